"""Spikes: the deviation from the star's law is learned, predicts left-out constellations, and contains no ghosts."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import LARGEST, SIZE, views

from flarewright.measure.glow.laws import offsets, star_radiance
from flarewright.measure.residual.sprite_fit import drawn
from flarewright.measure.residual.star_spikes import spike_sprites
from flarewright.model.measurement.ghost_model import Star

ANGLES = np.linspace(1.0, LARGEST, 7)
STAR = Star(spikes=6, first_deg=20.0, width_px=1.3, radius_px=(4.0, 400.0), radiance=((9.0,) * 3, (0.2,) * 3))


def stars(angles, widening=0.06, ghost=False):
    """Return views of a star that the pupil's vignetting widens and dims, on a sloping level, without its law."""
    out = []
    for view in views((), noise=0.002, angles=angles, seed=int(angles[0] * 100)):
        place = (40.0 + 6.37 * view.constellation_deg, 78.7)
        x, y = offsets(place, SIZE, 1.0)
        wide = STAR.model_copy(update={"width_px": 1.3 + widening * view.constellation_deg})
        light = star_radiance(wide, x, y) / (1.0 + 0.02 * view.constellation_deg) - star_radiance(STAR, x, y)
        light += 0.2 + 0.001 * x[..., None]
        if ghost:
            light += 0.8 * (np.hypot(x + 3.0 * (view.constellation_deg - 12.0), y) < 9.0)[..., None]
        pixels = (view.pixels + light).astype(np.float32)
        out.append(replace(view, light_px=place, pixels=pixels))
    return out


def ridge(view):
    """Return a mask of the spikes, away from where they meet."""
    x, y = offsets(view.light_px, SIZE, 1.0)
    return (star_radiance(STAR, x, y)[..., 1] > 0.05) & (np.hypot(x, y) > 16.0)


@pytest.mark.parametrize("ghost", [pytest.param(False, marks=pytest.mark.slow), True])
def test_spikes_are_predicted_between_constellations(ghost):
    seen, between = stars(ANGLES, ghost=ghost), stars(0.5 * (ANGLES[:-1] + ANGLES[1:]))
    strips = spike_sprites(seen, [view.pixels for view in seen], STAR)
    mine = without = 0.0
    for view in between:
        x, _ = offsets(view.light_px, SIZE, 1.0)
        level = (0.2 + 0.001 * x)[..., None]
        on = ridge(view)
        mine += float(((drawn(strips, view) + level - view.pixels)[on] ** 2).sum())
        without += float(((level - view.pixels)[on] ** 2).sum())
    assert mine < 0.1 * without


def test_what_lies_beside_spikes_is_none():
    seen = stars(ANGLES[::2], widening=0.0)
    flat = [np.full(view.pixels.shape, 0.3, np.float32) for view in seen]
    strips = spike_sprites(seen, flat, STAR)
    assert max(np.abs(drawn(strips, view)).max() for view in seen) < 1e-3


def test_without_a_star_there_are_no_strips():
    seen = stars(ANGLES)
    assert spike_sprites(seen, [view.pixels for view in seen], None) == ()
    # too many spikes for strips between them
    crowded = STAR.model_copy(update={"spikes": 40})
    assert spike_sprites(seen, [view.pixels for view in seen], crowded) == ()
