"""Inner kernels are compiled once for each list of types, whatever numbers their callers write."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.kernels.jit.decorators import for_python, inner


@inner
def _power(number, exponent, halved):
    total = 1.0
    for _ in range(exponent):
        total *= number
    return total / 2.0 if halved else total


@inner
def _powers(number, count):
    cube, fourth = _power(number, 3, False), _power(number, exponent=4, halved=True)
    return cube, fourth, _power(number, count, False)


def test_literal_integers_share_a_compilation():
    assert for_python(_powers)(3.0, 2) == (27.0, 40.5, 9.0)
    compiled = {str(types) for types in _power.overloads}
    # truth values keep theirs, because Numba leaves out the branches that they exclude
    assert len(compiled) == 2
    assert not any("Literal[int]" in types for types in compiled)


def test_python_may_not_call_an_inner_kernel():
    with pytest.raises(TypeError, match="is for kernels"):
        _power(np.float64(3.0), 2, False)
