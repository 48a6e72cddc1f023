"""Transmission of paths by coatings over all wavelengths, also between the traced ones.

A coating's reflectance varies strongly with wavelength: a single film's is near 0 in the middle of the spectrum, a
broadband stack's rises steeply at the ends. Tracing rays is expensive, evaluating films is cheap. So rays are traced at
a few wavelengths, each with the mean reflectances of its band, and a path's colour is integrated over all wavelengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np

from ...colorimetry import VISIBLE_NM
from ...kernels.paraxial.path_reflectance import path_throughput, ray_throughput, throughput_between
from ...model import Coating, Lens, Medium, Stop
from ...model.project.light import Spectrum
from ...typing import Floats, Indices
from ..coatings.thin_film import film_stack, stack_reflectance
from ..colour.spectrum import band_shares, cubics
from ..lens.dispersion import D_LINE_NM, refractive_index
from ..lens.paraxial import gap_indices
from ..lens.paths import LightPath
from .pack import REFLECTANCE_SAMPLES, PackedLens, SensorMirror
from .pupil_region import tracing_arguments

# key of a surface: media in front and behind, indices and thicknesses of films in nm
_Surface = tuple[Medium | None, Medium | None, tuple[float, ...], tuple[float, ...]]

CURVE_NM = np.concatenate([
    np.arange(VISIBLE_NM[0], 700.0, 2.5), np.arange(700.0, 800.0, 5.0), [802.5, 810.0, 820.0, VISIBLE_NM[1]],
])  # fmt: skip
"""Integration wavelengths for colours of coatings: dense where the eye sees much."""

COSINES = 65
"""Samples of a curve over the cosine of incidence; a line between them errs by 6e-5 of R at most up to 60 degrees."""


# compared by identity: the cache (`_stacked`) returns one object for equal coatings
@dataclass(frozen=True, eq=False)
class CoatingCurves:
    """Reflectances of a lens' surfaces over wavelength.

    Attributes
    ----------
    reflectance : ndarray, shape (K, COSINES, L)
        R of each row against the cosine on the side of the lower index, uniform over [0, 1], at `CURVE_NM`.
    """

    reflectance: Floats


@dataclass(frozen=True, eq=False)
class BandCurves:
    """Reflectances as in `CoatingCurves`, and their means over the bands of traced wavelengths.

    Attributes
    ----------
    reflectance : ndarray, shape (K, COSINES, L + W)
        As in `CoatingCurves`, then the means over the band of each traced wavelength.
    """

    reflectance: Floats

    @cached_property
    def means(self) -> Floats:
        """The means over the bands alone, shape (K, COSINES, W)."""
        return np.ascontiguousarray(self.reflectance[:, :, len(CURVE_NM) :])

    @cached_property
    def tables(self) -> Floats:
        """Means over the bands in the layout of `PackedLens.reflectance`, shape (W, K, REFLECTANCE_SAMPLES)."""
        means = np.ascontiguousarray(np.moveaxis(self.reflectance[:, :, len(CURVE_NM) :], 2, 0))
        # another memory order would compile the kernels a second time; `take` keeps it
        tables = np.zeros((*means.shape[:2], REFLECTANCE_SAMPLES))
        for nodes, weights in zip(*_cosine_cubics(), strict=True):
            tables += weights * np.take(means, nodes, axis=2)
        return tables


@cache
def _cosine_cubics() -> tuple[Indices, Floats]:
    """Return the four nodes of `COSINES` around each of `REFLECTANCE_SAMPLES`, and their weights, (4, M) each."""
    weights = cubics(np.linspace(0.0, COSINES - 1.0, REFLECTANCE_SAMPLES), np.arange(COSINES, dtype=np.float64))
    nodes = np.argsort(-np.abs(weights), axis=0, kind="stable")[:4]
    return nodes, np.take_along_axis(weights, nodes, axis=0)


@dataclass(frozen=True)
class PathSpectrum:
    """Transmission of paths, and the part of it that their traced rays carry.

    Attributes
    ----------
    passed : ndarray, shape (L,) or (P, L)
        Fraction of the light that passes, at `CURVE_NM`.
    carried : ndarray, shape (W,) or (P, W)
        The same from the means over the bands of the traced wavelengths.
    """

    passed: Floats
    carried: Floats

    def of(self, path: int) -> PathSpectrum:
        """Return the spectrum of one path."""
        return PathSpectrum(self.passed[path], self.carried[path])


def coating_curves(
    lens: Lens, coatings: tuple[Coating | None, ...], sensor: SensorMirror | None = None
) -> CoatingCurves | None:
    """Tabulate the coatings of a lens over wavelength.

    Parameters
    ----------
    lens : Lens
    coatings : tuple of Coating or None
        One per row (`optics.rays.pack.resolve_coatings`).
    sensor : SensorMirror, optional
        The sensor as the last row.

    Returns
    -------
    CoatingCurves or None
        None without films: bare glass reflects almost equally at all wavelengths.
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


