"""In which views a ghost is there."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from planted_run import GHOSTS, shape, views

from flarewright.measure.fit import render
from flarewright.measure.found import Found, rest_of
from flarewright.measure.spans import respanned, span_of


def found(one, first, last):
    return Found((one, one, one), first, last)


def asked_anew(ghosts, seen, lead=1, pool=None):
    """Return the ghosts with the lives that one colour of the views tells of, and what is left of that colour."""
    rests = [rest_of(ghosts, seen, m) for m in range(3)]
    anew, left = respanned(ghosts, seen, rests, [lead] * len(ghosts), pool)
    return anew, left[lead]


def spans(ghosts):
    return [(ghost.first, ghost.last) for ghost in ghosts]


def test_a_ghost_that_was_found_in_a_part_of_its_life_is_there_in_all_of_it():
    seen = views(GHOSTS)
    end = len(seen) - 1
    ghosts = [found(one, first, last) for one, first, last in zip(GHOSTS, (0, 4, 2), (end, 9, end), strict=False)]
    anew, rest = asked_anew(ghosts, seen)
    assert spans(anew) == [(0, end)] * len(ghosts)
    for left, beside in zip(rest, rest_of(anew, seen, 1), strict=True):
        assert np.allclose(left, beside, atol=1e-5)


def test_a_ghost_is_not_there_where_only_others_have_shown_light():
    """Its own last view shows it; after that a brighter ghost lies there, which the others' light explains."""
    own, other = shape(-40.0, 12.0, 0.3), shape(-40.0, 14.0, 1.0)
    seen = [*views((own,))[:6], *views((other,))[6:]]
    end = len(seen) - 1
    ghosts = [found(own, 0, end), found(other, 6, end)]
    anew, _ = asked_anew(ghosts, seen)
    assert spans(anew) == [(0, 5), (6, end)]


@pytest.mark.parametrize(("gone", "span"), [((7,), (0, 11)), ((7, 8), (0, 6)), ((2, 3, 10, 11), (4, 9))])
def test_one_view_without_it_is_no_death_and_two_are(gone, span):
    one = shape(-60.0, 15.0, 0.4)
    with_it, without = views((one,))[:12], views(())[:12]
    shown = [without[k] if k in gone else with_it[k] for k in range(12)]
    assert span_of(one, shown, [view.pixels[..., 1] for view in shown], 5) == span


def test_who_is_hardly_ever_there_keeps_the_life_that_it_had():
    one = shape(-60.0, 15.0, 0.4)
    dark = views(())
    anew, rest = respanned([found(one, 3, 8)], dark, [[view.pixels[..., 1] for view in dark]], [0])
    assert spans(anew) == [(3, 8)]
    np.testing.assert_allclose(rest[0][5], dark[5].pixels[..., 1], atol=1e-6)


def test_threads_change_nothing():
    seen = views(GHOSTS)
    ghosts = [found(one, 1, 5) for one in GHOSTS]
    alone = asked_anew(ghosts, seen)
    with ThreadPoolExecutor(3) as pool:
        shared = asked_anew(ghosts, seen, pool=pool)
    assert spans(alone[0]) == spans(shared[0])
    assert all(np.array_equal(a, b) for a, b in zip(alone[1], shared[1], strict=True))


def test_the_light_of_a_ghost_stays_where_it_is_not_there():
    one = shape(-60.0, 15.0, 0.4)
    seen = [*views((one,))[:6], *views(())[6:]]
    ghosts = [found(one, 0, len(seen) - 1)]
    anew, rest = asked_anew(ghosts, seen)
    assert spans(anew) == [(0, 5)]
    # where it was taken off though nothing was there, it is given back
    assert abs(float(rest[8].sum())) < 0.05 * float(render(one, seen[8]).sum())


def test_a_life_is_told_by_the_colour_that_shows_the_ghost():
    """Blue shows it to its end; in green something as bright stays where it was."""
    one = shape(-60.0, 15.0, 0.4)
    dark, bright = views(()), views((one,))
    seen = [
        view.showing(
            np.stack([off.pixels[..., 0], view.pixels[..., 1], (view if k < 6 else off).pixels[..., 2]], axis=-1)
        )
        for k, (view, off) in enumerate(zip(bright, dark, strict=True))
    ]
    ghosts = [found(one, 0, len(seen) - 1)]
    assert spans(asked_anew(ghosts, seen, lead=2)[0]) == [(0, 5)]
    assert spans(asked_anew(ghosts, seen, lead=1)[0]) == [(0, len(seen) - 1)]
    # and what is left of the other colours is beside the new life
    anew, left = respanned(ghosts, seen, [rest_of(ghosts, seen, m) for m in range(3)], [2])
    for m in range(3):
        np.testing.assert_allclose(left[m], rest_of(anew, seen, m), atol=1e-5)
