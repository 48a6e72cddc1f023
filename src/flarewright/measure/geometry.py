"""From where the light was seen in each frame to the optical axis, the horizon's tilt and the true angles.

With the camera turned by theta, the light is at `foot + u (f t + k t^3 + l t^5)`, t = tan(theta), where `u` is the
direction of the turntable in the picture: f is the focal length in pixels, k and l the distortion, as far as the light
shows it. The foot is the axis, moved across the path when the camera nods (`symmetry` finds by how much). The jitter of
the turntable is what remains.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan, cos, degrees, hypot, radians, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from .light import Sighting, two_lights

Floats = NDArray[np.float64]

# a light much fainter than in the frames that show it best is none: it left the picture
_FAINTEST = 0.05
# and one that stands out of no frame by this much is none at all
_LEAST_CONTRAST = 20.0
# residuals of the path beyond this part of the width are no path of one light
_WORST_PATH = 0.02
# a light that moves by less than this part of the width per tangent stays where it is: even a fisheye has more
_LEAST_FOCAL = 0.1
# fewer distinct angles do not fix the distortion
_FOR_DISTORTION = 8
# and a power of it is believed when it is so many standard errors
_SURE = 4.0
# powers of t that the law may have
_MOST_POWERS = 3
# a light that lies by so many times the jitter from where the law says is half believed: there the law fails, as where
# rims cut the light's own image
_STRAYS = 4.0
# nearer the axis than this the direction to the light says nothing
_NEAR_PX = 8.0
# how far the foot may lie beside the axis by nodding, and the axis beside the picture's middle, when nothing else
# tells
_NOD_DEG, _OFF_CENTRE = 0.2, 0.02


@dataclass(frozen=True)
class Seen:
    """One frame for the geometry: the captures' angles, and the light where it was believed."""

    nominal_deg: float
    nominal_roll_deg: float
    light_px: tuple[float, float] | None
    error_px: float


@dataclass(frozen=True)
class Placed:
    """Where one frame truly stood: `FrameInfo`'s fields of the same names."""

    constellation_deg: float
    roll_deg: float
    light_px: tuple[float, float]
    light_error_px: float
    light_found: bool


@dataclass(frozen=True)
class Geometry:
    """A run's geometry.

    Attributes
    ----------
    axis_px, axis_error_px : tuple of float
    px_per_rad : float
    law_px : tuple of float
        What t, t^3 and t^5 count in the light's distance from the axis.
    jitter_deg : float
        Spread of the turntable's angles about the nominal ones.
    placed : tuple of Placed
        As the frames were given.
    remarks : tuple of str
    """

    axis_px: tuple[float, float]
    axis_error_px: tuple[float, float]
    px_per_rad: float
    law_px: tuple[float, ...]
    jitter_deg: float
    placed: tuple[Placed, ...]
    remarks: tuple[str, ...]


def believable(sightings: Sequence[Sighting]) -> list[bool]:
    """Tell in which frames the light truly is.

    Parameters
    ----------
    sightings : sequence of Sighting
        Of all frames of a run.

    Returns
    -------
    list of bool

    Raises
    ------
    FlarewrightError
        No light, or two lights.
    """
    best = max(one.flux for one in sightings)
    found = [one.flux > _FAINTEST * best and not one.at_border and one.clipped_share < 0.5 for one in sightings]
    contrast = max((one.contrast for one, seen in zip(sightings, found, strict=True) if seen), default=0.0)
    if contrast < _LEAST_CONTRAST:
        raise FlarewrightError(
            f"no light was found: nothing stands out of the pictures by more than {_LEAST_CONTRAST:g} times their "
            "median; check the photographs, or give light_x_px and light_y_px in captures.csv"
        )
    rivals = [
        k for k, (one, seen) in enumerate(zip(sightings, found, strict=True)) if seen and one.rival_px is not None
    ]
    if rivals and len(rivals) > 0.5 * sum(found):
        one = sightings[rivals[0]]
        raise two_lights(one, one.rival_px, "one frame")
    return found


Across = Callable[[tuple[float, float], tuple[float, float]], tuple[float, float] | None]


