"""Kernels are loaded without what Numba needs only to compile, and compile beside that."""

import os
import subprocess
import sys

import pytest

# pixels that are added and collected by two kernels, one of which may be in the cache; and what was imported for it
CODE = """
import sys
import numpy as np
from flarewright.kernels.collect import add_doubled, collect
pixels = np.empty((1, 2, 3), np.float32)
collect(np.arange(24, dtype=np.float32).reshape(1, 1, 3, 8), pixels)
heavy = [name for name in ("scipy.linalg", "numba.np.linalg", "numba.typed.dictimpl") if name in sys.modules]
hits, misses = (sum(told.values()) for told in (collect.stats.cache_hits, collect.stats.cache_misses))
print(pixels.tolist(), hits, misses)
print(heavy)
if len(sys.argv) > 1:
    add_doubled(np.ones((2, 3, 3), np.float32), np.zeros((4, 6, 3), np.float32))
    print(sum(add_doubled.stats.cache_misses.values()), "numba.np.linalg" in sys.modules)
"""


def told(cache, *words, before=""):
    done = subprocess.run(
        [sys.executable, "-c", before + CODE, *words], capture_output=True, text=True, check=True,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
    )  # fmt: skip
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    place = tmp_path_factory.mktemp("cache")
    pixels, heavy = told(place)
    # what compiles needs it all
    assert pixels.endswith(" 0 1")
    assert "numba.np.linalg" in heavy
    return place, pixels.removesuffix(" 0 1")


@pytest.fixture(scope="module")
def loaded(cache):
    """What a second process loads, before it compiles a kernel that was never called."""
    return told(cache[0], "and add")


def test_what_is_in_the_cache_is_loaded_alone(cache, loaded):
    assert loaded[:2] == [f"{cache[1]} 1 0", "[]"]


def test_what_is_not_compiles_after_it(loaded):
    assert loaded[2:] == ["1 True"]


def test_with_another_numba_kernels_are_loaded_as_it_loads_them(cache):
    place, pixels = cache
    before = """
from numba.core.caching import FunctionCache
kept = FunctionCache.load_overload
FunctionCache.load_overload = lambda self, sig, target_context, more=None: kept(self, sig, target_context)
"""
    loaded, heavy = told(place, before=before)
    assert loaded == f"{pixels} 1 0"
    assert "numba.np.linalg" in heavy
