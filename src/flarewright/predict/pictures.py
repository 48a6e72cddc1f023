"""Pictures of flares: each is drawn once, here or by other processes."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, field

import numpy as np

from ..typing import Pixels, Progress
from .flare import Flare, luminance

Drawn = dict[tuple[float, float], Pixels]
Memory = dict[str, Drawn]
"""Drawn pictures, by the flare's fingerprint, then by (constellation, roll) in degrees.

Luminance; in colour for a fingerprint with `IN_COLOUR`.
"""
IN_COLOUR = "-rgb"

__all__ = ["Drawn", "Memory", "Spread", "Wish", "draw_all", "in_colour"]


@dataclass(frozen=True)
class Wish:
    """A picture that a prediction needs.

    Attributes
    ----------
    flare : Flare
    constellation_deg, roll_deg : float
    colored : bool
        False: luminance.
    drawn : dict
        Pictures of this flare, among which it belongs.
    """

    flare: Flare
    constellation_deg: float
    roll_deg: float
    colored: bool = False
    drawn: Drawn = field(default_factory=dict, compare=False, repr=False)

    def draw(self) -> Pixels:
        """Draw the picture, shape (H, W), or (H, W, 3) in colour."""
        picture = self.flare.picture(self.constellation_deg, self.roll_deg)
        return picture if self.colored else luminance(picture).astype(np.float32)

    @property
    def missing(self) -> bool:
        """Whether it is not drawn yet."""
        return self.at not in self.drawn

    @property
    def at(self) -> tuple[float, float]:
        """Constellation and roll, degrees: its key in `drawn`."""
        return self.constellation_deg, self.roll_deg


Spread = Callable[[Sequence[Wish]], Generator[tuple[Wish, Pixels], None, None]]
"""Draws pictures by other processes, and yields each when it is finished (`workflow.flare_pictures`)."""


def draw_all(wishes: Sequence[Wish], spread: Spread | None = None, progress: Progress | None = None) -> list[Pixels]:
    """Draw pictures that are not drawn yet, and keep each as soon as it is finished.

    Parameters
    ----------
    wishes : sequence of Wish
    spread : callable, optional
        None: they are drawn here, one after the other.
    progress : callable, optional

    Returns
    -------
    list of ndarray
        In the order of the wishes.
    """
    # flares that draw the same pictures share the place for them
    missing = list({(id(wish.drawn), wish.at): wish for wish in wishes if wish.missing}.values())
    with closing((spread or _here)(missing)) as finished:
        for k, (wish, picture) in enumerate(finished):
            wish.drawn[wish.at] = picture
            if progress is not None:
                progress((k + 1) / len(missing), f"{wish.flare.name}, {wish.constellation_deg:.4g} degrees")
    return [wish.drawn[wish.at] for wish in wishes]


def _here(wishes: Sequence[Wish]) -> Generator[tuple[Wish, Pixels], None, None]:
    for wish in wishes:
        yield wish, wish.draw()


def in_colour(flare: Flare, memory: Memory, constellation_deg: float, roll_deg: float) -> Wish:
    """Return the wish for a picture in colour, which belongs into a memory; into none without a fingerprint."""
    drawn = memory.setdefault(flare.fingerprint + IN_COLOUR, {}) if flare.fingerprint else {}
    return Wish(flare, constellation_deg, roll_deg, True, drawn)