def solve_geometry(
    frames: Sequence[Seen], size_px: tuple[int, int], across: Across | None = None, px_per_rad: float | None = None
) -> Geometry:
    """Find axis, scale, tilt and the true angles.

    Parameters
    ----------
    frames : sequence of Seen
    size_px : tuple of int
        Width and height.
    across : callable, optional
        Called with the path's foot and the unit vector across the path of the roll with most frames; returns by how
        much the axis lies beside the foot and with which error, or None (`symmetry.axis_beside_path`).
    px_per_rad : float, optional
        Focal length in pixels where the light does not tell it.

    Returns
    -------
    Geometry

    Raises
    ------
    FlarewrightError
        When the light does not move as the angles say.
    """
    seen = [one for one in frames if one.light_px is not None]
    rolls = list(dict.fromkeys(one.nominal_roll_deg for one in frames))
    paths = {roll: path for roll in rolls if (path := _fit_path([one for one in seen if one.nominal_roll_deg == roll]))}
    for roll, path in paths.items():
        _check_direction(path, roll, size_px[0])
    centre = 0.5 * size_px[0], 0.5 * size_px[1]
    if not paths:
        return _without_path(frames, centre, size_px, px_per_rad)
    remarks: list[str] = []
    axis, error = _axis(paths, centre, size_px, across, remarks)
    placed = tuple(_place(one, paths.get(one.nominal_roll_deg), axis, next(iter(paths.values()))) for one in frames)
    largest = max(paths.values(), key=lambda path: path.count)
    return Geometry(axis, error, largest.focal_px, largest.law_px, largest.jitter_deg, placed, tuple(remarks))


@dataclass(frozen=True)
class _Path:
    """The light's path of one roll: foot, direction, and the law of its distance."""

    foot: tuple[float, float]
    direction: tuple[float, float]
    law_px: tuple[float, ...]
    # the largest t that showed the light
    reach: float
    jitter_deg: float
    residual_px: float
    count: int
    covariance: tuple[tuple[float, ...], ...]

    @property
    def focal_px(self) -> float:
        return self.law_px[0]

    @property
    def foot_error(self) -> float:
        """Return the standard error of the foot along the path."""
        return max(sqrt(max(self.covariance[0][0], 0.0)), 0.01)

    def error(self, t: float) -> float:
        """Return the standard error of the light's place along the path at t = tan(theta), jitter included."""
        powers = _by_powers(t, len(self.law_px))[: len(self.covariance)]
        jitter = radians(self.jitter_deg) * self.focal_px
        return sqrt(max(float(powers @ np.array(self.covariance) @ powers), 0.0) + jitter**2)

    @property
    def normal(self) -> tuple[float, float]:
        return -self.direction[1], self.direction[0]

    def distance(self, t: float) -> float:
        """Return the distance along the path at t = tan(theta); beyond what showed the light it goes on straight."""
        near = min(max(t, -self.reach), self.reach)
        return float(_by_powers(near, len(self.law_px))[1:] @ self.law_px) + self.slope(near) * (t - near)

    def slope(self, t: float) -> float:
        """Return by how much the distance grows with t."""
        near = min(abs(t), self.reach)
        return sum((2 * k + 1) * each * near ** (2 * k) for k, each in enumerate(self.law_px))

    def angle_deg(self, distance: float) -> float:
        """Return the angle at which the light stands so far from the axis, by Newton's method."""
        t = distance / self.focal_px
        for _ in range(20):
            t -= (self.distance(t) - distance) / self.slope(t)
        return degrees(atan(t))


