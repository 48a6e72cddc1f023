"""Remarks on badly placed lights: outside the picture, or where nearly all ghosts merge into one veil."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model import Layer
from ...optics.colour.rgb import brightest_channel
from ...optics.pupil.polygon import points
from .direct_image import DirectImage
from .shot import Shot

# in a uniform picture, the 99th percentile is less than this many times the median
UNIFORM_RATIO = 1.5
# rows or columns, whichever are fewer, that percentiles are taken from
_SAMPLED_ROWS = 32
# largest number of lights listed separately
MOST_LISTED = 3


def outside_remarks(shots: Sequence[Shot], images: Sequence[DirectImage]) -> list[str]:
    """Return remarks on lights that are imaged outside the picture.

    Parameters
    ----------
    shots : sequence of Shot
        All parts of all lights.
    images : sequence of DirectImage
        One per shot.
    """
    lights: dict[int, list[tuple[Shot, DirectImage]]] = {}
    for shot, image in zip(shots, images, strict=True):
        if np.isfinite(image.position_mm).all():
            lights.setdefault(shot.number, []).append((shot, image))
    places = {number: _outside_text(parts) for number, parts in lights.items()}
    remarks = [
        f"{'the light' if len(places) == 1 else f'light {number} (counted from 0)'} is {place} the picture"
        for number, place in places.items()
        if place
    ]
    return (
        remarks
        if len(remarks) <= MOST_LISTED
        else [*remarks[:MOST_LISTED], f"{len(remarks) - MOST_LISTED} more lights are outside the picture"]
    )


def _outside_text(parts: Sequence[tuple[Shot, DirectImage]]) -> str:
    """Describe how far outside a light lies, by its nearest part; empty if it lies inside."""
    nearest: tuple[float, str] | None = None
    for shot, image in parts:
        width, height = shot.size_px
        per_mm = np.array([shot.to_pixels[2], -shot.to_pixels[3]])
        x, y = np.asarray(image.position_mm) * per_mm + shot.to_pixels[:2]
        # extent of an area light to each side, at the centre of the field
        reach = np.zeros((1, 2))
        if shot.border is not None:
            reach = points(shot.border) * shot.packed.first_order.efl * per_mm
        (left, up), (right, down) = reach.min(axis=0), reach.max(axis=0)
        far_out = {"left of": -x - right, "right of": x + left - width, "above": -y - down, "below": y + up - height}
        beyond = [(side, float(far)) for side, far in far_out.items() if far > 0.0]
        far = max((far for _, far in beyond), default=0.0)
        words = " and ".join(f"{max(round(far), 1)} px {side}" for side, far in beyond)
        if nearest is None or far < nearest[0]:
            nearest = far, words
    return nearest[1] if nearest is not None else ""


def veil_remarks(ghosts: Layer) -> list[str]:
    """Return a remark if a picture's ghosts are one uniform veil.

    Parameters
    ----------
    ghosts : Layer
        The layer of all ghosts.
    """
    if ghosts.pixels.size == 0:
        return []
    # percentiles of all pixels would take a twentieth of a draft
    step = max(1, min(ghosts.pixels.shape[:2]) // _SAMPLED_ROWS)
    light = brightest_channel(ghosts.pixels[::step, ::step])
    median, bright = np.percentile(light, [50.0, 99.0])
    if not median > 0.0 or bright > UNIFORM_RATIO * median:
        return []
    return ["the ghosts are almost one even veil over the picture: stop down or move the light to see shapes"]
