"""Changes of the rows of a prescription: added, copied and removed rows, and the place of the stop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import LensError
from ...model import Lens, Position, Project, Row, Stop, Surface
from ...optics.lens.surface_shape import sag
from ...optics.lens.zoom import gaps_without_row, positions_without_row
from ...sentences import INVALID
from ..common.messages import sentence
from .lens import own_lens
from .row_numbers import renumbered

MOST_ROWS = 200


def _row(lens: Lens, row: int) -> Row:
    """Return a row by its number; raises LensError if there is none."""
    if not 0 <= row < len(lens.rows):
        raise LensError(f"there is no row {row}; they count from 0 to {len(lens.rows) - 1}")
    return lens.rows[row]


def add_row(project: Project, row: int) -> Project:
    """Insert a plane surface in air behind a row, at 1 mm distance where there is room."""
    lens = own_lens(project)
    if len(lens.rows) >= MOST_ROWS:
        raise LensError(f"a lens has at most {MOST_ROWS} rows here")
    old = _row(lens, row)
    gap = 0.5 * old.thickness if row + 1 < len(lens.rows) else 1.0
    medium = old.medium if isinstance(old, Surface) else None
    semi = old.semi_diameter if isinstance(old, Surface) else None
    front = old.replace(thickness=old.thickness - gap) if row + 1 < len(lens.rows) else old.replace(thickness=gap)
    new = Surface(thickness=gap, medium=medium, semi_diameter=semi)
    if row + 1 == len(lens.rows):
        lens, project = _with_sensor_farther(lens, project, -gap)
    added = renumbered(project, lens, (*lens.rows[:row], front, new, *lens.rows[row + 1 :]), _behind(row + 1))
    return _with_halved_gap(added, row)


def _with_halved_gap(project: Project, row: int) -> Project:
    """Give both halves of a divided gap half of it at every position that moves it."""
    lens = project.lens
    assert isinstance(lens, Lens), "rows are added to a lens of the project"
    halved = []
    for position in lens.positions:
        gaps = dict(position.gaps)
        if row in gaps:
            gaps |= {row: 0.5 * gaps[row], row + 1: 0.5 * gaps[row]}
        halved.append(_with_gaps(position, gaps))
    return _with_positions(project, tuple(halved))


def duplicate_row(project: Project, row: int) -> Project:
    """Insert a copy of a row behind it; a copy of the last row stands 1 mm behind it."""
    lens = own_lens(project)
    old = _row(lens, row)
    if not isinstance(old, Surface):
        raise LensError(f"row {row} is the stop, and a lens has one")
    front = old
    if row + 1 == len(lens.rows):
        # what is written behind the last row is the distance of the sensor, not that of another surface
        front = old.replace(thickness=1.0)
        lens, project = _with_sensor_farther(lens, project, -1.0)
    rows = (*lens.rows[:row], front, *lens.rows[row:])
    return renumbered(project, lens, rows, _behind(row + 1))


def _with_sensor_farther(lens: Lens, project: Project, by: float) -> tuple[Lens, Project]:
    """Return a lens and its project with stated distances of the sensor from another last vertex."""
    camera = project.camera
    try:
        if lens.sensor_distance is not None:
            lens = lens.replace(sensor_distance=lens.sensor_distance + by)
        if camera.sensor_distance is not None:
            project = project.replace(camera=camera.replace(sensor_distance=camera.sensor_distance + by))
    except INVALID as error:
        raise LensError(f"the sensor would stand in the lens: {sentence(error)}") from None
    return lens, project


def remove_row(project: Project, row: int) -> Project:
    """Remove a row; the gap in front of it absorbs its thickness, and the glass in front extends to the next row."""
    lens = own_lens(project)
    gone = _row(lens, row)
    if isinstance(gone, Stop):
        raise LensError(f"row {row} is the stop, which every lens has; make another row the stop first")
    rows = list(lens.rows)
    if row > 0:
        rows[row - 1] = rows[row - 1].replace(thickness=rows[row - 1].thickness + gone.thickness)
    del rows[row]
    last = rows[-1]
    if row == len(rows) and isinstance(last, Surface):
        rows[-1] = last.replace(medium=None)
    positions = positions_without_row(lens, row)
    still = lens.replace(positions=())
    if row == len(rows) and row > 0:
        # the sensor stays, and the last vertex is farther from it
        still, project = _with_sensor_farther(still, project, lens.rows[row - 1].thickness)
    shorter = renumbered(project, still, tuple(rows), lambda k: None if k == row else k - (k > row))
    return _with_positions(shorter if positions else shorter.replace(zoom=None), positions)


def move_stop(project: Project, row: int) -> Project:
    """Move the stop into the air in front of a row, or behind it where glass is in front; surfaces stay.

    Parameters
    ----------
    project : Project
    row : int
        A surface.

    Returns
    -------
    Project
        Sharpness, brightness and focus are unchanged; the ghosts are bounded elsewhere.

    Raises
    ------
    LensError
        When glass is on both sides, the stop is there already, or a zoom position has no room for it.

    Notes
    -----
    `design.finishing.lens_edits.move_stop` replaces a surface by the stop (Van Acoleyen 2025, section 5.3.3), which
    few lenses tolerate.
    """
    lens = own_lens(project)
    old, rows = lens.stop_row, lens.rows
    if not 0 <= row < len(rows) or row == old:
        raise LensError(f"row {row} is no surface; choose one between 0 and {len(rows) - 1} to put the stop next to")
    gaps = [k for k in (row, row + 1) if k < len(rows) and (k == 0 or getattr(rows[k - 1], "medium", None) is None)]
    free = [k for k in gaps if k not in (old, old + 1)]
    if not free:
        why = "the stop is there already" if gaps else "there is glass on both sides of it"
        raise LensError(f"the stop cannot go next to row {row}: {why}; choose a row beside another gap of air")
    # first remove it, so that its two gaps become one, then insert it in front of one of the remaining rows
    target = free[0] - (free[0] > old)
    left = list(rows)
    stop = left.pop(old)
    if old > 0:
        left[old - 1] = left[old - 1].replace(thickness=left[old - 1].thickness + stop.thickness)
    still = lens.replace(positions=())
    if old == len(left):
        # the sensor stays, and the last vertex is farther from it
        still, project = _with_sensor_farther(still, project, rows[old - 1].thickness)
    behind = _room_behind_stop(left, target)
    if target:
        left[target - 1] = left[target - 1].replace(thickness=left[target - 1].thickness - behind)
    left.insert(target, stop.replace(thickness=behind))

    def place(k: int) -> int:
        reduced = k - (k > old)
        return target if k == old else reduced + (reduced >= target)

    positions = tuple(_with_stop_at(position, lens, target, behind) for position in lens.positions)
    moved = renumbered(project, still, tuple(left), place)
    return _with_positions(moved, positions)


def _with_positions(project: Project, positions: tuple[Position, ...]) -> Project:
    """Give the project's own lens other positions; raises LensError if its rows do not fit them."""
    if not positions:
        return project
    assert isinstance(project.lens, Lens), "rows are changed of a lens of the project"
    try:
        return project.replace(lens=project.lens.replace(positions=positions))
    except ValueError as error:
        raise LensError(sentence(error)) from None


