"""Spectra of lights, and the RGB weights of the traced wavelengths."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ...colorimetry import VISIBLE_NM
from ...errors import FlarewrightError
from ...model.project.camera import Colorspace
from ...model.project.light import D65, BlackBody, EqualEnergy, Lines, Rgb, Spectrum, Tabulated
from ...typing import Floats
from .cie1931 import D65_POWER, TABLE_NM, cie_1931, cmf_at_1_nm
from .rgb import xyz_to_rgb_matrix
from .rgb_to_spectrum import smoothest_reflectance, uplift

_H, _C, _KB = 6.62607015e-34, 299792458.0, 1.380649e-23  # exact SI values


def planck(wavelength_nm: ArrayLike, temperature_k: float) -> Floats:
    """Return the spectral radiance of a black body (Planck's law).

    Parameters
    ----------
    wavelength_nm : array_like
    temperature_k : float

    Returns
    -------
    ndarray
        W / (m^2 sr nm), the shape of `wavelength_nm`.
    """
    lam = np.asarray(wavelength_nm, dtype=np.float64) * 1e-9
    return 2e-9 * _H * _C**2 / lam**5 / np.expm1(_H * _C / (lam * _KB * temperature_k))


def spectral_power(spectrum: Spectrum, wavelength_nm: ArrayLike) -> Floats:
    """Return the relative power per nm of a continuous spectrum.

    Parameters
    ----------
    spectrum : Spectrum
        Any but `Lines`, which have no power per nm.
    wavelength_nm : array_like

    Returns
    -------
    ndarray
        The shape of `wavelength_nm`; 0 outside the table for D65 and for a tabulated spectrum.

    Raises
    ------
    ValueError
        For `Lines`.
    """
    wave = np.asarray(wavelength_nm, dtype=np.float64)
    if isinstance(spectrum, EqualEnergy):
        return np.ones_like(wave)
    if isinstance(spectrum, D65):
        # D65 is defined as linear between steps of 10 nm, so this is exact
        return np.interp(wave, TABLE_NM, D65_POWER, left=0.0, right=0.0)
    if isinstance(spectrum, BlackBody):
        return planck(wave, spectrum.temperature_k)
    if isinstance(spectrum, Lines):
        raise ValueError("spectral lines have power but no power per nm; use band_weights")
    if isinstance(spectrum, Rgb):
        # import on demand: few lights have a colour, and the fit imports this module
        return spectral_power(D65(), wave) * smoothest_reflectance(uplift(spectrum.rgb), wave)
    return np.interp(wave, spectrum.wavelength_nm, spectrum.power, left=0.0, right=0.0)


def traced_wavelengths(count: int, spectrum: Spectrum | None = None) -> Floats:
    """Return wavelengths to trace that sample the visible range well with few rays.

    Parameters
    ----------
    count : int
        Number of wavelengths.
    spectrum : Spectrum or None
        A line spectrum of at most `count` different lines returns exactly its lines.

    Returns
    -------
    ndarray, shape (count,) or fewer, ascending, nm

    Raises
    ------
    ValueError
        When `count` is below 1.

    Notes
    -----
    The midpoints of `count` equal cells between 395 and 705 nm, which hold 99.9 % of white light's luminance: 31 of
    them are 400, 410, ..., 700. The end nodes represent half a cell beyond them, about the amount that the constant end
    of `band_weights` assigns to them; nodes at the range's ends would be wasted on invisible light. Three wavelengths
    are the peaks of the colour matching functions (450, 540, 610), which suit the RGB of a draft.
    """
    if count < 1:
        raise ValueError(f"at least one wavelength must be traced, not {count}")
    if isinstance(spectrum, Lines):
        lines = np.unique([wave for wave, power in spectrum.lines if power > 0.0])
        if 0 < lines.size <= count:
            return lines
    if count == 3:
        return np.array([450.0, 540.0, 610.0])
    return 395.0 + 310.0 * (np.arange(count) + 0.5) / count


def sampled_wavelengths(count: int, spectrum: Spectrum | None = None) -> Floats:
    """Return wavelengths that sample the visible light densely, without interpolation between them.

    Parameters
    ----------
    count : int
        Least number; at least one every 5 nm.
    spectrum : Spectrum or None
        As in `traced_wavelengths`.

    Returns
    -------
    ndarray, shape (N,), ascending, nm
        Midpoints of equal cells within `VISIBLE_NM`, or a spectrum's lines.
    """
    low, high = VISIBLE_NM
    cells = max(count, round((high - low) / 5.0))
    if isinstance(spectrum, Lines):
        lines = traced_wavelengths(cells, spectrum)
        if covers_all_lines(spectrum, lines):
            return lines
    return low + (high - low) * (np.arange(cells) + 0.5) / cells


def covers_all_lines(spectrum: Spectrum, wavelengths_nm: ArrayLike) -> bool:
    """Return whether the traced wavelengths include all light of a spectrum.

    Parameters
    ----------
    spectrum : Spectrum
    wavelengths_nm : array_like, shape (N,)
    """
    if not isinstance(spectrum, Lines):
        return False
    return {wave for wave, power in spectrum.lines if power > 0.0} <= set(np.atleast_1d(wavelengths_nm).tolist())


def spectrum_xyz(spectrum: Spectrum) -> Floats:
    """Return the tristimulus values of a light, scaled to Y = 1.

    Returns
    -------
    ndarray, shape (3,)

    Raises
    ------
    FlarewrightError
        When the spectrum holds no visible light.
    """
    _, xyz = _stimulus(spectrum)
    total: Floats = xyz.sum(axis=0)
    return total


def luminance_shares(spectrum: Spectrum) -> tuple[Floats, Floats]:
    """Return the distribution of a light's luminance over wavelength.

    Returns
    -------
    wavelength_nm : ndarray, shape (L,)
        The lines in their order, or every nanometre from 360 to 830.
    share : ndarray, shape (L,)
        Fraction of the luminance; the sum is 1.

    Raises
    ------
    FlarewrightError
        When the spectrum holds no visible light.
    """
    wave, xyz = _stimulus(spectrum)
    return wave, xyz[:, 1]


def band_weights(
    spectrum: Spectrum, wavelengths_nm: ArrayLike, colorspace: Colorspace, *, cubic: bool = False
) -> Floats:
    """Return the RGB weight of each traced wavelength, for a light of luminance 1.

    Parameters
    ----------
    spectrum : Spectrum
    wavelengths_nm : array_like, shape (N,)
        Traced wavelengths, ascending.
    colorspace : {"rec709", "acescg"}
    cubic : bool
        Integrate what is cubic between the nodes instead of linear, for nodes as dense as `sampled_wavelengths`: what
        two films reflect can grow by a factor of 13 within 20 nm, and lines between nodes 5 nm apart err by 3 %.

    Returns
    -------
    ndarray, shape (N, 3)
        Linear RGB, negatives kept; the sum over N is the light's RGB, independent of N: (1, 1, 1) for D65.

    Raises
    ------
    FlarewrightError
        When the spectrum holds no visible light.
    ValueError
        When the wavelengths are not ascending.

    Notes
    -----
    C_k = integral S(l) cmf(l) h_k(l) dl in steps of 1 nm. h_k is the piecewise-linear hat function on the nodes,
    constant beyond the first and the last, so sum_k C_k f(l_k) integrates any f exactly that is linear between nodes; a
    ghost's brightness is smooth in wavelength. Lines are split between their two neighbours. With `cubic`, h_k are the
    weights of `cubics`.
    """
    wave, xyz = _stimulus(spectrum)
    return (cubics if cubic else hats)(wave, wavelengths_nm) @ xyz @ xyz_to_rgb_matrix(colorspace).T


def band_parts(spectrum: Spectrum, wavelengths_nm: ArrayLike, colorspace: Colorspace, curve_nm: ArrayLike) -> Floats:
    """Split `band_weights` over the points of a curve that multiplies the spectrum.

    Parameters
    ----------
    spectrum, wavelengths_nm, colorspace
        As in `band_weights`.
    curve_nm : array_like, shape (L,)
        Points of the curve, ascending; it is cubic between them (`cubics`) and constant beyond.

    Returns
    -------
    ndarray, shape (L, N, 3)
        Their sum over L, weighted by the curve's values, gives the weights of spectrum times curve; all parts add to
        `band_weights`.

    Raises
    ------
    FlarewrightError, ValueError
        As `band_weights`.
    """
    wave, xyz = _stimulus(spectrum)
    rgb = xyz @ xyz_to_rgb_matrix(colorspace).T
    parts: Floats = np.einsum("lw,nw,wc->lnc", cubics(wave, curve_nm), hats(wave, wavelengths_nm), rgb, optimize=True)
    return parts


def band_shares(spectrum: Spectrum, wavelengths_nm: ArrayLike, curve_nm: ArrayLike) -> Floats:
    """Split the band of each traced wavelength over the points of a curve.

    Parameters
    ----------
    spectrum : Spectrum
    wavelengths_nm : array_like, shape (N,)
        Traced wavelengths, ascending.
    curve_nm : array_like, shape (L,)
        As in `band_parts`.

    Returns
    -------
    ndarray, shape (N, L)
        Shares of X + Y + Z, which sum to 1 over L: a curve's mean over a band is their dot product. A band without
        light has equal shares.

    Raises
    ------
    FlarewrightError, ValueError
        As `band_weights`.
    """
    wave, xyz = _stimulus(spectrum)
    shares = hats(wave, wavelengths_nm) * xyz.sum(axis=1) @ hats(wave, curve_nm).T
    dark = ~(shares.sum(axis=1) > 0.0)
    shares[dark] = hats(np.asarray(curve_nm, dtype=np.float64), wavelengths_nm)[dark]
    found: Floats = shares / shares.sum(axis=1, keepdims=True)
    return found


def hats(wave: Floats, nodes_nm: ArrayLike) -> Floats:
    """Evaluate piecewise-linear hat functions on ascending nodes, constant beyond the first and the last.

    Parameters
    ----------
    wave : ndarray, shape (M,)
        Points of evaluation.
    nodes_nm : array_like, shape (N,)

    Returns
    -------
    ndarray, shape (N, M)
        They sum to 1 everywhere.

    Raises
    ------
    ValueError
        When the nodes are not ascending.
    """
    nodes = np.atleast_1d(np.asarray(nodes_nm, dtype=np.float64))
    if nodes.ndim != 1 or nodes.size == 0 or bool(np.any(np.diff(nodes) <= 0.0)):
        raise ValueError("traced wavelengths must rise")
    found = np.zeros((nodes.size, len(wave)))
    if nodes.size == 1:
        return found + 1.0
    at = np.clip(wave, nodes[0], nodes[-1])
    left = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, nodes.size - 2)
    rising = np.where(at == nodes[-1], 1.0, (1.0 / np.diff(nodes))[left] * (at - nodes[left]))
    column = np.arange(len(wave))
    found[left, column], found[left + 1, column] = 1.0 - rising, rising
    return found


def cubics(wave: Floats, nodes_nm: ArrayLike) -> Floats:
    """Evaluate piecewise cubic interpolation on ascending nodes, constant beyond the first and the last.

    Parameters
    ----------
    wave : ndarray, shape (M,)
        Points of evaluation.
    nodes_nm : array_like, shape (N,)

    Returns
    -------
    ndarray, shape (N, M)
        Weights of the values at the nodes. They sum to 1 everywhere; each place has at most four.

    Raises
    ------
    ValueError
        When the nodes are not ascending.

    Notes
    -----
    Lagrange's polynomial through the two nodes on either side (Abramowitz and Stegun 1964, 25.2.13); through the four
    nearest in the first and the last gap. What two films reflect near their zero has a relative curvature of
    12 / distance^2: 15 nm beside it a line between nodes 2.5 nm apart is 2.8 % too bright, which counts under a light
    of few wavelengths.

    Examples
    --------
    >>> cubics(np.array([1.5]), [0.0, 1.0, 2.0, 3.0])[:, 0].tolist()
    [-0.0625, 0.5625, 0.5625, -0.0625]
    """
    nodes = np.atleast_1d(np.asarray(nodes_nm, dtype=np.float64))
    if nodes.size < 4:
        return hats(wave, nodes)
    if nodes.ndim != 1 or bool(np.any(np.diff(nodes) <= 0.0)):
        raise ValueError("the nodes must rise")
    place = np.clip(wave, nodes[0], nodes[-1])
    first = np.clip(np.searchsorted(nodes, place, "right") - 2, 0, nodes.size - 4)
    weights = np.zeros((nodes.size, len(place)))
    for j in range(4):
        share = np.ones(len(place))
        for k in range(4):
            if k != j:
                share *= (place - nodes[first + k]) / (nodes[first + j] - nodes[first + k])
        weights[first + j, np.arange(len(place))] = share
    return weights


def band_contents(spectrum: Spectrum, wavelengths_nm: ArrayLike) -> tuple[tuple[Floats, Floats], ...]:
    """Return the wavelengths and light of each band in `band_weights`.

    Parameters
    ----------
    spectrum : Spectrum
    wavelengths_nm : array_like, shape (N,)
        Traced wavelengths, ascending.

    Returns
    -------
    tuple of (ndarray, ndarray), each of shape (L,)
        For each of the N: the wavelengths in its band, and their shares of the sum of X, Y and Z, which add to 1. A
        band without light contains only its own wavelength.
    """
    return _band_contents(spectrum, tuple(np.atleast_1d(np.asarray(wavelengths_nm, dtype=np.float64)).tolist()))


@lru_cache(maxsize=256)
def _band_contents(spectrum: Spectrum, nodes_nm: tuple[float, ...]) -> tuple[tuple[Floats, Floats], ...]:
    nodes = np.array(nodes_nm)
    wave, xyz = _stimulus(spectrum)
    power = xyz.sum(axis=1)
    found = []
    for k, node in enumerate(nodes):
        # a band ends at the neighbours, where their hats begin
        first = 0 if k == 0 else int(np.searchsorted(wave, nodes[k - 1], "right"))
        last = len(wave) if k == len(nodes) - 1 else int(np.searchsorted(wave, nodes[k + 1]))
        near = nodes[max(k - 1, 0) : k + 2]
        share = np.interp(wave[first:last], near, near == node) * power[first:last]
        most = float(share.max(initial=0.0))
        lit = share > 1e-4 * most
        held = (wave[first:last][lit], share[lit] / share[lit].sum()) if most > 0.0 else (np.array([node]), np.ones(1))
        found.append(held)
    return tuple(found)


def _stimulus(spectrum: Spectrum) -> tuple[Floats, Floats]:
    """Return wavelengths (L,) and their contributions to XYZ (L, 3), scaled to a sum of Y = 1."""
    if isinstance(spectrum, Lines):
        wave = np.array([line[0] for line in spectrum.lines])
        power = np.array([line[1] for line in spectrum.lines])
    else:
        wave = cmf_at_1_nm()[0]
        if isinstance(spectrum, Tabulated) and float(np.diff(spectrum.wavelength_nm).min()) < 1.0:
            power = _means_of_table(spectrum, wave)
        else:
            power = spectral_power(spectrum, wave)
    largest = float(power.max())
    # scale first, so that a very cold black body does not underflow
    xyz = cie_1931(wave) * (power / largest if largest > 0.0 else power)[:, None]
    luminance = float(xyz[:, 1].sum())
    if not luminance > 0.0:
        raise FlarewrightError(
            f"the spectrum ({spectrum.kind}) has no visible light; give it power between 380 and 780 nm"
        )
    return wave, xyz / luminance


def _means_of_table(table: Tabulated, wave: Floats) -> Floats:
    """Return the mean power of a table around each of `wave`, 1 nm apart, by hats: fine tables have lines between."""
    nm = np.array(table.wavelength_nm)
    nodes = np.union1d(nm, wave[(wave > nm[0]) & (wave < nm[-1])])
    power, step = np.interp(nodes, nm, table.power), 0.5 * np.diff(nodes)
    light = power * (np.append(step, 0.0) + np.append(0.0, step))
    seen = (nodes >= wave[0]) & (nodes <= wave[-1])
    at, light = nodes[seen] - wave[0], light[seen]
    low = np.minimum(at.astype(np.intp), len(wave) - 2)
    part = at - low
    below, above = np.bincount(low, light * (1.0 - part), len(wave)), np.bincount(low + 1, light * part, len(wave))
    return np.asarray(below + above, dtype=np.float64)
