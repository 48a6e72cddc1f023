"""The sensor: noise with the variance of photons and reading, black level, clipping, tone curves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from flarewright.model.project.dataset import DatasetSpec
from flarewright.workflow.training_pairs.sensor import (
    Sensor,
    _normal_steps,
    codes,
    draw_sensor,
    exposed,
    jpeg_bytes,
    noise_of,
    through_jpeg,
)

PLAIN = Sensor(None, 0.0, 0.0, True, "srgb", None)


def grey(value, side=128):
    return np.full((side, side, 3), value, np.float32)


@pytest.mark.parametrize(("well", "read", "level"), [(5000.0, 0.0, 0.4), (1000.0, 30.0, 0.2), (20000.0, 5.0, 0.7)])
def test_noise_has_the_variance_of_photons_and_of_reading(well, read, level):
    rng = np.random.default_rng(4)
    noise = rng.standard_normal((128, 128, 3), dtype=np.float32)
    found = exposed(grey(level), Sensor(well, read, 0.0, True, "linear", None), noise)
    counts = rng.poisson(level * well, found.shape) + rng.normal(0.0, read, found.shape)
    number = found.size
    assert abs(found.mean() - level) < 4.0 * counts.std() / well / np.sqrt(number)
    # both variances have the relative error sqrt(2 / number)
    assert abs(found.var() / (counts.var() / well**2) - 1.0) < 4.0 * np.sqrt(4.0 / number)


@pytest.mark.parametrize("sensor", [
    Sensor(700.0, 4.0, 0.06, True, "linear", None), Sensor(700.0, 4.0, 0.0, False, "linear", None),
    Sensor(None, 0.0, 0.06, False, "linear", None),
])  # fmt: skip
def test_the_record_follows_from_the_formula_in_every_channel(sensor):
    rng = np.random.default_rng(7)
    light = rng.uniform(-0.2, 1.6, (9, 7, 3)).astype(np.float32)
    noise = rng.standard_normal(light.shape, dtype=np.float32)
    wanted = light.astype(np.float64)
    if sensor.full_well_e is not None:
        electrons = np.clip(wanted, 0.0, 1.0) * sensor.full_well_e + sensor.read_noise_e**2
        wanted = wanted + noise * np.sqrt(electrons) / sensor.full_well_e
    wanted = sensor.black_level + (1.0 - sensor.black_level) * wanted
    wanted = np.clip(wanted, 0.0, 1.0 if sensor.clip else None)
    np.testing.assert_allclose(exposed(light, sensor, noise), wanted, rtol=2e-6, atol=2e-7)


def test_noise_is_normally_distributed():
    spec = DatasetSpec.model_validate({"size_px": (400, 300), "lens": {"names": "x"}, "sensor": {"full_well_e": 900}})
    found = noise_of(spec, 5, 0)
    number = found.size
    # Kolmogorov's bound at one in a million, and the standard errors of the moments
    assert stats.kstest(found.ravel(), "norm").statistic < np.sqrt(0.5 * np.log(2e6) / number)
    for channel in np.moveaxis(found, 2, 0):
        assert abs(channel.mean()) < 5.0 / np.sqrt(channel.size)
        assert abs(channel.var() - 1.0) < 5.0 * np.sqrt(2.0 / channel.size)
    assert abs((found.astype(np.float64) ** 4).mean() - 3.0) < 5.0 * np.sqrt(96.0 / number)
    # neighbours, rows and channels are independent
    for one, other in ((found[:, 1:], found[:, :-1]), (found[1:], found[:-1]), (found[..., 1:], found[..., :-1])):
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 5.0 / np.sqrt(one.size)


def test_the_steps_of_the_noise_have_the_moments_that_are_stated():
    steps = _normal_steps().astype(np.float64)
    assert abs(steps.mean()) < 1e-9
    assert 1.0 - (steps**2).mean() == pytest.approx(1.5e-6, rel=0.03)
    assert 3.0 - (steps**4).mean() == pytest.approx(1.8e-4, rel=0.03)
    assert steps.max() == pytest.approx(4.39, abs=0.005)
    assert (np.diff(steps) > 0.0).all()


def test_light_above_white_clips_and_a_black_level_keeps_the_noise_of_black():
    noise = np.random.default_rng(5).standard_normal((128, 128, 3), dtype=np.float32)
    assert (exposed(grey(7.0), PLAIN) == 1.0).all()
    assert exposed(grey(7.0), Sensor(None, 0.0, 0.0, False, "linear", None)).max() == 7.0
    dark = Sensor(1000.0, 10.0, 0.0, True, "linear", None)
    raised = Sensor(1000.0, 10.0, 0.1, True, "linear", None)
    assert (exposed(grey(0.0), dark, noise) == 0.0).mean() == pytest.approx(0.5, abs=0.02)
    lifted = exposed(grey(0.0), raised, noise)
    assert lifted.mean() == pytest.approx(0.1, abs=2e-4)
    assert lifted.std() == pytest.approx(0.009, rel=0.02)
    assert exposed(grey(1.0), raised)[0, 0, 0] == 1.0


def test_the_clean_picture_gets_other_noise_or_the_same():
    spec = DatasetSpec.model_validate({"size_px": (32, 16), "lens": {"names": "x"}, "sensor": {"full_well_e": 900}})
    one, other = noise_of(spec, 3, 0), noise_of(spec, 3, 1)
    assert one.shape == (16, 32, 3)
    assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 4.0 / np.sqrt(one.size)
    same = spec.replace(sensor=spec.sensor.replace(noise="same"))
    assert np.array_equal(noise_of(same, 3, 0), noise_of(same, 3, 1))
    assert not np.array_equal(one, noise_of(spec, 4, 0))
    assert draw_sensor(spec, 3) == Sensor(900.0, 0.0, 0.0, True, "srgb", None)


@pytest.mark.parametrize("bits", [8, 16])
def test_tone_curves_are_those_of_their_standards(bits):
    top = 2**bits - 1
    light = np.repeat(np.linspace(0.0, 1.0, 300, dtype=np.float32), 3).reshape(1, 300, 3)
    exact = light.astype(np.float64)
    srgb = np.where(exact <= 0.0031308, 12.92 * exact, 1.055 * exact ** (1 / 2.4) - 0.055)
    for tone, wanted in (("srgb", srgb), ("linear", exact), ("gamma:2.2", exact ** (1 / 2.2))):
        found = codes(light, tone, bits).astype(float)
        assert np.abs(found - wanted * top).max() < 0.51 + top * 2e-7
    assert codes(light * 9.0, "gamma:2.2", bits).max() == top


def test_light_beyond_white_has_the_same_colour_in_8_bits_and_in_16_and_through_every_curve():
    """A layer of flare has such light; 8 bits of sRGB used to mix it with white, unlike the flared picture."""
    light = np.array([[[3.0, 0.5, 0.1], [0.5, 0.4, -0.2], [5.0, 4.0, 3.0]]], np.float32)
    clipped = np.clip(light, 0.0, 1.0)
    for tone in ("srgb", "linear", "gamma:2.2"):
        np.testing.assert_array_equal(codes(light, tone, 8), codes(clipped, tone, 8))
        np.testing.assert_allclose(codes(light, tone, 8), codes(light, tone, 16) / 257.0, atol=0.51)


def test_jpeg_changes_a_picture_more_at_lower_quality():
    picture = np.random.default_rng(6).integers(0, 255, (32, 32, 3), np.uint8)
    errors = [np.abs(through_jpeg(picture, quality).astype(int) - picture).mean() for quality in (30, 80, 100)]
    assert errors[0] > errors[1] > errors[2]
    assert jpeg_bytes(picture, 80)[:2] == b"\xff\xd8"
