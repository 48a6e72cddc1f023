"""A second light in the picture: it stays where it is in the room while the camera turns, and no ghost does."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, radians, sin

import numpy as np

from .geometry import Geometry
from .light import Sighting, two_lights

# what stays where it is, in the room or in the picture, to so many pixels or to this part of the light's way, in so
# large a part of the frames that show it
_STAYS_PX, _STAYS, _MOSTLY = 2.0, 0.05, 0.8
# is no ghost: beside the line from axis to light by this part of the width in two frames, or anywhere in three while
# the light goes so far; ghosts lie on that line, and a tenth of the width from the light they go at another pace
_BESIDE, _WAY = 0.1, 0.3
# cosine from which on a direction counts as ahead of the camera
_AHEAD = 0.1


def refuse_second_light(sightings: Sequence[Sighting], geometry: Geometry) -> None:
    """Refuse a run with a second light, however faint beside the first.

    Parameters
    ----------
    sightings : sequence of Sighting
        Of all frames of a run.
    geometry : Geometry
        Of the same frames.

    Raises
    ------
    FlarewrightError
        When a bright spot stays where it is in the room while the camera turns, or in the picture beside the line from
        axis to light, where no ghost is.
    """
    both = zip(sightings, geometry.placed, strict=True)
    shown = [(one, placed) for one, placed in both if placed.light_found and one.other_px is not None]
    if len(shown) < 2:
        return
    focal = geometry.px_per_rad
    along = np.array([(cos(radians(placed.roll_deg)), -sin(radians(placed.roll_deg))) for _, placed in shown])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    turned = np.radians([placed.constellation_deg for _, placed in shown])
    spots = np.array([one.other_px for one, _ in shown]) - geometry.axis_px
    x, beside = (spots * along).sum(axis=1), (spots * across).sum(axis=1)
    # as the camera would see it if it were turned back to the light, unless it would be beside the camera then
    depth = x * np.sin(turned) + focal * np.cos(turned)
    ahead = depth > _AHEAD * focal
    depth = np.maximum(depth, _AHEAD * focal)
    room = focal * np.stack([x * np.cos(turned) - focal * np.sin(turned), beside], axis=1) / depth[:, None]
    way = focal * np.tan(turned)
    width = 2.0 * max(geometry.axis_px[0], 1.0)
    off = np.abs(beside) > _BESIDE * width
    for places, chosen, least in ((room, off & ahead, 2), (spots, off, 2), (room, ahead, 3)):
        if chosen.sum() < least:
            continue
        span = float(np.ptp(way[chosen]))
        far = np.hypot(*(places[chosen] - np.median(places[chosen], axis=0)).T)
        if (far < max(_STAYS_PX, _STAYS * span)).mean() < _MOSTLY or (least > 2 and span < _WAY * width):
            continue
        one, placed = shown[int(np.flatnonzero(chosen)[0])]
        raise two_lights(one, one.other_px, f"the frame at {placed.constellation_deg:.1f} deg")
