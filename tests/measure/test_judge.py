"""Judge of the measurement: each found ghost matches one true ghost; ghosts with one footprint count separately."""

import numpy as np
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


def test_one_found_ghost_matches_one_of_two_with_its_footprint():
    body = disc(40, 30, 14)
    reported = judged(
        [true("a", body), true("b", disc(42, 30, 14), crossing=True), true("c", disc(10, 10, 6), cut=True)],
        [FoundGhost("1", body, 1.0)],
    )
    assert reported["recall, clean"] == 1.0
    assert reported["met of true"] == {
        "clean": (1, 1), "fold": (0, 0), "cut": (0, 1), "at the edge": (0, 0), "outshone": (0, 1),
    }  # fmt: skip
    assert reported["met of true, one found for several"]["outshone"] == (1, 1)
    assert reported["met of true, one found for several"]["cut"] == (0, 1)
    assert reported["recall, all"] == 1 / 3
    assert reported["recall, all, one found for several"] == 2 / 3
    assert reported["precision"] == 1.0


def test_false_ghosts_lower_precision_and_fragments_count_once():
    body = disc(40, 30, 14)
    halves = [np.where(np.arange(SHAPE[1]) < 40, body, False), np.where(np.arange(SHAPE[1]) >= 40, body, False)]
    found = [FoundGhost("1", halves[0], 1.0), FoundGhost("2", halves[1], 1.0), FoundGhost("3", disc(10, 50, 5), 1.0)]
    reported = judged([true("a", body), true("faint", disc(70, 10, 5), snr=2.0)], found)
    assert (reported["true"], reported["found"], reported["pieces"], reported["found, of no true ghost"]) == (
        1,
        2,
        3,
        1,
    )
    assert reported["recall, all"] == reported["recall, all, one found for several"] == 1.0
    assert reported["precision"] == 0.5


def test_centres_are_judged_in_the_area_of_recall():
    # most of the first ghost lies in the masked disc around the light; the found part lies outside
    far = ~disc(18, 30, 9)
    inside, outside = disc(20, 30, 10), disc(60, 30, 10)
    ghosts = [true("a", inside), true("b", outside)]
    reported = judged(ghosts, [FoundGhost("1", disc(24, 30, 10), 1.0), FoundGhost("2", disc(62, 30, 10), 1.0)], far)
    assert reported["true"] == 1
    assert reported["centre px"]["clean"] == [1, 2.0, 2.0]
