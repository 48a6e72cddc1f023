"""Rays from the sensor and from the light give the same ghosts of an area light: z-test with both variances."""

import numpy as np
import pytest
from PIL import Image
from scipy import stats

from flarewright.io.render_state.reference_state import read_reference_state
from flarewright.kernels.montecarlo.forward import BESIDE, IN_PICTURE
from flarewright.model import Camera, Holdout, Light, Lines, Output, Polygon, Project, Quality, Rectangle
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.optics.pupil.polygon import closed, solid_angle
from flarewright.render.reference import batches as batch_module
from flarewright.render.reference import camera_rays, energy_ledger, estimator
from flarewright.render.reference.batches import Sums, ray_source, run_batch, spectrum_of
from flarewright.render.reference.estimator import ReferenceRun
from flarewright.render.reference.ray_generation import reference_rays
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

D_LINE = Lines(lines=((587.56, 1.0),))
SIZE = (96, 64)


def light(field=(6.0, 4.0), **how):
    return Light(field_deg=field, spectrum=D_LINE, **how)


def project(lamp, lens="triplet-pestrecov", camera=None, quality=None, **how):
    return Project(
        lens=lens,
        f_number=8.0,
        lights=(lamp,),
        camera=Camera(size_px=SIZE, **(camera or {})),
        quality=Quality(wavelengths=1, bridge=False, ringing="off", **{"source_step_deg": 30.0, **(quality or {})}),
        output=Output(starburst=False),
        **how,
    )


def shots_of(made):
    settled = resolve_project(made)
    return make_shots(settled, make_opening(settled, None))


def from_light(shots, batches=16, side=64):
    sources = [ray_source(shot, 0, side=side, light=k) for k, shot in enumerate(shots)]
    sums = Sums(0, {}, {})
    for batch in range(batches):
        result = run_batch(sources, batch, picture=True)
        orders = result["figures"][IN_PICTURE:BESIDE]
        sums.add({"orders": orders, "blocks": result["blocks"][0], "paths": result["paths"][0]})
    return sums


