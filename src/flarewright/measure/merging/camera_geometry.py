"""Solve optical axis, horizon tilt and true angles of a run from the light's position in each frame.

With the camera turned by theta, the light is at `foot + u (f t + k t^3 + l t^5)`, t = tan(theta), where `u` is the
direction of the turntable in the picture, f the focal length in pixels, and k and l the distortion where the data
determine it. The foot is the axis, displaced across the path when the camera nods (`optical_axis` measures by how
much). The remaining deviations are the jitter of the turntable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan, cos, degrees, hypot, radians, sin, sqrt, tan

import numpy as np

from ...errors import FlarewrightError
from ...typing import Floats
from ..core.robust import MAD_TO_SIGMA
from .light_position import LightSighting, two_lights
from .settings import GeometrySettings


@dataclass(frozen=True)
class SightingInput:
    """Input of the geometry for one frame: the captures' angles, and the light's position where it is reliable."""

    nominal_deg: float
    nominal_roll_deg: float
    light_px: tuple[float, float] | None
    error_px: float


@dataclass(frozen=True)
class Placed:
    """Solved position of one frame; the fields are those of `FrameInfo`."""

    constellation_deg: float
    roll_deg: float
    light_px: tuple[float, float]
    light_error_px: float
    light_found: bool


@dataclass(frozen=True)
class Geometry:
    """Geometry of a run.

    Attributes
    ----------
    axis_px, axis_error_px : tuple of float
    px_per_rad : float
    law_px : tuple of float
        Coefficients of t, t^3 and t^5 in the light's distance from the axis.
    jitter_deg : float
        Standard deviation of the turntable's angles from the nominal ones.
    placed : tuple of Placed
        In the order of the frames.
    remarks : tuple of str
    """

    axis_px: tuple[float, float]
    axis_error_px: tuple[float, float]
    px_per_rad: float
    law_px: tuple[float, ...]
    jitter_deg: float
    placed: tuple[Placed, ...]
    remarks: tuple[str, ...]


def believable(sightings: Sequence[LightSighting], settings: GeometrySettings = GeometrySettings()) -> list[bool]:
    """Return for each frame whether its sighting is the light.

    Parameters
    ----------
    sightings : sequence of LightSighting
        Sightings in all frames of a run.
    settings : GeometrySettings

    Raises
    ------
    FlarewrightError
        When there is no light, or there are two.
    """
    best = max(one.flux for one in sightings)
    # what the user gives may be faint
    found = [
        one.given or (one.flux > settings.faintest * best and not one.at_border and one.clipped_share < 0.5)
        for one in sightings
    ]
    contrast = max((one.contrast for one, seen in zip(sightings, found, strict=True) if seen), default=0.0)
    if contrast < settings.least_contrast and not any(one.given for one in sightings):
        raise FlarewrightError(
            f"no light was found: nothing stands out of the pictures by more than {settings.least_contrast:g} "
            "times their median; check the photographs, or give light_x_px and light_y_px in captures.csv"
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
    frames: Sequence[SightingInput], size_px: tuple[int, int], across: Across | None = None,
    px_per_rad: float | None = None, settings: GeometrySettings = GeometrySettings(),
) -> Geometry:  # fmt: skip
    """Solve axis, focal length, tilt and true angles.

    Parameters
    ----------
    frames : sequence of SightingInput
    size_px : tuple of int
        Width and height.
    across : callable, optional
        Called with the path's foot and the unit vector across the path of the roll with most frames; returns the
        offset of the axis from the foot and its error, or None (`optical_axis.axis_beside_path`).
    px_per_rad : float, optional
        Focal length in pixels to use when the light's path does not determine it.
    settings : GeometrySettings

    Raises
    ------
    FlarewrightError
        When the light's path contradicts the angles.
    """
    seen = [one for one in frames if one.light_px is not None]
    rolls = list(dict.fromkeys(one.nominal_roll_deg for one in frames))
    lines = {roll: [one for one in seen if one.nominal_roll_deg == roll] for roll in rolls}
    paths = {roll: path for roll, line in lines.items() if (path := _fit_path(line, settings))}
    for roll, path in paths.items():
        _check_direction(path, roll, size_px[0], settings)
    centre = 0.5 * size_px[0], 0.5 * size_px[1]
    if not paths:
        return _without_path(frames, centre, size_px, px_per_rad, settings)
    remarks: list[str] = []
    axis, error = _axis(paths, centre, size_px, across, remarks, settings)
    placed = tuple(
        _place(one, paths.get(one.nominal_roll_deg), axis, next(iter(paths.values())), settings) for one in frames
    )
    largest = max(paths.values(), key=lambda path: path.count)
    remarks += _beside_middle(axis, centre, size_px, largest, settings)
    return Geometry(axis, error, largest.focal_px, largest.law_px, largest.jitter_deg, placed, tuple(remarks))


@dataclass(frozen=True)
class _Path:
    """The light's path at one roll: foot, direction, and the law of its distance."""

    foot: tuple[float, float]
    direction: tuple[float, float]
    law_px: tuple[float, ...]
    # largest t with a detected light
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
        """Return the standard error of the light's position along the path at t = tan(theta), including jitter."""
        powers = _by_powers(t, len(self.law_px))[: len(self.covariance)]
        jitter = radians(self.jitter_deg) * self.focal_px
        return sqrt(max(float(powers @ np.array(self.covariance) @ powers), 0.0) + jitter**2)

    @property
    def normal(self) -> tuple[float, float]:
        return -self.direction[1], self.direction[0]

    def distance(self, t: float) -> float:
        """Return the distance along the path at t = tan(theta), extrapolated linearly beyond `reach`."""
        near = min(max(t, -self.reach), self.reach)
        return float(_by_powers(near, len(self.law_px))[1:] @ self.law_px) + self.slope(near) * (t - near)

    def slope(self, t: float) -> float:
        """Return the derivative of the distance with respect to t."""
        near = min(abs(t), self.reach)
        return sum((2 * k + 1) * each * near ** (2 * k) for k, each in enumerate(self.law_px))

    def angle_deg(self, distance: float) -> float:
        """Return the angle at which the light has this distance from the axis, by Newton's method."""
        t = distance / self.focal_px
        for _ in range(20):
            t -= (self.distance(t) - distance) / self.slope(t)
        return degrees(atan(t))


