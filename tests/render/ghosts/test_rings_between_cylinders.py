"""Rings of ghosts in an anamorphic lens: Collins' integral with a matrix for each meridian, channel by channel."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import fresnel
from sensor_rays import trace_rays

from flarewright.model import D65, Art, Camera, Iris, Light, Output, Project, Quality, Rule, Surface
from flarewright.optics.colour.spectrum import band_weights
from flarewright.optics.lens.paraxial import flare_matrices
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.ghosts import diffraction_rings
from flarewright.render.ghosts.diffraction_rings import _Crossing
from flarewright.render.ghosts.ring_tables import EdgeCrossing
from flarewright.render.render import render
from flarewright.render.scene.resolve import resolve_project

LENS = "anamorphic-heliar-2x"
WAVES = np.arange(400.0, 701.0, 10.0)
NAMES = (("stop_x", "x"), ("stop_y", "y"))


def one_ghost(ghost, rings, camera):
    return Project(
        lens=LENS, f_number=16.0, iris=Iris(blades=4), lights=(Light(field_deg=(0.0, 0.0)),), camera=camera,
        quality=Quality(ringing=rings, wavelengths=11), output=Output(starburst=False, layers="passes"),
        art=Art(rules=(Rule(select="all", enable=False), Rule(select=ghost, enable=True))),
    )  # fmt: skip


def picture(wanted):
    layer = {layer.name: layer for layer in render(wanted).layers}["ghosts"]
    width, height = wanted.camera.size_px
    pixels = np.zeros((height, width, 3))
    x, y, w, h = layer.window
    pixels[y : y + h, x : x + w] = layer.pixels
    return pixels


def slit(at, half, scale):
    (s1, c1), (s2, c2) = fresnel((at + half) / scale), fresnel((at - half) / scale)
    return 0.5 * ((c1 - c2) ** 2 + (s1 - s2) ** 2)


def along(lens, axis, path, order, packed, sharp, pixel):
    """Return the light along one meridian, a row per wavelength, and the pixels well inside the ghost."""
    count, half = len(sharp), 0.5 * math.sqrt(math.pi) * order.stop_semi_diameter
    z = sum(row.thickness for row in lens.rows[:-1]) + order.sensor_distance
    fine = pixel * ((np.arange(count * 16) + 0.5) / 16 - 0.5 * count)
    pupil = np.linspace(-20.0, 20.0, 2001)
    found = []
    for w, wave in enumerate(WAVES):
        Ma, Ms = flare_matrices(lens, path, wave, z)
        magnification = Ms[0, 0] + Ms[0, 1] * Ma[1, 0] / Ma[0, 0]
        scale = math.sqrt(abs(1e-6 * wave * Ms[0, 1] / magnification) / 2.0)
        # matrices give the diffraction, rays the positions
        rays = trace_rays(packed, path, *(pupil, 0.0 * pupil)[:: 1 - 2 * axis], (0.0, 0.0), w)
        stop, there = (rays[name] * np.sign(magnification) ** k for k, name in enumerate(NAMES[axis]))
        held = (rays["status"] > 0) & (rays["rel_radius"] <= 1.0) & (np.abs(stop) < 1.3 * half)
        order_of = np.argsort(there[held])
        stop, there = stop[held][order_of], there[held][order_of]
        inner = np.abs(stop) < 0.1 * half
        assert np.polyfit(stop[inner], there[inner], 1)[0] == pytest.approx(abs(magnification), rel=0.02)
        found.append(slit(np.interp(fine, there, stop), half, scale).reshape(count, 16).mean(axis=1))
    edge = int(np.flatnonzero(sharp > 0.5 * sharp[count // 2])[0])
    return np.array(found), np.abs(np.arange(count) + 0.5 - 0.5 * count) < 0.5 * count - edge - 1.5


@pytest.mark.parametrize(
    ("ghost", "size_px", "sensor_mm", "tabled", "part"),
    [
        # behind the cylinders
        pytest.param("10-8", (280, 280), (24.0, 24.0), True, 0.12, marks=pytest.mark.slow),
        # between them: L with one sign in both meridians, similar and not, and with both signs
        pytest.param("8-3", (240, 240), (24.0, 28.0), False, 0.25, marks=pytest.mark.slow),
        pytest.param("6-3", (100, 300), (3.2, 12.0), False, 0.25, marks=pytest.mark.slow),
        ("10-3", (160, 200), (6.4, 8.0), False, 0.15),
    ],
)
def test_a_ghost_is_collins_integral_of_both_meridians(ghost, size_px, sensor_mm, tabled, part, monkeypatch):
    """Second method: lens matrices with the curvatures of either meridian, analytic slits, colour by colour."""
    served = []
    known = diffraction_rings._crossing

    def watched(*given):
        served.append(known(*given))
        return served[-1]

    monkeypatch.setattr(diffraction_rings, "_LAST", diffraction_rings._Last())
    monkeypatch.setattr(diffraction_rings, "_crossing", watched)
    camera = Camera(size_px=size_px, sensor_mm=sensor_mm)
    wanted = one_ghost(ghost, "collins", camera)
    sharp, found = picture(one_ghost(ghost, "off", camera)), picture(wanted)
    assert [type(crossing) for crossing in served] == [EdgeCrossing if tabled else _Crossing]
    settled = resolve_project(wanted)
    path = next(path for path in ghost_paths(settled.lens, "all") if path.name == ghost)
    packed = pack_lens(settled.lens, settled.order, (None,) * len(settled.lens.rows), WAVES)
    upright = settled.lens.replace(rows=tuple(
        row.replace(curvature_x=None) if isinstance(row, Surface) else row for row in settled.lens.rows
    ))  # fmt: skip
    across = settled.lens.replace(rows=tuple(
        row.replace(curvature=row.curvature if row.curvature_x is None else row.curvature_x, curvature_x=None)
        if isinstance(row, Surface) else row for row in settled.lens.rows
    ))  # fmt: skip
    width, height = size_px
    middle = np.s_[height // 2 - 5 : height // 2 + 5], np.s_[width // 2 - 5 : width // 2 + 5]
    row, column = sharp[middle[0]].mean(axis=0), sharp[:, middle[1]].mean(axis=1)
    x, inside_x = along(across, 0, path, settled.order, packed, row.sum(axis=1), sensor_mm[0] / width)
    y, inside_y = along(upright, 1, path, settled.order, packed, column.sum(axis=1), sensor_mm[1] / height)
    shares = band_weights(D65(), WAVES, settled.project.output.colorspace)
    shares /= shares.sum(axis=0)
    for c in range(3):
        for expected, seen, plain, inside in (
            (shares[:, c] * y[:, middle[0]].mean(axis=1) @ x, found[middle[0]].mean(axis=0), row, inside_x),
            (shares[:, c] * x[:, middle[1]].mean(axis=1) @ y, found[:, middle[1]].mean(axis=1), column, inside_y),
        ):
            ripples = seen[inside, c] / plain[inside, c]
            error = np.sqrt(np.mean((ripples - expected[inside]) ** 2))
            assert expected[inside].std() > 0.035
            assert error < min(0.02, part * expected[inside].std())


def test_where_one_meridian_comes_to_a_focus_the_other_keeps_its_fringes(monkeypatch):
    """Near a focus on the sensor the Fresnel area across grows fourfold from blue to red, that down by 1.8."""
    asked = []
    real = diffraction_rings.Ringing.pattern

    def watched(self, item, window, areas, shares):
        asked.append((item, shares @ areas))
        return real(self, item, window, areas, shares)

    monkeypatch.setattr(diffraction_rings, "_LAST", diffraction_rings._Last())
    monkeypatch.setattr(diffraction_rings.Ringing, "pattern", watched)
    camera = Camera(size_px=(240, 135), desqueeze=True)
    picture(one_ghost("12-3", "collins", camera).replace(f_number=8.0, lights=(Light(field_deg=(6.0, 3.0)),)))
    known = [(item, mean) for item, mean in asked if abs(item.area[-1, 0]) > 3.0 * abs(item.area[0, 0])]
    assert known
    for item, mean in known:
        # the width down and across agree with interpolation between the neighbouring traced wavelengths
        at = np.interp(mean[1], np.abs(item.area[:, 1]), np.abs(item.area[:, 0]))
        assert abs(mean[0]) == pytest.approx(at, rel=0.05)
