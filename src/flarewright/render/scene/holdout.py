"""Holdouts: how much of a light, and which part of it, objects in front of the lens leave visible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np

from ...errors import ProjectError
from ...io.images.plate_image import read_depth, read_matte
from ...model import Lens, Light, Project
from ...model.project.holdout import Holdout
from ...optics.lens.paraxial import focal_lengths
from ...optics.lens.paths import direct_path
from ...optics.pupil.occlusion import hidden_part, visible_shape
from ...optics.pupil.polygon import backward, centroid, content, mapped, solid_angle
from ...typing import Floats, Pixels
from .area_lights import motion, traced_centre
from .shot import Shot, moved

# allowed difference between the aspect ratios of plate and picture, since both have whole pixels
ASPECT_TOLERANCE = 0.01
# a distance from which an object hides nothing, not even the sun, mm
FARTHEST_MM = 1e9

Plate = tuple[Holdout, Pixels]
"""A holdout with its opacity per pixel."""


def read_plates(project: Project, light: Light) -> tuple[Plate, ...]:
    """Read the holdouts of a light.

    Returns
    -------
    tuple of (Holdout, ndarray of shape (H, W))
        The project's and the light's; empty if there are none.

    Raises
    ------
    ProjectError
        A file cannot be read, or its aspect ratio differs from the picture's.
    """
    found = []
    for holdout in (project.holdout, light.holdout):
        if holdout is None:
            continue
        hidden = _hidden(holdout, light)
        rows, columns = hidden.shape
        width, height = (part * side for part, side in zip(holdout.frame, project.camera.size_px, strict=True))
        if abs(columns * height / (rows * width) - 1.0) > ASPECT_TOLERANCE + 1.0 / min(rows, columns):
            raise ProjectError(
                f"{holdout.image or holdout.depth}: the holdout is {columns}x{rows}, of another shape than the "
                f"picture's {width:.0f}x{height:.0f}; give an image of the picture's shape, larger or smaller"
            )
        found.append((holdout, hidden))
    return tuple(found)


def _hidden(holdout: Holdout, light: Light) -> Pixels:
    if holdout.image is not None:
        matte = read_matte(holdout.image)
        return matte if holdout.invert else np.float32(1.0) - matte
    assert holdout.depth is not None, "a holdout is an image or a depth plate"
    depth_mm = read_depth(holdout.depth) * holdout.depth_unit_mm
    nearest = min(inf if light.distance is None else light.distance, FARTHEST_MM)
    return (depth_mm < nearest).astype(np.float32)


def seen_part(lens: Lens, shot: Shot, plates: Sequence[Plate]) -> Shot | None:
    """Return the part of a light, or of a part of one, that its plates leave visible.

    Parameters
    ----------
    lens : Lens
    shot : Shot
    plates : sequence of Plate
        From `read_plates`.

    Returns
    -------
    Shot or None
        With the direction, light and border of the visible part; None if nothing is visible.

    Notes
    -----
    A plate is a picture: a direction meets it where the lens images that direction, given by the centroid of its direct
    rays and, over a part of an area light, by their motion. Where the lens passes no direct light, the ideal image
    position is used.
    """
    for holdout, hidden in plates:
        matrix, place = _to_plate(lens, shot, holdout, hidden.shape)
        if shot.border is None:
            seen = 1.0 - hidden_part(hidden, place)
            found = _scaled(shot, seen) if seen > 0.0 else None
        else:
            found = _cut(shot, matrix, place, hidden)
        if found is None:
            return None
        shot = found
    return shot


def _to_plate(lens: Lens, shot: Shot, holdout: Holdout, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Return the map from slopes, relative to the shot's own, to columns and rows of a plate: matrix and offset."""
    direct, here = direct_path(lens), np.tan(np.radians(shot.light.field_deg))
    order = shot.packed.first_order
    ideal = np.array(focal_lengths(order.efl, order.efl_x))
    centre = traced_centre(shot, direct, here)
    moves = None if shot.border is None or centre is None else motion(shot, direct)
    place = ideal * here if centre is None else centre[0]
    matrix = np.diag(ideal) if moves is None else moves[0]
    # pixels of the plate per mm, upright
    covered_px = np.array(shot.size_px) * holdout.frame * holdout.overscan
    zoom = shot.to_pixels[2:] * np.array(shape[::-1]) / covered_px * [1.0, -1.0]
    return zoom[:, None] * matrix, 0.5 * np.array(shape[::-1]) + zoom * place


def _scaled(shot: Shot, seen: float) -> Shot:
    light = shot.light.replace(intensity=shot.light.intensity * seen)
    return replace(shot, light=light, share=shot.share * seen)


def _cut(shot: Shot, matrix: Floats, place: Floats, hidden: Pixels) -> Shot | None:
    """Cut an area light by a plate; trace the remaining part from its own centre."""
    assert shot.border is not None, "a point has no border"
    on_plate = mapped(shot.border, matrix, place)
    # rows run downward, which reverses the orientation of areas
    mirrored = content(on_plate) < 0.0
    on_plate = backward(on_plate) if mirrored else on_plate
    if content(on_plate) <= 0.0:
        seen = 1.0 - hidden_part(hidden, place)
        return _scaled(shot, seen) if seen > 0.0 else None
    cut = visible_shape(on_plate, hidden)
    if cut is on_plate:
        return shot
    if not len(cut):
        return None
    back = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    left = mapped(backward(cut) if mirrored else cut, back, -(back @ place))
    here, offset = np.tan(np.radians(shot.light.field_deg)), centroid(left)
    there = here + offset
    # uniform radiance, so flux is proportional to solid angle
    before, after = (solid_angle(mapped(border, np.eye(2), here)) for border in (shot.border, left))
    found = _scaled(moved(shot, there), after / before)
    return replace(found, border=mapped(left, np.eye(2), -offset))
