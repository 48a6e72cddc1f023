"""Faster compilation: memoised answers to questions that Numba computes repeatedly (docs/adr/0007).

To type a product of two numbers Numba tries ten templates, again for every product. It also computes the live variables
of every block although few passes read them, and copies a function's statements, with all its variables, to inline it.
For every variable that is assigned twice it visits each statement of the function two times. The replacements in this
module return the same answers sooner; the machine code does not change.

They are active only while our kernels compile, which Numba's lock keeps to one thread: `quickly` installs them and then
restores Numba's functions.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import analysis, base, inline_closurecall, ir, postproc, ssa, targetconfig, transforms, types
from numba.core.types.functions import BaseFunction

# Numba's stubs do not know these
_Context: Any = base.BaseContext
_Function: Any = BaseFunction
_Inst: Any = ir.Inst
_PostProcessor: Any = postproc.PostProcessor
_ssa: Any = ssa
_flags: Any = targetconfig.ConfigStack.top_or_none
_live_variables: Any = analysis.compute_live_variables
_Lifetime: Any = vars(postproc)["VariableLifetime"]
_inlining: dict[str, Any] = vars(inline_closurecall)
_Worker: Any = _inlining["InlineWorker"]

# (id of the function, context, argument types) -> function, signature, implementation key. The function is stored so
# that it stays alive and no other object gets its id
_Calls = dict[tuple[int, Any, Any], tuple[Any, Any, Any]]

# argument types that fully determine the signature
_VALUE_TYPES = (types.Number, types.Boolean, types.Array, types.BaseTuple)
# compiler options of a kernel that its callees do not inherit
_NOT_INHERITED = ("no_cpython_wrapper", "no_cfunc_wrapper", "no_compile", "release_gil")

# per process: known calls by inherited options, and by the id of the flags object
_calls: list[tuple[Any, _Calls]] = []
_calls_of: dict[int, tuple[Any, _Calls]] = {}
# sizes of LLVM types, bytes
_sizes: dict[Any, int] = {}
# id of a statement -> statement, which stays alive so that no other gets its id, and the names of its variables
_names: dict[int, tuple[Any, frozenset[str]]] = {}
# by class: whether its values are variables, contain variables, or neither
_kinds: dict[type, str] = {}


def _inherited(flags: Any) -> Any:
    """Return the compiler options that callees inherit."""
    if flags is None:
        return None
    copy = flags.copy()
    for name in _NOT_INHERITED:
        if name in copy.options:
            copy.discard(name)
    return copy


def _known_calls() -> _Calls:
    """Return the known calls under the current compiler options."""
    flags = _flags()
    if id(flags) not in _calls_of:
        inherited = _inherited(flags)
        calls: _Calls | None = next((calls for options, calls in _calls if options == inherited), None)
        if calls is None:
            calls = {}
            _calls.append((inherited, calls))
        _calls_of[id(flags)] = flags, calls
    return _calls_of[id(flags)][1]


def _get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Return the signature of a call; for plain values it depends only on their types and the compiler options."""
    if kws or not all(isinstance(one, _VALUE_TYPES) for one in args):
        return _originals[_get_call_type](self, context, args, kws)
    calls, key = _known_calls(), (id(self), context, args)
    if key not in calls:
        signature = _originals[_get_call_type](self, context, args, kws)
        if signature is None:
            return None
        calls[key] = self, signature, self._impl_keys[signature.args]
    _, signature, code = calls[key]
    # a call under other options may have stored another key
    self._impl_keys[signature.args] = code
    return signature


class _EntryVariables(dict[Any, Any]):
    """The live variables at the start of each block, computed on first access."""

    def __init__(self, function: Any) -> None:
        super().__init__()
        self.blocks, self.lifetime = function.blocks, function.variable_lifetime

    def __missing__(self, block: Any) -> Any:
        known = self.lifetime
        living = _live_variables(known.cfg, self.blocks, known.usedefs.defmap, known.deadmaps.combined)
        self.update((one, living[offset]) for offset, one in self.blocks.items())
        return super().__getitem__(block)


