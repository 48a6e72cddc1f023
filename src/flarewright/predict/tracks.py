"""Positions of a scene's cameras and lights over time, and the light that reaches each camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from ..errors import ProjectError
from ..model.project.light import SUN_DEG
from ..model.project.scene import Distant, Lamp, Scene, SceneCamera, SceneLight
from ..optics.lens.field_angles import constellation_and_roll, view_axes
from ..typing import Floats, Mask
from .photometry import beam, disc_illuminance, point_illuminance
from .sun import sky_direction, sun_illuminance, sun_path


@dataclass(frozen=True)
class CameraTrack:
    """A camera over time.

    Attributes
    ----------
    position_m : ndarray, shape (T, 3)
    aim_m : ndarray, shape (T, 3)
    axes : ndarray, shape (T, 3, 3)
        From `optics.lens.field_angles.view_axes`.
    """

    position_m: Floats
    aim_m: Floats
    axes: Floats


@dataclass(frozen=True)
class CameraSighting:
    """One light seen from one camera over time.

    Attributes
    ----------
    constellation_deg, roll_deg : ndarray, shape (T,)
    illuminance_lx : ndarray, shape (T,)
        On a plane at the camera that faces the light; 0 while the light is off.
    diameter_deg : ndarray, shape (T,)
        Angular diameter of the light.
    distance_m : ndarray, shape (T,)
        Infinite for distant lights.
    """

    constellation_deg: Floats
    roll_deg: Floats
    illuminance_lx: Floats
    diameter_deg: Floats
    distance_m: Floats


def moments(scene: Scene) -> tuple[Floats, tuple[datetime, ...] | None]:
    """Return the scene's times in seconds after its start, and as dates if it has a start date.

    Returns
    -------
    times_s : ndarray, shape (T,)
        Evenly spaced; the last one is the end, also after a shorter step.
    dates : tuple of datetime or None
    """
    span = scene.time
    times = np.arange(0.0, span.duration_s + 1e-9 * span.step_s, span.step_s)
    if span.duration_s - times[-1] > 1e-6 * span.step_s:
        times = np.append(times, span.duration_s)
    if span.start is None:
        return times, None
    start = span.start
    return times, tuple(start + timedelta(seconds=float(second)) for second in times)


def camera_track(camera: SceneCamera, times_s: Floats, where: str) -> CameraTrack:
    """Compute the position and orientation of a camera over time.

    Parameters
    ----------
    camera : SceneCamera
    times_s : ndarray, shape (T,)
    where : str
        Name of the camera in messages.

    Raises
    ------
    ProjectError
        When it aims at its own position, or along its up direction.
    """
    position = _moving(camera.position_m, [(key.at_s, key.position_m) for key in camera.keyframes], times_s)
    aim = _moving(camera.aim_m, [(key.at_s, key.aim_m) for key in camera.keyframes], times_s)
    return _looking(position, aim, camera, times_s, where)


def moved_by(track: CameraTrack, offset_m: Floats, camera: SceneCamera, times_s: Floats, where: str) -> CameraTrack:
    """Shift a camera by a constant offset; its aim points are kept."""
    return _looking(track.position_m + offset_m, track.aim_m, camera, times_s, where)


def _looking(position: Floats, aim: Floats, camera: SceneCamera, times_s: Floats, where: str) -> CameraTrack:
    forward = aim - position
    still = np.asarray(np.linalg.norm(forward, axis=1) < 1e-9)
    if still.any():
        raise ProjectError(f"{where}: the camera aims at its own place{_when(still, times_s)}; move its aim_m")
    axes = view_axes(forward, np.broadcast_to(camera.up, forward.shape))
    lost = np.asarray(np.isnan(axes).any(axis=(1, 2)))
    if lost.any():
        raise ProjectError(f"{where}: the camera's up is along its view{_when(lost, times_s)}; give another up")
    return CameraTrack(position, aim, axes)


def sightings(
    scene: Scene, tracks: Sequence[CameraTrack], times_s: Floats, dates: Sequence[datetime] | None
) -> list[list[CameraSighting]]:
    """Compute how every camera sees every light over time.

    Parameters
    ----------
    scene : Scene
    tracks : sequence of CameraTrack
        Cameras of the scene, or shifted ones.
    times_s : ndarray, shape (T,)
    dates : sequence of datetime or None
        Dates for the sun.

    Returns
    -------
    list of list of Sighting
        By camera and light.

    Raises
    ------
    ProjectError
        When a lamp is at a camera's position.
    """
    skies = {k: _sky(scene, light, dates) for k, light in enumerate(scene.lights) if not isinstance(light, Lamp)}
    found = []
    for c, track in enumerate(tracks):
        row = []
        for k, light in enumerate(scene.lights):
            if isinstance(light, Lamp):
                row.append(_lamp(light, track, times_s, f"lights[{k}] ({light.name}) and cameras[{c}]"))
            else:
                direction, lux, across = skies[k]
                row.append(_far(track, direction, lux, across))
        found.append(row)
    return found


def _sky(scene: Scene, light: SceneLight, dates: Sequence[datetime] | None) -> tuple[Floats, Floats, float]:
    """Return direction, illuminance and angular diameter of a light that is the same for all cameras."""
    if isinstance(light, Distant):
        azimuth, elevation = np.array([light.azimuth_deg]), np.array([light.elevation_deg])
        lux, across = np.array([light.illuminance_lx]), light.diameter_deg
    else:
        assert scene.site is not None
        assert dates is not None
        assert light.kind == "sun"
        azimuth, elevation = sun_path(scene.site, dates)
        clear = sun_illuminance(elevation)
        lux = clear if light.illuminance_lx is None else np.full(len(elevation), light.illuminance_lx)
        lux, across = np.where(elevation >= light.horizon_deg, lux, 0.0), SUN_DEG
    return sky_direction(azimuth - scene.north_deg, elevation), lux, across


def _far(track: CameraTrack, direction: Floats, lux: Floats, across: float) -> CameraSighting:
    constellation, roll = constellation_and_roll(track.axes, direction)
    count = len(constellation)
    return CameraSighting(
        constellation, roll, np.broadcast_to(lux, (count,)), np.full(count, across), np.full(count, np.inf)
    )


def lamp_places(light: Lamp, times_s: Floats) -> Floats:
    """Return the positions of a lamp over time, metres, shape (T, 3)."""
    return _moving(light.position_m, [(key.at_s, key.position_m) for key in light.keyframes], times_s)


def _lamp(light: Lamp, track: CameraTrack, times_s: Floats, where: str) -> CameraSighting:
    keys = light.keyframes
    position = lamp_places(light, times_s)
    away = position - track.position_m
    distance = np.linalg.norm(away, axis=1)
    touching = np.asarray(distance < 1e-6)
    if touching.any():
        raise ProjectError(f"{where}: the lamp stands at the camera's place{_when(touching, times_s)}; move one")
    constellation, roll = constellation_and_roll(track.axes, away)
    if light.luminance_cd_m2 is not None:
        assert light.diameter_m is not None
        lux = disc_illuminance(light.luminance_cd_m2, light.diameter_m, distance)
    else:
        assert light.intensity_cd is not None
        lux = point_illuminance(light.intensity_cd, distance)
    if light.aim_m is not None and light.beam_deg is not None:
        aim = _moving(light.aim_m, [(key.at_s, key.aim_m) for key in keys], times_s) - position
        length = np.linalg.norm(aim, axis=1)
        if (length < 1e-9).any():
            raise ProjectError(
                f"{where}: the lamp aims at its own place{_when(length < 1e-9, times_s)}; move its aim_m"
            )
        cosine = -(aim * away).sum(axis=1) / (length * distance)
        lux = lux * beam(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), light.beam_deg)
    gain = _moving((1.0,), [(key.at_s, None if key.gain is None else (key.gain,)) for key in keys], times_s)[:, 0]
    diameter = 0.0 if light.diameter_m is None else light.diameter_m
    return CameraSighting(
        constellation, roll, lux * gain, np.degrees(2.0 * np.arctan2(0.5 * diameter, distance)), distance
    )


def _moving(start: Sequence[float], keys: Sequence[tuple[float, Sequence[float] | None]], times_s: Floats) -> Floats:
    """Interpolate a position linearly over time, shape (T, N)."""
    known = [(at, np.array(place)) for at, place in keys if place is not None]
    if not known or known[0][0] > 0.0:
        known.insert(0, (0.0, np.array(start)))
    at, places = np.array([one[0] for one in known]), np.array([one[1] for one in known])
    return np.stack([np.interp(times_s, at, column) for column in places.T], axis=1)


def _when(found: Mask, times_s: Floats) -> str:
    return f" at {times_s[int(np.argmax(found))]:g} s" if len(times_s) > 1 else ""
