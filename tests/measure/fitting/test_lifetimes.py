"""Range of views in which a ghost is visible."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, shape, views

from flarewright.measure.fitting.detected_ghost import DetectedGhost, residual_of
from flarewright.measure.fitting.ghost_fit import render
from flarewright.measure.fitting.lifetimes import update_ranges, visible_range


def found(one, first, last):
    return DetectedGhost((one, one, one), first, last)


def respanned_in(ghosts, seen, lead=1, pool=None):
    """Return the ghosts with ranges determined again in one colour, and the residual of that colour."""
    rests = [residual_of(ghosts, seen, m) for m in range(3)]
    again, left = update_ranges(ghosts, seen, rests, [lead] * len(ghosts), pool)
    return again, left[lead]


def spans(ghosts):
    return [(ghost.first, ghost.last) for ghost in ghosts]


def test_a_ghost_found_in_a_part_of_its_range_gets_all_of_it():
    seen = views(GHOSTS)
    end = len(seen) - 1
    ghosts = [found(one, first, last) for one, first, last in zip(GHOSTS, (0, 4, 2), (end, 9, end), strict=False)]
    again, rest = respanned_in(ghosts, seen)
    assert spans(again) == [(0, end)] * len(ghosts)
    for left, beside in zip(rest, residual_of(again, seen, 1), strict=True):
        assert np.allclose(left, beside, atol=1e-5)


def test_light_of_other_ghosts_does_not_extend_a_range():
    """After the last view of the ghost a brighter ghost explains the light at its position."""
    own, other = shape(-40.0, 12.0, 0.3), shape(-40.0, 14.0, 1.0)
    seen = [*views((own,))[:6], *views((other,))[6:]]
    end = len(seen) - 1
    ghosts = [found(own, 0, end), found(other, 6, end)]
    again, _ = respanned_in(ghosts, seen)
    assert spans(again) == [(0, 5), (6, end)]


@pytest.mark.parametrize(("gone", "span"), [((7,), (0, 11)), ((7, 8), (0, 6)), ((2, 3, 10, 11), (4, 9))])
def test_two_views_without_a_ghost_end_its_range_and_one_does_not(gone, span):
    one = shape(-60.0, 15.0, 0.4)
    with_it, without = views((one,))[:12], views(())[:12]
    shown = [without[k] if k in gone else with_it[k] for k in range(12)]
    assert visible_range(one, shown, [view.pixels[..., 1] for view in shown], 5) == span


def test_a_ghost_on_both_sides_of_the_axis_is_found_on_one_side():
    """A ghost that only lights away from the axis gets votes of both sides; the views between showed nothing of it,
    so it was refused though each side alone showed it.
    """
    one, angles = shape(-60.0, 15.0, 0.4), [-20, -16, -12, -8, -5, -2, 2, 5, 8, 12, 16, 20, 24]
    shown = [view for angle in angles for view in views((one,) if abs(angle) > 9.0 else (), angles=[angle])]
    own = [view.pixels[..., 1] for view in shown]
    assert visible_range(one, shown, own, 6) == (9, 12)
    # the other side, where the middle of the votes shows it
    assert visible_range(one, shown, own, 1) == (0, 2)


def test_a_ghost_in_too_few_views_keeps_its_range():
    one = shape(-60.0, 15.0, 0.4)
    dark = views(())
    again, rest = update_ranges([found(one, 3, 8)], dark, [[view.pixels[..., 1] for view in dark]], [0])
    assert spans(again) == [(3, 8)]
    np.testing.assert_allclose(rest[0][5], dark[5].pixels[..., 1], atol=1e-6)


def test_threads_change_nothing():
    seen = views(GHOSTS)
    ghosts = [found(one, 1, 5) for one in GHOSTS]
    alone = respanned_in(ghosts, seen)
    with ThreadPoolExecutor(3) as pool:
        shared = respanned_in(ghosts, seen, pool=pool)
    assert spans(alone[0]) == spans(shared[0])
    assert all(np.array_equal(a, b) for a, b in zip(alone[1], shared[1], strict=True))


def test_light_outside_the_range_of_a_ghost_is_not_subtracted():
    one = shape(-60.0, 15.0, 0.4)
    seen = [*views((one,))[:6], *views(())[6:]]
    ghosts = [found(one, 0, len(seen) - 1)]
    again, rest = respanned_in(ghosts, seen)
    assert spans(again) == [(0, 5)]
    # light that was subtracted outside its range is restored
    assert abs(float(rest[8].sum())) < 0.05 * float(render(one, seen[8]).sum())


def test_the_leading_colour_determines_the_range():
    """Blue shows its end; in green equally bright light stays at its position."""
    one = shape(-60.0, 15.0, 0.4)
    angles = np.linspace(1.0, LARGEST, 12)
    dark, bright = views((), angles=angles), views((one,), angles=angles)
    seen = [
        view.showing(
            np.stack([off.pixels[..., 0], view.pixels[..., 1], (view if k < 6 else off).pixels[..., 2]], axis=-1)
        )
        for k, (view, off) in enumerate(zip(bright, dark, strict=True))
    ]
    ghosts = [found(one, 0, len(seen) - 1)]
    assert spans(respanned_in(ghosts, seen, lead=2)[0]) == [(0, 5)]
    assert spans(respanned_in(ghosts, seen, lead=1)[0]) == [(0, len(seen) - 1)]
    # the residuals of the other colours match the new range
    again, left = update_ranges(ghosts, seen, [residual_of(ghosts, seen, m) for m in range(3)], [2])
    for m in range(3):
        np.testing.assert_allclose(left[m], residual_of(again, seen, m), atol=1e-5)
