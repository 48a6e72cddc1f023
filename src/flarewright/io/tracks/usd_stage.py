"""USD stages: the lights of a stage as its camera sees them (extra `usd`)."""

from __future__ import annotations

from math import ceil, floor
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileError, optional
from ...typing import Floats
from ..files.door import outside, shown
from .numbers import LARGEST_BYTES, MOST_FRAMES, MOST_TRACKS
from .scene import CameraFrame, LightFrame, SceneLight, tracks_of_scene
from .track import TrackFile

_WHAT = "a USD stage"
# lights without a place in the picture, such as a dome around it
_PLACELESS = frozenset({"DomeLight", "DomeLight_1", "GeometryLight", "PortalLight", "PluginLight"})
# largest size of a stage, bytes: its geometry may be in it
_LARGEST = 16 * LARGEST_BYTES


def read_stage(path: str | Path) -> TrackFile:
    """Read the camera and the lights of a stage.

    Parameters
    ----------
    path : path
        .usd, .usda, .usdc or .usdz.

    Returns
    -------
    TrackFile
        A track for each light in front of the camera, with its time codes as frames.

    Raises
    ------
    FileError
        The stage cannot be read, or has no camera, several cameras, or no light.
    FlarewrightError
        The package `usd-core` is not installed.

    Notes
    -----
    A camera looks along its -z and a distant light shines along its own (UsdGeom, UsdLux). Apertures and focal length
    have one unit. Tests: tests/io/tracks/test_usd_stage.py.
    """
    with outside(path, _WHAT, largest=_LARGEST):
        usd = optional("pxr.Usd", "usd", "a USD stage")
        geom, lux = optional("pxr.UsdGeom", "usd", "a USD stage"), optional("pxr.UsdLux", "usd", "a USD stage")
        name = shown(path)
        stage = _opened(usd, str(path), name)
        cameras = [prim for prim in stage.Traverse() if prim.IsA(geom.Camera)]
        if len(cameras) != 1:
            listed = ", ".join(str(prim.GetPath()) for prim in cameras[:5])
            what = "no camera; add one" if not cameras else f"{len(cameras)} cameras ({listed}); keep one active"
            raise FileError(f"{name} has {what} whose picture shows the lights")
        prims = [prim for prim in stage.Traverse() if prim.HasAPI(lux.LightAPI)]
        placeless = [str(prim.GetName()) for prim in prims if prim.GetTypeName() in _PLACELESS]
        prims = [prim for prim in prims if prim.GetTypeName() not in _PLACELESS]
        if not prims:
            raise FileError(f"{name} has no light with a place: distant, sphere, disk, rect or cylinder; add one")
        if len(prims) > MOST_TRACKS:
            raise FileError(f"{name} has more than {MOST_TRACKS} lights; export those that flare")
        frames = _frames(stage, name)
        camera = tuple(_camera(geom.Camera(cameras[0]), frame, geom, usd, name) for frame in frames)
        lights = tuple(_light(prim, frames, geom, lux, usd) for prim in prims)
        tracks, remarks = tracks_of_scene(name, camera, lights)
        faded = [
            str(prim.GetName()) for prim in prims if lux.LightAPI(prim).GetIntensityAttr().ValueMightBeTimeVarying()
        ]
        if faded:
            remarks = (
                *remarks,
                f"{name}: intensities of {', '.join(faded)[:200]} change, of which only 0 has an effect",
            )
        if placeless:
            remarks = (*remarks, f"{name}: {', '.join(placeless)[:200]} have no place, so they are left out")
        return TrackFile(tracks, "usd", float(stage.GetTimeCodesPerSecond()), remarks)


def _opened(usd: Any, path: str, name: str) -> Any:
    """Return the stage of a file; the library also prints its errors, which say less."""
    try:
        stage = usd.Stage.Open(path)
    except Exception as error:
        raise FileError(f"{name} cannot be read as {_WHAT}: is it the right file?") from error
    if stage is None:
        raise FileError(f"{name} cannot be read as {_WHAT}: is it the right file?")
    return stage


