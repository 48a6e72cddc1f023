"""Mixture of the colours: weights follow the noise, and a ghost that green hardly shows is found."""

import numpy as np
import pytest
from planted_run import LARGEST, shape, views

from flarewright.measure.core.views import all_finite
from flarewright.measure.detection.channel_mix import channel_weights, mix_channels, mixture
from flarewright.measure.detection.matching_pursuit import pursue
from flarewright.measure.fitting.ghost_fit import render


def noisier(view, factors):
    """Return a view with the variance of its colours scaled."""
    return type(view)(
        view.constellation_deg, view.sigma, view.frame, view.light_px, view.pixels,
        view.variance * np.square(np.array(factors, np.float32)),
    )  # fmt: skip


def bare(count):
    """Return views of noise only."""
    return views((), angles=np.linspace(1.0, 3.0, count))


def test_colours_are_weighted_by_their_noise():
    seen = [noisier(view, (2.0, 1.0, 4.0)) for view in bare(4)]
    share = channel_weights(seen)
    assert share == pytest.approx(np.array([0.25, 1.0, 0.0625]) / 1.3125, rel=1e-5)
    one = mix_channels(seen, seen, share, 0.1)[0]
    # the mixture has the least variance of all that preserve white light
    np.testing.assert_allclose(one.variance[..., 1], (share**2) @ seen[0].variance[0, 0], rtol=1e-5)
    assert np.array_equal(one.pixels[..., 0], mixture(seen[0].pixels, share))
    assert np.array_equal(one.pixels[..., 0], one.pixels[..., 2])
    white = np.full((2, 2, 3), 0.7, np.float32)
    assert mixture(white, share) == pytest.approx(np.full((2, 2), 0.7), rel=1e-6)
    for step in (np.array([0.02, -0.02, 0.0]), np.array([0.0, 0.01, -0.01])):
        assert ((share + step) ** 2) @ seen[0].variance[0, 0] > (share**2) @ seen[0].variance[0, 0]


def test_pictures_without_noise_have_equal_weights():
    assert channel_weights([noisier(view, (0.0, 0.0, 0.0)) for view in bare(3)]) == pytest.approx(np.full(3, 1.0 / 3.0))


def test_unmeasured_pixels_stay_unknown_and_the_variance_is_that_of_the_mixture():
    seen = bare(3)
    seen[0].variance[:4, :, 0] = np.inf
    share = channel_weights(seen)
    one = mix_channels(seen, seen, share, 0.1)[0]
    assert not all_finite(one.variance)[:4].any()
    assert all_finite(one.variance)[4:].all()
    assert one.pixels[4:, :, 1].std() == pytest.approx(float(np.sqrt(one.variance[10, 10, 1])), rel=0.02)


def test_the_error_of_the_glow_is_common_to_all_colours():
    seen = bare(3)
    cleaned = [view.showing(view.pixels - np.float32([0.0, 0.3, 0.6])) for view in seen]
    share = channel_weights(seen)
    noise = mix_channels(seen, seen, share, 0.1)[1].variance
    glow = mix_channels(seen, cleaned, share, 0.1)[1].variance
    np.testing.assert_allclose(glow - noise, (0.1 * 0.9 / 3.0) ** 2, rtol=1e-3)


def test_a_purple_ghost_is_found(no_crescents):
    """Coatings optimized for green leave purple ghosts; an earlier version searched green only."""
    ghost = shape(-60.0, 25.0, 0.05)
    seen = []
    for view in views((), noise=0.012, seed=4, angles=np.linspace(1.0, LARGEST, 6), size=(240, 80)):
        light = render(ghost, view)[..., None] * np.array([1.0, 0.1, 1.0])
        seen.append(view.showing((view.pixels + light).astype(np.float32)))
    masks = [np.ones(view.pixels.shape[:2], bool) for view in seen]
    assert pursue([view.showing_one(view.pixels[..., 1]) for view in seen], masks, most=2) == []
    found = pursue(mix_channels(seen, seen, channel_weights(seen), 0.1), masks, most=2)
    assert len(found) == 1
    assert found[0].shapes[0].numbers[[0, 10]] == pytest.approx(ghost.numbers[[0, 10]], rel=0.06)
