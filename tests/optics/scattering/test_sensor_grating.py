"""The sensor as a grating: the grating equation, Parseval, and landing points of orders."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import flarewright as fw
from flarewright.model import Camera, Light, Lines, Output, Plate, Project, Quality, SensorGrating
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.rays.pack import pack_lens
from flarewright.optics.rays.single_rays import trace_polylines
from flarewright.optics.scattering.sensor_grating import grating_orders, order_efficiency, return_trip
from flarewright.render.render import render
from flarewright.render.scene.resolve import build, load_lens

LINE_NM = 550.0


@pytest.mark.parametrize("fill", [0.2, 0.5, 0.83, 1.0])
def test_orders_hold_all_that_is_reflected(fill):
    m = np.arange(-200_000, 200_001)
    assert order_efficiency(m, fill).sum() == pytest.approx(1.0, abs=2e-5)
    # against the transform of sampled cells
    samples = 4000
    field = (np.arange(samples) < fill * samples).astype(float)
    power = np.abs(np.fft.fft(field) / samples) ** 2 / fill
    assert order_efficiency(np.arange(6), fill) == pytest.approx(power[:6], abs=1e-4)


def packed_with_glass(gap=0.7, thickness=2.0):
    built = build(load_lens("heliar-tronnier"), cover_glass=Plate(glass="N-BK7", thickness=thickness, gap=gap))
    order = first_order(built.lens, 8.0)
    lens = built.lens
    return lens, pack_lens(lens, order, (None,) * len(lens.rows), np.array([LINE_NM, 650.0])), order


def test_the_grating_equation_at_a_plane_in_air():
    """From the back of the cover glass, orders land at 2 gap tan(angle), sin(angle) = m lambda / period."""
    lens, packed, _ = packed_with_glass(gap=0.7)
    grating = SensorGrating(period_um=4.0, fill=0.6, orders=8)
    orders = {order.order: order for order in grating_orders(packed, len(lens.rows) - 1, grating)}
    assert orders[(0, 0)].shift_mm == pytest.approx(0.0)
    for m, n in ((1, 0), (0, -2), (3, 2)):
        sine = np.hypot(m, n) * packed.wavelengths_nm * 1e-3 / 4.0
        away = 2.0 * 0.7 * np.tan(np.arcsin(sine))
        assert np.hypot(*orders[(m, n)].shift_mm.T) == pytest.approx(away, rel=1e-12)
        # in the direction of the order
        assert orders[(m, n)].shift_mm * [n, m] @ [1.0, -1.0] == pytest.approx(0.0, abs=1e-12)
    # sin(angle) > 1: an evanescent order
    assert np.isnan(orders[(7, 3)].shift_mm[0]).all() if (7, 3) in orders else True


@pytest.mark.parametrize("row", [4, 6, 8])
def test_the_way_back_is_that_of_traced_rays(row):
    """A ghost sensor-I of two parallel bundles: its rays through one sensor point diverge by B times their slopes."""
    lens, packed, order = packed_with_glass()
    row = len(lens.rows) - 1 if row == 8 else row
    shift, height = return_trip(packed, row, 0)
    # rays that arrive at nearly one point of the sensor with different slopes
    y = np.array([-1e-3, 1e-3])
    hits = trace_polylines(
        lens, (len(lens.rows), row), np.zeros(2), y, 0.0, sensor_distance=order.sensor_distance, wavelength_nm=LINE_NM
    )
    # the sensor is the step after the last refraction: its hit has the sensor's z
    first = int(np.flatnonzero(np.isclose(hits[0, :-1, 2], packed.sensor_z))[0])
    arrive, leave = hits[:, first, 1], hits[:, -1, 1]
    before = hits[:, first - 1]
    slope = (arrive - before[:, 1]) / (packed.sensor_z - before[:, 2])
    # y' = A y + B u; A from rays of an off-axis light
    beside = trace_polylines(
        lens, (len(lens.rows), row), np.zeros(2), y, -1e-5, sensor_distance=order.sensor_distance, wavelength_nm=LINE_NM
    )
    u = np.append(slope, (beside[:, first, 1] - beside[:, first - 1, 1]) / (packed.sensor_z - beside[:, first - 1, 2]))
    places = np.append(arrive, beside[:, first, 1])
    found, *_ = np.linalg.lstsq(np.stack([places, u], axis=1), np.append(leave, beside[:, -1, 1]), rcond=None)
    assert found[1] == pytest.approx(shift, rel=1e-5)
    at_mirror = hits[:, np.flatnonzero(np.diff(np.sign(np.diff(hits[0, :, 2]))) > 0)[0] + 1, 1]
    assert np.isfinite(at_mirror).all()
    assert abs(height) > 0.0


def frame(grating, fill=0.7):
    return Project(
        lens="heliar-tronnier",
        f_number=16.0,
        lights=(Light(field_deg=(0.5, 0.3), spectrum=Lines(lines=((LINE_NM, 1.0),))),),
        camera=Camera(
            size_px=(240, 160), sensor_mm=(12.0, 8.0), sensor_reflectance=0.2,
            cover_glass=Plate(glass="N-BK7", thickness=1.0, gap=1.5),
            sensor_grating=None if grating is None else SensorGrating(period_um=grating, fill=fill, orders=2),
        ),
        quality=Quality(wavelengths=1, ringing="off"),
        output=Output(layers="ghosts", starburst=False),
    )  # fmt: skip


def picture(rendering, name):
    layer = next(layer for layer in rendering.layers if layer.name == name)
    whole = np.zeros((160, 240))
    x, y, width, height = layer.window
    whole[y : y + height, x : x + width] = layer.pixels[..., 1]
    return whole


@cache
def plain_mirror():
    return render(frame(None))


def test_a_picture_shows_orders_where_the_equation_puts_them():
    mirrored, diffracted = plain_mirror(), render(frame(4.0))
    # from the back of the cover glass
    name = "ghost.sensor-10"
    plain, orders = picture(mirrored, name), picture(diffracted, name)
    step = 2.0 * 1.5 * np.tan(np.arcsin(LINE_NM * 1e-3 / 4.0)) * 20.0
    row, column = (np.arange(160) @ plain.sum(axis=1), np.arange(240) @ plain.sum(axis=0)) / plain.sum()
    whole = plain.sum()
    for m in (-2, -1, 0, 1, 2):
        away = 2.0 * 1.5 * np.tan(np.arcsin(m * LINE_NM * 1e-3 / 4.0)) * 20.0
        low, high = (round(column + away + side * step) for side in (-0.5, 0.5))
        strip = orders[round(row - step / 2) : round(row + step / 2), low:high]
        share = float(order_efficiency(m, 0.7) * order_efficiency(0, 0.7))
        assert strip.sum() == pytest.approx(share * whole, rel=0.02)
        assert np.arange(low, high) @ strip.sum(axis=0) / strip.sum() == pytest.approx(column + away, abs=0.2)
    assert any("orders of the sensor's grating" in remark for remark in diffracted.remarks)


def test_an_even_mirror_is_a_grating_without_dark_fields():
    mirrored, even = plain_mirror(), render(frame(8.0, fill=1.0))
    for a, b in zip(mirrored.layers, even.layers, strict=True):
        # pytest.approx compares pixels one by one, which is slow
        assert b.pixels.shape == a.pixels.shape
        assert np.allclose(b.pixels, a.pixels, rtol=1e-6, atol=1e-12)


def test_what_cannot_be_seen_is_told():
    blind = frame(8.0)
    blind = blind.replace(camera=blind.camera.replace(sensor_reflectance=0.0))
    assert any("nothing without" in remark for remark in render(blind).remarks)
    draft = frame(8.0).replace(quality=Quality(mode="draft", wavelengths=1))
    assert any("is for final quality" in remark for remark in fw.render(draft).remarks)
