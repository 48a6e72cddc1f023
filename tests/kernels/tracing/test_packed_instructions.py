"""The tracer's lanes compile to packed vector instructions."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

COLD = """
import numpy as np
from flarewright.kernels.tracing.incident_light import IncidentLight
from flarewright.kernels.tracing.lens_arrays import ConicLens
from flarewright.kernels.tracing.path_steps import PathSteps
from flarewright.kernels.tracing.sequential import STOP_X, trace_nodes
K = 2
one = np.ones(K)
out = np.empty((8, STOP_X))
lens = ConicLens(
    0.01 * one, 0.0 * one, np.arange(K) * 1.0, 0.1 * one, np.array([1.0, 1.5, 1.0]), np.zeros((K, 9)), 50.0
)
steps = PathSteps(np.arange(K), np.zeros(K, dtype=np.int64))
trace_nodes(steps, lens, IncidentLight(0.0, 0.0), np.zeros(8), np.zeros(8), out)
(text,) = trace_nodes.inspect_asm().values()
lines = [line for line in text.splitlines() if "vsqrtpd" in line]
print("packed", sum("%ymm" in line or "%zmm" in line for line in lines))
"""


def has_avx() -> bool:
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as stream:
            return " avx " in stream.read().replace("\n", " ")
    except OSError:
        return False


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64") or not has_avx(), reason="needs an x86 CPU with AVX")
def test_square_roots_are_taken_four_at_a_time(tmp_path):
    """Compile without a cache: cached code has no assembly to inspect."""
    cold = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", COLD], env=cold, capture_output=True, text=True, check=True, timeout=300
    )
    assert int(done.stdout.split()[-1]) >= 2
