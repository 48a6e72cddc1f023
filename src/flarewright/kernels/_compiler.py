"""Numba's compiler as our kernels need it: with a memory, and without passes that would find nothing to do."""

from __future__ import annotations

from contextlib import nullcontext, suppress
from types import CodeType
from typing import Any, ClassVar

from numba.core import ir, types
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes

_quickly: Any = nullcontext
# with another Numba the same code, later
with suppress(ImportError, AttributeError, KeyError):
    from ._quick import quickly

    _quickly = quickly

# Numba's stubs do not know these
_Compiler: Any = CompilerBase
_Closures: Any = InlineClosureLikes
_Rewrites: Any = NopythonRewrites
_Expr: Any = ir.Expr

# what Numba inlines besides functions within functions, and what it makes arrays of lists with
_CLOSURE_LIKES = frozenset({"reduce", "stencil", "array"})


@register_pass(mutates_CFG=True, analysis_only=False)
class _OwnClosures(_Closures):  # type: ignore[misc]
    """Numba's pass that inlines functions within functions, for kernels that have any."""

    _name = "flarewright_inline_closure_likes"

    def run_pass(self, state: Any) -> bool:
        """Inline what there is."""
        code = state.func_id.code
        if any(isinstance(one, CodeType) for one in code.co_consts) or _CLOSURE_LIKES & {*code.co_names}:
            return bool(super().run_pass(state))
        return False


@register_pass(mutates_CFG=True, analysis_only=False)
class _ArrayRewrites(_Rewrites):  # type: ignore[misc]
    """Numba's pass that joins operations on whole arrays, for kernels that have any."""

    _name = "flarewright_nopython_rewrites"

    def run_pass(self, state: Any) -> bool:
        """Join what there is."""
        told = state.calltypes.items()
        if any(isinstance(one, _Expr) and isinstance(found.return_type, types.Array) for one, found in told if found):
            return bool(super().run_pass(state))
        return False


class KernelCompiler(_Compiler):  # type: ignore[misc]
    """Numba's compiler, quickly."""

    # in the place of Numba's passes
    exchanged: ClassVar[dict[Any, Any]] = {InlineClosureLikes: _OwnClosures, NopythonRewrites: _ArrayRewrites}

    def compile_extra(self, func: Any) -> Any:
        """Compile a function; a caller waits, inside its own."""
        with _quickly():
            return super().compile_extra(func)

    def define_pipelines(self) -> list[Any]:
        """Return Numba's passes, some of them exchanged."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [(self.exchanged.get(one, one), told) for one, told in passes.passes]
        passes.finalize()
        return [passes]
