"""Direct changes of a lens that need no search (Van Acoleyen 2025, sections 5.3.3 and 5.3.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import LensError, ProjectError
from ..kernels import design_ghosts as columns
from ..model import Lens, Stop, Surface
from ..optics.paraxial import first_order
from ..render.prepare import complete_lens
from .ghosts import evaluate
from .opening import opened_to
from .prescription import structure_of, vector_of

Floats = NDArray[np.float64]

# curvatures that are tried on either side, and how often an interval is halved
TRIED = 4000
HALVINGS = 60
# part of a surface's radius that its rim may reach
STEEPEST = 0.98


@dataclass(frozen=True)
class Resized:
    """A lens with one ghost resized, and what became of all of them.

    Attributes
    ----------
    lens : Lens
    row : int
        The mirror that was bent, or the row that was opened.
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
        Multiplies its radius.
    mirror : {"first", "second"}
        Which row is bent, j or i.
    f_number : float, optional
        None: wide open. The stop's diameter and the sensor's distance stay.

    Returns
    -------
    Resized
        With the curvature nearest to the old one that does it.

    Raises
    ------
    ProjectError
        When the lens has no such ghost, or no curvature of that row makes it so large.
    LensError
        When the lens makes no image any more, or would have an f-number that no lens file can hold.
    """
    structure = structure_of(lens)
    if ghost not in structure.pairs:
        raise ProjectError(
            f"{lens.name} has no ghost {ghost[0]}-{ghost[1]} that reflects twice on one side of the stop; "
            "flarewright ghosts LENS --paths same-side lists them"
        )
    order = first_order(lens, f_number)
    vector = vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance)
    row = ghost[0] if mirror == "first" else ghost[1]
    surface = lens.rows[row]
    assert isinstance(surface, Surface)
    assert surface.semi_diameter is not None
    entrance = 2.0 * (getattr(lens.rows[0], "semi_diameter", None) or order.entrance_pupil_diameter)
    g, at = structure.pairs.index(ghost), 1 + structure.rows + row

    def radii(curvatures: Floats) -> Floats:
        many = np.repeat(vector[None], len(curvatures), axis=0)
        many[:, at] = curvatures
        return np.asarray(np.abs(evaluate(structure, many, entrance)[:, g, columns.RADIUS]), dtype=np.float64)

    before = evaluate(structure, vector[None], entrance)[0]
    wanted = height * abs(before[g, columns.RADIUS])
    curvature = _nearest_root(lambda c: radii(c) - wanted, surface.curvature, STEEPEST / surface.semi_diameter)
    if curvature is None:
        raise ProjectError(
            f"no curvature of row {row} makes ghost {ghost[0]}-{ghost[1]} {height:g} times as large; "
            "take the other mirror, or another size"
        )
    vector[at] = curvature
    after = evaluate(structure, vector[None], entrance)[0]
    rows = list(lens.rows)
    rows[row] = surface.replace(curvature=curvature)
    bent = lens.replace(rows=tuple(rows), sensor_distance=order.sensor_distance)
    # the same opening of the stop gives another f-number when the lens in front of it has changed
    bent = complete_lens(opened_to(bent, float(vector[0])))
    kept = [columns.PLACE, columns.RADIUS]
    return Resized(bent, row, structure.pairs, before[:, kept], after[:, kept])


def resize_all(
    lens: Lens, height: float, *, by: Literal["stop", "entrance"] = "stop", f_number: float | None = None
) -> Resized:
    """Resize all ghosts that one opening bounds: those of the stop, or those of the entrance.

    Parameters
    ----------
    lens : Lens
        Complete.
    height : float
        Multiplies the stop's diameter, or that of the first surface.
    by : {"stop", "entrance"}
    f_number : float, optional
        None: wide open.

    Returns
    -------
    Resized
        Ghosts that the other opening bounds stay as they are, or are bounded by this one now.

    Raises
    ------
    ProjectError
        When the stop is the first row, or the first surface would be wider than it is a sphere.
    LensError
        When no lens file can hold the f-number.

    Notes
    -----
    Van Acoleyen 2025, section 5.3.1.
    """
    structure, order = structure_of(lens), first_order(lens, f_number)
    vector = vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance)
    front = lens.rows[0]
    if by == "entrance" and not isinstance(front, Surface):
        raise ProjectError(
            f"the stop is the first row of {lens.name}, so nothing else bounds what enters; resize by stop"
        )
    entrance = 2.0 * (getattr(front, "semi_diameter", None) or order.entrance_pupil_diameter)
    before = evaluate(structure, vector[None], entrance)[0]
    if by == "stop":
        row, vector[0] = lens.stop_row, height * vector[0]
        changed = opened_to(lens, float(vector[0]))
    else:
        assert isinstance(front, Surface)
        row, entrance = 0, height * entrance
        if abs(front.curvature) * 0.5 * entrance > STEEPEST:
            raise ProjectError(
                f"row 0 of {lens.name} is a sphere of radius {1.0 / abs(front.curvature):.4g} mm, and {height:g} times "
                "its opening is wider than that; take less"
            )
        changed = lens.replace(rows=(front.replace(semi_diameter=0.5 * entrance), *lens.rows[1:]))
        if f_number is not None:
            changed = changed.replace(f_number=f_number)
    after = evaluate(structure, vector[None], entrance)[0]
    kept = [columns.PLACE, columns.RADIUS]
    return Resized(complete_lens(changed), row, structure.pairs, before[:, kept], after[:, kept])


def _nearest_root(function: object, start: float, largest: float) -> float | None:
    """Find the sign change nearest to a start within +-largest."""
    assert callable(function)
    # fine steps near the old curvature, coarse ones far off
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
        # a pole changes sign as well, and is no root
        if abs(float(function(np.array([found]))[0])) > 1e-3 * max(abs(side), 1e-9) + 1e-6:
            continue
        if best is None or abs(found - start) < abs(best - start):
            best = found
    return best


def move_stop(lens: Lens, row: int) -> Lens:
    """Make another row the stop: it becomes a plane in air, and the old stop is taken out.

    Parameters
    ----------
    lens : Lens
        Complete.
    row : int
        Counted as the lens stands; air must be in front of it. What was behind it becomes air.

    Returns
    -------
    Lens
        Its stop has the diameter that it had.

    Raises
    ------
    ProjectError
        When the row is the stop, there is no such row, or glass is in front of it.
    LensError
        When the lens makes no image any more, or would have an f-number that no lens file can hold.
    """
    old = lens.stop_row
    if row == old:
        raise ProjectError(f"row {row} cannot become the stop, for it is the stop already: choose another row")
    if not 0 <= row < len(lens.rows):
        raise ProjectError(f"row {row} cannot become the stop: choose a surface between 0 and {len(lens.rows) - 1}")
    front = lens.rows[row - 1] if row else None
    if isinstance(front, Surface) and front.medium is not None:
        free = [
            str(k) for k, one in enumerate(lens.rows)
            if k != old and (k == 0 or getattr(lens.rows[k - 1], "medium", None) is None) and isinstance(one, Surface)
        ]  # fmt: skip
        raise ProjectError(f"row {row} cannot become the stop, glass is in front of it; rows {', '.join(free)} can")
    diameter = 2.0 * first_order(lens).stop_semi_diameter
    rows = list(lens.rows)
    rows[row] = Stop(thickness=rows[row].thickness)
    gone = rows.pop(old)
    if 0 < old < len(rows):
        rows[old - 1] = rows[old - 1].replace(thickness=rows[old - 1].thickness + gone.thickness)
    presets = {name: tuple(c for k, c in enumerate(all_) if k != old) for name, all_ in lens.coating_presets.items()}
    try:
        moved = lens.replace(rows=tuple(rows), coating_presets=presets, elements=(), f_number=1.0)
    except ValueError as error:
        raise LensError(f"with its stop at row {row} {lens.name} is no lens any more: no glass is left") from error
    return complete_lens(opened_to(moved, diameter))
