"""How bright a draft's ghosts shall be wherever the light stands: learned from traced ghosts, angle by angle.

Matrices know neither inner rims nor what steep rays do, so how far a draft is off changes with the field angle: what
was learned where the light rests holds some degrees around it. For a hand that goes on, the ghosts of a few angles are
measured once, by matrices and by traced rays, while nothing else is to be done.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan, atan2, cos, degrees, hypot, log, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from ..measure.rendering import is_measured
from ..model import Light, Project
from .draft_match import LEAST, MOST, STEP, Ladder, Levels, Match, Rung
from .jobs import Check
from .seen import see

Floats = NDArray[np.float64]

# where ghosts are measured; farther out, as at the last
ANGLES_DEG = tuple(5.0 * k for k in range(13))
# so far from where the light rests what was learned there fades into what was learned angle by angle
NEAR_DEG = 10.0
# what a ghost may be multiplied by: one that no ray comes through is hardly seen, whatever matrices say
DARKEST, BRIGHTEST = LEAST / 16.0, 2.0 * MOST
# the side of the square picture in which all ghosts within the frame's circle are measured
SIDE_PX = 540
EVERY = ("all",)


def with_rung(ladder: Ladder | None, rung: Rung) -> Ladder:
    """Return a ladder with one rung more.

    Parameters
    ----------
    ladder : Ladder or None
        None: the first.
    rung : Rung

    Returns
    -------
    Ladder
    """
    rungs = tuple(sorted([*(() if ladder is None else ladder.rungs), rung], key=lambda one: one.angle_deg))
    names = tuple(sorted({name for one in rungs for name in one.parts}))
    parts = np.empty((len(rungs), len(names)))
    for number, name in enumerate(names):
        lit = [k for k, one in enumerate(rungs) if name in one.parts]
        parts[:, number] = np.interp(np.arange(len(rungs)), lit, [rungs[k].parts[name] for k in lit])
    return Ladder(rungs, names, parts)


def missing(ladder: Ladder | None, project: Project) -> list[float]:
    """Return the angles that are not measured yet, those first that are nearest to the light.

    Of a measured flare there are none: its drafts have the ghosts of its final pictures.
    """
    if is_measured(project):
        return []
    known = set() if ladder is None else {one.angle_deg for one in ladder.rungs}
    here = _angle(_brightest(project))
    return sorted((angle for angle in ANGLES_DEG if angle not in known), key=lambda angle: abs(angle - here))


def measured(project: Project, angle_deg: float, check: Check) -> Rung:
    """Measure the ghosts of a project's brightest light as if it stood at another field angle.

    Parameters
    ----------
    project : Project
    angle_deg : float
    check : callable
        What it raises ends the work.

    Returns
    -------
    Rung
    """
    light = _brightest(project)
    x, y = (tan(radians(angle)) for angle in light.field_deg)
    turn, slope = atan2(y, x), tan(radians(angle_deg))
    there = (degrees(atan(slope * cos(turn))), degrees(atan(slope * sin(turn))))
    # a hand may turn to any side, so all counts that lies within the frame's circle
    across = hypot(*project.camera.sensor)
    camera = project.camera.replace(size_px=(SIDE_PX, SIDE_PX), sensor_mm=(across, across))
    lone = light.replace(field_deg=there, keyframes=(), holdout=None)
    stage = project.replace(lights=(lone,), camera=camera, holdout=None)
    drafted, traced = (
        {ghost.name: ghost.flux for ghost in see(stage, grade, lambda *_: check()).ghosts}
        for grade in ("draft", "final")
    )
    parts = {name: min(traced.get(name, 0.0) / flux, BRIGHTEST) for name, flux in drafted.items()}
    levelled = sum(flux * parts[name] for name, flux in drafted.items())
    total = sum(traced.values()) / levelled if levelled > 0.0 else 1.0
    return Rung(angle_deg, parts, min(max(total, 1.0 / BRIGHTEST), BRIGHTEST))


def levels_at(match: Match, project: Project) -> Levels:
    """Return the gains of a draft's ghosts where the project's lights stand.

    Parameters
    ----------
    match : Match
    project : Project

    Returns
    -------
    Levels
        Those of `match` where its lights rest, and where nothing else is known.
    """
    ladder = match.ladder
    if ladder is None:
        return match.levels
    parts, total = _at(ladder, project.lights)
    near = _nearness(match, project.lights)
    held = {name: gain for gain, names in match.levels for name in names}
    every = held.pop(EVERY[0], 1.0)
    # a ghost that no angle has shown yet is known from where the light rests alone
    lone = {name: (every * gain) ** near for name, gain in held.items() if name not in ladder.names}
    if near > 0.0:
        there, _ = _at(ladder, match.lights)
        learned = np.array([every * held.get(name, 1.0) for name in ladder.names])
        parts = np.exp2(np.log2(parts) + near * (np.log2(learned) - np.log2(there)))
    # the gain of all has been learned with the levels where the lights rest
    total = (total / (sum(match.gain) / 3.0)) ** (1.0 - near)
    groups: dict[int, list[str]] = {}
    for name, part in (*zip(ladder.names, parts.tolist(), strict=True), *lone.items()):
        groups.setdefault(round(log(part, STEP)), []).append(name)
    found = tuple((STEP**step, tuple(names)) for step, names in sorted(groups.items()) if step != 0)
    return found if total == 1.0 else (*found, (total, EVERY))


def _at(ladder: Ladder, lights: Sequence[Light]) -> tuple[Floats, float]:
    """Return what each ghost, and then all, must be multiplied by, on average over the lights."""
    weights = np.array([light.intensity for light in lights])
    weights = weights / weights.sum() if weights.sum() > 0.0 else np.full(len(lights), 1.0 / len(lights))
    angles = [one.angle_deg for one in ladder.rungs]
    parts, total = np.zeros(len(ladder.names)), 0.0
    for light, weight in zip(lights, weights.tolist(), strict=True):
        place = float(np.interp(_angle(light), angles, np.arange(len(angles))))
        k = min(int(place), len(angles) - 1)
        after = min(k + 1, len(angles) - 1)
        part = place - k
        parts += weight * ((1.0 - part) * ladder.parts[k] + part * ladder.parts[after])
        total += weight * ((1.0 - part) * ladder.rungs[k].total + part * ladder.rungs[after].total)
    return np.clip(parts, DARKEST, BRIGHTEST), total


def _nearness(match: Match, lights: Sequence[Light]) -> float:
    """Tell how near lights are to where they rested: 1 there, 0 from `NEAR_DEG` on."""
    if len(match.lights) != len(lights):
        return 0.0
    far = max(abs(_angle(one) - _angle(other)) for one, other in zip(match.lights, lights, strict=True))
    return max(0.0, 1.0 - far / NEAR_DEG)


def _brightest(project: Project) -> Light:
    return max(project.lights, key=lambda light: light.intensity)


def _angle(light: Light) -> float:
    """Return a light's angle to the axis, degrees."""
    return degrees(atan(hypot(*(tan(radians(angle)) for angle in light.field_deg))))
