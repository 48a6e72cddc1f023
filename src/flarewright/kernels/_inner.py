"""How a kernel that only kernels call is compiled: linked into its callers, never optimised or translated alone.

Numba optimises every function as a whole and turns it into machine code before it copies it into its callers, where it
is optimised and translated again. Of a kernel that nothing else calls, that first machine code is never run
(docs/adr/0007: a quarter of the first command).
"""

from __future__ import annotations

from typing import Any, ClassVar

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

from ._compiler import KernelCompiler

# Numba's stubs do not know these
_Library: Any = JITCodeLibrary
_Lowering: Any = NativeLowering


class _LinkedLibrary(_Library):  # type: ignore[misc]
    """Code that is complete as soon as it can be linked into a caller's."""

    def _optimize_final_module(self) -> None:
        """Leave it to the caller's library, which holds this code when it is optimised."""

    def _finalize_final_module(self) -> None:
        """Make no machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkedLowering(_Lowering):  # type: ignore[misc]
    """Numba's last pass, for code that has no address of its own."""

    _name = "flarewright_linked_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a typed function into a `_LinkedLibrary` and make it known to its callers."""
        library = _LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        library.enable_object_caching()
        state.library = library
        # only now: what Numba compiles for kernels of other flags, it compiles again
        state.flags.no_compile = state.flags.no_cpython_wrapper = True
        super().run_pass(state)
        # callers find the code by what stands for its entry
        entry = object()
        state["cr"] = state["cr"]._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, state["cr"].fndesc, [library])
        return True


class InnerCompiler(KernelCompiler):
    """Our compiler with its last pass exchanged."""

    exchanged: ClassVar[dict[Any, Any]] = {**KernelCompiler.exchanged, NativeLowering: _LinkedLowering}
