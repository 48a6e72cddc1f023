"""Zoom and focus positions: which gaps a lens has at a focal length or a focus distance."""

from __future__ import annotations

from itertools import pairwise
from math import inf
from typing import Any

from ..errors import ProjectError
from ..model import Lens, Position
from .paraxial import first_order

# focal lengths are met to this part
CLOSE = 1e-9
STEPS = 200


def at_position(lens: Lens, position: Position) -> Lens:
    """Return the lens as it stands at one of its positions.

    Parameters
    ----------
    lens : Lens
    position : Position

    Returns
    -------
    Lens
        Without positions, the gaps in its rows.
    """
    rows = list(lens.rows)
    for row, gap in position.gaps:
        rows[row] = rows[row].replace(thickness=gap)
    changes: dict[str, Any] = {"rows": tuple(rows), "positions": ()}
    for name in ("f_number", "field_deg", "focus_distance"):
        if getattr(position, name) is not None:
            changes[name] = getattr(position, name)
    changes["stated_focal_length"] = position.focal_length
    found: Lens = lens.replace(**changes)
    return found


def zoomed(lens: Lens, zoom: str | float | None) -> Lens:
    """Set the zoom.

    Parameters
    ----------
    lens : Lens
    zoom : str or float or None
        A position's name, or a focal length in mm; None: the gaps as its rows have them.

    Returns
    -------
    Lens

    Raises
    ------
    ProjectError
        When the lens has no such position.

    Notes
    -----
    Between two neighbouring positions every gap changes in proportion, and so far that the paraxial focal length is the
    one asked for. A real zoom's cams run along curves; the ends of each stretch are the patent's.
    """
    if zoom is None:
        return lens
    if not lens.positions:
        raise ProjectError(
            f"{lens.name} has no positions to zoom to; take out the zoom, or give its file [[positions]]"
        )
    names = ", ".join(repr(position.name) for position in lens.positions)
    number = _number(zoom)
    if number is None:
        for position in lens.positions:
            if position.name.lower() == str(zoom).strip().lower():
                return at_position(lens, position)
        raise ProjectError(f"{lens.name} has no position {zoom!r}; it has: {names}, or give a focal length in mm")
    if any(position.focus_distance is not None for position in lens.positions):
        raise ProjectError(f"the positions of {lens.name} are for focus; choose one by its name ({names}) or by focus")
    efl = {position.name: first_order(at_position(lens, position)).efl for position in lens.positions}
    ordered = sorted(lens.positions, key=lambda position: efl[position.name])
    low, high = efl[ordered[0].name], efl[ordered[-1].name]
    if not low * (1.0 - 5e-3) <= number <= high * (1.0 + 5e-3):
        raise ProjectError(f"{lens.name} zooms from {low:.2f} to {high:.2f} mm, not to {number:g} mm")
    number = min(max(number, low), high)
    for one, other in pairwise(ordered):
        if efl[one.name] <= number <= efl[other.name]:
            return at_position(lens, _between(lens, one, other, number))
    return at_position(lens, ordered[0])


def _number(zoom: str | float) -> float | None:
    if isinstance(zoom, str):
        try:
            return float(zoom.strip().lower().removesuffix("mm"))
        except ValueError:
            return None
    return float(zoom)


def _between(lens: Lens, one: Position, other: Position, focal_length: float) -> Position:
    """Bisect for the part of the way from one position to another that has a focal length."""
    low, high = 0.0, 1.0
    part = 0.0
    for _ in range(STEPS):
        part = 0.5 * (low + high)
        efl = first_order(at_position(lens, mixed(one, other, part))).efl
        if abs(efl / focal_length - 1.0) < CLOSE:
            break
        low, high = (part, high) if efl < focal_length else (low, part)
    found: Position = mixed(one, other, part).replace(focal_length=focal_length)
    return found


def mixed(one: Position, other: Position, part: float) -> Position:
    """Return the position that lies a part of the way from one to another."""
    there = dict(other.gaps)
    gaps = tuple((row, gap + part * (there[row] - gap)) for row, gap in one.gaps)

    def between(name: str) -> float | None:
        a, b = getattr(one, name), getattr(other, name)
        return None if a is None or b is None else float(a + part * (b - a))

    return Position(
        name=f"between {one.name} and {other.name}",
        gaps=gaps,
        f_number=between("f_number"),
        field_deg=between("field_deg"),
    )


def focused(lens: Lens, distance: float | None) -> Lens:
    """Set the focus of a lens whose positions are for focus; any other is returned as it is.

    Parameters
    ----------
    lens : Lens
    distance : float or None
        Of the plane in focus, mm in front of the first vertex; None: as the rows stand.

    Returns
    -------
    Lens

    Raises
    ------
    ProjectError
        When the lens does not focus that near.

    Notes
    -----
    Between neighbouring positions gaps change in proportion to 1 / distance, as a helicoid's path does to first order.
    """
    if distance is None or not any(position.focus_distance is not None for position in lens.positions):
        return lens

    def nearness(position: Position) -> float:
        return 1.0 / (inf if position.focus_distance is None else position.focus_distance)

    ordered = sorted(lens.positions, key=nearness)
    near = 1.0 / distance
    if near > nearness(ordered[-1]) * (1.0 + 1e-9) or near < nearness(ordered[0]) * (1.0 - 1e-9):
        raise ProjectError(
            f"{lens.name} has focus positions down to {1.0 / nearness(ordered[-1]):g} mm, not for {distance:g} mm"
        )
    for one, other in pairwise(ordered):
        if nearness(one) <= near <= nearness(other) * (1.0 + 1e-9):
            part = (near - nearness(one)) / (nearness(other) - nearness(one))
            found: Lens = at_position(lens, mixed(one, other, part)).replace(focus_distance=distance)
            return found
    return at_position(lens, ordered[-1])