def _frames(stage: Any, name: str) -> tuple[float, ...]:
    """Return the frames of a stage: its time codes, or 1 for a stage that rests."""
    if not stage.HasAuthoredTimeCodeRange():
        return (1.0,)
    first, last = ceil(stage.GetStartTimeCode() - 1e-6), floor(stage.GetEndTimeCode() + 1e-6)
    if not 0 <= last - first < MOST_FRAMES:
        raise FileError(f"{name} has time codes {first} to {last}; give a range of 1 to {MOST_FRAMES} frames")
    return tuple(float(frame) for frame in range(first, last + 1))


def _matrix(prim: Any, frame: float, geom: Any, usd: Any) -> Floats:
    """Return a prim's matrix to the world; USD multiplies row vectors, so it is transposed."""
    found = geom.Imageable(prim).ComputeLocalToWorldTransform(usd.TimeCode(frame))
    return np.array(found, dtype=np.float64).T


def _camera(camera: Any, frame: float, geom: Any, usd: Any, name: str) -> CameraFrame:
    """Return the camera at a frame."""
    time = usd.TimeCode(frame)
    focal, across, down, right, up = (
        float(attribute.Get(time) or 0.0)
        for attribute in (
            camera.GetFocalLengthAttr(), camera.GetHorizontalApertureAttr(), camera.GetVerticalApertureAttr(),
            camera.GetHorizontalApertureOffsetAttr(), camera.GetVerticalApertureOffsetAttr(),
        )
    )  # fmt: skip
    if camera.GetProjectionAttr().Get(time) == geom.Tokens.orthographic:
        raise FileError(f"{name}: the camera is orthographic, and a lens is not; make it a perspective camera")
    if not (focal > 0.0 and across > 0.0 and down > 0.0):
        raise FileError(f"{name}: the camera has a focal length or an aperture of 0 at frame {frame:g}; correct it")
    # an aperture that is moved right shows the axis left of the picture's middle
    axis = 0.5 - right / across, 0.5 + up / down
    return CameraFrame(frame, _matrix(camera.GetPrim(), frame, geom, usd), focal, (across, down), axis)


def _light(prim: Any, frames: tuple[float, ...], geom: Any, lux: Any, usd: Any) -> SceneLight:
    """Return a light of a stage."""
    distant = bool(prim.IsA(lux.DistantLight))
    radius, angle = 0.0, 0.0
    if distant:
        angle = float(lux.DistantLight(prim).GetAngleAttr().Get() or 0.0)
    elif prim.GetTypeName() in ("SphereLight", "DiskLight"):
        radius = float(prim.GetAttribute("inputs:radius").Get() or 0.0)
    states = []
    api = lux.LightAPI(prim)
    colours = [_colour(api, usd.TimeCode(frame)) for frame in frames]
    lit = next((colour for colour in colours if colour is not None and max(colour) > 0.0), None)
    for frame, colour in zip(frames, colours, strict=True):
        time = usd.TimeCode(frame)
        level = float(api.GetIntensityAttr().Get(time) or 0.0)
        seen = geom.Imageable(prim).ComputeVisibility(time) != geom.Tokens.invisible
        # units of USD say nothing about the irradiance at the camera, but a light of 0 is off, and so is a black one,
        # which keeps the colour of a frame beside it
        black = colour is not None and max(colour) <= 0.0
        lit = lit if black else colour
        matrix = _matrix(prim, frame, geom, usd)
        states.append(LightFrame(frame, matrix, None, lit, seen and level > 0.0 and not black))
    return SceneLight(str(prim.GetName()), distant, tuple(states), angle, radius)


def _colour(api: Any, time: Any) -> tuple[float, float, float] | None:
    """Return the colour of a light, which may be black; None for white, which keeps the light's own spectrum."""
    attribute = api.GetColorAttr()
    value = attribute.Get(time)
    if value is None or not attribute.HasAuthoredValue():
        return None
    red, green, blue = (max(float(part), 0.0) for part in value)
    return red, green, blue
