"""Projects whose targets are the ghosts of a photograph or of a measured flare."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan, atan2, degrees, hypot, radians, tan
from pathlib import Path

import numpy as np

from ...design.problem.photo_targets import PhotoGhost, seen_project
from ...errors import FlarewrightError, ProjectError
from ...io.images.picture import read_picture
from ...io.measurement.ghost_model_file import read_ghost_model
from ...measure.core.measured_side import measured_side
from ...measure.core.parameter_vector import visible
from ...measure.detection.single_image import Spot, spots_of_model, spots_of_picture
from ...model import Project
from ...model.measurement.ghost_model import GhostModel
from ..defaults import WIDTH_MM

# radius around the light's image without a search for ghosts, as a fraction of the picture's width
_GLOW = 0.06
# number of constellations of the measured range among which the one with most ghosts is chosen
_TRIED = 40
LEAST_DEG = 0.5
"""Smallest constellation whose ghosts can be explained: on the axis all lie at the middle."""


def project_of_model(
    source: Path, lights_deg: Sequence[tuple[float, float]], width_mm: float | None, most: int
) -> Project:
    """Return a project whose targets are a measured flare's ghosts for given lights.

    Parameters
    ----------
    source : Path
        A ghost model.
    lights_deg : sequence of tuple of float
        Field angles of the lights, right and up.
    width_mm : float or None
        Width of the sensor. None: the model's, else 36 mm.
    most : int
        Largest number of ghosts of a light, most visible first.

    Raises
    ------
    FlarewrightError
        When the model cannot be read, or has no ghosts there.
    """
    model = read_ghost_model(source)
    width = width_mm or model.sensor_width_mm or WIDTH_MM
    pixel = width / model.size_px[0]
    lights = []
    for x, y in lights_deg:
        constellation = degrees(atan(hypot(tan(radians(x)), tan(radians(y)))))
        # the side where the light lies, if it was measured: a ghost may have been found on one side only
        side, _ = measured_side(model, -constellation if x < 0.0 else constellation)
        lights.append(((x, y), _striking(spots_of_model(model, side), pixel, most)))
    sensor = (width, width * model.size_px[1] / model.size_px[0])
    return seen_project(lights, size_px=model.size_px, sensor_mm=sensor, focal_mm=model.focal_px * pixel)


def project_of_picture(
    source: Path, light_deg: tuple[float, float], width_mm: float, focal_mm: float | None, most: int
) -> Project:
    """Return a project whose targets are the ghosts found in a photograph.

    Parameters
    ----------
    source : Path
        An EXR, PNG or other picture.
    light_deg : tuple of float
        Field angles of the light, right and up.
    width_mm : float
        Width of the sensor.
    focal_mm : float or None
        Focal length. None: the light's image may be found as a ghost.
    most : int
        Largest number of ghosts, most visible first.

    Raises
    ------
    FlarewrightError
        When the picture cannot be read, is too small, or shows no ghosts.
    """
    pixels = read_picture(source)
    high, wide = pixels.shape[:2]
    if min(high, wide) < 32:
        raise ProjectError(f"{source} is {wide} by {high} pixels, too small to find ghosts in")
    x, y = (tan(radians(angle)) for angle in light_deg)
    pixel, axis = width_mm / wide, (0.5 * wide, 0.5 * high)
    hidden = None
    if focal_mm is not None:
        place = axis[0] + focal_mm * x / pixel, axis[1] - focal_mm * y / pixel
        rows, columns = np.indices((high, wide)) + 0.5
        hidden = np.hypot(columns - place[0], rows - place[1]) < _GLOW * wide
    spots = spots_of_picture(pixels, axis, degrees(atan2(y, x)), hidden=hidden)
    sensor = (width_mm, width_mm * high / wide)
    ghosts = _striking(spots, pixel, most)
    return seen_project([(light_deg, ghosts)], size_px=(wide, high), sensor_mm=sensor, focal_mm=focal_mm)


def _striking(spots: tuple[Spot, ...], pixel: float, most: int) -> list[PhotoGhost]:
    """Return the most visible ghosts in mm: those with the most light on their border."""
    by_light = sorted(spots, key=lambda one: -sum(one.rgb) * one.radius_px)
    return [PhotoGhost(one.place_px * pixel, one.radius_px * pixel, one.rgb) for one in by_light[:most]]


def busiest_constellation(model: GhostModel) -> float:
    """Return the constellation at which most ghosts are visible, degrees; the smallest of several.

    Raises
    ------
    FlarewrightError
        When the model has no ghosts off the axis.
    """
    low, high = model.constellation_deg
    tried = [float(angle) for angle in np.linspace(low, high, _TRIED) if abs(angle) >= LEAST_DEG]
    if not tried or not model.ghosts:
        raise FlarewrightError("the model has no ghosts off the axis, so there is nothing to explain")
    return max(tried, key=lambda angle: (float(visible(model.ghosts, angle).sum()), -abs(angle)))
