"""An iris given as an image: each pixel receives the mean transmittance of the image over it."""

from functools import cache

import numpy as np
import pytest

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.raster.bundle import draw_bundle, node_densities
from flarewright.kernels.raster.iris_mask import even_value, mask_value
from flarewright.kernels.raster.polygons import blank_plane, to_pixels
from flarewright.kernels.raster.stop_pattern import AT_X, AT_Y, COLUMNS, FIRST, PER_MM_X, PER_MM_Y, ROWS
from flarewright.kernels.tracing.sequential import ALIVE, STOP_X, WEIGHT, X, Y
from flarewright.model import Iris, Light, Project
from flarewright.optics.pupil.mask_levels import mask_levels
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project

SIDE = 48


def square_bundle(n, crossings=1, scale=1.0):
    """Return a square bundle of n x n cells, 2 mm wide, in focus at every stop crossing, mirrored at the second."""
    at = np.linspace(-1.0, 1.0, n + 1)
    px, py = (g.ravel() for g in np.meshgrid(at, at, indexing="ij"))
    data = np.zeros((px.size, STOP_X + 2 * crossings))
    # the upright picture is the sensor turned by half a turn
    data[:, X], data[:, Y] = -scale * px, -scale * py
    data[:, WEIGHT] = data[:, ALIVE] = 1.0
    for c in range(crossings):
        data[:, STOP_X + 2 * c], data[:, STOP_X + 2 * c + 1] = (px, py) if c == 0 else (-px, py)
    k = np.arange(px.size).reshape(n + 1, n + 1)
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return data, np.stack([px, py], axis=1), triangles


def drawn(mask, n=4, crossings=1, zoom=20.0):
    data, pupil, triangles = square_bundle(n, crossings)
    plane = blank_plane(SIDE, SIDE)
    draw_bundle(
        data, pupil, triangles, node_densities(data, pupil, triangles), crossings, np.zeros((0, 4)),
        mask_levels(mask, 1.0), np.eye(2), np.array([SIDE / 2, SIDE / 2, zoom, zoom]), 1.0, np.ones(3), plane, 1,
    )  # fmt: skip
    return to_pixels(plane, SIDE)[..., 0].astype(float)


def gear(side, teeth=7):
    """Return a gear-shaped mask with an antialiased border."""
    fine = 4 * side
    at = (np.arange(fine) + 0.5) * 2.0 / fine - 1.0
    angle, radius = np.arctan2(-at[:, None], at), np.hypot(at, at[:, None])
    inside = radius < 0.8 + 0.1 * np.sign(np.sin(teeth * angle))
    return inside.reshape(side, 4, side, 4).mean(axis=(1, 3))


def means(mask, zoom, *, twice=False):
    """Return the mask, interpolated linearly between texel centres, averaged over pixels."""
    times = 32
    where = ((np.arange(SIDE * times) + 0.5) / times - SIDE / 2) / zoom
    at = np.clip(0.5 * (where + 1.0) * len(mask) - 0.5, 0.0, len(mask) - 1.001)
    low = at.astype(int)
    part = at - low
    rows = mask[low] * (1.0 - part[:, None]) + mask[low + 1] * part[:, None]
    fine = rows[:, low] * (1.0 - part) + rows[:, low + 1] * part
    fine = fine * fine[:, ::-1] if twice else fine
    inside = np.abs(where) < 1.0
    fine = fine * (inside[:, None] & inside)
    return fine.reshape(SIDE, times, SIDE, times).mean(axis=(1, 3)) / zoom**2


@cache
def gear_and_means(texels):
    mask = gear(texels)
    return mask, means(mask, 20.0)


