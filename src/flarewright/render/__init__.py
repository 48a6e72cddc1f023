"""From a project to layers: one pass a file. The package may be called: `flarewright.render(project)` renders."""

import sys
from inspect import Signature, signature
from types import ModuleType
from typing import Any


class _CallablePackage(ModuleType):
    """A package that is also the public function of its name, `flarewright.render.render.render`."""

    @property
    def __signature__(self) -> Signature:
        """Its parameters, for `inspect.signature` and what asks it."""
        from .render import render

        return signature(render)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        from .render import render

        return render(*args, **kwargs)


sys.modules[__name__].__class__ = _CallablePackage
