"""What a path's geometry does between the traced wavelengths: how much of the pupil its light passes.

Rays are traced at few wavelengths because geometry changes slowly. Of a sliver it does not: light passes the rims, or
lands in the picture, at one end of the spectrum alone, and no line between two traced wavelengths tells how much.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .coating_curves import CURVE_NM
from .spectrum import hats

Floats = NDArray[np.float64]

# what passes less than this part of the most cannot stand for its neighbours
LEAST_PART = 1e-3
# an error is estimated at every so manieth wavelength
EVERY = 3

__all__ = ["bent_error", "bent_ratios", "lit_waves"]


def bent_error(passed: Floats, light: Floats, traced_nm: Floats, throughput: Floats) -> tuple[Floats, Floats]:
    """Estimate how wrong a path's colour is where its throughput is straight between the traced wavelengths.

    Parameters
    ----------
    passed : ndarray, shape (..., L)
        Part of the light that coatings pass, at `CURVE_NM`.
    light : ndarray, shape (L, 3)
        What there is of it in each channel.
    traced_nm : ndarray, shape (W,)
        Rising.
    throughput : ndarray, shape (..., W)
        At the traced wavelengths.

    Returns
    -------
    error, total : ndarray, shape (...)
        The largest channel's error, and the largest channel.

    Notes
    -----
    Against the cubic spline through the same values, whose ends run on straight: its distance from the line is the
    leading term of the error.
    """
    straight, bent = _interpolations(tuple(traced_nm))
    passed, light = passed[..., ::EVERY], light[::EVERY]
    # not `@`: its library's threads wait busily beside ours
    line = np.einsum("...w,wl->...l", throughput, straight)
    more = np.maximum(np.einsum("...w,wl->...l", throughput, bent), 0.0) - line
    error, total = (np.abs(np.einsum("...l,lc->...c", one * passed, light)).max(axis=-1) for one in (more, line))
    return error, total


@lru_cache(maxsize=64)
def _interpolations(traced_nm: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return what turns values at the traced wavelengths into those of a curve: by lines, by a cubic, (W, L)."""
    nodes, curve_nm = np.array(traced_nm), CURVE_NM[::EVERY]
    straight = hats(curve_nm, nodes)
    if len(nodes) == 1:
        return straight, straight
    # second derivatives from values, 0 at the ends (de Boor 2001, chapter IV); SciPy's takes longer to import than a
    # draft to draw
    gap = np.diff(nodes)
    slope = (np.eye(len(nodes))[1:] - np.eye(len(nodes))[:-1]) / gap[:, None]
    system = np.eye(len(nodes))
    for k in range(1, len(nodes) - 1):
        system[k, k - 1 : k + 2] = gap[k - 1] / 6.0, (gap[k - 1] + gap[k]) / 3.0, gap[k] / 6.0
    second = np.linalg.solve(system, np.pad(np.diff(slope, axis=0), ((1, 1), (0, 0))))
    cell = np.clip(np.searchsorted(nodes, curve_nm) - 1, 0, len(gap) - 1)
    width, ahead = gap[cell, None], (curve_nm - nodes[cell])[:, None]
    behind = width - ahead
    within = (curve_nm >= nodes[0]) & (curve_nm <= nodes[-1])
    cubic = (behind**3 / width - behind * width) * second[cell] + (ahead**3 / width - ahead * width) * second[cell + 1]
    bent = straight.T + np.where(within[:, None], cubic / 6.0, 0.0)
    # the ends run on as steeply as they come in
    low, high = slope[0] - gap[0] / 6.0 * second[1], slope[-1] + gap[-1] / 6.0 * second[-2]
    bent += np.minimum(curve_nm - nodes[0], 0.0)[:, None] * low + np.maximum(curve_nm - nodes[-1], 0.0)[:, None] * high
    return straight, np.ascontiguousarray(bent.T)


def bent_ratios(
    lit: NDArray[np.bool_], traced_nm: Floats, throughput: Floats, fine_nm: Floats, fine: Floats
) -> tuple[Floats, Floats]:
    """Divide what passes at all wavelengths among traced ones that know it at theirs alone.

    Parameters
    ----------
    lit : ndarray, shape (W,), bool
        Which traced wavelengths pass enough of all paths to stand for their neighbours, and for the bands of those
        that do not.
    traced_nm : ndarray, shape (W,)
        Rising.
    throughput : ndarray, shape (P, W)
        Of paths, at the traced wavelengths.
    fine_nm : ndarray, shape (M,)
        Rising.
    fine : ndarray, shape (P, M)
        At these; straight between them, constant beyond.

    Returns
    -------
    shares : ndarray, shape (W, L)
        How each wavelength of `CURVE_NM` is split between traced ones; 0 for one that is not lit.
    ratios : ndarray, shape (P, L)
        What passes over what the traced ones know of it: times the shares and `throughput`, summed over W, it is
        `fine`.
    """
    shares = np.zeros((len(traced_nm), len(CURVE_NM)))
    shares[lit] = _hats(tuple(traced_nm[lit]))
    known = np.einsum("pw,wl->pl", throughput, shares)
    return shares, np.einsum("pm,ml->pl", fine, _hats(tuple(fine_nm))) / known


@lru_cache(maxsize=64)
def _hats(nodes_nm: tuple[float, ...]) -> Floats:
    return hats(CURVE_NM, nodes_nm)


def lit_waves(throughput: Floats, fine: Floats) -> NDArray[np.bool_]:
    """Tell which traced wavelengths pass enough to stand for others, shape (P, W); arguments as in `bent_ratios`."""
    lit: NDArray[np.bool_] = throughput > LEAST_PART * fine.max(axis=1, keepdims=True)
    return lit