def _fit_path(seen: Sequence[SightingInput], settings: GeometrySettings) -> _Path | None:
    """Fit the path of one roll by robust least squares; None with fewer than two distinct angles."""
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
    for count in range(2, settings.most_powers + 1 if distinct.size >= settings.distortion_angles else 2):
        bent = _robust(_by_powers(t, count), along)
        # a term within the jitter would only degrade the extrapolation beyond the picture
        if abs(bent[0][count]) > settings.least_sigmas * sqrt(bent[1][count, count]):
            fit, covariance, rest = bent
    side, _, rest_beside = _robust(_by_powers(t, 1), beside)
    # direction of the turntable in the picture, and the law along it; the tilt is small
    slope = max(hypot(fit[1], side[1]), 1e-9)
    direction = (fit[1] * u + side[1] * np.array([-u[1], u[0]])) / slope
    foot = fit[0] * u + side[0] * np.array([-u[1], u[0]])
    spread = float(np.sqrt(np.mean(np.square([rest, rest_beside]).sum(axis=0))))
    # the median excludes frames where the detection failed, which are no jitter
    scatter = MAD_TO_SIGMA * float(np.median(np.abs(rest - np.median(rest))))
    jitter = sqrt(max(scatter**2 - float(np.median([one.error_px**2 for one in seen])), 0.0))
    law = (float(slope), *map(float, fit[2:]))
    return _Path(
        (float(foot[0]), float(foot[1])), (float(direction[0]), float(direction[1])), law,
        float(np.abs(t).max()), degrees(jitter / slope), spread, len(seen), tuple(map(tuple, covariance.tolist())),
    )  # fmt: skip


