"""Direct changes of a lens without a search (Van Acoleyen 2025, sections 5.3.3 and 5.3.5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...errors import LensError, ProjectError
from ...kernels.design import ghosts as columns
from ...model import Lens, Stop, Surface
from ...optics.lens.paraxial import FirstOrder, first_order
from ...optics.lens.zoom import at_position, positions_without_row
from ...render.scene.resolve import check_opens, complete_lens
from ...sentences import INVALID, validation_sentences
from ...typing import Floats
from ..problem.ghosts import evaluate
from ..problem.opening import opened_to
from ..problem.prescription import Structure, structure_of, vector_of

# number of curvatures tried on either side, and of bisections
TRIED = 4000
HALVINGS = 60
# largest semi-diameter of a surface as a fraction of its radius
STEEPEST = 0.98
# positions of a zoom have one sensor if its distances differ by less than this part of the focal length: patents round
ONE_SENSOR = 5e-3


@dataclass(frozen=True)
class Resized:
    """A lens with one ghost resized, and the effect on all ghosts.

    Attributes
    ----------
    lens : Lens
    row : int
        The mirror whose curvature changed, or the row whose diameter changed.
    ghosts : tuple of (int, int)
    before, after : ndarray, shape (G, 2)
        Place (mm per unit slope of the light) and signed radius (mm).
    """

    lens: Lens
    row: int
    ghosts: tuple[tuple[int, int], ...]
    before: Floats
    after: Floats


def resize_ghost(
    lens: Lens,
    ghost: tuple[int, int],
    height: float,
    *,
    mirror: Literal["first", "second"] = "first",
    f_number: float | None = None,
) -> Resized:
    """Resize one ghost by the radius of one of its two mirrors.

    Parameters
    ----------
    lens : Lens
        Complete.
    ghost : (int, int)
        Rows j, then i < j.
    height : float
        Factor on its radius.
    mirror : {"first", "second"}
        Row whose curvature changes, j or i.
    f_number : float, optional
        None: wide open. The stop's diameter and the sensor's distance are constant.

    Returns
    -------
    Resized
        With the solution of nearest curvature. The focal length that the source states is left out; those of zoom
        positions change as the traced ones do.

    Raises
    ------
    ProjectError
        When the lens has no such ghost, does not open to the f-number, no curvature of that row gives this size, or
        the sensor of a zoom has another distance in each position.
    LensError
        When the lens forms no image any more, or a lens file cannot hold its f-number.
    """
    structure, order, vector, entrance = _numbers_of(lens, f_number)
    _check_one_sensor(lens, order)
    if ghost not in structure.pairs:
        raise ProjectError(
            f"{lens.name} has no ghost {ghost[0]}-{ghost[1]} that reflects twice on one side of the stop; "
            "flarewright ghosts LENS --paths same-side lists them"
        )
    row = ghost[0] if mirror == "first" else ghost[1]
    surface = lens.rows[row]
    assert isinstance(surface, Surface)
    g, at = structure.pairs.index(ghost), 1 + structure.rows + row
    before = _ghosts(structure, vector, entrance)
    curvature = _curvature(structure, vector, entrance, (g, at), height * abs(before[g, 1]), surface)
    if curvature is None:
        raise ProjectError(
            f"no curvature of row {row} makes ghost {ghost[0]}-{ghost[1]} {height:g} times as large; "
            "change the other mirror, or choose another size"
        )
    vector[at] = curvature
    rows = list(lens.rows)
    rows[row] = surface.replace(curvature=curvature)
    bent = lens.replace(rows=tuple(rows), sensor_distance=order.sensor_distance, stated_focal_length=None)
    # the same stop diameter gives another f-number when the lens in front of the stop changes
    bent = complete_lens(_with_positions(lens, opened_to(bent, float(vector[0]))))
    return Resized(bent, row, structure.pairs, before, _ghosts(structure, vector, entrance))


def _check_one_sensor(lens: Lens, order: FirstOrder) -> None:
    """Raise an error for a zoom whose last surface moves: a lens file has one distance of the sensor."""
    for position in lens.positions:
        distance = first_order(at_position(lens, position)).sensor_distance
        if abs(distance - order.sensor_distance) > ONE_SENSOR * order.efl:
            raise ProjectError(
                f"the sensor of {lens.name} stands {distance:.4g} mm behind its last surface at {position.name!r}, and "
                f"{order.sensor_distance:.4g} mm by the gaps of its rows, but a resized lens keeps one distance; "
                "remove its [[positions]]"
            )


def _with_positions(before: Lens, after: Lens) -> Lens:
    """Return a changed lens whose positions have the focal lengths of its rows, and f-numbers of its stop.

    Raises
    ------
    LensError
        When it forms no image at a position, or a lens file cannot hold the f-number.
    """
    if not before.positions:
        return after
    share = first_order(after).stop_semi_diameter / first_order(before).stop_semi_diameter
    ratios: dict[float, float] = {}
    # positions of one focal length are settings of the focus, and keep that of the one without a distance
    for position in sorted(before.positions, key=lambda each: each.focus_distance is not None):
        if position.focal_length is None or position.focal_length in ratios:
            continue
        ratio = first_order(at_position(after, position)).efl / first_order(at_position(before, position)).efl
        if ratio <= 0.0:
            raise LensError(f"{after.name} forms no image at {position.name!r} any more; change less")
        ratios[position.focal_length] = ratio
    positions = []
    for position in before.positions:
        changes = {}
        if position.focal_length is not None:
            changes["focal_length"] = position.focal_length * ratios[position.focal_length]
        if position.f_number is not None:
            diameter = 2.0 * share * first_order(at_position(before, position)).stop_semi_diameter
            changes["f_number"] = opened_to(at_position(after, position), diameter).f_number
        positions.append(position.replace(**changes))
    found: Lens = after.replace(positions=tuple(positions))
    return found


def _numbers_of(lens: Lens, f_number: float | None) -> tuple[Structure, FirstOrder, Floats, float]:
    """Return structure, first-order numbers, vector and diameter of the entrance of a lens."""
    check_opens(lens, f_number)
    structure, order = structure_of(lens), first_order(lens, f_number)
    entrance = 2.0 * (getattr(lens.rows[0], "semi_diameter", None) or order.entrance_pupil_diameter)
    return structure, order, vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance), entrance


def _ghosts(structure: Structure, vector: Floats, entrance: float) -> Floats:
    """Return place and radius of each ghost, shape (G, 2)."""
    return np.asarray(evaluate(structure, vector[None], entrance)[0][:, [columns.PLACE, columns.RADIUS]])


def _curvature(
    structure: Structure, vector: Floats, entrance: float, where: tuple[int, int], wanted: float, surface: Surface
) -> float | None:
    """Return the curvature, `where[1]` of the vector, that gives ghost `where[0]` a radius; None if there is none."""
    g, at = where
    assert surface.semi_diameter is not None

    def misses(curvatures: Floats) -> Floats:
        many = np.repeat(vector[None], len(curvatures), axis=0)
        many[:, at] = curvatures
        radii = np.abs(evaluate(structure, many, entrance)[:, g, columns.RADIUS])
        return np.asarray(radii - wanted, dtype=np.float64)

    return _nearest_root(misses, surface.curvature, STEEPEST / surface.semi_diameter)


def resize_all(
    lens: Lens, height: float, *, by: Literal["stop", "entrance"] = "stop", f_number: float | None = None
) -> Resized:
    """Resize all ghosts bounded by one opening, the stop or the entrance.

    Parameters
    ----------
    lens : Lens
        Complete.
    height : float
        Factor on the diameter of the stop or of the first surface.
    by : {"stop", "entrance"}
    f_number : float, optional
        None: wide open.

    Returns
    -------
    Resized
        Ghosts bounded by the other opening keep their size, or become bounded by this one.

    Raises
    ------
    ProjectError
        When the stop is the first row, the lens does not open to the f-number, or the first surface would be wider
        than its sphere.
    LensError
        When a lens file cannot hold the f-number.

    Notes
    -----
    Van Acoleyen 2025, section 5.3.1.
    """
    structure, _, vector, entrance = _numbers_of(lens, f_number)
    front = lens.rows[0]
    if by == "entrance" and not isinstance(front, Surface):
        raise ProjectError(
            f"the stop is the first row of {lens.name}, so nothing else bounds the entrance; resize by stop"
        )
    before = _ghosts(structure, vector, entrance)
    if by == "stop":
        row, vector[0] = lens.stop_row, height * vector[0]
        changed = opened_to(lens, float(vector[0]))
    else:
        assert isinstance(front, Surface)
        row, entrance = 0, height * entrance
        if abs(front.curvature) * 0.5 * entrance > STEEPEST:
            raise ProjectError(
                f"row 0 of {lens.name} is a sphere of radius {1.0 / abs(front.curvature):.4g} mm, and {height:g} times "
                "its opening is wider than that; use a smaller size"
            )
        changed = lens.replace(rows=(front.replace(semi_diameter=0.5 * entrance), *lens.rows[1:]))
        if f_number is not None:
            changed = changed.replace(f_number=f_number)
    resized = complete_lens(_with_positions(lens, changed))
    return Resized(resized, row, structure.pairs, before, _ghosts(structure, vector, entrance))


def _nearest_root(function: Callable[[Floats], Floats], start: float, largest: float) -> float | None:
    """Return the root nearest to a start within +-largest."""
    # fine steps near the old curvature, coarse ones far from it
    steps = np.concatenate([[0.0], np.geomspace(1e-9, 2.0 * largest, TRIED)])
    best: float | None = None
    for way in (1.0, -1.0):
        tried = start + way * steps
        tried = tried[np.abs(tried) <= largest]
        if len(tried) < 2:
            continue
        values = function(tried)
        changes = np.flatnonzero(values[:-1] * values[1:] <= 0.0)
        if changes.size == 0:
            continue
        low, high = float(tried[changes[0]]), float(tried[changes[0] + 1])
        side = float(values[changes[0]])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if float(function(np.array([middle]))[0]) * side > 0.0:
                low = middle
            else:
                high = middle
        found = 0.5 * (low + high)
        # a pole changes sign as well, but is no root
        if abs(float(function(np.array([found]))[0])) > 1e-3 * max(abs(side), 1e-9) + 1e-6:
            continue
        if best is None or abs(found - start) < abs(best - start):
            best = found
    return best


def move_stop(lens: Lens, row: int) -> Lens:
    """Make another row the stop: it becomes a plane in air, and the old stop is removed.

    Parameters
    ----------
    lens : Lens
        Complete.
    row : int
        In the present lens; air must be in front of it. The gap behind it becomes air.

    Returns
    -------
    Lens
        Its stop has the same diameter as before.

    Raises
    ------
    ProjectError
        When the row is the stop already, does not exist, or has glass in front of it.
    LensError
        When the lens forms no image any more, or a lens file cannot hold its f-number.
    """
    old = lens.stop_row
    if row == old:
        raise ProjectError(f"row {row} is the stop already: choose another row")
    if not 0 <= row < len(lens.rows):
        raise ProjectError(f"row {row} cannot become the stop: choose a surface between 0 and {len(lens.rows) - 1}")
    front = lens.rows[row - 1] if row else None
    if isinstance(front, Surface) and front.medium is not None:
        free = [
            str(k) for k, one in enumerate(lens.rows)
            if k != old and (k == 0 or getattr(lens.rows[k - 1], "medium", None) is None) and isinstance(one, Surface)
        ]  # fmt: skip
        raise ProjectError(f"row {row} cannot become the stop: glass is in front of it; rows {', '.join(free)} can")
    diameter = 2.0 * first_order(lens).stop_semi_diameter
    rows = list(lens.rows)
    rows[row] = Stop(thickness=rows[row].thickness)
    gone = rows.pop(old)
    if 0 < old < len(rows):
        rows[old - 1] = rows[old - 1].replace(thickness=rows[old - 1].thickness + gone.thickness)
    presets = {name: tuple(c for k, c in enumerate(all_) if k != old) for name, all_ in lens.coating_presets.items()}
    distance = lens.sensor_distance
    if distance is not None and old == len(lens.rows) - 1:
        # it was measured from the stop
        distance += lens.rows[old - 1].thickness
    if not any(isinstance(one, Surface) and one.medium is not None for one in rows):
        raise LensError(f"with its stop at row {row}, {lens.name} has no glass: choose another row")
    try:
        moved = lens.replace(
            rows=tuple(rows), coating_presets=presets, elements=(), f_number=1.0, sensor_distance=distance,
            positions=positions_without_row(lens, old),
        )  # fmt: skip
    except INVALID as error:
        raise LensError(f"the stop of {lens.name} cannot move to row {row}: {validation_sentences(error)[0]}") from None
    return complete_lens(opened_to(moved, diameter))
