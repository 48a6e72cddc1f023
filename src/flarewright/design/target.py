"""From a project to a problem: which ghosts are wanted, and among which lenses they are looked for."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, radians, tan

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..model import Project, Stop
from ..model.design import Design, GhostWish
from ..render.prepare import Settled, settle
from .canvas import Canvas, canvas
from .glass_list import glass_list
from .impossible import on_the_line
from .objective import Objective, own_objective, relative_weights
from .picture import light_of_ghosts
from .prescription import Structure, structure_of, structures, surfaces_for, vector_of
from .problem import Problem

Floats = NDArray[np.float64]


def problem_of(project: Project) -> tuple[Problem, Settled]:
    """Read a project as a problem of design.

    Parameters
    ----------
    project : Project
        Its `design` says what is wanted; without one: another lens with the same ghosts.

    Returns
    -------
    problem : Problem
    settled : Settled
        The project's own lens.

    Raises
    ------
    FlarewrightError
        When the project's lens cannot be designed with, a wish names no ghost of it, or no lens has so many ghosts.
    """
    design = project.design or Design()
    design = design.replace(wishes=tuple(on_the_line(wish, k, project) for k, wish in enumerate(design.wishes)))
    settled = settle(project)
    structure = structure_of(settled.lens)
    vector = vector_of(settled.lens, 2.0 * settled.order.stop_semi_diameter, settled.order.sensor_distance)
    slopes = np.array([hypot(*(tan(radians(angle)) for angle in light.field_deg)) for light in project.lights])
    if not slopes.all():
        raise ProjectError("a light on the axis puts every ghost at its middle; move the light off it to design")
    own = own_objective(
        structure, vector, slopes, bounds=design.bounds, signed=design.signed, brightness=design.brightness,
        weights=design.weights, extra=design.extra, entrance=design.entrance,
    )  # fmt: skip
    objective = with_wishes(own, design, structure)
    if len(objective.targets) == 0 or objective.wanted == 0:
        raise ProjectError("no ghost is wanted; leave some of the lens' own, or wish for new ones")
    if design.judge == "picture":
        objective = replace(objective, picture=_picture(project, objective, settled.lens.iris.blades))
    found = _structures(design, structure, objective)
    changed = bool(design.wishes) and design.own_ghosts
    bounds, glasses = design.bounds, None
    if design.glasses:
        glasses = glass_list(design.glasses, bounds.n_d)
        bounds = bounds.replace(n_d=(float(glasses.n_d[0]), float(glasses.n_d[-1])))
    return Problem(
        objective, found, bounds,
        stop_diameter=float(vector[0]) if design.brightness == "stop" else None,
        fixed=vector if design.fixed_rows else None, fixed_rows=_checked(design.fixed_rows, structure),
        begin_with=((structure, vector),) if changed and structure in found else (), glasses=glasses,
        fixed_media=tuple(None if isinstance(row, Stop) else row.medium for row in settled.lens.rows),
        traced=design.quality == "final",
    ), settled  # fmt: skip


def _picture(project: Project, objective: Objective, blades: int) -> Canvas:
    """Draw the wanted ghosts as the thesis' grey picture shows them, in the frame of the project's camera."""
    directions = []
    for light in project.lights:
        x, y = (tan(radians(angle)) for angle in light.field_deg)
        directions.append((x / hypot(x, y), y / hypot(x, y)))
    width, height = project.camera.sensor
    drawn = np.asarray((objective.weights[:, :2] > 0.0).all(axis=1))
    return canvas(
        objective.targets, objective.spans, directions, light=light_of_ghosts(objective.wanted),
        half_frame=(0.5 * width, 0.5 * height), blades=blades, drawn=drawn,
    )  # fmt: skip


def _structures(design: Design, own: Structure, objective: Objective) -> tuple[Structure, ...]:
    wanted = objective.wanted
    if design.structure == "lens":
        if len(own.pairs) < wanted:
            raise ProjectError(
                f"{wanted} ghosts are wanted at one light, but a lens built like the project's has {len(own.pairs)} on "
                'either side of its stop; choose structure = "any" and more surfaces'
            )
        return (own,)
    surfaces = design.surfaces or (own.rows - 1 if design.own_ghosts else _enough(surfaces_for(wanted), wanted))
    found = structures(surfaces, wanted)
    if not found:
        fewest = _enough(surfaces, wanted)
        raise ProjectError(
            f"{wanted} ghosts are wanted at one light, but no lens of {surfaces} surfaces has so many on one side of "
            f"its stop; give surfaces = {fewest} or more"
        )
    # where the lens' own pattern is as good as the others, it is tried first
    return (own, *(one for one in found if one != own)) if own in found else found


def _enough(surfaces: int, wanted: int) -> int:
    """Return so many surfaces, or the next number that makes enough ghosts."""
    return next(count for count in range(surfaces, 1000) if structures(count, wanted, most=1))


def _checked(rows: tuple[int, ...], structure: Structure) -> tuple[int, ...]:
    for row in rows:
        if not 0 <= row < structure.rows:
            raise ProjectError(f"design.fixed_rows has {row}, but the lens' rows are 0 to {structure.rows - 1}")
    return rows


def with_wishes(own: Objective, design: Design, structure: Structure) -> Objective:
    """Apply wishes to the targets that a lens' own ghosts make.

    Parameters
    ----------
    own : Objective
    design : Design
    structure : Structure
        Of the lens.

    Returns
    -------
    Objective

    Raises
    ------
    ProjectError
        When a wish names a ghost or a light that there is not.
    """
    names = {f"{j}-{i}" for j, i in structure.pairs}
    lights = len(own.slopes)
    for number, wish in enumerate(design.wishes):
        where = f"design.wishes[{number}]"
        if wish.ghost is not None and wish.ghost not in names:
            raise ProjectError(
                f"{where}: the lens has no ghost {wish.ghost} that reflects twice on one side of the stop; "
                "flarewright ghosts LENS --paths same-side lists them"
            )
        if wish.light is not None and wish.light >= lights:
            raise ProjectError(f"{where}: there is no light {wish.light}; they count from 0 to {lights - 1}")
        if wish.ghost is not None and not design.own_ghosts:
            raise ProjectError(f"{where} names the lens' own ghost {wish.ghost}, but own_ghosts is false")
    targets, weights, labels, spans = [], [], [], [0]
    for light in range(lights):
        span = range(int(own.spans[light]), int(own.spans[light + 1])) if design.own_ghosts else range(0)
        for t in span:
            name = own.names[t].partition(" ")[0]
            target, weight, kept = own.targets[t].copy(), own.weights[t].copy(), True
            for wish in design.wishes:
                if wish.ghost == name and wish.light in (None, light):
                    target, weight, kept = _changed(target, weight, wish, design)
            if kept:
                targets.append(target)
                weights.append(weight)
                labels.append(own.names[t])
        for number, wish in enumerate(design.wishes):
            if wish.ghost is None and wish.light in (None, light):
                start = np.array([0.0, 1.0, 0.0])
                target, weight, _ = _changed(start, np.array([1.0, 1.0, 0.0]), wish, design)
                targets.append(target)
                weights.append(weight)
                labels.append(f"wish {number}" if lights == 1 else f"wish {number} at light {light}")
        spans.append(len(targets))
    return replace(
        own, targets=np.array(targets).reshape(-1, 3), weights=np.array(weights).reshape(-1, 3),
        spans=np.array(spans, dtype=np.int64), names=tuple(labels),
    )  # fmt: skip


def _changed(target: Floats, weight: Floats, wish: GhostWish, design: Design) -> tuple[Floats, Floats, bool]:
    """Return a target as a wish changes it, and whether it stays one."""
    if wish.action == "remove":
        return target, weight, False
    place = target[0] if wish.place_mm is None else wish.place_mm
    radius = (target[1] if wish.radius_mm is None else wish.radius_mm) * wish.height
    radius = radius if design.signed else abs(radius)
    new = np.array([place + wish.move_mm, radius, target[2] + np.log(wish.brightness)])
    if wish.action == "ignore":
        return new, np.zeros(3), True
    size = float(relative_weights(new[1:2])[0]) if design.weights == "relative" else 1.0
    return new, np.array([size, size, weight[2]]) * wish.weight, True
