"""Small pictures over the constellation: what a measured flare holds beside its ghosts, star and halo."""

from __future__ import annotations

from functools import cached_property
from math import prod
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from .base import Frozen
from .bytes_text import read_bytes, told_bytes
from .detail import Detail
from .moves import Moves
from .reaches import Reaches

# bits of a number's fraction that are kept, of the ten of a 16-bit float
_FRACTION = 4


class Sprite(Frozen):
    """Light that no ghost, star or halo explains, as pictures that change slowly over the constellation.

    Attributes
    ----------
    follows : {"light", "axis", "ghosts", "speck"}
        "light": it goes where the light's image goes and stays upright, as the star does. "axis": it stays about the
        optical axis and turns with the direction of the light, as ghosts do. "ghosts": as with "axis", and between two
        of its constellations what lies at a ghost's borders goes where these go, or as `moves` tell. "speck": it goes
        and grows with one small ghost.
    grain_px : float
        Side of a cell, pixels.
    corner_px : tuple of float
        Where the first cell begins, from the light, the axis or the middle of the speck. "light": along the rows'
        direction and at right angles to it, down when that is right; else: towards the light and at right angles to it,
        down when the light is right.
    turn_deg : float
        "light" only: direction in which rows run, counterclockwise from the right in the upright picture.
    rolls_deg : tuple of float
        Direction of the light in each picture, counterclockwise from the right when upright; not of a "speck". "light":
        the picture turns with the light from there on, about it; without rolls it stays upright. "axis" and "ghosts":
        without rolls they turn as well next to the axis, where with them what is left lies as it was photographed. What
        has rolls goes on where no photograph showed it.
    stretch : float
        Length of a cell along its row over `grain_px`.
    constellation_deg : tuple of float
        Of each picture, rising; linear between them, and beyond as at the ends; "speck": nothing beyond.
    ghost : str or None
        "speck" only: name of the ghost. Without that ghost it is not drawn.
    spread_px : tuple of float
        "speck" only: standard deviation of the ghost's lit area, towards the light and at right angles to it, where a
        cell is as large as `grain_px`; elsewhere cells are larger or smaller as these are.
    moves : Moves or None
        "ghosts" only: how what is left moves between its pictures.
    reaches : Reaches or None
        "ghosts" only: how far all light goes between its pictures, what the ghosts, the star and the other sprites show
        too. Between two pictures nothing is darker or brighter than what both show so near.
    detail : Detail or None
        Only with `moves`: what is finer than cells.
    rows, columns : int
        Cells of each picture.
    unit : float
        Radiance of 1 in `cells`.
    cells : str
        Base64 of zlib of 16-bit floats (IEEE 754) in the order picture, row, column, red-green-blue: first the upper
        byte of each, then the lower byte of each. They may be below 0.
    """

    follows: Literal["light", "axis", "ghosts", "speck"]
    grain_px: float = Field(gt=0.0)
    corner_px: tuple[float, float]
    turn_deg: float = 0.0
    rolls_deg: tuple[float, ...] = ()
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
        for what, told in (("moves", self.moves), ("reaches", self.reaches), ("detail", self.detail)):
            if told is None:
                continue
            if self.follows != "ghosts":
                raise ValueError(f'only a sprite that follows "ghosts" has {what}')
            blocks = tuple(-(-cells // told.block) for cells in (self.rows, self.columns))
            if (told.intervals, told.rows, told.columns) != (len(self.constellation_deg) - 1, *blocks):
                raise ValueError(f"the {what} of a sprite do not cover its pictures and cells")
        if self.detail is not None:
            if self.moves is None or self.detail.block != self.moves.block:
                raise ValueError("the detail of a sprite must come with moves of the same blocks")
            self.detail.check(self.rows, self.columns)
        if self.rolls_deg and (self.follows == "speck" or len(self.rolls_deg) != len(self.constellation_deg)):
            raise ValueError('the rolls of a sprite are one for each picture, and of none that follows "speck"')
        read_bytes(self.cells, self._size, "the cells of a sprite")
        return self

    @property
    def _shape(self) -> tuple[int, int, int, int]:
        return len(self.constellation_deg), self.rows, self.columns, 3

    @property
    def _size(self) -> int:
        return 2 * prod(self._shape)

    @cached_property
    def pictures(self) -> NDArray[np.float32]:
        """Radiance, shape (constellations, rows, columns, 3)."""
        whole = read_bytes(self.cells, self._size, "the cells of a sprite")
        planes = np.frombuffer(whole, np.uint8).reshape(2, -1)
        bits = (planes[0].astype(np.uint16) << 8) | planes[1]
        values: NDArray[np.float32] = bits.view(np.float16).astype(np.float32).reshape(self._shape)
        return values * np.float32(self.unit)


def packed(pictures: NDArray[np.float32], step: float) -> tuple[float, str]:
    """Return `unit` and `cells` of a sprite.

    Parameters
    ----------
    pictures : ndarray, shape (constellations, rows, columns, 3)
        Radiance.
    step : float
        Radiance to which cells are told, above 0; bright ones to 1 part in 32 if that is more.
    """
    unit = max(step, float(np.abs(pictures).max(initial=0.0)) / 32768.0)
    # bright cells make the unit larger than the step; the fractions of 16-bit floats go down to 1e-7 of it
    bits = (np.rint(pictures / step) * (step / unit)).astype(np.float16).view(np.uint16).ravel()
    # rounded to the fraction that is kept: half of its last place is added, and what is below cut off
    gone = 10 - _FRACTION
    bits = ((bits + (1 << (gone - 1))) >> gone) << gone
    planes = np.concatenate([(bits >> 8).astype(np.uint8), (bits & 0xFF).astype(np.uint8)])
    return unit, told_bytes(planes.tobytes())
