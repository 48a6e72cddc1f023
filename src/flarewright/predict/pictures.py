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


@dataclass(frozen=True)
class PictureRequest:
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


Spread = Callable[[Sequence[PictureRequest]], Generator[tuple[PictureRequest, Pixels], None, None]]
"""Draws pictures by other processes, and yields each when it is finished (`workflow.flare_pictures`)."""


def draw_all(
    requests: Sequence[PictureRequest], spread: Spread | None = None, progress: Progress | None = None
) -> list[Pixels]:
    """Draw pictures that are not drawn yet, and keep each as soon as it is finished.

    Parameters
    ----------
    requests : sequence of PictureRequest
    spread : callable, optional
        None: they are drawn here, one after the other.
    progress : callable, optional

    Returns
    -------
    list of ndarray
        In the order of the requests.
    """
    # flares that draw the same pictures share the place for them
    missing = list({(id(request.drawn), request.at): request for request in requests if request.missing}.values())
    with closing((spread or _here)(missing)) as finished:
        for k, (request, picture) in enumerate(finished):
            request.drawn[request.at] = picture
            if progress is not None:
                progress((k + 1) / len(missing), f"{request.flare.name}, {request.constellation_deg:.4g} degrees")
    return [request.drawn[request.at] for request in requests]


def _here(requests: Sequence[PictureRequest]) -> Generator[tuple[PictureRequest, Pixels], None, None]:
    for request in requests:
        yield request, request.draw()


def in_colour(flare: Flare, memory: Memory, constellation_deg: float, roll_deg: float) -> PictureRequest:
    """Return the request for a picture in colour, which belongs into a memory; into none without a fingerprint."""
    drawn = memory.setdefault(flare.fingerprint + IN_COLOUR, {}) if flare.fingerprint else {}
    return PictureRequest(flare, constellation_deg, roll_deg, True, drawn)
