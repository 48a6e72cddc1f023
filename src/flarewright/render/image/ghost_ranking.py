"""Which ghosts are the brightest at each pixel, found from one ghost after the other.

The memory does not depend on the number of ghosts: each is drawn, ranked and forgotten.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...model import Layer
from ...model.layer import part_inside
from ...model.matte import GhostMatte
from ...model.project.camera import Colorspace
from ...optics.colour.rgb import luminance_weights
from ...typing import Floats, Pixels
from .compose import beauty

RANK_BYTES = 8
"""Memory of one rank of a pixel."""

# mean part of a pixel's light that the ranks hold, below which a remark says so
_ENOUGH = 0.95
# rows that are ranked together: a few megabytes of intermediate values
_STRIP = 64


class GhostRanking:
    """The brightest objects of each pixel so far.

    Parameters
    ----------
    size_px : tuple of int
        Width and height of the picture.
    ranks : int
        Objects that a pixel keeps.
    """

    def __init__(self, size_px: tuple[int, int], ranks: int) -> None:
        width, height = size_px
        self._numbers: dict[str, int] = {}
        self._objects = np.full((ranks, height, width), -1, dtype=np.int32)
        self._light = np.zeros((ranks, height, width), dtype=np.float32)

    def add(self, name: str, light: Pixels, window: tuple[int, int, int, int]) -> None:
        """Rank a new object; of equal ones the first is kept before the later.

        Parameters
        ----------
        name : str
        light : ndarray, shape (h, w)
            Luminance; values that are not above 0 are left out.
        window : tuple of int
            x, y, width and height of `light` in the picture; what lies outside is left out.
        """
        number = self._numbers.setdefault(name, len(self._numbers))
        x, y, *_ = window
        _, height, width = self._light.shape
        left, top, right, bottom = part_inside(window, (width, height))
        for start in range(top, bottom, _STRIP):
            rows = slice(start, min(start + _STRIP, bottom))
            seen = light[rows.start - y : rows.stop - y, left - x : max(right, left) - x]
            held, whose = self._light[:, rows, left:right], self._objects[:, rows, left:right]
            _insert(held, whose, seen, np.full(seen.shape, number, dtype=np.int32))

    def merge(self, matte: GhostMatte) -> None:
        """Add the objects of another matte of the same size: the light of one that is there already adds up.

        Parameters
        ----------
        matte : GhostMatte
            Light without a rank in it is not known by object, and is left out.
        """
        # the last one stands for no object
        own = [*(self._numbers.setdefault(name, len(self._numbers)) for name in matte.names), -1]
        number: NDArray[np.int32] = np.array(own, dtype=np.int32)
        for start in range(0, self._light.shape[1], _STRIP):
            rows = slice(start, start + _STRIP)
            held, whose = self._light[:, rows], self._objects[:, rows]
            for light, objects in zip(matte.light[:, rows], number[matte.objects[:, rows]], strict=True):
                known = (whose == objects) & (objects >= 0)
                held += np.where(known, light, np.float32(0.0))
                _insert(held, whose, np.where(known.any(axis=0), np.float32(0.0), light), objects)
            order = np.argsort(-held, axis=0, kind="stable")
            held[:] = np.take_along_axis(held, order, axis=0)
            whose[:] = np.take_along_axis(whose, order, axis=0)

    def matte(self, total: Pixels, ranks: int | None = None, factor: float = 1.0) -> GhostMatte:
        """Return the matte of the objects so far.

        Parameters
        ----------
        total : ndarray, shape (height, width)
            Luminance of the whole picture, after the factor.
        ranks : int, optional
            Of the matte; None: all that are kept.
        factor : float
            Of the light of all objects.
        """
        light = self._light[:ranks] * np.float32(factor)
        objects = np.where(light > 0.0, self._objects[:ranks], np.int32(-1))
        # rounding must not give an object more light than the picture has
        whole = np.maximum(total, light.sum(axis=0))
        return GhostMatte(tuple(self._numbers), objects, light, whole.astype(np.float32, copy=False))

    def scale(self, factor: float) -> None:
        """Multiply the light of all objects so far."""
        self._light *= np.float32(factor)


def _insert(held: Pixels, whose: NDArray[np.int32], light: Pixels, objects: NDArray[np.int32]) -> None:
    """Insert an object a pixel into sorted ranks of shape (ranks, h, w), in place, where its light has a rank."""
    taken = light > held[-1]
    if not taken.any():
        return
    taken[:] = False
    for row, own in zip(held, whose, strict=True):
        # what an object displaces displaces the next one, also an equally bright one: the order of equal ones stays
        taken |= light > row
        if not taken.any():
            continue
        below, under = np.where(taken, row, light), np.where(taken, own, objects)
        np.copyto(row, light, where=taken)
        np.copyto(own, objects, where=taken)
        light, objects = below, under


def luminance_of(pixels: Pixels | Floats, colorspace: Colorspace) -> Pixels:
    """Return the luminance of linear pixels of shape (H, W, 3), shape (H, W), float32."""
    return np.asarray(pixels @ luminance_weights(colorspace).astype(pixels.dtype), dtype=np.float32)


def rank_remarks(matte: GhostMatte) -> tuple[str, ...]:
    """Return a remark on light whose objects have no rank, if it is a noticeable part."""
    lit = matte.total > 0.0
    held = float(matte.coverage.sum(axis=0)[lit].mean()) if lit.any() else 1.0
    if held >= _ENOUGH:
        return ()
    return (
        f"the matte's {len(matte.light)} ghosts a pixel have {held:.0%} of its light on average, and its others are in "
        "no matte: --matte-ranks keeps more",
    )


def ghost_matte(
    ranking: GhostRanking, passes: Sequence[Layer], size_px: tuple[int, int], colorspace: Colorspace, gain: float
) -> GhostMatte:
    """Return the matte of ranked ghosts among the other passes of a picture, which become objects of their own.

    Parameters
    ----------
    ranking : GhostRanking
        With all ghosts; changed.
    passes : sequence of Layer
        That add up to the picture.
    size_px : tuple of int
        Width and height.
    colorspace : {"rec709", "acescg"}
    gain : float
        Of all ghosts, which `passes` have and `ranking` lacks.
    """
    ranking.scale(gain)
    for layer in passes:
        if not layer.name.startswith("ghosts"):
            ranking.add(layer.name, luminance_of(layer.pixels, colorspace), layer.window)
    return ranking.matte(luminance_of(beauty(passes, size_px).pixels, colorspace))
