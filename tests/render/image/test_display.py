"""The view: exact curves, the stated exposure, and the sum of layers."""

import numpy as np
import pytest

from flarewright.errors import FlarewrightError
from flarewright.io.images.exr import CHROMATICITIES
from flarewright.model import Layer
from flarewright.render.image.compose import beauty
from flarewright.render.image.display import (
    ACESCG_TO_REC709,
    auto_exposure,
    srgb_codes,
    srgb_oetf,
    view,
    view_sum,
    view_text,
)


def rgb_to_xyz(chromaticities):
    xyz = np.array([[x / y, 1.0, (1 - x - y) / y] for x, y in np.reshape(chromaticities, (4, 2))]).T
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3]), xyz[:, 3]


def test_acescg_matrix_follows_from_the_primaries():
    ap1, white_ap1 = rgb_to_xyz(CHROMATICITIES["acescg"])
    rec709, white_d65 = rgb_to_xyz(CHROMATICITIES["rec709"])
    bradford = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
    adapt = np.linalg.inv(bradford) @ np.diag((bradford @ white_d65) / (bradford @ white_ap1)) @ bradford
    np.testing.assert_allclose(ACESCG_TO_REC709, np.linalg.inv(rec709) @ adapt @ ap1, atol=1e-8)
    np.testing.assert_allclose(ACESCG_TO_REC709.sum(axis=1), 1.0, atol=1e-7)  # white stays white


def test_srgb_curve_has_the_standard_values():
    np.testing.assert_allclose(srgb_oetf(np.array([0.0, 0.001, 0.0031308, 0.18, 0.5, 1.0])),
                               [0.0, 0.01292, 0.04045, 0.46135612, 0.73535698, 1.0], atol=2e-6)  # fmt: skip
    picture = np.full((1, 1, 3), 0.18, np.float32)
    for transform in ("srgb", "filmic"):
        assert view(picture, 0.0, transform).tolist() == [[[118, 118, 118]]]
        assert view(picture / 8, 3.0, transform).tolist() == [[[118, 118, 118]]]


def decoded(codes):
    """Return linear light from sRGB codes."""
    at = np.linspace(0.0, 1.0, 20001)
    return np.interp(np.asarray(codes) / 255.0, srgb_oetf(at), at)


OUTSIDE = [(0.0007, -0.0006, 0.005), (-0.2, 0.5, 0.9), (0.9, -0.3, 0.1), (-0.6, 1.0, -0.1), (0.3, -0.9, 1.0)]


@pytest.mark.parametrize("transform", ["srgb", "filmic"])
@pytest.mark.parametrize("rgb", OUTSIDE)
def test_colours_outside_the_triangle_keep_their_dominant_wavelength(rgb, transform):
    """They move along the line to white: their distances from the largest channel keep their proportions."""
    light = np.array(rgb) / max(rgb) * 0.45
    seen = decoded(view(light[None, None].astype(np.float32), 0.0, transform)[0, 0])
    middle, low = np.sort(light)[1], light.min()
    assert np.argsort(seen).tolist() == np.argsort(light).tolist()
    assert seen.max() == pytest.approx(0.45, abs=4e-3)
    assert (seen.max() - np.sort(seen)[1]) / (seen.max() - seen.min()) == pytest.approx(
        (light.max() - middle) / (light.max() - low), abs=0.03
    )


def test_a_blue_ghost_is_blue_and_an_over_exposed_one_still_is():
    """Clipping each channel made it magenta, (255, 0, 255), at the exposure that shows it."""
    ghost = np.array([[OUTSIDE[0]]], np.float32)
    for stops in (6.0, 7.6, 9.0):
        red, green, blue = (int(code) for code in view(ghost, stops)[0, 0])
        assert blue > 150
        assert red < 0.75 * blue
        assert green < red


def test_the_srgb_view_leaves_what_a_screen_can_show():
    colours = np.random.default_rng(2).uniform(0.0, 1.0, (40, 40, 3)).astype(np.float32)
    exact = 255.0 * srgb_oetf(colours.astype(np.float64))
    assert np.abs(view(colours, 0.0, "srgb") - exact).max() < 0.5 + 2e-4


def test_codes_of_single_values_are_the_nearest_and_clip_each_channel():
    light = np.random.default_rng(2).uniform(-0.3, 1.4, (40, 30, 3)).astype(np.float32)
    light[0, 0], light[0, 1] = np.nan, (np.inf, -np.inf, 0.0)
    found = srgb_codes(light)
    clipped = np.clip(np.nan_to_num(light), 0.0, 1.0)
    np.testing.assert_array_equal(found, view(clipped, 0.0, "srgb"))
    assert np.abs(found - 255.0 * srgb_oetf(clipped.astype(np.float64))).max() < 0.5 + 1e-4
    assert found[0, 0].tolist() == [0, 0, 0]
    assert found[0, 1].tolist() == [255, 0, 0]
    # a picture in another memory order
    np.testing.assert_array_equal(srgb_codes(light.transpose(1, 0, 2)), found.transpose(1, 0, 2))


