"""Colours of ghosts as a function of the coatings (Van Acoleyen 2025, sections 5.3.6, 5.4 and 5.6.4).

Light meets every surface at normal incidence, at three wavelengths. A ghost's colour is R_j R_i times the
transmittances along its path, so its logarithm is a sum over the surfaces. `color_search` chooses coatings.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...errors import ProjectError
from ...model import Coating, Film, Lens, Project, QuarterWave, Surface
from ...model.lens.coating import Stack
from ...model.project.design import Bounds, Design
from ...optics.coatings.thin_film import MAGNESIUM_FLUORIDE, film_stack, stack_reflectance
from ...optics.colour.rgb import oklab
from ...optics.rays.pack import resolve_coatings
from ...render.scene.resolve import resolve_project
from ...typing import Floats, Indices, Mask
from ..problem.prescription import Structure, structure_of

Kind = Literal["quarter-wave", "film"]

# wavelengths of red, green and blue in the thesis' program, nm
WAVELENGTHS_NM = (650.0, 510.0, 475.0)
# step of tables over the centre wavelength, nm
STEP_NM = 2.0


@dataclass(frozen=True)
class ColorProblem:
    """Target colours of ghosts, and the coatings that may change.

    Attributes
    ----------
    structure : Structure
    n_d : ndarray, shape (K + 1,)
        Indices, before row 0 and behind every row.
    targets : ndarray, shape (G, 3)
        R, G, B of each ghost, relative to the light source.
    weights : ndarray, shape (G,)
    hue_only : ndarray, shape (G,), bool
        Whether only the ratio of the three counts.
    kind : {"quarter-wave", "film"}
    bounds : Bounds
    perceptual : bool
        Compare colours in Oklab instead of by relative differences of red, green and blue.
    layers : int
        Largest number of free films on a surface.
    kept : tuple of int
        Mirrors whose coatings stay as they are.
    kept_logs : ndarray, shape (G, 3)
        Contribution of those mirrors to the logarithms of the ghosts' colours.
    """

    structure: Structure
    n_d: Floats
    targets: Floats
    weights: Floats
    hue_only: Mask
    kind: Kind
    bounds: Bounds
    perceptual: bool = False
    layers: int = 1
    kept: tuple[int, ...] = ()
    kept_logs: Floats | float = 0.0

    @property
    def rows(self) -> Indices:
        """Rows whose coatings are chosen, shape (M,)."""
        mirrors = mirrors_of(self.structure)
        return mirrors[~np.isin(mirrors, self.kept)]

    def uses(self) -> tuple[Floats, Floats]:
        """Return how often each ghost is reflected by and passes each of `rows`, both of shape (G, M)."""
        chosen = ~np.isin(mirrors_of(self.structure), self.kept)
        reflections, passes = uses(self.structure)
        return reflections[:, chosen], passes[:, chosen]

    def check(self) -> None:
        """Raise an error unless a solver can start.

        Raises
        ------
        ProjectError
            When no ghost has a target colour, or no surface can be coated.
        """
        if not self.weights.any():
            raise ProjectError("no ghost's colour has a weight; give one a weight above 0")
        if not len(self.rows):
            raise ProjectError("no surface of this lens lies between glass and air, so there is nothing to coat")

    def limits(self) -> tuple[Floats, Floats]:
        """Return lower and upper bounds of a coating's values, each of shape (P,)."""
        if self.kind == "quarter-wave":
            return np.array(self.bounds.center_wavelength_nm[:1]), np.array(self.bounds.center_wavelength_nm[1:])
        low, high = np.array([self.bounds.film_index, self.bounds.film_nm]).T
        return np.tile(low, self.layers), np.tile(high, self.layers)


@dataclass(frozen=True)
class Coatings:
    """Result of a search for coatings.

    Attributes
    ----------
    cost : float
    values : ndarray, shape (M, P)
        For each of the problem's `rows`: the centre wavelength in nm, or index and thickness in nm of each film, from
        the side of the lower index; a film of thickness 0 is absent.
    colors : ndarray, shape (G, 3)
    """

    cost: float
    values: Floats
    colors: Floats


def mirrors_of(structure: Structure) -> Indices:
    """Return the rows that reflect: those where the index changes."""
    return np.flatnonzero(structure.mirrors)


def uses(structure: Structure) -> tuple[Floats, Floats]:
    """Return how often each ghost is reflected by each mirror and passes it.

    Returns
    -------
    reflections, passes : ndarray, shape (G, M)
    """
    rows = mirrors_of(structure)
    j, i = (np.array(side)[:, None] for side in zip(*structure.pairs, strict=True))
    reflections = ((rows == j) | (rows == i)).astype(np.float64)
    # surfaces between the two mirrors are passed three times, the mirrors themselves once
    passes = np.where((rows > i) & (rows < j), 3.0, 1.0)
    return reflections, passes


