"""Pictures of a hand that moves the light: the draft's own ghosts, and a starburst that is drawn once and moved along.

Everywhere in the picture the starburst of a distant light is one pattern (docs/diffraction.md); only its place and its
strength change. So it is drawn on a sheet with room for every place, and each picture takes its part of that: half a
pixel off at most, in a fraction of the time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import floor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..io.mask_image import read_mask
from ..model import Art, Iris, Light, Project
from ..optics.paths import ghost_paths
from .art import resolve_art
from .direct import DirectImage, defocus_mm, direct_image
from .ghosts import render_ghosts
from .prepare import Settled, settle
from .scatter import chosen_scatter
from .shot import Shot, make_opening, make_shots
from .starburst_pass import OUT_OF_FOCUS_PX, read_soil, starburst_of

Floats = NDArray[np.float32]

# texels a side of an iris that is an image, in ghosts
MASK_PX = 64

__all__ = ["Sheet", "Still", "moving_picture"]


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
class Still:
    """A picture in two parts that are added by whoever shows it.

    Attributes
    ----------
    ghosts : ndarray, shape (H, W, 3)
    sheet : Sheet
        The starburst; kept for the next picture.
    corner : tuple of int
        Row and column of the sheet that lie on the first pixel.
    gain : tuple of float
        Of the sheet, R, G, B.
    """

    ghosts: Floats
    sheet: Sheet
    corner: tuple[int, int]
    gain: tuple[float, float, float]

    @property
    def rest(self) -> Floats:
        """The starburst as it lies in the picture."""
        (top, left), (height, width) = self.corner, self.ghosts.shape[:2]
        part = self.sheet.pixels[top : top + height, left : left + width]
        return np.asarray(part * np.array(self.gain, dtype=np.float32))


def moving_picture(project: Project, kept: Sheet | None) -> Still | None:
    """Draw a project for a moving hand.

    Parameters
    ----------
    project : Project
        Of draft quality.
    kept : Sheet or None
        Of the picture before.

    Returns
    -------
    Still or None
        None where the starburst changes with the light's place, or lies elsewhere: then `render` draws it.

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
    (shot,) = make_shots(settled, make_opening(settled, mask))
    if defocus_mm(settled.lens, shot) >= OUT_OF_FOCUS_PX / float(shot.to_pixels[2:].max()):
        return None
    image = direct_image(settled.lens, shot)
    width, height = shot.size_px
    column = floor(shot.to_pixels[0] + image.position_mm[0] * shot.to_pixels[2])
    row = floor(shot.to_pixels[1] - image.position_mm[1] * shot.to_pixels[3])
    if not (-1 <= column <= width and -1 <= row <= height):
        return None
    strength = _strength(shot, image)
    scene = _scene(project)
    if kept is None or kept.scene != scene:
        if not (strength > 0.0).all():
            return None
        kept = Sheet(scene, _drawn(settled, shot, image, mask, (column, row)), strength)
    paths = ghost_paths(settled.lens, project.quality.paths, sensor=settled.sensor is not None)
    seen = shot if mask is None else replace(shot, opening=make_opening(settled, _coarse(mask)))
    layer = render_ghosts((seen,), paths, project.quality, art=art.paths).total
    by_hand = art.gain.get("ghosts", 1.0)
    ghosts = layer.pixels if by_hand == 1.0 else layer.pixels * np.float32(by_hand)
    if ghosts.shape[:2] != (height, width):
        x, y, w, h = layer.window
        whole = np.zeros((height, width, 3), dtype=np.float32)
        whole[y : y + h, x : x + w] = ghosts
        ghosts = whole
    gain = art.gain.get("starburst", 1.0) * strength / kept.strength
    return Still(ghosts, kept, (height - row, width - column), (float(gain[0]), float(gain[1]), float(gain[2])))


def _alike_everywhere(project: Project) -> bool:
    """Tell whether the starburst is one pattern wherever the light is, as far as the project itself says."""
    (light, *others) = project.lights
    plain = light.distance is None and not light.extended and light.holdout is None and project.holdout is None
    return (
        not others and plain and not project.starburst.cats_eye and project.output.starburst
        and not (project.dirt.in_ghosts and not project.dirt.clean)
    )  # fmt: skip


def _scene(project: Project) -> Project:
    (light,) = project.lights
    placed = Light(field_deg=(0.0, 0.0), spectrum=light.spectrum)
    scene: Project = project.replace(lights=(placed,), art=Art(physical=project.art.physical), design=None)
    return scene


def _strength(shot: Shot, image: DirectImage) -> NDArray[np.float64]:
    """Return the light's flux in each channel."""
    weights = shot.weights(shot.packed.wavelengths_nm)
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


def _coarse(mask: NDArray[np.float64]) -> NDArray[np.float64]:
    """Average a mask over cells, for each texel of it is a piece of every ghost."""
    cell = -(-max(mask.shape) // MASK_PX)
    rows, columns = (-(-side // cell) * cell for side in mask.shape)
    # the border goes on
    whole = np.pad(mask, ((0, rows - mask.shape[0]), (0, columns - mask.shape[1])), mode="edge")
    return np.asarray(whole.reshape(rows // cell, cell, columns // cell, cell).mean(axis=(1, 3)))


def _drawn(
    settled: Settled, shot: Shot, image: DirectImage, mask: NDArray[np.float64] | None, pixel: tuple[int, int]
) -> Floats:
    """Draw the starburst with its own pixel in the middle of a sheet."""
    width, height = shot.size_px
    placed = shot.to_pixels + np.array([width - pixel[0], height - pixel[1], 0.0, 0.0])
    wide = replace(shot, to_pixels=placed, size_px=(2 * width + 1, 2 * height + 1))
    soil = read_soil(settled.project.dirt)
    return np.ascontiguousarray(starburst_of(settled, (wide,), (image,), mask, soil).pixels, dtype=np.float32)
