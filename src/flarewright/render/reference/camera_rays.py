"""Area lights as the kernel for rays from the sensor reads them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...kernels.montecarlo.arguments import AreaLight, Chances, LightSums, PicturePoints, SpectralSamples
from ...kernels.montecarlo.backward import trace_camera_batch
from ...kernels.montecarlo.forward import BESIDE, IN_PICTURE, TALLIES
from ...kernels.tracing.intersect import AXES, ORIGIN, sag_of_shape
from ...optics.pupil.polygon import WEIGHT, mapped, points, solid_angle
from ...optics.rays.pack import PackedLens
from ...typing import Floats, Indices, Pixels
from ..scene.shot import Shot
from .shot_arrays import shot_arrays

# circles and directions that sample the last surface, and a margin for what lies between them
CIRCLES, DIRECTIONS, DISC_MARGIN = 17, 48, 1.01
# number of strips into which a border is divided
STRIPS = 64


@dataclass(frozen=True)
class CameraSource:
    """One area light with all its parts, and the lens, as kernel arguments.

    Attributes
    ----------
    shot : Shot
        Its first part.
    points : PicturePoints
    samples : SpectralSamples
    chances : Chances
    number : int
        Of the light.
    light : AreaLight
    """

    shot: Shot
    points: PicturePoints
    samples: SpectralSamples
    chances: Chances
    number: int
    light: AreaLight


def camera_source(
    shots: Sequence[Shot], samples: SpectralSamples, chances: Chances, *, count: int, light: int
) -> CameraSource:
    """Prepare an area light for rays from the sensor.

    Parameters
    ----------
    shots : sequence of Shot
        The parts of the light.
    samples : SpectralSamples
        For a light of irradiance 1 (`batches.spectrum_of`).
    chances : Chances
    count : int
        Points of the picture per batch.
    light : int
        Index that makes the random numbers independent of those of other lights.
    """
    shot = shots[0]
    border = np.concatenate([_bright(part) for part in shots])
    ends = points(border)
    distance = 0.0 if shot.light.distance is None else shot.light.distance
    to_pupil = distance + shot.packed.first_order.entrance_pupil_z if distance > 0.0 else 0.0
    bounds = np.array([*np.stack([ends.min(axis=0), ends.max(axis=0)], axis=1).ravel(), distance, to_pupil])
    in_strips, first = _in_strips(border)
    points_of_batch = PicturePoints(count, _rear_disc(shot))
    return CameraSource(shot, points_of_batch, samples, chances, light, AreaLight(in_strips, bounds, first))


def _in_strips(border: Floats) -> tuple[Floats, Indices]:
    """Sort edges into strips of the second coordinate, so that each ray tests few; also return the strips' starts."""
    low, high = np.minimum(border[:, 1], border[:, 3]), np.maximum(border[:, 1], border[:, 3])
    lines = np.linspace(low.min(), high.max(), STRIPS + 1)
    # rounding can move a ray into the next strip
    slack = 1e-9 * (lines[-1] - lines[0])
    inside = [np.flatnonzero((high >= a - slack) & (low <= b + slack)) for a, b in pairwise(lines)]
    return np.ascontiguousarray(border[np.concatenate(inside)]), np.cumsum([0, *map(len, inside)])


def _bright(shot: Shot) -> Floats:
    """Return the border of a part in slopes from the axis, with radiances as weights."""
    assert shot.border is not None, "a point has no radiance"
    here = np.tan(np.radians(shot.light.field_deg))
    border = mapped(shot.border, np.eye(2), here)
    # uniform radiance: irradiance is proportional to solid angle
    border[:, WEIGHT] *= shot.light.intensity / solid_angle(border)
    return border


def _rear_disc(shot: Shot) -> tuple[float, float]:
    """Bound the last surface as seen from the picture: z of its vertex, and a radius in that plane, mm."""
    packed = shot.packed
    # a reflecting sensor is a row too
    last = int(np.flatnonzero(packed.z_vertex < packed.sensor_z)[-1])
    vertex = float(packed.z_vertex[last])
    if packed.inv_semi[last] == 0.0:
        return vertex, shot.opening.radius
    radius = float(packed.semi[last]) * np.linspace(0.0, 1.0, CIRCLES)[:, None]
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    x, y = (radius * turned for turned in (np.cos(angle), np.sin(angle)))
    surface = np.stack([x, y, _height(packed, last, x, y)], axis=-1)
    if packed.shapes is not None:
        frame = packed.shapes[last]
        surface = surface @ frame[AXES : AXES + 9].reshape(3, 3) + frame[ORIGIN : ORIGIN + 3]
    height = surface[..., 2]
    # seen from the picture's edge, every point of the surface projects into the vertex plane
    reach, gap = shot.view_radius, packed.sensor_z - vertex
    part = gap / np.maximum(gap - height, 1e-3 * gap)
    across = np.hypot(surface[..., 0], surface[..., 1])
    return vertex, float((across * part + reach * np.abs(1.0 - part)).max()) * DISC_MARGIN


def _height(packed: PackedLens, row: int, x: Floats, y: Floats) -> Floats:
    """Return the height of a surface over its vertex plane, in its own frame, mm."""
    if packed.shapes is not None:
        heights = [sag_of_shape(packed.shapes, row, u, v)[0] for u, v in zip(x.ravel(), y.ravel(), strict=True)]
        return np.array(heights).reshape(x.shape)
    c, square = float(packed.curvature[row]), x * x + y * y
    root = np.sqrt(np.maximum(1.0 - (1.0 + packed.conic[row]) * c * c * square, 0.0))
    return np.asarray(c * square / (1.0 + root))


def run_camera(source: CameraSource, batch: int, planes: Pixels, paths: Floats) -> Floats:
    """Trace one batch of an area light from the sensor.

    Parameters
    ----------
    source : CameraSource
    batch : int
    planes : ndarray, shape (2, 3, H, W), float32
        Added to: flux per pixel after two reflections and after more.
    paths : ndarray, shape (2, K, K)
        Added to: luminous flux of two reflections in the picture.

    Returns
    -------
    ndarray, shape (4,)
        Luminous flux in the picture after 0, 2, 4 and more reflections.
    """
    tallies = np.zeros(TALLIES)
    lens, stop, frame = shot_arrays(source.shot)
    trace_camera_batch(
        lens, source.samples, source.points, source.chances, batch, source.number, stop, frame, source.light,
        LightSums(planes, tallies, paths),
    )  # fmt: skip
    return tallies[IN_PICTURE:BESIDE]
