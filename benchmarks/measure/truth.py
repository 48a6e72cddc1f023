"""Truth about each ghost of a synthetic capture: position, brightness and difficulty."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flarewright.kernels.tracing.sequential import ALIVE, REL, STOP_X, WEIGHT, X, Y
from flarewright.optics.lens.paths import LightPath, ghost_paths
from flarewright.optics.rays.bundle import trace_points
from flarewright.optics.rays.pupil_region import find_region
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shot import Shot
from flarewright.render.scene.shots import make_shots

sys.path.append(str(Path(__file__).parents[2] / "tests" / "measure"))

from synthetic_camera import Pose, Setup, ghost_layers, project_of

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# rays across half the accepted pupil and along it, to detect its shape and folds
_RAYS = (48, 96)
_LEAST_RAYS = 30
# least part of the pupil that lands inverted in a fold
FOLD = 0.02
# least part of the rays just outside the open pupil that a rim must stop to count as a bounding rim
CUT = 0.05
# a crossing: least ratio of other ghosts' light to the ghost's, and least part of the ghost with that ratio
CROSSING_LIGHT, CROSSING_PART = 1.0, 0.5
# ghosts below this part of green's noise are dropped
_FAINTEST = 1.0


@dataclass(frozen=True)
class TrueGhost:
    """One path at one constellation.

    Attributes
    ----------
    name : str
    window : tuple of int
        Left, top, width, height of `mask`, pixels.
    mask : ndarray of bool, shape (height, width)
        Footprint: where green is more than half of the median of the lit pixels.
    light : ndarray, shape (ceil(height / 2), ceil(width / 2)), float16
        Green over `level`, at half the resolution.
    level, snr : float
        Median green radiance in the footprint, and its ratio to the median noise.
    fold, cut, at_edge, crossing : bool
        Part of it is inverted; more than one rim bounds it; the picture cuts it; other ghosts are as bright over much
        of it.
    """

    name: str
    window: tuple[int, int, int, int]
    mask: Mask
    light: NDArray[np.float16]
    level: float
    snr: float
    fold: bool
    cut: bool
    at_edge: bool
    crossing: bool

    @property
    def clean(self) -> bool:
        return not (self.fold or self.cut or self.at_edge or self.crossing)


def footprint(green: Floats) -> tuple[tuple[int, int, int, int], Mask, float] | None:
    """Return window, mask and level of a ghost's image; None when it is dark."""
    lit = green[green > 1e-3 * float(green.max(initial=0.0))]
    if lit.size < 4:
        return None
    mask = green > 0.5 * float(np.median(lit))
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    top, left = int(rows[0]), int(columns[0])
    height, width = int(rows[-1]) + 1 - top, int(columns[-1]) + 1 - left
    return (left, top, width, height), mask[top : top + height, left : left + width], float(np.median(green[mask]))


def true_ghosts(setup: Setup, pose: Pose, scale: float, sigma: NDArray[np.float32]) -> list[TrueGhost]:
    """Return the truth about every ghost above the noise, brightest first."""
    images = {name: image[..., 1] for name, image in ghost_layers(setup, pose, scale)}
    total = sum(images.values(), np.zeros(setup.size_px[::-1]))
    forms = forms_of(setup, pose)
    found = []
    for name, green in images.items():
        seen = footprint(green)
        if seen is None:
            continue
        (left, top, width, height), mask, level = seen
        inside = np.s_[top : top + height, left : left + width]
        snr = level / float(np.median(sigma[inside][mask]))
        if not snr > _FAINTEST:
            continue
        others = (total[inside] - green[inside])[mask] > CROSSING_LIGHT * green[inside][mask]
        fold, cut = forms.get(name, (False, False))
        at_edge = cut_by_frame(seen[0], setup.size_px)
        crossing = bool(others.mean() > CROSSING_PART)
        light = (green[inside][::2, ::2] / level).astype(np.float16)
        found.append(TrueGhost(name, seen[0], mask, light, level, snr, fold, cut, at_edge, crossing))
    return sorted(found, key=lambda one: -one.level)


