"""A light at a finite distance: limits, Gauss' equation, the inverse square law, and two other tracers."""

import re
from math import cos, hypot, pi, radians, sqrt, tan

import numpy as np
import pytest
from judge import judge, probabilities
from oracle import trace
from prescriptions import HELIAR, lens, system

from flarewright.errors import ProjectError
from flarewright.model import Camera, Iris, Light, Lines, Output, Project, Quality, Starburst
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order, path_matrices
from flarewright.optics.lens.paths import direct_path, ghost_path
from flarewright.optics.rays.bundle import incidence, trace_points
from flarewright.optics.rays.ghost_table import GhostQuery
from flarewright.optics.rays.pack import facing, pack_lens
from flarewright.optics.rays.pupil_region import front_box
from flarewright.render.analysis import find_ghosts, ghosts
from flarewright.render.reference.energy_ledger import trace_ledger
from flarewright.render.render import render
from flarewright.render.scene.direct_image import defocus_mm, direct_image, traced_spot
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

D_LINE = Lines(lines=((587.56, 1.0),))


def project(distance, field=(8.0, 5.0), name="heliar-tronnier", f_number=8.0, light=None, **parts):
    return Project(
        lens=name,
        f_number=f_number,
        iris=Iris(),
        lights=(Light(field_deg=field, distance=distance, spectrum=D_LINE, **(light or {})),),
        camera=Camera(size_px=parts.pop("size", (192, 120)), **parts.pop("camera", {})),
        quality=Quality(wavelengths=1, bridge=False, ringing="off", **parts.pop("quality", {})),
        output=Output(**parts),
    )


def shot_of(made):
    settled = resolve_project(made)
    return settled.lens, make_shots(settled, make_opening(settled, None))[0]


def test_rays_are_those_that_the_oracle_traces_one_by_one():
    s, a_lens = system(HELIAR, 4.5), lens(HELIAR, 4.5)
    order = first_order(a_lens)
    packed = pack_lens(a_lens, order, (None,) * len(a_lens.rows), np.array([D_LINE_NM]))
    seen = incidence((7.0, 4.0), 150.0, order.entrance_pupil_z)
    packed = facing(packed, seen.axes, seen.nearness)
    # position of the light, from its angles at the entrance pupil
    to_pupil = 150.0 + order.entrance_pupil_z
    place = np.array([to_pupil * tan(radians(7.0)), to_pupil * tan(radians(4.0)), -150.0])
    x, y = np.random.default_rng(3).uniform(-9.0, 9.0, (2, 24))
    for rows in (None, (4, 1), (8, 7)):
        path = direct_path(a_lens) if rows is None else ghost_path(a_lens, *rows)
        data = trace_points(packed, 0, path, seen.tilt, np.stack([x, y], axis=1) @ seen.axes.T)
        landed = data[:, 0:2] @ seen.axes
        for k in range(x.size):
            ray = np.array([x[k], y[k], 0.0]) - place
            field = tuple(np.degrees(np.arctan2(-ray[:2], ray[2])))
            slow = trace(s, rows, x[k : k + 1], y[k : k + 1], field)
            assert bool(data[k, 4] > 0.0) == bool(slow.alive[0])
            if slow.alive[0]:
                assert landed[k] == pytest.approx((-slow.x[0], -slow.y[0]), abs=1e-9)
                # cosine over squared distance, relative to the ray through the vertex
                fall = (np.linalg.norm(place) / np.linalg.norm(ray)) ** 3
                assert data[k, 2] == pytest.approx(slow.weight[0, 0] * fall, rel=1e-4)


@pytest.mark.parametrize("mode", ["final", "draft"])
def test_a_far_light_is_a_distant_light(mode):
    far, distant = (render(project(d, quality={"mode": mode})) for d in (1e8, None))
    for name in ("ghosts", "starburst"):
        one, other = (next(layer for layer in r.layers if layer.name == name).pixels for r in (far, distant))
        assert one.shape == other.shape
        assert np.abs(one - other).sum() < 3e-3 * other.sum()
    for one, other in zip(far.summary["lights"], distant.summary["lights"], strict=True):
        assert one["direct_position_mm"] == pytest.approx(other["direct_position_mm"], abs=1e-5)


