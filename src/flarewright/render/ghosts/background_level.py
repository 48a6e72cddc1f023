"""A coarse picture of all bright ghosts, from which the visibility of rings is judged before anything is drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.raster.bundle import draw_bundle, measure_bundle, node_densities
from ...kernels.raster.polygons import blank_plane, to_pixels
from ...optics.pupil.polygon import points
from ...optics.rays.bundle import Bundle, Refinement, trace_grid
from ...typing import Floats, Pixels
from .extent_blur import blur_by_extent, shape_kernel
from .final_pass import FinalPass

Sketch = Callable[[FinalPass], Pixels]

# pixels of the picture per pixel of the sketch, along each axis
COARSE = 16
# largest errors of a sketched ghost: in sketch pixels, and as a part of its flux
TOLERANCE_PX, FLUX_TOLERANCE = 0.5, 3e-2
# the sketch has one channel; the others get no light
_ONE_CHANNEL = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Surroundings:
    """Approximate irradiance around each place of a picture.

    Attributes
    ----------
    least : ndarray, shape (H, W)
        Irradiance of all sketched ghosts, scaled by their regions and `FinalPass.gain`: the minimum over 3 x 3 pixels.
    corners_px : ndarray, shape (2, 2)
        First and last corner of the picture, column and row.
    """

    least: Floats
    corners_px: Floats

    def moved(self, margins: tuple[int, int], detail: int) -> Surroundings:
        """Return the same for a canvas whose resolution is halved `detail` times, with margins on each side."""
        return Surroundings(self.least, self.corners_px / 2.0**detail + np.array(margins))


def surroundings(
    items: Sequence[FinalPass], run: Callable[[Sketch, Sequence[FinalPass]], Iterable[Pixels]]
) -> Surroundings:
    """Sketch ghosts of a picture.

    Parameters
    ----------
    items : sequence of FinalPass
        At least one. All other ghosts count as dark.
    run : callable
        Maps a function over the ghosts, possibly in several threads, and yields the results in order.
    """
    width, height = _size(items[0].shot.size_px)
    total = np.zeros((height, width))
    for own in run(sketch, items):
        total += own
    wide = np.pad(total, 1, mode="edge")
    parts = [wide[y : y + height, x : x + width] for y in range(3) for x in range(3)]
    return Surroundings(np.minimum.reduce(parts), np.array([[0.0, 0.0], [width, height]]) * COARSE)


def sketch(item: FinalPass) -> Pixels:
    """Draw a ghost at 1/16 of the resolution.

    Returns
    -------
    ndarray, shape (ceil(H / COARSE), ceil(W / COARSE)), float32
        Irradiance, scaled by the ghost's region and `FinalPass.gain`.
    """
    shot, opening = item.shot, item.shot.opening
    width, height = _size(shot.size_px)
    place = item.to_pixels / COARSE
    plane = blank_plane(width, height)
    bundle = trace_grid(
        shot.packed, item.path, shot.incidence.tilt, (opening.radius, opening.inner), item.region,
        Refinement(
            float(place[2:].max()), TOLERANCE_PX, item.view_radius, FLUX_TOLERANCE, rough=1, one_color=True
        ),
    )  # fmt: skip
    (data,) = bundle.traced.values()
    draw_bundle(
        data, bundle.pupil, bundle.triangles, node_densities(data, bundle.pupil, bundle.triangles),
        item.path.stop_crossings, opening.blades, opening.levels, shot.incidence.axes, place,
        flux_scale(item, bundle, data) * float(place[2] * place[3]), _ONE_CHANNEL, plane, bundle.halves,
    )  # fmt: skip
    light: Pixels = to_pixels(plane, width)[..., :1]
    if item.source is not None and np.ptp(points(item.source), axis=0).max() > COARSE:
        light = blur_by_extent(light, shape_kernel(item.source, 1.0 / COARSE)).astype(np.float32)
    return light[..., 0]


def flux_scale(item: FinalPass, bundle: Bundle, data: Floats) -> float:
    """Return the factor from a bundle's flux at its middle wavelength to the flux of its region times `FinalPass.gain`.

    One wavelength suffices for the distribution of the light, but its amount comes from all wavelengths.
    """
    sums = measure_bundle(
        data, bundle.pupil, bundle.triangles, item.path.stop_crossings, item.shot.opening.blades,
        item.shot.incidence.axes, bundle.halves,
    )  # fmt: skip
    return item.region.flux * item.gain / float(sums[0]) if sums[0] > 0.0 else 0.0


def _size(size_px: tuple[int, int]) -> tuple[int, int]:
    return -(-size_px[0] // COARSE), -(-size_px[1] // COARSE)
