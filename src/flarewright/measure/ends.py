"""Ghosts end where they no longer explain light.

One set of numbers describes a ghost over all constellations, and polynomials leave what they were fitted to quickly. At
the first and the last photographs of its life a ghost may be drawn as something that is not there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_model import GhostModel
from .numbers import visible
from .replay import draw
from .views import Pixels, View

# a ghost is left at least so many photographs
_FEWEST = 3


def ended(
    model: GhostModel, views: Sequence[View], left: Sequence[Pixels], masks: Sequence[NDArray[np.bool_]]
) -> tuple[GhostModel, list[Pixels]]:
    """Shorten ghosts by the photographs at their ends that are nearer to the truth without them.

    Parameters
    ----------
    model : GhostModel
    views : sequence of View
        By rising constellation.
    left : sequence of ndarray, shape (H, W, 3)
        What they show beside everything in the model; not a number where nothing was measured.
    masks : sequence of ndarray, shape (H, W)
        Where that may be believed.

    Returns
    -------
    GhostModel
        A ghost that was shortened fades between the last photograph that shows it and the next.
    list of ndarray
        What is left beside that.
    """
    rest = list(left)
    ghosts = []
    bare = model.replace(sprites=())
    for ghost in model.ghosts:
        alone = cast(GhostModel, bare.replace(ghosts=(ghost,)))
        shown = [k for k, view in enumerate(views) if visible([ghost], view.constellation_deg)[0] > 0.0]
        spans, fades = list(ghost.visible_deg), list(ghost.fade_deg)
        for end in (0, -1):
            gone = 0
            for count, k in enumerate(shown[:: 1 if end == 0 else -1][:-_FEWEST], start=1):
                light = draw(alone, views[k].constellation_deg, views[k].roll_deg, views[k].size_px)
                known = masks[k][..., None] & np.isfinite(rest[k]) & (light != 0.0)
                without = rest[k] + light.astype(np.float32)
                if not known.any():
                    # out of the picture, which says nothing of those before
                    continue
                if (rest[k][known] ** 2).sum() < (without[known] ** 2).sum():
                    break
                rest[k], gone = without, count
            if gone:
                past, shown = (shown[:gone], shown[gone:]) if end == 0 else (shown[-gone:], shown[:-gone])
                last, next_ = (views[n].constellation_deg for n in (shown[end], past[-1 - end]))
                spans[end], fades[end] = 0.5 * (last + next_), abs(next_ - last)
        ghosts.append(ghost.replace(visible_deg=tuple(spans), fade_deg=tuple(fades)))
    return cast(GhostModel, model.replace(ghosts=tuple(ghosts))), rest
