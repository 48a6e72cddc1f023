"""Scenes of the Blender add-on: a camera and lights, frame by frame, as JSON (docs/placing-lights.md)."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import Field, ValidationError

from ...errors import FileError
from ...model.base import Frozen
from ...sentences import summary, validation_sentences
from ...typing import Floats
from ..files.door import shown
from .numbers import MOST_FRAMES, MOST_TRACKS
from .scene import CameraFrame, LightFrame, SceneLight, tracks_of_scene
from .track import TrackFile

FORMAT = "flarewright-scene"

Row = tuple[float, float, float, float]
Channel = Annotated[float, Field(ge=0.0, le=1e9)]
Length = Annotated[float, Field(gt=0.0, le=1e6)]


class _Posed(Frozen):
    frame: int = Field(ge=-1_000_000, le=10_000_000)
    matrix: tuple[Row, Row, Row, Row]


class _CameraState(_Posed):
    focal_mm: Length
    sensor_mm: tuple[Length, Length]
    axis: tuple[float, float] = (0.5, 0.5)


class _LightState(_Posed):
    intensity: float | None = Field(None, ge=0.0, le=1e20)
    rgb: tuple[Channel, Channel, Channel] | None = None
    visible: bool = True


class _Camera(Frozen):
    name: str = "Camera"
    frames: tuple[_CameraState, ...] = Field(min_length=1, max_length=MOST_FRAMES)


class _Light(Frozen):
    name: str = Field(min_length=1, max_length=200)
    kind: Literal["sun", "point", "spot", "area"]
    diameter_deg: float = Field(0.0, ge=0.0, le=60.0)
    radius: float = Field(0.0, ge=0.0, le=1e9)
    frames: tuple[_LightState, ...] = Field(min_length=1, max_length=MOST_FRAMES)


class _Scene(Frozen):
    format: Literal["flarewright-scene"]
    version: Literal[1]
    fps: float | None = Field(None, ge=0.01, le=1000.0)
    camera: _Camera
    lights: tuple[_Light, ...] = Field(min_length=1, max_length=MOST_TRACKS)


Posed = TypeVar("Posed", bound=_Posed)


def is_scene_json(text: str) -> bool:
    """Return whether a text is JSON of a scene."""
    return text.lstrip().startswith("{") and f'"{FORMAT}"' in text


def read_scene(text: str, file: str) -> TrackFile:
    """Read the lights of a scene as its camera sees them.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.

    Raises
    ------
    FileError
        It is no scene, a value is out of range or stands in some frames of a light only, or no light is in front of
        the camera.
    """
    name = shown(file)
    try:
        data = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        reason = f"line {error.lineno}" if isinstance(error, json.JSONDecodeError) else "nested too deeply"
        raise FileError(f"{name} is not valid JSON ({reason}): export the scene again") from None
    try:
        scene = _Scene.model_validate(data)
    except ValidationError as error:
        problems = validation_sentences(error)
        raise FileError(summary(name, problems), tuple(problems)) from None
    camera = tuple(
        CameraFrame(one.frame, _matrix(one, name), one.focal_mm, one.sensor_mm, one.axis)
        for one in _ordered(scene.camera.frames, f"{name}: the camera")
    )
    for light in scene.lights:
        for key in ("intensity", "rgb"):
            if len({getattr(one, key) is None for one in light.frames}) > 1:
                raise FileError(
                    f"{name}: the light {light.name!r} has {key} in some frames only; give it in all of them or none"
                )
    lights = tuple(
        SceneLight(
            light.name, light.kind == "sun",
            tuple(
                LightFrame(one.frame, _matrix(one, name), one.intensity, one.rgb, one.visible)
                for one in _ordered(light.frames, f"{name}: the light {light.name!r}")
            ),
            light.diameter_deg, light.radius,
        )
        for light in scene.lights
    )  # fmt: skip
    tracks, remarks = tracks_of_scene(name, camera, lights)
    return TrackFile(tracks, "blender", scene.fps, remarks)


def _ordered(states: tuple[Posed, ...], what: str) -> tuple[Posed, ...]:
    """Return states in the order of their frames."""
    found = tuple(sorted(states, key=lambda one: one.frame))
    twice = next((b.frame for a, b in pairwise(found) if a.frame == b.frame), None)
    if twice is not None:
        raise FileError(f"{what} has frame {twice} twice; export the scene again")
    for state in found:
        rgb = getattr(state, "rgb", None)
        if rgb is not None and max(rgb) <= 0.0:
            raise FileError(
                f"{what} is black at frame {state.frame}; give it a colour, and intensity 0 where it is off"
            )
    return found


def _matrix(state: _Posed, file: str) -> Floats:
    """Return the matrix of a state; raise an error for one that squashes an axis."""
    matrix = np.array(state.matrix)
    if not (np.isfinite(matrix).all() and (np.linalg.norm(matrix[:3, :3], axis=0) > 1e-12).all()):
        raise FileError(f"{file}: the matrix of frame {state.frame} has an axis of length 0; export the scene again")
    return matrix
