"""Where the light of a constellation stands in the picture, by all places where it was seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model.ghost_model import GhostModel
from .replay import light_px
from .views import View

# tangent of the constellation from which the light's distance from the axis tells the focal length
_OFF_AXIS = 0.02
# rounds in which stray places lose their weight, and how well a light's place is known at best
_LAW_ROUNDS, _LIGHT_PX = 20, 0.05
# part of the width by which a light's place may differ from the law of all places
_NEAR_LAW = 0.01


def light_law(views: Sequence[View], px_per_rad: float) -> tuple[float, float]:
    """Return focal length (pixels) and distortion that tell where the views' lights are; see `GhostModel`.

    Parameters
    ----------
    views : sequence of View
        Those whose light lies in the picture count: places beyond it are foretold, not seen.
    px_per_rad : float
        Taken where fewer than four of them have the light well off the axis.
    """
    t = np.array([np.tan(np.radians(abs(view.constellation_deg))) for view in views])
    away = np.array([view.off_axis_px for view in views])
    inside = [all(0.0 <= at <= side for at, side in zip(view.light_px, view.size_px, strict=True)) for view in views]
    seen = np.array(inside) & (t > _OFF_AXIS)
    if np.unique(np.round(t[seen], 4)).size < 4:
        return px_per_rad, 0.0
    basis, away = np.stack([t, t**3], axis=1)[seen], away[seen]
    law = np.array([np.median(away / basis[:, 0]), 0.0])
    for _ in range(_LAW_ROUNDS):
        # a light that was taken for another counts less and less
        off = np.abs(away - basis @ law)
        root = 1.0 / np.hypot(1.0, off / (3.0 * max(1.4826 * float(np.median(off)), _LIGHT_PX)))
        law = np.linalg.lstsq(basis * root[:, None], away * root, rcond=None)[0]
    focal, bent = law
    return float(focal), float(bent / focal)


def light_of_view(model: GhostModel, view: View) -> tuple[float, float]:
    """Return where a view's light is: as seen, or where a replay puts it when that is far off or beyond the picture.

    Next to the axis a camera that nods turns the light's direction about: there a roll does not tell the place.
    """
    told = light_px(model, view.constellation_deg, view.roll_deg)
    off = np.hypot(*np.subtract(view.light_px, told))
    inside = all(0.0 <= at <= side for at, side in zip(view.light_px, view.size_px, strict=True))
    return view.light_px if inside and off < _NEAR_LAW * view.size_px[0] else told
