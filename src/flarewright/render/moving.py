"""Pictures of a hand that moves a light: the draft's own ghosts, and starbursts that are drawn once and moved along.

Everywhere in the picture the starburst of a distant light is one pattern (docs/diffraction.md); only its place and its
strength change. So it is drawn on a sheet with room for every place, and each picture takes its part of that: half a
pixel off at most, in a fraction of the time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import floor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..io.mask_image import read_mask
from ..model import Art, Iris, Lens, Light, Project
from ..optics.paths import ghost_paths
from .art import resolve_art
from .direct import DirectImage, defocus_mm, direct_image
from .ghosts import render_ghosts
from .opening import make_opening
from .path_color import direct_spectrum
from .prepare import Settled, settle
from .scatter import chosen_scatter
from .shot import Shot
from .shots import make_shots
from .starburst_pass import OUT_OF_FOCUS_PX, read_soil, starburst_of

Floats = NDArray[np.float32]

# a picture of more lights takes long by its ghosts alone, and their sheets much memory
MOST_LIGHTS = 4

SMALL_DEG = 0.6
"""Discs up to this angle, the sun's with some room, light the ghosts of a moving picture as points do: to spread each
ghost over its own disc takes several times as long as to draw it, and softens its border by a few pixels. Their
starbursts are moved along as those of points: at another angle a disc's image is a few per cent longer."""

__all__ = ["Sheet", "Star", "Still", "moving_picture"]


@dataclass(frozen=True)
class Sheet:
    """A light's starburst with as much room to every side as a picture has.

    Attributes
    ----------
    scene : Project
        All that shapes it: the project without the light's place and strength.
    pixels : ndarray, shape (2 H + 1, 2 W + 1, 3)
        Irradiance; the light is within the pixel in the middle.
    strength : ndarray, shape (3,)
        Flux of the light that it was drawn for.
    """

    scene: Project
    pixels: Floats
    strength: NDArray[np.float64]


@dataclass(frozen=True)
class Star:
    """A light's starburst in a picture.

    Attributes
    ----------
    sheet : Sheet
    corner : tuple of int
        Row and column of the sheet that lie on the first pixel.
    gain : tuple of float
        Of the sheet, R, G, B.
    """

    sheet: Sheet
    corner: tuple[int, int]
    gain: tuple[float, float, float]


@dataclass(frozen=True)
class Still:
    """A picture in parts that are added by whoever shows it.

    Attributes
    ----------
    ghosts : ndarray, shape (H, W, 3)
    stars : tuple of Star
        One a light; their sheets are kept for the next picture.
    """

    ghosts: Floats
    stars: tuple[Star, ...]

    @property
    def sheets(self) -> tuple[Sheet, ...]:
        """The sheets of all lights."""
        return tuple(star.sheet for star in self.stars)

    @property
    def rest(self) -> Floats:
        """The starbursts as they lie in the picture."""
        height, width = self.ghosts.shape[:2]
        total = np.zeros((height, width, 3), dtype=np.float32)
        for star in self.stars:
            top, left = star.corner
            total += star.sheet.pixels[top : top + height, left : left + width] * np.array(star.gain, dtype=np.float32)
        return total


def moving_picture(project: Project, kept: Sequence[Sheet]) -> Still | None:
    """Draw a project for a moving hand.

    Parameters
    ----------
    project : Project
        Of draft quality.
    kept : sequence of Sheet
        Of the picture before.

    Returns
    -------
    Still or None
        None where a starburst changes with its light's place, or lies elsewhere: then `render` draws it.

    Raises
    ------
    FlarewrightError
        As `render`.

    Notes
    -----
    Tested against `render` in tests/render/test_moving.py.
    """
    if not _alike_everywhere(project):
        return None
    settled = settle(project)
    # what scatters depends on where the light is
    if chosen_scatter(settled) is not None:
        return None
    art = resolve_art(settled)
    mask = _mask(settled.iris)
    shots = make_shots(settled, make_opening(settled, mask))
    stars: list[Star] = []
    for shot in shots:
        star = _star(settled, shot, mask, (*(star.sheet for star in stars), *kept), art.gain.get("starburst", 1.0))
        if star is None:
            return None
        stars.append(star)
    paths = ghost_paths(settled.lens, project.quality.paths, sensor=settled.sensor is not None)
    layer = render_ghosts([_as_a_point(shot) for shot in shots], paths, project.quality, art=art.paths).total
    by_hand = art.gain.get("ghosts", 1.0)
    ghosts = layer.pixels if by_hand == 1.0 else layer.pixels * np.float32(by_hand)
    width, height = shots[0].size_px
    if ghosts.shape[:2] != (height, width):
        x, y, w, h = layer.window
        whole = np.zeros((height, width, 3), dtype=np.float32)
        whole[y : y + h, x : x + w] = ghosts
        ghosts = whole
    return Still(ghosts, tuple(stars))


def _star(
    settled: Settled, shot: Shot, mask: NDArray[np.float64] | None, kept: Sequence[Sheet], by_hand: float
) -> Star | None:
    """Place the starburst of a light: a sheet that is kept, or a new one; None where it cannot be moved along."""
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
        sheet = Sheet(scene, _drawn(settled, shot, image, mask, (column, row)), strength)
    red, green, blue = (float(gain) for gain in by_hand * strength / sheet.strength)
    return Star(sheet, (height - row, width - column), (red, green, blue))


def _as_a_point(shot: Shot) -> Shot:
    """Let a small disc light ghosts from its middle alone."""
    return replace(shot, border=None) if _small(shot.light) else shot


def _small(light: Light) -> bool:
    return light.shape is None and light.diameter_deg <= SMALL_DEG


def _alike_everywhere(project: Project) -> bool:
    """Tell whether each starburst is one pattern wherever its light is, as far as the project itself says."""
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
    scene: Project = project.replace(lights=(placed,), art=Art(physical=project.art.physical), design=None)
    return scene


def _strength(lens: Lens, shot: Shot, image: DirectImage) -> NDArray[np.float64]:
    """Return the light's flux in each channel."""
    weights = shot.weights(shot.packed.wavelengths_nm, direct_spectrum(shot, lens))
    return np.asarray(shot.light.intensity * image.throughput_mm2 @ weights, dtype=np.float64)


def _mask(iris: Iris) -> NDArray[np.float64] | None:
    if iris.mask is None:
        return None
    place = Path(iris.mask)
    return _read_mask(iris.mask, place.stat().st_mtime_ns if place.exists() else 0)


@lru_cache(maxsize=1)
def _read_mask(path: str, _: int) -> NDArray[np.float64]:
    """Read a mask once, and anew when its file has changed."""
    return read_mask(path)


def _drawn(
    settled: Settled, shot: Shot, image: DirectImage, mask: NDArray[np.float64] | None, pixel: tuple[int, int]
) -> Floats:
    """Draw the starburst with its own pixel in the middle of a sheet."""
    width, height = shot.size_px
    placed = shot.to_pixels + np.array([width - pixel[0], height - pixel[1], 0.0, 0.0])
    wide = replace(shot, to_pixels=placed, size_px=(2 * width + 1, 2 * height + 1))
    soil = read_soil(settled.project.dirt)
    return np.ascontiguousarray(starburst_of(settled, (wide,), (image,), mask, soil).pixels, dtype=np.float32)
