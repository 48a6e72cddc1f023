"""Conversion of CIE XYZ to linear RGB (Rec.709, ACEScg; D65 is (1, 1, 1) in both), luminance weights, and Oklab."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...colorimetry import D65_WHITE, PRIMARIES, rgb_to_xyz, xyz_of
from ...model.project.camera import Colorspace
from ...typing import Floats

_PRIMARIES = {"rec709": PRIMARIES["lin_rec709_scene"], "acescg": PRIMARIES["lin_ap1_scene"]}
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])

# linear Rec.709 to cone responses, and their cube roots to lightness, green-red and blue-yellow
_OKLAB_CONES = np.array([
    [0.4122214708, 0.5363325363, 0.0514459929],
    [0.2119034982, 0.6806995451, 0.1073969566],
    [0.0883024619, 0.2817188376, 0.6299787005],
])  # fmt: skip
_OKLAB_AXES = np.array([
    [0.2104542553, 0.7936177850, -0.0040720468],
    [1.9779984951, -2.4285922050, 0.4505937099],
    [0.0259040371, 0.7827717662, -0.8086757660],
])  # fmt: skip


@lru_cache
def xyz_to_rgb_matrix(colorspace: Colorspace) -> Floats:
    """Return the matrix from XYZ (D65 white, Y = 1) to linear RGB of a colour space.

    Parameters
    ----------
    colorspace : {"rec709", "acescg"}

    Returns
    -------
    ndarray, shape (3, 3), read-only
        rgb = matrix @ xyz.

    Raises
    ------
    ValueError
        When the colour space is unknown.

    Notes
    -----
    Derived from primaries and white as in SMPTE RP 177. For ACEScg (AP1) the D65 white is adapted to the ACES white
    with Bradford's matrix, as in the ACES transforms and OpenColorIO's built-in ones.
    """
    if colorspace not in _PRIMARIES:
        raise ValueError(f"colour space {colorspace!r} is unknown; use one of {', '.join(_PRIMARIES)}")
    matrix = adapted_to_rgb_matrix(_PRIMARIES[colorspace])
    matrix.flags.writeable = False
    return matrix


def adapted_to_rgb_matrix(primaries: Sequence[float]) -> Floats:
    """Return the matrix from XYZ (D65 white, Y = 1) to linear RGB of primaries and a white, adapted to that white.

    Parameters
    ----------
    primaries : sequence of float, length 8
        Chromaticities of red, green, blue and white.

    Returns
    -------
    ndarray, shape (3, 3)

    Notes
    -----
    As `xyz_to_rgb_matrix`.
    """
    return np.linalg.inv(rgb_to_xyz(primaries)) @ _bradford(D65_WHITE, primaries[6:])


def _bradford(source: Sequence[float], target: Sequence[float]) -> Floats:
    gain = (_BRADFORD @ xyz_of(target)) / (_BRADFORD @ xyz_of(source))
    adapted: Floats = np.linalg.inv(_BRADFORD) @ np.diag(gain) @ _BRADFORD
    return adapted


def luminance_weights(colorspace: Colorspace) -> Floats:
    """Return the luminance Y of a unit of each channel, shape (3,).

    Parameters
    ----------
    colorspace : {"rec709", "acescg"}
    """
    weights: Floats = np.linalg.inv(xyz_to_rgb_matrix(colorspace))[1]
    return weights


def oklab(rgb: Floats) -> Floats:
    """Convert linear Rec.709 to Oklab, in which equal distances look about equally large.

    Parameters
    ----------
    rgb : ndarray, shape (..., 3)

    Returns
    -------
    ndarray, shape (..., 3)
        L, a, b; white is (1, 0, 0).

    Notes
    -----
    B. Ottosson, "A perceptual color space for image processing", 2020. Tests compare the pairs of XYZ and Lab printed
    there.
    """
    cones = np.cbrt(rgb @ _OKLAB_CONES.T)
    return np.asarray(cones @ _OKLAB_AXES.T, dtype=np.float64)


def brightest_channel(rgb: NDArray[Any]) -> NDArray[Any]:
    """Return the largest channel of every pixel.

    Parameters
    ----------
    rgb : ndarray, shape (..., 3)

    Returns
    -------
    ndarray, shape (...)

    Examples
    --------
    >>> brightest_channel(np.array([[0.1, 0.5, 0.2]])).tolist()
    [0.5]
    """
    # far faster than `max` along the last axis, which is short
    return np.asarray(reduce(np.maximum, np.moveaxis(rgb, -1, 0)))