def reflectances(kind: Kind, n_front: ArrayLike, n_back: ArrayLike, values: Floats) -> Floats:
    """Return the reflectance of surfaces for many settings of their coatings, at the three wavelengths.

    Parameters
    ----------
    kind : {"quarter-wave", "film"}
    n_front, n_back : array_like, shape (...)
    values : ndarray, shape (..., P)
        As in `Coatings`; the shapes broadcast.

    Returns
    -------
    ndarray, shape (..., 3)

    Notes
    -----
    At normal incidence a lossless stack reflects the same from both sides, so light comes from the lower index here.
    """
    front, back = (np.asarray(n, dtype=np.float64)[..., None] for n in (n_front, n_back))
    low, high = np.minimum(front, back), np.maximum(front, back)
    if kind == "quarter-wave":
        index = np.maximum(np.sqrt(low * high), MAGNESIUM_FLUORIDE)
        n, d = [index], [values[..., :1] / (4.0 * index)]
    else:
        n, d = ([values[..., p : p + 1] for p in range(part, values.shape[-1], 2)] for part in (0, 1))
    return stack_reflectance(low, high, n, d, np.array(WAVELENGTHS_NM), 1.0)


def colors_of(problem: ColorProblem, values: Floats) -> Floats:
    """Return the colour of every ghost for settings of the coatings.

    Parameters
    ----------
    problem : ColorProblem
    values : ndarray, shape (..., M, P)

    Returns
    -------
    ndarray, shape (..., G, 3)
    """
    return np.exp(log_colors(problem, log_reflectances(problem, values)))


def own_colors(lens: Lens, structure: Structure) -> Floats:
    """Return the colours of a lens' ghosts with its present coatings of any kind.

    Returns
    -------
    ndarray, shape (G, 3)
    """
    return np.asarray(np.exp(_own_logs(lens, structure, mirrors_of(structure))), dtype=np.float64)


def _own_logs(lens: Lens, structure: Structure, rows: Indices) -> Floats:
    """Return the contribution of mirrors with their present coatings to the log colours, shape (G, 3)."""
    n_d = indices_of(lens)
    waves = np.array(WAVELENGTHS_NM)
    table = []
    for k in rows:
        row = lens.rows[k]
        assert isinstance(row, Surface)
        films = film_stack(row.coating, float(n_d[k]), float(n_d[k + 1]))
        table.append(stack_reflectance(float(n_d[k]), float(n_d[k + 1]), *films, waves, 1.0))
    R = np.maximum(np.array(table).reshape(-1, len(waves)), 1e-12)
    chosen = np.isin(mirrors_of(structure), rows)
    reflections, passes = (each[:, chosen] for each in uses(structure))
    return np.asarray(reflections @ np.log(R) + passes @ np.log1p(-R), dtype=np.float64)


def cemented(lens: Lens, structure: Structure) -> tuple[int, ...]:
    """Return the bare mirrors between two glasses: cemented surfaces take no film."""
    n_d = indices_of(lens)
    rows = ((int(k), lens.rows[k]) for k in mirrors_of(structure))
    return tuple(
        k for k, row in rows if isinstance(row, Surface) and row.coating is None and min(n_d[k], n_d[k + 1]) > 1.0
    )


def indices_of(lens: Lens) -> Floats:
    """Return n_d before row 0 and behind every row, shape (K + 1,)."""
    behind = [1.0 if not isinstance(row, Surface) or row.medium is None else row.medium.n_d for row in lens.rows]
    return np.array([1.0, *behind])


def color_residuals(problem: ColorProblem, logs: Floats) -> Floats:
    """Return weighted relative differences from target colours, shape (G, V, 3), for log colours of that shape."""
    target = problem.targets / problem.targets.sum(axis=1, keepdims=True)
    found = np.exp(logs)
    own = found.sum(axis=2, keepdims=True)
    given = problem.targets.sum(axis=1)[:, None, None]
    scale = np.where(problem.hue_only[:, None, None], own, given)
    off = oklab(found / scale) - oklab(target)[:, None] if problem.perceptual else found / scale - target[:, None]
    return np.asarray(problem.weights[:, None, None] * off, dtype=np.float64)


def perceived_differences(problem: ColorProblem, colors: Floats) -> Floats:
    """Return the Oklab distance between found and target colours, scaled so that the target's channels sum to 1.

    Parameters
    ----------
    problem : ColorProblem
    colors : ndarray, shape (G, 3)

    Returns
    -------
    ndarray, shape (G,)
        About 0.02 is just noticeable side by side.
    """
    even = replace(problem, perceptual=True, weights=np.ones(len(colors)))
    off = color_residuals(even, np.log(np.maximum(colors, 1e-300))[:, None])[:, 0]
    return np.asarray(np.linalg.norm(off, axis=1), dtype=np.float64)


def log_reflectances(problem: ColorProblem, values: Floats) -> Floats:
    """Return the logarithms of R and T of `rows`, shape (2, ..., M, 3), for values of shape (..., M, P)."""
    rows = problem.rows
    R = reflectances(problem.kind, problem.n_d[rows], problem.n_d[rows + 1], values)
    return log_both(R)


