"""Cached kernels load without Numba's function library; compiling other kernels afterwards still works."""

import os
import subprocess
import sys

import pytest

# call two kernels, one of which may be in the cache; print the result, the cache counts and the heavy imports
CODE = """
import sys
import numpy as np
from flarewright.kernels.raster.pyramid import add_doubled, collect
pixels = np.empty((1, 2, 3), np.float32)
collect(np.arange(24, dtype=np.float32).reshape(1, 1, 3, 8), pixels)
heavy = [name for name in ("scipy.linalg", "numba.np.linalg", "numba.typed.dictimpl") if name in sys.modules]
hits, misses = (sum(counts.values()) for counts in (collect.stats.cache_hits, collect.stats.cache_misses))
print(pixels.tolist(), hits, misses)
print(heavy)
if len(sys.argv) > 1:
    add_doubled(np.ones((2, 3, 3), np.float32), np.zeros((4, 6, 3), np.float32))
    print(sum(add_doubled.stats.cache_misses.values()), "numba.np.linalg" in sys.modules)
"""


def output_lines(cache, *words, before=""):
    done = subprocess.run(
        [sys.executable, "-c", before + CODE, *words], capture_output=True, text=True, check=True,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
    )  # fmt: skip
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    place = tmp_path_factory.mktemp("cache")
    pixels, heavy = output_lines(place)
    # compiling imports the whole library
    assert pixels.endswith(" 0 1")
    assert "numba.np.linalg" in heavy
    return place, pixels.removesuffix(" 0 1")


@pytest.fixture(scope="module")
def loaded(cache):
    """Return the output of a second process, which loads one kernel and compiles another."""
    return output_lines(cache[0], "and add")


def test_a_cached_kernel_loads_without_heavy_imports(cache, loaded):
    assert loaded[:2] == [f"{cache[1]} 1 0", "[]"]


def test_an_uncached_kernel_compiles_afterwards(loaded):
    assert loaded[2:] == ["1 True"]


@pytest.mark.slow
def test_an_unsupported_numba_loads_kernels_itself(cache):
    place, pixels = cache
    before = """
from numba.core.caching import FunctionCache
kept = FunctionCache.load_overload
FunctionCache.load_overload = lambda self, sig, target_context, more=None: kept(self, sig, target_context)
"""
    loaded, heavy = output_lines(place, before=before)
    assert loaded == f"{pixels} 1 0"
    assert "numba.np.linalg" in heavy
