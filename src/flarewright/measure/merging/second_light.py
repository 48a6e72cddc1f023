"""Detect a second light source: it is fixed in the room while the camera turns, and no ghost is."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, radians, sin

import numpy as np

from .camera_geometry import Geometry
from .light_position import LightSighting, two_lights
from .settings import LightSettings


def refuse_second_light(
    sightings: Sequence[LightSighting], geometry: Geometry, settings: LightSettings = LightSettings()
) -> None:
    """Raise when a run shows a second light source, however faint.

    Parameters
    ----------
    sightings : sequence of LightSighting
        Sightings in all frames of a run.
    geometry : Geometry
        Geometry of the same frames.
    settings : LightSettings

    Raises
    ------
    FlarewrightError
        When a bright spot is fixed in the room while the camera turns, or fixed in the picture beside the line from
        axis to light, where ghosts are not.
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
    # position as seen by a camera turned back to the light; skip spots that would be beside the camera then
    depth = x * np.sin(turned) + focal * np.cos(turned)
    ahead = depth > settings.ahead * focal
    depth = np.maximum(depth, settings.ahead * focal)
    room = focal * np.stack([x * np.cos(turned) - focal * np.sin(turned), beside], axis=1) / depth[:, None]
    way = focal * np.tan(turned)
    width = 2.0 * max(geometry.axis_px[0], 1.0)
    off = np.abs(beside) > settings.beside * width
    for places, chosen, least in ((room, off & ahead, 2), (spots, off, 2), (room, ahead, 3)):
        if chosen.sum() < least:
            continue
        span = float(np.ptp(way[chosen]))
        far = np.hypot(*(places[chosen] - np.median(places[chosen], axis=0)).T)
        if (far < max(settings.scatter_px, settings.scatter * span)).mean() < settings.least_agreeing or (
            least > 2 and span < settings.least_motion * width
        ):
            continue
        one, placed = shown[int(np.flatnonzero(chosen)[0])]
        raise two_lights(one, one.other_px, f"the frame at {placed.constellation_deg:.1f} deg")
