"""Pictures while the user drags a light: ghosts in draft quality, and starbursts that are drawn once and shifted.

The starburst of a distant light is one pattern everywhere in the picture (docs/diffraction.md); only position and
strength change. So it is drawn once on a canvas with room for every position, and each picture shows a part of that
canvas: in a fraction of the time, with a position error of at most half a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import floor
from pathlib import Path

import numpy as np

from ...io.images.mask_image import read_mask
from ...kernels.raster.plane_memory import black_picture
from ...model import Art, Iris, Lens, Light, Project
from ...optics.lens.paths import ghost_paths
from ...typing import Floats, Pixels
from ..ghosts.ghost_pass import render_ghosts
from ..scattering.scatter_pass import chosen_scatter
from ..scene.art_rules import resolve_art
from ..scene.direct_image import DirectImage, defocus_mm, direct_image
from ..scene.opening import make_opening
from ..scene.path_color import direct_spectrum
from ..scene.resolve import ResolvedProject, resolve_project
from ..scene.shot import Shot
from ..scene.shots import make_shots
from ..starburst.starburst_pass import OUT_OF_FOCUS_PX, read_soil, starburst_of

# with more lights the ghosts are slow and the starburst canvases need much memory
MOST_LIGHTS = 4

SMALL_DEG = 0.6
"""Ghosts of discs up to this angle (the sun, with some margin) are drawn as those of points while dragging: spreading
each ghost over its disc takes several times as long as drawing it, and softens its edge by a few pixels. Starbursts of
such discs are shifted as those of points: at another angle a disc's image is a few per cent longer."""


@dataclass(frozen=True)
class StarburstCanvas:
    """A light's starburst with room for a picture on every side.

    Attributes
    ----------
    scene : Project
        Everything that shapes the starburst: the project without position and strength of the light.
    pixels : ndarray, shape (2 H + 1, 2 W + 1, 3)
        Irradiance; the light lies within the central pixel.
    strength : ndarray, shape (3,)
        Flux of the light for which it was drawn.
    """

    scene: Project
    pixels: Pixels
    strength: Floats


@dataclass(frozen=True)
class DragStar:
    """A light's starburst as placed in a picture.

    Attributes
    ----------
    sheet : StarburstCanvas
    corner : tuple of int
        Row and column of the sheet at the first pixel of the picture.
    gain : tuple of float
        Factor on the sheet, R, G, B.
    """

    sheet: StarburstCanvas
    corner: tuple[int, int]
    gain: tuple[float, float, float]


@dataclass(frozen=True)
class DragPicture:
    """A picture in parts, which the caller adds.

    Attributes
    ----------
    ghosts : ndarray, shape (H, W, 3)
    stars : tuple of DragStar
        One per light; pass their sheets to the next call.
    """

    ghosts: Pixels
    stars: tuple[DragStar, ...]

    @property
    def sheets(self) -> tuple[StarburstCanvas, ...]:
        """The starburst sheets of all lights."""
        return tuple(star.sheet for star in self.stars)

    @property
    def rest(self) -> Pixels:
        """The sum of all starbursts in the picture."""
        height, width = self.ghosts.shape[:2]
        total = black_picture(width, height)
        for star in self.stars:
            top, left = star.corner
            total += star.sheet.pixels[top : top + height, left : left + width] * np.array(star.gain, dtype=np.float32)
        return total


def moving_picture(project: Project, kept: Sequence[StarburstCanvas]) -> DragPicture | None:
    """Draw a project while the user drags a light.

    Parameters
    ----------
    project : Project
        Of draft quality.
    kept : sequence of StarburstCanvas
        The sheets of the previous picture.

    Returns
    -------
    DragPicture or None
        None if a starburst changes its shape with the light's position or lies outside the picture; use `render` then.

    Raises
    ------
    FlarewrightError
        As in `render`.

    Notes
    -----
    Tested against `render` in tests/render/preview/test_drag_preview.py.
    """
    if not _has_fixed_patterns(project):
        return None
    settled = resolve_project(project)
    # scattered light changes with the light's position
    if chosen_scatter(settled) is not None:
        return None
    art = resolve_art(settled)
    mask = _mask(settled.iris)
    shots = make_shots(settled, make_opening(settled, mask))
    stars: list[DragStar] = []
    for shot in shots:
        star = _star(settled, shot, mask, (*(star.sheet for star in stars), *kept), art.gain.get("starburst", 1.0))
        if star is None:
            return None
        stars.append(star)
    paths = ghost_paths(settled.lens, project.quality.paths, sensor=settled.sensor is not None)
    layer = render_ghosts([_as_point(shot) for shot in shots], paths, project.quality, art=art.paths).total
    art_gain = art.gain.get("ghosts", 1.0)
    ghosts = layer.pixels if art_gain == 1.0 else layer.pixels * np.float32(art_gain)
    width, height = shots[0].size_px
    if ghosts.shape[:2] != (height, width):
        x, y, w, h = layer.window
        whole = black_picture(width, height)
        whole[y : y + h, x : x + w] = ghosts
        ghosts = whole
    return DragPicture(ghosts, tuple(stars))


