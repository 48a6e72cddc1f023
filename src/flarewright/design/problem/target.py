"""From a project to a problem: the target ghosts, and the lenses that a search may try."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, radians, tan

import numpy as np

from ...errors import ProjectError
from ...model import Project, Surface
from ...model.project.design import Design, GhostTarget
from ...optics.lens.plane_plates import FILTER_ROWS
from ...render.scene.resolve import ResolvedProject, resolve_project
from ...typing import Floats
from .glass_list import glass_list
from .grey_picture import light_of_ghosts
from .impossible import on_the_line
from .objective import Objective, own_objective, relative_weights
from .prescription import Structure, structure_of, structures, surfaces_for, vector_of
from .problem import Problem
from .target_image import TargetCanvas, canvas


def problem_of(project: Project) -> tuple[Problem, ResolvedProject]:
    """Convert a project to a design problem.

    Parameters
    ----------
    project : Project
        Its `design` sets the targets; without one, the task is another lens with the same ghosts.

    Returns
    -------
    problem : Problem
    settled : ResolvedProject
        The project's lens, resolved.

    Raises
    ------
    FlarewrightError
        When design cannot use the project's lens, a target names no ghost of it, no lens has enough ghosts, or a light
        is near.
    """
    for number, light in enumerate(project.lights):
        # its ghosts have another place and another size than those of a distant light in the same direction
        if light.distance is not None:
            raise ProjectError(
                f"lights[{number}].distance: design places the ghosts of distant lights only; remove the distance"
            )
    design = project.design or Design()
    design = design.replace(
        ghost_targets=tuple(
            on_the_line(ghost_target, k, project) for k, ghost_target in enumerate(design.ghost_targets)
        )
    )
    settled = resolve_project(project)
    structure = structure_of(settled.lens)
    vector = vector_of(settled.lens, 2.0 * settled.order.stop_semi_diameter, settled.order.sensor_distance)
    slopes = np.array([hypot(*(tan(radians(angle)) for angle in light.field_deg)) for light in project.lights])
    if not slopes.all():
        raise ProjectError("a light on the axis puts every ghost at its middle; move the light off it to design")
    own = own_objective(
        structure, vector, slopes, bounds=design.bounds, signed=design.signed, brightness=design.brightness,
        weights=design.weights, extra=design.extra, entrance=design.entrance,
    )  # fmt: skip
    objective = _with_ghost_targets(own, design, structure)
    if len(objective.targets) == 0 or objective.wanted == 0:
        raise ProjectError("no ghost is a target; keep some of the lens' own ghosts, or add new targets")
    if design.judge == "picture":
        objective = replace(objective, picture=_picture(project, objective, settled.iris.blades))
    found = _structures(design, structure, objective)
    changed = bool(design.ghost_targets) and design.own_ghosts
    bounds, glasses = design.bounds, None
    if design.glasses:
        glasses = glass_list(design.glasses, bounds.n_d)
        bounds = bounds.replace(n_d=(float(glasses.n_d[0]), float(glasses.n_d[-1])))
    return Problem(
        objective, found, bounds,
        stop_diameter=float(vector[0]) if design.brightness == "stop" else None,
        fixed=vector if design.fixed_rows else None, fixed_rows=_fixed_rows(design, settled),
        begin_with=((structure, vector),) if changed and structure in found else (), glasses=glasses,
        own_rows=settled.lens.rows,
        traced=design.quality == "final",
    ), settled  # fmt: skip


def _picture(project: Project, objective: Objective, blades: int) -> TargetCanvas:
    """Draw the target ghosts as the thesis' grey picture, in the frame of the project's camera."""
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
            f"{wanted} ghosts are wanted at one light, but no lens of {surfaces} surfaces has that many on one side of "
            f"its stop; give surfaces = {fewest} or more"
        )
    # where the lens' own pattern is as good as the others, try it first
    return (own, *(one for one in found if one != own)) if own in found else found


def _enough(surfaces: int, wanted: int) -> int:
    """Return `surfaces`, or the next larger number that makes enough ghosts."""
    return next(count for count in range(surfaces, 1000) if structures(count, wanted, most=1))


def _fixed_rows(design: Design, settled: ResolvedProject) -> tuple[int, ...]:
    """Return the rows that stay unchanged, counted with those of a filter; the design counts the lens' own."""
    own, ahead = settled.opened.lens.rows, 0 if settled.project.filter is None else FILTER_ROWS
    for row in design.fixed_rows:
        if not 0 <= row < len(own):
            raise ProjectError(f"design.fixed_rows has {row}, but the lens' rows are 0 to {len(own) - 1}")
        surface = settled.lens.rows[row + ahead]
        if design.quality == "final" and isinstance(surface, Surface) and not _is_centred_sphere(surface):
            raise ProjectError(
                f"design.fixed_rows has {row}, which is no centred sphere, and the rays of design.quality "
                f'"final" meet spheres only; choose "draft", or free row {row}'
            )
    return tuple(row + ahead for row in design.fixed_rows)


