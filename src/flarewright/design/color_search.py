"""Our solver for coatings.

What one coating does to the logarithms of all ghosts' colours is known for every setting of it at once. So coatings are
chosen one after the other, each the best of its whole range, until none gets better; Gauss-Newton with damping finishes
every such descent. The first half of them begin anywhere, the others from a good end with some coatings drawn anew.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

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
from .problem import Over, never

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# indices of one free film in the tables, and settings of two or three films that are drawn at random
INDICES, DRAWN = 14, 8192
# settings of several films whose reflectances, above a floor, differ by less than this part look the same at first
ALIKE, FLOOR = 0.3, 3e-3
SWEEPS = 30
FINISHING_STEPS = 200
# descents that do not know of each other; not the number of threads, for results must not depend on that
ROUND = 8
# a cost at which the colours are met
ENOUGH = 1e-16
# ends from which others begin
POOL = 8


@dataclass(frozen=True)
class ColorStep:
    """A better setting: seconds since the beginning, descents (evaluations) so far, and its values."""

    seconds: float
    work: int
    values: Floats


def solve_colors(
    problem: ColorProblem, *, seed: int = 0, starts: int = 64, threads: int | None = None,
    time_limit: float | None = None, cancelled: Callable[[], bool] | None = None,
    note: Callable[[ColorStep], None] | None = None,
) -> Coatings:  # fmt: skip
    """Choose the coatings of all surfaces.

    Parameters
    ----------
    problem : ColorProblem
    seed : int
    starts : int
        Descents, half of them from random settings.
    threads : int, optional
        None: all cores; the result does not depend on it.
    time_limit : float, optional
        Seconds, at which descents are cut off; None: all of them are done.
    cancelled : callable, optional
        Asked in every descent; one that is cut off ends with what it has.
    note : callable, optional
        Gets every setting that is better than those before.

    Returns
    -------
    Coatings

    Raises
    ------
    ProjectError
        When no ghost's colour is asked for, or no surface can be coated.
    """
    problem.check()
    begun, workers = time.perf_counter(), threads or os.cpu_count() or 1
    tables = [_table(problem, int(k)) for k in problem.rows]

    def over() -> bool:
        late = time_limit is not None and time.perf_counter() - begun >= time_limit
        return late or (cancelled is not None and cancelled())

    def one_more(number: int, pool: tuple[Coatings, ...]) -> Coatings:
        return _search(problem, tables, pool, np.random.default_rng([seed, number]), number, over)

    found: list[Coatings] = []
    with ThreadPoolExecutor(min(workers, starts)) as threads_pool:
        for first in range(0, starts, ROUND):
            if found and (found[0].cost <= ENOUGH or over()):
                break
            pool = tuple(found[:POOL]) if 2 * first >= starts else ()
            ends = threads_pool.map(partial(one_more, pool=pool), range(first, min(first + ROUND, starts)))
            for number, one in enumerate(ends, first + 1):
                if note is not None and (not found or one.cost < found[0].cost):
                    note(ColorStep(time.perf_counter() - begun, number, one.values))
                if all(abs(one.cost - other.cost) > 1e-6 * other.cost for other in found):
                    found = sorted([*found, one], key=_cost)[:POOL]
    return found[0]


def _cost(one: Coatings) -> float:
    return one.cost


@dataclass(frozen=True)
class _Table:
    """Settings of one surface's coating, shape (V, P), and the logarithms of R and T there, shape (2, V, 3).

    `ends` tells where the settings of one film end, of two and of three.
    """

    settings: Floats
    logs: Floats
    ends: Integers

    def up_to(self, films: int) -> _Table:
        end = int(self.ends[films - 1])
        return _Table(self.settings[:end], self.logs[:, :end], self.ends[:films])


def _table(problem: ColorProblem, row: int) -> _Table:
    """List every setting that a descent tries on a surface."""
    settings = _settings(problem)
    R = reflectances(problem.kind, problem.n_d[row], problem.n_d[row + 1], settings)
    if problem.kind == "quarter-wave" or problem.layers == 1:
        return _Table(settings, log_both(R), np.array([len(settings)]))
    films = (settings[:, 1::2] > 0.0).sum(axis=1)
    # of several films many look the same: one of each sort, and only where fewer films do not look so
    sort = np.round(np.log(R + FLOOR) / ALIKE).astype(np.int64)
    first = np.zeros(len(settings), np.bool_)
    first[np.unique(sort, axis=0, return_index=True)[1]] = True
    kept = first | (films == 1)
    ends = np.searchsorted(films[kept], np.arange(1, problem.layers + 1), side="right")
    return _Table(settings[kept], log_both(R[kept]), ends)


def _settings(problem: ColorProblem) -> Floats:
    """List settings of a coating all over its range, shape (V, P)."""
    bounds = problem.bounds
    if problem.kind == "quarter-wave":
        shortest, longest = bounds.center_wavelength_nm
        return np.linspace(shortest, longest, round((longest - shortest) / STEP_NM) + 1)[:, None]
    n = np.linspace(*bounds.film_index, INDICES)
    d = np.linspace(*bounds.film_nm, round((bounds.film_nm[1] - bounds.film_nm[0]) / (4.0 * STEP_NM)) + 1)
    single = np.stack(np.meshgrid(n, d, indexing="ij"), axis=-1).reshape(-1, 2)
    # what is not there has an index all the same, so that nothing divides by 0
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
    """Descend from a random setting, or from a good one with some coatings drawn anew, and finish."""
    # of three films one in three descents may have all: where fewer do, they are found more easily
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
    """Choose one coating after the other until none gets better."""
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
            # against what is chosen now
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
    """Least squares from a setting of the tables, inside the bounds; films that are not there stay away."""
    low, high = problem.limits()
    away = np.zeros(values.shape, np.bool_)
    if problem.kind == "film":
        away = np.repeat(values[:, 1::2] == 0.0, 2, axis=1)
    values, damping = values.copy(), 1e-3
    cost, residuals, logs = _costs(problem, values)
    for _ in range(FINISHING_STEPS):
        if over():
            break
        J = _jacobian(problem, values, residuals, logs)
        push = (J.T @ residuals.ravel()).reshape(values.shape[1], -1).T
        # at a bound that it would leave a value stays
        held = away | ((values <= low) & (push > 0.0)) | ((values >= high) & (push < 0.0))
        J[:, held.T.ravel()] = 0.0
        normal, push = J.T @ J, J.T @ residuals.ravel()
        better = False
        for _ in range(8):
            scaled = normal + damping * np.diag(np.maximum(np.diag(normal), 1e-12))
            step = -np.linalg.solve(scaled, push).reshape(values.shape[1], -1).T
            tried = np.where(held, values, np.clip(values + step, low, high))
            new, new_residuals, new_logs = _costs(problem, tried)
            if new < cost:
                better = True
                break
            damping *= 5.0
        if not better:
            break
        stop = cost - new < 1e-5 * cost
        values, cost, residuals, logs = tried, new, new_residuals, new_logs
        damping *= 0.2
        if stop or cost < 1e-24:
            break
    return Coatings(cost, values, colors_of(problem, values))


def _costs(problem: ColorProblem, values: Floats) -> tuple[float, Floats, Floats]:
    """Return the cost, the residuals and the mirrors' logarithms of a setting."""
    logs = log_reflectances(problem, values)
    residuals = color_residuals(problem, log_colors(problem, logs)[:, None])
    return float((residuals**2).sum()), residuals, logs


def _jacobian(problem: ColorProblem, values: Floats, residuals: Floats, logs: Floats) -> Floats:
    """Differentiate the residuals by all values, part by part; each touches one surface's R only."""
    low, high = problem.limits()
    reflections, passes = problem.uses()
    base, columns = log_colors(problem, logs), []
    for part in range(values.shape[1]):
        step = 1e-4 * (high[part] - low[part])
        moved = values.copy()
        moved[:, part] += np.where(values[:, part] + step <= high[part], step, -step)
        change = (log_reflectances(problem, moved) - logs) / (moved - values)[None, :, part, None]
        slopes = reflections.T[:, :, None] * change[0][:, None] + passes.T[:, :, None] * change[1][:, None]
        ahead = color_residuals(problem, base[:, None] + 1e-6 * slopes.transpose(1, 0, 2))
        columns.append(((ahead - residuals) / 1e-6).transpose(1, 0, 2).reshape(len(values), -1))
    return np.concatenate(columns).T
