"""Annotations: what a person wants of single ghosts, as the wishes of a project's design."""

from __future__ import annotations

from math import atan2, cos, hypot, radians, sin, tan
from typing import Any

from ..errors import ProjectError
from ..model import Design, GhostWish, Project, Rule
from .edit_ghosts import reset_art


def wish_of(project: Project, ghost: str) -> GhostWish | None:
    """Return the wish for one of the lens' own ghosts."""
    design = project.design
    return None if design is None else next((wish for wish in design.wishes if wish.ghost == ghost), None)


def set_wish(project: Project, ghost: str, values: dict[str, Any]) -> Project:
    """Change what is wanted of a ghost.

    Parameters
    ----------
    project : Project
    ghost : str
        "j-i", both on one side of the stop.
    values : dict
        Fields of `GhostWish`.

    Returns
    -------
    Project
    """
    j, i = (int(part) for part in ghost.split("-"))
    from ..render.prepare import as_lens

    stop = as_lens(project.lens).stop_row
    if (j < stop) != (i < stop):
        raise ProjectError(
            f"ghost {ghost} crosses the stop between its mirrors; design places ghosts that reflect twice on one side "
            f"of the stop (row {stop})"
        )
    wish = (wish_of(project, ghost) or GhostWish(ghost=ghost)).replace(**values)
    design = project.design or Design(structure="lens")
    # one that is changed keeps its place, so that the list on the page stands still
    numbers = {each.ghost: number for number, each in enumerate(design.wishes)}
    wishes = list(design.wishes)
    place = slice(numbers.get(ghost, len(wishes)), numbers.get(ghost, len(wishes)) + 1)
    wishes[place] = [] if wish == GhostWish(ghost=ghost) else [wish]
    return _with(project, design, tuple(wishes))


def add_ghost(project: Project, place_mm: float, radius_mm: float) -> Project:
    """Wish for a ghost that the lens has not."""
    design = project.design or Design()
    new = GhostWish(place_mm=round(place_mm, 3), radius_mm=round(max(abs(radius_mm), 0.05), 3))
    # more ghosts need more surfaces, which the lens' own structure has not
    return _with(project, design.replace(structure="any", fixed_rows=()), (*design.wishes, new))


def remove_wish(project: Project, number: int, before: dict[str, Any] | None = None) -> Project:
    """Take a wish back.

    Parameters
    ----------
    project : Project
    number : int
    before : dict, optional
        Structure and fixed rows as they were before the first new ghost was added (`history.design_before_added`): with
        the last one goes what it needed.

    Returns
    -------
    Project
    """
    design = project.design
    if design is None or not 0 <= number < len(design.wishes):
        raise ProjectError(f"there is no wish {number}")
    left = tuple(wish for k, wish in enumerate(design.wishes) if k != number)
    if before is not None and _any_new(design.wishes) and not _any_new(left):
        design = design.replace(**before)
    return _with(project, design, left)


def set_new_wish(project: Project, number: int, values: dict[str, Any]) -> Project:
    """Change a wish by its number."""
    design = project.design
    if design is None or not 0 <= number < len(design.wishes):
        raise ProjectError(f"there is no wish {number}")
    wishes = list(design.wishes)
    wishes[number] = wishes[number].replace(**values)
    return _with(project, design, tuple(wishes))


def set_design(project: Project, values: dict[str, Any]) -> Project:
    """Change how lenses are looked for: structure, signed, surfaces."""
    design = project.design or Design()
    if values.get("own_ghosts") is False and not _any_new(design.wishes):
        raise ProjectError(
            "from scratch only the ghosts that were added count, and there is none yet: add a ghost first"
        )
    if values.get("structure") == "any":
        values = {**values, "fixed_rows": ()}
    return _with(project, design.replace(**values), design.wishes)


def clear_wishes(project: Project) -> Project:
    """Take all wishes back."""
    changed: Project = project.replace(design=None)
    return changed


def wish_names(design: Design) -> tuple[str, ...]:
    """Return what a person calls the ghost of each wish: the lens' own by its rows, new ones in the order they came."""
    names, new = [], 0
    for wish in design.wishes:
        new += wish.ghost is None
        names.append(f"added ghost {new}" if wish.ghost is None else f"ghost {wish.ghost}")
    return tuple(names)


def _any_new(wishes: tuple[GhostWish, ...]) -> bool:
    return any(wish.ghost is None for wish in wishes)


def _with(project: Project, design: Design, wishes: tuple[GhostWish, ...]) -> Project:
    if not _any_new(wishes):
        # without the last ghost that was added there is nothing to begin from scratch for
        design = design.replace(own_ghosts=True)
    changed: Project = project.replace(design=design.replace(wishes=wishes))
    return changed


def target_project(project: Project) -> Project:
    """Return the fictional project whose picture is the target: each ghost moved, resized and coloured by hand.

    Parameters
    ----------
    project : Project

    Returns
    -------
    Project
        Its art is made of the wishes for the lens' own ghosts (thesis section 5.5); new ghosts are drawn by
        `new_discs`.
    """
    bare = reset_art(project)
    design = project.design
    if design is None:
        return bare
    x, y = direction(project)
    # from scratch only those count that are new
    rules = [] if design.own_ghosts else [Rule(select="all", enable=False)]
    for wish in design.wishes:
        if wish.ghost is None or wish.action == "ignore":
            continue
        if wish.action == "remove":
            rules.append(Rule(select=wish.ghost, enable=False))
            continue
        move = wish.move_mm
        # a larger ghost spreads its light, a smaller one gathers it: its flux stays
        tint = wish.color or (1.0, 1.0, 1.0)
        if wish.color is not None:
            tint = tuple(part / max(wish.color) for part in wish.color)  # type: ignore[assignment]
        rules.append(
            Rule(
                select=wish.ghost, scale=min(max(wish.height, 0.01), 100.0), gain=wish.brightness, tint=tint,
                offset_mm=(move * x, move * y) if move else None,
            )
        )  # fmt: skip
    changed: Project = bare.replace(art=bare.art.replace(rules=tuple(rules)), design=None)
    return changed


def new_discs(project: Project) -> tuple[tuple[float, float, float], ...]:
    """Return centre (mm right and up) and radius of every ghost that is wished for and that the lens has not."""
    design = project.design
    if design is None:
        return ()
    x, y = direction(project)
    return tuple(
        (wish.place_mm * x, wish.place_mm * y, abs(wish.radius_mm))
        for wish in design.wishes
        if wish.ghost is None and wish.place_mm is not None and wish.radius_mm is not None
    )


def direction(project: Project) -> tuple[float, float]:
    """Return the unit vector from the picture's middle towards the first light: ghosts lie on this line."""
    x, y = (tan(radians(angle)) for angle in project.lights[0].field_deg)
    if hypot(x, y) == 0.0:
        return 1.0, 0.0
    angle = atan2(y, x)
    return cos(angle), sin(angle)
