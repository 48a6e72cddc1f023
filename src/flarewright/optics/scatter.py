"""What surfaces scatter: formulas for roughness, measured functions and Chaumond's model, and their tables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ProjectError
from ..kernels.scatter import CORE, DEPTH, FIXED, HIGH, LOW, ROUGH, SHARE, scattered_total
from ..model import Lens, Stop
from ..model.scatter import Scatter
from .dust import dust_density
from .pack import PackedLens

Floats = NDArray[np.float64]

# nodes of a table: steps of a tenth in the logarithm of v^2
NODES = 256
# below this there is no light to tell of, and a logarithm stays finite
DARK = 1e-280
LEAST = 1e-30
# steps of the sum over all directions
RINGS, SPOKES = 160, 32
# indices that differ by less are those of one glass
SAME_INDEX = 1e-9

__all__ = [
    "ScatterTables",
    "abg_density",
    "abg_total",
    "phase_depth",
    "roughness_density",
    "scatter_tables",
    "total_integrated_scatter",
]


def phase_depth(n_in: float, n_out: float, cos_in: ArrayLike, *, mirror: bool = False) -> Floats:
    """Optical path that a unit of height at a surface changes, per unit.

    Parameters
    ----------
    n_in, n_out : float
    cos_in : array_like
        Cosine of the angle of incidence.
    mirror : bool
        Of the reflected light instead of the refracted.

    Returns
    -------
    ndarray
        |n_out cos_out - n_in cos_in|, or 2 n_in cos_in; 0 behind a total reflection.
    """
    cosine = np.asarray(cos_in, dtype=np.float64)
    if mirror:
        return 2.0 * n_in * cosine
    square = n_out**2 - n_in**2 * (1.0 - cosine**2)
    depth: Floats = np.where(square > 0.0, np.abs(np.sqrt(np.maximum(square, 0.0)) - n_in * cosine), 0.0)
    return depth


def total_integrated_scatter(depth: ArrayLike, roughness_nm: float, wavelength_nm: float) -> Floats:
    """Share of the reflected or refracted light that a rough surface scatters.

    Parameters
    ----------
    depth : array_like
        From `phase_depth`.
    roughness_nm, wavelength_nm : float

    Returns
    -------
    ndarray
        1 - exp(-(2 pi depth rms / lambda)^2), nearly (2 pi depth rms / lambda)^2.

    Notes
    -----
    H. E. Bennett and J. O. Porteus, J. Opt. Soc. Am. 51, 123 (1961) for mirrors: (4 pi n cos(theta) rms / lambda)^2. A
    height h delays refracted light by (n_out cos_out - n_in cos_in) h where it delays reflected light by
    2 n_in cos_in h, so at normal incidence it is (2 pi (n_out - n_in) rms / lambda)^2.
    """
    argument = 2.0 * np.pi * np.asarray(depth, dtype=np.float64) * roughness_nm / wavelength_nm
    share: Floats = -np.expm1(-(argument**2))
    return share


def roughness_density(v: ArrayLike, wavelength_nm: float, correlation_um: float, slope: float) -> Floats:
    """How the scatter of a rough surface spreads over v, per area of v.

    Parameters
    ----------
    v : array_like
        Length of the difference of the optical direction components along the surface.
    wavelength_nm, correlation_um : float
    slope : float
        Above 2.

    Returns
    -------
    ndarray
        Its integral over the whole plane is 1.

    Notes
    -----
    The power spectrum of heights is the K-correlation or ABC model, 1 / (1 + (2 pi l f)^2)^(slope / 2) with f = v /
    lambda (E. L. Church and P. Z. Takacs, SPIE 1165, 136, 1989), which is Harvey's three-parameter scatter function
    with its shoulder at lambda / (2 pi l) and the slope -slope.
    """
    shoulder = 1e-3 * wavelength_nm / (2.0 * np.pi * correlation_um)
    m = 0.5 * slope
    ratio = np.asarray(v, dtype=np.float64) / shoulder
    density: Floats = (m - 1.0) / (np.pi * shoulder**2) * (1.0 + ratio**2) ** -m
    return density


def abg_density(v: ArrayLike, abg: tuple[float, float, float]) -> Floats:
    """Measured scatter function A / (B + v^g), 1/sr at a surface in air; share of light per area of v.

    Parameters
    ----------
    v : array_like
        |beta - beta0|.
    abg : tuple of float

    Returns
    -------
    ndarray

    Notes
    -----
    R. P. Breault Research, ASAP; A. W. Greynolds, SPIE 475 (1984). The scatter function times cos(theta) dOmega is the
    share, and that is the area of v.
    """
    a, b, g = abg
    density: Floats = a / (b + np.asarray(v, dtype=np.float64) ** g)
    return density


def abg_total(abg: tuple[float, float, float]) -> float:
    """Total integrated scatter of A / (B + v^g) at normal incidence: over the unit disc.

    Parameters
    ----------
    abg : tuple of float

    Returns
    -------
    float
        pi A ln(1 + 1 / B) where g is 2.
    """
    # v = 0 lies at no node, and the sum converges like that of a smooth periodic function's half
    t = np.linspace(-60.0, 0.0, 60001)
    v = np.exp(t)
    values = 2.0 * np.pi * v**2 * abg_density(v, abg)
    return float((values.sum() - 0.5 * (values[0] + values[-1])) * (t[1] - t[0]))


@dataclass(frozen=True)
class ScatterTables:
    """What every row scatters, as kernels read it.

    Attributes
    ----------
    tables : ndarray, shape (W, K, 2, M)
        Natural logarithms of the share per area of v at even steps of log(v^2 + CORE^2): of roughness, over the squared
        phase depth; of all else.
    amounts : ndarray, shape (W, K, 2)
        (2 pi rms / lambda)^2 and Chaumond's share.
    shares : ndarray, shape (W, K)
        What each row scatters in total at normal incidence, behind it; 0 where it does not.
    """

    tables: Floats
    amounts: Floats
    shares: Floats

    @property
    def kept(self) -> Floats:
        """Part of the direct light that no surface scatters, per wavelength, shape (W,)."""
        left: Floats = np.prod(1.0 - self.shares, axis=1)
        return left


def scatter_tables(lens: Lens, packed: PackedLens, scatter: Scatter) -> ScatterTables:
    """Tabulate what every row of a lens scatters at its packed wavelengths.

    Parameters
    ----------
    lens : Lens
    packed : PackedLens
    scatter : Scatter
        Its model is not "none".

    Returns
    -------
    ScatterTables

    Raises
    ------
    ProjectError
        For an exception at a row that is no surface, or a surface that would scatter half of its light and more.
    """
    for exception in scatter.rows:
        if exception.row >= len(lens.rows) or isinstance(lens.rows[exception.row], Stop):
            what = "the stop" if exception.row < len(lens.rows) else f"not there, the last is {len(lens.rows) - 1}"
            raise ProjectError(f"scatter.rows: row {exception.row} of {lens.name} is {what}; name a surface")
    count, width = len(packed.wavelengths_nm), len(lens.rows)
    tables = np.full((count, width, 2, NODES), np.log(DARK))
    amounts, shares = np.zeros((count, width, 2)), np.zeros((count, width))
    for w, wavelength_nm in enumerate(packed.wavelengths_nm):
        for k, row in enumerate(lens.rows):
            n_in, n_out = float(packed.n_gap[w, k]), float(packed.n_gap[w, k + 1])
            if isinstance(row, Stop) or abs(n_out - n_in) < SAME_INDEX:
                continue
            _fill(scatter.at(k), float(wavelength_nm), min(n_in, n_out) == 1.0, tables[w, k], amounts[w, k])
            # all of Chaumond's share leaves the direct light, a fifth of it backward
            rough = amounts[w, k] * np.array([1.0, 0.0])
            found = scattered_total(tables[w, k], rough, n_in, n_out, 1.0, RINGS, SPOKES) + amounts[w, k, SHARE]
            shares[w, k] = found if found > LEAST else 0.0
            if shares[w, k] >= 0.5:
                raise ProjectError(
                    f"scatter: row {k} of {lens.name} would scatter {shares[w, k]:.0%} of its light; scatter once per "
                    "surface holds for a little of it, take less"
                )
    return ScatterTables(tables, amounts, shares)


def _fill(scatter: Scatter, wavelength_nm: float, in_air: bool, table: Floats, amount: Floats) -> None:
    """Fill the table of one row."""
    v = np.sqrt(np.maximum(np.exp(np.linspace(LOW, HIGH, NODES)) - CORE**2, 0.0))
    if scatter.model == "chaumond":
        amount[SHARE] = scatter.share
        return
    fixed = np.zeros(NODES)
    if scatter.model == "harvey-shack":
        amount[DEPTH] = (2.0 * np.pi * scatter.roughness_nm / wavelength_nm) ** 2
        density = roughness_density(v, wavelength_nm, scatter.correlation_um, scatter.slope)
        table[ROUGH] = np.log(np.maximum(amount[DEPTH] * density, DARK))
    elif in_air:
        fixed += abg_density(v, scatter.abg)
    if in_air and scatter.cleanliness_level is not None:
        fixed += dust_density(v, wavelength_nm, scatter.cleanliness_level)
    table[FIXED] = np.log(np.maximum(fixed, DARK))
