"""Coatings for the colours that ghosts shall have (Van Acoleyen 2025, sections 5.3.6, 5.4 and 5.6.4).

Light meets every surface head on, at three wavelengths. A ghost's colour is R_j R_i times the transmittances along its
path, so its logarithm is a sum over the surfaces: what one coating does to all ghosts is known for every thickness at
once. Coatings are therefore chosen one after the other, each the best of its whole range, until none gets better; the
best of many such descents is finished by Gauss-Newton with damping.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..model import Coating, Film, Lens, Project, QuarterWave, Surface
from ..model.design import Bounds, Design
from ..optics.coatings import MAGNESIUM_FLUORIDE, film_stack, stack_reflectance
from ..optics.color import oklab
from ..optics.pack import resolve_coatings
from ..render.prepare import settle
from .prescription import Structure, structure_of

Floats = NDArray[np.float64]
Kind = Literal["quarter-wave", "film"]

# red, green and blue of the thesis' program
WAVELENGTHS_NM = (650.0, 510.0, 475.0)
# steps of the tables, and indices in one of free films
STEP_NM = 2.0
INDICES = 14
SWEEPS = 30
# descents that least squares finish
FINISHED, FINISHING_STEPS = 8, 200


@dataclass(frozen=True)
class ColorProblem:
    """Ghost colours to be met by coatings.

    Attributes
    ----------
    structure : Structure
    n_d : ndarray, shape (K + 1,)
        Indices, before row 0 and behind every row.
    targets : ndarray, shape (G, 3)
        R, G, B of each ghost, relative to the light.
    weights : ndarray, shape (G,)
    hue_only : ndarray, shape (G,), bool
        Whether only the ratio of the three counts.
    kind : {"quarter-wave", "film"}
    bounds : Bounds
    perceptual : bool
        Differences are judged in Oklab instead of by parts of red, green and blue.
    """

    structure: Structure
    n_d: Floats
    targets: Floats
    weights: Floats
    hue_only: NDArray[np.bool_]
    kind: Kind
    bounds: Bounds
    perceptual: bool = False


@dataclass(frozen=True)
class Coatings:
    """What a search for coatings found.

    Attributes
    ----------
    cost : float
    values : ndarray, shape (M, 1) or (M, 2)
        Centre wavelength in nm, or index and thickness in nm, of each mirror in order.
    colors : ndarray, shape (G, 3)
    """

    cost: float
    values: Floats
    colors: Floats


def mirrors_of(structure: Structure) -> NDArray[np.int64]:
    """Return the rows that carry coatings."""
    return np.flatnonzero(structure.mirrors)


def uses(structure: Structure) -> tuple[Floats, Floats]:
    """Count how often each ghost is reflected by each mirror and passes it.

    Parameters
    ----------
    structure : Structure

    Returns
    -------
    reflections, passes : ndarray, shape (G, M)
    """
    rows = mirrors_of(structure)
    j, i = (np.array(side)[:, None] for side in zip(*structure.pairs, strict=True))
    reflections = ((rows == j) | (rows == i)).astype(np.float64)
    # what lies between the mirrors is passed three times, they themselves once
    passes = np.where((rows > i) & (rows < j), 3.0, 1.0)
    return reflections, passes


def reflectances(kind: Kind, n_front: float, n_back: float, values: Floats) -> Floats:
    """Reflectance of one surface for many settings of its coating, at the three wavelengths.

    Parameters
    ----------
    kind : {"quarter-wave", "film"}
    n_front, n_back : float
    values : ndarray, shape (V, 1) or (V, 2)
        Centre wavelengths, or indices and thicknesses.

    Returns
    -------
    ndarray, shape (V, 3)

    Notes
    -----
    A film without dispersion answers to thickness over wavelength alone, so many thicknesses are asked for as many
    wavelengths of one film.
    """
    waves = np.array(WAVELENGTHS_NM)
    out = np.empty((len(values), 3))
    if kind == "quarter-wave":
        index = max(float(np.sqrt(n_front * n_back)), MAGNESIUM_FLUORIDE)
        unit = 1000.0 / (4.0 * index)
        scaled = waves[None, :] * 1000.0 / values[:, :1]
        return np.asarray(stack_reflectance(n_front, n_back, (index,), (unit,), scaled, 1.0), dtype=np.float64)
    for index in np.unique(values[:, 0]):
        which = values[:, 0] == index
        scaled = waves[None, :] * 100.0 / values[which, 1:2]
        out[which] = stack_reflectance(n_front, n_back, (float(index),), (100.0,), scaled, 1.0)
    return out


def colors_of(problem: ColorProblem, values: Floats) -> Floats:
    """Return the colour of every ghost for one setting of the coatings.

    Parameters
    ----------
    problem : ColorProblem
    values : ndarray, shape (M, 1) or (M, 2)

    Returns
    -------
    ndarray, shape (G, 3)
    """
    return np.exp(_log_colors(problem, _logs(problem, values)))


def own_colors(lens: Lens, structure: Structure) -> Floats:
    """Return the colours of a lens' ghosts with the coatings it has, any kind of them.

    Parameters
    ----------
    lens : Lens
    structure : Structure

    Returns
    -------
    ndarray, shape (G, 3)
    """
    n_d = indices_of(lens)
    waves = np.array(WAVELENGTHS_NM)
    table = []
    for k in mirrors_of(structure):
        row = lens.rows[k]
        assert isinstance(row, Surface)
        films = film_stack(row.coating, float(n_d[k]), float(n_d[k + 1]))
        table.append(stack_reflectance(float(n_d[k]), float(n_d[k + 1]), *films, waves, 1.0))
    R = np.maximum(np.array(table), 1e-12)
    reflections, passes = uses(structure)
    return np.asarray(np.exp(reflections @ np.log(R) + passes @ np.log1p(-R)), dtype=np.float64)


def indices_of(lens: Lens) -> Floats:
    """Return n_d before row 0 and behind every row, shape (K + 1,)."""
    behind = [1.0 if not isinstance(row, Surface) or row.medium is None else row.medium.n_d for row in lens.rows]
    return np.array([1.0, *behind])


def solve_colors(problem: ColorProblem, *, seed: int = 0, starts: int = 64, threads: int | None = None) -> Coatings:
    """Choose the coatings of all surfaces.

    Parameters
    ----------
    problem : ColorProblem
    seed : int
    starts : int
        Descents from random settings; the best is finished.
    threads : int, optional
        None: all cores; the result does not depend on it.

    Returns
    -------
    Coatings

    Raises
    ------
    ProjectError
        When no ghost's colour is asked for.
    """
    if not problem.weights.any():
        raise ProjectError("no ghost's colour counts; give one a weight above 0")
    grid = _grid(problem)
    rows = mirrors_of(problem.structure)
    tables = np.empty((len(rows), 2, len(grid), 3))
    for m, k in enumerate(rows):
        R = np.clip(reflectances(problem.kind, problem.n_d[k], problem.n_d[k + 1], grid), 1e-12, 1.0 - 1e-12)
        tables[m] = np.log(R), np.log1p(-R)
    with ThreadPoolExecutor(min(threads or os.cpu_count() or 1, starts)) as pool:
        found = list(pool.map(partial(_descend, problem, grid, tables, seed), range(starts)))
        found.sort(key=lambda one: one[0])
        finished = list(pool.map(partial(_finish, problem), [values for _, values in found[:FINISHED]]))
    return min(finished, key=lambda one: one.cost)


def _grid(problem: ColorProblem) -> Floats:
    """List every setting that a descent tries."""
    bounds = problem.bounds
    if problem.kind == "quarter-wave":
        low, high = bounds.center_wavelength_nm
        return np.linspace(low, high, round((high - low) / STEP_NM) + 1)[:, None]
    n = np.linspace(*bounds.film_index, INDICES)
    d = np.linspace(*bounds.film_nm, round((bounds.film_nm[1] - bounds.film_nm[0]) / (4.0 * STEP_NM)) + 1)
    return np.stack(np.meshgrid(n, d, indexing="ij"), axis=-1).reshape(-1, 2)


def _descend(problem: ColorProblem, grid: Floats, tables: Floats, seed: int, start: int) -> tuple[float, Floats]:
    """Choose one coating after the other until none gets better."""
    random = np.random.default_rng([seed, start])
    reflections, passes = uses(problem.structure)
    count = len(tables)
    chosen = random.integers(len(grid), size=count)
    picked = tables[np.arange(count), :, chosen]
    logs = reflections @ picked[:, 0] + passes @ picked[:, 1]
    best = np.inf
    for _ in range(SWEEPS):
        before = best
        for m in random.permutation(count):
            reflected, passed = reflections[:, m, None, None], passes[:, m, None, None]
            # against what is chosen now
            tried = logs[:, None] + reflected * (tables[m, 0] - tables[m, 0, chosen[m]])
            tried += passed * (tables[m, 1] - tables[m, 1, chosen[m]])
            costs = (_residuals(problem, tried) ** 2).sum(axis=(0, 2))
            chosen[m] = int(np.argmin(costs))
            best = float(costs[chosen[m]])
            logs = tried[:, chosen[m]]
        if best >= before * (1.0 - 1e-6):
            break
    return best, grid[chosen]


def _residuals(problem: ColorProblem, logs: Floats) -> Floats:
    """Weighted difference of colours, each in parts of its target; shape (G, V, 3) from log colours of that shape."""
    target = problem.targets / problem.targets.sum(axis=1, keepdims=True)
    found = np.exp(logs)
    own = found.sum(axis=2, keepdims=True)
    given = problem.targets.sum(axis=1)[:, None, None]
    scale = np.where(problem.hue_only[:, None, None], own, given)
    off = oklab(found / scale) - oklab(target)[:, None] if problem.perceptual else found / scale - target[:, None]
    return np.asarray(problem.weights[:, None, None] * off, dtype=np.float64)


def perceived_differences(problem: ColorProblem, colors: Floats) -> Floats:
    """Distance in Oklab between found and wanted colours, both as bright as the wanted one has a sum of 1.

    Parameters
    ----------
    problem : ColorProblem
    colors : ndarray, shape (G, 3)

    Returns
    -------
    ndarray, shape (G,)
        About 0.02 is just seen side by side.
    """
    even = replace(problem, perceptual=True, weights=np.ones(len(colors)))
    off = _residuals(even, np.log(np.maximum(colors, 1e-300))[:, None])[:, 0]
    return np.asarray(np.linalg.norm(off, axis=1), dtype=np.float64)


def _logs(problem: ColorProblem, values: Floats) -> Floats:
    """Logarithms of R and T of every mirror, shape (2, M, 3)."""
    rows = mirrors_of(problem.structure)
    R = np.concatenate([
        reflectances(problem.kind, problem.n_d[k], problem.n_d[k + 1], values[m : m + 1]) for m, k in enumerate(rows)
    ])  # fmt: skip
    R = np.clip(R, 1e-12, 1.0 - 1e-12)
    return np.stack([np.log(R), np.log1p(-R)])


def _log_colors(problem: ColorProblem, logs: Floats) -> Floats:
    reflections, passes = uses(problem.structure)
    return np.asarray(reflections @ logs[0] + passes @ logs[1], dtype=np.float64)


def _finish(problem: ColorProblem, values: Floats) -> Coatings:
    """Least squares from a setting of the grid, inside the bounds; each variable touches one surface's R only."""
    bounds = problem.bounds
    limits = [bounds.center_wavelength_nm] if problem.kind == "quarter-wave" else [bounds.film_index, bounds.film_nm]
    low, high = np.array(limits).T
    reflections, passes = uses(problem.structure)
    values, damping = values.copy(), 1e-3

    def cost_of(at: Floats) -> tuple[float, Floats, Floats]:
        logs = _logs(problem, at)
        residuals = _residuals(problem, _log_colors(problem, logs)[:, None])
        return float((residuals**2).sum()), residuals, logs

    cost, residuals, logs = cost_of(values)
    for _ in range(FINISHING_STEPS):
        base, columns = _log_colors(problem, logs), []
        for part in range(values.shape[1]):
            step = 1e-4 * (high[part] - low[part])
            moved = values.copy()
            moved[:, part] += np.where(values[:, part] + step <= high[part], step, -step)
            change = (_logs(problem, moved) - logs) / (moved - values)[None, :, part, None]
            for m in range(len(values)):
                slope = reflections[:, m, None] * change[0, m] + passes[:, m, None] * change[1, m]
                ahead = _residuals(problem, (base + 1e-6 * slope)[:, None])
                columns.append((ahead - residuals).ravel() / 1e-6)
        J = np.array(columns).T
        normal, push = J.T @ J, J.T @ residuals.ravel()
        better = False
        for _ in range(8):
            scaled = normal + damping * np.diag(np.maximum(np.diag(normal), 1e-12))
            step = -np.linalg.solve(scaled, push).reshape(values.shape[1], -1).T
            tried = np.clip(values + step, low, high)
            new, new_residuals, new_logs = cost_of(tried)
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