def _is_centred_sphere(surface: Surface) -> bool:
    return not (surface.conic or surface.terms or surface.displaced or surface.figure)


def _with_ghost_targets(own: Objective, design: Design, structure: Structure) -> Objective:
    """Return the objective made of a lens' own ghosts with ghost targets applied; they may name what does not exist."""
    names = {f"{j}-{i}" for j, i in structure.pairs}
    lights = len(own.slopes)
    visible = [
        {name.partition(" ")[0] for name in own.names[own.spans[light] : own.spans[light + 1]]}
        for light in range(lights)
    ]
    for number, ghost_target in enumerate(design.ghost_targets):
        where = f"design.ghost_targets[{number}]"
        if ghost_target.ghost is not None and ghost_target.ghost not in names:
            raise ProjectError(
                f"{where}: the lens has no ghost {ghost_target.ghost} that reflects twice on one side of the stop; "
                "flarewright ghosts LENS --paths same-side lists them"
            )
        if ghost_target.light is not None and ghost_target.light >= lights:
            raise ProjectError(f"{where}: there is no light {ghost_target.light}; they count from 0 to {lights - 1}")
        if ghost_target.ghost is not None and not design.own_ghosts:
            raise ProjectError(f"{where} names the lens' own ghost {ghost_target.ghost}, but own_ghosts is false")
        at = range(lights) if ghost_target.light is None else (ghost_target.light,)
        if _moves_own(ghost_target) and not any(ghost_target.ghost in visible[light] for light in at):
            # it has no place and size there from which to go on
            raise ProjectError(
                f"{where}: the lens' ghost {ghost_target.ghost} is invisible at that light; give place_mm and "
                "radius_mm of a new ghost instead, without its name"
            )
    targets, weights, labels, spans = [], [], [], [0]
    for light in range(lights):
        span = range(int(own.spans[light]), int(own.spans[light + 1])) if design.own_ghosts else range(0)
        for t in span:
            name = own.names[t].partition(" ")[0]
            target, weight, kept = own.targets[t].copy(), own.weights[t].copy(), True
            for ghost_target in design.ghost_targets:
                if ghost_target.ghost == name and ghost_target.light in (None, light):
                    target, weight, kept = _changed(target, weight, ghost_target, design)
            if kept:
                targets.append(target)
                weights.append(weight)
                labels.append(own.names[t])
        for number, ghost_target in enumerate(design.ghost_targets):
            if ghost_target.ghost is None and ghost_target.light in (None, light):
                start = np.array([0.0, 1.0, 0.0])
                target, weight, _ = _changed(start, np.array([1.0, 1.0, 0.0]), ghost_target, design)
                targets.append(target)
                weights.append(weight)
                labels.append(f"target {number}" if lights == 1 else f"target {number} at light {light}")
        spans.append(len(targets))
    return replace(
        own, targets=np.array(targets).reshape(-1, 3), weights=np.array(weights).reshape(-1, 3),
        spans=np.array(spans, dtype=np.int64), names=tuple(labels),
    )  # fmt: skip


def _moves_own(ghost_target: GhostTarget) -> bool:
    """Return whether a target gives one of the lens' own ghosts another place, size or brightness."""
    given = ghost_target.place_mm is not None or ghost_target.radius_mm is not None
    factors = (ghost_target.height, ghost_target.brightness)
    changed = given or ghost_target.move_mm != 0.0 or factors != (1.0, 1.0)
    return ghost_target.ghost is not None and ghost_target.action == "want" and changed


def _changed(target: Floats, weight: Floats, ghost_target: GhostTarget, design: Design) -> tuple[Floats, Floats, bool]:
    """Return a target and its weights as changed by a ghost target, and whether it stays a target."""
    if ghost_target.action == "remove":
        return target, weight, False
    place = target[0] if ghost_target.place_mm is None else ghost_target.place_mm
    radius = (target[1] if ghost_target.radius_mm is None else ghost_target.radius_mm) * ghost_target.height
    radius = radius if design.signed else abs(radius)
    new = np.array([place + ghost_target.move_mm, radius, target[2] + np.log(ghost_target.brightness)])
    if ghost_target.action == "ignore":
        return new, np.zeros(3), True
    size = float(relative_weights(new[1:2])[0]) if design.weights == "relative" else 1.0
    return new, np.array([size, size, weight[2]]) * ghost_target.weight, True
