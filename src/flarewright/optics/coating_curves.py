"""What coatings do to a path's light between the traced wavelengths.

A coating's reflectance bends with the wavelength: a single film's is near 0 in the middle of the spectrum, a broadband
stack's rises steeply at the ends. Rays are expensive, films are not. So rays are traced at a few wavelengths, each with
the mean reflectances of the band that it stands for, and a path's colour is integrated over all wavelengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ..kernels.path_curves import multiply_steps
from ..kernels.standing import traced_squares
from ..model import Coating, Lens, Medium, Stop
from ..model.light import Spectrum
from .coatings import film_stack, stack_reflectance
from .dispersion import refractive_index
from .pack import REFLECTANCE_SAMPLES, PackedLens, SensorMirror
from .paraxial import D_LINE_NM, gap_indices
from .paths import LightPath
from .spectrum import VISIBLE_NM, band_shares

Floats = NDArray[np.float64]
# media in front and behind, indices and thicknesses of films in nm
_Surface = tuple[Medium | None, Medium | None, tuple[float, ...], tuple[float, ...]]

STEP_NM = 2.5
CURVE_NM = np.arange(VISIBLE_NM[0], VISIBLE_NM[1] + 0.5 * STEP_NM, STEP_NM)
"""Wavelengths at which colours of coatings are integrated."""

COSINES = 65
"""Entries of a curve against the cosine of incidence; R is linear between them within 6e-5 up to 60 degrees."""

__all__ = [
    "COSINES",
    "CURVE_NM",
    "BandCurves",
    "CoatingCurves",
    "PathSpectrum",
    "band_curves",
    "coating_curves",
    "joined_steps",
    "path_spectra",
    "step_squares",
]


# compared by identity: whoever asks for the same coatings again gets the same object (`_stacked`)
@dataclass(frozen=True, eq=False)
class CoatingCurves:
    """Reflectances of a lens' surfaces over the wavelengths.

    Attributes
    ----------
    reflectance : ndarray, shape (K, COSINES, L)
        R of each row against the cosine on the side of the lower index, uniform over [0, 1], at `CURVE_NM`.
    """

    reflectance: Floats


@dataclass(frozen=True, eq=False)
class BandCurves:
    """The same, and the means over the bands that some traced wavelengths stand for.

    Attributes
    ----------
    reflectance : ndarray, shape (K, COSINES, L + W)
        As in `CoatingCurves`, then the means over the band of each traced wavelength.
    """

    reflectance: Floats

    @cached_property
    def tables(self) -> Floats:
        """Means over the bands as `PackedLens.reflectance` holds them, shape (W, K, REFLECTANCE_SAMPLES)."""
        means = np.moveaxis(self.reflectance[:, :, len(CURVE_NM) :], 2, 0)
        place = np.linspace(0.0, COSINES - 1.0, REFLECTANCE_SAMPLES)
        cell = np.minimum(place.astype(np.intp), COSINES - 2)
        low = np.ascontiguousarray(means[:, :, :-1])
        rise = means[:, :, 1:] - low
        # kernels would be compiled for another order in memory once more; `take` keeps it
        tables = np.take(rise, cell, axis=2)
        tables *= place - cell
        tables += np.take(low, cell, axis=2)
        return tables


@dataclass(frozen=True)
class PathSpectrum:
    """What paths let pass, and what their traced rays carry of it.

    Attributes
    ----------
    passed : ndarray, shape (L,) or (P, L)
        Part of the light that passes, at `CURVE_NM`.
    carried : ndarray, shape (W,) or (P, W)
        The same with the means of the bands that the traced wavelengths stand for.
    """

    passed: Floats
    carried: Floats

    def of(self, path: int) -> PathSpectrum:
        """Return that of one path."""
        return PathSpectrum(self.passed[path], self.carried[path])


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
    """
    n_d = gap_indices(lens, D_LINE_NM)
    films = [
        ((), ()) if isinstance(row, Stop) else _films(coatings[k], float(n_d[k]), float(n_d[k + 1]))
        for k, row in enumerate(lens.rows)
    ]
    if not any(indices for indices, _ in films):
        return None
    surfaces: list[_Surface] = []
    front: Medium | None = None
    for row, (indices, thicknesses_nm) in zip(lens.rows, films, strict=True):
        # the stop is a plane in a gap
        back = front if isinstance(row, Stop) else row.medium
        surfaces.append((front, back, indices, thicknesses_nm))
        front = back
    return _stacked(tuple(surfaces), None if sensor is None else sensor.reflectance)


