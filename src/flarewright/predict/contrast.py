"""Loss of a picture's contrast by flare (Walch 2017, section 9.2)."""

from __future__ import annotations

from dataclasses import dataclass

from ..typing import Floats

WASHED = 0.9
"""Part of the contrast; where less remains, flare counts as visible."""


@dataclass(frozen=True)
class Contrast:
    """Contrast without and with flare.

    Attributes
    ----------
    k_ideal, k_real, ratio : float
        Equations 9.1, 9.2 and 9.3.
    """

    k_ideal: float
    k_real: float
    ratio: float


def contrast(i_max: float, i_min: float, i_flare: float) -> Contrast:
    """Compute the contrast of a scene under a uniform veil.

    Parameters
    ----------
    i_max, i_min : float
        Brightest and darkest value of the scene, above 0 and at least 0.
    i_flare : float
        Flare that is added to both, in the same unit.

    Notes
    -----
    Walch 2017, equations 9.1 to 9.3, after Keshmirian 2008; the ratio is the exact middle part of 9.3, not its
    approximation for faint flare.
    """
    whole = i_max + i_min
    return Contrast(
        k_ideal=(i_max - i_min) / whole,
        k_real=(i_max - i_min) / (whole + 2.0 * i_flare),
        ratio=whole / (whole + 2.0 * i_flare),
    )


def washed_share(flare: Floats, share: Floats, i_max: float, i_min: float) -> float:
    """Return the part of a frame where flare reduces the contrast to less than `WASHED`.

    Parameters
    ----------
    flare : ndarray, shape (H, W)
        In the unit of the scene.
    share : ndarray, shape (H, W)
        Part of each pixel inside the frame.
    i_max, i_min : float
        Brightest and darkest value of the scene.
    """
    # the flare at which equation 9.3 gives WASHED
    limit = 0.5 * (i_max + i_min) * (1.0 / WASHED - 1.0)
    return float((share * (flare > limit)).sum() / share.sum())
