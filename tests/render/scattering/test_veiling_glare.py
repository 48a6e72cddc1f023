"""The veiling glare index: closed forms where nothing blocks, and forward random rays where edges do."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from flarewright.kernels.montecarlo.forward import IN_PICTURE
from flarewright.model import (
    Bare,
    Camera,
    Everywhere,
    Iris,
    Lens,
    Light,
    Lines,
    Medium,
    Output,
    Project,
    Quality,
    Scatter,
    Standard,
    Stop,
    Surface,
)
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_paths
from flarewright.optics.rays.pack import pack_lens
from flarewright.optics.scattering import veiling_glare as surround
from flarewright.optics.scattering.veiling_glare import from_surround, object_nearness
from flarewright.render.reference.batches import Sums, ray_source, run_batch
from flarewright.render.render import render
from flarewright.render.scattering import veiling_glare as glare_module
from flarewright.render.scattering.veiling_glare import veiling_glare
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import complete_lens, load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

NM = 587.56
ANYWHERE = (Light(field_deg=(0.0, 0.0)),)


def wide(lenses):
    """Weak singlets whose edges block nothing; the stop is behind them, so rays from the sensor meet it first."""
    rows = []
    for _ in range(lenses):
        rows += [
            Surface(curvature=0.004, thickness=12.0, medium=Medium(n_d=1.6, v_d=60.0), semi_diameter=60.0),
            Surface(curvature=-0.004, thickness=8.0, semi_diameter=60.0),
        ]
    return complete_lens(Lens(name="wide", f_number=20.0, field_deg=0.02, rows=(*rows, Stop(thickness=60.0))))


def packed(lens, wavelength_nm=NM):
    order = first_order(lens)
    return pack_lens(lens, order, (None,) * len(lens.rows), np.array([wavelength_nm]))


@pytest.mark.parametrize("lenses", [1, 2])
def test_where_nothing_blocks_ghosts_add_up_reflectances(lenses):
    """All paths see the surround through one stop: R_j R_i of the direct light, times T of the surfaces between."""
    lens = wide(lenses)
    pack = packed(lens)
    paths = ghost_paths(lens)
    (direct, _), *ghosts = from_surround(lens, pack, [direct_path(lens), *paths], 0.0)
    R = ((1.6 - 1.0) / (1.6 + 1.0)) ** 2
    parts = [R * R * (1.0 - R) ** (2 * (path.first_reflection - path.second_reflection - 1)) for path in paths]
    for (everywhere, beyond), part in zip(ghosts, parts, strict=True):
        assert everywhere / direct == pytest.approx(part, rel=0.01)
        assert beyond == everywhere
    reported = veiling_glare(Project(lens=lens, lights=ANYWHERE), NM)
    assert reported.index == pytest.approx(sum(parts) / (1.0 + sum(parts)), rel=0.01)
    assert (reported.scatter, reported.blur) == (0.0, pytest.approx(0.0, abs=1e-3))


def test_without_reflections_the_image_of_an_even_surround_is_pi_sine_squared():
    """Lambert's law on the axis, at f/2, where the squared sine is 3 % less than slopes alone would give."""
    lens = complete_lens(wide(1).model_copy(update={"f_number": 2.0}))
    pack = packed(lens)
    dark = replace(pack, reflectance=np.zeros_like(pack.reflectance))
    radius, distance = pack.stop_semi, pack.sensor_z - pack.z_vertex[-1]
    sine2 = radius**2 / (radius**2 + distance**2)
    assert sine2 > 0.05
    assert from_surround(lens, dark, [direct_path(lens)], 0.0)[0, 0] == pytest.approx(pi * sine2, rel=1e-3)


def test_without_reflections_there_is_no_glare():
    lens = wide(2)
    pack = packed(lens)
    dark = replace(pack, reflectance=np.zeros_like(pack.reflectance))
    assert (from_surround(lens, dark, ghost_paths(lens), 0.01) == 0.0).all()
    assert from_surround(lens, dark, [direct_path(lens)], 0.01)[0, 0] > 0.0


def test_where_nothing_blocks_scatter_adds_up_totals():
    lens = wide(1)
    polish = Scatter(model="harvey-shack", roughness_nm=4.0, correlation_um=4.0, slope=5.0)
    reported = veiling_glare(Project(lens=lens, lights=ANYWHERE, scatter=polish), NM)
    total = 1.0 - np.exp(-((2.0 * pi * 0.6 * 4.0 / NM) ** 2))
    # per surface, relative to the remaining direct light and to all light
    expected = 2.0 * total / (1.0 + reported.ghosts)
    assert reported.scatter == pytest.approx(expected, rel=0.02)


def test_white_is_what_a_render_says_of_an_extended_scene():
    coating = Everywhere(coating=Standard(name="modern-broadband"))
    project = Project(lens="triplet-pestrecov", f_number=8.0, lights=ANYWHERE, coating=coating)
    reported = veiling_glare(project, NM)
    light = Light(field_deg=(0.0, 0.0), spectrum=Lines(lines=((NM, 1.0),)))
    drawn = render(
        project.replace(
            lights=(light,), camera=Camera(size_px=(8, 8)), output=Output(starburst=False),
            quality=Quality(mode="draft", wavelengths=1),
        )
    )  # fmt: skip
    scene = drawn.summary["scene_irradiance_per_radiance"]
    assert reported.white * (1.0 - reported.index) == pytest.approx(scene, rel=0.02)