@pytest.mark.parametrize("distance", [250.0, 1500.0])
def test_a_light_in_the_plane_of_focus_is_imaged_where_gauss_says(distance):
    made = project(distance, field=(0.6, 0.4), f_number=32.0, camera={"focus_distance": distance})
    a_lens, shot = shot_of(made)
    assert defocus_mm(a_lens, shot) == pytest.approx(0.0, abs=1e-9)
    order = shot.packed.first_order
    # Newton's equation: magnification f / x from the front focus
    last = float(shot.packed.z_vertex[-1])
    _, ((_, _), (c, d)) = path_matrices(a_lens, direct_path(a_lens), D_LINE_NM, last)
    x = distance + d / c
    heights = [(distance + order.entrance_pupil_z) * tan(radians(angle)) for angle in (0.6, 0.4)]
    image = direct_image(a_lens, shot)
    assert image.position_mm == pytest.approx([order.efl / x * h for h in heights], rel=2e-4)
    spot = traced_spot(a_lens, shot)
    assert spot.sum() == pytest.approx(1.0, abs=1e-6)
    assert max(spot.shape) <= 5


def test_out_of_focus_a_light_is_a_disc_as_wide_as_gauss_says():
    made = project(600.0, field=(0.0, 0.0), f_number=16.0, size=(960, 600))
    a_lens, shot = shot_of(made)
    order = shot.packed.first_order
    last = float(shot.packed.z_vertex[-1])
    _, ((_, _), (c, d)) = path_matrices(a_lens, direct_path(a_lens), D_LINE_NM, last)
    # the image lies f^2 / x behind the focus; the cone's slope follows from its aperture
    shift = order.efl**2 / (600.0 + d / c)
    slope = 0.5 * order.exit_pupil_diameter / (last + order.bfl + shift - order.exit_pupil_z)
    width = 2.0 * slope * shift
    assert defocus_mm(a_lens, shot) == pytest.approx(width, rel=1e-6)
    spot = traced_spot(a_lens, shot)
    pixel = 1.0 / float(shot.to_pixels[2])
    # spherical aberration changes the area of a disc a little
    area = (spot > 0.5 * np.median(spot[spot > 0.0])).sum() * pixel**2
    assert sqrt(4.0 * area / pi) == pytest.approx(width, rel=0.02)
    rendering = render(made)
    assert any("out of focus" in remark for remark in rendering.remarks)
    starburst = next(layer for layer in rendering.layers if layer.name == "starburst")
    flux = float((starburst.pixels.sum(axis=(0, 1), dtype=np.float64) * pixel**2) @ luminance_weights("rec709"))
    assert flux == pytest.approx(rendering.summary["lights"][0]["direct_throughput_mm2"][0], rel=5e-3)
    # the light of a disc spreads over its area
    assert (starburst.pixels @ luminance_weights("rec709")).max() < 1.3 * flux / area


@pytest.mark.parametrize("distance", [40.0, pytest.param(400.0, marks=pytest.mark.slow)])
def test_what_enters_is_the_solid_angle_of_the_front(distance):
    """On the axis a light of intensity 1 at the entrance pupil has the power R^2 per steradian."""
    _, shot = shot_of(project(distance, field=(0.0, 0.0)))
    packed = shot.packed
    semi, c = float(packed.semi[0]), float(packed.curvature[0])
    sag = (1.0 - sqrt(1.0 - (c * semi) ** 2)) / c
    solid = 2.0 * pi * (1.0 - cos(np.arctan2(semi, distance + sag)))
    ledger = trace_ledger([shot], 1, threads=1)
    power = (distance + packed.first_order.entrance_pupil_z) ** 2
    assert ledger.entered_mm2 == pytest.approx(power * solid, rel=2e-3)
    assert ledger.total.share == pytest.approx(1.0, abs=1e-3)