@pytest.mark.parametrize("texels", [16, 40, 64, 300, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("cells", [1, 4, 37])
def test_a_pixel_holds_the_mean_of_the_mask_over_it(texels, cells):
    mask, expected = gear_and_means(texels)
    got = drawn(mask, cells)
    assert got.sum() == pytest.approx(expected.sum(), rel=2e-3)
    # means are approximated by pixel centres on a pyramid level, so the border is slightly softer or sharper
    assert np.abs(got - expected).sum() < 0.04 * expected.sum()
    assert np.abs(got - expected).max() < 0.25 / 20.0**2


def test_stripes_finer_than_pixels_are_even_grey():
    """Sampled at pixel centres without a pyramid they would alias."""
    mask = np.zeros((512, 512))
    mask[:, ::2] = 1.0
    got = drawn(mask)[8:40, 8:40]
    np.testing.assert_allclose(got, 0.5 / 20.0**2, rtol=1e-4)


def test_two_crossings_multiply():
    mask = gear(64, 5)
    got = drawn(mask, crossings=2)
    expected = means(mask, 20.0, twice=True)
    assert got.sum() == pytest.approx(expected.sum(), rel=5e-3)
    assert np.abs(got - expected).sum() < 0.03 * expected.sum()


def test_the_table_of_changes_finds_where_a_mask_is_constant():
    rng = np.random.default_rng(4)
    mask = np.kron(rng.integers(0, 3, (4, 3)), np.ones((5, 7))) / 2.0
    levels = mask_levels(mask, 2.0)
    find = for_python(even_value)
    rows, columns = mask.shape
    constant = 0
    for _ in range(400):
        u, v = np.sort(rng.uniform(-1.9, 1.9, (2, 2)), axis=1)
        if rng.random() < 0.5:
            u[1], v[1] = u[0] + 0.2, v[0] + 0.2
        value = find(levels, u[0], u[1], v[0], v[1])
        # all texels that linear interpolation may read
        c = np.clip(np.floor((u / 2.0 + 1.0) * 0.5 * columns - 0.5) + np.arange(2), 0, columns - 1).astype(int)
        r = np.clip(np.floor((1.0 - v[::-1] / 2.0) * 0.5 * rows - 0.5) + np.arange(2), 0, rows - 1).astype(int)
        seen = mask[r[0] : r[1] + 1, c[0] : c[1] + 1]
        assert value == (seen[0, 0] if np.ptp(seen) == 0.0 else -1.0)
        constant += value >= 0.0
    assert 40 < constant < 360


@pytest.mark.parametrize("shape", [(64, 64), (37, 90), (2, 2), (5, 301)])
def test_levels_keep_their_place_and_their_light(shape):
    rows, columns = shape
    # values increase to the right and upwards, so that each sample encodes its place
    x = ((np.arange(columns) + 0.5) / columns * 2.0 - 1.0) * 3.0
    y = -((np.arange(rows) + 0.5) / rows * 2.0 - 1.0) * 3.0
    values, table, _ = mask_levels(0.5 + 0.1 * x + 0.05 * y[:, None], 3.0)
    for row in table:
        first, height, width = (int(row[k]) for k in (FIRST, ROWS, COLUMNS))
        level = values[first : first + height * width].reshape(height, width)
        at_x = (np.arange(width) - row[AT_X]) / row[PER_MM_X]
        at_y = (np.arange(height) - row[AT_Y]) / row[PER_MM_Y]
        ramp = 0.5 + 0.1 * at_x + 0.05 * at_y[:, None]
        # the last row and column may be repeated ones
        np.testing.assert_allclose(level[: height - 1, : width - 1], ramp[: height - 1, : width - 1], atol=1e-5)


def test_an_image_of_the_opening_stands_upright():
    """The first row is the top, the first column the left; interpolated between samples, dark outside."""
    half = 2.0
    value = for_python(mask_value)
    image = np.array([[0.9, 0.5], [0.3, 0.1]], dtype=np.float32)
    for (row, column), expected in np.ndenumerate(image):
        assert value(image, half, column * half - 0.5 * half, 0.5 * half - row * half) == pytest.approx(expected)
    assert value(image, half, 0.0, 0.0) == pytest.approx(0.45)
    assert value(image, half, 0.0, 1.0) == pytest.approx(0.7)
    assert value(image, half, 0.0, 2.5) == 0.0


def test_a_rotated_image_of_many_pixels_is_halved_and_keeps_its_light_and_place(monkeypatch):
    settled = resolve_project(
        Project(lens="triplet-pestrecov", iris=Iris(rotation_deg=25.0), lights=(Light(field_deg=(5.0, 3.0)),))
    )
    image = np.add.outer(np.linspace(1.0, 0.0, 120), np.linspace(0.0, 0.5, 120)) / 1.5
    whole = make_opening(settled, image)
    monkeypatch.setattr("flarewright.render.scene.opening.MOST_ROTATED", 100)
    halved = make_opening(settled, image)
    assert (len(whole.mask), len(halved.mask)) == (170, 85)
    assert halved.half == whole.half
    assert halved.mean_transmittance == pytest.approx(whole.mean_transmittance, rel=1e-3)
    assert 0.25 * (halved.mask[:-1, :-1] + halved.mask[1:, :-1] + halved.mask[:-1, 1:] + halved.mask[1:, 1:])[
        20:60, 20:60
    ] == pytest.approx(whole.mask[1:-1, 1:-1].reshape(84, 2, 84, 2).mean(axis=(1, 3))[20:60, 20:60], abs=1e-3)


@pytest.mark.parametrize("texels", [2, 4, 8, 16])
def test_stripes_are_as_bright_at_their_ends(texels):
    """Beyond the last sample a mask goes on as that sample; cells there took the value of a corner."""
    mask = np.repeat((np.arange(texels) >= texels // 2).astype(float)[:, None], texels, axis=1)
    for stripes, axis in ((mask, 0), (mask.T, 1)):
        sums = drawn(np.ascontiguousarray(stripes), n=16).sum(axis=axis)
        lit = sums[sums > 0.0]
        np.testing.assert_allclose(lit[1:-1], np.median(lit), rtol=1e-5)
