"""Throughput between and beyond the traced wavelengths: against rays that are traced there; ends of a path's light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X
from flarewright.model import Camera, Light, Lines, Project, Quality
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.rays.bundle import Bundle, Refinement, trace_bundle, trace_grid, trace_points
from flarewright.optics.rays.path_reflectance import CURVE_NM
from flarewright.optics.rays.pupil_region import find_region, front_box, region_at_ends
from flarewright.render.ghosts import steep_ghosts
from flarewright.render.ghosts.final_pass import FinalPass
from flarewright.render.ghosts.matrix_flux import matrix_fluxes
from flarewright.render.ghosts.steep_ghosts import (
    ABRUPT_PART,
    bent_spectrum,
    ends,
    gaps_at_ends,
    interpolated_where_straight,
    light_up_to_its_end,
    within_gaps,
)
from flarewright.render.ghosts.traced_ghosts import find_final
from flarewright.render.scene.between_wavelengths import FINE_NM
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.path_color import areas_between, visible_rays
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shot import Shot, at_fine_wavelengths, seen_light
from flarewright.render.scene.shots import make_shots


def _grid(project: Project, name: str, *, fine: bool = False) -> tuple[Shot, FinalPass, Bundle]:
    """Return the shot of a project, a ghost, and its grid, both at more wavelengths if `fine`."""
    settled = resolve_project(project)
    (shot,) = make_shots(settled, make_opening(settled, None))
    (path,) = (path for path in ghost_paths(settled.lens) if path.name == name)
    own = at_fine_wavelengths(shot) if fine else shot
    item, opening = find_final(own, path), shot.opening
    detail = Refinement(float(shot.to_pixels[2]), view_radius=item.view_radius)
    tilt, radii = shot.incidence.tilt, (opening.radius, opening.inner)
    return shot, item, trace_grid(own.packed, path, tilt, radii, item.region, detail)


@pytest.mark.parametrize("name", ["13-0", "4-1", "13-3"])
def test_interpolated_rays_pass_where_traced_ones_do(name):
    project = Project(
        lens="takumar-50-f1.4", f_number=4.0, lights=(Light(field_deg=(-9.0, 5.0)),), camera=Camera(size_px=(96, 54)),
        quality=Quality(mode="final", wavelengths=7),
    )  # fmt: skip
    shot, item, bundle = _grid(project, name)
    tilt = shot.incidence.tilt
    fine, seen = at_fine_wavelengths(shot).packed, visible_rays(shot, item.to_pixels, bundle.halves)
    alone = replace(bundle, traced={})
    a, b, c = np.moveaxis(bundle.pupil[bundle.triangles], 1, 0)
    triangle = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    third = np.bincount(bundle.triangles.ravel(), np.repeat(triangle / 3.0, 3), len(bundle.pupil))
    traced = [sum(third[half(trace_bundle(fine, w, alone, tilt))].sum() for half in seen) for w in range(len(FINE_NM))]
    found = areas_between(shot, bundle, FINE_NM, item.to_pixels)
    # of the three, one rises to 2.4 times its first value, two fall to a sixth and a fifth
    assert np.abs(found - traced).max() < 0.05 * max(traced)
    assert max(traced) > 1.15 * min(traced)
    # nothing is interpolated at the wavelengths of the grid
    held = sorted(bundle.traced)
    at_held = areas_between(shot, bundle, shot.packed.wavelengths_nm[held], item.to_pixels)
    np.testing.assert_allclose(at_held, [sum(third[half(bundle.traced[w])].sum() for half in seen) for w in held])


@pytest.mark.parametrize(
    ("lens", "f_number", "field", "name"),
    [
        ("canon-28-80", 8.0, (10.0, 5.0), "14-0"),
        ("canon-28-80", 8.0, (10.0, 5.0), "27-22"),
        ("takumar-50-f1.4", 4.0, (-9.0, 5.0), "13-0"),
    ],
)
def test_few_traced_and_drawn_wavelengths_give_the_colours_of_all(monkeypatch, lens, f_number, field, name):
    project = Project(
        lens=lens, f_number=f_number, lights=(Light(field_deg=field),), camera=Camera(size_px=(640, 360)),
        quality=Quality(mode="final", wavelengths=3),
    )  # fmt: skip
    shot, item, grid = _grid(project, name, fine=True)

    def color() -> np.ndarray:
        return bent_spectrum(shot, item.shot, grid, None, item.to_pixels).passed @ seen_light(shot)

    few = color()
    monkeypatch.setattr(steep_ghosts, "RAY_STRIDE", 1)
    monkeypatch.setattr(steep_ghosts, "BEND", -1.0)
    every = color()
    plain = np.ones(len(CURVE_NM)) @ seen_light(shot)
    assert np.abs(few - every).max() < 0.005 * np.abs(every).max()
    assert np.abs(plain - every).max() > 0.02 * np.abs(every).max()


@pytest.mark.parametrize(
    ("lens", "f_number", "field"), [("takumar-50-f1.4", 4.0, (-9.0, 5.0)), ("canon-70-200", 5.6, (4.0, 3.0))]
)
def test_light_at_the_ends_of_the_spectrum_is_found_around_that_between(lens, f_number, field):
    """Every ray of a dense grid over the front that passes at an end lies in it, and many outside the known part."""
    project = Project(
        lens=lens, f_number=f_number, lights=(Light(field_deg=field),), quality=Quality(mode="final", wavelengths=3)
    )
    settled = resolve_project(project)
    (shot,) = make_shots(settled, make_opening(settled, None))
    fine, tilt, radius = at_fine_wavelengths(shot).packed, shot.incidence.tilt, shot.opening.radius
    box = front_box(fine, tilt)
    x, y = np.meshgrid(np.linspace(*box[:2], 100), np.linspace(*box[2:], 200), indexing="ij")
    pupil = np.stack([x, y], axis=2).reshape(-1, 2)
    searched, found, outside = 0, 0, {"known": 0, "found": 0}
    for path in ghost_paths(settled.lens)[::3]:
        search = (path, tilt, radius, shot.view_radius)
        if (known := find_region(shot.packed, *search)) is None:
            continue
        searched += 1
        _, right, low, high = known.box
        # light goes on beyond a part that is far too small
        part = replace(known, box=np.array([0.0, right, low, low + 0.4 * (high - low)]))
        assert region_at_ends(fine, *search, part) is None
        # the known part has some room at its sides
        part = replace(known, box=np.array([0.0, 0.9 * right, 0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high]))
        if (region := region_at_ends(fine, *search, part)) is None:
            continue
        found += 1
        for w in (0, len(FINE_NM) - 1):
            rays = trace_points(fine, w, path, tilt, pupil)
            passing = (rays[:, ALIVE] > 0.0) & (rays[:, REL] <= 1.0)
            for crossing in range(path.stop_crossings):
                passing &= np.hypot(*rays[:, STOP_X + 2 * crossing :][:, :2].T) <= radius
            for name, own in (("known", part.box), ("found", region.box)):
                outside[name] += int(((pupil < own[0::2]) | (pupil > own[1::2])).any(axis=1)[passing].sum())
    assert found > 0.8 * searched > 0
    assert outside["known"] > outside["found"] == 0


def test_a_curve_is_computed_where_it_bends():
    """Light that begins like a square root, and a smooth curve: both within a part of the largest value."""
    asked: list[int] = []

    def root(w: int) -> float:
        asked.append(w)
        return float(np.sqrt(max(FINE_NM[w] - 500.0, 0.0)))

    found = interpolated_where_straight(FINE_NM, root, 5e-3)
    exact = np.sqrt(np.maximum(FINE_NM - 500.0, 0.0))
    assert np.abs(found - exact).max() < 5e-3 * exact.max()
    # every other, and those beside the beginning
    assert set(asked) >= {*range(0, 22, 2), 21, 9, 11}
    assert len(asked) == len({*asked}) < 17
    asked.clear()
    # not even those
    sine = interpolated_where_straight(FINE_NM, lambda w: asked.append(w) or 1.0 + np.sin(FINE_NM[w] / 80.0), 5e-2)
    assert sorted(asked) == [*range(0, 22, 2), 21]
    # the remainder of a cubic, largest at 720 nm between 630, 690, 755 and 800 nm
    assert np.abs(sine - 1.0 - np.sin(FINE_NM / 80.0)).max() < 90.0 * 30.0 * 35.0 * 80.0 / 24.0 / 80.0**4
    asked.clear()
    assert (interpolated_where_straight(FINE_NM, root, -1.0) == exact).all()
    assert asked == [*range(22)]


def test_lines_are_all_traced(monkeypatch):
    light = Light(field_deg=(-9.0, 5.0), spectrum=Lines(lines=((436.0, 1.0), (546.0, 1.0), (650.0, 1.0), (656.0, 1.0))))
    project = Project(
        lens="takumar-50-f1.4", f_number=4.0, lights=(light,), camera=Camera(size_px=(640, 360)),
        quality=Quality(mode="final", wavelengths=3),
    )  # fmt: skip
    shot, item, grid = _grid(project, "13-0", fine=True)
    few = bent_spectrum(shot, item.shot, grid, None, item.to_pixels).passed
    monkeypatch.setattr(steep_ghosts, "lagrange", None)
    assert (bent_spectrum(shot, item.shot, grid, None, item.to_pixels).passed == few).all()
    assert np.ptp(few) > 0.05


def test_wavelengths_are_added_where_light_ends():
    nm = np.array([400.0, 420.0, 440.0, 460.0, 480.0, 500.0])
    throughput = np.array([
        [1.0, 0.9, 0.8, 0.7, 0.6, 0.5],
        [0.0, 0.0, 0.0, 0.6, 0.8, 1.0],
        [0.3, 0.2, 0.1, 0.02, 0.0, 0.0],
    ])  # fmt: skip
    rises, falls = ends(throughput, ABRUPT_PART)
    assert np.argwhere(rises).tolist() == [[1, 2]]
    assert not falls.any()
    # the gap that holds the end, and the next on its bright side
    within = np.arange(442.5, 480.0, 2.5)
    assert (
        CURVE_NM[within_gaps(nm, gaps_at_ends(rises, falls).any(axis=0))].tolist() == within[within != 460.0].tolist()
    )
    rises, falls = ends(throughput[:, ::-1], ABRUPT_PART)
    within = np.arange(422.5, 460.0, 2.5)
    assert (
        CURVE_NM[within_gaps(nm, gaps_at_ends(rises, falls).any(axis=0))].tolist() == within[within != 440.0].tolist()
    )


@pytest.mark.parametrize("end", [0.03, 0.4, 0.97])
@pytest.mark.parametrize("power", [0.0, 0.5])
def test_the_light_of_a_gap_is_integrated_up_to_its_end(end, power):
    """A constant, and a square root as near total reflection: moments in closed form."""
    near, far = light_up_to_its_end(end**power, lambda part: (end - part) ** power if part < end else 0.0)
    whole = end ** (power + 1.0) / (power + 1.0)
    moment = end ** (power + 2.0) / ((power + 1.0) * (power + 2.0))
    # half of the last bisection moves the end of a constant, and hardly changes a square root
    assert near + far == pytest.approx(whole, abs=0.02 if power == 0.0 else 0.002)
    assert far == pytest.approx(moment, abs=0.02 if power == 0.0 else 0.001)


def test_the_ray_of_a_draft_moves_steadily_from_the_middle_of_the_iris_to_that_of_the_entrance():
    """Its angles have no jump, and its height is the middle of what passes both rims."""
    project = Project(
        lens="nikon-28-75", f_number=4.0, lights=(Light(field_deg=(18.0, 3.0)),), camera=Camera(size_px=(96, 54)),
        quality=Quality(mode="draft", wavelengths=3),
    )  # fmt: skip
    settled = resolve_project(project)
    (shot,) = make_shots(settled, make_opening(settled, None))
    paths = list(ghost_paths(settled.lens))
    radii = np.linspace(0.2, 3.0, 141) * shot.opening.radius
    middle = shot.packed.n_gap[1:2]
    angles = np.concatenate([
        matrix_fluxes(replace(shot, opening=replace(shot.opening, radius=r)), paths, middle, shot.packed.reflectance)[1]
        for r in radii
    ])  # fmt: skip
    change = np.ptp(angles, axis=0)
    steps = np.abs(np.diff(angles, axis=0)).max(axis=0)
    moved = change > 0.05
    assert moved.sum() > 100
    assert (steps[moved] < 0.3 * change[moved]).all()
