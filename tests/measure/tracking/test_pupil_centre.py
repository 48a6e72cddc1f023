"""Image of a ghost's pupil centre and its errors, against drawn pictures and random parameters."""

import numpy as np
import pytest
from test_model_image import planted

from flarewright.measure.core.parameter_vector import NUMBERS, channel_deviation, channel_of, field
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.tracking.pupil_centre import PLACE, RADIANCE, SIZE, middles_of
from flarewright.model.measurement.ghost_model import AberrationGhost, Curve, Curves

ANGLES = np.linspace(1.0, 24.0, 5)
LARGEST = 25.0
CURVES = Curves(
    brightness=Curve(values=(1.0, 1.4, 0.8), error=(0.03, 0.02, 0.05)),
    along_px=Curve(values=(0.5, -1.0), error=(0.2, 0.4)),
    size=Curve(values=(1.1,), error=(0.01,)),
)


def ghost(uncertainty=(), curves=CURVES, shift=0.0):
    channels = []
    for m in range(3):
        numbers = np.zeros(NUMBERS)
        numbers[:4] = -60.0 - shift * m, 1.0, 0.5, 4.0
        numbers[10:14] = 14.0, 1.0, 0.3, 2.0
        numbers[20:24] = 900.0 - 200.0 * m, 80.0, 0.0, 50.0
        numbers[51:] = 0.1, 0.2
        channels.append(channel_of(numbers, 0).replace(uncertainty=uncertainty))
    return AberrationGhost(name="1", red=channels[0], green=channels[1], blue=channels[2], visible_deg=(0.0, 25.0),
                           curves=curves)  # fmt: skip


def reported():
    """Return deviations of 1 or 2 % of a ghost's parameters, `below` last."""
    deviation = np.zeros(39)
    deviation[[0, 2, 3]], deviation[[10, 12, 13]], deviation[[20, 23]] = (0.6, 0.2, 0.3), (0.2, 0.1, 0.1), (9.0, 5.0)
    deviation[-2:] = 0.01, 0.015
    return tuple(deviation.tolist())


def spline(values, z):
    """Return a natural cubic spline through three values at distance 1/2."""
    t = 2.0 * min(z, 1.0 - z)
    first, middle, last = (values[..., k] for k in range(3))
    straight = (1.0 - t) * (first if z < 0.5 else last) + t * middle
    return straight + 0.25 * (first - 2.0 * middle + last) * (t**3 - t)


def reference(f, g, intensity, below, pose, sigma):
    """Return position, size and radiance at the pupil centre; leading axes of the parameters are arbitrary."""
    brightness, along, size = pose
    w, g = sigma**2, size * g
    over = 1.0 + below[..., 1] * w
    place = sigma * (f[..., 0] + f[..., 3] * w + f[..., 9] * w * w) / over + along
    across = (g[..., 0] + g[..., 3] * w) / over
    radially = across + (w * (f[..., 2] + f[..., 8] * w) - sigma * below[..., 0] * place) / over
    return place, across, brightness * (intensity[..., 0] + intensity[..., 3] * w) / np.abs(across * radially)


def test_a_round_ghost_has_the_centroid_area_and_radiance_of_its_picture():
    plain = np.zeros(NUMBERS)
    plain[[0, 3, 10, 13, 20, 23]] = 40.0, -12.0, 15.0, 3.0, 900.0, 200.0
    channel = channel_of(plain, 0)
    round_one = AberrationGhost(
        name="1", red=channel, green=channel, blue=channel, visible_deg=(0.0, 25.0), curves=CURVES
    )
    model = planted().replace(ghosts=(round_one,), halo=None, star=None)
    found = middles_of(round_one, ANGLES, LARGEST)
    for k, angle in enumerate(ANGLES):
        light = replay_model(model, float(angle))[0].pixels[..., 1].astype(float)
        x = np.arange(light.shape[1]) + 0.5 - model.axis_px[0]
        assert (light.sum(axis=0) @ x) / light.sum() == pytest.approx(found.values[1, PLACE, k], abs=0.02)
        brightest = found.values[1, RADIANCE, k]
        assert light.max() == pytest.approx(brightest, rel=1e-3)
        # the light is uniform, so that the area yields the size
        assert np.sqrt(light.sum() / brightest / np.pi) == pytest.approx(found.values[1, SIZE, k], rel=2e-3)