def test_filmic_keeps_darks_rolls_off_and_reaches_white():
    light = np.geomspace(1e-4, 1e7, 200)
    codes = view(np.repeat(light[:, None, None], 3, axis=2).astype(np.float32), 0.0)[:, 0]
    assert (codes == codes[:, :1]).all()
    assert (np.diff(codes[:, 0].astype(int)) >= 0).all()
    dark = light < 0.5
    assert np.abs(codes[dark, 0] - 255.0 * srgb_oetf(light[dark])).max() < 0.6
    # one stop above white is not yet white, eight times is nearly white, and very bright colours are white
    assert 225 < codes[np.searchsorted(light, 1.0), 0] < 240
    assert 245 < codes[np.searchsorted(light, 8.0), 0] < 255
    bright = view(np.array([[[1e4, 1e2, 1.0]]], np.float32), 0.0)[0, 0]
    assert bright.min() > 250
    assert view(np.array([[[np.inf, 1.0, 1.0]]], np.float32), 0.0)[0, 0].min() > 250
    assert view(np.array([[[np.nan, -1.0, 0.0]]], np.float32), 0.0).max() == 0


def test_colours_lose_their_saturation_slowly():
    """Half of it at eight times white."""
    blue = decoded(view(np.array([[[0.1, 0.1, 9.0]]], np.float32), 0.0)[0, 0])
    assert blue[:2].mean() / blue[2] == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("transform", ["srgb", "filmic"])
def test_the_sum_is_seen_as_the_sum(transform):
    rng = np.random.default_rng(4)
    ghosts, rest = (rng.normal(0.2, 0.5, (9, 12, 3)).astype(np.float32) for _ in range(2))
    whole = ghosts * np.float32([1.0, 0.5, 2.0]) + rest
    apart = view_sum(ghosts, rest, 0.4, ghost_gain=(1.0, 0.5, 2.0), transform=transform).astype(int)
    assert np.abs(apart - view(whole, 0.4, transform)).max() <= 1


def test_acescg_white_is_white():
    white = np.ones((2, 2, 3), np.float32)
    assert (view(white, 0.0, "srgb", colorspace="acescg") == 255).all()
    assert auto_exposure(white, "acescg") == auto_exposure(white, "rec709")


def test_auto_exposure_is_deterministic_scales_and_survives_black():
    picture = np.abs(np.random.default_rng(3).standard_normal((40, 40, 3))).astype(np.float32)
    stops = auto_exposure(picture)
    assert auto_exposure(picture / 1024) == pytest.approx(stops + 10, abs=0.011)
    assert auto_exposure(np.zeros((4, 4, 3), np.float32)) == 0.0
    np.testing.assert_array_equal(view(picture), view(picture, stops))
    # dark pixels do not count towards the percentile
    flat = np.pad(np.full((9, 9, 3), 0.45, np.float32), ((0, 90), (0, 90), (0, 0)))
    assert auto_exposure(flat) == 1.0


def test_auto_exposure_keeps_a_veil_over_the_whole_picture_dark():
    veil = np.full((50, 50, 3), 0.0075, np.float32)
    assert auto_exposure(veil) == 2.0
    veil[:5, :5] = 0.02
    assert auto_exposure(veil) == 2.0
    veil[:20, :20] = 0.45
    assert auto_exposure(veil) == 1.0


def test_auto_exposure_shows_ghosts_but_burns_out_little():
    """The core of a star may clip; its spikes and scattered light together may not."""
    ghosts = np.zeros((100, 100, 3), np.float32)
    ghosts[:10, :10] = 0.45
    star = ghosts.copy()
    star[50:55, 50:55] = 1e6
    assert auto_exposure(star, ghosts=ghosts) == 1.0
    glow = ghosts.copy()
    glow[50:70, 50:70] = 4.0
    assert auto_exposure(glow, ghosts=ghosts) == -2.0
    assert view(glow, auto_exposure(glow, ghosts=ghosts)).max() < 240


def test_every_code_begins_where_the_curve_rounds_to_it():
    light = np.linspace(-0.01, 1.02, 1_000_003, dtype=np.float32)
    exact = 255.0 * srgb_oetf(np.clip(light.astype(np.float64), 0.0, 1.0))
    codes = view(np.broadcast_to(light[:, None, None], (len(light), 1, 3)), 0.0, "srgb")[:, 0]
    assert (codes == codes[:, :1]).all()
    # single precision can round to either side of a half
    assert np.abs(codes[:, 0] - exact).max() < 0.5 + 2e-4
    assert (np.diff(codes[:, 0].astype(int)) >= 0).all()
    assert set(codes[:, 0]) == set(range(256))


def test_unknown_view_is_refused_and_the_view_is_stated():
    with pytest.raises(FlarewrightError, match="choose filmic, srgb, aces"):
        view(np.zeros((1, 1, 3), np.float32), 0.0, "log")  # type: ignore[arg-type]
    assert view_text(2.5, "srgb", "acescg", automatic=True) == (
        "exposure +2.50 stops (automatic), ACEScg converted to Rec.709, sRGB clipped at white, "
        "colours outside Rec.709 moved towards white"
    )
    assert "filmic roll-off" in view_text(0.0, "filmic", "rec709", automatic=False)


def test_beauty_adds_windows_and_cuts_what_lies_outside():
    a = Layer("starburst", np.ones((4, 6, 3), np.float32), (0, 0, 6, 4))
    b = Layer("ghost.2-0", np.full((3, 3, 3), 2.0, np.float32), (4, -1, 3, 3))
    total = beauty([a, b], (6, 4))
    assert total.name == "beauty"
    assert total.window == (0, 0, 6, 4)
    expected = np.ones((4, 6, 3))
    expected[:2, 4:] += 2.0
    np.testing.assert_array_equal(total.pixels, expected)
    # the layers stay unchanged
    assert (a.pixels == 1.0).all()
    assert beauty([a, b]).window == (0, 0, 7, 4)
    assert not beauty([], (3, 2)).pixels.any()
    with pytest.raises(FlarewrightError):
        beauty([])
