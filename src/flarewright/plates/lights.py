"""Lights of the renderer from the sources of a plate.

A plate value L is the radiance of the scene, in units of the plate. A source of such values over a solid angle is a
light of irradiance L omega. The lens images the radiance L of the axis as an irradiance L / f, where f is the factor
4 N^2 / (pi T) (`plate_factor`): lights of intensity L omega f give layers in units of the plate, which add to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, pi

import numpy as np

from ..errors import ProjectError
from ..model import Light, Rgb
from ..model.project.animation import LARGEST_INTENSITY
from ..model.project.light import LEAST_LIGHT_DEG, Rectangle
from ..render.image.photographic_exposure import SUN_LUX
from ..render.scene.direct_image import direct_image
from ..render.scene.pixel_place import direct_images
from ..render.scene.resolve import ResolvedProject
from ..typing import Floats, Mask
from .detection import LUMINANCE
from .field_map import FieldMap
from .settings import SourceKind
from .tracking import Tracks

# sources narrower than these are points: part of the plate's width, pixels
_POINT_PART, _POINT_PX = 0.005, 3.0
# largest ratio of the axes of a disc
_ROUND = 1.3
# widest light, degrees, below that of the model
_WIDEST_DEG, _WIDEST_DISC_DEG = 110.0, 60.0
# an area light that reaches farther from the axis is a point: its corners would lie beside the camera, degrees
_FARTHEST_DEG = 85.0


@dataclass(frozen=True)
class PlateTracks:
    """The lights of a plate over time, in its pixels.

    Attributes
    ----------
    tracks : Tracks
        Steady and joined.
    extended : ndarray of bool, shape (T,)
        Area lights; the others are points.
    round : ndarray of bool, shape (T,)
        Area lights that are discs; the others are rectangles.
    size_px : tuple of int
        Width and height of the plate.
    joined : int
        The last tracks, each of many sources. They have ghosts only: at their centroid there is no lamp.
    known : SourceKind or None
        A lamp of known brightness.
    white : float or None
        Plate value of white paper in the sun.
    named : ndarray, shape (T, F)
        Part of its largest light that each source of known brightness shows; NaN for sources measured in the plate.
    gain : float
    """

    tracks: Tracks
    extended: Mask
    round: Mask
    size_px: tuple[int, int]
    joined: int
    known: SourceKind | None
    white: float | None
    named: Floats
    gain: float = 1.0


def plate_tracks(
    tracks: Tracks,
    size_px: tuple[int, int],
    *,
    point_px: float | None = None,
    gain: float = 1.0,
    known: SourceKind | None = None,
    white: float | None = None,
    clips_at: float | None = None,
    joined: int = 0,
) -> PlateTracks:
    """Decide for a whole sequence which sources are points and which have a known brightness.

    Parameters
    ----------
    tracks : Tracks
    size_px : tuple of int
    point_px : float, optional
        Sources narrower than this are points; None: half a percent of the width, at least 3 pixels.
    gain : float
    known : SourceKind, optional
        The brightest source is the sun; or every clipped source, or else the brightest, is such a lamp.
    white : float, optional
        Plate value of white paper in the sun.
    clips_at : float, optional
        Luminance from which a source counts as clipped.
    joined : int
        The last tracks, which are no single lamps.
    """
    bright = tracks.light @ LUMINANCE
    with np.errstate(invalid="ignore"):
        xx, xy, yy = np.moveaxis(tracks.moments_px2, -1, 0)
        middle, apart = 0.5 * (xx + yy), 0.5 * np.sqrt((xx - yy) ** 2 + 4.0 * xy**2)
    wide = _mean(np.sqrt(12.0 * (middle + apart)), bright)
    narrow = _mean(np.sqrt(12.0 * np.maximum(middle - apart, 0.0)), bright)
    named = np.full(bright.shape, np.nan)
    if known is not None and len(tracks):
        chosen = np.zeros(len(tracks), dtype=np.bool_)
        if known.kind == "lamp" and clips_at is not None:
            chosen = tracks.peak.max(axis=1) >= clips_at
        chosen[len(tracks) - joined :] = False
        if not chosen.any():
            # a group is brighter than any of its lamps
            single = len(tracks) - joined or len(tracks)
            chosen[int(np.argmax(bright[:single].max(axis=1)))] = True
        named[chosen] = bright[chosen] / np.maximum(bright[chosen].max(axis=1, keepdims=True), 1e-300)
    is_round = wide < _ROUND * narrow
    narrowest = max(_POINT_PART * size_px[0], _POINT_PX) if point_px is None else point_px
    extended = wide > narrowest
    # the ghosts of lamps far from each other are no spread ghost of one
    extended[len(tracks) - joined :] = False
    return PlateTracks(tracks, extended, is_round, size_px, joined, known, white, named, gain)


def _mean(values: Floats, weights: Floats) -> Floats:
    """Return the mean of each row by its weights; a value that is NaN has none."""
    return np.asarray((np.nan_to_num(values) * weights).sum(axis=1) / np.maximum(weights.sum(axis=1), 1e-300))


def plate_factor(settled: ResolvedProject, directions: FieldMap) -> float:
    """Return the plate value of an irradiance on the sensor: radiance of the scene per irradiance of its image.

    Returns
    -------
    float
        4 N^2 / (pi T) on the axis for green light; T is the transmittance of the lens.

    Notes
    -----
    A light of irradiance E has a direct image of flux E A, with the throughput A of `render.scene.direct_image`. A
    pixel of solid angle omega and area a gets the irradiance L omega A / a (physics.md, Radiometry).
    """
    images = direct_images(settled, Light(field_deg=(0.0, 0.0)))
    throughput = direct_image(images.lens, images.shot).throughput_mm2
    column, row, across, down = images.shot.to_pixels
    omega = float(directions.solid_angles(np.array([[column, row]]))[0])
    return float(1.0 / (omega * across * down * throughput[(len(throughput) - 1) // 2]))


def lights_at(
    plate: PlateTracks, frame: float, directions: FieldMap, factor: float, size_px: tuple[int, int]
) -> tuple[tuple[Light, ...], float]:
    """Return the lights of a plate at a frame.

    Parameters
    ----------
    plate : PlateTracks
    frame : float
        Number; between frames, values are interpolated.
    directions : FieldMap
    factor : float
        `plate_factor`.
    size_px : tuple of int
        Of the camera's picture, which shows what the plate shows, larger or smaller.

    Returns
    -------
    lights : tuple of Light
        One dark light if there is none.
    lost : float
        Part of the light where the lens images nothing.
    """
    centre, light, moments, named = _between(plate, frame)
    there = light.sum(axis=1) > 0.0
    scale = np.array(size_px) / plate.size_px
    places = np.where(there[:, None], centre, 0.5 * np.array(plate.size_px)) * scale
    slopes, change = directions.slopes(places), directions.jacobians(places)
    # solid angles of the plate's pixels
    omega = directions.solid_angles(places) * float(np.prod(scale))
    seen = np.isfinite(slopes).all(axis=1) & np.isfinite(omega)
    total = float((light[there] @ LUMINANCE).sum())
    found = []
    for k in np.flatnonzero(there & seen):
        rgb = light[k] * omega[k] * factor * plate.gain
        if np.isfinite(named[k]):
            rgb = rgb / (rgb @ LUMINANCE) * _known_irradiance(plate) * named[k] * factor * plate.gain
        intensity = float(rgb @ LUMINANCE)
        if not intensity > 0.0:
            continue
        if intensity > LARGEST_INTENSITY:
            raise ProjectError(f"a source of the plate is too bright ({intensity:g}); lower --plate-gain or --white")
        field = np.degrees(np.arctan(slopes[k]))
        shape, diameter = None, 0.0
        if plate.extended[k] and plate.round[k]:
            diameter = _disc_deg(moments[k], omega[k])
        elif plate.extended[k]:
            # pixels of the plate to degrees, along the field angles X and Y
            per_px = np.degrees(change[k] / (1.0 + slopes[k][:, None] ** 2)) * scale
            shape = _rectangle(per_px, moments[k])
        if _reaches_too_far(slopes[k], diameter, shape):
            shape, diameter = None, 0.0
        found.append(
            Light(
                name=f"plate-{k + 1}",
                field_deg=(float(field[0]), float(field[1])),
                intensity=intensity,
                spectrum=Rgb(rgb=tuple(float(value) for value in rgb / rgb.max())),
                diameter_deg=0.0 if diameter < LEAST_LIGHT_DEG else min(diameter, _WIDEST_DISC_DEG),
                shape=shape,
                starburst=bool(k < len(there) - plate.joined),
            )
        )
    lost = float((light[there & ~seen] @ LUMINANCE).sum()) / total if total > 0.0 else 0.0
    return tuple(found) or (Light(name="plate", field_deg=(0.0, 0.0), intensity=0.0),), lost


def _known_irradiance(plate: PlateTracks) -> float:
    """Return the irradiance of a source of known brightness, in units of the plate."""
    assert plate.known is not None
    assert plate.white is not None
    # white paper that faces an illuminance E has the luminance E / pi
    return pi * plate.white * plate.known.illuminance_lx / SUN_LUX


def _disc_deg(moments: Floats, omega: float) -> float:
    """Return the diameter of a disc with some moments, pixels of the solid angle omega: they are r^2 / 4."""
    xx, _, yy = moments
    return float(4.0 * degrees((0.5 * (xx + yy) * omega) ** 0.5))


def _reaches_too_far(slopes: Floats, diameter: float, shape: Rectangle | None) -> bool:
    """Return whether a corner of an area light lies so far from the axis that it is beside the camera."""
    radius = 0.5 * (diameter if shape is None else float(np.hypot(*shape.size_deg)))
    if np.abs(np.degrees(np.arctan(slopes))).max() + radius > _FARTHEST_DEG:
        return True
    return degrees(np.arctan(np.hypot(*slopes))) + 0.5 * diameter > _FARTHEST_DEG


def _between(plate: PlateTracks, frame: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return centres, sums, moments and parts of known brightness at a frame, between two frames if it lies there."""
    tracks = plate.tracks
    frames = tracks.frames
    high = int(np.clip(np.searchsorted(frames, frame), 0, len(frames) - 1))
    low = high if frames[high] <= frame else max(high - 1, 0)
    part = 0.0 if high == low else float((frame - frames[low]) / (frames[high] - frames[low]))

    def mix(values: Floats) -> Floats:
        a, b = values[:, low], values[:, high]
        # a source that is absent in one of both frames stays at its place
        a, b = np.where(np.isnan(a), b, a), np.where(np.isnan(b), a, b)
        return a + part * (b - a)

    light = tracks.light[:, low] + part * (tracks.light[:, high] - tracks.light[:, low])
    return mix(tracks.centre_px), light, mix(tracks.moments_px2), mix(plate.named)


def _rectangle(per_px: Floats, moments: Floats) -> Rectangle:
    """Return the uniform rectangle with second moments, which are given in pixels."""
    xx, xy, yy = moments
    spread = per_px @ np.array([[xx, xy], [xy, yy]]) @ per_px.T
    values, axes = np.linalg.eigh(spread)
    sides = np.clip(np.sqrt(12.0 * np.maximum(values, 0.0)), LEAST_LIGHT_DEG, _WIDEST_DEG)
    # a rectangle turned by half a turn is itself
    angle = (degrees(np.arctan2(axes[1, 1], axes[0, 1])) + 90.0) % 180.0 - 90.0
    return Rectangle(size_deg=(float(sides[1]), float(sides[0])), rotation_deg=float(angle))