def cut_by_frame(window: tuple[int, int, int, int], size_px: tuple[int, int]) -> bool:
    """Return whether a footprint ends at the border of the picture."""
    left, top, width, height = window
    return left == 0 or top == 0 or left + width == size_px[0] or top + height == size_px[1]


def forms_of(setup: Setup, pose: Pose) -> dict[str, tuple[bool, bool]]:
    """Return for every path (of the setup, if it names any) whether it folds, and whether several rims bound it."""
    settled = resolve_project(project_of(setup, pose, "passes"))
    shot = make_shots(settled, make_opening(settled, None))[0]
    paths = [path for path in ghost_paths(settled.lens) if not setup.paths or path.name in setup.paths]
    return {path.name: form for path in paths if (form := _form(shot, path)) is not None}


@dataclass(frozen=True)
class PathRays:
    """Rays of one path over half of the accepted pupil, right of the plane of the light, shape (N,) each.

    Attributes
    ----------
    passes : ndarray of bool
        Whether a ray reaches the sensor through the iris.
    stops : ndarray, shape (N, passes of the iris, 2)
    x, y, weight : ndarray
        Positions on the sensor, mm, and transmitted part of the light.
    """

    passes: Mask
    stops: Floats
    x: Floats
    y: Floats
    weight: Floats


def rays_of(shot: Shot, path: LightPath, count: tuple[int, int], colour: float = 0.5) -> PathRays | None:
    """Trace rays on a grid, row by row along the light's plane; None where too few reach the sensor.

    `colour` is 0 for the shortest wavelength and 1 for the longest.
    """
    tilt, radius = shot.incidence.tilt, shot.opening.radius
    region = find_region(shot.packed, path, tilt, radius, shot.view_radius)
    if region is None:
        return None
    x0, x1, y0, y1 = region.box
    across, along = np.linspace(x0, x1, count[0]), np.linspace(y0, y1, count[1])
    px, py = (each.ravel() for each in np.meshgrid(across, along))
    wavelength = int(colour * (len(shot.packed.wavelengths_nm) - 1) + 0.5)
    rays = trace_points(shot.packed, wavelength, path, tilt, np.stack([px, py], axis=1))
    stops = rays[:, STOP_X:].reshape(len(rays), -1, 2)
    at_stop = np.hypot(stops[..., 0], stops[..., 1]).max(axis=1)
    passes = (rays[:, ALIVE] > 0.5) & (rays[:, REL] <= 1.0) & (at_stop <= radius)
    if passes.sum() < _LEAST_RAYS:
        return None
    return PathRays(passes, stops, rays[:, X], rays[:, Y], rays[:, WEIGHT])


def _form(shot: Shot, path: LightPath) -> tuple[bool, bool] | None:
    rays = rays_of(shot, path, _RAYS)
    if rays is None:
        return None
    grid = _RAYS[::-1]
    x, y, open_ = rays.x.reshape(grid), rays.y.reshape(grid), rays.passes.reshape(grid)
    whole = open_[1:, 1:] & open_[1:, :-1] & open_[:-1, 1:] & open_[:-1, :-1]
    turned = np.diff(x, axis=1)[:-1] * np.diff(y, axis=0)[:, :-1] - np.diff(y, axis=1)[:-1] * np.diff(x, axis=0)[:, :-1]
    over = float(np.mean(turned[whole] > 0.0)) if whole.any() else 0.0
    # each pass of the iris counts as a separate rim; glass stops the other rays
    reach = np.hypot(rays.stops[..., 0], rays.stops[..., 1])
    stopped_by = np.where(reach.max(axis=1) > shot.opening.radius, np.argmax(reach, axis=1), rays.stops.shape[1])
    return min(over, 1.0 - over) > FOLD, _bounded_by(open_, stopped_by.reshape(grid)) > 1


def _bounded_by(open_: Mask, stopped_by: NDArray[np.int64]) -> int:
    """Return the number of rims that stop the rays just outside an open pupil."""
    padded = np.pad(open_, 1)
    beside = padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
    count = np.bincount(stopped_by[beside & ~open_])
    return int(np.count_nonzero(count > CUT * count.sum()))
