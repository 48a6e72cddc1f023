"""A joint restart from plain ghosts corrects ghosts that were detected one at a time."""

from dataclasses import replace

import numpy as np
from planted_run import NOISE, shape, views

from flarewright.kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_I
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.footprint import overlap
from flarewright.measure.fitting.ghost_fit import render
from flarewright.measure.fitting.restart import restart_jointly

ANGLES = np.linspace(2.0, 24.0, 4)
SMALL, LARGE = shape(60.0, 20.0, 0.6), shape(95.0, 30.0, 0.4)


def grown_over() -> list[DetectedGhost]:
    """Return a small ghost whose fit grew over a large one, with a rim and varying brightness, and the large one."""
    wrong = shape(68.0, 27.7, 0.6)
    wrong.numbers[FIRST_I + 1 : FIRST_I + 3] = -0.9 * wrong.numbers[FIRST_I], -0.7 * wrong.numbers[FIRST_I]
    wrong.numbers[FIRST_DISC : FIRST_DISC + 3] = -2.27, 0.01, 2.44
    starts = (replace(wrong, discs=1), shape(93.0, 29.5, 0.35))
    return [DetectedGhost((one,) * 3, 0, ANGLES.size - 1) for one in starts]


def test_a_restart_corrects_positions():
    shown = views((SMALL, LARGE), angles=ANGLES)
    start = grown_over()
    assert overlap(start[0].shapes[1], SMALL, shown) < 0.7
    small, large = restart_jointly(start, shown)
    for ghost, true in ((small, SMALL), (large, LARGE)):
        for one in ghost.shapes:
            assert not one.discs
            assert overlap(one, true, shown) > 0.95
    missed = [view.pixels[..., 1] - render(small.shapes[1], view) - render(large.shapes[1], view) for view in shown]
    assert np.sqrt(np.mean(np.square(missed))) < 1.5 * NOISE


def test_a_restart_keeps_all_ghosts_and_their_views():
    shown = views((SMALL,), angles=ANGLES)
    # two ghosts for one: a later step drops redundant ghosts
    twice = [DetectedGhost((SMALL,) * 3, 0, 3), DetectedGhost((SMALL,) * 3, 1, 2)]
    assert [(ghost.first, ghost.last) for ghost in restart_jointly(twice, shown)] == [(0, 3), (1, 2)]
    assert restart_jointly([], shown) == []