# cached: every frame of a sequence needs the same films
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
    """Return R of one surface, shape (COSINES, L)."""
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
    """Average coatings over the bands of traced wavelengths.

    Parameters
    ----------
    curves : CoatingCurves
    spectrum : Spectrum
        Of the light; it weights a band's mean, with the eye's sensitivity.
    wavelengths_nm : tuple of float
        Ascending.

    Notes
    -----
    A film can make a path dark at one wavelength and bright next to it. Rays with the band's means carry light wherever
    the band has some, so that their weights can be corrected (`PathSpectrum`).
    """
    shares = band_shares(spectrum, wavelengths_nm, CURVE_NM)
    return BandCurves(np.concatenate([curves.reflectance, curves.reflectance @ shares.T], axis=2))


# cached: interactive edits use the same groups repeatedly
@lru_cache(maxsize=64)
def joined_steps(paths: tuple[LightPath, ...]) -> tuple[Indices, Indices, Indices]:
    """Return the concatenated rows and actions of paths, shape (steps,) each, and each path's start, shape (P + 1,)."""
    starts = np.cumsum([0, *(len(path.rows) for path in paths)])
    steps = np.concatenate([path.steps for path in paths], axis=1)
    return steps[0], steps[1], starts


def path_spectra(curves: BandCurves, paths: Sequence[LightPath], squares: Floats) -> PathSpectrum:
    """Multiply R and T along paths for all wavelengths.

    Parameters
    ----------
    curves : BandCurves
    paths : sequence of LightPath
    squares : ndarray, shape (N, steps)
        Of N rays per path: squared sines on the side of the lower index at the steps of all concatenated paths; 1 under
        total reflection.

    Returns
    -------
    PathSpectrum
        Of all paths; means over the rays.
    """
    through = np.empty((len(paths), curves.reflectance.shape[2]))
    path_throughput(
        np.ascontiguousarray(curves.reflectance), *joined_steps(tuple(paths)), np.ascontiguousarray(squares), through
    )
    return PathSpectrum(through[:, : len(CURVE_NM)], through[:, len(CURVE_NM) :])


def products_between(
    reflectance: Floats, paths: Sequence[LightPath], squares: Floats, nodes: Floats, shares: Floats
) -> Floats:
    """Multiply R and T along one ray of each path whose angles at the mirrors change with the wavelength.

    Parameters
    ----------
    reflectance : ndarray, shape (K, COSINES, M)
        Any columns of `BandCurves.reflectance`.
    paths : sequence of LightPath
    squares : ndarray, shape (steps,)
        Squared sines at the steps of all concatenated paths, used where light is transmitted.
    nodes : ndarray, shape (N, steps)
        The same at N wavelengths, used at the mirrors.
    shares : ndarray, shape (N, M)
        Part that each of them has in each column.

    Returns
    -------
    ndarray, shape (P, M)
    """
    through = np.empty((len(paths), reflectance.shape[2]))
    throughput_between(
        np.ascontiguousarray(reflectance), *joined_steps(tuple(paths)), np.ascontiguousarray(squares),
        np.ascontiguousarray(nodes), np.ascontiguousarray(shares), through,
    )  # fmt: skip
    return through


def spectra_of_rays(
    packed: PackedLens, path: LightPath, tilt: float, curves: BandCurves, points: Floats, wave: int
) -> PathSpectrum | None:
    """Multiply R and T along a path at the angles of traced rays, for all wavelengths.

    Parameters
    ----------
    packed : PackedLens
    path : LightPath
    tilt : float
        From `optics.rays.bundle.incidence`.
    curves : BandCurves
    points : ndarray, shape (N, 2)
        On the plane of the first vertex, meridional frame, mm.
    wave : int
        Index of the traced wavelength.

    Returns
    -------
    PathSpectrum or None
        Two means: of every other ray that reaches the sensor's plane, and of the rest. None if no ray does.
    """
    through = np.empty((2, curves.reflectance.shape[2]))
    x, y = np.ascontiguousarray(points.T)
    reached = ray_throughput(
        *tracing_arguments(packed, wave, path, tilt), x, y, path.stop_crossings,
        np.ascontiguousarray(curves.reflectance), through,
    )  # fmt: skip
    if reached == 0:
        return None
    return PathSpectrum(through[:, : len(CURVE_NM)], through[:, len(CURVE_NM) :])
