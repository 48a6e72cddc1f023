"""The view: exact curves, stated exposure, and the sum of layers."""

import numpy as np
import pytest

from flarewright.errors import FlarewrightError
from flarewright.io.exr import CHROMATICITIES
from flarewright.model import Layer
from flarewright.render.compose import beauty
from flarewright.render.display import ACESCG_TO_REC709, auto_exposure, filmic, srgb_oetf, view, view_text


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
    assert view(picture, 0.0).tolist() == [[[118, 118, 118]]]
    assert view(picture / 8, 3.0).tolist() == [[[118, 118, 118]]]


def test_negative_colours_are_clamped_and_white_clips():
    picture = np.array([[[-0.5, 0.0, 7.0]]], np.float32)
    assert view(picture, 0.0).tolist() == [[[0, 0, 255]]]
    assert view(picture, 0.0, "filmic")[0, 0, 2] > 240


def test_filmic_keeps_black_and_grey_and_reaches_white():
    x = np.array([0.0, 0.18, 1.0, 10.0, np.inf])
    y = filmic(x)
    assert y[0] == 0.0
    assert y[1] == pytest.approx(0.18, abs=1e-12)
    assert y[4] == 1.0
    assert (np.diff(y) > 0).all()


def test_acescg_white_is_white():
    white = np.ones((2, 2, 3), np.float32)
    assert (view(white, 0.0, colorspace="acescg") == 255).all()
    assert auto_exposure(white, "acescg") == auto_exposure(white, "rec709")


def test_auto_exposure_is_deterministic_scales_and_survives_black():
    picture = np.abs(np.random.default_rng(3).standard_normal((40, 40, 3))).astype(np.float32)
    stops = auto_exposure(picture)
    assert auto_exposure(picture / 1024) == pytest.approx(stops + 10, abs=0.011)
    assert auto_exposure(np.zeros((4, 4, 3), np.float32)) == 0.0
    np.testing.assert_array_equal(view(picture), view(picture, stops))
    # Pixels that no light reaches do not count towards the percentile.
    flat = np.pad(np.full((9, 9, 3), 0.35, np.float32), ((0, 90), (0, 90), (0, 0)))
    assert auto_exposure(flat) == 1.0


def test_auto_exposure_keeps_a_veil_over_the_whole_picture_dark():
    veil = np.full((50, 50, 3), 0.01, np.float32)
    assert auto_exposure(veil) == 2.0
    veil[:5, :5] = 0.02
    assert auto_exposure(veil) == 2.0
    veil[:20, :20] = 0.35
    assert auto_exposure(veil) == 1.0


def test_every_code_begins_where_the_curve_rounds_to_it():
    light = np.linspace(-0.01, 1.02, 1_000_003, dtype=np.float32)
    exact = 255.0 * srgb_oetf(np.clip(light.astype(np.float64), 0.0, 1.0))
    codes = view(np.broadcast_to(light[:, None, None], (len(light), 1, 3)), 0.0)[:, 0]
    assert (codes == codes[:, :1]).all()
    # single precision may fall to either side of a half
    assert np.abs(codes[:, 0] - exact).max() < 0.5 + 2e-4
    assert (np.diff(codes[:, 0].astype(int)) >= 0).all()
    assert set(codes[:, 0]) == set(range(256))


def test_unknown_view_is_refused_and_the_view_is_stated():
    with pytest.raises(FlarewrightError, match="srgb and filmic"):
        view(np.zeros((1, 1, 3), np.float32), 0.0, "aces")  # type: ignore[arg-type]
    assert view_text(2.5, "srgb", "acescg", automatic=True) == (
        "exposure +2.50 stops (automatic), ACEScg converted to Rec.709, sRGB, negative colours clamped to 0"
    )


def test_beauty_adds_windows_and_cuts_what_lies_outside():
    a = Layer("starburst", np.ones((4, 6, 3), np.float32), (0, 0, 6, 4))
    b = Layer("ghost.2-0", np.full((3, 3, 3), 2.0, np.float32), (4, -1, 3, 3))
    total = beauty([a, b], (6, 4))
    assert total.name == "beauty"
    assert total.window == (0, 0, 6, 4)
    expected = np.ones((4, 6, 3))
    expected[:2, 4:] += 2.0
    np.testing.assert_array_equal(total.pixels, expected)
    # and leaves the layers alone
    assert (a.pixels == 1.0).all()
    assert beauty([a, b]).window == (0, 0, 7, 4)
    assert not beauty([], (3, 2)).pixels.any()
    with pytest.raises(FlarewrightError):
        beauty([])
