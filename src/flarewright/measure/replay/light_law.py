"""Position of the light in the picture as a function of the constellation, fitted to all detected positions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model.measurement.ghost_model import GhostModel
from ..core.robust import MAD_TO_SIGMA
from ..core.views import View
from .model_image import light_px

# least tangent of the constellation at which a light's distance from the axis determines the focal length
_OFF_AXIS = 0.02
# rounds of reweighting outliers, and the least position error of a light, pixels
_LAW_ROUNDS, _LIGHT_PX = 20, 0.05
# largest difference of a light's position from the fitted law, part of the width
_NEAR_LAW = 0.01


def light_law(views: Sequence[View], px_per_rad: float) -> tuple[float, float]:
    """Fit focal length (pixels) and distortion to the lights of views; see `GhostModel`.

    Parameters
    ----------
    views : sequence of View
        Views whose light lies in the picture count; positions beyond it are predicted, not detected.
    px_per_rad : float
        Focal length to use when fewer than four lights are well off the axis.
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
        # reduce the weight of positions where another light was detected
        off = np.abs(away - basis @ law)
        root = 1.0 / np.hypot(1.0, off / (3.0 * max(MAD_TO_SIGMA * float(np.median(off)), _LIGHT_PX)))
        law = np.linalg.lstsq(basis * root[:, None], away * root, rcond=None)[0]
    focal, bent = law
    return float(focal), float(bent / focal)


def light_of_view(model: GhostModel, view: View) -> tuple[float, float]:
    """Return a view's light position: the detected one, or a replay's if both differ or it is outside the picture.

    Near the axis a nodding camera changes the light's direction, so that the roll does not determine the position.
    """
    by_law = light_px(model, view.constellation_deg, view.roll_deg)
    off = np.hypot(*np.subtract(view.light_px, by_law))
    inside = all(0.0 <= at <= side for at, side in zip(view.light_px, view.size_px, strict=True))
    return view.light_px if inside and off < _NEAR_LAW * view.size_px[0] else by_law