def from_camera(shots, batches=16, count=8192):
    source = camera_rays.camera_source(shots, *spectrum_of(shots[0], 1.0, 0), count=count, light=0)
    rows = len(shots[0].packed.curvature)
    sums = Sums(0, {}, {})
    for batch in range(batches):
        planes, paths = np.zeros((2, 3, SIZE[1], SIZE[0]), dtype=np.float32), np.zeros((2, rows, rows))
        orders = camera_rays.run_camera(source, batch, planes, paths)
        two = np.tensordot(luminance_weights("rec709"), planes[0].astype(np.float64), 1)
        blocks = two.reshape(SIZE[1] // 16, 16, SIZE[0] // 16, 16).sum(axis=(1, 3))
        sums.add({"orders": orders, "blocks": blocks, "paths": paths[0]})
    return sums


def agree(one, other, name, dim=0.0):
    """Return the probability of the worst difference, over values with known errors above `dim` of the largest."""
    a, b = one.mean(name), other.mean(name)
    variance = one.variance(name) + other.variance(name)
    known = (variance > 0.0) & (np.maximum(a, b) > dim * max(a.max(), b.max()))
    z = (a - b)[known] / np.sqrt(variance[known])
    return 2.0 * z.size * stats.t.sf(np.abs(z).max(), one.batches - 1)


def cylindrical():
    """Return the triplet with a front surface that differs between the meridians."""
    lens = load_lens("triplet-pestrecov")
    return lens.replace(
        rows=(lens.rows[0].replace(curvature_x=0.85 * lens.rows[0].curvature), *lens.rows[1:]), sensor_distance=None
    )


CASES = {
    "disc": (light(diameter_deg=8.0), {}),
    "wide rectangle": (light((10.0, 0.0), shape=Rectangle(size_deg=(40.0, 25.0), rotation_deg=20.0)), {}),
    "in parts": (light(diameter_deg=12.0), {"quality": {"source_step_deg": 5.0}}),
    "near lamp": (light(diameter_deg=14.0, distance=250.0), {}),
    "sensor that reflects": (light(diameter_deg=10.0), {"camera": {"sensor_reflectance": 0.3}}),
    "anamorphic": (light((4.0, 2.0), diameter_deg=10.0), {"lens": "anamorphic-heliar-2x"}),
    "few surfaces, one of them cylindrical": (light((4.0, 2.0), diameter_deg=10.0), {"lens": cylindrical}),
    "beside the frame": (
        light((24.0, 0.0), shape=Polygon(corners_deg=((-6, -8), (6, -8), (6, 8), (0, 0), (-6, 8)))),
        {"lens": "flektogon-35"},
    ),
}


# a near lamp is a disc too; a wide rectangle has parts; rays from the camera cross surfaces of any shape by the code of
# rays from the light (tests/render/reference/test_shapes.py), which takes seconds to compile once more
LIKE_OTHERS = ("disc", "in parts", "anamorphic", "few surfaces, one of them cylindrical")
# points per side of the front, and points of the picture, where errors allow few
FEW = {
    "disc": (48, 4096),
    "wide rectangle": (32, 1024),
    "in parts": (16, 2048),
    "near lamp": (32, 1024),
    "sensor that reflects": (32, 1024),
    "anamorphic": (48, 1024),
    "few surfaces, one of them cylindrical": (32, 1024),
    "beside the frame": (64, 2048),
}


@pytest.mark.parametrize(
    ("name", "rays"),
    [
        pytest.param(name, rays, marks=pytest.mark.slow if rays == "many" or name in LIKE_OTHERS else ())
        for name in CASES
        for rays in ("few", "many")
    ],
)
def test_both_ways_agree(name, rays, monkeypatch):
    """Direct light, and two, four and more reflections in the picture; each block; each path."""
    lamp, how = CASES[name]
    if callable(how.get("lens")):
        how = {"lens": how["lens"]()}
    shots = shots_of(project(lamp, **how))
    side, count = (64 if len(shots) == 1 else 32, 8192) if rays == "many" else FEW[name]
    if rays == "few":
        # each direction costs as much as hundreds of rays
        monkeypatch.setattr(batch_module, "AIM_SIDE", 4)
    one, other = from_light(shots, side=side), from_camera(shots, count=count)
    assert agree(one, other, "orders") > 1e-3
    assert agree(one, other, "blocks", 0.2) > 1e-3
    assert agree(one, other, "paths", 0.02) > 1e-3
    # the test is sharp: two reflections are known to a few per cent
    for sums in (one, other):
        assert np.sqrt(sums.variance("orders")[1]) < 0.05 * sums.mean("orders")[1]


def test_the_corners_of_a_wide_picture_are_as_dark_from_both(monkeypatch):
    """Light from all directions on a sensor so large that cos^4 takes a third of it: the law of uniform light."""
    monkeypatch.setattr(batch_module, "AIM_SIDE", 4)
    lamp = light((0.0, 0.0), shape=Rectangle(size_deg=(70.0, 50.0)))
    shots = shots_of(project(lamp, "heliar-tronnier", camera={"sensor_mm": (150.0, 100.0)}))
    one, other = from_light(shots, side=32), from_camera(shots, count=1024)
    assert agree(one, other, "orders") > 1e-3
    # cos^2 instead would give 20 % more
    for sums in (one, other):
        assert np.sqrt(sums.variance("orders")[0]) < 0.02 * sums.mean("orders")[0]


def test_what_is_hidden_is_hidden_from_both(tmp_path, monkeypatch):
    monkeypatch.setattr(batch_module, "AIM_SIDE", 4)
    grey = np.tile(np.linspace(0.0, 255.0, SIZE[0]).astype(np.uint8), (SIZE[1], 1))
    grey[20:28] = 0
    Image.fromarray(grey).save(tmp_path / "m.png")
    shots = shots_of(project(light(diameter_deg=10.0), holdout=Holdout(image=str(tmp_path / "m.png"))))
    assert len(shots[0].border) > 100
    one, other = from_light(shots, side=32), from_camera(shots, count=2048)
    for name, dim in (("orders", 0.0), ("blocks", 0.2)):
        assert agree(one, other, name, dim) > 1e-3


@pytest.mark.parametrize(
    ("lens", "field", "f_number", "count"),
    [
        # light fills the rear only wide open, so that a disc 10 % too small is detected; at f/8 half of it suffices
        ("heliar-tronnier", (2.0, 1.0), None, 2048),
        pytest.param("tessar-brendel", (2.0, 1.0), None, 2048, marks=pytest.mark.slow),
        pytest.param("heliar-tronnier", (6.0, 4.0), 8.0, 16384, marks=pytest.mark.slow),
        pytest.param("canon-28-80", (6.0, 4.0), 8.0, 16384, marks=pytest.mark.slow),
    ],
)
def test_the_rear_disc_is_wide_enough(lens, field, f_number, count, monkeypatch):
    """A disc of twice the area gives the same light: no light came from outside."""
    shots = shots_of(project(light(field, diameter_deg=16.0), lens=lens).replace(f_number=f_number))
    one = from_camera(shots, count=count)
    with monkeypatch.context() as patch:
        patch.setattr(camera_rays, "DISC_MARGIN", 1.4)
        other = from_camera(shots, count=count)
    assert agree(one, other, "orders") > 1e-3


def test_solid_angles():
    """A square of half width a is 4 asin(a^2 / (1 + a^2)), and an octant of the sphere pi / 2."""
    for a in (0.01, 0.5, 3.0):
        square = closed(np.array([[-a, -a], [a, -a], [a, a], [-a, a]]))
        assert solid_angle(square) == pytest.approx(4.0 * np.arcsin(a * a / (1.0 + a * a)), rel=1e-12)
    far = closed(np.array([[0.0, 0.0], [1e9, 0.0], [0.0, 1e9]]))
    assert solid_angle(far) == pytest.approx(np.pi / 2.0, rel=1e-8)


def test_small_lights_are_traced_from_the_light_and_wide_ones_from_the_camera(monkeypatch):
    # few rays suffice for the decisions of the trial
    monkeypatch.setattr("flarewright.render.reference.ray_generation.TRIAL_SIDE", 32)
    wide = light((0.0, 0.0), shape=Rectangle(size_deg=(70.0, 50.0)))
    for lamp, of, ghost_target, expected in (
        (light(), "total", "camera", ()),
        (light(diameter_deg=0.53), "total", "auto", ()),
        (light(diameter_deg=4.0), "blocks", "auto", ()),
        (wide, "total", "auto", (0,)),
        (wide, "total", "light", ()),
        (light(diameter_deg=4.0), "blocks", "camera", (0,)),
    ):
        made = project(
            lamp, quality={"reference_error_of": of, "reference_from": ghost_target, "source_step_deg": 60.0}
        )
        rays = reference_rays(shots_of(made), made.quality, 128)
        assert rays.from_camera == expected
        assert all(source.drawn is not bool(expected) for source in rays.sources)


@pytest.mark.parametrize(
    ("side", "batches", "resumed"), [(32, 16, 12), pytest.param(128, 20, 5, marks=pytest.mark.slow)]
)
def test_a_picture_made_from_the_camera(side, batches, resumed, tmp_path, monkeypatch):
    """The same light with a point light beside it; resumed bit for bit, on any number of threads; ledger of both."""
    monkeypatch.setattr(estimator, "SIDE", side)
    if side < 128:
        monkeypatch.setattr(batch_module, "AIM_SIDE", 4)
        # a ledger is unbiased for any number of rays
        monkeypatch.setattr(energy_ledger, "SIDE", 16)
    lights = (light(diameter_deg=8.0), light((-3.0, 2.0), intensity=0.2))
    limits = {"mode": "reference", "reference_samples": batches * side**2}
    made = {
        ghost_target: project(lights[0], "heliar-tronnier", quality={**limits, "reference_from": ghost_target}).replace(
            lights=lights
        )
        for ghost_target in ("light", "camera")
    }
    found = {ghost_target: render(each, ledger=True, threads=2) for ghost_target, each in made.items()}
    facts = {ghost_target: each.summary["reference"] for ghost_target, each in found.items()}
    assert (facts["light"]["lights_from_camera"], facts["camera"]["lights_from_camera"]) == ([], [0])
    noise = [facts[ghost_target]["relative_standard_error"] for ghost_target in found]
    assert (
        abs(facts["camera"]["ghost_flux_mm2"] / facts["light"]["ghost_flux_mm2"] - 1.0) < 4.0 * np.hypot(*noise) < 0.1
    )
    assert any("traced from the sensor" in remark for remark in found["camera"].remarks)
    for each in found.values():
        assert each.ledger.total.share == pytest.approx(1.0, abs=2e-3)
    state = tmp_path / "a.state.npz"
    few = made["camera"].replace(quality=made["camera"].quality.replace(reference_samples=resumed * side**2))
    render(few, run=ReferenceRun(state_file=state), threads=1)
    again = render(made["camera"], run=ReferenceRun(resume=read_reference_state(state)), threads=1)
    for a, b in zip(found["camera"].layers, again.layers, strict=True):
        assert a.pixels.tobytes() == b.pixels.tobytes()