def _check_direction(path: _Path, roll_deg: float, width: int, settings: GeometrySettings) -> None:
    """Raise when a path contradicts the captures."""
    if path.residual_px > settings.worst_path * width:
        raise FlarewrightError(
            f"the light does not move as the angles say (it is {path.residual_px:.0f} pixels off): check "
            "constellation_deg and roll_deg in captures.csv, and that no other light is in the picture"
        )
    if path.focal_px < settings.least_focal * width:
        raise FlarewrightError(
            "the light does not move in the picture, though the angles change: check constellation_deg in "
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
    """Return the columns 1, t, t^3, ..., with `count` powers."""
    return np.stack([np.ones_like(t), *(t ** (2 * k + 1) for k in range(count))], axis=-1)


def _robust(A: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Fit y = A x with Huber's weights, then with Cauchy's, which reject outliers; return x, covariance, residual."""
    weight = np.ones(y.size)
    x = np.zeros(A.shape[1])
    for turn in range(40):
        x = np.linalg.pinv((A.T * weight) @ A) @ (A.T * weight) @ y
        rest = y - A @ x
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(rest))), 1e-3)
        far = np.abs(rest) / (2.0 * scale)
        weight = 1.0 / (np.maximum(1.0, far) if turn < 20 else 1.0 + far**2)
    rest = y - A @ x
    freedom = max(y.size - A.shape[1], 1)
    covariance = np.linalg.pinv((A.T * weight) @ A) * float((weight * rest**2).sum()) / freedom
    return x, covariance, rest


def _axis(
    paths: dict[float, _Path], centre: tuple[float, float], size_px: tuple[int, int], across: Across | None,
    remarks: list[str], settings: GeometrySettings,
) -> tuple[tuple[float, float], tuple[float, float]]:  # fmt: skip
    """Estimate the axis from the feet of all paths, the mirror line, and a weak prior at the picture's middle."""
    information = np.zeros((2, 2))
    weighted = np.zeros(2)

    def know(direction: tuple[float, float], value: float, error: float) -> None:
        nonlocal information, weighted
        unit = np.array(direction)
        information = information + np.outer(unit, unit) / error**2
        weighted = weighted + unit * value / error**2

    for unit in ((1.0, 0.0), (0.0, 1.0)):
        know(unit, centre[0] * unit[0] + centre[1] * unit[1], settings.off_centre * size_px[0])
    largest = max(paths.values(), key=lambda path: path.count)
    for path in paths.values():
        know(path.direction, _dot(path.foot, path.direction), path.foot_error)
        know(path.normal, _dot(path.foot, path.normal), radians(settings.nod_deg) * path.focal_px)
    found = None if across is None else across(largest.foot, largest.normal)
    if found is not None:
        know(largest.normal, _dot(largest.foot, largest.normal) + found[0], found[1])
    elif across is not None:
        remarks.append("the ghosts do not determine the axis across the light's path; the path was used")
    covariance = np.linalg.inv(information)
    axis = covariance @ weighted
    error = np.sqrt(np.diag(covariance))
    return (float(axis[0]), float(axis[1])), (float(error[0]), float(error[1]))


def _beside_middle(
    axis: tuple[float, float], centre: tuple[float, float], size_px: tuple[int, int], path: _Path,
    settings: GeometrySettings,
) -> list[str]:  # fmt: skip
    """Return a remark on an axis far from the picture's middle, as a wrong zero of the turntable places it."""
    off = axis[0] - centre[0], axis[1] - centre[1]
    if hypot(*off) <= settings.off_middle * size_px[0]:
        return []
    # a light at the middle stands at this nominal angle
    zero_deg = path.angle_deg(-_dot(off, path.direction))
    return [
        f"the axis lies {hypot(*off):.1f} px from the picture's middle ({off[0]:+.1f} right, {off[1]:+.1f} down), and "
        f"the light is nearest to the middle at {zero_deg:+.2f} deg: unless the pictures are cropped or shifted, the "
        f"turntable's zero is wrong; subtract {zero_deg:.2f} from constellation_deg in captures.csv"
    ]


def _dot(a: tuple[float, float], b: tuple[float, float]) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _place(
    one: SightingInput, path: _Path | None, axis: tuple[float, float], other: _Path, settings: GeometrySettings
) -> Placed:
    """Solve one frame: its light as detected, or as predicted by its path."""
    law = path or other
    t = tan(radians(one.nominal_deg))
    roll = radians(one.nominal_roll_deg)
    u = path.direction if path is not None else (cos(roll), -sin(roll))
    foot = path.foot if path is not None else axis
    sign = 1.0 if one.nominal_deg >= 0.0 else -1.0
    step = law.distance(t)
    expected = foot[0] + step * u[0], foot[1] + step * u[1]
    # weigh the light's error against the turntable's
    table = max(radians(law.jitter_deg) * law.focal_px, 0.02)
    error = law.error(t) if one.light_px is None else one.error_px
    far = hypot(expected[0] - axis[0], expected[1] - axis[1])
    if one.light_px is None:
        light, distance = expected, far
    else:
        light = one.light_px
        seen = hypot(light[0] - axis[0], light[1] - axis[1])
        believed = 1.0 / (1.0 + ((seen - far) / (settings.outlier_jitters * table)) ** 4)
        distance = far + (seen - far) * believed * table**2 / (table**2 + one.error_px**2)
    direction = sign * (light[0] - axis[0]), sign * (light[1] - axis[1])
    if hypot(*direction) < settings.near_px:
        direction = u
    return Placed(
        sign * law.angle_deg(distance), degrees(np.arctan2(-direction[1], direction[0])), light, error,
        one.light_px is not None,
    )  # fmt: skip


def _without_path(
    frames: Sequence[SightingInput], centre: tuple[float, float], size_px: tuple[int, int], px_per_rad: float | None,
    settings: GeometrySettings,
) -> Geometry:  # fmt: skip
    """Solve frames with a light at one angle at most; the axis is assumed in the picture's middle."""
    seen = next((one for one in frames if one.light_px is not None and abs(one.nominal_deg) > 0.5), None)
    if seen is not None and seen.light_px is not None:
        distance = hypot(seen.light_px[0] - centre[0], seen.light_px[1] - centre[1])
        px_per_rad = distance / abs(tan(radians(seen.nominal_deg)))
    if px_per_rad is None or px_per_rad <= 0.0:
        raise FlarewrightError(
            "the light was seen at one angle only, so its path is unknown: add captures at other angles, or give "
            "focal_mm in captures.csv and pitch_um in camera.json"
        )
    error = settings.off_centre * size_px[0]
    placed = []
    for one in frames:
        roll = radians(one.nominal_roll_deg)
        path = _Path(centre, (cos(roll), -sin(roll)), (px_per_rad,), 0.0, 0.0, 0.0, 0, ((error**2,),))
        placed.append(_place(one, path, centre, path, settings))
    remark = "the light was seen at one angle only; the axis is assumed to be the middle of the picture"
    return Geometry(centre, (error, error), px_per_rad, (px_per_rad,), 0.0, tuple(placed), (remark,))
