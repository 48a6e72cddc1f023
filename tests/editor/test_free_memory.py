"""Memory that pictures have freed returns to the system."""

import subprocess
import sys

import pytest

from flarewright.editor.common import free_memory

# threads fill arenas with blocks below the size that the C library maps apart, and free all but the last of each
FILL = """
import re, threading
from flarewright.editor.common.free_memory import free_bytes, release

def resident():
    return int(re.search(r"VmRSS:\\s+(\\d+) kB", open("/proc/self/status").read())[1]) / 1024

def fill(kept):
    blocks = [bytearray(100_000) for _ in range(500)]
    kept.append(blocks[-1])

kept = []
before = resident()
threads = [threading.Thread(target=fill, args=(kept,)) for _ in range(6)]
for one in threads: one.start()
for one in threads: one.join()
full, free = resident(), free_bytes()
few = release(most=2**40)
done = release(most=2**20)
print(before, full, resident(), free / 2**20, few, done)
"""


@pytest.mark.skipif(free_memory._library() is None, reason="needs the GNU C library")
def test_free_memory_above_the_limit_returns_to_the_system():
    done = subprocess.run([sys.executable, "-c", FILL], capture_output=True, text=True, timeout=60, check=True)
    *numbers, few, given = done.stdout.split()
    before, full, after, free = map(float, numbers)
    assert (few, given) == ("False", "True")
    assert free > 20.0
    assert full - before > 20.0
    assert after - before < 0.3 * (full - before)


def test_nothing_happens_without_the_library(monkeypatch):
    monkeypatch.setattr(free_memory, "_library", lambda: None)
    assert free_memory.free_bytes() == 0
    assert not free_memory.release(0)
