"""Sprites: small pictures over the constellation that hold the residual light of a measured flare."""

from __future__ import annotations

from functools import cached_property
from math import prod
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from ...typing import Pixels
from ..base import Frozen
from ..bytes_text import decode_bytes, encode_bytes
from .clamp_ranges import Reaches
from .fine_detail import Detail
from .residual_motion import Moves

# mantissa bits that are kept, of the ten of a 16-bit float
_FRACTION = 4


class Sprite(Frozen):
    """Residual light that no ghost, star or halo explains, as pictures that change slowly over the constellation.

    Attributes
    ----------
    follows : {"light", "axis", "ghosts", "speck"}
        "light": moves with the light's image and stays upright, as the star does. "axis": centred on the optical axis,
        turns with the direction of the light, as ghosts do. "ghosts": as "axis"; between two of its constellations it
        moves as `moves` gives. "speck": a blob, moves and scales with one small ghost.
    grain_px : float
        Side of a cell, pixels.
    corner_px : tuple of float
        Corner of the first cell relative to the light, the axis or the ghost's centre. "light": along the rows and
        perpendicular to them (down when rows run to the right). Otherwise: towards the light and perpendicular to that
        (down when the light is on the right).
    turn_deg : float
        "light" only: direction of the rows, counterclockwise from the right in the upright picture.
    rolls_deg : tuple of float
        Direction of the light in each picture, counterclockwise from the right in the upright picture; not for
        blobs. "light": with rolls, the picture also turns with the light, about the light; without, it stays
        upright. "axis" and "ghosts": without rolls, the residual turns next to the axis as well; with rolls, it stays
        as photographed there.
    captured_roll_deg : float or None
        Nominal roll of the captures that it was learned from, where those of several rolls were; of these series of
        sprites, only one is drawn. None: always drawn.
    stretch : float
        Length of a cell along its row relative to `grain_px`.
    constellation_deg : tuple of float
        Constellation of each picture, ascending; linear between them, constant beyond the ends (blobs: zero beyond).
    ghost : str or None
        Blobs only: name of its ghost. The sprite is drawn only with that ghost.
    spread_px : tuple of float
        Blobs only: standard deviation of the ghost's light, towards the light and perpendicular to it, at which a
        cell has the size `grain_px`; cells scale with the ghost.
    moves : Moves or None
        "ghosts" only: motion of the residual between its pictures.
    reaches : Reaches or None
        "ghosts" only: range within which all light moves between its pictures, ghosts, star and other sprites included.
        An interpolated value stays between the extremes of both pictures within this range.
    detail : Detail or None
        Only with `moves`: detail finer than the cells.
    rows, columns : int
        Number of cells of each picture.
    unit : float
        Radiance that the value 1 in `cells` encodes.
    cells : str
        Base64 of zlib of 16-bit floats (IEEE 754) in the order picture, row, column, red-green-blue: first the upper
        byte of each, then the lower byte of each. Values can be negative.
    """

    follows: Literal["light", "axis", "ghosts", "speck"]
    grain_px: float = Field(gt=0.0)
    corner_px: tuple[float, float]
    turn_deg: float = 0.0
    rolls_deg: tuple[float, ...] = ()
    captured_roll_deg: float | None = None
    stretch: float = Field(default=1.0, gt=0.0)
    ghost: str | None = None
    spread_px: tuple[Annotated[float, Field(gt=0.0)], Annotated[float, Field(gt=0.0)]] = (1.0, 1.0)
    constellation_deg: tuple[float, ...] = Field(min_length=1)
    moves: Moves | None = None
    reaches: Reaches | None = None
    detail: Detail | None = None
    rows: int = Field(ge=1)
    columns: int = Field(ge=1)
    unit: float = Field(gt=0.0)
    cells: str

    @model_validator(mode="after")
    def _fits(self) -> Sprite:
        if any(b <= a for a, b in zip(self.constellation_deg, self.constellation_deg[1:], strict=False)):
            raise ValueError("the constellations of a sprite must rise")
        if (self.follows == "speck") != (self.ghost is not None):
            raise ValueError('a sprite names a ghost if it follows "speck", and only then')
        for what, part in (("moves", self.moves), ("reaches", self.reaches), ("detail", self.detail)):
            if part is None:
                continue
            if self.follows != "ghosts":
                raise ValueError(f'only a sprite that follows "ghosts" has {what}')
            blocks = tuple(-(-cells // part.block) for cells in (self.rows, self.columns))
            if (part.intervals, part.rows, part.columns) != (len(self.constellation_deg) - 1, *blocks):
                raise ValueError(f"the {what} of a sprite do not cover its pictures and cells")
        if self.detail is not None:
            if self.moves is None or self.detail.block != self.moves.block:
                raise ValueError("the detail of a sprite must come with moves of the same blocks")
            self.detail.check(self.rows, self.columns)
        if self.rolls_deg and (self.follows == "speck" or len(self.rolls_deg) != len(self.constellation_deg)):
            raise ValueError('the rolls of a sprite are one for each picture, and of none that follows "speck"')
        decode_bytes(self.cells, self._size, "the cells of a sprite")
        return self

    @property
    def _shape(self) -> tuple[int, int, int, int]:
        return len(self.constellation_deg), self.rows, self.columns, 3

    @property
    def _size(self) -> int:
        return 2 * prod(self._shape)

    @cached_property
    def pictures(self) -> Pixels:
        """Radiance, shape (constellations, rows, columns, 3)."""
        whole = decode_bytes(self.cells, self._size, "the cells of a sprite")
        planes = np.frombuffer(whole, np.uint8).reshape(2, -1)
        bits = (planes[0].astype(np.uint16) << 8) | planes[1]
        values: Pixels = bits.view(np.float16).astype(np.float32).reshape(self._shape)
        return values * np.float32(self.unit)


def encode_pictures(pictures: Pixels, step: float) -> tuple[float, str]:
    """Return `unit` and `cells` of a sprite that encode these pictures.

    Parameters
    ----------
    pictures : ndarray, shape (constellations, rows, columns, 3)
        Radiance.
    step : float
        Quantization step of the radiance, above 0; bright cells have a relative step of 1/32 where that is larger.
    """
    unit = max(step, float(np.abs(pictures).max(initial=0.0)) / 32768.0)
    # bright cells make the unit larger than the step; 16-bit floats have fractions down to 1e-7 of the unit
    bits = (np.rint(pictures / step) * (step / unit)).astype(np.float16).view(np.uint16).ravel()
    # round to the mantissa bits that are kept: add half of the last place, then truncate
    dropped = 10 - _FRACTION
    kept = ((bits + (1 << (dropped - 1))) >> dropped) << dropped
    planes = np.concatenate([(kept >> 8).astype(np.uint8), (kept & 0xFF).astype(np.uint8)])
    return unit, encode_bytes(planes.tobytes())
