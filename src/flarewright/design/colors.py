"""The colours of ghosts by the coatings they meet (Van Acoleyen 2025, sections 5.3.6, 5.4 and 5.6.4).

Light meets every surface head on, at three wavelengths. A ghost's colour is R_j R_i times the transmittances along its
path, so its logarithm is a sum over the surfaces. `color_search` chooses coatings.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ProjectError
from ..model import Coating, Film, Lens, Project, QuarterWave, Surface
from ..model.coating import Stack
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
# steps of tables over the centre wavelength
STEP_NM = 2.0
# films of a free coating at most
MOST_LAYERS = 3


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
    layers : int
        Free films on a surface at most.
    kept : tuple of int
        Mirrors that stay as they are.
    kept_logs : ndarray, shape (G, 3)
        What those do to the logarithms of the ghosts' colours.
    """

    structure: Structure
    n_d: Floats
    targets: Floats
    weights: Floats
    hue_only: NDArray[np.bool_]
    kind: Kind
    bounds: Bounds
    perceptual: bool = False
    layers: int = 1
    kept: tuple[int, ...] = ()
    kept_logs: Floats | float = 0.0

    @property
    def rows(self) -> NDArray[np.int64]:
        """Rows whose coatings are chosen, shape (M,)."""
        mirrors = mirrors_of(self.structure)
        return mirrors[~np.isin(mirrors, self.kept)]

    def uses(self) -> tuple[Floats, Floats]:
        """Count how often each ghost is reflected by each of `rows` and passes it, both of shape (G, M)."""
        chosen = ~np.isin(mirrors_of(self.structure), self.kept)
        reflections, passes = uses(self.structure)
        return reflections[:, chosen], passes[:, chosen]

    def check(self) -> None:
        """Refuse what no solver can begin with.

        Raises
        ------
        ProjectError
            When no ghost's colour is asked for, or no surface can be coated.
        """
        if not self.weights.any():
            raise ProjectError("no ghost's colour counts; give one a weight above 0")
        if not len(self.rows):
            raise ProjectError("no surface of this lens lies between glass and air, so there is nothing to coat")

    def limits(self) -> tuple[Floats, Floats]:
        """Least and largest of a coating's values, each of shape (P,)."""
        if self.kind == "quarter-wave":
            return np.array(self.bounds.center_wavelength_nm[:1]), np.array(self.bounds.center_wavelength_nm[1:])
        low, high = np.array([self.bounds.film_index, self.bounds.film_nm]).T
        return np.tile(low, self.layers), np.tile(high, self.layers)


@dataclass(frozen=True)
class Coatings:
    """What a search for coatings found.

    Attributes
    ----------
    cost : float
    values : ndarray, shape (M, P)
        Of each of the problem's `rows`: the centre wavelength in nm, or index and thickness in nm of each film, from
        the side of the lower index; a film of no thickness is not there.
    colors : ndarray, shape (G, 3)
    """

    cost: float
    values: Floats
    colors: Floats


def mirrors_of(structure: Structure) -> NDArray[np.int64]:
    """Return the rows that reflect: those where the index changes."""
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


def reflectances(kind: Kind, n_front: ArrayLike, n_back: ArrayLike, values: Floats) -> Floats:
    """Reflectance of surfaces for many settings of their coatings, at the three wavelengths.

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
    Head on a lossless stack reflects the same from both sides, so light comes from the side of the lower index here.
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
    """Return the colours of a lens' ghosts with the coatings it has, any kind of them.

    Parameters
    ----------
    lens : Lens
    structure : Structure

    Returns
    -------
    ndarray, shape (G, 3)
    """
    return np.asarray(np.exp(_own_logs(lens, structure, mirrors_of(structure))), dtype=np.float64)


def _own_logs(lens: Lens, structure: Structure, rows: NDArray[np.int64]) -> Floats:
    """Return what mirrors with the coatings that they have do to the logarithms of the colours, shape (G, 3)."""
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
    """Return the bare mirrors between two glasses: cement holds them, and no film can be put there."""
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
    off = color_residuals(even, np.log(np.maximum(colors, 1e-300))[:, None])[:, 0]
    return np.asarray(np.linalg.norm(off, axis=1), dtype=np.float64)


def log_reflectances(problem: ColorProblem, values: Floats) -> Floats:
    """Logarithms of R and T of `rows`, shape (2, ..., M, 3), for values of shape (..., M, P)."""
    rows = problem.rows
    R = reflectances(problem.kind, problem.n_d[rows], problem.n_d[rows + 1], values)
    return log_both(R)


def log_both(R: Floats) -> Floats:
    """Logarithms of R and of 1 - R, both kept finite."""
    R = np.clip(R, 1e-12, 1.0 - 1e-12)
    return np.stack([np.log(R), np.log1p(-R)])


def log_colors(problem: ColorProblem, logs: Floats) -> Floats:
    """Logarithms of every ghost's colour, shape (..., G, 3), from those of the mirrors, shape (2, ..., M, 3)."""
    reflections, passes = problem.uses()
    return np.asarray(reflections @ logs[0] + passes @ logs[1] + problem.kept_logs, dtype=np.float64)


def coated(lens: Lens, coated_rows: NDArray[np.int64], kind: Kind, values: Floats) -> Lens:
    """Put coatings on a lens.

    Parameters
    ----------
    lens : Lens
    coated_rows : ndarray, shape (M,)
        `ColorProblem.rows`.
    kind : {"quarter-wave", "film"}
    values : ndarray, shape (M, P)
        As in `Coatings`.

    Returns
    -------
    Lens
    """
    rows = list(lens.rows)
    for k, value in zip(coated_rows, values, strict=True):
        rows[k] = rows[k].replace(coating=coating_of(kind, value))
    out: Lens = lens.replace(rows=tuple(rows))
    return out


def coating_of(kind: Kind, values: Floats) -> Coating:
    """Return a coating of its values, shape (P,)."""
    if kind == "quarter-wave":
        return QuarterWave(center_wavelength_nm=float(values[0]))
    films = [Film(index=float(n), thickness_nm=float(d)) for n, d in values.reshape(-1, 2) if d > 0.0]
    return films[0] if len(films) == 1 else Stack(layers=tuple(films))


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


def color_problem(
    project: Project, kind: Kind, *, perceptual: bool = False, layers: int = 1
) -> tuple[ColorProblem, Lens]:
    """Read a project as a problem of colours: the lens' own, and those that its wishes change.

    Cemented surfaces stay bare where the project has them bare.

    Parameters
    ----------
    project : Project
    kind : {"quarter-wave", "film"}
    perceptual : bool
        Judge in Oklab.
    layers : int
        Free films on a surface at most.

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
    kept = cemented(lens, structure)
    found = ColorProblem(
        structure, indices_of(lens), targets, weights, hue_only, kind, design.bounds, perceptual, layers, kept,
        _own_logs(lens, structure, np.array(kept, dtype=np.int64)),
    )  # fmt: skip
    return found, lens