def test_irradiance_at_the_entrance_pupil_is_what_the_light_says():
    """A small opening receives intensity times its area, at any distance of the light."""
    for distance, field in ((60.0, (0.0, 0.0)), (600.0, (0.0, 0.0)), (60.0, (2.0, 1.0)), (None, (2.0, 1.0))):
        a_lens, shot = shot_of(project(distance, field=field, f_number=64.0))
        image = direct_image(a_lens, shot)
        cosine = 1.0 / hypot(1.0, tan(radians(field[0])), tan(radians(field[1])))
        area = 0.25 * pi * shot.packed.first_order.entrance_pupil_diameter**2
        # seen at an angle, the pupil differs slightly from the paraxial one
        close = 1e-3 if field == (0.0, 0.0) else 5e-3
        assert float(image.throughput_mm2[0]) == pytest.approx(area * cosine * image.transmittance, rel=close)


def test_every_tracer_agrees_on_a_lens_without_symmetry():
    """The general tracer, with the whole pupil, gives the light of the vector lanes with half of it."""
    plain = project(180.0, f_number=5.6)
    a_lens, shot = shot_of(plain)
    rows = list(a_lens.rows)
    # too small to move anything, but the lens is no longer rotationally symmetric
    rows[2] = rows[2].replace(decentre=(1e-12, 0.0))
    _, other = shot_of(plain.replace(lens=a_lens.replace(rows=tuple(rows))))
    assert (shot.packed.halves, other.packed.halves) == (2, 1)
    box, wide = front_box(shot.packed, shot.incidence.tilt), front_box(other.packed, shot.incidence.tilt)
    assert wide[0] < -0.99 * box[1]
    one, two = (direct_image(a_lens, s) for s in (shot, other))
    assert one.throughput_mm2 == pytest.approx(two.throughput_mm2, rel=1e-3)
    assert one.position_mm == pytest.approx(two.position_mm, abs=1e-3)


def test_the_box_holds_all_light_that_reaches_the_front():
    """Rays from the light to edge and vertex cross the first plane within the box, also for a fisheye."""
    for name, field, distance in (("heliar-tronnier", (20.0, 0.0), 30.0), ("fisheye-nikkor-10.5", (70.0, 0.0), 200.0)):
        _, shot = shot_of(project(distance, field=field, name=name, f_number=None))
        packed, tilt = shot.packed, shot.incidence.tilt
        semi, c = float(packed.semi[0]), float(packed.curvature[0])
        light = np.array([0.0, -np.sin(tilt), -np.cos(tilt)]) / packed.nearness
        r, angle = np.meshgrid(semi * np.sqrt(np.linspace(0.0, 1.0, 60)), np.linspace(0.0, 2.0 * pi, 121))
        on = np.stack([r * np.cos(angle), r * np.sin(angle), c * r**2 / (1.0 + np.sqrt(1.0 - (c * r) ** 2))], axis=-1)
        at = light + (on - light) * (-light[2] / (on[..., 2] - light[2]))[..., None]
        x0, x1, y0, y1 = front_box(packed, tilt)
        assert x0 == 0.0
        assert np.abs(at[..., 0]).max() <= x1
        assert y0 <= at[..., 1].min()
        assert at[..., 1].max() <= y1


@pytest.mark.parametrize(("batches", "layers"), [(16, "passes"), pytest.param(64, "ghosts", marks=pytest.mark.slow)])
def test_final_quality_agrees_with_the_reference_on_a_near_light(batches, layers):
    made = project(160.0, field=(9.0, 4.0), f_number=4.5, layers=layers, starburst=False)
    judged = judge(made, batches=batches, side=64 if batches > 16 else 48)
    everywhere, worst = probabilities(judged)
    assert min(everywhere, worst) > 1e-4
    final, mean, error = judged.total
    assert abs(final - mean) < 2e-3 * mean + 4.0 * error


