"""Rings are drawn by default, but only where they are visible, and at no cost where there are none."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from flarewright.kernels.diffraction import ringing as kernel
from flarewright.model import Camera, Iris, Light, Output, Project, Quality
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.pupil.polygon import closed
from flarewright.render.ghosts import ring_visibility
from flarewright.render.ghosts.background_level import COARSE, sketch
from flarewright.render.ghosts.ring_visibility import blurs, least_blur
from flarewright.render.ghosts.traced_ghosts import draw_final, find_final
from flarewright.render.image.canvas import blank, merge
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

LUMINANCE = (0.2126, 0.7152, 0.0722)


def project(f_number=8.0, ringing=None, **changes):
    fields = {
        "lens": "heliar-tronnier",
        "f_number": f_number,
        "iris": Iris(blades=6),
        "lights": (Light(field_deg=(10.0, 5.0)),),
        "camera": Camera(size_px=(640, 360)),
        "output": Output(starburst=False),
        "quality": Quality(wavelengths=3) if ringing is None else Quality(wavelengths=3, ringing=ringing),
    }
    return Project.model_validate({**fields, **changes})


def picture(wanted):
    layer = {layer.name: layer for layer in render(wanted).layers}["ghosts"]
    width, height = wanted.camera.size_px
    pixels = np.zeros((height, width))
    x, y, w, h = layer.window
    pixels[y : y + h, x : x + w] = layer.pixels @ LUMINANCE
    return pixels


def watched(patch):
    """Return a list that gets for each ghost with rings whether they are drawn."""
    reported = []

    def noted(*known):
        reported.append(real(*known))
        return reported[-1]

    real = ring_visibility.ripples_seen
    patch.setattr(ring_visibility, "ripples_seen", noted)
    return reported


@pytest.fixture
def drawn(monkeypatch):
    return watched(monkeypatch)


@cache
def standard():
    """Return the picture of the standard project, and for each ghost with rings whether they are drawn."""
    with pytest.MonkeyPatch.context() as patch:
        drawn = watched(patch)
        return picture(project()), tuple(drawn)


def test_final_quality_has_rings_by_default():
    (found, drawn), sharp = standard(), picture(project(ringing="off"))
    assert any(drawn)
    assert np.abs(found - sharp).max() > 0.1 * sharp.mean()
    assert found.sum() == pytest.approx(sharp.sum(), rel=2e-3)


def test_the_first_command_needs_no_kernel_for_rings(monkeypatch):
    """Wide open, the rings of the Heliar lie in the light of other ghosts."""

    def refuse(*_):
        raise AssertionError("rings were drawn")

    wanted = project(None, lights=(Light(field_deg=(12.0, 7.0)),), camera=Camera())
    monkeypatch.setattr("flarewright.render.ghosts.diffraction_rings.draw_ringing", refuse)
    assert kernel.draw_ringing is not refuse
    assert np.array_equal(picture(wanted), picture(wanted.replace(quality=Quality(wavelengths=3, ringing="off"))))


@pytest.mark.parametrize(
    ("f_number", "light"),
    [
        pytest.param(5.6, (4.0, 3.0), marks=pytest.mark.slow),
        (8.0, (10.0, 5.0)),
        pytest.param(None, (12.0, 7.0), marks=pytest.mark.slow),
    ],
)
def test_rings_that_are_not_drawn_are_invisible(f_number, light, drawn, monkeypatch):
    wanted = project(f_number, lights=(Light(field_deg=light),))
    found, shown = standard() if wanted == project() else (picture(wanted), drawn)
    assert not all(shown)
    monkeypatch.setattr(ring_visibility, "LEAST_RIPPLE", -1.0)
    whole = picture(wanted)
    lit = np.maximum(whole, 0.01 * whole.mean())
    assert (np.abs(found - whole) / lit).max() < 1.5 * 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "coarse", "paths"),
    [((320, 180), (160, 90), "same-side"), ((640, 360), (640, 360), "all")],
)
def test_an_area_light_washes_rings_out(size, coarse, paths, drawn):
    quality = Quality(wavelengths=3, paths=paths)
    camera = Camera(size_px=size)

    def lit_by(degrees, camera=camera):
        return project(lights=(Light(field_deg=(10.0, 5.0), diameter_deg=degrees),), quality=quality, camera=camera)

    def ripples_of(degrees):
        wanted = lit_by(degrees)
        found, sharp = picture(wanted), picture(wanted.replace(quality=quality.replace(ringing="off")))
        return (np.abs(found - sharp) / np.maximum(sharp, 0.01 * sharp.mean())).max(), found.sum() / sharp.sum()

    (point, whole), (sun, light) = ripples_of(0.0), ripples_of(0.53)
    assert sun < 0.15 * point
    assert (whole, light) == pytest.approx((1.0, 1.0), rel=2e-3)
    drawn.clear()
    picture(lit_by(4.0, Camera(size_px=coarse)))
    # for some ghosts of an area light rings are skipped that a point light would show
    assert not all(drawn)


def test_a_layer_of_its_own_is_looked_at_by_itself(drawn):
    wide = project(None, lights=(Light(field_deg=(12.0, 7.0)),), output=Output(starburst=False, layers="ghosts"))
    picture(wide.replace(quality=wide.quality.replace(paths="same-side")))
    assert any(drawn)


def test_a_sketch_is_the_ghost_seen_coarsely():
    settled = resolve_project(project())
    (shot,) = make_shots(settled, make_opening(settled, None))
    compared = 0
    for path in ghost_paths(settled.lens, "all"):
        item = find_final(shot, path)
        if item is None or item.region.seen_flux < 1e-3 * item.gain * shot.opening.radius**2 * 1e-3:
            continue
        canvas = blank(shot.size_px)
        draw_final(item, Quality(wavelengths=3), canvas)
        fine = merge(canvas.planes, shot.size_px) @ np.array(LUMINANCE)
        height, width = (-(-side // COARSE) for side in fine.shape)
        padded = np.pad(fine, ((0, height * COARSE - fine.shape[0]), (0, width * COARSE - fine.shape[1])))
        coarse = padded.reshape(height, COARSE, width, COARSE).sum(axis=(1, 3))
        if coarse.sum() <= 0.0:
            continue
        found = sketch(item).astype(np.float64)
        assert np.abs(found / found.sum() - coarse / coarse.sum()).sum() < 0.25
        compared += 1
    assert compared > 10


def test_fringes_are_blurred_by_the_least_width_of_a_light_where_they_are_alike_all_around():
    corners = np.array([[-5.0, -1.0], [5.0, -1.0], [5.0, 1.0], [-5.0, 1.0]])
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    alike = np.array([[1.6, 1.6]]) ** 2
    for shape in (corners, corners @ turn):
        assert least_blur(alike, closed(shape)) == pytest.approx(2.0 / 1.6)
    # and at least by a pixel
    assert least_blur(alike, None, 4.0) == pytest.approx(1.0 / 1.6)
    assert least_blur(alike / 16.0, closed(corners), 4.0) == pytest.approx(4.0 / 1.6)


def test_fringes_between_cylinders_are_blurred_along_their_own_normals():
    """Fringes that are wide across the picture are compared with the light's spread across it, not down it."""
    corners = np.array([[-5.0, -1.0], [5.0, -1.0], [5.0, 1.0], [-5.0, 1.0]])
    squares = np.array([[8.0**2, -(0.5**2)]])
    found = least_blur(squares, closed(corners))
    # an edge at the angle t: its scale, and the light's width along its normal
    t = np.linspace(0.0, np.pi, 2001)
    scale = np.sqrt(np.abs(64.0 * np.cos(t) ** 2 - 0.25 * np.sin(t) ** 2))
    width = np.maximum(10.0 * np.abs(np.cos(t)) + 2.0 * np.abs(np.sin(t)), 1.0)
    assert found == pytest.approx((width / np.maximum(scale, 1e-9)).min(), rel=1e-3)
    # the smallest width over the widest fringe would be far less
    assert found > 4.0 * 2.0 / 8.0


