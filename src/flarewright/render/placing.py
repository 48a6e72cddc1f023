"""Remarks on where the light stands: outside the picture, or so that almost all of it becomes one veil."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model import Layer
from ..optics.border import points
from .direct import DirectImage
from .shot import Shot

# of an even picture the brightest hundredth is less than so many times as bright as the median
EVEN = 1.5
# so many lights are told one by one
MOST = 3

__all__ = ["outside", "veiled"]


def outside(shots: Sequence[Shot], images: Sequence[DirectImage]) -> list[str]:
    """Say which lights are imaged outside the picture, and how far.

    Parameters
    ----------
    shots : sequence of Shot
        All parts of all lights.
    images : sequence of DirectImage
        One a shot.

    Returns
    -------
    list of str
    """
    lights: dict[int, list[tuple[Shot, DirectImage]]] = {}
    for shot, image in zip(shots, images, strict=True):
        if np.isfinite(image.position_mm).all():
            lights.setdefault(shot.number, []).append((shot, image))
    places = {number: _beyond(parts) for number, parts in lights.items()}
    told = [
        f"{'the light' if len(places) == 1 else f'light {number} (counted from 0)'} is {place} the picture"
        for number, place in places.items()
        if place
    ]
    return told if len(told) <= MOST else [*told[:MOST], f"{len(told) - MOST} more lights are outside the picture"]


def _beyond(parts: Sequence[tuple[Shot, DirectImage]]) -> str:
    """Say how far beyond the borders a light lies, by the part of it that lies nearest; nothing when it is inside."""
    nearest: tuple[float, str] | None = None
    for shot, image in parts:
        width, height = shot.size_px
        per_mm = np.array([shot.to_pixels[2], -shot.to_pixels[3]])
        x, y = np.asarray(image.position_mm) * per_mm + shot.to_pixels[:2]
        # how far an area light reaches to each side, in the middle of the field
        reach = np.zeros((1, 2))
        if shot.border is not None:
            reach = points(shot.border) * shot.packed.first_order.efl * per_mm
        (left, up), (right, down) = reach.min(axis=0), reach.max(axis=0)
        far_out = {
            "left of": -x - right,
            "right of": x + left - width,
            "above": -y - down,
            "below": y + up - height,
        }
        beyond = [(side, float(far)) for side, far in far_out.items() if far > 0.0]
        far = max((far for _, far in beyond), default=0.0)
        words = " and ".join(f"{max(round(far), 1)} px {side}" for side, far in beyond)
        if nearest is None or far < nearest[0]:
            nearest = far, words
    return nearest[1] if nearest is not None else ""


def veiled(ghosts: Layer) -> list[str]:
    """Say when a picture's ghosts are one even veil, in which nothing is seen.

    Parameters
    ----------
    ghosts : Layer
        All of them.

    Returns
    -------
    list of str
    """
    if ghosts.pixels.size == 0:
        return []
    light = ghosts.pixels.max(axis=-1)
    median, bright = np.percentile(light, [50.0, 99.0])
    if not median > 0.0 or bright > EVEN * median:
        return []
    return ["the ghosts are almost one even veil over the picture: stop down (--fstop) or move the light to see shapes"]
