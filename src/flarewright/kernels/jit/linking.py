"""Compiler of `inner` kernels: their code is linked into the callers, and not optimised or translated alone.

Numba optimises every function and translates it into machine code before it copies it into the callers, where it is
optimised and translated again. The first machine code of a kernel that only kernels call never runs; skipping it saves
a quarter of the first command (docs/adr/0007).
"""

from __future__ import annotations

from typing import Any, ClassVar

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

from .pipeline import KernelCompiler

# Numba's stubs do not know these
_Library: Any = JITCodeLibrary
_Lowering: Any = NativeLowering


class _LinkedLibrary(_Library):  # type: ignore[misc]
    """A code library that is complete as soon as it can be linked into a caller."""

    def _optimize_final_module(self) -> None:
        """Do nothing: the caller's library optimises this code."""

    def _finalize_final_module(self) -> None:
        """Mark the library as final without making machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkedLowering(_Lowering):  # type: ignore[misc]
    """Numba's lowering pass for code without an address."""

    _name = "flarewright_linked_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a typed function into a `_LinkedLibrary` and register it for its callers."""
        library = _LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        library.enable_object_caching()
        state.library = library
        # set the flags only now: Numba compiles callees again for kernels of other flags
        state.flags.no_compile = state.flags.no_cpython_wrapper = True
        super().run_pass(state)
        # callers find the code by this object, which replaces the entry address
        entry = object()
        state["cr"] = state["cr"]._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, state["cr"].fndesc, [library])
        return True


class InnerCompiler(KernelCompiler):
    """`KernelCompiler` with another lowering pass."""

    exchanged: ClassVar[dict[Any, Any]] = {**KernelCompiler.exchanged, NativeLowering: _LinkedLowering}
