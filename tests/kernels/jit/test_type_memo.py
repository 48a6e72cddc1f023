"""Memoised compilation: the same machine code as Numba's, and Numba's functions are restored afterwards."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
from numba import njit, types
from numba.core import compiler, ir, postproc, ssa, targetconfig

from flarewright.kernels.jit import decorators, type_memo
from flarewright.kernels.jit.type_memo import quickly
from flarewright.kernels.tracing.adaptive_grid import build_mesh

PATCHED = [(owner, name) for owner, name, _ in type_memo._PATCHES]


def installed():
    return [getattr(owner, name) for owner, name in PATCHED]


def test_numbas_functions_are_restored():
    originals = installed()
    with quickly():
        ours = installed()
        assert not set(ours) & set(originals)
        with quickly():
            assert installed() == ours
        assert installed() == ours
    assert installed() == originals
    with pytest.raises(ZeroDivisionError), quickly():
        raise ZeroDivisionError
    assert installed() == originals
    assert not type_memo._originals
    assert not type_memo._calls_of


def test_only_our_kernels_use_the_memo(monkeypatch):
    used = []
    known = type_memo._known_calls
    monkeypatch.setattr(type_memo, "_known_calls", lambda: used.append(known()) or used[-1])

    def twice(x):
        return x * x + x * x

    assert njit(twice)(3.0) == 18.0
    assert not used
    assert decorators.for_python(decorators.inner(twice))(3.0) == 18.0
    assert used


def test_the_memo_is_kept_by_inherited_options(monkeypatch):
    monkeypatch.setattr(type_memo, "_calls", [])
    monkeypatch.setattr(type_memo, "_calls_of", {})

    def known(**options):
        flags = compiler.Flags()
        for name, value in options.items():
            setattr(flags, name, value)
        with targetconfig.ConfigStack().enter(flags):
            return type_memo._known_calls()

    assert known(nrt=True) is known(nrt=True, no_compile=True, no_cpython_wrapper=True)
    assert known(nrt=True) is not known(nrt=False)
    assert known(nrt=True) is not known(nrt=True, error_model="numpy")
    assert len(type_memo._calls) == 3


@njit(inline="always", **decorators._OPTIONS)
def away(x, pair):
    for bound in pair:
        if x < -bound:
            return -x
    return x


@njit(inline="always", **decorators._OPTIONS)
def farther(x, pair):
    return max(away(x, pair), pair[0])


# many kinds of statements, to compare the machine code of Numba's compiler and ours
def kernel(values, rows, pair):
    total = np.zeros(3)
    most = 0.0
    for k in range(values.shape[0]):
        for m in range(values.shape[1]):
            x = values[k, m]
            # the same function twice, once in another one
            most = max(most, away(x, pair), farther(x, pair), abs(total[m % 3]))
            if rows[k] > 0 and x > pair[0]:
                total[rows[k] % 3] += x * x - min(k, m) / (1 + m)
            elif x < -pair[1]:
                break
    joined = total * 2.0 + most
    return joined.sum(), [part + 1.0 for part in (most, total[0])]


def compiled_kernel(**compiler):
    """Compile the kernel and return its result and its machine code."""
    one = njit(kernel, **compiler, **decorators._OPTIONS)
    returned = one(np.linspace(-2, 5, 12).reshape(4, 3), np.arange(4), (1.0, 0.5))
    lines = one.inspect_asm(one.signatures[0]).splitlines()
    code = [line for line in lines if line.startswith("\t") and not line.startswith("\t.")]
    # names contain the number of the compilation, and addresses differ between processes
    return returned, [re.sub(r'"?[\w.$<>]*_ZN[^\s,()"]*"?|\d{9,}|0x[0-9a-f]{6,}', "", line) for line in code]


def test_the_machine_code_is_numbas():
    alone, ours = compiled_kernel(), compiled_kernel(**decorators._ROOT)
    assert decorators._ROOT
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
        assert ir.Inst._rec_list_vars is type_memo._rec_list_vars
        ours = [statement.list_vars() for statement in statements]
    assert ours == theirs


def test_each_assignment_gets_numbas_variable():
    def rewritten():
        function = function_of(build_mesh)
        before = {label: list(map(str, block.body)) for label, block in function.blocks.items()}
        after = {label: list(map(str, block.body)) for label, block in ssa.reconstruct_ssa(function).blocks.items()}
        assert sum(after[label] != before[label] for label in before) > 20
        return after

    theirs = rewritten()
    with quickly():
        ours = rewritten()
    assert any(".phi" in line or "phi(" in line for body in theirs.values() for line in body)
    assert ours == theirs
    assert not type_memo._names


def test_live_variables_are_computed_on_access():
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
# apply each change to Numba before importing our kernels; a forked child starts with a Numba that has already compiled
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
from flarewright.kernels.jit import decorators, pipeline
BaseFunction.get_call_type, postproc.VariableLifetime, ir.Inst._rec_list_vars = kept
assert pipeline._quickly is nullcontext
print(change, decorators.for_python(decorators.inner(lambda x: x * x))(3.0))
"""


@pytest.fixture(scope="module")
def compiled_with():
    """Return the result of a kernel compiled with a changed Numba, by the change."""
    groups = [CHANGES] if hasattr(os, "fork") else [[change] for change in CHANGES]
    printed = ""
    for changes in groups:
        printed += subprocess.run(
            [sys.executable, "-c", CHANGED, *changes], capture_output=True, text=True, check=True
        ).stdout
    return dict(line.rsplit(" ", 1) for line in printed.splitlines())


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_an_unsupported_numba_compiles_without_the_memo(compiled_with, change):
    assert compiled_with[change] == "9.0"
