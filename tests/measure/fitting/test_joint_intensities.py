"""Joint solution for the brightness of all ghosts, and joining of fragments to one ghost."""

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, NOISE, shape, views

from flarewright.measure.core.parameters import Shape
from flarewright.measure.detection.join_ghosts import join_ghosts
from flarewright.measure.detection.settings import DetectionSettings, JoinSettings
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.ghost_fit import render
from flarewright.measure.fitting.joint_intensities import solve_intensities

FEW = np.linspace(2.0, LARGEST, 6)


def found(one: Shape, count: int = FEW.size) -> DetectedGhost:
    return DetectedGhost((one, one, one), 0, count - 1)


def dimmer(one: Shape, factor: float) -> Shape:
    numbers = one.numbers.copy()
    numbers[20:30] *= factor
    return Shape(numbers, one.discs)


def misfit(ghosts, shown) -> float:
    """Return the root mean square residual of views over the noise."""
    left = [
        view.pixels[..., 1] - sum(render(ghost.shapes[1], view) for ghost in ghosts if ghost.first <= k <= ghost.last)
        for k, view in enumerate(shown)
    ]
    return float(np.sqrt(np.mean(np.square(left))) / NOISE)


def test_overlapping_ghosts_get_their_true_brightness():
    # one lies inside the other in all views
    planted = (shape(-40.0, 34.0, 0.5), shape(-46.0, 20.0, 0.4))
    shown = views(planted, angles=FEW)
    wrong = [found(dimmer(planted[0], 1.7)), found(dimmer(planted[1], 0.2))]
    right = solve_intensities(wrong, shown)
    assert misfit(wrong, shown) > 3.0
    assert misfit(right, shown) < 1.2
    for ghost, truth in zip(right, planted, strict=True):
        for one in ghost.shapes:
            assert one.numbers[20] + 0.5 * one.numbers[21] == pytest.approx(
                truth.numbers[20] + 0.5 * truth.numbers[21], rel=0.03
            )


def test_a_redundant_ghost_is_dropped():
    shown = views((GHOSTS[0],), angles=FEW)
    twice = [found(dimmer(GHOSTS[0], 0.5)), found(dimmer(GHOSTS[0], 0.5)), found(GHOSTS[1])]
    kept = solve_intensities(twice, shown)
    assert len(kept) == 1
    assert kept[0].shapes[1].numbers[0] == GHOSTS[0].numbers[0]
    assert solve_intensities([], shown) == []


def test_the_light_inside_the_rims_decides_whether_a_ghost_is_negative():
    # the disc leaves the bright pupil centre; the negative intensity outside it is not drawn
    core = shape(-40.0, 30.0, 0.5)
    core.numbers[21] = -3.0 * core.numbers[20]
    core.numbers[30:33] = 0.0, 0.0, 0.4
    planted = (GHOSTS[0], Shape(core.numbers, 1))
    shown = views(planted, angles=FEW)
    kept = solve_intensities([found(one) for one in planted], shown)
    assert len(kept) == 2
    assert misfit(kept, shown) < 1.2


@pytest.mark.parametrize("colour", [0, 1, 2])
def test_a_ghost_visible_in_one_colour_is_needed(colour):
    body, within = shape(-40.0, 34.0, 0.5), shape(-46.0, 20.0, 0.4)
    shown = []
    for view in views((body,), angles=FEW):
        light = view.pixels.copy()
        light[..., colour] += render(within, view).astype(np.float32)
        shown.append(view.showing(light))
    kept = solve_intensities([found(body), found(within)], shown)
    assert [ghost.shapes[1].numbers[0] for ghost in kept] == [body.numbers[0], within.numbers[0]]
    reported = [one.numbers[20] / within.numbers[20] for one in kept[1].shapes]
    assert reported == pytest.approx([float(m == colour) for m in range(3)], abs=0.05)
    assert len(solve_intensities([found(body), found(within)], views((body,), angles=FEW))) == 1


@pytest.mark.parametrize(("part", "reported"), [(0.015, 1), (0.06, 2)])
def test_the_model_error_of_a_ghost_is_no_other_ghost(part, reported):
    # almost no noise: any drawn ghost explains its own light well
    body, within = shape(-40.0, 34.0, 50.0), shape(-46.0, 20.0, 50.0 * part)
    shown = views((body, within), angles=FEW)
    kept = solve_intensities([found(body), found(within)], shown)
    assert len(kept) == reported
    assert kept[0].shapes[1].numbers[0] == body.numbers[0]


