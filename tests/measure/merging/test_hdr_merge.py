"""Merging is unbiased with a correct variance, works in bands, and measures the noise that it needs."""

import zlib
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from synthetic_camera import Setup, expose

from flarewright.io.images.photo import open_photo
from flarewright.measure.merging.hdr_merge import Exposure, exposure_ratios, merge_exposures, without_idle_digits
from flarewright.measure.merging.noise import common_black, fit_transfer, noise_of, smooth, transfers
from flarewright.model.measurement.capture import CameraNoise

CAMERA = Setup()
NOISE = CameraNoise(electrons_per_unit=CAMERA.electrons_per_unit, read_noise=CAMERA.read_noise)


def scene(height: int = 60, width: int = 90) -> np.ndarray:
    """Return five decades of light: a glow, an edge, and a spot that every exposure clips."""
    x, y = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
    r = np.hypot(x - 0.6 * width, y - 0.5 * height)
    light = 1e-3 + 0.4 / (1.0 + (r / 12.0) ** 2) + 2000.0 * np.exp(-0.5 * (r / 2.5) ** 2)
    light = light * np.where(x > 0.3 * width, 1.0, 0.4)
    return (light[..., None] * np.array([0.7, 1.0, 0.5])).astype(np.float32)


def shoot(folder, light, times=CAMERA.exposures_s, seed=0, gains=None, setup=CAMERA):
    found = []
    for j, time in enumerate(times):
        path = folder / f"{seed}-{j}.npy"
        np.save(path, expose(setup, light, time, 1.0 if gains is None else gains[j], (seed, j)))
        noise = noise_of(NOISE, 100.0, 1.0)
        photo = open_photo(path, setup.white)
        found.append(Exposure(photo, time, (noise,) * 3, np.full(3, setup.black, np.float32), setup.white))
    return found


FULL = CAMERA.white - CAMERA.black


def test_the_mean_of_many_merges_is_the_truth_and_their_spread_is_the_variance(tmp_path):
    light, runs = scene(), 15
    found = [merge_exposures(shoot(tmp_path, light, seed=k)) for k in range(runs)]
    mean = np.stack([one[0] for one in found]).astype(np.float64) / FULL
    variance = np.stack([one[1] for one in found]).astype(np.float64) / FULL**2
    known = np.isfinite(variance).all(axis=0)
    assert 0.9 < known.mean() < 1.0
    z = (mean.mean(axis=0) - light)[known] / np.sqrt(variance.mean(axis=0)[known] / runs)
    # the mean over all pixels and seeds is within its standard error, also in each third of the levels
    assert abs(z.mean()) < 4.0 / np.sqrt(z.size)
    for part in np.array_split(np.argsort(light[known]), 3):
        assert abs(z[part].mean()) < 4.0 / np.sqrt(part.size)
    chi2 = ((mean - light) ** 2 / variance)[:, known]
    assert chi2.mean() == pytest.approx(1.0, abs=0.02)


def test_weights_by_a_pixels_own_reading_would_be_biased(tmp_path):
    """The bias that `merge` avoids is large enough for the test above to detect."""
    light = np.full((60, 90, 3), 2e-4, np.float32)
    bias = []
    for k in range(20):
        shots = shoot(tmp_path, light, times=(1.0, 2.0), seed=k)
        numbers = [one.read(0, 60)[0] for one in shots]
        weights = [one.seconds**2 / one.variance(x) for one, x in zip(shots, numbers, strict=True)]
        naive = sum(w * x / one.seconds for w, x, one in zip(weights, numbers, shots, strict=True)) / sum(weights)
        careful, variance = merge_exposures(shots)
        bias.append([(value / FULL - light).mean() / np.sqrt(variance.mean() / variance.size) * FULL
                     for value in (naive, careful)])  # fmt: skip
    naive, careful = np.mean(bias, axis=0) * np.sqrt(20)
    assert naive < -5.0
    assert abs(careful) < 4.0


def test_clipped_everywhere_is_unknown_and_shows_at_least_white(tmp_path):
    light = scene()
    shots = shoot(tmp_path, light)
    mean, variance = merge_exposures(shots)
    hopeless = light * CAMERA.exposures_s[0] > 1.1
    assert hopeless.any()
    assert np.isinf(variance[hopeless]).all()
    assert (mean[hopeless] >= FULL / CAMERA.exposures_s[0]).all()
    assert np.isfinite(mean).all()


@pytest.mark.parametrize("rows", [7, 16, 59])
def test_bands_of_rows_give_the_same_pixels(tmp_path, rows):
    shots = shoot(tmp_path, scene())
    whole = merge_exposures(shots, rows=1000)
    assert all(np.array_equal(a, b) for a, b in zip(merge_exposures(shots, rows=rows), whole, strict=True))


