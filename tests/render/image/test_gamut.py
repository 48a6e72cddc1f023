"""Files without negative channels."""

import numpy as np
import pytest

from flarewright.model import Camera, Layer, Light, Lines, Output, Project, Quality
from flarewright.render.image.gamut import apply_gamut, compressed, negative_share
from flarewright.render.render import render

CYAN = Lines(lines=((500.0, 1.0),))


def layer(pixels, name="ghosts"):
    pixels = np.asarray(pixels, np.float32)
    return Layer(name, pixels, (0, 0, pixels.shape[1], pixels.shape[0]))


def test_nothing_is_negative_and_the_largest_channel_stays():
    colours = np.random.default_rng(1).normal(0.2, 1.0, (30, 30, 3)).astype(np.float32)
    before = colours.copy()
    found = compressed(layer(colours)).pixels
    assert found.min() >= 0.0
    lit = before.max(axis=-1) > 0.0
    np.testing.assert_allclose(found.max(axis=-1)[lit], before.max(axis=-1)[lit], rtol=1e-6)
    assert not found[~lit].any()
    # the given layer is unchanged, and so are colours well within the gamut
    np.testing.assert_array_equal(colours, before)
    within_reach = before.min(axis=-1) > 0.1 * before.max(axis=-1)
    np.testing.assert_array_equal(found[within_reach], before[within_reach])
    assert (found[~within_reach & lit] != before[~within_reach & lit]).any()


def test_farther_out_is_farther_out_still():
    """A smooth knee: more saturated light stays more saturated."""
    light = np.ones((1, 50, 3), np.float32)
    light[0, :, 0] = np.linspace(0.3, -3.0, 50)
    assert (np.diff(compressed(layer(light)).pixels[0, :, 0]) < 0.0).all()


def test_what_share_is_negative():
    pixels = np.ones((2, 4, 3))
    pixels[0, :3, 1] = -1e-6
    assert negative_share(layer(pixels)) == pytest.approx(3 / 8)
    assert negative_share(layer(np.zeros((0, 0, 3)))) == 0.0


def test_variances_are_no_light():
    both = [layer(-np.ones((2, 2, 3)), name) for name in ("ghosts", "ghosts.variance")]
    light, variance = apply_gamut("compress", both)
    assert not light.pixels.any()
    assert variance is both[1]
    assert apply_gamut("keep", both) == both


def test_a_render_of_cyan_light_without_negative_channels():
    """Passes still add up to the beauty; without compression, every lit pixel of a spectral cyan is negative."""
    project = Project(
        lens="triplet-pestrecov", lights=(Light(field_deg=(8.0, 4.0), spectrum=CYAN),), camera=Camera(size_px=(64, 36)),
        quality=Quality(ringing="off", paths="same-side"), output=Output(layers="passes", gamut="compress"),
    )  # fmt: skip
    whole, *passes = render(project).layers
    assert all(each.pixels.min() >= 0.0 for each in (whole, *passes))
    np.testing.assert_allclose(whole.pixels, sum(each.pixels for each in passes), rtol=1e-5, atol=1e-9)
    kept = {each.name: each for each in render(project.replace(output=Output(layers="passes"))).layers}
    assert negative_share(kept["beauty"]) > 0.9
    ghosts = next(each for each in passes if each.name == "ghosts")
    np.testing.assert_allclose(ghosts.pixels.max(axis=-1), kept["ghosts"].pixels.max(axis=-1), rtol=1e-6)
