"""Colour errors of paths whose throughput changes fast between the traced wavelengths, and their correction.

Rays are traced at few wavelengths because geometry changes slowly. Slivers are an exception: their light passes the
rims, or lands in the picture, only at one end of the spectrum, and linear interpolation between wavelengths fails.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...typing import Floats, Mask
from ..colour.spectrum import hats
from .path_reflectance import CURVE_NM

# a wavelength with less than this fraction of the largest throughput cannot represent its neighbours
LEAST_PART = 1e-3
# the error is estimated at every third wavelength
EVERY = 3


def interpolation_error(
    passed: Floats, light: Floats, known_nm: Floats, throughput: Floats, traced: Mask | None = None
) -> tuple[Floats, Floats]:
    """Estimate the colour error of a path from linear throughput between the traced wavelengths.

    Parameters
    ----------
    passed : ndarray, shape (..., L)
        Fraction of the light that coatings pass, at `CURVE_NM`.
    light : ndarray, shape (L, 3)
        The light in each channel.
    known_nm : ndarray, shape (W,)
        The traced wavelengths and others, ascending.
    throughput : ndarray, shape (..., W)
        At `known_nm`.
    traced : ndarray, shape (W,), bool, optional
        Which of `known_nm` are traced; None: all.

    Returns
    -------
    error, total : ndarray, shape (...)
        The largest error of a channel, and the largest channel.

    Notes
    -----
    The reference is the cubic spline through the same values, with linear ends: its distance from the line is the
    leading term of the error.
    """
    drawn = (True,) * len(known_nm) if traced is None else tuple(traced.tolist())
    straight, bent = _interpolations(tuple(known_nm), drawn)
    # all light, also of a line between two of these wavelengths
    passed = passed[..., ::EVERY]
    # in rows, along which sums are vectorised
    by_channel = np.ascontiguousarray((curve_hats(tuple(CURVE_NM[::EVERY])) @ light).T)
    # not `@`, whose library threads busy-wait next to ours
    line = np.einsum("...w,wl->...l", throughput, straight)
    more = np.maximum(np.einsum("...w,wl->...l", throughput, bent), 0.0) - line
    error, total = (np.abs(np.einsum("...l,cl->...c", one * passed, by_channel)).max(axis=-1) for one in (more, line))
    return error, total


def gap_errors(passed: Floats, light: Floats, known_nm: Floats, throughput: Floats) -> tuple[Floats, Floats]:
    """Estimate how much each gap between known wavelengths adds to the colour error of `interpolation_error`.

    Parameters
    ----------
    passed : ndarray, shape (L,) or (P, L)
    light : ndarray, shape (L, 3)
    known_nm : ndarray, shape (M,)
        Ascending.
    throughput : ndarray, shape (P, M)

    Returns
    -------
    errors, shares : ndarray, shape (P, M - 1)
        The error and the light of each gap, relative to the largest channel of the path; 0 and 1 if there is no light.
        Light beyond the known wavelengths counts with the first and the last gap.
    """
    straight, bent = _interpolations(tuple(known_nm), (True,) * len(known_nm))
    coarse_nm = CURVE_NM[::EVERY]
    light = curve_hats(tuple(coarse_nm)) @ light
    line = np.einsum("pw,wl->pl", throughput, straight)
    more = np.maximum(np.einsum("pw,wl->pl", throughput, bent), 0.0) - line
    gap = np.clip(np.searchsorted(known_nm, coarse_nm) - 1, 0, len(known_nm) - 2)
    parts = (np.eye(len(known_nm) - 1)[gap][:, :, None] * light[:, None]).reshape(len(light), -1)
    errors, shares = (
        np.einsum("pl,lk->pk", one * passed[..., ::EVERY], parts).reshape(len(one), -1, 3) for one in (more, line)
    )
    total = np.abs(shares.sum(axis=1)).max(axis=1)[:, None]
    errors, shares = np.abs(errors).max(axis=2), np.abs(shares).max(axis=2)
    return (
        np.divide(errors, total, out=np.zeros_like(errors), where=total > 0.0),
        np.divide(shares, total, out=np.ones_like(shares), where=total > 0.0),
    )


@lru_cache(maxsize=64)
def _interpolations(known_nm: tuple[float, ...], traced: tuple[bool, ...]) -> tuple[Floats, Floats]:
    """Return the interpolation matrices from wavelengths to the curve, linear between traced ones and cubic, (W, L)."""
    nodes, curve_nm = np.array(known_nm), CURVE_NM[::EVERY]
    straight = hats(curve_nm, nodes)
    if len(nodes) == 1:
        return straight, straight
    # second derivatives from values, 0 at the ends (de Boor 2001, chapter IV); importing SciPy's takes longer than
    # drawing a draft
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
    # the ends continue with their slope
    low, high = slope[0] - gap[0] / 6.0 * second[1], slope[-1] + gap[-1] / 6.0 * second[-2]
    bent += np.minimum(curve_nm - nodes[0], 0.0)[:, None] * low + np.maximum(curve_nm - nodes[-1], 0.0)[:, None] * high
    straight[:] = 0.0
    straight[np.array(traced)] = hats(curve_nm, nodes[np.array(traced)])
    return straight, np.ascontiguousarray(bent.T)


def throughput_ratios(lit: Mask, traced_nm: Floats, throughput: Floats, fine: Floats) -> tuple[Floats, Floats]:
    """Split the throughput at all wavelengths over traced ones whose throughput is known only at themselves.

    Parameters
    ----------
    lit : ndarray, shape (W,), bool
        Which traced wavelengths have enough throughput in all paths to represent their neighbours and the bands of
        traced wavelengths that do not.
    traced_nm : ndarray, shape (W,)
        Ascending.
    throughput : ndarray, shape (P, W)
        Of paths, at the traced wavelengths.
    fine : ndarray, shape (P, L)
        Throughput at `CURVE_NM`.

    Returns
    -------
    shares : ndarray, shape (W, L)
        Split of each wavelength of `CURVE_NM` over the traced ones; 0 for those that are not lit.
    ratios : ndarray, shape (P, L)
        Correction factors: ratios times shares times `throughput`, summed over W, is `fine`.
    """
    shares = np.zeros((len(traced_nm), len(CURVE_NM)))
    shares[lit] = curve_hats(tuple(traced_nm[lit]))
    known = np.einsum("pw,wl->pl", throughput, shares)
    return shares, fine / known


@lru_cache(maxsize=64)
def curve_hats(nodes_nm: tuple[float, ...]) -> Floats:
    """Return how each of `CURVE_NM` is split between some wavelengths, as `optics.colour.spectrum.hats` does."""
    return hats(CURVE_NM, nodes_nm)


def bright_wavelengths(throughput: Floats, fine: Floats) -> Mask:
    """Return which traced wavelengths have enough throughput, shape (P, W); arguments as in `throughput_ratios`."""
    lit: Mask = throughput > LEAST_PART * fine.max(axis=1, keepdims=True)
    return lit
