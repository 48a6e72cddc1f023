"""The best distinct lenses of a search, polished, as prescriptions that render."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import FlarewrightError
from ...io.lens.glass_catalogue import nearest
from ...io.lens.media import complete_medium as complete_media
from ...model import Iris, Lens, Medium, Stop, Surface
from ...render.scene.resolve import complete_lens
from ...typing import Floats
from ..problem.objective import fitness, fitness_thesis, misfits
from ..problem.opening import opened_to
from ..problem.prescription import Structure
from ..problem.problem import SOLVED, LensCandidate, Over, Problem, never
from ..problem.rims import clear_radii
from ..solvers.polish import finer, finest, merge_pools
from ..solvers.pool_search import KEPT, PoolState
from .constraints import Breach, breaches, keeps_limits, stiff
from .glass_rounding import held_indices, with_catalogue_glasses
from .null_space import lenses_with_same_ghosts, to_the_middle
from .traced_polish import finish, traced_misfits

# lenses whose variables differ by less than this on average count as one: log lengths, curvatures (1/mm), indices
APART = (0.15, 0.004, 0.05)
POLISHING_STEPS = 200
# number of minima that may break hard constraints before the rest of the pool is skipped
MOST_FAILURES = 40
# number of ghosts to trace when choosing the lenses to finish
TRACED = 2000


@dataclass(frozen=True)
class Outcome:
    """A lens that a search found.

    Attributes
    ----------
    lens : Lens
        Complete: it renders.
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    cost : float
        What the search minimised.
    fitness : float
        Mean squared misfit in mm^2, best matching.
    fitness_algorithm1 : float
        As in the thesis: ghosts and targets sorted by size.
    residuals : ndarray, shape (N, 2)
        Place and size of each target's ghost minus the target's, mm.
    ghosts : tuple of (int, int)
        Mirrors of each target's ghost.
    glasses : dict of int to str
        Catalogue name of the glass behind each row, where the problem asks for glasses.
    fitness_any_index : float or None
        Fitness before the indices were replaced by those of glasses.
    fitness_traced : (float, float) or None
        Misfit of traced ghosts (`traced_polish.TracedMisfits.cost`) before and after finishing; `residuals` are traced
        then.
    breaks : tuple of Breach
        Hard constraints that it breaks; only from `nearest_outcomes`.
    lost : tuple of str
        Targets whose ghosts too few traced rays reach; only where lenses are finished with traced rays.
    """

    lens: Lens
    structure: Structure
    vector: Floats
    cost: float
    fitness: float
    fitness_algorithm1: float
    residuals: Floats
    ghosts: tuple[tuple[int, int], ...]
    glasses: dict[int, str] = field(default_factory=dict)
    fitness_any_index: float | None = None
    fitness_traced: tuple[float, float] | None = None
    breaks: tuple[Breach, ...] = ()
    lost: tuple[str, ...] = ()


def lens_of(
    structure: Structure, vector: Floats, radii: Floats, *, name: str, iris: Iris | None = None,
    media: Mapping[int, Medium | None] | None = None, kept: Mapping[int, Surface] | None = None,
) -> Lens:  # fmt: skip
    """Convert a prescription's vector to a lens.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    radii : ndarray, shape (K,)
        Semi-diameters, mm (`rims.clear_radii`).
    name : str
    iris : Iris, optional
    media : mapping of int to Medium or None, optional
        Media behind some rows, where known.
    kept : mapping of int to Surface, optional
        Rows whose shape and coating stay, and whose rim stays inside their own where they are no spheres.

    Returns
    -------
    Lens
        With the dispersion of the nearest catalogue glass where no medium is given; its f-number gives the stop the
        vector's diameter.

    Raises
    ------
    FlarewrightError
        When the lens forms no image.
    """
    rows: list[Surface | Stop] = []
    count = structure.rows
    for k in range(count):
        # the last gap is the distance to the sensor
        thickness = float(vector[1 + k])
        if k == structure.stop:
            rows.append(Stop(thickness=thickness))
            continue
        n_d = float(vector[1 + 2 * count + k])
        if media is not None and k in media:
            medium = media[k]
        else:
            medium = Medium(n_d=n_d, v_d=round(nearest(n_d)[0].v_d, 2)) if structure.glass[k] else None
        own, semi_diameter = (kept or {}).get(k), float(radii[k])
        if own is not None and own.semi_diameter is not None and (own.conic or own.terms):
            # beyond their rim terms may turn the surface back
            semi_diameter = min(semi_diameter, own.semi_diameter)
        rows.append(
            (own or Surface()).replace(
                curvature=float(vector[1 + count + k]), thickness=thickness, medium=medium,
                semi_diameter=semi_diameter, semi_diameter_estimated=False,
            )
        )  # fmt: skip
    rough = Lens(
        name=name, source="designed by Flarewright for its ghosts", f_number=1.0,
        sensor_distance=float(vector[count]), iris=iris or Iris(), rows=tuple(rows),
    )  # fmt: skip
    known, _ = complete_media(rough)
    return complete_lens(opened_to(known, float(vector[0])))


def outcomes(
    state: PoolState,
    problem: Problem,
    *,
    count: int = 5,
    name: str = "Designed lens",
    iris: Iris | None = None,
    over: Over = never,
) -> tuple[Outcome, ...]:
    """Return the best distinct lenses of a search.

    Parameters
    ----------
    state : PoolState
    problem : Problem
    count : int
    name : str
    iris : Iris, optional
    over : callable
        Whether the time is up. Then the function returns at least one lens and skips further improvement.

    Returns
    -------
    tuple of Outcome
        Best first; distinct lenses, without those that form no image.
    """
    problem = finer(problem)
    pool = list(state.ended)
    for run in state.runs:
        pool = list(merge_pools(pool, run.members, KEPT))
    pool.sort(key=lambda one: one.cost)
    # where the targets are met, lenses with the same ghosts come before those that only come close
    pool[:1] = lenses_with_same_ghosts(problem, pool[0], seed=state.seed, over=over) if count > 1 and pool else pool[:1]
    if problem.traced:
        pool = _by_tracing(pool, problem, over)
    # the best lens with free indices need not be the best with glasses
    enough = count if problem.glasses is None else 2 * count
    chosen: list[LensCandidate] = []
    found: list[Outcome] = []
    failures = 0
    for one in pool:
        if len(found) == enough or failures > MOST_FAILURES or (found and over()):
            break
        if any(_same(one, other) for other in chosen):
            continue
        fine = to_the_middle(problem, finest(problem, one, POLISHING_STEPS), over)
        if any(_same(fine, other) for other in chosen):
            continue
        outcome = _outcome(fine, problem, name, iris, over)
        if outcome is not None:
            chosen.append(fine)
            found.append(outcome)
        else:
            failures += 1
    # lenses that meet their targets keep their order
    found.sort(key=lambda one: max(one.cost, SOLVED) if one.fitness_traced is None else one.fitness_traced[1])
    return tuple(
        replace(one, lens=one.lens.replace(name=f"{name} {number}")) for number, one in enumerate(found[:count], 1)
    )


def _by_tracing(pool: list[LensCandidate], problem: Problem, over: Over) -> list[LensCandidate]:
    """Sort lenses by the misfit of their traced ghosts: lenses equal to first order differ much when traced."""
    aim = problem.objective
    judged: list[tuple[float, int]] = []

    def cost(one: LensCandidate) -> float:
        vector = problem.variables(one.structure).prescription(one.x)
        residuals, _, ghosts = misfits(aim, one.structure, vector)
        return np.inf if residuals is None else traced_misfits(problem, one.structure, vector, ghosts).cost

    for number, one in enumerate(pool[: int(np.clip(TRACED / len(aim.targets), 16, 200))]):
        if over():
            break
        judged.append((cost(one), number))
    return [*(pool[number] for _, number in sorted(judged)), *pool[len(judged) :]]


def nearest_outcomes(
    state: PoolState, problem: Problem, *, count: int = 5, name: str = "Designed lens", iris: Iris | None = None,
    over: Over = never,
) -> tuple[Outcome, ...]:  # fmt: skip
    """Return the best lenses of a search in which no lens keeps the hard constraints.

    Parameters
    ----------
    state, problem, count, name, iris, over
        As in `outcomes`.

    Returns
    -------
    tuple of Outcome
        With the constraints that each `breaks`; the constraint against crossing surfaces is kept where possible.
    """
    for hard in (tuple(one for one in problem.bounds.hard if one == "edges"), ()):
        loose = replace(problem, bounds=problem.bounds.replace(hard=hard))
        found = outcomes(state, loose, count=count, name=name, iris=iris, over=over)
        if found:
            break
    return tuple(replace(one, breaks=breaches(problem, one.structure, one.vector)) for one in found)


def _same(one: LensCandidate, other: LensCandidate) -> bool:
    if one.structure != other.structure:
        return False
    rows = one.structure.rows
    return float(np.mean(np.abs(one.x - other.x) / np.repeat(APART, [1 + rows, rows, rows]))) < 1.0


def _outcome(one: LensCandidate, problem: Problem, name: str, iris: Iris | None, over: Over) -> Outcome | None:
    aim, known = problem.objective, problem.variables(one.structure)
    fixed = {row: problem.own_rows[row] for row in problem.fixed_rows}
    kept = {row: surface for row, surface in fixed.items() if isinstance(surface, Surface)}
    media: dict[int, Medium | None] = {row: surface.medium for row, surface in kept.items()}
    names: dict[int, str] = {}
    any_index = None
    inside = keeps_limits(problem, one)
    if inside is not None and problem.glasses is not None:
        any_index = fitness(aim, one.structure, known.prescription(inside.x))
        near, numbers = with_catalogue_glasses(stiff(problem), inside, over)
        known = known.with_indices(held_indices(problem, numbers))
        inside = keeps_limits(problem, near, known)
        media = {**{row: problem.glasses.medium(number) for row, number in numbers.items()}, **media}
        names = {row: medium.glass for row, medium in sorted(media.items()) if medium is not None and medium.glass}
    if inside is None:
        return None
    vector = known.prescription(inside.x)
    residuals, _, ghosts = misfits(aim, one.structure, vector)
    if residuals is None:
        return None
    traced, lost = None, tuple[str, ...]()
    if problem.traced:
        done = finish(problem, one.structure, known, inside.x, ghosts, over)
        vector, residuals = known.prescription(done.x), done.after.off
        traced = done.before.cost, done.after.cost
        lost = tuple(name for name, gone in zip(aim.names, done.after.lost, strict=True) if gone)
    try:
        radii = clear_radii(one.structure, vector, aim.slopes, aim.entrance, edge=problem.bounds.edge)
        lens = lens_of(one.structure, vector, radii, name=name, iris=iris, media=media, kept=kept)
    except FlarewrightError:
        return None
    return Outcome(
        lens, one.structure, vector, inside.cost, fitness(aim, one.structure, vector),
        fitness_thesis(aim, one.structure, vector), residuals, ghosts, names, any_index,
        traced, lost=lost,
    )  # fmt: skip