def _star(
    settled: ResolvedProject, shot: Shot, mask: Floats | None, kept: Sequence[StarburstCanvas], art_gain: float
) -> DragStar | None:
    """Place the starburst of a light, on a kept sheet or a new one; None if it cannot be shifted."""
    if defocus_mm(settled.lens, shot) >= OUT_OF_FOCUS_PX / float(shot.to_pixels[2:].max()):
        return None
    image = direct_image(settled.lens, shot)
    width, height = shot.size_px
    column = floor(shot.to_pixels[0] + image.position_mm[0] * shot.to_pixels[2])
    row = floor(shot.to_pixels[1] - image.position_mm[1] * shot.to_pixels[3])
    if not (-1 <= column <= width and -1 <= row <= height):
        return None
    strength = _strength(settled.lens, shot, image)
    scene = _scene(settled.project, shot.light)
    sheet = next((sheet for sheet in kept if sheet.scene == scene), None)
    if sheet is None:
        if not (strength > 0.0).all():
            return None
        sheet = StarburstCanvas(scene, _drawn(settled, shot, image, mask, (column, row)), strength)
    red, green, blue = (float(gain) for gain in art_gain * strength / sheet.strength)
    return DragStar(sheet, (height - row, width - column), (red, green, blue))


def _as_point(shot: Shot) -> Shot:
    """Replace a small disc by a point light, for ghosts."""
    return replace(shot, border=None) if _small(shot.light) else shot


def _small(light: Light) -> bool:
    return light.shape is None and light.diameter_deg <= SMALL_DEG


def _has_fixed_patterns(project: Project) -> bool:
    """Return whether the settings allow each starburst to be one pattern at every position of its light."""
    plain = project.holdout is None and all(
        light.distance is None and light.holdout is None and (_small(light) or not light.extended)
        for light in project.lights
    )
    return (
        plain and len(project.lights) <= MOST_LIGHTS and not project.starburst.cats_eye and project.output.starburst
        and not (project.dirt.in_ghosts and not project.dirt.clean)
    )  # fmt: skip


def _scene(project: Project, light: Light) -> Project:
    placed = Light(field_deg=(0.0, 0.0), spectrum=light.spectrum, diameter_deg=light.diameter_deg)
    return project.replace(lights=(placed,), art=Art(physical=project.art.physical), design=None)


def _strength(lens: Lens, shot: Shot, image: DirectImage) -> Floats:
    """Return the light's flux in each channel."""
    weights = shot.weights(shot.packed.wavelengths_nm, direct_spectrum(shot, lens))
    return np.asarray(shot.light.intensity * image.throughput_mm2 @ weights, dtype=np.float64)


def _mask(iris: Iris) -> Floats | None:
    if iris.mask is None:
        return None
    place = Path(iris.mask)
    return _read_mask(iris.mask, place.stat().st_mtime_ns if place.exists() else 0)


@lru_cache(maxsize=1)
def _read_mask(path: str, _: int) -> Floats:
    """Read a mask; the cache key contains the file's modification time."""
    return read_mask(path)


def _drawn(
    settled: ResolvedProject, shot: Shot, image: DirectImage, mask: Floats | None, pixel: tuple[int, int]
) -> Pixels:
    """Draw the starburst on a sheet, with the light in the central pixel."""
    width, height = shot.size_px
    placed = shot.to_pixels + np.array([width - pixel[0], height - pixel[1], 0.0, 0.0])
    wide = replace(shot, to_pixels=placed, size_px=(2 * width + 1, 2 * height + 1))
    soil = read_soil(settled.project.dirt)
    return np.ascontiguousarray(starburst_of(settled, (wide,), (image,), mask, soil).pixels, dtype=np.float32)
