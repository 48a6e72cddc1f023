"""Which ghosts are seen where: the table of ghosts, what lies under the pointer, and outlines.

Every ghost is drawn by itself in a small picture, by the same renderer as the picture that is shown, in the detail that
a screen shows. A ghost is under the pointer where its light is, so iris, rims and folds count exactly as they do in the
picture; the one that is chosen is drawn once more at full size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..measure.rendering import is_measured, render_any
from ..model import Art, Layer, Output, Project, Quality, Rule
from .picture import Grade
from .studio import spread, staged

Floats = NDArray[np.float32]

# of the viewport's picture
SMALL = 0.25
# against a ghost's brightest spot: what is less is left over from sums of rows
LEFT_OVER = 1e-6
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)


@dataclass(frozen=True)
class SeenGhost:
    """A ghost as it lies in the picture.

    Attributes
    ----------
    name : str
    flux : float
        Its light in the picture: luminance times area, mm^2.
    peak : float
        Its brightest spot's irradiance.
    size_mm : float
        Root mean square radius of what is in the picture.
    centre : tuple of float
        Centroid, as parts of width and height from the upper left corner.
    window : tuple of int
        Of `light` within the small picture.
    light : ndarray, shape (h, w)
        Luminance.
    """

    name: str
    flux: float
    peak: float
    size_mm: float
    centre: tuple[float, float]
    window: tuple[int, int, int, int]
    light: Floats


@dataclass(frozen=True)
class Seen:
    """All ghosts of a project in a picture of this size, brightest first."""

    project: Project
    size_px: tuple[int, int]
    ghosts: tuple[SeenGhost, ...]


def see(project: Project, grade: Grade, progress: Callable[[float, str], None] | None = None) -> Seen:
    """Draw every ghost by itself, small; muted ones too, for they are listed.

    Parameters
    ----------
    project : Project
    grade : {"draft", "final"}
    progress : callable, optional
        What it raises ends the work.

    Returns
    -------
    Seen
    """
    stage = staged(project, grade, SMALL)
    art = Art(rules=tuple(rule for rule in project.art.rules if rule.enable is None))
    quality = stage.quality
    if grade == "final":
        quality = Quality(
            mode="final", wavelengths=3, paths=quality.paths, tolerance_px=1.0, ringing="off", screen=True
        )
    stage = stage.replace(art=art, quality=quality, output=Output(layers="ghosts", starburst=False))
    rendering = render_any(stage, progress=progress)
    width, height = stage.camera.size_px
    across = stage.camera.sensor[0] / width
    ghosts = [
        _seen(layer, (width, height), across) for layer in rendering.layers if layer.name.startswith("ghost.")
    ]  # fmt: skip
    lit = sorted((ghost for ghost in ghosts if ghost.flux > 0.0), key=lambda ghost: -ghost.flux)
    return Seen(project, (width, height), tuple(lit))


def _seen(layer: Layer, size: tuple[int, int], pixel_mm: float) -> SeenGhost:
    light = _lit(layer.pixels)
    x, y, w, h = layer.window
    total = float(light.sum(dtype=np.float64))
    if total <= 0.0:
        return SeenGhost(layer.name.removeprefix("ghost."), 0.0, 0.0, 0.0, (0.5, 0.5), layer.window, light)
    columns, rows = np.arange(w) + x + 0.5, np.arange(h) + y + 0.5
    along, down = light.sum(axis=0, dtype=np.float64) / total, light.sum(axis=1, dtype=np.float64) / total
    cx, cy = float(along @ columns), float(down @ rows)
    spread_px = float(along @ (columns - cx) ** 2 + down @ (rows - cy) ** 2) ** 0.5
    return SeenGhost(
        layer.name.removeprefix("ghost."), total * pixel_mm**2, float(light.max()), spread_px * pixel_mm,
        (cx / size[0], cy / size[1]), layer.window, light,
    )  # fmt: skip


def under(seen: Seen, u: float, v: float) -> tuple[str, ...]:
    """Return the ghosts at a place, brightest there first.

    Parameters
    ----------
    seen : Seen
    u, v : float
        Parts of the picture's width and height from the upper left corner.

    Returns
    -------
    tuple of str
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


def alone(project: Project, ghost: str, grade: Grade) -> Floats:
    """Draw one ghost by itself at the viewport's size, as it lies in the picture, muted or not.

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
        # rings go beyond the ghost's border, faintly and far
        # and what no ghost explains is none of it
        quality = quality.replace(wavelengths=3, ringing="off", screen=quality.screen or is_measured(stage))
    stage = stage.replace(art=only, quality=quality, output=Output(layers="passes", starburst=False))
    layers = [layer for layer in render_any(stage).layers if layer.name.startswith("ghosts")]
    return _lit(spread(layers, stage.camera.size_px))


def _lit(pixels: Floats) -> Floats:
    """Return the luminance of a ghost that is alone, and nothing where only rounding is left."""
    light = np.asarray(pixels @ _LUMINANCE, dtype=np.float32)
    return np.where(light > LEFT_OVER * light.max(initial=0.0), light, np.float32(0.0))


def is_there(light: Floats, u: float, v: float, slack_px: int = 1) -> bool:
    """Tell whether a ghost drawn alone is at a place, or `slack_px` beside it."""
    height, width = light.shape
    column, row = int(np.floor(u * width)), int(np.floor(v * height))
    near = light[
        max(row - slack_px, 0) : row + slack_px + 1, max(column - slack_px, 0) : column + slack_px + 1
    ]  # fmt: skip
    return bool(near.size and near.max() > 0.0)


def outline(light: Floats, colour: tuple[int, int, int], width_px: int = 1) -> NDArray[np.uint8]:
    """Draw the border of a ghost.

    Parameters
    ----------
    light : ndarray, shape (H, W)
        The ghost alone.
    colour : tuple of int
    width_px : int
        On either side of the border.

    Returns
    -------
    ndarray, shape (H, W, 4), uint8
        Clear but for the line; the picture's own border is none of the ghost.
    """
    inside = light > 0.0
    grown, shrunk = inside, inside
    for _ in range(width_px):
        grown, shrunk = _spread_mask(grown), ~_spread_mask(~shrunk)
    line = grown & ~shrunk
    soft = _spread_mask(line) & ~line
    out = np.zeros((*light.shape, 4), dtype=np.uint8)
    out[..., :3] = colour
    out[line, 3] = 255
    out[soft, 3] = 70
    return out


def _spread_mask(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Grow a mask by a pixel to its four sides; what lies beyond the picture changes nothing."""
    out = mask.copy()
    out[1:] |= mask[:-1]
    out[:-1] |= mask[1:]
    out[:, 1:] |= mask[:, :-1]
    out[:, :-1] |= mask[:, 1:]
    return out
