"""Fast array lengths against a list of all products of 2, 3 and 5."""

from __future__ import annotations

import pytest

from flarewright.optics.diffraction.fft_size import fast_size

SMOOTH = sorted(2**a * 3**b * 5**c for a in range(12) for b in range(8) for c in range(6))


@pytest.mark.parametrize("least", [1, 2, 7, 11, 97, 121, 1000, 1921])
@pytest.mark.parametrize("even", [False, True])
def test_it_is_the_next_of_the_list(least, even):
    wanted = next(size for size in SMOOTH if size >= least and not (even and size % 2))
    assert fast_size(least, even=even) == wanted
