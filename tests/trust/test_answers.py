"""The rig's limit on processor time counts what an input costs, not what kernels take to compile."""

from __future__ import annotations

import time

import numba
import pytest
from numba.core import event

from .answers import TooLongError, within
from .compile_time import compile_time


def _work(seconds: float) -> None:
    end_s = time.process_time() + seconds
    while time.process_time() < end_s:
        pass


def test_the_compiler_is_counted():
    @numba.njit
    def kernel(number):
        return number + 1.0

    before_s = compile_time().seconds()
    kernel(1.0)
    assert compile_time().seconds() > before_s


def test_compilation_does_not_count_and_the_rest_does():
    with within(0.03), event.trigger_event("numba:compile"):
        _work(0.1)
    with pytest.raises(TooLongError), within(0.03):
        _work(0.1)
