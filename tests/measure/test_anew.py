"""Ghosts that were found one after the other find their places once they are begun anew together."""

from dataclasses import replace

import numpy as np
from planted_run import NOISE, shape, views

from flarewright.kernels.measure_pupil import FIRST_DISC, FIRST_I
from flarewright.measure.anew import begun_anew
from flarewright.measure.fit import render
from flarewright.measure.footprint import overlap
from flarewright.measure.found import Found

ANGLES = np.linspace(2.0, 24.0, 6)
SMALL, LARGE = shape(60.0, 20.0, 0.6), shape(95.0, 30.0, 0.4)


def grown_over() -> list[Found]:
    """Return the small ghost as it grew over the large one's light, with a rim and fading, and the large one."""
    wrong = shape(68.0, 27.7, 0.6)
    wrong.numbers[FIRST_I + 1 : FIRST_I + 3] = -0.9 * wrong.numbers[FIRST_I], -0.7 * wrong.numbers[FIRST_I]
    wrong.numbers[FIRST_DISC : FIRST_DISC + 3] = -2.27, 0.01, 2.44
    starts = (replace(wrong, discs=1), shape(93.0, 29.5, 0.35))
    return [Found((one,) * 3, 0, ANGLES.size - 1) for one in starts]


def test_ghosts_find_their_places_plainly():
    shown = views((SMALL, LARGE), angles=ANGLES)
    start = grown_over()
    assert overlap(start[0].shapes[1], SMALL, shown) < 0.7
    small, large = begun_anew(start, shown)
    for ghost, true in ((small, SMALL), (large, LARGE)):
        for one in ghost.shapes:
            assert not one.discs
            assert overlap(one, true, shown) > 0.95
    missed = [view.pixels[..., 1] - render(small.shapes[1], view) - render(large.shapes[1], view) for view in shown]
    assert np.sqrt(np.mean(np.square(missed))) < 1.5 * NOISE


def test_none_is_left_out_and_lives_stay():
    shown = views((SMALL,), angles=ANGLES)
    # two for one: a later fit says who is needed
    twice = [Found((SMALL,) * 3, 0, 5), Found((SMALL,) * 3, 2, 4)]
    assert [(ghost.first, ghost.last) for ghost in begun_anew(twice, shown)] == [(0, 5), (2, 4)]
    assert begun_anew([], shown) == []
