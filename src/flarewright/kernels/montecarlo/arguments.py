"""Records that the Monte Carlo kernels take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...typing import Floats, Indices, Pixels
from ..jit.decorators import inner


class SpectralSamples(NamedTuple):
    """The wavelengths among which random rays choose.

    Attributes
    ----------
    cumulative : ndarray, shape (S,)
        Cumulative probability.
    luminances : ndarray, shape (S,)
        Luminance of each sample over its probability.
    rgbs : ndarray, shape (S, 3)
        Colour of each sample over its probability.
    heroes : int
        Wavelengths traced from each point, evenly spread over the cumulative probability.
    """

    cumulative: Floats
    luminances: Floats
    rgbs: Floats
    heroes: int


class Chances(NamedTuple):
    """Random numbers, and how many reflections of high order are followed.

    Attributes
    ----------
    boosts : ndarray, shape (4,)
        Probability over reflectance with which a reflection is followed: for the third and fourth reflection, and for
        later ones. Then the average number of rays that a ray may split off: after two or three reflections, and after
        more. The last must be below 1: otherwise oblique rays, whose R is much larger than the R from which the boosts
        were chosen, multiply without end.
    key : ndarray, shape (2,), uint64
        Selects, with the numbers of the batch and the light, the stream of random numbers.
    """

    boosts: Floats
    key: NDArray[np.uint64]


class FrontPoints(NamedTuple):
    """Where the rays of a light enter the lens.

    Attributes
    ----------
    direction : ndarray, shape (4,)
        Direction of the light's ray through the first vertex, and the light's nearness
        (`kernels.tracing.incident_light`), 0 for a distant light.
    axes : ndarray, shape (2, 2)
        Upright (x, y) of the axes of `box`.
    box : ndarray, shape (4,)
        x0, x1, y0, y1 in the plane of the first vertex; points are spread evenly in it.
    side : int
        A batch has side x side points, one at a random place in each cell of the box.
    first : int
        Row of the first surface.
    """

    direction: Floats
    axes: Floats
    box: Floats
    side: int
    first: int


class PicturePoints(NamedTuple):
    """Where rays from the camera start, and where they aim.

    Attributes
    ----------
    number : int
        Of points in a batch.
    rear : tuple of float
        z and radius of a disc that all light towards the sensor crosses, mm.
    """

    number: int
    rear: tuple[float, float]


class AreaLight(NamedTuple):
    """The radiance of area lights.

    Attributes
    ----------
    border : ndarray, shape (N, 5)
        Edges: slopes (tan X, tan Y) of both ends and the radiance, sorted by strips of tan Y; an edge is listed in
        every strip that it crosses.
    bounds : ndarray, shape (6,)
        Of the slopes; then the distances of the light from the first vertex and from the entrance pupil, mm, both 0
        for a distant light.
    strips : ndarray of int
        Index of the first edge of each strip, and the end of the last strip.
    """

    border: Floats
    bounds: Floats
    strips: Indices


class PictureFrame(NamedTuple):
    """Where the sensor's picture lies.

    Attributes
    ----------
    to_pixels : ndarray, shape (4,)
        Column and row of the axis, pixels per mm right and up.
    size : tuple of int
        Width and height, pixels.
    """

    to_pixels: Floats
    size: tuple[int, int]


class LightSums(NamedTuple):
    """Sums of the light where it ends, which the kernels add to.

    Attributes
    ----------
    planes : ndarray, shape (2, 3, H, W), float32
        Flux per pixel after two reflections, and after more; height 0 for no picture.
    tallies : ndarray, shape (TALLIES,)
        Luminous flux by where it ended (`kernels.montecarlo.forward`).
    paths : ndarray, shape (2, K, K)
        Luminous flux after two reflections by their rows (j, i), in the picture and beside it.
    """

    planes: Pixels
    tallies: Floats
    paths: Floats


class Scattering(NamedTuple):
    """Scatter of the direct light, and the sums of scattered light, which the kernels add to.

    Attributes
    ----------
    tables : ndarray, shape (S, K, 2, M) or, at one wavelength, (K, 2, M)
    amounts : ndarray, shape (S, K, 2) or (K, 2)
        Scatter of the rows (`kernels.scattering.single_scatter.scattered_density`).
    strays : ndarray, shape (STRAYS,)
        Luminous flux of scattered light by where it ended (`kernels.montecarlo.scattered_rays`).
    plane : ndarray, shape (3, H, W), float32
        Flux per pixel; height 0 for no picture.
    """

    tables: Floats
    amounts: Floats
    strays: Floats
    plane: Pixels


class Ray(NamedTuple):
    """A ray that starts, and its light.

    Attributes
    ----------
    start : ndarray, shape (6,)
        Place, mm, and unit direction.
    forward : int
        1: it starts in front of row 0; -1: behind the last row.
    unit, luminance : float
        Its flux for the picture, and the luminance of its wavelength.
    rgb : ndarray, shape (3,)
        Colour of its wavelength.
    """

    start: Floats
    forward: int
    unit: float
    luminance: float
    rgb: Floats


class Scratch(NamedTuple):
    """Memory of one thread: state of its random numbers, four of them, and rays that wait."""

    stream: NDArray[np.uint64]
    pool: Floats
    stack: Floats


@inner
def scattering_at(scatter, s):
    """Return the scatter of one spectral sample, or None."""
    if scatter is None:
        return None
    return Scattering(scatter.tables[s], scatter.amounts[s], scatter.strays, scatter.plane)