# every frame of a sequence asks for the same
@lru_cache(maxsize=1024)
def _films(coating: Coating | None, n_front: float, n_back: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return film_stack(coating, n_front, n_back)


@lru_cache(maxsize=16)
def _stacked(surfaces: tuple[_Surface, ...], sensor: float | None) -> CoatingCurves:
    rows = [_curves(*surface) for surface in surfaces]
    if sensor is not None:
        rows.append(np.full_like(rows[0], sensor))
    return CoatingCurves(np.stack(rows))


@lru_cache(maxsize=512)
def _curves(
    front: Medium | None, back: Medium | None, indices: tuple[float, ...], thicknesses_nm: tuple[float, ...]
) -> Floats:
    """R of one surface, shape (COSINES, L)."""
    if front == back and not indices:
        return np.zeros((COSINES, len(CURVE_NM)))
    if refractive_index(front, D_LINE_NM) > refractive_index(back, D_LINE_NM):
        front, back = back, front
        indices, thicknesses_nm = indices[::-1], thicknesses_nm[::-1]
    low, high = (np.broadcast_to(refractive_index(one, CURVE_NM), CURVE_NM.shape) for one in (front, back))
    cosine = np.linspace(0.0, 1.0, COSINES)[:, None]
    return stack_reflectance(low, high, indices, thicknesses_nm, CURVE_NM, cosine)


@lru_cache(maxsize=16)
def band_curves(curves: CoatingCurves, spectrum: Spectrum, wavelengths_nm: tuple[float, ...]) -> BandCurves:
    """Average coatings over the bands that traced wavelengths stand for.

    Parameters
    ----------
    curves : CoatingCurves
    spectrum : Spectrum
        Of the light: a band's mean is weighted by what the eye sees of it.
    wavelengths_nm : tuple of float
        Rising.

    Returns
    -------
    BandCurves

    Notes
    -----
    A film may leave nothing of a path at one wavelength and much beside it. Rays that carry the band's means carry
    light wherever the band has some, so that their weights can be set right (`PathSpectrum`).
    """
    shares = band_shares(spectrum, wavelengths_nm, CURVE_NM)
    return BandCurves(np.concatenate([curves.reflectance, curves.reflectance @ shares.T], axis=2))


# a moving hand asks for the same ones again and again
@lru_cache(maxsize=64)
def joined_steps(paths: tuple[LightPath, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Join the rows and the actions of paths, shape (steps,) each; and where each path begins, shape (P + 1,)."""
    starts = np.cumsum([0, *(len(path.rows) for path in paths)])
    steps = np.concatenate([path.steps for path in paths], axis=1)
    return steps[0], steps[1], starts


def path_spectra(curves: BandCurves, paths: Sequence[LightPath], squares: Floats) -> PathSpectrum:
    """Multiply R and T along paths, over the wavelengths.

    Parameters
    ----------
    curves : BandCurves
    paths : sequence of LightPath
    squares : ndarray, shape (N, steps)
        Of N rays of each path: the squared sines on the side of the lower index at the steps of all paths, one path
        after another (`step_squares`, `kernels.matrix.matrix_squares`).

    Returns
    -------
    PathSpectrum
        Of all paths: means over the rays.
    """
    through = np.empty((len(paths), curves.reflectance.shape[2]))
    multiply_steps(curves.reflectance, *joined_steps(tuple(paths)), np.ascontiguousarray(squares), through)
    return PathSpectrum(through[:, : len(CURVE_NM)], through[:, len(CURVE_NM) :])


def step_squares(packed: PackedLens, path: LightPath, tilt: float, points: Floats) -> Floats:
    """Compute at which angles real rays meet the surfaces of a path.

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
    ndarray, shape (N, S)
        Squared sines on the side of the lower index at every step, at the middle traced wavelength; 1 under total
        reflection. Only of the rays that reach the sensor's plane, so there may be fewer.
    """
    n = packed.n_gap[len(packed.n_gap) // 2]
    squares = np.empty((len(points), len(path.rows)))
    count = traced_squares(
        path.rows, path.actions, packed.curvature, packed.form, packed.z_vertex, n, packed.sensor_z, tilt,
        packed.nearness, np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1]), squares,
    )  # fmt: skip
    return squares[:count]
