"""The rig's limit on processor time counts what an input costs, not what kernels take to compile."""

from __future__ import annotations

import time

import numba
import pytest

from .answers import TooLongError, within
from .compile_time import compile_time


def _work(seconds: float) -> None:
    end_s = time.process_time() + seconds
    while time.process_time() < end_s:
        pass


def test_compilation_does_not_count_and_the_rest_does():
    @numba.njit
    def kernel(number):
        return number + 1.0

    compiled = compile_time()
    before_s = compiled.seconds()
    with within(0.03):
        kernel(1.0)
    assert compiled.seconds() - before_s > 0.05
    with pytest.raises(TooLongError), within(0.03):
        _work(0.3)
