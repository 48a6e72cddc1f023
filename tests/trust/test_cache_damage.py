"""A damaged cache changes no result and is reported."""

import pytest

from .cache_damage import run


@pytest.mark.parametrize("seed", range(2, 26, 4))
def test_a_damaged_autosave_is_reported(seed):
    verdict = run(seed)
    assert verdict.subject.startswith("autosave")
    assert verdict.held, verdict


@pytest.mark.slow
@pytest.mark.parametrize("seed", [seed for seed in range(24) if seed % 4 != 2])
def test_a_damaged_cache_changes_no_result(seed):
    verdict = run(seed)
    assert verdict.held, verdict
