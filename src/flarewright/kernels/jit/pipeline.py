"""The compiler of our kernels: Numba's, with memoised typing and without passes that would change nothing."""

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
# an unsupported Numba version makes the same code, more slowly
with suppress(ImportError, AttributeError, KeyError):
    from .type_memo import quickly

    _quickly = quickly

# Numba's stubs do not know these
_Compiler: Any = CompilerBase
_Closures: Any = InlineClosureLikes
_Rewrites: Any = NopythonRewrites
_Expr: Any = ir.Expr

# functions that Numba's closure pass rewrites besides nested functions
_CLOSURE_LIKES = frozenset({"reduce", "stencil", "array"})


@register_pass(mutates_CFG=True, analysis_only=False)
class _OwnClosures(_Closures):  # type: ignore[misc]
    """Numba's pass that inlines nested functions, skipped for kernels without any."""

    _name = "flarewright_inline_closure_likes"

    def run_pass(self, state: Any) -> bool:
        """Inline nested functions if the kernel has any; return whether the code changed."""
        code = state.func_id.code
        if any(isinstance(one, CodeType) for one in code.co_consts) or _CLOSURE_LIKES & {*code.co_names}:
            return bool(super().run_pass(state))
        return False


@register_pass(mutates_CFG=True, analysis_only=False)
class _ArrayRewrites(_Rewrites):  # type: ignore[misc]
    """Numba's pass that fuses whole-array operations, skipped for kernels without any."""

    _name = "flarewright_nopython_rewrites"

    def run_pass(self, state: Any) -> bool:
        """Fuse array operations if the kernel has any; return whether the code changed."""
        calls = state.calltypes.items()
        if any(isinstance(one, _Expr) and isinstance(found.return_type, types.Array) for one, found in calls if found):
            return bool(super().run_pass(state))
        return False


class KernelCompiler(_Compiler):  # type: ignore[misc]
    """Numba's compiler with memoised typing and fewer passes."""

    # Numba's pass -> ours
    exchanged: ClassVar[dict[Any, Any]] = {InlineClosureLikes: _OwnClosures, NopythonRewrites: _ArrayRewrites}

    def compile_extra(self, func: Any) -> Any:
        """Compile a function; while a caller compiles, this call is nested in the caller's."""
        with _quickly():
            return super().compile_extra(func)

    def define_pipelines(self) -> list[Any]:
        """Return Numba's passes with those in `exchanged` replaced."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [(self.exchanged.get(one, one), description) for one, description in passes.passes]
        passes.finalize()
        return [passes]
