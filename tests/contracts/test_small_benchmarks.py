"""The comparison of the small benchmarks with the kept ratios fails where it should; it measures no time."""

import json

import pytest
from benchmarks.small import MACHINES_DIFFER, PROCESSES, RATIOS, lost, middle, surely_lost, works
from benchmarks.yardstick import RAY_SURFACES, trace_plainly

KEPT = {"trace": 2.0, "fill": 10.0, "rings": 0.5}


@pytest.mark.parametrize("common", [0.4, 1.0, 2.9])
def test_a_machine_with_other_ratios_loses_nothing(common: float) -> None:
    assert lost({name: common * ratio for name, ratio in KEPT.items()}, KEPT, 1.5) == {}


@pytest.mark.parametrize("common", [0.4, 1.0, 2.9])
def test_one_slower_work_is_named(common: float) -> None:
    now = {name: common * ratio for name, ratio in KEPT.items()}
    now["fill"] *= 1.6
    [sentence] = lost(now, KEPT, 1.5).values()
    assert sentence.startswith("fill: 1.60 times")
    now["fill"] *= 1.4 / 1.6
    assert lost(now, KEPT, 1.5) == {}


def test_a_loss_counts_if_every_process_shows_it() -> None:
    kept = {**KEPT, "trace again": 2.0, "fill again": 10.0}
    slow, both = {**kept, "fill": 16.0}, {**kept, "fill": 17.0, "rings": 0.9}
    runs = iter([both, slow, both])
    [sentence] = surely_lost(both, kept, 1.5, lambda: next(runs))
    assert sentence.startswith("fill: 1.70 times")
    assert next(runs, None) is None


@pytest.mark.parametrize("unlucky", [1, PROCESSES - 1])
def test_a_loss_that_a_process_does_not_show_is_none(unlucky: int) -> None:
    slow = {**KEPT, "fill": 20.0}
    runs = iter([*[slow] * (unlucky - 1), KEPT])
    assert surely_lost(slow, KEPT, 1.5, lambda: next(runs)) == []
    assert next(runs, None) is None


def test_without_a_loss_nothing_is_measured_again() -> None:
    assert surely_lost(KEPT, KEPT, 1.5, lambda: pytest.fail("measured again")) == []


@pytest.mark.parametrize("common", [0.7, 1.0, 1.6])
def test_the_middle_of_two_machines_is_as_far_from_both(common: float) -> None:
    other = {name: common * ratio for name, ratio in KEPT.items()}
    assert middle(other, KEPT) == pytest.approx(KEPT)
    between = middle({**other, "fill": 1.44 * other["fill"]}, KEPT)
    assert between == pytest.approx({**KEPT, "fill": 1.2 * KEPT["fill"]})
    assert middle({**other, "new": 3.0}, KEPT)["new"] == 3.0


def test_a_loss_of_all_works_is_told() -> None:
    [sentence] = lost({name: 1.1 * MACHINES_DIFFER * ratio for name, ratio in KEPT.items()}, KEPT, 1.5).values()
    assert sentence.startswith("all works")


def test_works_without_a_kept_ratio_are_told() -> None:
    assert lost({**KEPT, "new": 1.0}, KEPT, 1.5) == {"new": "new: no ratio is kept; run python -m benchmarks.small"}
    assert len(lost({}, KEPT, 1.5)) == 1


def test_every_work_has_a_kept_ratio() -> None:
    assert set(json.loads(RATIOS.read_text(encoding="utf-8"))["ratios"]) == set(works())


def test_the_yardstick_traces_what_it_counts() -> None:
    assert RAY_SURFACES == 200_000 * 8
    # symmetric heights: the sum of the places is 0 but for rounding
    assert abs(trace_plainly()) < 1e-6
