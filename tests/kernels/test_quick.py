"""Compiling with a memory: the same code as Numba makes alone, and Numba is left as it was."""

import subprocess
import sys

import pytest
from numba import njit, types
from numba.core import compiler, ir, postproc, targetconfig

from flarewright.kernels import _jit, _quick
from flarewright.kernels._quick import quickly
from flarewright.kernels.mesh import build_mesh

PLACES = [(owner, name) for owner, name, _ in _quick._PLACES]


def standing():
    return [getattr(owner, name) for owner, name in PLACES]


def test_numba_is_put_back():
    numbas = standing()
    with quickly():
        ours = standing()
        assert not set(ours) & set(numbas)
        with quickly():
            assert standing() == ours
        assert standing() == ours
    assert standing() == numbas
    with pytest.raises(ZeroDivisionError), quickly():
        raise ZeroDivisionError
    assert standing() == numbas
    assert not _quick._numbas
    assert not _quick._calls_of


def test_only_our_kernels_are_compiled_with_it(monkeypatch):
    asked = []
    known = _quick._known_calls
    monkeypatch.setattr(_quick, "_known_calls", lambda: asked.append(known()) or asked[-1])

    def twice(x):
        return x * x + x * x

    assert njit(twice)(3.0) == 18.0
    assert not asked
    assert _jit.for_python(_jit.inner(twice))(3.0) == 18.0
    assert asked


def test_options_that_calls_inherit_have_a_memory_each(monkeypatch):
    monkeypatch.setattr(_quick, "_calls", [])
    monkeypatch.setattr(_quick, "_calls_of", {})

    def known(**options):
        flags = compiler.Flags()
        for name, value in options.items():
            setattr(flags, name, value)
        with targetconfig.ConfigStack().enter(flags):
            return _quick._known_calls()

    assert known(nrt=True) is known(nrt=True, no_compile=True, no_cpython_wrapper=True)
    assert known(nrt=True) is not known(nrt=False)
    assert known(nrt=True) is not known(nrt=True, error_model="numpy")
    assert len(_quick._calls) == 3


# a kernel of many kinds of statements, compiled by Numba alone or by our compiler; what is compared is the machine code
CODE = """
import re, sys
import numpy as np
from numba import njit
from flarewright.kernels import _jit

def compiled(function, **options):
    ours = {} if sys.argv[1] == "alone" else _jit._ROOT
    assert ours or sys.argv[1] == "alone"
    return njit(function, **ours, **_jit._OPTIONS, **options)

def kernel(values, rows, pair):
    total = np.zeros(3)
    most = 0.0
    for k in range(values.shape[0]):
        for m in range(values.shape[1]):
            x = values[k, m]
            most = max(most, x, abs(total[m % 3]))
            if rows[k] > 0 and x > pair[0]:
                total[rows[k] % 3] += x * x - min(k, m) / (1 + m)
            elif x < -pair[1]:
                break
    joined = total * 2.0 + most
    return joined.sum(), [part for part in (most, total[0])]

one = compiled(kernel)
values, rows, pair = np.linspace(-2, 5, 12).reshape(4, 3), np.arange(4), (1.0, 0.5)
print(*one(values, rows, pair))
code = one.inspect_asm(one.signatures[0])
told = [line for line in code.splitlines() if line.startswith("\\t") and not line.startswith("\\t.")]
for line in told:
    # names hold the number of the compilation, and addresses are those of this process
    print(re.sub(r'"?[\\w.$<>]*_ZN[^\\s,()"]*"?|\\d{9,}|0x[0-9a-f]{6,}', "", line))
"""


def made(how):
    done = subprocess.run([sys.executable, "-c", CODE, how], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_the_machine_code_is_numbas_own():
    alone, ours = made("alone"), made("ours")
    assert len(alone) > 100
    assert ours == alone


def function_of(kernel):
    return compiler.run_frontend(kernel.py_func)


def test_variables_are_listed_as_numba_lists_them():
    function = function_of(build_mesh)
    statements = [statement for block in function.blocks.values() for statement in block.body]
    theirs = [statement.list_vars() for statement in statements]
    assert sum(map(len, theirs)) > 300
    with quickly():
        assert ir.Inst._rec_list_vars is _quick._rec_list_vars
        ours = [statement.list_vars() for statement in statements]
    assert ours == theirs


def test_what_lives_where_a_block_begins_is_told_when_asked():
    function = function_of(build_mesh)
    postproc.PostProcessor(function).run()
    theirs = [set(function.get_block_entry_vars(block)) for block in function.blocks.values()]
    assert any(theirs)
    with quickly():
        postproc.PostProcessor(function).run()
    assert not function.block_entry_vars
    assert [set(function.get_block_entry_vars(block)) for block in function.blocks.values()] == theirs


def test_sizes_are_those_of_llvm():
    context = njit(lambda x: x).targetctx
    for one in (types.float64, types.UniTuple(types.int32, 3), types.Array(types.float32, 3, "C"), types.boolean):
        ty = context.get_data_type(one)
        alone = context.get_abi_sizeof(ty)
        with quickly():
            assert [context.get_abi_sizeof(ty) for _ in range(2)] == [alone, alone]


@pytest.mark.parametrize(
    "change",
    [
        "BaseFunction.get_call_type = lambda self, context, args: None",
        "del postproc.VariableLifetime",
        "del ir.Inst._rec_list_vars",
    ],
)
def test_with_another_numba_kernels_compile_as_it_compiles_them(change):
    code = f"""
from contextlib import nullcontext
from numba.core import ir, postproc
from numba.core.types.functions import BaseFunction
kept = BaseFunction.get_call_type, postproc.VariableLifetime, ir.Inst._rec_list_vars
{change}
from flarewright.kernels import _compiler, _jit
BaseFunction.get_call_type, postproc.VariableLifetime, ir.Inst._rec_list_vars = kept
assert _compiler._quickly is nullcontext
print(_jit.for_python(_jit.inner(lambda x: x * x))(3.0))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "9.0"
