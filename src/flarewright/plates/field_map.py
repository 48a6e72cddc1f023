"""Field angles and solid angles of the pixels of a plate: the traced direct image of the lens, inverted.

The direct image is traced at some places and interpolated between them: along one radius if the lens is symmetric, on a
grid over the picture otherwise. The interpolated quantity is the angle from the axis, which is nearly linear in the
place also for a fisheye.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline

from ..errors import ProjectError
from ..model import Light
from ..render.scene.pixel_place import (
    DirectImages,
    angle_of,
    direct_images,
    field_angles_at,
    field_deg_of,
    image_px,
    last_lit,
)
from ..render.scene.resolve import ResolvedProject
from ..typing import Floats

# traced places along the radius, and along each side of the picture
_RADII, _SIDE = 21, 9
_LEAST_RADII = 4
# largest angle from the axis, radians, and halvings until the last angle that a lens images is known
_STEEPEST, _HALVINGS = 1.56, 14
# places beyond the corner and the border, pixels of the camera: an area light may reach out of the picture
_BEYOND = 1.02
# step of the derivative, pixels
_STEP_PX = 0.5


@dataclass(frozen=True)
class FieldMap:
    """Directions of the places of a picture.

    Attributes
    ----------
    angles : callable
        Angle vectors theta (cos phi, sin phi) in radians, shape (N, 2), of columns and rows, shape (N, 2); NaN where
        the lens images nothing.
    """

    angles: Callable[[Floats], Floats]

    def slopes(self, places_px: Floats) -> Floats:
        """Return tan X and tan Y of places, shape (N, 2); NaN where the lens images nothing.

        Parameters
        ----------
        places_px : ndarray, shape (N, 2)
            Columns and rows of the camera's picture, from its top left corner.
        """
        angle = self.angles(places_px)
        theta = np.hypot(angle[:, 0], angle[:, 1])
        return angle * np.where(theta > 1e-9, np.tan(theta) / np.maximum(theta, 1e-9), 1.0)[:, None]

    def jacobians(self, places_px: Floats) -> Floats:
        """Return the change of the slopes per column and per row, shape (N, 2, 2), slopes along axis 1."""
        columns = []
        for axis in np.eye(2) * _STEP_PX:
            columns.append((self.slopes(places_px + axis) - self.slopes(places_px - axis)) / (2.0 * _STEP_PX))
        return np.stack(columns, axis=2)

    def solid_angles(self, places_px: Floats) -> Floats:
        """Return the solid angle of a pixel at each place, shape (N,), steradian.

        Notes
        -----
        An area dA of slopes (tan X, tan Y) subtends dA / (1 + tan^2 X + tan^2 Y)^(3/2).
        """
        slopes, change = self.slopes(places_px), self.jacobians(places_px)
        area = np.abs(change[:, 0, 0] * change[:, 1, 1] - change[:, 0, 1] * change[:, 1, 0])
        return np.asarray(area / (1.0 + (slopes**2).sum(axis=1)) ** 1.5)


def field_map(settled: ResolvedProject) -> FieldMap:
    """Trace the direct image of a lens over its picture.

    Raises
    ------
    ProjectError
        The lens images nothing near its axis.

    Notes
    -----
    tests/plates/test_field_map.py compares with the exact inverse between the traced places.
    """
    images = direct_images(settled, Light(field_deg=(0.0, 0.0)))
    return FieldMap(_radial(images) if images.shot.packed.symmetric else _over_grid(images))


def _radial(images: DirectImages) -> Callable[[Floats], Floats]:
    """Return the angles of a symmetric lens."""
    column, row, across, down = images.shot.to_pixels
    width, height = images.shot.size_px
    corner = _BEYOND * float(np.hypot(0.5 * width / across, 0.5 * height / down))
    last = _last_angle(images, corner * across)
    # traced forwards, so that no tolerance of an inverse roughens the solid angles
    angles = np.linspace(0.0, last, _RADII)
    radii = np.zeros(_RADII)
    for k, angle in enumerate(angles[1:], 1):
        place = image_px(images, (float(np.degrees(angle)), 0.0))
        radii[k] = np.nan if place is None else (place[0] - column) / across
    known = np.isfinite(radii)
    # a lens that folds its image has no inverse beyond the fold
    known &= np.concatenate([[True], np.cumprod(np.diff(np.where(known, radii, -1.0)) > 0.0).astype(np.bool_)])
    if known.sum() < _LEAST_RADII:
        raise ProjectError(f"{images.lens.name} images too little of the picture for a plate; check --sensor")
    # an odd function, so that its slope is continuous on the axis
    at, value = radii[known], angles[known]
    spline = CubicSpline(np.concatenate([-at[:0:-1], at]), np.concatenate([-value[:0:-1], value]))

    def angles_of(places_px: Floats) -> Floats:
        offset = (places_px - [column, row]) / [across, -down]
        radius = np.hypot(offset[:, 0], offset[:, 1])
        # a little beyond the last place: a derivative there needs it
        theta = np.where(radius <= at[-1] + 2.0 / across, spline(radius), np.nan)
        ratio = np.where(radius > 1e-9, theta / np.maximum(radius, 1e-9), spline(0.0, 1))
        return np.asarray(offset * ratio[:, None])

    return angles_of


def _last_angle(images: DirectImages, radius_px: float) -> float:
    """Return the angle from the axis of a place to the right of it, radians, or the last angle that the lens images."""
    column, row = images.shot.to_pixels[:2]
    try:
        return float(np.radians(field_angles_at(images, (float(column + radius_px), float(row)))[0]))
    except ProjectError:
        return last_lit(images, np.array([1.0, 0.0]), _STEEPEST, _HALVINGS)


def _over_grid(images: DirectImages) -> Callable[[Floats], Floats]:
    """Return the angles of any lens."""
    width, height = images.shot.size_px
    sides = []
    for side in (width, height):
        reach = 0.5 * side * _BEYOND
        sides.append(0.5 * side + np.linspace(-reach, reach, _SIDE))
    traced = np.full((_SIDE, _SIDE, 2), np.nan)
    per_radian = images.shot.to_pixels[2:] * [1.0, -1.0] * images.squeezed
    # from the middle outwards: each place starts at a neighbour that is known
    order = sorted(np.ndindex(_SIDE, _SIDE), key=lambda at: max(abs(at[0] - _SIDE // 2), abs(at[1] - _SIDE // 2)))
    for i, j in order:
        inner = tuple(k + int(np.sign(_SIDE // 2 - k)) for k in (i, j))
        near = traced[inner]
        start = None if np.isnan(near).any() else field_deg_of(near)
        try:
            x, y = field_angles_at(images, (float(sides[0][i]), float(sides[1][j])), start)
        except ProjectError:
            continue
        there = image_px(images, (x, y))
        assert there is not None, "an inverse is traced"
        traced[i, j] = angle_of(np.tan(np.radians([x, y])))
        # the miss of the inverse, paraxially
        traced[i, j] += (np.array([sides[0][i], sides[1][j]]) - there) / per_radian
    known = np.isfinite(traced[..., 0])
    if known.sum() < 16:
        raise ProjectError(f"{images.lens.name} images too little of the picture for a plate; check --sensor")
    splines = [RectBivariateSpline(*sides, _continued(traced[..., axis], known, sides)) for axis in (0, 1)]
    dark = None if known.all() else RectBivariateSpline(*sides, (~known).astype(np.float64), kx=1, ky=1)

    def angles_of(places_px: Floats) -> Floats:
        found = np.stack([spline.ev(places_px[:, 0], places_px[:, 1]) for spline in splines], axis=1)
        if dark is not None:
            found[dark.ev(places_px[:, 0], places_px[:, 1]) > 1e-9] = np.nan
        return found

    return angles_of


def _continued(values: Floats, known: Floats, sides: list[Floats]) -> Floats:
    """Return values with unknown ones continued by a polynomial of all known ones; nothing is read there."""
    if known.all():
        return values
    x, y = np.meshgrid(*((side - side.mean()) / np.ptp(side) for side in sides), indexing="ij")
    terms = np.stack([x**i * y**j for i in range(4) for j in range(4 - i)], axis=-1)
    weights, *_ = np.linalg.lstsq(terms[known], values[known], rcond=None)
    return np.where(known, values, terms @ weights)
