"""The light that ghosts lie in: a sketch of the picture, before anything is drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import draw_bundle, measure_bundle, node_densities
from ..kernels.raster import blank_plane, to_pixels
from ..optics.border import points
from ..optics.bundle import Bundle, trace_grid
from .final_pass import FinalPass
from .spread import shape_kernel, spread

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Sketch = Callable[[FinalPass], Singles]

# pixels of the picture to one of the sketch
COARSE = 16
# largest errors of a sketched ghost: sketched pixels, and part of its flux
TOLERANCE_PX, FLUX_TOLERANCE = 0.5, 3e-2
# of the sketched colours only one is used
_ONE = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Surroundings:
    """How much light there is, roughly, around each place of a picture.

    Attributes
    ----------
    least : ndarray, shape (H, W)
        Irradiance of all ghosts that count, as `FinalPass.gain` and regions tell it: the least of nine neighbours.
    corners_px : ndarray, shape (2, 2)
        The picture's first and last corner, column and row.
    """

    least: Floats
    corners_px: Floats

    def moved(self, margins: tuple[int, int], detail: int) -> Surroundings:
        """Return the same for a sheet of lower resolution, whose halvings are counted, with margins on each side."""
        return Surroundings(self.least, self.corners_px / 2.0**detail + np.array(margins))


def surroundings(
    items: Sequence[FinalPass], run: Callable[[Sketch, Sequence[FinalPass]], Iterable[Singles]]
) -> Surroundings:
    """Sketch some ghosts of a picture.

    Parameters
    ----------
    items : sequence of FinalPass
        At least one. What is not among them counts as dark.
    run : callable
        Maps a function over the ghosts, on several threads if it likes, and returns what it found in their order.

    Returns
    -------
    Surroundings
    """
    width, height = _size(items[0].shot.size_px)
    total = np.zeros((height, width))
    for own in run(sketch, items):
        total += own
    wide = np.pad(total, 1, mode="edge")
    parts = [wide[y : y + height, x : x + width] for y in range(3) for x in range(3)]
    return Surroundings(np.minimum.reduce(parts), np.array([[0.0, 0.0], [width, height]]) * COARSE)


def sketch(item: FinalPass) -> Singles:
    """Draw a ghost at a sixteenth of the resolution.

    Parameters
    ----------
    item : FinalPass

    Returns
    -------
    ndarray, shape (ceil(H / COARSE), ceil(W / COARSE)), float32
        Irradiance, as its region and `FinalPass.gain` tell it.
    """
    shot, opening = item.shot, item.shot.opening
    width, height = _size(shot.size_px)
    place = item.to_pixels / COARSE
    plane = blank_plane(width, height)
    bundle = trace_grid(
        shot.packed, item.path, shot.incidence.tilt, (opening.radius, opening.inner), item.region,
        tolerance=TOLERANCE_PX, scale=float(place[2:].max()), view_radius=item.view_radius,
        flux_tolerance=FLUX_TOLERANCE, rough=1, one_color=True,
    )  # fmt: skip
    (data,) = bundle.traced.values()
    draw_bundle(
        data, bundle.pupil, bundle.triangles, node_densities(data, bundle.pupil, bundle.triangles),
        item.path.stop_crossings, opening.blades, opening.levels, shot.incidence.axes, place,
        unit(item, bundle, data) * float(place[2] * place[3]), _ONE, plane, bundle.halves,
    )  # fmt: skip
    light: Singles = to_pixels(plane, width)[..., :1]
    if item.source is not None and np.ptp(points(item.source), axis=0).max() > COARSE:
        light = spread(light, shape_kernel(item.source, 1.0 / COARSE)).astype(np.float32)
    return light[..., 0]


def unit(item: FinalPass, bundle: Bundle, data: Floats) -> float:
    """Tell what turns a bundle's flux at its middle wavelength into what its region and `FinalPass.gain` tell.

    One wavelength shows where the light goes; how much there is of it, all of them do.
    """
    sums = measure_bundle(
        data, bundle.pupil, bundle.triangles, item.path.stop_crossings, item.shot.opening.blades,
        item.shot.incidence.axes, bundle.halves,
    )  # fmt: skip
    return item.region.flux * item.gain / float(sums[0]) if sums[0] > 0.0 else 0.0


def _size(size_px: tuple[int, int]) -> tuple[int, int]:
    return -(-size_px[0] // COARSE), -(-size_px[1] // COARSE)