def test_against_random_rays_from_all_sides():
    """Forward: lights over the hemisphere, and the light of their ghosts on a patch in the centre of the picture."""
    lens = load_lens("triplet-pestrecov")
    side = 6.0
    common = {"lens": lens, "f_number": 4.0, "coating": Everywhere(coating=Bare()), "iris": Iris()}
    nodes, weights = np.polynomial.legendre.leggauss(16)
    angles = 0.5 * np.radians(80.0) * (nodes + 1.0)
    ghosts, variance = 0.0, 0.0
    for angle, weight in zip(angles, 0.5 * np.radians(80.0) * weights, strict=True):
        light = Light(field_deg=(float(np.degrees(angle)), 0.0), spectrum=Lines(lines=((NM, 1.0),)))
        project = Project(
            **common, lights=(light,), camera=Camera(size_px=(4, 4), sensor_mm=(side, side)),
            quality=Quality(wavelengths=1, bridge=False),
        )  # fmt: skip
        settled = resolve_project(project)
        shot = make_shots(settled, make_opening(settled, None))[0]
        source, sums = ray_source(shot, 0, side=48, light=0), Sums(0, {}, {})
        for batch in range(12):
            sums.add(run_batch([source], batch, picture=False))
        # radiance 1 from a ring of directions; the flux contains the shot's cosine
        ring = 2.0 * pi * np.sin(angle) * weight / side**2
        ghosts += ring * sums.mean("figures")[IN_PICTURE + 1]
        variance += ring**2 * sums.variance("figures")[IN_PICTURE + 1]
    settled = resolve_project(
        Project(**common, lights=(Light(field_deg=(0.0, 0.0), spectrum=Lines(lines=((NM, 1.0),))),))
    )
    pack = make_shots(settled, make_opening(settled, None))[0].packed
    mine = from_surround(settled.lens, pack, ghost_paths(settled.lens), 0.0)[:, 0].sum()
    # the patch is not a point, and the ghosts are not uniform over it
    assert abs(mine / ghosts - 1.0) < 0.03 + 4.0 * np.sqrt(variance) / ghosts < 0.12


def test_general_surfaces_see_the_same():
    lens = load_lens("triplet-pestrecov")
    rows = list(lens.rows)
    rows[0] = rows[0].replace(asphere=(1e-15,))
    plain, general = (
        veiling_glare(Project(lens=a, lights=ANYWHERE), NM).index for a in (lens, lens.replace(rows=tuple(rows)))
    )
    assert general == pytest.approx(plain, rel=1e-6)


@pytest.fixture
def few_rays(monkeypatch):
    """Fewer directions and rays, for properties that do not depend on the accuracy of the index."""
    for name, value in (("INNER_NODES", 3), ("OUTER_NODES", 5), ("RAYS", 6)):
        monkeypatch.setattr(glare_module, name, value)
    for name, value in (("COARSE", 32), ("FINE", 32), ("DIRECT", 64)):
        monkeypatch.setattr(surround, name, value)


@pytest.mark.parametrize(
    "dirt",
    [{"roughness_nm": 8.0}, pytest.param({"cleanliness_level": 300.0}, marks=pytest.mark.slow)],
    ids=["polish", "dust"],
)
def test_coating_and_polish_change_it(dirt, request):
    if "cleanliness_level" not in dirt:
        request.getfixturevalue("few_rays")
    lens = "double-gauss-tronnier" if "cleanliness_level" in dirt else "tessar-brendel"
    bare = Project(lens=lens, lights=ANYWHERE, coating=Everywhere(coating=Bare()))
    coated = bare.replace(coating=Everywhere(coating=Standard(name="modern-broadband")))
    dusty = coated.replace(scatter=Scatter(model="harvey-shack", **dirt))
    one, two, three = (veiling_glare(project, NM) for project in (bare, coated, dusty))
    assert 0.02 < one.index < 0.15
    assert two.index < 0.02 * one.index
    assert three.ghosts == pytest.approx(two.ghosts, rel=0.02)
    assert three.index > 5.0 * two.index


def test_threads_do_not_matter(few_rays):
    project = Project(lens=wide(1), lights=ANYWHERE, scatter=Scatter(model="abg"))
    assert veiling_glare(project, NM, threads=1) == veiling_glare(project, NM, threads=3)


def test_the_plane_in_focus():
    lens = load_lens("triplet-pestrecov")
    assert object_nearness(packed(lens), lens) == 0.0
    order = first_order(lens, focus_distance=700.0)
    near = pack_lens(lens, order, (None,) * len(lens.rows), np.array([NM]))
    assert object_nearness(near, lens) == pytest.approx(1.0 / 700.0, rel=1e-4)
    # focused near, the patch lies as far from the blur
    reported = veiling_glare(Project(lens=lens, lights=ANYWHERE, camera=Camera(focus_distance=700.0)), NM)
    assert reported.blur == 0.0
