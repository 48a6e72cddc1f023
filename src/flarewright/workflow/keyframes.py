"""A project at a time: values of its keyframes and curves."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import ceil, fmod
from typing import Any

import numpy as np

from ..errors import ProjectError
from ..io.project.project_file import validation_messages
from ..model import BlackBody, Iris, Light, Project, Rgb, Timeline
from ..model.project.animation import Curve, Motion
from ..sentences import INVALID


def value_at(at_s: float, times_s: Sequence[float], values: Sequence[float], motion: Motion = "linear") -> float:
    """Interpolate keys at a time.

    Parameters
    ----------
    at_s : float
    times_s, values : sequence of float
        Keys in the order of time; the value is constant before the first and after the last.
    motion : {"linear", "smooth"}
        linear: straight lines; smooth: the monotone cubic of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984,
        300), which has a continuous slope and never leaves the range of two neighbouring keys, so that an f-number or
        an intensity stays valid.

    Notes
    -----
    `tests/workflow/test_keyframes.py` compares the slopes at the keys with the paper's harmonic mean.
    """
    if motion == "linear" or len(times_s) < 2:
        return float(np.interp(at_s, times_s, values))
    from scipy.interpolate import PchipInterpolator

    found = float(PchipInterpolator(times_s, values)(min(max(at_s, times_s[0]), times_s[-1])))
    # rounding leaves the range by 1e-16, and an intensity below 0 is none
    return min(max(found, min(values)), max(values))


def light_at(light: Light, at_s: float) -> Light:
    """Return a light with its place, intensity and colour at a time.

    Parameters
    ----------
    light : Light
    at_s : float
        Seconds; the light rests before its first key and after its last one.

    Returns
    -------
    Light
        With its keyframes and curves; a light without any is unchanged.
    """
    changes: dict[str, Any] = {}
    if light.keyframes:
        times = [key.at_s for key in light.keyframes]
        angles = zip(*(key.field_deg for key in light.keyframes), strict=True)
        changes["field_deg"] = tuple(value_at(at_s, times, axis, light.motion) for axis in angles)
    for curve in light.curves:
        found = _curve_at(curve, at_s)
        match curve.of:
            case "intensity":
                changes["intensity"] = found
            case "rgb":
                changes["spectrum"] = Rgb(rgb=found)
            case "temperature_k":
                changes["spectrum"] = BlackBody(temperature_k=found)
    return light.replace(**changes) if changes else light


def project_at(project: Project, at_s: float) -> Project:
    """Return a project with all its values at a time.

    Parameters
    ----------
    project : Project
    at_s : float
        Seconds.

    Returns
    -------
    Project
        With its keyframes and curves.

    Raises
    ------
    ProjectError
        The values at this time cannot be used together.
    """
    if is_still(project):
        return project
    changes: dict[str, Any] = {}
    for curve in project.curves:
        found = _curve_at(curve, at_s)
        match curve.of:
            case "focus_distance":
                changes["camera"] = {**dict(project.camera), "focus_distance": found}
            case "rotation_deg":
                changes["iris"] = {**dict(_iris(project)), "rotation_deg": fmod(found, 360.0)}
            case "f_number" | "zoom":
                changes[curve.of] = found
            case gain:
                art = changes.get("art", dict(project.art))
                changes["art"] = {**art, "gain": {**art["gain"], gain.removeprefix("gain."): found}}
    try:
        changes["lights"] = tuple(light_at(light, at_s) for light in project.lights)
        placed: Project = project.replace(**changes)
    except INVALID as error:
        raise ProjectError(f"at {at_s:g} s: {validation_messages(error, changes)[0]}") from None
    return placed


def still(project: Project) -> Project:
    """Return a project without keyframes and curves: what one frame shows."""
    lights = tuple(light.replace(keyframes=(), motion="linear", curves=()) for light in project.lights)
    return project.replace(lights=lights, curves=(), timeline=Timeline())


def is_still(project: Project) -> bool:
    """Return whether a project has neither keyframes nor curves."""
    return not project.curves and not any(light.keyframes or light.curves for light in project.lights)


def length_s(project: Project) -> float:
    """Return the time of the last key; 0 without keys."""
    times = [light.keyframes[-1].at_s for light in project.lights if light.keyframes]
    curves = [*project.curves, *(curve for light in project.lights for curve in light.curves)]
    return max([*times, *(curve.at_s[-1] for curve in curves)], default=0.0)


def last_frame(project: Project) -> int:
    """Return the number of the first frame at or after the last key; that at 0 s without keys."""
    timeline = project.timeline
    return timeline.start + ceil(length_s(project) * float(frame_rate(timeline.fps)) - 1e-6)


def peak_intensity(project: Project) -> float:
    """Return the largest intensity that a light has at any time; neither kind of curve exceeds its keys."""
    peaks: list[Any] = []
    for light in project.lights:
        keys = [curve.values for curve in light.curves if curve.of == "intensity"]
        peaks += list(keys[0]) if keys else [light.intensity]
    return max(value for value in peaks if isinstance(value, float))


def frame_rate(fps: float) -> Fraction:
    """Return frames per second as a fraction: 23.976 is 24000/1001, as SMPTE ST 2110 and OpenEXR write it.

    Examples
    --------
    >>> frame_rate(23.976), frame_rate(239.76), frame_rate(25.0)
    (Fraction(24000, 1001), Fraction(240000, 1001), Fraction(25, 1))
    """
    nominal = round(fps * 1.001)
    broadcast = Fraction(nominal * 1000, 1001)
    # people write 23.976, 23.98, 29.97, 59.94, 119.88; rates of no format, such as 24.975, need three decimals
    known = nominal >= 12 and (nominal % 12 == 0 or nominal % 15 == 0)
    if nominal > 0 and abs(fps - float(broadcast)) < (0.006 if known else 0.0006):
        return broadcast
    return Fraction(fps).limit_denominator(1000)


def time_of(frame: float, timeline: Timeline) -> float:
    """Return the time of a frame, seconds; the frame `timeline.start` is at 0 s."""
    return float((Fraction(frame) - timeline.start) / frame_rate(timeline.fps))


def _curve_at(curve: Curve, at_s: float) -> Any:
    """Return the value of a curve, one number or a colour."""
    if curve.of == "rgb":
        channels = zip(*curve.values, strict=True)
        return tuple(value_at(at_s, curve.at_s, channel, curve.motion) for channel in channels)
    return value_at(at_s, curve.at_s, curve.values, curve.motion)  # type: ignore[arg-type]


def _iris(project: Project) -> Iris:
    """Return the iris of a project, or of its lens."""
    if project.iris is not None:
        return project.iris
    from ..render.scene.resolve import open_lens

    return open_lens(project.lens).lens.iris
