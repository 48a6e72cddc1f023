"""Memory of planes: black, writable, and each plane's alone, in huge pages or not."""

import mmap

import numpy as np
import pytest

from flarewright.kernels.raster.plane_memory import black_memory, black_picture


@pytest.mark.parametrize("count", [0, 1000, 2**21 + 5])
def test_memory_is_black_and_belongs_to_one_plane(count):
    one, other = black_memory(count), black_memory(count)
    assert one.shape == (count,)
    assert one.dtype == np.float32
    assert not one.any()
    one += 1.0
    assert not other.any()
    assert one.sum() == count


@pytest.mark.parametrize("count", [2**20, 2**21 + 5, 5_000_001])
def test_large_memory_begins_at_a_huge_page(count):
    if not hasattr(mmap, "MADV_HUGEPAGE"):
        pytest.skip("no huge pages on this system")
    assert black_memory(count).ctypes.data % 2**21 == 0


@pytest.mark.parametrize("size_px", [(7, 3), (1280, 720)])
def test_a_picture_has_rows_of_pixels(size_px):
    picture = black_picture(*size_px)
    assert picture.shape == (size_px[1], size_px[0], 3)
    assert picture.flags.c_contiguous
    assert picture.flags.writeable
    assert not picture.any()


def test_a_system_that_refuses_huge_pages_gives_small_ones(monkeypatch):
    if not hasattr(mmap, "MADV_HUGEPAGE"):
        pytest.skip("no huge pages on this system")
    # an advice that no kernel knows
    monkeypatch.setattr(mmap, "MADV_HUGEPAGE", 9999)
    memory = black_memory(2**21)
    memory[-1] = 2.0
    assert memory.sum() == 2.0


def test_a_lack_of_memory_is_a_memory_error():
    with pytest.raises(MemoryError):
        black_memory(2**58)
