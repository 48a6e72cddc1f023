"""Ghost targets: how single ghosts should look, stored in the design of a project."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, hypot, radians, sin, tan
from typing import Any

from ...errors import ProjectError
from ...model import Design, GhostTarget, Project, Rule
from .ghosts import reset_art


def ghost_target_of(project: Project, ghost: str) -> GhostTarget | None:
    """Return the target of one of the lens' own ghosts."""
    design = project.design
    return (
        None
        if design is None
        else next((ghost_target for ghost_target in design.ghost_targets if ghost_target.ghost == ghost), None)
    )


def set_ghost_target(project: Project, ghost: str, values: dict[str, Any]) -> Project:
    """Change the target of a ghost.

    Parameters
    ----------
    project : Project
    ghost : str
        "j-i", both rows on one side of the stop.
    values : dict
        Fields of `GhostTarget`.
    """
    j, i = (int(part) for part in ghost.split("-"))
    from ...render.scene.resolve import open_lens

    stop = open_lens(project.lens).lens.stop_row
    if (j < stop) != (i < stop):
        raise ProjectError(
            f"ghost {ghost} crosses the stop between its mirrors; design places ghosts that reflect twice on one side "
            f"of the stop (row {stop})"
        )
    ghost_target = (ghost_target_of(project, ghost) or GhostTarget(ghost=ghost)).replace(**values)
    design = project.design or Design(structure="lens")
    # a changed target keeps its position, so that the list on the page does not jump
    numbers = {each.ghost: number for number, each in enumerate(design.ghost_targets)}
    ghost_targets = list(design.ghost_targets)
    place = slice(numbers.get(ghost, len(ghost_targets)), numbers.get(ghost, len(ghost_targets)) + 1)
    ghost_targets[place] = [] if ghost_target == GhostTarget(ghost=ghost) else [ghost_target]
    return with_targets(project, design, tuple(ghost_targets))


def add_ghost(project: Project, place_mm: float, radius_mm: float) -> Project:
    """Add a target for a new ghost, one that the lens does not have."""
    design = project.design or Design()
    new = GhostTarget(place_mm=round(place_mm, 3), radius_mm=round(max(abs(radius_mm), 0.05), 3))
    # more ghosts need more surfaces than the lens' own structure has
    return with_targets(project, design.replace(structure="any", fixed_rows=()), (*design.ghost_targets, new))


def remove_ghost_target(project: Project, number: int, before: dict[str, Any] | None = None) -> Project:
    """Remove a target.

    Parameters
    ----------
    project : Project
    number : int
    before : dict, optional
        Structure and fixed rows from before the first new ghost was added (`history.design_before_added`); they are
        restored when the last new ghost is removed.
    """
    design = _design_with(project, number)
    left = tuple(ghost_target for k, ghost_target in enumerate(design.ghost_targets) if k != number)
    if before is not None and _any_new(design.ghost_targets) and not _any_new(left):
        design = design.replace(**before)
    return with_targets(project, design, left)


def set_new_ghost_target(project: Project, number: int, values: dict[str, Any]) -> Project:
    """Change a target by its number."""
    design = _design_with(project, number)
    ghost_targets = list(design.ghost_targets)
    ghost_targets[number] = ghost_targets[number].replace(**values)
    return with_targets(project, design, tuple(ghost_targets))


def set_design(project: Project, values: dict[str, Any]) -> Project:
    """Change the settings of the search: structure, signed, surfaces."""
    design = project.design or Design()
    if values.get("own_ghosts") is False and not _any_new(design.ghost_targets):
        raise ProjectError("a search from scratch uses added ghosts only, and there is none yet: add a ghost first")
    if values.get("structure") == "any":
        values = {**values, "fixed_rows": ()}
    return with_targets(project, design.replace(**values), design.ghost_targets)