def test_values_equal_a_reference_with_curves():
    one = ghost()
    found = middles_of(one, ANGLES, LARGEST)
    for k, angle in enumerate(ANGLES):
        z = angle / 25.0
        for m, channel in enumerate((one.red, one.green, one.blue)):
            pose = spline(np.array([1.0, 1.4, 0.8]), z), 0.5 - 1.5 * z, 1.1
            numbers = (np.array(each) for each in (channel.f, channel.g, channel.intensity, channel.below))
            wanted = reference(*numbers, pose, field(float(angle), LARGEST))
            assert found.values[m, :, k] == pytest.approx(wanted, rel=1e-9)


def test_deviations_equal_those_of_random_parameters():
    curves = Curves(brightness=CURVES.brightness, along_px=CURVES.along_px)
    one = ghost(reported(), curves)
    found = middles_of(one, ANGLES, LARGEST)
    rng, deviation = np.random.default_rng(7), channel_deviation(one.green)
    n = 10000
    drawn = np.zeros((3, n, NUMBERS))
    for m, channel in enumerate((one.red, one.green, one.blue)):
        numbers = np.concatenate([channel.f, channel.g, channel.intensity, np.zeros(21), channel.below])
        drawn[m] = numbers + rng.normal(size=(n, NUMBERS)) * deviation
    knots = [np.array(each.values) + rng.normal(size=(n, len(each.values))) * each.error
             for each in (curves.brightness, curves.along_px)]  # fmt: skip
    for k in (0, 2, 4):
        z = ANGLES[k] / 25.0
        pose = spline(knots[0], z), knots[1] @ np.array([1.0 - z, z]), 1.0
        seen = [reference(each[:, :10], each[:, 10:20], each[:, 20:30], each[:, 51:], pose, field(ANGLES[k], LARGEST))
                for each in drawn]  # fmt: skip
        for quantity in (PLACE, SIZE, RADIANCE):
            assert found.known(quantity, 1).deviation[k] == pytest.approx(np.std(seen[1][quantity]), rel=0.03)
        # the curve shifts both colours alike
        red = found.apart(PLACE, 0, 1)
        assert red.deviation[k] == pytest.approx(np.std(seen[0][0] - seen[1][0]), rel=0.03)
        assert red.deviation[k] < np.hypot(found.known(PLACE, 0).deviation[k], found.known(PLACE, 1).deviation[k])


def test_a_negative_constellation_reverses_positions():
    found = middles_of(ghost(reported(), Curves()), np.concatenate([-ANGLES, [0.0], ANGLES]), LARGEST).known(PLACE, 1)
    assert found.value[:5] == pytest.approx(-found.value[6:], rel=1e-12)
    assert found.deviation[:5] == pytest.approx(found.deviation[6:], rel=1e-12)
    assert (found.value[5], found.deviation[5]) == (0.0, 0.0)


@pytest.mark.parametrize("uncertainty", [(), (0.0,) * 30])
def test_without_stored_uncertainty_deviations_are_0(uncertainty):
    found = middles_of(ghost(uncertainty, Curves()), ANGLES, LARGEST)
    assert found.changes.shape == (0, 3, 3, 5)
    assert (found.known(RADIANCE, 1).deviation == 0.0).all()
    assert (found.apart(PLACE, 0, 1).deviation == 0.0).all()


@pytest.mark.parametrize("last", [0, 1, 3, 7, 9])
def test_uncertainties_are_read_in_the_order_of_writing(last):
    rng = np.random.default_rng(last)
    numbers, deviation = rng.uniform(0.5, 1.0, NUMBERS), np.zeros(NUMBERS)
    deviation[:36] = rng.uniform(0.1, 0.2, 36)
    deviation[44 : 44 + last] = rng.uniform(0.1, 0.2, last)
    if last < 9:
        numbers[44 + last :] = 0.0
    read = channel_deviation(channel_of(numbers, 2, deviation))
    as_root = deviation[44] / (2.0 * np.sqrt(numbers[44])) if last else 0.0
    assert np.delete(read, 44) == pytest.approx(np.delete(deviation, 44))
    assert read[44] == pytest.approx(as_root)