def _with_gaps(position: Position, gaps: dict[int, float]) -> Position:
    return position.replace(gaps=tuple(sorted(gaps.items())))


def _room_behind_stop(rows: list[Row], target: int) -> float:
    """Return the distance from the stop to the row behind it: the middle of the space between the rims."""
    front, back = rows[target - 1] if target else None, rows[target]
    semis = [each.semi_diameter for each in (front, back) if isinstance(each, Surface) and each.semi_diameter]
    rim = np.array([min(semis, default=0.0)])
    with np.errstate(invalid="ignore"):
        bulge, hollow = (
            0.0 if each is None else float(np.nan_to_num(sag(each, np.zeros(1), rim)[0])) for each in (front, back)
        )
    if front is None:
        return 1.0 + max(0.0, -hollow)
    near, far = max(0.0, bulge), front.thickness + min(0.0, hollow)
    return front.thickness - (0.5 * (near + far) if far > near else 0.5 * front.thickness)


def _with_stop_at(position: Position, lens: Lens, target: int, behind: float) -> Position:
    """Return the gaps of a zoom position for another place of the stop; the stop moves with the row behind it."""
    gaps = gaps_without_row(lens, position, lens.stop_row)
    if target - 1 in gaps:
        gaps[target - 1] -= behind
        if gaps[target - 1] < 0.0:
            raise LensError(
                f"the stop cannot go there: in zoom position {position.name!r} that gap is {-gaps[target - 1]:.2f} mm "
                "too narrow; choose a row beside another gap of air"
            )
    return _with_gaps(position, {k + (k >= target): gap for k, gap in gaps.items()})


def _behind(first: int) -> Callable[[int], int]:
    return lambda k: k + (k >= first)