def _fit_path(seen: Sequence[Seen]) -> _Path | None:
    """Fit the path of one roll by least squares, outliers down-weighted; None when fewer than two angles show it."""
    nominal = np.array([one.nominal_deg for one in seen])
    distinct = np.unique(nominal)
    if distinct.size < 2:
        return None
    t = np.tan(np.radians(nominal))
    lights = np.array([one.light_px for one in seen], dtype=np.float64)
    roll = radians(seen[0].nominal_roll_deg)
    u = np.array([cos(roll), -sin(roll)])
    along, beside = lights @ u, lights @ np.array([-u[1], u[0]])
    fit, covariance, rest = _robust(_by_powers(t, 1), along)
    for count in range(2, _MOST_POWERS + 1 if distinct.size >= _FOR_DISTORTION else 2):
        bent = _robust(_by_powers(t, count), along)
        # a distortion that the jitter explains would only spoil what is foretold beyond the picture
        if abs(bent[0][count]) > _SURE * sqrt(bent[1][count, count]):
            fit, covariance, rest = bent
    side, _, rest_beside = _robust(_by_powers(t, 1), beside)
    # the turntable's direction in the picture, and the law along it: the tilt is small
    slope = max(hypot(fit[1], side[1]), 1e-9)
    direction = (fit[1] * u + side[1] * np.array([-u[1], u[0]])) / slope
    foot = fit[0] * u + side[0] * np.array([-u[1], u[0]])
    spread = float(np.sqrt(np.mean(np.square([rest, rest_beside]).sum(axis=0))))
    # where the law fails there is no jitter
    scatter = 1.4826 * float(np.median(np.abs(rest - np.median(rest))))
    jitter = sqrt(max(scatter**2 - float(np.median([one.error_px**2 for one in seen])), 0.0))
    law = (float(slope), *map(float, fit[2:]))
    return _Path(
        (float(foot[0]), float(foot[1])), (float(direction[0]), float(direction[1])), law,
        float(np.abs(t).max()), degrees(jitter / slope), spread, len(seen), tuple(map(tuple, covariance.tolist())),
    )  # fmt: skip


def _check_direction(path: _Path, roll_deg: float, width: int) -> None:
    """Refuse a path that is not the one the captures tell of."""
    if path.residual_px > _WORST_PATH * width:
        raise FlarewrightError(
            f"the light does not move as the angles say (it is {path.residual_px:.0f} pixels off): check "
            "constellation_deg and roll_deg in captures.csv, and that no other light is in the picture"
        )
    if path.focal_px < _LEAST_FOCAL * width:
        raise FlarewrightError(
            "the light stays where it is in the picture, though the angles change: check constellation_deg in "
            "captures.csv, and that the photographs are of one light seen by a turning camera"
        )
    found_deg = degrees(np.arctan2(-path.direction[1], path.direction[0]))
    off_deg = (found_deg - roll_deg + 180.0) % 360.0 - 180.0
    if abs(off_deg) > 135.0:
        raise FlarewrightError(
            "the light moves against the angles: with positive angles it should go right in the upright picture; "
            "change the sign of constellation_deg, or set roll_deg to 180"
        )
    if abs(off_deg) > 45.0:
        raise FlarewrightError(
            f"the light moves towards {round(found_deg)} deg in the picture (0 right, 90 up) as the angles grow, where "
            f"roll_deg says {roll_deg:g}: correct roll_deg in captures.csv"
        )


def _by_powers(t: Floats | float, count: int) -> Floats:
    """Return the columns 1, t, t^3, ..., with so many powers."""
    return np.stack([np.ones_like(t), *(t ** (2 * k + 1) for k in range(count))], axis=-1)