def _run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Post-process a function after a pass, but compute live variables only on access."""
    function = self.func_ir
    if emit_dels or function.is_generator:
        _originals[_run](self, emit_dels, extend_lifetimes)
        return
    function.blocks = transforms.canonicalize_cfg(function.blocks)
    function.variable_lifetime = _Lifetime(function.blocks)
    function.block_entry_vars = _EntryVariables(function)
    function.generator_info = None


def _rec_list_vars(self: Any, val: Any) -> list[Any]:
    """Return the variables in a part of a statement; the class of the part decides how to search it."""
    kind = _kinds.get(type(val))
    if kind is None:
        kind = _kinds[type(val)] = _kind(val)
    if kind == "variable":
        return [val]
    if kind == "statement":
        return val.list_vars()
    found: list[Any] = []
    if kind != "nothing":
        for part in val.values() if kind == "named parts" else val:
            found += _rec_list_vars(self, part)
    return found


def _kind(value: Any) -> str:
    if isinstance(value, ir.Var):
        return "variable"
    if isinstance(value, _Inst):
        return "statement"
    if isinstance(value, (list, tuple)):
        return "parts"
    return "named parts" if isinstance(value, dict) else "nothing"


def _inline_function(self: Any, caller_ir: Any, block: Any, i: Any, function: Any, arg_typs: Any = None) -> Any:
    """Inline a function without the two deep copies of its statements: no other call has them."""
    callee = self.run_untyped_passes(function)
    _inlining["copy"] = _NoCopy
    try:
        return self.inline_ir(caller_ir, block, i, callee, function.__code__.co_freevars, arg_typs=arg_typs)
    finally:
        _inlining["copy"] = copy


class _NoCopy:
    """Replacement for the module `copy` of Numba's inliner."""

    @staticmethod
    def deepcopy(value: Any) -> Any:
        """Return the value itself."""
        return value


def _run_ssa(blocks: Any) -> Any:
    """Give each assignment its own variable; forget the names in statements, which other passes change."""
    try:
        return _originals[_run_ssa](blocks)
    finally:
        _names.clear()


def _run_block_rewrite(blocks: Any, states: Any, handler: Any) -> dict[Any, Any]:
    """Give each statement that has the variable in question to a handler, which returns the statement to put there."""
    name, rewritten = states["varname"], {}
    for label, block in blocks.items():
        states["label"], states["block"] = label, block
        rewritten[label] = ir.Block(scope=block.scope, loc=block.loc)
        rewritten[label].body = [
            (handler.on_assign if isinstance(one, ir.Assign) else handler.on_other)(states, one)
            if name in _names_in(one)
            else one
            for one in block.body
        ]
    return rewritten


def _names_in(statement: Any) -> frozenset[str]:
    known = _names.get(id(statement))
    if known is None:
        known = _names[id(statement)] = statement, frozenset(one.name for one in statement.list_vars())
    return known[1]


def _get_abi_sizeof(self: Any, ty: Any) -> int:
    """Return the size of an LLVM type in bytes; without the memo Numba lets LLVM parse a module for it."""
    if ty not in _sizes:
        _sizes[ty] = _originals[_get_abi_sizeof](self, ty)
    return _sizes[ty]


# the functions of Numba to replace: class or module, attribute, replacement
_PATCHES: tuple[tuple[Any, str, Any], ...] = (
    (_Function, "get_call_type", _get_call_type),
    (_PostProcessor, "run", _run),
    (_Inst, "_rec_list_vars", _rec_list_vars),
    (_Worker, "inline_function", _inline_function),
    (_ssa, "_run_ssa", _run_ssa),
    (_ssa, "_run_block_rewrite", _run_block_rewrite),
    (_Context, "get_abi_sizeof", _get_abi_sizeof),
)
# replacement -> Numba's function, while the replacements are installed
_originals: dict[Any, Any] = {}


def _parameters(function: Any) -> tuple[str, ...]:
    code = function.__code__
    return tuple(code.co_varnames[: code.co_argcount])


for _owner, _name, _replacement in _PATCHES:
    if _parameters(getattr(_owner, _name)) != _parameters(_replacement):
        raise ImportError(f"unsupported Numba version: {_name} has other parameters")
if _inlining["copy"] is not copy:
    raise ImportError("unsupported Numba version: its inliner does not copy")


@contextmanager
def quickly() -> Iterator[None]:
    """Compile with memoised answers inside the block. The caller must hold Numba's lock, as every compiler does."""
    if _originals:
        # nested: a callee of the kernel that compiles
        yield
        return
    for owner, name, replacement in _PATCHES:
        _originals[replacement] = getattr(owner, name)
        setattr(owner, name, replacement)
    try:
        yield
    finally:
        for owner, name, replacement in _PATCHES:
            setattr(owner, name, _originals.pop(replacement))
        _calls_of.clear()
