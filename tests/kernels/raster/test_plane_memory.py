"""Memory of planes: black, writable, and each plane's alone, in huge pages or not."""

import mmap

import numpy as np
import pytest

from flarewright.kernels.raster.plane_memory import black_memory


@pytest.mark.parametrize("count", [0, 1000, 2**21 + 5])
def test_memory_is_black_and_belongs_to_one_plane(count):
    one, other = black_memory(count), black_memory(count)
    assert one.shape == (count,)
    assert one.dtype == np.float32
    assert not one.any()
    one += 1.0
    assert not other.any()
    assert one.sum() == count


def test_a_system_that_refuses_huge_pages_gives_small_ones(monkeypatch):
    if not hasattr(mmap, "MADV_HUGEPAGE"):
        pytest.skip("no huge pages on this system")
    # an advice that no kernel knows
    monkeypatch.setattr(mmap, "MADV_HUGEPAGE", 9999)
    memory = black_memory(2**21)
    memory[-1] = 2.0
    assert memory.sum() == 2.0
