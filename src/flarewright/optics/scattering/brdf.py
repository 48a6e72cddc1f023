"""Surface scatter: roughness, measured functions and Chaumond's model, as formulas and as tables for kernels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import ProjectError
from ...kernels.scattering.single_scatter import CORE, DEPTH, FIXED, HIGH, LOW, ROUGH, SHARE, scattered_total
from ...model import Lens, Stop
from ...model.lens.scatter import Scatter
from ...typing import Floats
from ..rays.pack import PackedLens
from .dust import dust_density

# nodes of a table, evenly spaced in log(v^2)
NODES = 256
# floor of the tables that keeps logarithms finite, and share below which a row does not scatter
DARK = 1e-280
LEAST = 1e-30
# steps in radius and angle of the integral over all directions
RINGS, SPOKES = 160, 32
# indices that differ by less belong to the same glass
SAME_INDEX = 1e-9


def roughness_density(v: ArrayLike, wavelength_nm: float, correlation_um: float, slope: float) -> Floats:
    """Return the distribution of a rough surface's scatter over v, per area of v.

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
    return (m - 1.0) / (np.pi * shoulder**2) * (1.0 + ratio**2) ** -m


def abg_density(v: ArrayLike, abg: tuple[float, float, float]) -> Floats:
    """Return the measured scatter function A / (B + v^g), 1/sr for a surface in air: fraction of light per area of v.

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
    R. P. Breault Research, ASAP; A. W. Greynolds, SPIE 475 (1984). The fraction of light is the scatter function times
    cos(theta) dOmega, which is the area of v.
    """
    a, b, g = abg
    return a / (b + np.asarray(v, dtype=np.float64) ** g)


@dataclass(frozen=True)
class ScatterTables:
    """Scatter of every row, in the form that kernels read.

    Attributes
    ----------
    tables : ndarray, shape (W, K, 2, M)
        Natural logarithms of the share per area of v at even steps of log(v^2 + CORE^2): of roughness, divided by the
        squared phase depth; of everything else.
    amounts : ndarray, shape (W, K, 2)
        (2 pi rms / lambda)^2 and Chaumond's share.
    shares : ndarray, shape (W, K)
        Total forward scatter of each row at normal incidence; 0 for rows that do not scatter.
    """

    tables: Floats
    amounts: Floats
    shares: Floats

    @property
    def kept(self) -> Floats:
        """Fraction of the direct light that no surface scatters, per wavelength, shape (W,)."""
        left: Floats = np.prod(1.0 - self.shares, axis=1)
        return left


def scatter_tables(lens: Lens, packed: PackedLens, scatter: Scatter) -> ScatterTables:
    """Tabulate the scatter of every row of a lens at its packed wavelengths.

    Parameters
    ----------
    lens : Lens
    packed : PackedLens
    scatter : Scatter
        Its model is not "none".

    Raises
    ------
    ProjectError
        When an exception names a row that is no surface, or a surface would scatter half of its light or more.
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
            # Chaumond's whole share leaves the direct light, a fifth of it backward
            rough = amounts[w, k] * np.array([1.0, 0.0])
            found = scattered_total(tables[w, k], rough, n_in, n_out, 1.0, RINGS, SPOKES) + amounts[w, k, SHARE]
            shares[w, k] = found if found > LEAST else 0.0
            if shares[w, k] >= 0.5:
                raise ProjectError(
                    f"scatter: row {k} of {lens.name} would scatter {shares[w, k]:.0%} of its light; the single "
                    "scattering model needs a small share, reduce it"
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
