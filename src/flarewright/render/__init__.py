"""From a project to layers. The package is callable: `flarewright.render(project)` renders.

Modules at this level join the sub-packages. Each sub-package holds one kind of pass, or shared helpers.

Modules and sub-packages:

- `render`: `render`, the only renderer; returns a `Rendering`
- `remarks`: sentences for the user about a finished picture
- `summary`: `summary_of`: facts of a picture as JSON data
- `analysis`: `paraxial` and `ghosts`, the analyses that accept any form of lens
- `analysis_memory`: `AnalysisMemory`: the finished part of an interrupted analysis
- `progress_parts`: `progress_parts`: the progress of several parts as that of one piece of work
- `gallery`: `cards`, `card_project`, `card_picture`: pictures of the shipped lenses and looks
- `warmup`: `compile_for_render`, `compile_for_analysis`: compile kernels ahead of time
- `ghosts`: the ghost pass, draft and final quality
- `starburst`: diffraction at the iris
- `scattering`: scattered light and veiling glare
- `reference`: Monte Carlo rendering, four-reflection ghosts, the energy ledger
- `scene`: from a `Project` to what the passes draw: lights, iris, lens state, art rules
- `image`: canvases, layers, gamut, exposure, display
- `preview`: fast previews for the editor
- `plots`: SVG and HTML figures
"""

import sys
from inspect import Signature, signature
from types import ModuleType
from typing import Any


class _CallablePackage(ModuleType):
    """A package that is also the public function of its name, `flarewright.render.render.render`."""

    @property
    def __signature__(self) -> Signature:
        """Signature of the function, for `inspect.signature`."""
        from .render import render

        return signature(render)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        from .render import render

        return render(*args, **kwargs)


sys.modules[__name__].__class__ = _CallablePackage