def test_a_shutter_that_lies_is_found_out(tmp_path):
    gains = (1.07, 0.95, 1.0)
    ratios = exposure_ratios(shoot(tmp_path, scene(200, 300), gains=gains))
    for ratio, gain in zip(ratios, gains, strict=True):
        assert abs(ratio.value - gain) < 4.0 * ratio.error + 1e-9
        assert ratio.error < 0.01


def test_photon_transfer_finds_the_planted_camera_within_its_uncertainty(tmp_path):
    pulls = []
    for seed in range(5):
        camera = replace(CAMERA, electrons_per_unit=2.0 + seed / 2, read_noise=6.0, seed=seed)
        shots = shoot(tmp_path, scene(150, 220), seed=seed, setup=camera)
        read = [one.read(0, 150) for one in shots]
        points = []
        for (a, a_off), (b, _), ratio in zip(read, read[1:], (1 / 16, 1 / 64), strict=False):
            around = smooth(b, 7)
            free = ~a_off & (b < 0.9 * FULL) & (around < 0.8 * FULL)
            for c in range(3):
                points += transfers(a[..., c], b[..., c], around[..., c], ratio, free[..., c], 1.0)
        found = fit_transfer(points, CameraNoise(), 1.0)
        pulls.append([(found.electrons_per_unit - camera.electrons_per_unit) / found.electrons_per_unit_error,
                      (found.read_noise - camera.read_noise) / found.read_noise_error])  # fmt: skip
        assert found.electrons_per_unit_error < 0.1 * camera.electrons_per_unit
        assert found.read_noise_error < 0.1 * camera.read_noise
    pulls = np.array(pulls)
    assert np.abs(pulls).max() < 4.0
    assert 0.4 < pulls.std() < 1.7


def test_the_black_level_is_where_two_exposures_meet(tmp_path):
    shots = shoot(tmp_path, scene(150, 220))
    raw = [(one.photo.rows(0, 150), one.read(0, 150)[1]) for one in shots]
    black = common_black((a[..., c], b[..., c], smooth(b, 7)[..., c], ~(a_off | b_off)[..., c])
                         for (a, a_off), (b, b_off) in pairwise(raw) for c in range(3))  # fmt: skip
    assert black == pytest.approx(CAMERA.black, abs=0.1)


def test_an_even_scene_reports_the_same_noise(tmp_path):
    """Bins sorted by a reading itself would sort its noise: with equal exposures half of it would be lost."""
    light = np.full((150, 220, 3), 0.2, np.float32) * np.array([0.2, 1.0, 2.0], np.float32)
    a, b = (one.read(0, 150)[0] for one in shoot(tmp_path, light, times=(1.0, 1.0)))
    points = [one for c in range(3) for one in transfers(a[..., c], b[..., c], smooth(b, 7)[..., c], 1.0,
                                                         np.ones(a.shape[:2], bool), 1.0)]  # fmt: skip
    found = fit_transfer(points, CameraNoise(read_noise=CAMERA.read_noise), 1.0)
    assert found.electrons_per_unit == pytest.approx(CAMERA.electrons_per_unit, rel=0.04)


def test_digits_of_noise_are_rounded_away_and_nothing_else():
    rng = np.random.default_rng(2)
    variance = (10.0 ** rng.uniform(-12, 4, (50, 60, 3))).astype(np.float32)
    variance[3, 4] = np.inf
    mean = (rng.normal(size=variance.shape) * 100.0).astype(np.float32)
    short, reported = without_idle_digits(mean, variance)
    known = np.isfinite(variance)
    off = (short - mean)[known] / np.sqrt(variance[known])
    assert np.abs(off).max() <= 1.0 / 32.0 + 1e-4
    assert off.var() < 1.0 / 3000.0
    assert np.abs(reported[known] / variance[known] - 1.0).max() < 1.0 / 500.0
    assert np.array_equal(short[~known], mean[~known])
    assert np.isinf(reported[~known]).all()
    packed, full = (len(zlib.compress(values.tobytes())) for values in (reported, variance))
    assert packed < 0.8 * full


@pytest.mark.parametrize("iso", [100.0, 200.0, 800.0])
def test_noise_grows_with_the_iso_as_counted_electrons_do(iso):
    """Simulated photon, read and quantization noise: at eight times the ISO a unit is an eighth of the electrons."""
    camera = CameraNoise(electrons_per_unit=4.0, read_noise=3.0, iso=100.0)
    per_unit = 4.0 * 100.0 / iso
    rng = np.random.default_rng(12)
    for units in (0.0, 40.0, 900.0):
        electrons = rng.poisson(units * per_unit, 40000) + rng.normal(0.0, 3.0, 40000)
        drawn = np.round(electrons / per_unit).var()
        # standard error of a variance of n samples: sqrt(2 / n), here 0.7 %; four times that
        noise = noise_of(camera, iso, 1.0)
        assert noise.slope * np.array(units) + noise.floor == pytest.approx(drawn, rel=0.03)
