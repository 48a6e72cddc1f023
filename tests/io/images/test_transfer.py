"""Transfer functions against their inverses in the standards, and against colour-science."""

from __future__ import annotations

from math import exp, log

import numpy as np
import pytest

from flarewright.io.images.transfer import HDR_WHITE_CD_M2, TRANSFERS, decoded, encoded_rec709, white_of
from flarewright.render.image.display import srgb_oetf

CODES = np.linspace(0.0, 1.0, 257, dtype=np.float32)


def camera(light):
    """Return the code of light (ITU-R BT.709-6, item 1.2)."""
    return 4.5 * light if light < 0.018 else 1.099 * light**0.45 - 0.099


def hybrid_log_gamma(light):
    """Return the code of light (ITU-R BT.2100-2, table 5)."""
    a = 0.17883277
    b, c = 1.0 - 4.0 * a, 0.5 - a * log(4.0 * a)
    return (3.0 * light) ** 0.5 if light <= 1.0 / 12.0 else a * log(12.0 * light - b) + c


def test_codes_of_the_decoded_light_are_the_codes():
    assert srgb_oetf(decoded(CODES, "srgb").astype(float)) == pytest.approx(CODES, abs=1e-5)
    # the two parts of the standard's curve do not meet exactly
    assert [camera(float(x)) for x in decoded(CODES, "rec709")] == pytest.approx(CODES.tolist(), abs=3e-4)
    scene = decoded(CODES, "hlg").astype(float) * (exp((0.75 - 0.55991073) / 0.17883277) + 0.28466892) / 12.0
    assert [hybrid_log_gamma(x) for x in scene] == pytest.approx(CODES.tolist(), abs=1e-5)


@pytest.mark.parametrize(("code", "cd_m2"), [(0.508078, 100.0), (0.751827, 1000.0), (1.0, 10000.0), (0.149946, 1.0)])
def test_pq_has_the_published_luminances(code, cd_m2):
    """Codes of ITU-R BT.2408, table 1, and Miller (2014)."""
    assert decoded(np.float32([code]), "pq")[0] * HDR_WHITE_CD_M2 == pytest.approx(cd_m2, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("transfer", "other"),
    [
        ("srgb", lambda c, x: c.eotf(x, "sRGB")),
        ("rec709", lambda c, x: c.oetf_inverse(x, "ITU-R BT.709")),
        ("pq", lambda c, x: c.eotf(x, "ITU-R BT.2100 PQ") / HDR_WHITE_CD_M2),
        ("hlg", lambda c, x: c.oetf_inverse(x, "ITU-R BT.2100 HLG") / c.oetf_inverse(0.75, "ITU-R BT.2100 HLG")),
        ("gamma22", lambda c, x: c.gamma_function(x, 2.2)),
        ("linear", lambda c, x: x),
    ],
)
def test_values_are_those_of_colour_science(transfer, other):
    # its import takes seconds
    colour = pytest.importorskip("colour")
    wanted = np.asarray(other(colour, CODES.astype(np.float64)))
    assert decoded(CODES, transfer) == pytest.approx(wanted, rel=1e-4, abs=2e-5)


@pytest.mark.parametrize("transfer", TRANSFERS)
def test_codes_rise_from_black_to_white(transfer):
    values = decoded(CODES, transfer)
    assert values.dtype == np.float32
    assert values[0] == pytest.approx(0.0, abs=1e-6)
    assert (np.diff(values) > 0.0).all()
    assert values[-1] == pytest.approx(white_of(transfer))
    assert decoded(np.float32([-0.1]), transfer)[0] == pytest.approx(0.0, abs=1e-6)


def test_the_camera_encodes_what_is_decoded():
    light = np.linspace(0.0, 1.0, 257, dtype=np.float32)
    assert decoded(encoded_rec709(light), "rec709") == pytest.approx(light, abs=1e-4)


def test_white_paper_is_one_in_high_dynamic_range():
    assert decoded(np.float32([0.75]), "hlg")[0] == pytest.approx(1.0)
    assert white_of("pq") == pytest.approx(10000.0 / 203.0, rel=1e-4)


def test_codes_above_white_stay_brighter():
    # limited range ends at (255 - 16) / 219
    assert decoded(np.float32([239.0 / 219.0]), "rec709")[0] > 1.1
