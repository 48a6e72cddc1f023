"""Zoom and focus positions: the gaps of a lens at a focal length or a focus distance."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from ...errors import LensError, ProjectError
from ...model import Lens, Position
from .paraxial import first_order

# relative tolerance of focal lengths
CLOSE = 1e-9
STEPS = 200
# a focal length this far beyond the range counts as its end: makers round engraved values
SLACK = 5e-3


def at_position(lens: Lens, position: Position) -> Lens:
    """Return the lens at one of its positions.

    Returns
    -------
    Lens
        Without positions; its rows have the position's gaps.
    """
    rows = list(lens.rows)
    for row, gap in position.gaps:
        rows[row] = rows[row].replace(thickness=gap)
    changes: dict[str, Any] = {"rows": tuple(rows), "positions": ()}
    for name in ("f_number", "field_deg"):
        if getattr(position, name) is not None:
            changes[name] = getattr(position, name)
    if _for_focus(lens):
        # a position without a distance then means infinity, whatever the focus of the rows
        changes["focus_distance"] = position.focus_distance
    changes["stated_focal_length"] = position.focal_length
    return lens.replace(**changes)


def gaps_without_row(lens: Lens, position: Position, row: int) -> dict[int, float]:
    """Return the gaps that a position moves, by row, after one row is removed.

    Parameters
    ----------
    lens : Lens
    position : Position
        Of this lens.
    row : int
        The gaps in front of it and behind it become one; in front of row 0 there is none.

    Returns
    -------
    dict of int to float
        Keys in the new numbers. A gap in front of the last row would change the place of the sensor: it stays, behind
        the last row, where no lens may have it.
    """
    at = dict(position.gaps)
    gaps = {k - (k > row): gap for k, gap in at.items() if k not in (row - 1, row)}
    if row > 0 and at.keys() & {row - 1, row}:
        gaps[row - 1] = sum(at.get(k, lens.rows[k].thickness) for k in (row - 1, row))
    return gaps


def positions_without_row(lens: Lens, row: int) -> tuple[Position, ...]:
    """Return the positions of a lens after one of its rows is removed (`gaps_without_row`).

    Positions that move no gap any more are left out.
    """
    moved = ((position, gaps_without_row(lens, position, row)) for position in lens.positions)
    return tuple(position.replace(gaps=tuple(sorted(gaps.items()))) for position, gaps in moved if gaps)


def named_position(lens: Lens, zoom: str | float | None) -> Position | None:
    """Return the position of a lens that a zoom setting names; None for a focal length between positions."""
    wanted = str(zoom).strip().lower()
    return next((position for position in lens.positions if position.name.lower() == wanted), None)


def positioned(lens: Lens, zoom: str | float | None, distance: float | None) -> Lens:
    """Return a lens at a zoom and a focus setting.

    Parameters
    ----------
    lens : Lens
    zoom : str or float or None
        Name of a position, or a focal length in mm; None: the gaps of the rows.
    distance : float or None
        Distance of the plane in focus in front of the first vertex, mm; None: infinity, or that of the named position.
        It changes gaps only for lenses with focus positions.

    Returns
    -------
    Lens
        The same lens when both are None.

    Raises
    ------
    ProjectError
        When the lens has no such position, or cannot focus there.

    Notes
    -----
    Positions of one focal length are one zoom setting. Within it gaps are linear in 1 / distance, as the travel of a
    helicoid is to first order. Between two settings every gap is interpolated linearly; the fraction is that at which
    the paraxial focal length, at the farthest focus of the lens' positions, is the wanted one. The same fraction then
    applies at the wanted distance. The cams of a real zoom follow curves; only the ends of each interval are the
    patent's.
    """
    if zoom is None and (distance is None or not _for_focus(lens)):
        return lens
    if not lens.positions:
        raise ProjectError(f"{lens.name} has no positions to zoom to; remove the zoom, or give its file [[positions]]")
    # a name such as "66.7 mm" is the position itself, not a focal length to interpolate
    named = None if zoom is None else named_position(lens, zoom)
    number = None if zoom is None or named is not None else _number(zoom)
    if zoom is None:
        settings = _settings(lens)
        if len(settings) > 1:
            raise ProjectError(f"{lens.name} has focus positions for several focal lengths; give the zoom too")
        return at_position(lens, _focused(lens, settings[0], distance))
    if number is not None:
        return at_position(lens, _between(lens, number, distance))
    if named is not None:
        if distance is None:
            return at_position(lens, named)
        mine = next(setting for setting in _settings(lens) if named in setting)
        return at_position(lens, _focused(lens, mine, distance))
    raise ProjectError(f"{lens.name} has no position {zoom!r}; it has: {_names(lens)}, or give a focal length in mm")


def _for_focus(lens: Lens) -> bool:
    return any(position.focus_distance is not None for position in lens.positions)


def _names(lens: Lens) -> str:
    return ", ".join(repr(position.name) for position in lens.positions)


def _number(zoom: str | float) -> float | None:
    if isinstance(zoom, str):
        try:
            return float(zoom.strip().lower().removesuffix("mm"))
        except ValueError:
            return None
    return float(zoom)


def _nearness(position: Position) -> float:
    return 0.0 if position.focus_distance is None else 1.0 / position.focus_distance


def _settings(lens: Lens) -> list[list[Position]]:
    """Group positions by stated focal length, each group from far to near."""
    groups: dict[float | None, list[Position]] = {}
    for position in lens.positions:
        groups.setdefault(position.focal_length if _for_focus(lens) else len(groups), []).append(position)
    return [sorted(group, key=_nearness) for group in groups.values()]


def _focused(lens: Lens, setting: Sequence[Position], distance: float | None) -> Position:
    """Return the position of one zoom setting at a focus distance."""
    if not _for_focus(lens):
        return setting[0]
    near = 0.0 if distance is None else 1.0 / distance
    farthest, nearest = setting[0], setting[-1]
    if not _nearness(farthest) * (1.0 - 1e-9) <= near <= _nearness(nearest) * (1.0 + 1e-9):
        limits = [f"{1.0 / n:g} mm" if (n := _nearness(end)) else "infinity" for end in (farthest, nearest)]
        wanted_distance = "infinity" if distance is None else f"{distance:g} mm"
        raise ProjectError(
            f"{lens.name} has focus positions from {limits[0]} to {limits[1]}, not for {wanted_distance}"
        )
    for one, other in pairwise(setting):
        if near <= _nearness(other) * (1.0 + 1e-9):
            part = (near - _nearness(one)) / (_nearness(other) - _nearness(one))
            return _interpolated_position(lens, one, other, part).replace(focus_distance=distance)
    return setting[0]


def _between(lens: Lens, focal_length: float, distance: float | None) -> Position:
    """Return the position of a focal length, interpolated between two zoom settings."""
    settings = _settings(lens)
    if _for_focus(lens) and any(setting[0].focal_length is None for setting in settings):
        raise ProjectError(
            f"the positions of {lens.name} are for focus and have no focal lengths; choose one by its name "
            f"({_names(lens)}) or by focus"
        )
    found = sorted(((first_order(at_position(lens, each[0])).efl, k) for k, each in enumerate(settings)))
    low, high = found[0][0], found[-1][0]
    if not low * (1.0 - SLACK) <= focal_length <= high * (1.0 + SLACK):
        raise ProjectError(f"{lens.name} zooms from {low:.2f} to {high:.2f} mm, not to {focal_length:g} mm")
    number = min(max(focal_length, low), high)
    for (below, a), (above, b) in pairwise(found):
        if number <= above:
            part = _part(lens, settings[a][0], settings[b][0], (below, above), number)
            one, other = _focused(lens, settings[a], distance), _focused(lens, settings[b], distance)
            return _interpolated_position(lens, one, other, part).replace(focal_length=number)
    return _focused(lens, settings[0], distance)


def _part(lens: Lens, one: Position, other: Position, ends: tuple[float, float], focal_length: float) -> float:
    """Return the fraction between two positions, of known focal lengths, that has a focal length: Illinois method."""

    def error(part: float) -> float:
        try:
            efl = first_order(at_position(lens, _interpolated_position(lens, one, other, part))).efl
        except LensError:
            raise ProjectError(
                f"{lens.name} forms no image on the straight path between its positions {one.name!r} and "
                f"{other.name!r}; choose one of them by its name"
            ) from None
        return efl / focal_length - 1.0

    low, high = 0.0, 1.0
    below, above = (efl / focal_length - 1.0 for efl in ends)
    for end, found in ((low, below), (high, above)):
        if abs(found) < CLOSE:
            return end
    part, side = low, 0
    for _ in range(STEPS):
        part = low - below * (high - low) / (above - below)
        found = error(part)
        if abs(found) < CLOSE:
            break
        # an end that stays twice counts half: otherwise it would stay for ever
        if found < 0.0:
            low, below, above = part, found, 0.5 * above if side < 0 else above
            side = -1
        else:
            high, above, below = part, found, 0.5 * below if side > 0 else below
            side = 1
    return part


def _interpolated_position(lens: Lens, one: Position, other: Position, part: float) -> Position:
    """Return the position at a fraction between two, 0 and 1, with the focus distance of the first."""
    there = dict(other.gaps)
    gaps = tuple((row, gap + part * (there[row] - gap)) for row, gap in one.gaps)

    def between(name: str) -> float | None:
        a, b = (getattr(lens if getattr(p, name) is None else p, name) for p in (one, other))
        return None if a is None or b is None else float(a + part * (b - a))

    return Position(
        name=f"between {one.name} and {other.name}",
        gaps=gaps,
        focus_distance=one.focus_distance,
        f_number=between("f_number"),
        field_deg=between("field_deg"),
    )
