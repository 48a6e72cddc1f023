"""Solve the brightness of all ghosts at once. With fixed shapes the picture is linear in it.

Fits of one ghost at a time converge slowly where ghosts overlap. The joint solution assigns shared light at once. It
also finds redundant ghosts: those whose removal hardly raises the residual after the others are solved again.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ...kernels.ghost_model.edge_coverage import sum_along_rows, sum_changes_along_rows
from ...kernels.ghost_model.ghost_mesh import window_of
from ...kernels.ghost_model.jacobian import draw_with_changes
from ...kernels.ghost_model.pupil_mesh import FIRST_I
from ...typing import Floats, Indices, Mask, Pixels
from ..core.parallel import map_batched
from ..core.parameters import Shape
from ..core.sampling import evenly_spaced
from ..core.views import View, halved_pixels
from .detected_ghost import CHANNELS, DetectedGhost
from .ghost_fit import priors, witness
from .patches import scaled
from .settings import FitSettings

# intensity parameters that are solved: terms 1, u, v, w
_TERMS = np.arange(FIRST_I, FIRST_I + 4)


@dataclass(frozen=True)
class _LinearModel:
    """Linear model of one view of P pixels with its G visible ghosts.

    Attributes
    ----------
    ghosts : ndarray of int, shape (G,)
    basis : ndarray, shape (P, 4 G)
        Picture per unit of each intensity parameter, minus its weighted mean, which removes a uniform background.
    light : ndarray, shape (4 G,)
        Sum of the light per unit of each parameter.
    there : ndarray of bool, shape (P, G)
        Pixels that each ghost covers.
    pixels : ndarray, shape (P,)
        Observed pixels minus their weighted mean.
    weight : ndarray, shape (P,)
    allowed : ndarray, shape (G,)
        Weighted squares of the expected model error in the footprint of each ghost.
    """

    ghosts: Indices
    basis: Pixels
    light: Floats
    there: Mask
    pixels: Floats
    weight: Floats
    allowed: Floats

    @property
    def columns(self) -> Indices:
        """Indices of the parameters of its ghosts among those of all ghosts."""
        return _columns(self.ghosts)


@dataclass(frozen=True)
class _Equations:
    """Normal equations of one colour, `matrix` x = `side`, for the intensity parameters of all ghosts, shape (4 G,)."""

    pictures: Sequence[_LinearModel]
    matrix: Floats
    side: Floats


def solve_intensities(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], *, needed: float | None = None,
    pool: ThreadPoolExecutor | None = None, settings: FitSettings = FitSettings(),
) -> list[DetectedGhost]:  # fmt: skip
    """Solve the brightness of all ghosts in all colours, and drop redundant ghosts.

    Parameters
    ----------
    ghosts : sequence of DetectedGhost
    views : sequence of View
        With the glow subtracted; pixels to ignore have infinite variance.
    needed : float, optional
        Minimum fraction of the squares that a ghost must explain alone, all colours together; default: that of
        `settings`.
    pool : executor, optional
    settings : FitSettings
    """
    if not ghosts:
        return []
    equations = [_equations(ghosts, views, m, pool, settings) for m in range(CHANNELS)]
    kept = _needed(equations, settings.joint.needed if needed is None else needed)
    at = _columns(kept)
    values = [
        np.asarray(np.linalg.solve(one.matrix[np.ix_(at, at)], one.side[at])).reshape(-1, _TERMS.size)
        for one in equations
    ]
    return [_with_light(ghosts[int(k)], [values[m][n] for m in range(CHANNELS)]) for n, k in enumerate(kept)]


def _equations(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], channel: int, pool: ThreadPoolExecutor | None,
    settings: FitSettings,
) -> _Equations:  # fmt: skip
    """Return the normal equations of one colour."""
    pictures = _linear_models(ghosts, views, channel, pool, settings)
    width = views[0].size_px[0]
    prior = np.concatenate([priors(ghost.shapes[channel], _TERMS, width, settings.priors) for ghost in ghosts])
    matrix: Floats = np.zeros((prior.size, prior.size))
    side: Floats = np.zeros(prior.size)
    for one in pictures:
        # a product of a matrix with its transpose takes half the work and is exactly symmetric
        root = np.sqrt(one.weight)
        scaled = one.basis * root[:, None]
        matrix[np.ix_(one.columns, one.columns)] += scaled.T @ scaled
        side[one.columns] += scaled.T @ (root * one.pixels)
    # halved pictures have fewer pixels that share one model error
    alike = max(settings.alike_px * (settings.joint.light_width_px / width) ** 2, 1.0)
    first: Floats = np.asarray(np.linalg.solve(matrix + np.diag(prior), side))
    matrix += np.diag(prior * witness(*_residual_squares(pictures, first), alike))
    return _Equations(pictures, matrix, side)


def _residual_squares(pictures: Sequence[_LinearModel], values: Floats) -> tuple[float, int]:
    """Return the weighted squares of the residual with these parameters, and the number of pixels."""
    cost = sum(float(one.weight @ (one.pixels - one.basis @ values[one.columns]) ** 2) for one in pictures)
    return cost, sum(int(np.count_nonzero(one.weight)) for one in pictures)


def _columns(kept: Indices) -> Indices:
    """Return the indices of the parameters of some ghosts among those of all ghosts."""
    return np.asarray((_TERMS.size * kept[:, None] + np.arange(_TERMS.size)).ravel())


def _needed(equations: Sequence[_Equations], least: float) -> Indices:
    """Return the ghosts that remain after repeated removal of the least needed one.

    Removing some parameters and solving the others again raises the squares by x' (C)^-1 x, where x are their values
    and C is their block of the inverse matrix. The squares of all colours count together, as coatings make many ghosts
    purple, hardly visible in green.
    """
    kept = np.arange(equations[0].side.size // _TERMS.size)
    light_sums = [_light_sums(one) for one in equations]
    allowed = np.sum([_model_errors(one, kept.size) for one in equations], axis=0)
    while kept.size:
        at = _columns(kept)
        grown, seen, brightness, missed = (np.zeros(kept.size) for _ in range(4))
        for colour, adding in zip(equations, light_sums, strict=True):
            inverse = np.linalg.inv(colour.matrix[np.ix_(at, at)])
            values = inverse @ colour.side[at]
            missed += _residual_by_ghost(colour, at, values)[kept]
            for n in range(kept.size):
                part = slice(_TERMS.size * n, _TERMS.size * (n + 1))
                own, light = at[part], values[part]
                grown[n] += float(light @ np.linalg.solve(inverse[part, part], light))
                seen[n] += float(light @ colour.matrix[np.ix_(own, own)] @ light)
                brightness[n] += adding[own] @ light
        # a ghost fainter than the model error of the others in its footprint may be that error
        gains = np.minimum(grown / np.maximum(grown + missed, 1e-300), seen / np.maximum(allowed[kept], 1e-300) - 1.0)
        # drop ghosts with negative light; the sum runs over the area inside the rims, not over the whole pupil
        gains[brightness <= 0.0] = -1.0
        worst = int(np.argmin(gains))
        if gains[worst] >= least:
            break
        kept = np.delete(kept, worst)
    return kept


def _light_sums(colour: _Equations) -> Floats:
    """Return the total light per unit of each intensity parameter, shape (4 G,)."""
    light_sums = np.zeros(colour.side.size)
    for one in colour.pictures:
        light_sums[one.columns] += one.light
    return light_sums


def _model_errors(colour: _Equations, count: int) -> Floats:
    """Return the weighted squares of the expected model error in the footprint of each ghost."""
    allowed = np.zeros(count)
    for one in colour.pictures:
        allowed[one.ghosts] += one.allowed
    return allowed


def _residual_by_ghost(colour: _Equations, at: Indices, values: Floats) -> Floats:
    """Return the weighted squares of the residual in the footprint of each ghost, with these intensity parameters."""
    everything = np.zeros(colour.side.size)
    everything[at] = values
    residuals = np.zeros(colour.side.size // _TERMS.size)
    for one in colour.pictures:
        missed = one.pixels - one.basis @ everything[one.columns]
        residuals[one.ghosts] += (one.weight * missed**2) @ one.there
    return residuals


def _linear_models(
    ghosts: Sequence[DetectedGhost], views: Sequence[View], channel: int, pool: ThreadPoolExecutor | None,
    settings: FitSettings,
) -> list[_LinearModel]:  # fmt: skip
    """Draw the linear model of the selected views."""
    times = max(0, int(np.ceil(np.log2(views[0].size_px[0] / settings.joint.light_width_px))))

    def one(k: int) -> _LinearModel:
        view = views[k]
        pixels = halved_pixels(view.pixels[..., channel], times).astype(float)
        variance = halved_pixels(view.variance[..., channel], times, variance=True).astype(float)
        height, width = pixels.shape
        shown = np.array([n for n, ghost in enumerate(ghosts) if ghost.first <= k <= ghost.last], dtype=np.int64)
        basis = np.zeros((height, width, shown.size, _TERMS.size), np.float32)
        model = np.zeros((height, width))
        for n, g in enumerate(shown):
            model += _draw_basis(ghosts[g].shapes[channel], view.sigma, scaled(view.frame, times), basis[:, :, n])
        level = np.maximum(np.abs(model), np.abs(pixels))
        allowed = (settings.model_error * level) ** 2
        weight = np.where(np.isfinite(variance), 1.0 / (variance + allowed), 0.0).ravel()
        columns = basis.reshape(height * width, -1)
        total = max(float(weight.sum()), 1e-300)
        seen = np.where(weight > 0.0, pixels.ravel(), 0.0)
        there = columns[:, :: _TERMS.size] != 0.0
        light = columns.sum(axis=0, dtype=np.float64)
        columns = columns - ((weight @ columns) / total).astype(np.float32)
        missed = (weight * allowed.ravel()) @ there
        return _LinearModel(shown, columns, light, there, seen - float(weight @ seen) / total, weight, missed)

    return map_batched(one, evenly_spaced(range(len(views)), settings.joint.light_views), pool=pool)


def _draw_basis(shape: Shape, sigma: float, frame: Floats, basis: Pixels) -> Floats:
    """Fill the picture per unit of each intensity parameter, shape (H, W, 4); return the picture of the shape."""
    height, width = basis.shape[:2]
    out = np.zeros((height, width))
    left, top, w, h = window_of(shape.numbers, shape.discs, sigma, frame, width, height)
    if not w:
        return out
    plane, changes = np.zeros((h, w + 1)), np.zeros((h, w + 1, _TERMS.size))
    draw_with_changes(shape.numbers, shape.discs, sigma, _TERMS, frame, left, top, plane, changes)
    sum_along_rows(plane)
    sum_changes_along_rows(changes)
    basis[top : top + h, left : left + w] = changes[:, :w]
    out[top : top + h, left : left + w] = plane[:, :w]
    return out


def _with_light(ghost: DetectedGhost, values: Sequence[Floats]) -> DetectedGhost:
    """Return a ghost with other intensity parameters."""
    shapes = []
    for shape, light in zip(ghost.shapes, values, strict=True):
        numbers = shape.numbers.copy()
        numbers[_TERMS] = light
        shapes.append(replace(shape, numbers=numbers))
    red, green, blue = shapes
    return replace(ghost, shapes=(red, green, blue))
