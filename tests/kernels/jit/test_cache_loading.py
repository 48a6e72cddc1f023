"""Cached kernels load without Numba's function library; compiling other kernels afterwards still works."""

import subprocess
import sys

import numpy as np
import pytest

from flarewright.kernels.raster.pyramid import collect

# call a kernel that is in the cache; print the result, the cache counts and the heavy imports; then compile another one
CODE = """
import sys
import numpy as np
from flarewright.kernels.jit import decorators
from flarewright.kernels.raster.pyramid import add_doubled, collect
pixels = np.empty((1, 2, 3), np.float32)
collect(np.arange(24, dtype=np.float32).reshape(1, 1, 3, 8), pixels)
heavy = [name for name in ("scipy.linalg", "numba.np.linalg", "numba.typed.dictimpl") if name in sys.modules]
hits, misses = (sum(counts.values()) for counts in (collect.stats.cache_hits, collect.stats.cache_misses))
print(pixels.tolist(), hits, misses)
print(heavy)
if len(sys.argv) > 1:
    from numba.core import config
    config.CACHE_DIR = sys.argv[1]
    fresh = decorators.compiled(add_doubled.py_func)
    fresh(np.ones((2, 3, 3), np.float32), np.zeros((4, 6, 3), np.float32))
    print(sum(fresh.stats.cache_misses.values()), "numba.np.linalg" in sys.modules)
"""


def output_lines(*words, before=""):
    done = subprocess.run([sys.executable, "-c", before + CODE, *words], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def pixels():
    """Return what the kernel computes here, where it enters the cache of all tests."""
    here = np.empty((1, 2, 3), np.float32)
    collect(np.arange(24, dtype=np.float32).reshape(1, 1, 3, 8), here)
    return here.tolist()


@pytest.fixture(scope="module")
def loaded(pixels, tmp_path_factory):
    """Return the output of a process that loads one kernel and compiles another."""
    return output_lines(str(tmp_path_factory.mktemp("cache")))


def test_a_cached_kernel_loads_without_heavy_imports(pixels, loaded):
    assert loaded[:2] == [f"{pixels} 1 0", "[]"]


def test_an_uncached_kernel_compiles_afterwards(loaded):
    """Compiling imports the whole library."""
    assert loaded[2:] == ["1 True"]


@pytest.mark.slow
def test_an_unsupported_numba_loads_kernels_itself(pixels):
    before = """
from numba.core.caching import FunctionCache
kept = FunctionCache.load_overload
FunctionCache.load_overload = lambda self, sig, target_context, more=None: kept(self, sig, target_context)
"""
    loaded, heavy = output_lines(before=before)
    assert loaded == f"{pixels} 1 0"
    assert "numba.np.linalg" in heavy