def coated(lens: Lens, structure: Structure, kind: Kind, values: Floats) -> Lens:
    """Put coatings on a lens.

    Parameters
    ----------
    lens : Lens
    structure : Structure
    kind : {"quarter-wave", "film"}
    values : ndarray, shape (M, 1) or (M, 2)

    Returns
    -------
    Lens
    """
    rows = list(lens.rows)
    for k, value in zip(mirrors_of(structure), values, strict=True):
        coating: Coating = (
            QuarterWave(center_wavelength_nm=float(value[0]))
            if kind == "quarter-wave"
            else Film(index=float(value[0]), thickness_nm=float(value[1]))
        )
        rows[k] = rows[k].replace(coating=coating)
    out: Lens = lens.replace(rows=tuple(rows))
    return out


def pair_map(n_d: Floats, pair: tuple[int, int], bounds: Bounds) -> Floats:
    """Colours of one ghost over the centre wavelengths of its two mirrors, steps of 2 nm (thesis, figure 5.9).

    Parameters
    ----------
    n_d : ndarray, shape (K + 1,)
    pair : (int, int)
    bounds : Bounds

    Returns
    -------
    ndarray, shape (V, V, 3)
        Rows: first mirror; normalised by the Euclidean norm (thesis, equation 5.1).
    """
    low, high = bounds.center_wavelength_nm
    grid = np.linspace(low, high, round((high - low) / STEP_NM) + 1)[:, None]
    one, other = (reflectances("quarter-wave", float(n_d[k]), float(n_d[k + 1]), grid) for k in pair)
    both = one[:, None] * other[None]
    return np.asarray(both / np.maximum(np.linalg.norm(both, axis=2, keepdims=True), 1e-300), dtype=np.float64)


