"""Brightness gains of a draft's ghosts as a function of the field angle, measured with traced ghosts.

Matrices ignore inner rims and the behaviour of steep rays, so the error of a draft depends on the field angle. Gains
learned where the light rests hold within some degrees. For a drag beyond that, the ghosts are measured at a few angles,
by matrices and by traced rays, while the editor is idle.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan, atan2, cos, degrees, hypot, log, radians, sin, tan

import numpy as np

from ...measure.replay.measured_project import is_measured
from ...model import Light, Project
from ...typing import Floats
from ..common.latest_job import Check
from .draft_match import LEAST, MOST, STEP, DraftCalibration, Levels, Match, Node
from .ghost_picking import see

# field angles of the measurements; beyond the last one its gains apply
ANGLES_DEG = tuple(5.0 * k for k in range(13))
# angular distance from the light's rest place over which its gains fade into those of the calibration
NEAR_DEG = 10.0
# limits of a ghost's gain: a ghost that no ray reaches becomes nearly invisible
DARKEST, BRIGHTEST = LEAST / 16.0, 2.0 * MOST
# side of the square picture, px, which covers all ghosts within the frame's circle
SIDE_PX = 540
EVERY = ("all",)


def with_node(calibration: DraftCalibration | None, node: Node) -> DraftCalibration:
    """Return a calibration with one more node.

    Parameters
    ----------
    calibration : DraftCalibration or None
        None: the first node.
    node : Node
    """
    nodes = tuple(sorted([*(() if calibration is None else calibration.nodes), node], key=lambda one: one.angle_deg))
    names = tuple(sorted({name for one in nodes for name in one.parts}))
    parts = np.empty((len(nodes), len(names)))
    for number, name in enumerate(names):
        lit = [k for k, one in enumerate(nodes) if name in one.parts]
        parts[:, number] = np.interp(np.arange(len(nodes)), lit, [nodes[k].parts[name] for k in lit])
    return DraftCalibration(nodes, names, parts)


def missing(calibration: DraftCalibration | None, project: Project) -> list[float]:
    """Return the angles that are not measured yet, nearest to the light first.

    Empty for a measured flare, whose drafts have the same ghosts as its final pictures.
    """
    if is_measured(project):
        return []
    known = set() if calibration is None else {one.angle_deg for one in calibration.nodes}
    here = _angle(_brightest(project))
    return sorted((angle for angle in ANGLES_DEG if angle not in known), key=lambda angle: abs(angle - here))


def measured(project: Project, angle_deg: float, check: Check) -> Node:
    """Measure the ghosts of a project's brightest light at another field angle.

    Parameters
    ----------
    project : Project
    angle_deg : float
    check : callable
        Exceptions that it raises end the work.
    """
    light = _brightest(project)
    x, y = (tan(radians(angle)) for angle in light.field_deg)
    turn, slope = atan2(y, x), tan(radians(angle_deg))
    there = (degrees(atan(slope * cos(turn))), degrees(atan(slope * sin(turn))))
    # a drag may turn the light in any direction, so cover the whole circle around the frame
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
    return Node(angle_deg, parts, min(max(total, 1.0 / BRIGHTEST), BRIGHTEST))


def levels_at(match: Match, project: Project) -> Levels:
    """Return the gains of a draft's ghosts for the present places of the lights.

    Returns
    -------
    Levels
        Those of `match` where its lights rest, and where no calibration exists.
    """
    calibration = match.calibration
    if calibration is None:
        return match.levels
    parts, total = _at(calibration, project.lights)
    near = _nearness(match, project.lights)
    held = {name: gain for gain, names in match.levels for name in names}
    every = held.pop(EVERY[0], 1.0)
    # a ghost outside the calibration has gains at the rest place only
    lone = {name: (every * gain) ** near for name, gain in held.items() if name not in calibration.names}
    if near > 0.0:
        there, _ = _at(calibration, match.lights)
        learned = np.array([every * held.get(name, 1.0) for name in calibration.names])
        parts = np.exp2(np.log2(parts) + near * (np.log2(learned) - np.log2(there)))
    # the overall gain was learned together with the levels at the rest place
    total = (total / (sum(match.gain) / 3.0)) ** (1.0 - near)
    groups: dict[int, list[str]] = {}
    for name, part in (*zip(calibration.names, parts.tolist(), strict=True), *lone.items()):
        groups.setdefault(round(log(part, STEP)), []).append(name)
    found = tuple((STEP**step, tuple(names)) for step, names in sorted(groups.items()) if step != 0)
    return found if total == 1.0 else (*found, (total, EVERY))


def _at(calibration: DraftCalibration, lights: Sequence[Light]) -> tuple[Floats, float]:
    """Return the gain of each ghost, and the overall gain, averaged over the lights."""
    weights = np.array([light.intensity for light in lights])
    weights = weights / weights.sum() if weights.sum() > 0.0 else np.full(len(lights), 1.0 / len(lights))
    angles = [one.angle_deg for one in calibration.nodes]
    parts, total = np.zeros(len(calibration.names)), 0.0
    for light, weight in zip(lights, weights.tolist(), strict=True):
        place = float(np.interp(_angle(light), angles, np.arange(len(angles))))
        k = min(int(place), len(angles) - 1)
        after = min(k + 1, len(angles) - 1)
        part = place - k
        parts += weight * ((1.0 - part) * calibration.parts[k] + part * calibration.parts[after])
        total += weight * ((1.0 - part) * calibration.nodes[k].total + part * calibration.nodes[after].total)
    return np.clip(parts, DARKEST, BRIGHTEST), total


def _nearness(match: Match, lights: Sequence[Light]) -> float:
    """Return how near the lights are to their rest places: 1 there, 0 from `NEAR_DEG` on."""
    if len(match.lights) != len(lights):
        return 0.0
    far = max(abs(_angle(one) - _angle(other)) for one, other in zip(match.lights, lights, strict=True))
    return max(0.0, 1.0 - far / NEAR_DEG)


def _brightest(project: Project) -> Light:
    return max(project.lights, key=lambda light: light.intensity)


def _angle(light: Light) -> float:
    """Return a light's angle to the axis, degrees."""
    return degrees(atan(hypot(*(tan(radians(angle)) for angle in light.field_deg))))
