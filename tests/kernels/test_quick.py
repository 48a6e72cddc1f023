"""Compiling with a memory: the same code as Numba makes alone, and Numba is left as it was."""

import os
import re
import subprocess
import sys

import numpy as np
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


# many kinds of statements, compiled by Numba alone or by our compiler; what is compared is the machine code
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
    return joined.sum(), [part + 1.0 for part in (most, total[0])]


def made(**compiler):
    """Compile the kernel: what it returns, and its machine code."""
    one = njit(kernel, **compiler, **_jit._OPTIONS)
    returned = one(np.linspace(-2, 5, 12).reshape(4, 3), np.arange(4), (1.0, 0.5))
    lines = one.inspect_asm(one.signatures[0]).splitlines()
    code = [line for line in lines if line.startswith("\t") and not line.startswith("\t.")]
    # names hold the number of the compilation, and addresses are those of this process
    return returned, [re.sub(r'"?[\w.$<>]*_ZN[^\s,()"]*"?|\d{9,}|0x[0-9a-f]{6,}', "", line) for line in code]


def test_the_machine_code_is_numbas_own():
    alone, ours = made(), made(**_jit._ROOT)
    assert _jit._ROOT
    assert len(alone[1]) > 100
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


CHANGES = [
    "BaseFunction.get_call_type = lambda self, context, args: None",
    "del postproc.VariableLifetime",
    "del ir.Inst._rec_list_vars",
]
# each change is made to a Numba that our kernels do not know yet; a child begins with a Numba that has
# compiled before
CHANGED = """
import os, sys
from contextlib import nullcontext
from numba import njit
from numba.core import ir, postproc
from numba.core.types.functions import BaseFunction
assert njit(lambda x: x * x)(3.0) == 9.0
kept = BaseFunction.get_call_type, postproc.VariableLifetime, ir.Inst._rec_list_vars
for change in sys.argv[1:]:
    child = os.fork() if len(sys.argv) > 2 else 0
    if not child:
        break
    assert os.waitpid(child, 0)[1] == 0
if child:
    sys.exit()
exec(change)
from flarewright.kernels import _compiler, _jit
BaseFunction.get_call_type, postproc.VariableLifetime, ir.Inst._rec_list_vars = kept
assert _compiler._quickly is nullcontext
print(change, _jit.for_python(_jit.inner(lambda x: x * x))(3.0))
"""


@pytest.fixture(scope="module")
def compiled_with():
    """What kernels tell that were compiled with a changed Numba, by the change."""
    groups = [CHANGES] if hasattr(os, "fork") else [[change] for change in CHANGES]
    told = ""
    for changes in groups:
        told += subprocess.run(
            [sys.executable, "-c", CHANGED, *changes], capture_output=True, text=True, check=True
        ).stdout
    return dict(line.rsplit(" ", 1) for line in told.splitlines())


@pytest.mark.parametrize("change", CHANGES)
def test_with_another_numba_kernels_compile_as_it_compiles_them(compiled_with, change):
    assert compiled_with[change] == "9.0"
