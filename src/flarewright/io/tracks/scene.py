"""Lights of a 3D scene as its camera sees them: places in its picture and directions, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, degrees, hypot
from typing import TypeVar

import numpy as np

from ...errors import FileError
from ...model.project.light import LEAST_LIGHT_DEG
from ...typing import Floats
from .track import Track


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """A camera at one frame.

    Attributes
    ----------
    frame : float
    matrix : ndarray, shape (4, 4)
        From the camera to the world, for column vectors. The camera looks along its -z, up is +y.
    focal_mm : float
    sensor_mm : tuple of float
        Width and height that the picture covers.
    axis : tuple of float
        Where the picture shows the camera's -z: parts of its width and height from the top left corner.
    """

    frame: float
    matrix: Floats
    focal_mm: float
    sensor_mm: tuple[float, float]
    axis: tuple[float, float] = (0.5, 0.5)


@dataclass(frozen=True, eq=False)
class LightFrame:
    """A light at one frame.

    Attributes
    ----------
    frame : float
    matrix : ndarray, shape (4, 4)
        From the light to the world; a distant light shines along its -z.
    intensity : float or None
        Irradiance.
    rgb : tuple of float or None
    visible : bool
    """

    frame: float
    matrix: Floats
    intensity: float | None = None
    rgb: tuple[float, float, float] | None = None
    visible: bool = True


@dataclass(frozen=True)
class SceneLight:
    """A light of a scene.

    Attributes
    ----------
    name : str
    distant : bool
        Whether its direction counts, and not its position.
    frames : tuple of LightFrame
        One: the light rests.
    diameter_deg : float
        Angular diameter of a distant light.
    radius : float
        Radius of another one, in the unit of the matrices.
    """

    name: str
    distant: bool
    frames: tuple[LightFrame, ...]
    diameter_deg: float = 0.0
    radius: float = 0.0


State = TypeVar("State", CameraFrame, LightFrame)


def tracks_of_scene(
    file: str, camera: Sequence[CameraFrame], lights: Sequence[SceneLight]
) -> tuple[tuple[Track, ...], tuple[str, ...]]:
    """Return the tracks of lights in the picture of a pinhole camera.

    Parameters
    ----------
    file : str
        For messages.
    camera : sequence of CameraFrame
        Rising frames. One: the camera rests.
    lights : sequence of SceneLight

    Returns
    -------
    tracks : tuple of Track
        Parts of the picture from its top left corner, with directions; frames behind the camera are hidden.
    remarks : tuple of str

    Raises
    ------
    FileError
        No light is ever in front of the camera, or no camera and light share a frame.
    """
    tracks: list[Track] = []
    remarks: list[str] = []
    for light in lights:
        frames = [camera[0].frame]
        if len(camera) > 1 and len(light.frames) > 1:
            common = {one.frame for one in camera} & {one.frame for one in light.frames}
            frames = sorted(common)
            if not frames:
                raise FileError(f"{file}: the light {light.name!r} and the camera have no frame in common")
        elif len(camera) > 1:
            frames = [one.frame for one in camera]
        elif len(light.frames) > 1:
            frames = [one.frame for one in light.frames]
        seen = [_seen(_at(camera, frame), _at(light.frames, frame), light) for frame in frames]
        hidden = np.array([one is None for one in seen])
        if hidden.all():
            remarks.append(f"{file}: the light {light.name!r} is never in front of the camera, so it is left out")
            continue
        known = [((0.5, 0.5), (0.0, 0.0), 0.0) if one is None else one for one in seen]
        states = [_at(light.frames, frame) for frame in frames]
        levels = [state.intensity for state in states if state.intensity is not None]
        colours = [state.rgb for state in states if state.rgb is not None]
        widest = max(size for (_, _, size), away in zip(known, hidden, strict=True) if not away)
        tracks.append(
            Track(
                light.name[:80], np.array(frames, dtype=np.float64), np.array([place for place, _, _ in known]),
                size_px=(1.0, 1.0), directions=np.array([slope for _, slope, _ in known]),
                intensity=np.array(levels) if len(levels) == len(states) else None,
                rgb=np.array(colours) if len(colours) == len(states) else None,
                hidden=hidden if hidden.any() else None,
                diameter_deg=min(widest, 60.0) if widest >= LEAST_LIGHT_DEG else 0.0,
            )
        )  # fmt: skip
    if not tracks:
        raise FileError(f"{file} has no light in front of its camera at any frame; check the camera and the lights")
    return tuple(tracks), tuple(remarks)


def _at(states: Sequence[State], frame: float) -> State:
    """Return the state of a frame, or the only one."""
    return states[0] if len(states) == 1 else next(one for one in states if one.frame == frame)


def _seen(
    camera: CameraFrame, light: LightFrame, what: SceneLight
) -> tuple[tuple[float, float], tuple[float, float], float] | None:
    """Return place, direction and angular diameter of a light; None if it is off or behind the camera."""
    # directions turn back by the transpose only if the axes have unit length, which scaled cameras have not
    turn = camera.matrix[:3, :3] / np.linalg.norm(camera.matrix[:3, :3], axis=0)
    away = light.matrix[:3, 2] if what.distant else light.matrix[:3, 3] - camera.matrix[:3, 3]
    x, y, z = (float(part) for part in turn.T @ away)
    if not light.visible or not -z > 1e-9 * hypot(x, y, z):
        return None
    slope = (x / -z, y / -z)
    size = what.diameter_deg if what.distant else degrees(2.0 * atan(what.radius / hypot(x, y, z)))
    place = (
        camera.axis[0] + slope[0] * camera.focal_mm / camera.sensor_mm[0],
        camera.axis[1] - slope[1] * camera.focal_mm / camera.sensor_mm[1],
    )
    return place, slope, size
