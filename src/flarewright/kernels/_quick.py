"""What Numba asks itself again and again while it compiles, answered from memory (docs/adr/0007).

To find the type of a product of two numbers Numba tries ten templates, at each product anew; and most of what it works
out about the life of variables nobody reads. These are the same answers, sooner: the machine code does not change.

Nothing of it outlives our own compiling, all of which Numba's lock keeps to one thread: `quickly` puts Numba's
functions back.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import analysis, base, ir, postproc, targetconfig, transforms, types
from numba.core.types.functions import BaseFunction

# Numba's stubs do not know these
_Context: Any = base.BaseContext
_Function: Any = BaseFunction
_Inst: Any = ir.Inst
_PostProcessor: Any = postproc.PostProcessor
_flags: Any = targetconfig.ConfigStack.top_or_none
_live_variables: Any = analysis.compute_live_variables
_Lifetime: Any = vars(postproc)["VariableLifetime"]

# function and types of a call, by what they are in; the signature, and which code that is. Functions are kept, so that
# no other gets the number of one
_Calls = dict[tuple[int, Any, Any], tuple[Any, Any, Any]]

# types of arguments that say all that is to know
_PLAIN = (types.Number, types.Boolean, types.Array, types.BaseTuple)
# options of a kernel that are none of what it calls
_OWN = ("no_cpython_wrapper", "no_cfunc_wrapper", "no_compile", "release_gil")

# of the process: calls by the options that they inherit, and by the object that holds all options
_calls: list[tuple[Any, _Calls]] = []
_calls_of: dict[int, tuple[Any, _Calls]] = {}
# bytes of LLVM types
_sizes: dict[Any, int] = {}
# whether values of a class are variables, hold some, or neither
_kinds: dict[type, str] = {}


def _inherited(flags: Any) -> Any:
    """Return the options that what is called inherits."""
    if flags is None:
        return None
    copy = flags.copy()
    for name in _OWN:
        if name in copy.options:
            copy.discard(name)
    return copy


def _known_calls() -> _Calls:
    """Return what is known of calls under the options that hold now."""
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
    """Find the signature of a call: of plain values it depends on their types and on the options."""
    if kws or not all(isinstance(one, _PLAIN) for one in args):
        return _numbas[_get_call_type](self, context, args, kws)
    calls, key = _known_calls(), (id(self), context, args)
    if key not in calls:
        signature = _numbas[_get_call_type](self, context, args, kws)
        if signature is None:
            return None
        calls[key] = self, signature, self._impl_keys[signature.args]
    _, signature, code = calls[key]
    # a call under other options may have left its own
    self._impl_keys[signature.args] = code
    return signature


class _EntryVariables(dict[Any, Any]):
    """The variables that live where a block begins, worked out when one is asked for."""

    def __init__(self, function: Any) -> None:
        super().__init__()
        self.blocks, self.lifetime = function.blocks, function.variable_lifetime

    def __missing__(self, block: Any) -> Any:
        told = self.lifetime
        living = _live_variables(told.cfg, self.blocks, told.usedefs.defmap, told.deadmaps.combined)
        self.update((one, living[offset]) for offset, one in self.blocks.items())
        return super().__getitem__(block)


def _run(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Bring a function in order after a pass; what variables live where is worked out only for who asks."""
    function = self.func_ir
    if emit_dels or function.is_generator:
        _numbas[_run](self, emit_dels, extend_lifetimes)
        return
    function.blocks = transforms.canonicalize_cfg(function.blocks)
    function.variable_lifetime = _Lifetime(function.blocks)
    function.block_entry_vars = _EntryVariables(function)
    function.generator_info = None


def _rec_list_vars(self: Any, val: Any) -> list[Any]:
    """List the variables in a part of a statement; which kind of part it is, its class tells."""
    kind = _kinds.get(type(val))
    if kind is None:
        kind = _kinds[type(val)] = _kind(val)
    if kind == "variable":
        return [val]
    if kind == "statement":
        inside: list[Any] = val.list_vars()
        return inside
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


def _get_abi_sizeof(self: Any, ty: Any) -> int:
    """Return the bytes of an LLVM type, for which Numba has LLVM read a module of text."""
    if ty not in _sizes:
        _sizes[ty] = _numbas[_get_abi_sizeof](self, ty)
    return _sizes[ty]


# where Numba's functions stand that ours take the place of
_PLACES: tuple[tuple[Any, str, Any], ...] = (
    (_Function, "get_call_type", _get_call_type),
    (_PostProcessor, "run", _run),
    (_Inst, "_rec_list_vars", _rec_list_vars),
    (_Context, "get_abi_sizeof", _get_abi_sizeof),
)
# Numba's own by ours, while they are away
_numbas: dict[Any, Any] = {}


def _parameters(function: Any) -> tuple[str, ...]:
    code = function.__code__
    return tuple(code.co_varnames[: code.co_argcount])


for _owner, _name, _ours in _PLACES:
    if _parameters(getattr(_owner, _name)) != _parameters(_ours):
        raise ImportError(f"with this Numba {_name} is another function")


@contextmanager
def quickly() -> Iterator[None]:
    """Compile with a memory. Only for who holds Numba's lock, as every compiler does."""
    if _numbas:
        # a kernel that a kernel calls
        yield
        return
    for owner, name, ours in _PLACES:
        _numbas[ours] = getattr(owner, name)
        setattr(owner, name, ours)
    try:
        yield
    finally:
        for owner, name, ours in _PLACES:
            setattr(owner, name, _numbas.pop(ours))
        _calls_of.clear()
