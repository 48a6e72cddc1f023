"""Sources of a plate: their sums are the plate's, their moments its moments, and a hot pixel moves no lamp."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.errors import ProjectError
from flarewright.plates.detection import LUMINANCE, Sources, find_sources, log_average_luminance

RNG = np.random.default_rng(3)
ROWS, COLUMNS = np.mgrid[:120, :160] + 0.5


def plate(level=0.1):
    return np.full((120, 160, 3), level, np.float32)


def disc(pixels, x, y, radius, rgb):
    pixels[np.hypot(COLUMNS - x, ROWS - y) < radius] = rgb
    return pixels


def test_the_sum_of_the_sources_is_that_of_the_plate_over_the_threshold():
    pixels = plate() + RNG.exponential(0.5, (120, 160, 3)).astype(np.float32)
    for _ in range(30):
        disc(pixels, *RNG.uniform(5, 115, 2), RNG.uniform(0.5, 9), RNG.uniform(2, 90, 3))
    over = pixels @ LUMINANCE > 1.0
    found = find_sources(pixels, 1.0)
    assert len(found) > 30
    assert found.light.sum(axis=0) == pytest.approx(pixels[over].sum(axis=0, dtype=float), rel=1e-6)
    # a matte removes light before the threshold
    matte = (COLUMNS < 80).astype(np.float32)
    half = find_sources(pixels, 1.0, matte=matte)
    assert half.light.sum(axis=0) == pytest.approx(pixels[over & (COLUMNS < 80)].sum(axis=0, dtype=float), rel=1e-6)
    assert (half.centre_px[:, 0] < 80).all()


def test_a_hot_pixel_moves_a_lamp_by_less_than_a_pixel_and_is_a_source_itself():
    for size in (8, 64):
        pixels = plate()
        pixels[20 : 20 + size, 30 : 30 + size] = 1.0
        clean = find_sources(pixels, 0.5)
        pixels[21, 31] = 40.0
        found = find_sources(pixels, 0.5)
        lamp = int(np.argmax(found.area_px))
        assert np.hypot(*(found.centre_px[lamp] - clean.centre_px[0])) < 0.02
        assert len(found) == 2
        assert found.light.sum(axis=0) == pytest.approx(np.full(3, size**2 + 39.0), rel=1e-5)
        # without sources of one pixel the lamp alone is left, as if there were no defect
        assert find_sources(pixels, 0.5, least_px=2).light == pytest.approx(clean.light, rel=1e-5)


def test_a_lamp_of_one_pixel_is_no_hot_pixel():
    pixels = plate(0.0)
    pixels[10, 20] = (3.0, 5.0, 7.0)
    found = find_sources(pixels, 1.0)
    assert found.centre_px.tolist() == [[20.5, 10.5]]
    assert found.light.tolist() == [[3.0, 5.0, 7.0]]
    assert found.moments_px2[0] == pytest.approx([1 / 12, 0, 1 / 12])


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, -60.0])
def test_a_bar_has_the_moments_of_a_rectangle(angle_deg):
    turn = np.radians(angle_deg)
    along = (COLUMNS - 80) * np.cos(turn) + (ROWS - 60) * np.sin(turn)
    across = -(COLUMNS - 80) * np.sin(turn) + (ROWS - 60) * np.cos(turn)
    pixels = plate()
    pixels[(np.abs(along) < 30) & (np.abs(across) < 3)] = 9.0
    found = find_sources(pixels, 1.0)
    assert len(found) == 1
    xx, xy, yy = found.moments_px2[0]
    short, long = np.sqrt(12.0 * np.linalg.eigvalsh([[xx, xy], [xy, yy]]))
    assert (long, short) == (pytest.approx(60, rel=0.02), pytest.approx(6, rel=0.1))


def test_shapes_that_are_no_rectangle_are_split_until_their_parts_are():
    # an L, two lamps in a common glow, and a sign of two colours
    corner, glow, sign = plate(), plate(), plate()
    corner[20:90, 40:46] = corner[84:90, 40:110] = 9.0
    for x in (60, 90):
        disc(glow, x, 60, 4, 90.0)
    glow[56:64, 60:90] = np.maximum(glow[56:64, 60:90], 1.5)
    sign[50:70, 40:80], sign[50:70, 80:120] = (9.0, 0.5, 0.5), (0.5, 9.0, 0.5)
    for pixels, least in ((corner, 2), (glow, 2), (sign, 2)):
        found = find_sources(pixels, 1.0)
        assert len(found) >= least
        assert found.light.sum(axis=0) == pytest.approx(pixels[pixels @ LUMINANCE > 1.0].sum(axis=0), rel=1e-5)
        # the whole area's peak says whether its parts count
        assert len(set(found.peak)) == 1
    red, green = find_sources(sign, 1.0).light
    assert red[0] > 10 * red[1]
    assert green[1] > 10 * green[0]
    # each arm of the L is a bar
    x, y = find_sources(corner, 1.0).centre_px.T
    assert x.max() > 60
    assert y.min() < 70


def test_a_mean_in_stops_hardly_depends_on_a_small_sun():
    pixels = plate(0.2)
    dark = log_average_luminance(pixels)
    assert dark == pytest.approx(0.2, rel=0.01)
    assert log_average_luminance(disc(pixels, 80, 60, 3, 5000.0)) == pytest.approx(0.2, rel=0.1)
    assert log_average_luminance(plate(0.0)) == 0.0


def test_noise_above_the_threshold_is_refused_in_one_sentence():
    noise = np.zeros((400, 400, 3), np.float32)
    noise[::2, ::2] = 2.0
    with pytest.raises(ProjectError, match="40000 sources above 1, which is noise; raise the threshold"):
        find_sources(noise, 1.0)
    assert len(find_sources(noise, 1.0, least_px=2)) == 0


def test_a_table_of_sources_holds_all_of_them():
    found = find_sources(disc(plate(), 40, 30, 5, 9.0), 1.0)
    again = Sources.from_table(found.table)
    assert all(np.array_equal(getattr(found, name), getattr(again, name)) for name in ("centre_px", "light", "peak"))
    assert len(find_sources(plate(), 1.0)) == 0
