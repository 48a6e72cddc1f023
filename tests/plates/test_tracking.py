"""Sources over time: those near the threshold do not flicker, lamps that are switched on are there at once."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.plates.detection import find_sources
from flarewright.plates.tracking import follow, steady

ROWS, COLUMNS = np.mgrid[:60, :80] + 0.5
THRESHOLD = 1.0


def blob(x, y, peak, width=3.0):
    bright = peak * np.exp(-((COLUMNS - x) ** 2 + (ROWS - y) ** 2) / (2.0 * width**2))
    return np.repeat(bright[..., None], 3, axis=2).astype(np.float32)


def tracked(plates, fade=4):
    found = [find_sources(pixels, THRESHOLD) for pixels in plates]
    return steady(follow(range(1, len(plates) + 1), found, 80), THRESHOLD, 1.0, fade)


def brightness(tracks):
    return tracks.light.sum(axis=(0, 2))


def spread(values):
    return float(np.std(values) / np.mean(values))


def test_a_lamp_that_flickers_near_the_threshold_gives_steady_light():
    peaks = 1.35 * np.random.default_rng(5).uniform(0.7, 1.3, 60)
    plates = [blob(40, 30, peak) for peak in peaks]
    light = brightness(tracked(plates))[5:-5]
    # sources that a stop above the threshold begin, and count in full, as a plain search has them
    hard = np.array([find_sources(p, THRESHOLD).light.sum() if p.max() > 1.35 else 0.0 for p in plates])[5:-5]
    assert (light > 0.0).all()
    assert spread(light) < 0.6 * spread(hard)
    # in the unit of the lamp itself the flare changes no more than the lamp
    own = np.array([plate.sum() for plate in plates])[5:-5]
    assert np.std(light) < np.std(own)


def test_a_lamp_that_vanishes_for_a_moment_near_the_threshold_is_carried_over():
    peaks = np.full(20, 1.6)
    peaks[9:11] = 0.9
    tracks = tracked([blob(20 + k, 30, peak) for k, peak in enumerate(peaks)])
    assert len(tracks) == 1
    light = brightness(tracks)
    assert light[9:11] == pytest.approx(light[8], rel=0.02)
    assert tracks.centre_px[0, 9:11, 0] == pytest.approx([29, 30], abs=0.1)


def test_a_slow_lamp_fades_in_and_a_switched_one_is_there_at_once():
    slow = brightness(tracked([blob(40.3, 30.2, peak) for peak in np.linspace(0.8, 3.0, 40)]))
    assert np.abs(np.diff(slow)).max() < 0.1 * slow.max()
    lit = [blob(40, 30, 50.0 if 10 <= k < 20 else 0.0) for k in range(30)]
    light = brightness(tracked(lit))
    full = find_sources(lit[10], THRESHOLD).light.sum()
    assert light[10:20] == pytest.approx(full, rel=1e-6)
    assert light[:10] == pytest.approx(0.0)
    assert light[20:] == pytest.approx(0.0)


def test_bright_lamps_keep_their_light_and_their_names_where_they_cross():
    plates = [blob(10 + 3 * k, 20, 50.0) + blob(70 - 3 * k, 40, 20.0) for k in range(20)]
    found = [find_sources(pixels, THRESHOLD) for pixels in plates]
    tracks = steady(follow(range(20), found, 80), THRESHOLD, 1.0, 4)
    assert len(tracks) == 2
    assert brightness(tracks) == pytest.approx([each.light.sum() for each in found])
    steps = np.diff(tracks.centre_px[..., 0], axis=1)
    assert np.sign(steps).std(axis=1) == pytest.approx(0.0)


def test_without_fade_and_in_a_still_the_sources_are_as_found():
    plates = [blob(40, 30, peak) for peak in (1.1, 1.6, 1.1)]
    sums = [find_sources(pixels, THRESHOLD).light.sum() for pixels in plates]
    assert brightness(tracked(plates, fade=0)) == pytest.approx(sums)
    assert brightness(tracked(plates[:1])) == pytest.approx(sums[:1])