def log_both(R: Floats) -> Floats:
    """Return the logarithms of R and of 1 - R, both kept finite."""
    R = np.clip(R, 1e-12, 1.0 - 1e-12)
    return np.stack([np.log(R), np.log1p(-R)])


def log_colors(problem: ColorProblem, logs: Floats) -> Floats:
    """Return the log colour of every ghost, shape (..., G, 3), from the logs of the mirrors, shape (2, ..., M, 3)."""
    reflections, passes = problem.uses()
    return np.asarray(reflections @ logs[0] + passes @ logs[1] + problem.kept_logs, dtype=np.float64)


def coated(lens: Lens, coated_rows: Indices, kind: Kind, values: Floats) -> Lens:
    """Return a lens with coatings.

    Parameters
    ----------
    lens : Lens
    coated_rows : ndarray, shape (M,)
        `ColorProblem.rows`.
    kind : {"quarter-wave", "film"}
    values : ndarray, shape (M, P)
        As in `Coatings`.
    """
    rows = list(lens.rows)
    for k, value in zip(coated_rows, values, strict=True):
        rows[k] = rows[k].replace(coating=coating_of(kind, value))
    return lens.replace(rows=tuple(rows))


def coating_of(kind: Kind, values: Floats) -> Coating:
    """Return the coating for values of shape (P,)."""
    if kind == "quarter-wave":
        return QuarterWave(center_wavelength_nm=float(values[0]))
    films = [Film(index=float(n), thickness_nm=float(d)) for n, d in values.reshape(-1, 2) if d > 0.0]
    return films[0] if len(films) == 1 else Stack(layers=tuple(films))


def pair_map(n_d: Floats, pair: tuple[int, int], bounds: Bounds) -> Floats:
    """Return the colours of one ghost over the centre wavelengths of its two mirrors, in steps of 2 nm (thesis, 5.9).

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


def color_problem(
    project: Project, kind: Kind, *, perceptual: bool = False, layers: int = 1
) -> tuple[ColorProblem, Lens]:
    """Convert a project to a coating problem: targets are the lens' own ghost colours, as changed by its ghost targets.

    Cemented surfaces that are bare in the project stay bare.

    Parameters
    ----------
    project : Project
    kind : {"quarter-wave", "film"}
    perceptual : bool
        Compare colours in Oklab.
    layers : int
        Largest number of free films on a surface.

    Returns
    -------
    problem : ColorProblem
    lens : Lens
        That of the project with all its positions, and with the project's coatings.

    Raises
    ------
    FlarewrightError
        When a target names a ghost that the lens does not have, or is for a new ghost, or the project has a filter or
        a cover glass.
    """
    design = project.design or Design()
    plates = {"filter": project.filter, "camera.cover_glass": project.camera.cover_glass}
    for key, plate in plates.items():
        if plate is not None:
            # it would become rows of the written lens, in front of which the project puts it again
            raise ProjectError(f"{key} is no part of the lens to coat; leave it out of the project")
    # neither zoom nor focus changes glasses and coatings
    given = resolve_project(project).opened.lens
    choice = resolve_coatings(given, project.coating)
    rows = tuple(
        row.replace(coating=coating) if isinstance(row, Surface) else row
        for row, coating in zip(given.rows, choice, strict=True)
    )
    lens: Lens = given.replace(rows=rows)
    structure = structure_of(lens)
    targets = own_colors(lens, structure)
    weights, hue_only = np.ones(len(targets)), np.zeros(len(targets), np.bool_)
    at = {f"{j}-{i}": g for g, (j, i) in enumerate(structure.pairs)}
    for number, ghost_target in enumerate(design.ghost_targets):
        if ghost_target.ghost not in at:
            what = (
                "is for a new ghost"
                if ghost_target.ghost is None
                else f"names {ghost_target.ghost}, which the lens does not have"
            )
            raise ProjectError(
                f"design.ghost_targets[{number}] {what}; colours are for the lens' own ghosts that reflect twice on "
                "one side of the stop"
            )
        g = at[ghost_target.ghost]
        weights[g] = 0.0 if ghost_target.action != "want" else ghost_target.weight
        targets[g] *= ghost_target.brightness
        if ghost_target.color is not None:
            # a black channel gets a target of 0.001, as no coating reflects nothing
            hue = np.maximum(np.array(ghost_target.color) / max(ghost_target.color), 1e-3)
            targets[g], hue_only[g] = hue * targets[g].sum() / hue.sum(), True
    kept = cemented(lens, structure)
    found = ColorProblem(
        structure, indices_of(lens), targets, weights, hue_only, kind, design.bounds, perceptual, layers, kept,
        _own_logs(lens, structure, np.array(kept, dtype=np.int64)),
    )  # fmt: skip
    return found, lens
