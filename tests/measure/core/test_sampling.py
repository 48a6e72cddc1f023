from itertools import pairwise

import pytest

from flarewright.measure.core.sampling import evenly_spaced


@pytest.mark.parametrize("count", [1, 2, 7, 49, 50, 51, 99, 100, 1000])
def test_items_are_evenly_spaced_from_the_first_to_the_last(count):
    some = evenly_spaced(range(count), 50)
    assert len(some) == min(count, 50)
    assert (some[0], some[-1]) == (0, count - 1)
    gaps = {b - a for a, b in pairwise(some)}
    assert not gaps or (min(gaps) >= 1 and max(gaps) - min(gaps) <= 1)


def test_an_empty_sequence_stays_empty():
    assert evenly_spaced([], 3) == []
