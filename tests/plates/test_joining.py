"""A limit on the lights of a frame keeps all light, its centroid and its moments."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.plates.detection import LUMINANCE, find_sources
from flarewright.plates.joining import joined
from flarewright.plates.tracking import follow

RNG = np.random.default_rng(11)


def lamps(number, frames=3):
    places = RNG.permutation(50 * 80)[:number]
    light = RNG.exponential(3.0, (number, 3)) + 1.5
    found = []
    for k in range(frames):
        pixels = np.zeros((110, 170, 3), np.float32)
        rows, columns = 2 * (places // 80) + 2, 2 * (places % 80) + 2 + k
        pixels[rows, columns] = light
        found.append(find_sources(pixels, 1.0))
    return follow(range(frames), found, 170)


def test_the_light_of_every_frame_is_kept_per_channel():
    tracks = lamps(300)
    limited, sources, lights = joined(tracks, 20)
    present = (limited.light.sum(axis=2) > 0.0).sum(axis=0)
    assert (present <= 20).all()
    assert lights == 10
    assert sources > 250
    assert limited.light.sum(axis=0) == pytest.approx(tracks.light.sum(axis=0))
    before, after = (each.light @ LUMINANCE for each in (tracks, limited))
    for frame in range(3):
        old = np.nansum(tracks.centre_px[:, frame] * before[:, frame, None], axis=0)
        new = np.nansum(limited.centre_px[:, frame] * after[:, frame, None], axis=0)
        assert new == pytest.approx(old)


def test_the_brightest_stay_single_and_few_sources_are_not_joined():
    tracks = lamps(60)
    limited, _, lights = joined(tracks, 12)
    best = np.sort((tracks.light @ LUMINANCE).max(axis=1))[-5:]
    single = (limited.light[: len(limited) - lights] @ LUMINANCE).max(axis=1)
    assert set(np.round(best, 6)) <= set(np.round(single, 6))
    same, sources, lights = joined(tracks, 500)
    assert same is tracks
    assert (sources, lights) == (0, 0)
