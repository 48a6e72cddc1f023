"""Memory of planes: black, writable, and each plane's alone, in huge pages or not."""

import mmap
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from flarewright.kernels.raster import plane_memory
from flarewright.kernels.raster.plane_memory import (
    _KEPT,
    black_differences,
    black_memory,
    black_picture,
    unset_picture,
)


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


def test_a_picture_of_differences_is_black_and_in_double_precision():
    differences = black_differences(1280, 720)
    assert differences.shape == (720, 1280, 3)
    assert differences.dtype == np.float64
    assert not differences.any()
    differences[-1, -1] = 1.0
    assert differences.sum() == 3.0


def test_memory_of_a_draft_that_is_gone_serves_another_that_is_black():
    if not hasattr(mmap, "MADV_HUGEPAGE"):
        pytest.skip("planes lie in the memory of the C library on this system")
    first = black_differences(1280, 720)
    first += 1.0
    place, part = first.ctypes.data, first[3:5]
    # not while a part of it is in use
    del first
    second = black_differences(1280, 720)
    assert second.ctypes.data != place
    assert (part == 1.0).all()
    del part
    third = black_differences(1280, 720)
    assert third.ctypes.data == place
    assert not third.any()
    assert not second.any()
    third += 2.0
    del third
    plane = black_memory(6 * 1280 * 720)
    assert plane.ctypes.data == place
    assert not plane.any()
    # of another size, and too large to be kept
    assert unset_picture(1280, 720).ctypes.data != place
    held = len(plane_memory._kept)
    large = unset_picture(1920, 1080)
    del large
    assert len(plane_memory._kept) == held


def test_threads_get_memory_of_their_own():
    def work(number):
        for _ in range(50):
            plane = black_differences(1024, 512 + number % 2)
            assert not plane.any()
            plane += number
            assert (plane == number).all()

    with ThreadPoolExecutor(2 * _KEPT) as pool:
        list(pool.map(work, range(1, 2 * _KEPT + 1)))


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