def test_patterns_are_as_coarse_as_a_light_that_spreads_them():
    corners = np.array([[-2.0, -8.0], [2.0, -8.0], [2.0, 8.0], [-2.0, 8.0]])
    assert blurs(None, 1.0) == (1.0, 1.0)
    assert blurs(closed(3.0 * corners), 1.0) == pytest.approx((4.0, 16.0), rel=0.2)
    assert blurs(closed(3.0 * corners), 8.0) == pytest.approx((1.0, 2.0), rel=0.2)
    # an oblique line blurs nothing along itself
    line = np.array([[-8.0, -8.0], [-7.9, -8.0], [8.0, 8.0], [7.9, 8.0]])
    assert blurs(closed(line), 1.0) == (1.0, 1.0)


def test_a_screen_shows_higher_ripples_only(monkeypatch):
    """Ripples of 2 %: a file has them, eight bits do not."""
    monkeypatch.setattr(ring_visibility, "ripple_height", lambda blur: 0.02 / blur)
    item, rings = SimpleNamespace(source=None), SimpleNamespace(squares_px2=np.ones((1, 2)))
    assert ring_visibility.ripples_seen(item, rings, None, None)
    assert not ring_visibility.ripples_seen(item, rings, None, None, least=ring_visibility.SCREEN_RIPPLE)
    rings = SimpleNamespace(squares_px2=np.full((1, 2), 16.0))
    assert ring_visibility.ripples_seen(item, rings, None, None, least=ring_visibility.SCREEN_RIPPLE)


@pytest.mark.parametrize("wavelengths", [pytest.param(4, marks=pytest.mark.slow), 6])
def test_rings_are_looked_for_at_any_number_of_wavelengths(wavelengths, drawn):
    found = picture(project(quality=Quality(wavelengths=wavelengths)))
    assert any(drawn)
    assert found.sum() == pytest.approx(standard()[0].sum(), rel=0.02)
