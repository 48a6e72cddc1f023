"""Find the ghosts of a picture: the ghost table, ghosts under the pointer, and outlines.

Every ghost is drawn alone in a small picture, by the same renderer as the shown picture. A ghost is under the pointer
where its light is, so iris, rims and folds count as in the picture. The chosen ghost is drawn again at full size.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from io import StringIO

import numpy as np
from numpy.typing import NDArray

from ...measure.replay.measured_project import is_measured, render_any
from ...model import Art, Layer, Output, Project, Quality, Rule
from ...typing import Mask, Pixels, Progress
from .display_image import LUMINANCE
from .picture import Grade
from .render_picture import spread_layers, staged

# size of the small pictures, as a fraction of the viewport's
SMALL = 0.25
# relative to a ghost's peak: smaller values are rounding of row sums
LEFT_OVER = 1e-6


@dataclass(frozen=True)
class SeenGhost:
    """A ghost in the picture.

    Attributes
    ----------
    name : str
    flux : float
        Its light in the picture: luminance times area, mm^2.
    peak : float
        Its highest irradiance.
    size_mm : float
        Root mean square radius of the visible part.
    centre : tuple of float
        Centroid, as fractions of width and height from the upper left corner.
    window : tuple of int
        Position of `light` in the small picture.
    light : ndarray, shape (h, w)
        Luminance.
    """

    name: str
    flux: float
    peak: float
    size_mm: float
    centre: tuple[float, float]
    window: tuple[int, int, int, int]
    light: Pixels


@dataclass(frozen=True)
class PickableGhosts:
    """All ghosts of a project in a picture of this size, brightest first."""

    project: Project
    size_px: tuple[int, int]
    ghosts: tuple[SeenGhost, ...]


def see(project: Project, grade: Grade, progress: Progress | None = None) -> PickableGhosts:
    """Draw every ghost alone, small; also muted ones, as the table lists them.

    Parameters
    ----------
    project : Project
    grade : {"draft", "final"}
    progress : callable, optional
        Exceptions that it raises end the work.
    """
    stage = staged(project, grade, SMALL)
    ruled = () if project.art.physical else project.art.rules
    art = Art(rules=tuple(rule for rule in ruled if rule.enable is None))
    quality = stage.quality
    if grade == "final":
        quality = Quality(
            mode="final", wavelengths=3, paths=quality.paths, tolerance_px=1.0, ringing="off", screen=True
        )
    stage = stage.replace(art=art, quality=quality, output=Output(layers="ghosts", starburst=False))
    rendering = render_any(stage, progress=progress)
    width, height = stage.camera.size_px
    pixel_mm = (stage.camera.sensor[0] / width, stage.camera.sensor[1] / height)
    ghosts = [_seen(layer, (width, height), pixel_mm) for layer in rendering.layers if layer.name.startswith("ghost.")]
    lit = sorted((ghost for ghost in ghosts if ghost.flux > 0.0), key=lambda ghost: -ghost.flux)
    return PickableGhosts(project, (width, height), tuple(lit))


def _seen(layer: Layer, size: tuple[int, int], pixel_mm: tuple[float, float]) -> SeenGhost:
    light = _lit(layer.pixels)
    x, y, w, h = layer.window
    total = float(light.sum(dtype=np.float64))
    if total <= 0.0:
        return SeenGhost(layer.name.removeprefix("ghost."), 0.0, 0.0, 0.0, (0.5, 0.5), layer.window, light)
    columns, rows = np.arange(w) + x + 0.5, np.arange(h) + y + 0.5
    along, down = light.sum(axis=0, dtype=np.float64) / total, light.sum(axis=1, dtype=np.float64) / total
    cx, cy = float(along @ columns), float(down @ rows)
    # pixels of a desqueezed picture are no squares on the sensor
    wide, high = pixel_mm
    rms_mm = float(wide**2 * (along @ (columns - cx) ** 2) + high**2 * (down @ (rows - cy) ** 2)) ** 0.5
    return SeenGhost(
        layer.name.removeprefix("ghost."), total * wide * high, float(light.max()), rms_mm,
        (cx / size[0], cy / size[1]), layer.window, light,
    )  # fmt: skip


def under(seen: PickableGhosts, u: float, v: float) -> tuple[str, ...]:
    """Return the ghosts at a place, brightest first.

    Parameters
    ----------
    seen : PickableGhosts
    u, v : float
        Fractions of the picture's width and height from the upper left corner.
    """
    column, row = int(np.floor(u * seen.size_px[0])), int(np.floor(v * seen.size_px[1]))
    found: list[tuple[float, str]] = []
    for ghost in seen.ghosts:
        x, y, w, h = ghost.window
        if x <= column < x + w and y <= row < y + h:
            here = float(ghost.light[row - y, column - x])
            if here > 0.0:
                found.append((-here, ghost.name))
    return tuple(name for _, name in sorted(found))


def single_ghost(project: Project, ghost: str, grade: Grade) -> Pixels:
    """Draw one ghost alone at the viewport's size, muted or not.

    Parameters
    ----------
    project : Project
    ghost : str
    grade : {"draft", "final"}

    Returns
    -------
    ndarray, shape (H, W)
        Luminance.
    """
    stage = staged(project, grade)
    rules = tuple(rule for rule in project.art.rules if rule.enable is None)
    only = Art(rules=(*rules, Rule(select=f"not {ghost}", enable=False)))
    quality = stage.quality
    if grade == "final":
        # rings reach beyond the ghost's border, faint and far
        # and the residual of a measured flare belongs to no ghost
        quality = quality.replace(wavelengths=3, ringing="off", screen=quality.screen or is_measured(stage))
    stage = stage.replace(art=only, quality=quality, output=Output(layers="passes", starburst=False))
    layers = [layer for layer in render_any(stage).layers if layer.name.startswith("ghosts")]
    return _lit(spread_layers(layers, stage.camera.size_px))


def _lit(pixels: Pixels) -> Pixels:
    """Return the luminance of a single ghost, with rounding residuals set to 0."""
    light = np.asarray(pixels @ LUMINANCE, dtype=np.float32)
    return np.where(light > LEFT_OVER * light.max(initial=0.0), light, np.float32(0.0))


def is_there(light: Pixels, u: float, v: float) -> bool:
    """Return whether a ghost drawn alone is at a place, or within a pixel of it."""
    height, width = light.shape
    column, row = int(np.floor(u * width)), int(np.floor(v * height))
    near = light[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    return bool(near.size and near.max() > 0.0)


def ghost_outline(light: Pixels, colour: tuple[int, int, int]) -> NDArray[np.uint8]:
    """Draw the border of a ghost, a pixel wide on either side.

    Parameters
    ----------
    light : ndarray, shape (H, W)
        The ghost alone.
    colour : tuple of int

    Returns
    -------
    ndarray, shape (H, W, 4), uint8
        Transparent except for the line; the picture's edge is no border of the ghost.
    """
    inside = light > 0.0
    line = _spread_mask(inside) & _spread_mask(~inside)
    soft = _spread_mask(line) & ~line
    out = np.zeros((*light.shape, 4), dtype=np.uint8)
    out[..., :3] = colour
    out[line, 3] = 255
    out[soft, 3] = 70
    return out


def _spread_mask(mask: Mask) -> Mask:
    """Dilate a mask by a pixel to its four sides; the outside of the picture has no effect."""
    out = mask.copy()
    out[1:] |= mask[:-1]
    out[:-1] |= mask[1:]
    out[:, 1:] |= mask[:, :-1]
    out[:, :-1] |= mask[:, 1:]
    return out


def ghost_csv(seen: PickableGhosts) -> str:
    """Return the ghosts of a picture as CSV: brightest first, millimetres in the upright picture."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["ghost", "flux_mm2", "peak_irradiance", "rms_radius_mm", "x_mm", "y_mm"])
    width, height = seen.project.camera.sensor
    for ghost in seen.ghosts:
        x, y = (ghost.centre[0] - 0.5) * width, (0.5 - ghost.centre[1]) * height
        numbers = (ghost.flux, ghost.peak, ghost.size_mm, x, y)
        writer.writerow([ghost.name, *(f"{number:.6g}" for number in numbers)])
    return out.getvalue()
