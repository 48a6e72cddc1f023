"""Threads of a process that starts as ours do allocate from one heap, which keeps what was freed."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

# holds threads that have allocated, and lets the C library report its heaps
_COUNT_HEAPS = """
import ctypes, sys, threading
from flarewright.jobs.one_heap import share_one_heap
if "ours" in sys.argv:
    share_one_heap()
c = ctypes.CDLL(None)
c.malloc.restype = c.fopen.restype = ctypes.c_void_p
c.free.argtypes = c.fclose.argtypes = [ctypes.c_void_p]
c.malloc_info.argtypes = [ctypes.c_int, ctypes.c_void_p]
meet = threading.Barrier(5)
def allocate():
    # the interpreter lock is not held here, so that threads compete for the heap
    for _ in range(200):
        c.free(c.malloc(5000))
    meet.wait()
    meet.wait()
threads = [threading.Thread(target=allocate) for _ in range(4)]
for thread in threads: thread.start()
meet.wait()
report = c.fopen(sys.argv[1].encode(), b"w")
c.malloc_info(0, report)
c.fclose(report)
meet.wait()
for thread in threads: thread.join()
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries have one heap")
@pytest.mark.parametrize(("words", "one"), [((), False), (("ours",), True)])
def test_threads_share_one_heap(tmp_path, words, one):
    report = tmp_path / "heaps.xml"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    subprocess.run([sys.executable, "-c", _COUNT_HEAPS, report, *words], env=environment, check=True)
    assert (report.read_text().count("<heap nr=") == 1) == one


# allocates and frees what an item needs, and counts the pages that the system clears for it
_COUNT_PAGES = """
import resource, sys
import numpy as np
from flarewright.jobs.one_heap import keep_freed_memory
if "ours" in sys.argv:
    keep_freed_memory()
def item():
    [np.ones(6 << 17) for _ in range(8)]
item()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(4): item()
print((resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before) * resource.getpagesize() >> 20)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries keep what they choose")
@pytest.mark.parametrize(("words", "least", "most"), [((), 20, 200), (("ours",), 0, 5)])
def test_freed_memory_is_kept_for_the_next_item(words, least, most):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    command = [sys.executable, "-c", _COUNT_PAGES, *words]
    cleared_mb = int(subprocess.run(command, env=environment, check=True, capture_output=True).stdout)
    assert least <= cleared_mb <= most
