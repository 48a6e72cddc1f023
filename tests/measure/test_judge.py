"""The judge of the measurement: a found ghost is met once, and what shares a footprint is told apart from that."""

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[2]))

from benchmarks.measure.judge import FoundGhost, Tally, _judge_ghosts, summary
from benchmarks.measure.truth import TrueGhost

SHAPE = (60, 80)


def disc(x, y, radius):
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return np.hypot(columns - x, rows - y) < radius


def true(name, mask, level=1.0, snr=10.0, **what):
    light = mask[::2, ::2].astype(np.float16)
    hard = {"fold": False, "cut": False, "at_edge": False, "crossing": False, **what}
    return TrueGhost(name, (0, 0, SHAPE[1], SHAPE[0]), mask, light, level, snr, **hard)


def judged(ghosts, found, far=None):
    tally = Tally()
    tally.add_squares("linear", 1.0, 2.0)
    tally.ssim.append((1.0, 1.0))
    _judge_ghosts(ghosts, found, np.ones(SHAPE, bool) if far is None else far, {}, tally)
    return summary(tally)


def test_one_found_ghost_meets_one_of_two_that_share_its_footprint():
    body = disc(40, 30, 14)
    told = judged(
        [true("a", body), true("b", disc(42, 30, 14), crossing=True), true("c", disc(10, 10, 6), cut=True)],
        [FoundGhost("1", body, 1.0)],
    )
    assert told["recall, clean"] == 1.0
    assert told["met of true"] == {
        "clean": (1, 1), "fold": (0, 0), "cut": (0, 1), "at the edge": (0, 0), "outshone": (0, 1),
    }  # fmt: skip
    assert told["met of true, one found for several"]["outshone"] == (1, 1)
    assert told["met of true, one found for several"]["cut"] == (0, 1)
    assert told["recall, all"] == 1 / 3
    assert told["recall, all, one found for several"] == 2 / 3
    assert told["precision"] == 1.0


def test_what_is_nowhere_true_costs_precision_and_fragments_are_one():
    body = disc(40, 30, 14)
    halves = [np.where(np.arange(SHAPE[1]) < 40, body, False), np.where(np.arange(SHAPE[1]) >= 40, body, False)]
    found = [FoundGhost("1", halves[0], 1.0), FoundGhost("2", halves[1], 1.0), FoundGhost("3", disc(10, 50, 5), 1.0)]
    told = judged([true("a", body), true("faint", disc(70, 10, 5), snr=2.0)], found)
    assert (told["true"], told["found"], told["pieces"], told["found, of no true ghost"]) == (1, 2, 3, 1)
    assert told["recall, all"] == told["recall, all, one found for several"] == 1.0
    assert told["precision"] == 0.5


def test_centres_are_judged_where_recall_is():
    # most of the first lies around the light, where nothing is judged; what was found of it lies outside
    far = ~disc(18, 30, 9)
    inside, outside = disc(20, 30, 10), disc(60, 30, 10)
    ghosts = [true("a", inside), true("b", outside)]
    told = judged(ghosts, [FoundGhost("1", disc(24, 30, 10), 1.0), FoundGhost("2", disc(62, 30, 10), 1.0)], far)
    assert told["true"] == 1
    assert told["centre px"]["clean"] == [1, 2.0, 2.0]