def color_problem(project: Project, kind: Kind, *, perceptual: bool = False) -> tuple[ColorProblem, Lens]:
    """Read a project as a problem of colours: the lens' own, and those that its wishes change.

    Parameters
    ----------
    project : Project
    kind : {"quarter-wave", "film"}
    perceptual : bool
        Judge in Oklab.

    Returns
    -------
    problem : ColorProblem
    lens : Lens
        With the project's coatings.

    Raises
    ------
    FlarewrightError
        When a wish names a ghost that the lens has not, or is for a new ghost.
    """
    design = project.design or Design()
    settled = settle(project)
    choice = resolve_coatings(settled.lens, project.coating)
    rows = tuple(
        row.replace(coating=coating) if isinstance(row, Surface) else row
        for row, coating in zip(settled.lens.rows, choice, strict=True)
    )
    lens: Lens = settled.lens.replace(rows=rows)
    structure = structure_of(lens)
    targets = own_colors(lens, structure)
    weights, hue_only = np.ones(len(targets)), np.zeros(len(targets), np.bool_)
    at = {f"{j}-{i}": g for g, (j, i) in enumerate(structure.pairs)}
    for number, wish in enumerate(design.wishes):
        if wish.ghost not in at:
            what = "is for a new ghost" if wish.ghost is None else f"names {wish.ghost}, which the lens has not"
            raise ProjectError(
                f"design.wishes[{number}] {what}; colours are chosen for the lens' own ghosts that reflect twice on "
                "one side of the stop"
            )
        g = at[wish.ghost]
        weights[g] = 0.0 if wish.action != "want" else wish.weight
        targets[g] *= wish.brightness
        if wish.color is not None:
            # black in a channel is asked for as a thousandth, for no coating reflects nothing
            hue = np.maximum(np.array(wish.color) / max(wish.color), 1e-3)
            targets[g], hue_only[g] = hue * targets[g].sum() / hue.sum(), True
    found = ColorProblem(structure, indices_of(lens), targets, weights, hue_only, kind, design.bounds, perceptual)
    return found, lens
