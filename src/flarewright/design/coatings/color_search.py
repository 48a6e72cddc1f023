"""The built-in solver for coatings.

A table holds, for every setting of one coating, its effect on the logarithms of all ghosts' colours. So coatings are
chosen one after the other, each the best of its whole range, until none improves (coordinate descent); damped
Gauss-Newton finishes every descent. The first half of the descents start at random settings. The others start from a
good end point with some coatings redrawn.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...typing import Floats, Indices
from ..problem.problem import Over, never
from ..solvers.least_squares import bounded_step
from .colors import (
    STEP_NM,
    Coatings,
    ColorProblem,
    color_residuals,
    colors_of,
    log_both,
    log_colors,
    log_reflectances,
    reflectances,
)

# tabulated indices of one free film, and number of random settings of two or three films
INDICES, DRAWN = 14, 8192
# settings of several films whose reflectances, above a floor, differ by less than this part count as one
ALIKE, FLOOR = 0.3, 3e-3
SWEEPS = 30
FINISHING_STEPS = 200
# number of independent descents in a batch; a constant, so that results do not depend on the number of threads
ROUND = 8
# cost below which the target colours count as met
SOLVED_COST = 1e-16
# number of end points kept as starts for later descents
POOL = 8


Ending = tuple[float, Floats]
"""Cost and values at the end of a descent."""
Step = Callable[[Callable[[], list[Ending]], Over], list[Ending]]
"""Called with a batch of descents, and with what returns True after the batch if it was cut short."""


def run_step(make: Callable[[], list[Ending]], _cut: Over) -> list[Ending]:
    """Run a batch of descents without recording it."""
    return make()


@dataclass(frozen=True)
class ColorStep:
    """An improvement: seconds since the start, descents (evaluations) so far, and its values."""

    seconds: float
    work: int
    values: Floats


def solve_colors(
    problem: ColorProblem, *, seed: int = 0, starts: int = 64, threads: int | None = None,
    time_limit: float | None = None, cancelled: Callable[[], bool] | None = None,
    note: Callable[[ColorStep], None] | None = None, step: Step = run_step,
) -> Coatings:  # fmt: skip
    """Choose the coatings of all surfaces.

    Parameters
    ----------
    problem : ColorProblem
    seed : int
    starts : int
        Number of descents, half of them from random settings.
    threads : int, optional
        None: all cores; the result does not depend on it.
    time_limit : float, optional
        Seconds; running descents stop then. None: all descents finish.
    cancelled : callable, optional
        Called in every descent; a stopped descent returns its current setting.
    note : callable, optional
        Called with every setting that is better than those before.
    step : callable, optional
        Runs each batch of descents, or returns its result of an interrupted search.

    Raises
    ------
    ProjectError
        When no ghost has a target colour, or no surface can be coated.
    """
    problem.check()
    started, workers = time.perf_counter(), threads or os.cpu_count() or 1
    tables = [_table(problem, int(k)) for k in problem.rows]

    def over() -> bool:
        late = time_limit is not None and time.perf_counter() - started >= time_limit
        return late or (cancelled is not None and cancelled())

    def one_more(number: int, pool: tuple[Coatings, ...]) -> Coatings:
        return _search(problem, tables, pool, np.random.default_rng([seed, number]), number, over)

    found: list[Coatings] = []
    with ThreadPoolExecutor(min(workers, starts)) as threads_pool:
        for first in range(0, starts, ROUND):
            if found and (found[0].cost <= SOLVED_COST or over()):
                break
            pool = tuple(found[:POOL]) if 2 * first >= starts else ()
            numbers = range(first, min(first + ROUND, starts))

            def batch(pool: tuple[Coatings, ...] = pool, numbers: range = numbers) -> list[Ending]:
                found = threads_pool.map(partial(one_more, pool=pool), numbers)
                # in the order of a recorded array, as sums depend on it
                return [(one.cost, np.ascontiguousarray(one.values)) for one in found]

            ends = [Coatings(cost, values, colors_of(problem, values)) for cost, values in step(batch, over)]
            for number, one in enumerate(ends, first + 1):
                if note is not None and (not found or one.cost < found[0].cost):
                    note(ColorStep(time.perf_counter() - started, number, one.values))
                if all(abs(one.cost - other.cost) > 1e-6 * other.cost for other in found):
                    found = sorted([*found, one], key=_cost)[:POOL]
    return found[0]


def _cost(one: Coatings) -> float:
    return one.cost


@dataclass(frozen=True)
class _Table:
    """Settings of one surface's coating, shape (V, P), and the logarithms of their R and T, shape (2, V, 3).

    `ends` holds the numbers of settings with up to one, two and three films.
    """

    settings: Floats
    logs: Floats
    ends: Indices

    def up_to(self, films: int) -> _Table:
        end = int(self.ends[films - 1])
        return _Table(self.settings[:end], self.logs[:, :end], self.ends[:films])


def _table(problem: ColorProblem, row: int) -> _Table:
    """Tabulate every setting that a descent tries on a surface."""
    settings = _settings(problem)
    R = reflectances(problem.kind, problem.n_d[row], problem.n_d[row + 1], settings)
    if problem.kind == "quarter-wave" or problem.layers == 1:
        return _Table(settings, log_both(R), np.array([len(settings)]))
    films = (settings[:, 1::2] > 0.0).sum(axis=1)
    # many settings of several films look alike: keep one of each kind, unless fewer films already look like it
    sort = np.round(np.log(R + FLOOR) / ALIKE).astype(np.int64)
    first = np.zeros(len(settings), np.bool_)
    first[np.unique(sort, axis=0, return_index=True)[1]] = True
    kept = first | (films == 1)
    ends = np.searchsorted(films[kept], np.arange(1, problem.layers + 1), side="right")
    return _Table(settings[kept], log_both(R[kept]), ends)


def _settings(problem: ColorProblem) -> Floats:
    """Return settings of a coating over its whole range, shape (V, P)."""
    bounds = problem.bounds
    if problem.kind == "quarter-wave":
        shortest, longest = bounds.center_wavelength_nm
        return np.linspace(shortest, longest, round((longest - shortest) / STEP_NM) + 1)[:, None]
    n = np.linspace(*bounds.film_index, INDICES)
    d = np.linspace(*bounds.film_nm, round((bounds.film_nm[1] - bounds.film_nm[0]) / (4.0 * STEP_NM)) + 1)
    single = np.stack(np.meshgrid(n, d, indexing="ij"), axis=-1).reshape(-1, 2)
    # absent films have an index as well, to avoid division by 0
    absent = np.tile([bounds.film_index[0], 0.0], problem.layers)
    many = [np.concatenate([single, np.tile(absent[2:], (len(single), 1))], axis=1)]
    random = np.random.default_rng(0)
    for layers in range(2, problem.layers + 1):
        low, high = (np.tile(part, layers) for part in np.array([bounds.film_index, bounds.film_nm]).T)
        drawn = random.uniform(low, high, (DRAWN, 2 * layers))
        many.append(np.concatenate([drawn, np.tile(absent[2 * layers :], (DRAWN, 1))], axis=1))
    return np.concatenate(many)


def _search(
    problem: ColorProblem, tables: list[_Table], pool: tuple[Coatings, ...], random: np.random.Generator, number: int,
    over: Over,
) -> Coatings:  # fmt: skip
    """Descend from a random setting, or from a good one with some coatings redrawn, and finish."""
    # limit the films in two descents of three: solutions with few films are found more easily without further ones
    tables = [table.up_to(1 + number % len(table.ends)) for table in tables]
    values = np.stack([table.settings[random.integers(len(table.settings))] for table in tables])
    if pool:
        kept = pool[int(random.integers(len(pool)))].values
        drawn = random.choice(len(tables), min(int(random.integers(1, 4)), len(tables)), replace=False)
        fresh = np.isin(np.arange(len(tables)), drawn)[:, None]
        values = np.where(fresh, values, kept)
    return _finish(problem, _descend(problem, tables, values, random, over), over)


def _descend(
    problem: ColorProblem, tables: list[_Table], values: Floats, random: np.random.Generator, over: Over
) -> Floats:
    """Optimise one coating after the other until none improves."""
    reflections, passes = problem.uses()
    values, mirrors = values.copy(), log_reflectances(problem, values)
    logs = log_colors(problem, mirrors)
    best = float((color_residuals(problem, logs[:, None]) ** 2).sum())
    for _ in range(SWEEPS):
        before = best
        for m in random.permutation(len(tables)):
            reflected, passed = reflections[:, m, None, None], passes[:, m, None, None]
            if over():
                return values
            # change relative to the current coating
            change = tables[m].logs - mirrors[:, m, None]
            tried = logs[:, None] + reflected * change[0]
            tried += passed * change[1]
            costs = (color_residuals(problem, tried) ** 2).sum(axis=(0, 2))
            k = int(np.argmin(costs))
            if costs[k] < best:
                best, logs = float(costs[k]), tried[:, k]
                values[m], mirrors[:, m] = tables[m].settings[k], tables[m].logs[:, k]
        if best >= before * (1.0 - 1e-6):
            break
    return values


def _finish(problem: ColorProblem, values: Floats, over: Over = never) -> Coatings:
    """Run least squares from a tabulated setting, inside the bounds; absent films stay absent."""
    free = np.arange(values.size)
    if problem.kind == "film":
        free = np.flatnonzero(np.repeat(values[:, 1::2] > 0.0, 2, axis=1).T)
    low, high = (np.repeat(limit, len(values)) for limit in problem.limits())
    # a bound may be a single value
    free = free[low[free] < high[free]]

    def shaped(x: Floats) -> Floats:
        return x.reshape(-1, len(values)).T

    def residuals(x: Floats) -> Floats:
        return _residuals(problem, shaped(x))[0].ravel()

    x, damping = values.T.ravel(), 1e-3
    old = residuals(x)
    cost = float(old @ old)
    for _ in range(FINISHING_STEPS if free.size else 0):
        if over():
            break
        J = _jacobian(problem, shaped(x))[:, free]
        step = bounded_step(x, old, J, residuals, damping, free=free, low=low, high=high)
        if step is None:
            break
        x, old, damping = step
        before, cost = cost, float(old @ old)
        if before - cost < 1e-5 * before or cost < 1e-24:
            break
    return Coatings(cost, shaped(x), colors_of(problem, shaped(x)))


def _residuals(problem: ColorProblem, values: Floats) -> tuple[Floats, Floats]:
    """Return the residuals and the mirrors' logarithms of a setting."""
    logs = log_reflectances(problem, values)
    return color_residuals(problem, log_colors(problem, logs)[:, None]), logs


def _jacobian(problem: ColorProblem, values: Floats) -> Floats:
    """Return the derivatives of the residuals by all values, one value at a time; each changes one surface's R only."""
    residuals, logs = _residuals(problem, values)
    low, high = problem.limits()
    reflections, passes = problem.uses()
    base, columns = log_colors(problem, logs), []
    for part in range(values.shape[1]):
        step = 1e-4 * (high[part] - low[part])
        if step == 0.0:
            columns.append(np.zeros((len(values), residuals.size)))
            continue
        moved = values.copy()
        moved[:, part] += np.where(values[:, part] + step <= high[part], step, -step)
        change = (log_reflectances(problem, moved) - logs) / (moved - values)[None, :, part, None]
        slopes = reflections.T[:, :, None] * change[0][:, None] + passes.T[:, :, None] * change[1][:, None]
        ahead = color_residuals(problem, base[:, None] + 1e-6 * slopes.transpose(1, 0, 2))
        columns.append(((ahead - residuals) / 1e-6).transpose(1, 0, 2).reshape(len(values), -1))
    return np.concatenate(columns).T