def test_ghosts_have_light_only_in_their_views():
    shown = views((GHOSTS[0],), angles=FEW[:3]) + views((), angles=FEW[3:])
    assert misfit(solve_intensities([found(dimmer(GHOSTS[0], 0.5), 3)], shown), shown) < 1.2


def test_a_core_and_its_body_become_one_ghost():
    # g is small over half of the pupil, which concentrates its light at the centre
    whole = shape(-50.0, 30.0, 0.4)
    whole.numbers[10], whole.numbers[11] = 9.0, 21.0
    shown = views((whole,), angles=FEW)
    body, core = shape(-50.0, 29.0, 0.4), shape(-49.0, 8.0, 0.4)
    pieces = solve_intensities([found(body), found(core)], shown, needed=0.0)
    assert len(pieces) == 2
    reported: list[str] = []
    one = join_ghosts(pieces, shown, factor=2.0, report=reported.append)
    assert len(one) == 1
    # reported in pixels of pictures twice as wide
    assert reported == ["joined the ghost of speed -98 px with the one of size 58 px"]
    assert misfit(solve_intensities(one, shown), shown) < 0.5 * misfit(pieces, shown)


def test_two_separate_ghosts_are_not_joined():
    planted = (shape(-40.0, 34.0, 0.25), shape(-55.0, 14.0, 0.6))
    shown = views(planted, angles=FEW)
    assert len(join_ghosts([found(one) for one in planted], shown)) == 2


def test_the_gain_of_a_refit_joins_no_other_ghost():
    # detected as a uniform disc, which it is not: its gain from a refit does not make the other ghost a fragment
    large, small = shape(-40.0, 34.0, 0.5), shape(-52.0, 9.0, 0.1)
    large.numbers[10], large.numbers[11] = 10.0, 24.0
    shown = views((large, small), angles=FEW)
    assert len(join_ghosts([found(shape(-40.0, 32.0, 0.5)), found(small)], shown)) == 2


def test_light_outside_a_ghost_is_no_part_of_it():
    # small at the pupil centre, wide at its rim: most of it lies outside the other
    small, wide = shape(-40.0, 12.0, 0.6), shape(-42.0, 6.0, 0.1)
    wide.numbers[11] = 44.0
    wide.numbers[20:23] *= 20.0
    shown = views((small, wide), angles=FEW)
    assert len(join_ghosts([found(small), found(wide)], shown)) == 2


def test_ghosts_of_size_0_are_not_joined_with_others():
    """A ghost without light may shrink to size 0, where rounding determines the signs of its triangles."""
    rng = np.random.default_rng(3)
    shown = views(GHOSTS[:2], angles=FEW)
    vanished = []
    for _ in range(60):
        numbers = np.zeros(GHOSTS[0].numbers.size)
        for first in (0, 10):
            numbers[first : first + 4] = 10.0 ** rng.uniform(-15.0, -11.0) * rng.normal(size=4)
        numbers[20], numbers[30:33] = 1e-13, (1e-14, 1e-15, 0.05)
        vanished.append(Shape(numbers, 1))
        for view in shown:
            assert np.isfinite(render(vanished[-1], view)).all()
    kept = solve_intensities([*map(found, vanished[:5]), *map(found, GHOSTS[:2])], shown)
    assert [ghost.shapes[1].numbers[0] for ghost in kept] == [ghost.numbers[0] for ghost in GHOSTS[:2]]


def test_a_blob_stays_a_separate_ghost():
    """A joined ghost would blur a caustic core of one pixel, and a residual could not learn it at subpixel detail."""
    whole = shape(-50.0, 12.0, 0.4)
    whole.numbers[10], whole.numbers[11] = 1.0, 11.0
    shown = views((whole,), angles=FEW)
    pieces = solve_intensities([found(shape(-50.0, 12.0, 0.4)), found(shape(-50.0, 1.1, 4.0))], shown, needed=0.0)
    assert len(pieces) == 2
    assert len(join_ghosts(pieces, shown)) == 2
    # without the limit on blobs the core would be joined
    settings = DetectionSettings(joining=JoinSettings(blob_size=0.0))
    assert len(join_ghosts(pieces, shown, settings=settings)) == 1
