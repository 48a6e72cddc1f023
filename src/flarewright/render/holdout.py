"""What stands between the lights and the lens: how much of a light, and which part of it, is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..io.plate_image import read_depth, read_matte
from ..model import Lens, Light, Project
from ..model.holdout import Holdout
from ..optics.border import backward, centroid, content, mapped, solid_angle
from ..optics.holdout import behind, hidden_at
from ..optics.paths import direct_path
from .shot import Shot, moved
from .sources import motion, traced_centre

Floats = NDArray[np.float64]

# a plate may differ from the picture's shape by so much, for it has whole pixels too
SHAPE = 0.01
# what is so far away hides nothing, not even the sun, mm
NOTHING_MM = 1e9

__all__ = ["Plate", "read_plates", "seen_part"]

Plate = tuple[Holdout, NDArray[np.float32]]
"""A holdout, and the part of a light that each of its pixels takes."""


def read_plates(project: Project, light: Light) -> tuple[Plate, ...]:
    """Read what hides a light.

    Parameters
    ----------
    project : Project
    light : Light

    Returns
    -------
    tuple of (Holdout, ndarray of shape (H, W))
        The project's and its own; none when there is nothing.

    Raises
    ------
    ProjectError
        When a file cannot be read, or has another shape than the picture.
    """
    found = []
    width, height = project.camera.size_px
    for holdout in (project.holdout, light.holdout):
        if holdout is None:
            continue
        hidden = _hidden(holdout, light)
        rows, columns = hidden.shape
        if abs(columns * height / (rows * width) - 1.0) > SHAPE + 1.0 / min(rows, columns):
            raise ProjectError(
                f"{holdout.image or holdout.depth}: the holdout is {columns}x{rows}, of another shape than the "
                f"picture's {width}x{height}; give an image of the picture's shape, larger or smaller"
            )
        found.append((holdout, hidden))
    return tuple(found)


def _hidden(holdout: Holdout, light: Light) -> NDArray[np.float32]:
    if holdout.image is not None:
        matte = read_matte(holdout.image)
        return matte if holdout.invert else np.float32(1.0) - matte
    assert holdout.depth is not None, "a holdout is an image or a depth plate"
    depth_mm = read_depth(holdout.depth) * holdout.depth_unit_mm
    nearest = min(inf if light.distance is None else light.distance, NOTHING_MM)
    return (depth_mm < nearest).astype(np.float32)


def seen_part(lens: Lens, shot: Shot, plates: Sequence[Plate]) -> Shot | None:
    """Leave of a light, or of a part of one, what its plates leave.

    Parameters
    ----------
    lens : Lens
    shot : Shot
    plates : sequence of Plate
        From `read_plates`.

    Returns
    -------
    Shot or None
        With the direction, the light and the border of what is seen; None when nothing is.

    Notes
    -----
    A plate is a picture: a direction meets it where the lens images it, by the centroid of its direct rays, and by
    their motion over a part of an area light. Where the lens passes no direct light, the ideal image takes its place.
    """
    for holdout, hidden in plates:
        matrix, place = _to_plate(lens, shot, holdout, hidden.shape)
        if shot.border is None:
            seen = 1.0 - hidden_at(hidden, place)
            found = _dimmed(shot, seen) if seen > 0.0 else None
        else:
            found = _cut(shot, matrix, place, hidden)
        if found is None:
            return None
        shot = found
    return shot


def _to_plate(lens: Lens, shot: Shot, holdout: Holdout, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Return how slopes from a shot's own go to columns and rows of a plate: a matrix, and where its own goes."""
    direct, here = direct_path(lens), np.tan(np.radians(shot.light.field_deg))
    order = shot.packed.first_order
    ideal = np.array([order.efl if order.efl_x is None else order.efl_x, order.efl])
    centre = traced_centre(shot, direct, here)
    moves = None if shot.border is None or centre is None else motion(shot, direct)
    place = ideal * here if centre is None else centre[0]
    matrix = np.diag(ideal) if moves is None else moves[0]
    # pixels of the plate per mm, upright
    zoom = shot.to_pixels[2:] * np.array(shape[::-1]) / (np.array(shot.size_px) * holdout.overscan) * [1.0, -1.0]
    return zoom[:, None] * matrix, 0.5 * np.array(shape[::-1]) + zoom * place


def _dimmed(shot: Shot, seen: float) -> Shot:
    light = shot.light.replace(intensity=shot.light.intensity * seen)
    return replace(shot, light=light, share=shot.share * seen)


def _cut(shot: Shot, matrix: Floats, place: Floats, hidden: NDArray[np.float32]) -> Shot | None:
    """Cut an area light by a plate, and trace what is left of it from its own middle."""
    assert shot.border is not None, "a point has no border"
    on_plate = mapped(shot.border, matrix, place)
    # rows run downward, so areas are counter-clockwise the other way round
    mirrored = content(on_plate) < 0.0
    on_plate = backward(on_plate) if mirrored else on_plate
    if content(on_plate) <= 0.0:
        seen = 1.0 - hidden_at(hidden, place)
        return _dimmed(shot, seen) if seen > 0.0 else None
    cut = behind(on_plate, hidden)
    if cut is on_plate:
        return shot
    if not len(cut):
        return None
    back = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    left = mapped(backward(cut) if mirrored else cut, back, -(back @ place))
    here, offset = np.tan(np.radians(shot.light.field_deg)), centroid(left)
    there = here + offset
    # even radiance, so light goes by solid angle
    before, after = (solid_angle(mapped(border, np.eye(2), here)) for border in (shot.border, left))
    found = _dimmed(moved(shot, there), after / before)
    return replace(found, border=mapped(left, np.eye(2), -offset))
