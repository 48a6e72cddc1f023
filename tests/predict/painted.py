"""A flare of closed form as a reference for predictions: a moving, fading disc, and a spot at one constellation."""

import numpy as np

from flarewright.model import Layer
from flarewright.predict.flare import Flare, Frame

SIDE_MM = 50.0


def disc_light(constellation_deg):
    """Return the irradiance of the disc, which halves every ten degrees."""
    return 1e-3 * 0.5 ** (constellation_deg / 10.0)


def painted(side_px=200, *, turns_by_deg=0.0, peak_deg=None, size=(SIDE_MM, SIDE_MM)):
    """Return a flare: a disc of 6 mm radius opposite to the light, and at one constellation a bright middle."""
    width, height = side_px, max(1, round(side_px * size[1] / size[0]))
    x = ((np.arange(width) + 0.5) / width - 0.5) * size[0]
    y = (0.5 - (np.arange(height) + 0.5) / height)[:, None] * size[1]

    def draw(constellation_deg, roll_deg):
        away = 0.2 * constellation_deg
        at = -away * np.cos(np.radians(roll_deg)), -away * np.sin(np.radians(roll_deg))
        light = disc_light(constellation_deg) * (np.hypot(x - at[0], y - at[1]) < 6.0)
        if peak_deg is not None:
            light = light + 0.1 * np.exp(-(((constellation_deg - peak_deg) / 3.0) ** 2)) * (np.hypot(x, y) < 1.0)
        pixels = np.repeat(light[..., None], 3, axis=2).astype(np.float32)
        direct = np.full((1, 1, 3), 1e6, dtype=np.float32)
        return Layer("ghosts", pixels, (0, 0, width, height)), Layer("starburst", direct, (0, 0, 1, 1))

    return Flare(
        name="painted", draw=draw, size_px=(width, height), sensor=Frame(*size), f_number=4.0, scene_scale=0.05,
        turns_by_deg=turns_by_deg, reach_deg=60.0,
    )  # fmt: skip
