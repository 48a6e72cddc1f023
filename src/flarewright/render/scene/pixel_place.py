"""The field angles at which a light has its direct image at a given pixel: the inverse of the traced direct image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np

from ...errors import ProjectError
from ...io.images.mask_image import read_mask
from ...model import Lens, Light
from ...optics.lens.paraxial import focal_lengths
from ...typing import Floats
from .direct_image import direct_place
from .opening import make_opening
from .resolve import ResolvedProject
from .shot import Shot, moved
from .shots import make_shots

# pixels that a place found may miss the wanted one; drawing needs 0.1
TOLERANCE_PX = 0.02
# traced places until the search ends; distorted lenses need four to six, one near its limit of field some twenty
MOST_STEPS = 40
# largest angle from the axis of a step, and of any light, radians
LARGEST_STEP, LARGEST_ANGLE = 0.35, radians(89.9)
# step at which the search ends, radians, and determinant of the map, in paraxial ones, below which it is folded
LEAST_STEP, FOLDED = 1e-9, 1e-6
# halvings between an angle at which the lens passes light and one at which it does not, for the error message
HALVINGS = 12


@dataclass(frozen=True)
class DirectImages:
    """The direct images that a light of a project has at any field angle.

    Attributes
    ----------
    lens : Lens
        As traced: zoomed, focused, with its plates.
    shot : Shot
        The light as a point on the axis.
    squeezed : tuple of float
        Focal lengths in the horizontal and the vertical meridian, mm.
    """

    lens: Lens
    shot: Shot
    squeezed: tuple[float, float]


def direct_images(settled: ResolvedProject, light: Light) -> DirectImages:
    """Prepare the direct images of a light.

    Parameters
    ----------
    settled : ResolvedProject
    light : Light
        Its distance and its spectrum count, which chooses the traced wavelengths. An area light counts as its centre.

    Raises
    ------
    ProjectError
        The light stands inside the lens.
    """
    point = light.replace(
        field_deg=(0.0, 0.0), keyframes=(), curves=(), diameter_deg=0.0, shape=None, holdout=None, intensity=1.0
    )
    project = settled.project.replace(lights=(point,), holdout=None, curves=())
    mask = None if settled.iris.mask is None else read_mask(settled.iris.mask)
    alone = replace(settled, project=project)
    efl = focal_lengths(settled.order.efl, settled.order.efl_x)
    return DirectImages(settled.lens, make_shots(alone, make_opening(alone, mask))[0], efl)


def image_px(images: DirectImages, field_deg: tuple[float, float]) -> tuple[float, float] | None:
    """Trace a light and return where its direct image is drawn.

    Parameters
    ----------
    images : DirectImages
    field_deg : tuple of float
        Field angles (X, Y).

    Returns
    -------
    tuple of float or None
        Column and row of the centroid, pixels from the top left corner of the picture, so that the centre of the first
        pixel is (0.5, 0.5). None if the lens passes no light at that angle.
    """
    place = direct_place(images.lens, moved(images.shot, np.tan(np.radians(field_deg))))
    if place is None:
        return None
    column, row, across, down = images.shot.to_pixels
    return float(column + place[0] * across), float(row - place[1] * down)


def field_angles_at(
    images: DirectImages, place_px: tuple[float, float], near_deg: tuple[float, float] | None = None
) -> tuple[float, float]:
    """Return the field angles of a light whose direct image lies at a place.

    Parameters
    ----------
    images : DirectImages
    place_px : tuple of float
        Column and row, as of `image_px`; it may lie outside the picture.
    near_deg : tuple of float, optional
        Field angles of a place near by, from which the search starts: the previous frame's.

    Returns
    -------
    tuple of float
        (X, Y) in degrees; `image_px` of them differs from the place by less than `TOLERANCE_PX`.

    Raises
    ------
    ProjectError
        The lens images no light at that place; the message says how far it does in that direction.

    Notes
    -----
    Broyden's method on the vector theta (cos phi, sin phi) of the angle from the axis, in which also the image of a
    fisheye is nearly linear. A step that leads to where the lens passes no light is halved. Tests:
    tests/render/scene/test_pixel_place.py compares with the centroid of drawn pictures.
    """
    column, row, across, down = images.shot.to_pixels
    pixels = np.array([across, -down]) * images.squeezed
    starts = [(np.array(place_px) - [column, row]) / pixels]
    if near_deg is not None:
        starts.insert(0, np.tan(np.radians(near_deg)))
    for start in starts:
        found = _search(images, np.array(place_px), angle_of(start), pixels)
        if found is not None:
            return field_deg_of(found)
    raise ProjectError(_beyond(images, place_px))


def _search(images: DirectImages, target: Floats, start: Floats, pixels: Floats) -> Floats | None:
    """Return the angle vector whose direct image lies at a target, from a start; None if none is found.

    `pixels` are those per radian near the axis, across and down.
    """
    at, found = start, _traced(images, start)
    while found is None and np.hypot(*at) > 1e-3:
        # beyond the lens' field: start further inside
        at = 0.7 * at
        found = _traced(images, at)
    if found is None:
        raise ProjectError(f"{images.lens.name} passes no light near its axis, so no pixel can be the place of a light")
    slope, held = np.diag(pixels), 1.0
    miss = target - found
    for _ in range(MOST_STEPS):
        if np.hypot(*miss) <= TOLERANCE_PX:
            return at
        step = held * np.linalg.solve(slope, miss)
        length = float(np.hypot(*step))
        if length < LEAST_STEP:
            return None
        step *= min(1.0, LARGEST_STEP / length)
        there = _traced(images, at + step) if np.hypot(*(at + step)) < LARGEST_ANGLE else None
        if there is None:
            held *= 0.5
            continue
        slope = slope + np.outer(there - (target - miss) - slope @ step, step) / (step @ step)
        if abs(np.linalg.det(slope)) < FOLDED * abs(np.prod(pixels)):
            # an update that folds the map: begin again from the paraxial one
            slope = np.diag(pixels)
        if np.hypot(*(target - there)) < np.hypot(*miss):
            at, miss, held = at + step, target - there, 1.0
        else:
            # farther away than before: a shorter step from the same place
            held = 0.5
    return None


def _traced(images: DirectImages, angle: Floats) -> Floats | None:
    """Return the place of an angle vector, pixels."""
    place = image_px(images, field_deg_of(angle))
    return None if place is None else np.array(place)


def field_deg_of(angle: Floats) -> tuple[float, float]:
    """Return the field angles of theta (cos phi, sin phi) in radians, the vector of an angle from the axis."""
    theta = float(np.hypot(*angle))
    x, y = np.degrees(np.arctan(angle * (np.tan(theta) / theta) if theta > 0.0 else angle))
    return float(x), float(y)


def angle_of(slope: Floats) -> Floats:
    """Return theta (cos phi, sin phi) in radians of tan theta (cos phi, sin phi)."""
    size = float(np.hypot(*slope))
    return slope * (np.arctan(size) / size) if size > 0.0 else slope


def last_lit(images: DirectImages, towards: Floats, steepest: float, halvings: int) -> float:
    """Return the last angle from the axis, radians, at which the lens images a light in a direction of the picture."""
    lit, dark = 0.0, steepest
    for _ in range(halvings):
        middle = 0.5 * (lit + dark)
        lit, dark = (middle, dark) if _traced(images, middle * towards) is not None else (lit, middle)
    return lit


def _beyond(images: DirectImages, place_px: tuple[float, float]) -> str:
    """Describe how far from the axis the lens images lights in the direction of a place."""
    column, row, across, down = images.shot.to_pixels
    wanted = (np.array(place_px) - [column, row]) / ([across, -down] * np.array(images.squeezed))
    azimuth = float(np.arctan2(wanted[1], wanted[0]))
    towards = np.array([cos(azimuth), sin(azimuth)])
    lit = last_lit(images, towards, LARGEST_ANGLE, HALVINGS)
    last = _traced(images, lit * towards)
    reach = 0.0 if last is None else float(np.hypot(*(last - [column, row])))
    far = float(np.hypot(*(np.array(place_px) - [column, row])))
    return (
        f"{images.lens.name} has no direct image at {place_px[0]:g},{place_px[1]:g} px, {far:.0f} px from the middle "
        f"of the picture: in that direction it images lights up to {reach:.0f} px ({np.degrees(lit):.1f} degrees); "
        "give a place inside, or field angles (--light)"
    )