def with_lights_at(project: Project, place: Callable[[int], int | None]) -> Project:
    """Renumber the lights of targets after the lights of a project have changed.

    Parameters
    ----------
    project : Project
    place : callable
        New number of a light of before; None: it is gone, and so are its targets.
    """
    design = project.design
    if design is None or all(each.light is None for each in design.ghost_targets):
        return project
    ghost_targets = []
    for each in design.ghost_targets:
        light = None if each.light is None else place(each.light)
        if light is not None or each.light is None:
            ghost_targets.append(each.replace(light=light))
    return with_targets(project, design, tuple(ghost_targets))


def clear_ghost_targets(project: Project) -> Project:
    """Remove all targets."""
    return project.replace(design=None)


def ghost_target_names(design: Design) -> tuple[str, ...]:
    """Return the page's name of each target: own ghosts by their rows, new ghosts in the order of creation."""
    names, new = [], 0
    for ghost_target in design.ghost_targets:
        new += ghost_target.ghost is None
        names.append(f"added ghost {new}" if ghost_target.ghost is None else f"ghost {ghost_target.ghost}")
    return tuple(names)


def _design_with(project: Project, number: int) -> Design:
    """Return the design, which must have a target of a number."""
    if project.design is None or not 0 <= number < len(project.design.ghost_targets):
        raise ProjectError(f"there is no target {number}")
    return project.design


def _any_new(ghost_targets: tuple[GhostTarget, ...]) -> bool:
    return any(ghost_target.ghost is None for ghost_target in ghost_targets)


def with_targets(project: Project, design: Design, ghost_targets: tuple[GhostTarget, ...]) -> Project:
    """Give a project a design with other targets; from scratch is switched off where none is a new ghost."""
    if not _any_new(ghost_targets):
        # without new ghosts a search from scratch has no targets
        design = design.replace(own_ghosts=True)
    return project.replace(design=design.replace(ghost_targets=ghost_targets))


def target_project(project: Project) -> Project:
    """Return the project whose picture shows the targets: its ghosts are moved, resized and coloured by overrides.

    Returns
    -------
    Project
        Its overrides come from the targets of the lens' own ghosts (thesis section 5.5); new ghosts are drawn by
        `new_discs`.
    """
    bare = reset_art(project)
    design = project.design
    if design is None:
        return bare
    x, y = direction(project)
    # a search from scratch uses new ghosts only
    rules = [] if design.own_ghosts else [Rule(select="all", enable=False)]
    for ghost_target in design.ghost_targets:
        if ghost_target.ghost is None or ghost_target.action == "ignore":
            continue
        if ghost_target.action == "remove":
            rules.append(Rule(select=ghost_target.ghost, enable=False))
            continue
        move = ghost_target.move_mm
        # a resized ghost keeps its flux
        tint = ghost_target.color or (1.0, 1.0, 1.0)
        if ghost_target.color is not None:
            tint = tuple(part / max(ghost_target.color) for part in ghost_target.color)  # type: ignore[assignment]
        rules.append(
            Rule(
                select=ghost_target.ghost, scale=min(max(ghost_target.height, 0.01), 100.0),
                gain=ghost_target.brightness, tint=tint, offset_mm=(move * x, move * y) if move else None,
            )
        )  # fmt: skip
    return bare.replace(art=bare.art.replace(rules=tuple(rules)), design=None)


def new_discs(project: Project) -> tuple[tuple[float, float, float], ...]:
    """Return centre (mm right and up) and radius of every new ghost."""
    design = project.design
    if design is None:
        return ()
    x, y = direction(project)
    discs = []
    for each in design.ghost_targets:
        if each.ghost is not None or each.radius_mm is None or each.action == "ignore":
            continue
        # ghosts lie on the line to the light, so a point beside it is projected
        along = each.place_mm if each.at_mm is None else each.at_mm[0] * x + each.at_mm[1] * y
        place = (along or 0.0) + each.move_mm
        discs.append((place * x, place * y, abs(each.radius_mm) * each.height))
    return tuple(discs)


def direction(project: Project) -> tuple[float, float]:
    """Return the unit vector from the picture's middle towards the first light: all ghosts lie on this line."""
    x, y = (tan(radians(angle)) for angle in project.lights[0].field_deg)
    if hypot(x, y) == 0.0:
        return 1.0, 0.0
    angle = atan2(y, x)
    return cos(angle), sin(angle)
