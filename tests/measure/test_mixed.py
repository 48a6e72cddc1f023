"""All colours as one picture: what is certain counts, and a ghost that green hardly shows is found."""

import numpy as np
import pytest
from planted_run import LARGEST, shape, views

from flarewright.measure.fit import render
from flarewright.measure.mixed import mixed, mixture, shares
from flarewright.measure.pursuit import pursue
from flarewright.measure.views import all_known


def noisier(view, factors):
    """Return a view whose colours are told to be noisier by some factors."""
    return type(view)(
        view.constellation_deg, view.sigma, view.frame, view.light_px, view.pixels,
        view.variance * np.square(np.array(factors, np.float32)),
    )  # fmt: skip


def bare(count):
    """Return views of nothing but noise."""
    return views((), angles=np.linspace(1.0, 3.0, count))


def test_colours_count_by_how_certain_they_are():
    seen = [noisier(view, (2.0, 1.0, 4.0)) for view in bare(4)]
    share = shares(seen)
    assert share == pytest.approx(np.array([0.25, 1.0, 0.0625]) / 1.3125, rel=1e-5)
    one = mixed(seen, seen, share, 0.1)[0]
    # of all mixtures that leave white light as it is, the one of the least variance
    assert one.variance[..., 1] == pytest.approx((share**2) @ seen[0].variance[0, 0], rel=1e-5)
    assert np.array_equal(one.pixels[..., 0], mixture(seen[0].pixels, share))
    assert np.array_equal(one.pixels[..., 0], one.pixels[..., 2])
    white = np.full((2, 2, 3), 0.7, np.float32)
    assert mixture(white, share) == pytest.approx(np.full((2, 2), 0.7), rel=1e-6)
    for step in (np.array([0.02, -0.02, 0.0]), np.array([0.0, 0.01, -0.01])):
        assert ((share + step) ** 2) @ seen[0].variance[0, 0] > (share**2) @ seen[0].variance[0, 0]


def test_pictures_without_noise_count_alike():
    assert shares([noisier(view, (0.0, 0.0, 0.0)) for view in bare(3)]) == pytest.approx(np.full(3, 1.0 / 3.0))


def test_what_was_not_measured_stays_unknown_and_the_noise_is_what_is_told():
    seen = bare(3)
    seen[0].variance[:4, :, 0] = np.inf
    share = shares(seen)
    one = mixed(seen, seen, share, 0.1)[0]
    assert not all_known(one.variance)[:4].any()
    assert all_known(one.variance)[4:].all()
    assert one.pixels[4:, :, 1].std() == pytest.approx(float(np.sqrt(one.variance[10, 10, 1])), rel=0.02)


def test_what_stays_behind_of_a_glow_does_so_in_all_colours():
    seen = bare(3)
    dimmed = [view.showing(view.pixels - np.float32([0.0, 0.3, 0.6])) for view in seen]
    share = shares(seen)
    noise = mixed(seen, seen, share, 0.1)[1].variance
    glow = mixed(seen, dimmed, share, 0.1)[1].variance
    np.testing.assert_allclose(glow - noise, (0.1 * 0.9 / 3.0) ** 2, rtol=1e-3)


def test_a_purple_ghost_is_found_that_green_hides(no_lunes):
    """As coatings for green leave them: next to nothing in the colour that was looked at alone before."""
    ghost = shape(-60.0, 25.0, 0.05)
    seen = []
    for view in views((), noise=0.012, seed=4, angles=np.linspace(1.0, LARGEST, 8)):
        light = render(ghost, view)[..., None] * np.array([1.0, 0.1, 1.0])
        seen.append(view.showing((view.pixels + light).astype(np.float32)))
    masks = [np.ones(view.pixels.shape[:2], bool) for view in seen]
    assert pursue([view.showing_one(view.pixels[..., 1]) for view in seen], masks, most=2) == []
    found = pursue(mixed(seen, seen, shares(seen), 0.1), masks, most=2)
    assert len(found) == 1
    assert found[0].shapes[0].numbers[[0, 10]] == pytest.approx(ghost.numbers[[0, 10]], rel=0.06)
