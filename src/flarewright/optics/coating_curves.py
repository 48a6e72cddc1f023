"""What coatings do to a path's light between the traced wavelengths.

A coating's reflectance bends with the wavelength: a single film's is near 0 in the middle of the spectrum. A picture
that is traced at a few wavelengths and joins them by straight lines makes such ghosts too bright. Films cost nothing
to compute, rays do; so the spectrum is weighted by how the path's R and T bend between the wavelengths of its rays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ..kernels.path_curves import compare_with_lines, multiply_mirrors
from ..kernels.standing import traced_squares
from ..model import Coating, Lens, Stop
from .coatings import film_stack, stack_reflectance
from .pack import PackedLens, SensorMirror
from .paraxial import D_LINE_NM, gap_indices
from .paths import LightPath

Floats = NDArray[np.float64]

# visible light, in steps that a curved dip of a film does not notice
CURVE_NM = np.arange(375.0, 736.0, 2.5)
# entries against the squared sine; R of films is nearly linear in it
SQUARES = 33
# a path that is dark at two neighbouring wavelengths tells nothing about its colour between them
MOST_BEND = 4.0

__all__ = ["CURVE_NM", "CoatingCurves", "bends", "coating_curves", "mirror_squares_traced", "passed"]


@dataclass(frozen=True)
class CoatingCurves:
    """Reflectances of a lens' surfaces over the wavelengths.

    Attributes
    ----------
    reflectance : ndarray, shape (K, SQUARES, L)
        R of each row against the squared sine on the side of the lower index, uniform over [0, 1], at `CURVE_NM`.
    log_transmittance : ndarray, shape (K, L)
        log(1 - R) at normal incidence.
    """

    reflectance: Floats
    log_transmittance: Floats

    @cached_property
    def log_through(self) -> Floats:
        """Sum of `log_transmittance` over all rows before each, shape (K + 1, L): a leg between two is a difference."""
        return np.concatenate([np.zeros((1, len(CURVE_NM))), np.cumsum(self.log_transmittance, axis=0)])


def coating_curves(
    lens: Lens, coatings: tuple[Coating | None, ...], sensor: SensorMirror | None = None
) -> CoatingCurves | None:
    """Tabulate the coatings of a lens over the wavelengths.

    Parameters
    ----------
    lens : Lens
    coatings : tuple of Coating or None
        One a row (`optics.pack.resolve_coatings`).
    sensor : SensorMirror, optional
        The sensor as the last row.

    Returns
    -------
    CoatingCurves or None
        None where no row has a film: bare glass reflects almost alike at all wavelengths.

    Notes
    -----
    The glass has its index at the d line throughout: dispersion changes R slowly, which straight lines between the
    traced wavelengths follow.
    """
    n_d = gap_indices(lens, D_LINE_NM)
    rows: list[Floats] = []
    coated = False
    for k, row in enumerate(lens.rows):
        films: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
        if not isinstance(row, Stop):
            films = film_stack(coatings[k], n_d[k], n_d[k + 1])
            coated |= bool(films[0])
        rows.append(_curves(float(n_d[k]), float(n_d[k + 1]), *films))
    if not coated:
        return None
    if sensor is not None:
        rows.append(np.full_like(rows[0], sensor.reflectance))
    reflectance = np.stack(rows)
    return CoatingCurves(reflectance, np.log(np.maximum(1.0 - reflectance[:, 0], 1e-9)))


@lru_cache(maxsize=512)
def _curves(n_front: float, n_back: float, indices: tuple[float, ...], thicknesses_nm: tuple[float, ...]) -> Floats:
    """R of one surface, shape (SQUARES, L)."""
    if n_front > n_back:
        n_front, n_back = n_back, n_front
        indices, thicknesses_nm = indices[::-1], thicknesses_nm[::-1]
    shape = (SQUARES, len(CURVE_NM))
    if n_front == n_back and not indices:
        return np.zeros(shape)
    cos_low = np.sqrt(1.0 - np.arange(SQUARES) / (SQUARES - 1))[:, None]
    wave_nm = CURVE_NM if indices else np.array([D_LINE_NM])
    curves = stack_reflectance(n_front, n_back, indices, thicknesses_nm, wave_nm, cos_low)
    return np.broadcast_to(curves, shape)


def passed(curves: CoatingCurves, paths: Sequence[LightPath], squares: Floats) -> Floats:
    """Multiply R and T along paths, over the wavelengths.

    Parameters
    ----------
    curves : CoatingCurves
    paths : sequence of LightPath
        All with the same number M of mirrors.
    squares : ndarray, shape (P, N, M)
        Of N rays of each path: the squared sines on the side of the lower index at its mirrors.

    Returns
    -------
    ndarray, shape (P, L)
        The mean over the rays, at `CURVE_NM`.

    Notes
    -----
    Mirrors reflect at the rays' angles; the many surfaces that are passed, whose part in the colour is small, transmit
    as at normal incidence.
    """
    mirrors = np.array([path.mirrors for path in paths], dtype=np.int64).reshape(len(paths), -1)
    ends = np.array([path.rows[-1] + 1 for path in paths], dtype=np.int64)
    through = np.empty((len(paths), len(CURVE_NM)))
    multiply_mirrors(curves.reflectance, curves.log_through, mirrors, ends, np.ascontiguousarray(squares), through)
    return through


def bends(through: Floats, traced_nm: Floats) -> Floats:
    """Compare what paths pass with straight lines between the traced wavelengths.

    Parameters
    ----------
    through : ndarray, shape (P, L)
        From `passed`.
    traced_nm : ndarray, shape (W,)
        Rising.

    Returns
    -------
    ndarray, shape (P, L)
        What the straight lines must be multiplied by, at `CURVE_NM`; 1 at the traced wavelengths, up to the step of
        the table.
    """
    at_traced, joined = _straight(tuple(traced_nm))
    bend = np.empty_like(through)
    compare_with_lines(through, at_traced, joined, MOST_BEND, bend)
    return bend


@lru_cache(maxsize=64)
def _straight(traced_nm: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return what reads curves at the traced wavelengths, shape (L, W), and what joins these by lines, (W, L)."""
    at_traced = np.stack([np.interp(traced_nm, CURVE_NM, row) for row in np.eye(len(CURVE_NM))])
    joined = np.stack([np.interp(CURVE_NM, traced_nm, row) for row in np.eye(len(traced_nm))])
    return at_traced, joined


def mirror_squares_traced(packed: PackedLens, path: LightPath, tilt: float, points: Floats) -> Floats:
    """Tell at which angles real rays meet the mirrors of a path.

    Parameters
    ----------
    packed : PackedLens
    path : LightPath
    tilt : float
        From `optics.bundle.incidence`.
    points : ndarray, shape (N, 2)
        On the plane of the first vertex, meridional frame, mm.

    Returns
    -------
    ndarray, shape (N, M)
        Squared sines on the side of the lower index, at the middle traced wavelength; 1 under total reflection. Only
        of the rays that reach the sensor's plane, so there may be fewer.
    """
    n = packed.n_gap[len(packed.n_gap) // 2]
    squares = np.empty((len(points), len(path.mirrors)))
    count = traced_squares(
        path.rows, path.actions, packed.curvature, packed.form, packed.z_vertex, n, packed.sensor_z, tilt,
        packed.nearness, np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1]), squares,
    )  # fmt: skip
    return squares[:count]