def test_draft_quality_follows_the_light_too():
    """On the axis and stopped down, matrices and traced rays give the same ghosts; both depend on the distance."""
    flux = {}
    for distance in (None, 120.0):
        for mode in ("final", "draft"):
            made = project(distance, field=(0.5, 0.0), f_number=22.0, quality={"mode": mode}, starburst=False)
            ghosts = next(layer for layer in render(made).layers if layer.name == "ghosts")
            flux[mode, distance] = ghosts.pixels.sum(dtype=np.float64)
    ratio = {mode: flux[mode, 120.0] / flux[mode, None] for mode in ("final", "draft")}
    assert ratio["draft"] == pytest.approx(ratio["final"], rel=0.01)
    assert abs(ratio["final"] - 1.0) > 0.03


def test_a_light_in_the_lens_is_refused():
    """The edge of a concave front lies before its vertex; a convex front allows near lights."""
    a_lens, _ = shot_of(project(None, name="canon-28-80", f_number=None))
    rows = list(a_lens.rows)
    rows[0] = rows[0].replace(curvature=-0.02 * rows[0].curvature)
    hollow = a_lens.replace(rows=tuple(rows))
    semi = rows[0].semi_diameter
    sag = 0.5 * abs(rows[0].curvature) * semi**2
    with pytest.raises(ProjectError, match=r"lights\[0\].distance: a light at .* stands in the lens"):
        shot_of(project(0.9 * sag, f_number=None).replace(lens=hollow))
    with pytest.raises(ProjectError, match=r"a light at .* stands in the lens"):
        ghosts(hollow, (0.0, 0.0), distance=0.9 * sag)
    for near, whole in ((1.2 * sag, hollow), (0.9 * sag, a_lens)):
        shot_of(project(near, f_number=None).replace(lens=whole))


def test_the_distances_in_a_message_count_from_the_lens_as_the_given_one_does():
    """They used to count from a filter in front, so that the stated remedy was refused too."""
    a_lens, _ = shot_of(project(None, name="canon-28-80", f_number=None))
    rows = list(a_lens.rows)
    rows[0] = rows[0].replace(curvature=-0.02 * rows[0].curvature)
    settled = resolve_project(
        project(None, f_number=None).replace(lens=a_lens.replace(name="hollow", rows=tuple(rows)))
    )
    query = GhostQuery((0.0, 0.0), 1e-3, D_LINE_NM, "all")
    said = []
    for ahead in (0.0, 8.0):
        with pytest.raises(ProjectError) as refused:
            find_ghosts(settled.lens, settled.order, settled.coating, query, ahead=ahead)
        said.append([float(text) for text in re.findall(r"([0-9.]+) mm", str(refused.value))])
    # the least distance has four digits
    assert said[1] == pytest.approx([distance + 8.0 for distance in said[0]], abs=2e-3)


@pytest.mark.parametrize("cats_eye", [False, True])
def test_the_diffraction_pattern_grows_with_the_distance_of_the_image(cats_eye):
    """At a magnification of one a lens works at twice its f-number (physics.md: x = u lambda z)."""
    made = project(
        200.0,
        field=(0.0, 0.0),
        f_number=32.0,
        size=(161, 121),
        camera={"focus_distance": 200.0, "sensor_mm": (0.23, 0.1729)},
    )
    made = made.replace(starburst=Starburst(cats_eye=cats_eye))
    star = next(layer for layer in render(made).layers if layer.name == "starburst").pixels.sum(axis=2)
    rows, columns = np.mgrid[:121, :161]
    away = np.hypot(columns - 80, rows - 60) * 0.23 / 161
    edges = np.arange(0.0, 0.07, 0.002)
    profile = [star[(away >= low) & (away < low + 0.002)].mean() for low in edges]
    first = next(k for k in range(1, len(profile) - 1) if profile[k] < profile[k + 1])
    assert edges[first] + 0.001 == pytest.approx(1.2197 * 587.56e-6 * 32.0 * 2.0, rel=0.06)
