"""Flarewright: lens flare as physics.

>>> import flarewright as fw
>>> project = fw.Project(lens="heliar-tronnier", lights=[fw.Light(field_deg=(10, 5))])
>>> rendering = fw.render(project)                                      # doctest: +SKIP
>>> beauty = rendering.layers[0].pixels                                 # doctest: +SKIP

Names are imported when they are first used, so `import flarewright` costs nothing.
"""

from __future__ import annotations

from ._version import __version__ as __version__
from .lazy import lazy_names

__all__, __getattr__, _ = lazy_names(__name__)


def __dir__() -> list[str]:
    return sorted(__all__)