def _robust(A: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Fit y = A x by Huber's weights, then by Cauchy's, which let go of what is far off; return x, covariance, rest."""
    weight = np.ones(y.size)
    x = np.zeros(A.shape[1])
    for turn in range(40):
        x = np.linalg.pinv((A.T * weight) @ A) @ (A.T * weight) @ y
        rest = y - A @ x
        scale = max(1.4826 * float(np.median(np.abs(rest))), 1e-3)
        far = np.abs(rest) / (2.0 * scale)
        weight = 1.0 / (np.maximum(1.0, far) if turn < 20 else 1.0 + far**2)
    rest = y - A @ x
    freedom = max(y.size - A.shape[1], 1)
    covariance = np.linalg.pinv((A.T * weight) @ A) * float((weight * rest**2).sum()) / freedom
    return x, covariance, rest


def _axis(
    paths: dict[float, _Path], centre: tuple[float, float], size_px: tuple[int, int], across: Across | None,
    remarks: list[str],
) -> tuple[tuple[float, float], tuple[float, float]]:  # fmt: skip
    """Combine what is known of the axis: the feet of all paths, the mirror line, and weakly the picture's middle."""
    information = np.zeros((2, 2))
    weighted = np.zeros(2)

    def know(direction: tuple[float, float], value: float, error: float) -> None:
        nonlocal information, weighted
        unit = np.array(direction)
        information = information + np.outer(unit, unit) / error**2
        weighted = weighted + unit * value / error**2

    for unit in ((1.0, 0.0), (0.0, 1.0)):
        know(unit, centre[0] * unit[0] + centre[1] * unit[1], _OFF_CENTRE * size_px[0])
    largest = max(paths.values(), key=lambda path: path.count)
    for path in paths.values():
        know(path.direction, _dot(path.foot, path.direction), path.foot_error)
        know(path.normal, _dot(path.foot, path.normal), radians(_NOD_DEG) * path.focal_px)
    found = None if across is None else across(largest.foot, largest.normal)
    if found is not None:
        know(largest.normal, _dot(largest.foot, largest.normal) + found[0], found[1])
    elif across is not None:
        remarks.append("the ghosts do not show where the axis lies across the light's path; the path was taken")
    covariance = np.linalg.inv(information)
    axis = covariance @ weighted
    error = np.sqrt(np.diag(covariance))
    return (float(axis[0]), float(axis[1])), (float(error[0]), float(error[1]))


def _dot(a: tuple[float, float], b: tuple[float, float]) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _place(one: Seen, path: _Path | None, axis: tuple[float, float], other: _Path) -> Placed:
    """Place one frame: its light as seen, or as its path foretells."""
    law = path or other
    t = tan(radians(one.nominal_deg))
    roll = radians(one.nominal_roll_deg)
    u = path.direction if path is not None else (cos(roll), -sin(roll))
    foot = path.foot if path is not None else axis
    sign = 1.0 if one.nominal_deg >= 0.0 else -1.0
    step = law.distance(t)
    expected = foot[0] + step * u[0], foot[1] + step * u[1]
    # the light's own error is weighed against the turntable's
    table = max(radians(law.jitter_deg) * law.focal_px, 0.02)
    error = law.error(t) if one.light_px is None else one.error_px
    far = hypot(expected[0] - axis[0], expected[1] - axis[1])
    if one.light_px is None:
        light, distance = expected, far
    else:
        light = one.light_px
        seen = hypot(light[0] - axis[0], light[1] - axis[1])
        believed = 1.0 / (1.0 + ((seen - far) / (_STRAYS * table)) ** 4)
        distance = far + (seen - far) * believed * table**2 / (table**2 + one.error_px**2)
    direction = sign * (light[0] - axis[0]), sign * (light[1] - axis[1])
    if hypot(*direction) < _NEAR_PX:
        direction = u
    return Placed(
        sign * law.angle_deg(distance), degrees(np.arctan2(-direction[1], direction[0])), light, error,
        one.light_px is not None,
    )  # fmt: skip


def _without_path(
    frames: Sequence[Seen], centre: tuple[float, float], size_px: tuple[int, int], px_per_rad: float | None
) -> Geometry:
    """Place frames of which no two angles show the light: the axis is taken to be the picture's middle."""
    seen = next((one for one in frames if one.light_px is not None and abs(one.nominal_deg) > 0.5), None)
    if seen is not None and seen.light_px is not None:
        distance = hypot(seen.light_px[0] - centre[0], seen.light_px[1] - centre[1])
        px_per_rad = distance / abs(tan(radians(seen.nominal_deg)))
    if px_per_rad is None or px_per_rad <= 0.0:
        raise FlarewrightError(
            "the light was seen at one angle only, so its path is unknown: add captures at other angles, or give "
            "focal_mm in captures.csv and pitch_um in camera.json"
        )
    error = _OFF_CENTRE * size_px[0]
    placed = []
    for one in frames:
        roll = radians(one.nominal_roll_deg)
        path = _Path(centre, (cos(roll), -sin(roll)), (px_per_rad,), 0.0, 0.0, 0.0, 0, ((error**2,),))
        placed.append(_place(one, path, centre, path))
    told = "the light was seen at one angle only; the axis is taken to be the middle of the picture"
    return Geometry(centre, (error, error), px_per_rad, (px_per_rad,), 0.0, tuple(placed), (told,))
