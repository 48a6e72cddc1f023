"""What refers to the rows of a lens by their numbers, and follows them when rows are added, removed or moved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...errors import LensError
from ...model import Design, Element, Lens, PerRow, Project, Row, Scatter
from ...model.project.art import Art
from ..common.messages import sentence
from .design_targets import with_targets

# new number of a row; None: it is gone
Place = Callable[[int], int | None]


def renumbered(project: Project, lens: Lens, rows: tuple[Row, ...], place: Place) -> Project:
    """Give a lens new rows, and renumber everything that refers to rows.

    Parameters
    ----------
    project : Project
    lens : Lens
        Its lens, with the rows of before.
    rows : tuple of Row
        The new ones.
    place : callable
        New number of a row of before; None: it is gone.

    Returns
    -------
    Project
        Without overrides of ghosts by rows, and without targets of ghosts that design cannot move any more.

    Raises
    ------
    LensError
        When the result is no lens.
    """
    try:
        presets = {name: _moved(list(c), place, len(rows)) for name, c in lens.coating_presets.items()}
        positions = tuple(
            p.replace(gaps=tuple((new, gap) for row, gap in p.gaps if (new := place(row)) is not None))
            for p in lens.positions
        )
        elements = tuple(e for each in lens.elements if (e := _moved_element(each, place)) is not None)
        changed = lens.replace(
            rows=rows, coating_presets=presets, positions=positions, elements=elements,
            scatter=_moved_scatter(lens.scatter, place),
        )  # fmt: skip
    except ValueError as error:
        raise LensError(sentence(error)) from None
    coating = project.coating
    if isinstance(coating, PerRow):
        coating = PerRow(coatings=_moved(list(coating.coatings), place, len(rows)))
    base: Project = project.replace(
        coating=coating, art=_without_names(project.art), scatter=_moved_scatter(project.scatter, place)
    )
    return _with_moved_targets(base.replace(lens=changed), place, changed.stop_row)


def _moved(entries: list[Any], place: Place, count: int) -> tuple[Any, ...]:
    out: list[Any] = [None] * count
    for k, entry in enumerate(entries):
        new = place(k)
        if new is not None:
            out[new] = entry
    return tuple(out)


def _moved_element(element: Element, place: Place) -> Element | None:
    """Return an element with the rows that are left of it; None if there is none."""
    first, last = element.rows
    left = [new for row in range(first, last + 1) if (new := place(row)) is not None]
    return element.replace(rows=(min(left), max(left))) if left else None


def _moved_scatter(scatter: Scatter | None, place: Place) -> Scatter | None:
    if scatter is None:
        return None
    rows = tuple(each.replace(row=new) for each in scatter.rows if (new := place(each.row)) is not None)
    return scatter.replace(rows=rows)


def _with_moved_targets(project: Project, place: Place, stop: int) -> Project:
    """Renumber the rows of targets and those that a search keeps."""
    design: Design | None = project.design
    if design is None:
        return project
    ghost_targets = []
    for each in design.ghost_targets:
        if each.ghost is None:
            ghost_targets.append(each)
            continue
        j, i = (place(int(row)) for row in each.ghost.split("-"))
        # design places ghosts that reflect twice on one side of the stop
        if j is not None and i is not None and (j < stop) == (i < stop):
            ghost_targets.append(each.replace(ghost=f"{j}-{i}"))
    fixed = tuple(new for row in design.fixed_rows if (new := place(row)) is not None)
    return with_targets(project, design.replace(fixed_rows=fixed), tuple(ghost_targets))


def _without_names(art: Art) -> Art:
    """Remove rules that name rows, as the rows have new numbers."""
    plain = tuple(rule for rule in art.rules if not any(c.isdigit() for c in rule.select.partition(":")[0]))
    return art.replace(rules=tuple(rule for rule in plain if not rule.select.removeprefix("not ").startswith("row:")))
