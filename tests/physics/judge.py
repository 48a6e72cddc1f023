"""Test final quality against the reference, block by block, with the reference's variance.

There are two tests. Chi-squared over all blocks tests whether there is more difference than chance explains; the
largest deviation, with Bonferroni's correction, tests whether any single block is wrong. Both add the stated error of
final quality (docs/accuracy.md) to the variance: 0.2 % of a block's flux, and 1e-4 of the mean block's, which dominates
in nearly dark blocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from flarewright.kernels.montecarlo.forward import BESIDE, IN_PICTURE
from flarewright.model import Project
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.render.reference.batches import BLOCK, FOLLOWED, Sums, ray_source, run_batch
from flarewright.render.render import Rendering, render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

STATED, STATED_DARK = 2e-3, 1e-4


@dataclass(frozen=True)
class Judged:
    """Luminous flux from final quality and from the reference.

    Attributes
    ----------
    final, mean, variance : ndarray, shape (A, B)
        Blocks of 16 x 16 pixels, two reflections only.
    paths : dict of str to tuple of float
        By path: flux in the picture from final quality and from the reference, and its standard error.
    batches : int
    total : tuple of float
        Flux in the picture from final quality and from the reference, and its standard error.
    high_share : float
        Part of the ghosts' flux in the picture from more than two reflections, from the reference.
    """

    final: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    paths: dict[str, tuple[float, float, float]]
    batches: int
    total: tuple[float, float, float]
    high_share: float


def blocks_of(pixels: np.ndarray, window: tuple[int, int, int, int], project: Project) -> np.ndarray:
    """Integrate a layer's luminance over blocks, mm^2."""
    width, height = project.camera.size_px
    sensor = project.camera.sensor
    whole = np.zeros((height, width))
    x, y, w, h = window
    whole[y : y + h, x : x + w] = pixels.astype(np.float64) @ luminance_weights(project.output.colorspace)
    rows = np.add.reduceat(whole, np.arange(0, height, BLOCK), axis=0)
    area = sensor[0] / width * sensor[1] / height
    return np.add.reduceat(rows, np.arange(0, width, BLOCK), axis=1) * area


def gather(project: Project, batches: int, side: int, *, fours: bool = False) -> Sums:
    """Trace the reference at the wavelengths of final quality; `fours`: with two and four reflections only."""
    settled = resolve_project(project)
    shots = make_shots(settled, make_opening(settled, None))
    followed = (4.0, 0.0) if fours else (FOLLOWED, FOLLOWED)
    sources = [ray_source(shot, 0, side=side, light=k, followed=followed) for k, shot in enumerate(shots)]
    sums = Sums(0, {}, {})
    for batch in range(batches):
        result = run_batch(sources, batch, picture=True)
        two, every = result["blocks"]
        result["blocks"] = every - two if fours else two
        sums.add(result)
    return sums


def judge(project: Project, *, batches: int = 64, side: int = 128, fours: bool = False) -> Judged:
    """Render a project with both.

    Parameters
    ----------
    project : Project
        With `output.layers = "ghosts"`, so that every path is drawn in full detail.
    batches, side : int
        Of the reference.
    fours : bool
        Whether to compare blocks and total of four reflections instead of two. `final` and `paths` are always of two
        reflections.
    """
    sums = gather(project, batches, side, fours=fours)
    rendering: Rendering = render(project)
    ghosts = next(layer for layer in rendering.layers if layer.name == "ghosts")
    final = blocks_of(ghosts.pixels, ghosts.window, project)
    figures, errors = sums.mean("figures"), np.sqrt(sums.variance("figures"))
    mean, spread = sums.mean("paths")[0], np.sqrt(sums.variance("paths")[0])
    paths = {}
    for layer in rendering.layers:
        if layer.name.startswith("ghost."):
            j, i = (int(row) for row in str(layer.about["path"]).split("-"))
            paths[f"{j}-{i}"] = (float(layer.about["flux_mm2"]), float(mean[j, i]), float(spread[j, i]))
    end = IN_PICTURE + (2 if fours else 1)
    every = figures[IN_PICTURE + 1 : BESIDE].sum()
    return Judged(
        final,
        sums.mean("blocks"),
        sums.variance("blocks"),
        paths,
        batches,
        (float(final.sum()), float(figures[end]), float(errors[end])),
        float(figures[IN_PICTURE + 2 : BESIDE].sum() / every),
    )


def deviations(judged: Judged, final: np.ndarray | None = None) -> np.ndarray:
    """Return the difference of each lit block in standard errors: normal variables if final quality is correct.

    Raises
    ------
    AssertionError
        Final quality has more than 1e-4 of its light where the reference has none.
    """
    F = judged.final if final is None else final
    lit = judged.variance > 0.0
    assert F[~lit].sum() <= 1e-4 * F.sum()
    stated = (STATED * F[lit]) ** 2 + (STATED_DARK * F.mean()) ** 2
    z = (F - judged.mean)[lit] / np.sqrt(judged.variance[lit] + stated)
    # a variance from n batches makes it a t variable; convert it to a normal variable of equal probability
    return stats.norm.isf(stats.t.sf(z, judged.batches - 1))


def probabilities(judged: Judged, final: np.ndarray | None = None) -> tuple[float, float]:
    """Return the probabilities of such differences by chance: over all blocks, and for the worst block."""
    z = deviations(judged, final)
    everywhere = float(stats.chi2.sf((z**2).sum(), z.size))
    worst = float(min(1.0, 2.0 * z.size * stats.norm.sf(np.abs(z).max())))
    return everywhere, worst
