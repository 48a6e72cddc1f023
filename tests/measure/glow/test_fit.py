"""Fit of halo and star: light that keeps its offset from the light source while the camera turns."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planted_run import GHOSTS, SIZE, views

from flarewright.measure.fitting.ghost_fit import render
from flarewright.measure.glow.fit import Registered, fit_halo, fit_star, followed, iris_of, register
from flarewright.measure.glow.laws import halo_at, halo_radiance, offsets, star_at, star_radiance
from flarewright.measure.glow.subtraction import masks_of, subtract_glow
from flarewright.model.measurement.ghost_model import Blades, Halo, Star

HALO = Halo(
    radius_px=(2.0, 10.0, 50.0, 600.0), radiance=((3.0, 2.0, 1.0), (1.0, 0.8, 0.5), (0.2, 0.2, 0.2), (0.05, 0.05, 0.05))
)
STAR = Star(
    spikes=14, first_deg=11.0, width_px=1.3, radius_px=(2.0, 500.0), radiance=((40.0, 40.0, 30.0), (0.1, 0.1, 0.1))
)
# constellations
COUNT = 14


@cache
def shown(star):
    out = []
    for k, view in enumerate(views(GHOSTS[:2], noise=0.005, angles=np.linspace(2.0, 24.0, COUNT))):
        light = (20.5 + 15.3 * k, 79.5)
        x, y = offsets(light, SIZE, 1.0)
        pixels = view.pixels + halo_radiance(HALO, x, y) + (star_radiance(STAR, x, y) if star else 0.0)
        seen = type(view)(
            view.constellation_deg, view.sigma, view.frame, light, pixels.astype(np.float32), view.variance
        )
        out.append(seen)
    return tuple(out)


@cache
def even_halo():
    some = shown(star=False)
    return fit_halo(some, [view.pixels for view in some])


@cache
def registered(star):
    some = shown(star)
    return register(some, [view.pixels for view in some], 0.5)


@cache
def found_star():
    return fit_star(registered(star=True))


def test_the_halo_excludes_ghosts():
    found = even_halo()
    radius = np.array([12.0, 25.0, 60.0, 110.0])
    expected, got = (halo_radiance(each, radius, 0.0 * radius) for each in (HALO, found))
    # the fall of the halo across a ring does not count as dark places
    assert np.abs(got / expected - 1.0).max() < 0.06


def test_ghosts_that_move_with_the_light_are_in_neither_halo_nor_star():
    """Ghosts on both sides of the light in all views make neither a brighter halo nor a star of two spikes."""
    some = []
    for view in shown(star=False):
        x, y = offsets(view.light_px, SIZE, 1.0)
        beside = 1.5 * sum(np.hypot(x - side * far, y) < 14.0 for side in (-1.0, 1.0) for far in (22.0, 48.0, 80.0))
        some.append(replace(view, pixels=(view.pixels + beside[..., None]).astype(np.float32)))
    pixels = [view.pixels for view in some]
    radius = np.array([12.0, 25.0, 60.0, 110.0])
    expected, got = (halo_radiance(each, radius, 0.0 * radius) for each in (HALO, fit_halo(some, pixels)))
    assert np.abs(got / expected - 1.0).max() < 0.15
    assert fit_star(register(some, pixels)) is None
    # the strength in each view does not include them either
    masks = [np.ones(SIZE[::-1], bool) for _ in some]
    halo, _ = followed(some, pixels, masks, HALO, None)
    assert max(part for _, part in halo.strength) < 1.1
    assert max(max(row[1:]) for row in [(0.0, *level) for _, level in halo.even]) < 0.05


def test_the_star_has_its_spikes_direction_width_and_law():
    found = found_star()
    assert found.spikes == 14
    apart = 360.0 / 14
    assert abs((found.first_deg - 11.0 + 0.5 * apart) % apart - 0.5 * apart) < 0.6
    assert found.width_px == pytest.approx(1.3, rel=0.35)
    radius = np.array([20.0, 40.0, 70.0])
    expected, got = (
        star_radiance(each, radius * np.cos(np.radians(each.first_deg)), radius * np.sin(np.radians(each.first_deg)))
        for each in (STAR, found)
    )
    assert np.abs(got / expected - 1.0).max() < 0.4


def off(found, truth, rings):
    """Return the error of a radial law in green, in stated standard deviations."""
    radius = np.array(found.radius_px)
    true = (halo_radiance if isinstance(truth, Halo) else star_radiance)(
        truth, radius * np.cos(np.radians(11.0)), radius * np.sin(np.radians(11.0))
    )
    missed = np.array(found.radiance) - true
    return np.abs(missed / np.array(found.uncertainty))[rings, 1]


def test_halo_and_star_are_within_their_errors():
    halo = even_halo()
    assert len(halo.uncertainty) == len(halo.radiance)
    # the last radius extrapolates
    assert np.quantile(off(halo, HALO, slice(0, -1)), 0.9) < 3.0
    # the errors are not too large: a few percent of the light where it is uniform around the light
    part = np.array(halo.uncertainty) / np.array(halo.radiance)
    assert part[:-1].max() < 0.25
    assert np.median(part) < 0.03
    star = found_star()
    assert len(star.uncertainty) == len(star.radiance)
    # the error is large near the light, where spikes merge, and small farther out
    seen = np.array(star.radius_px) < 90.0
    assert np.median(off(star, STAR, seen)) < 3.0
    part = np.array(star.uncertainty)[seen, 1] / np.array(star.radiance)[seen, 1]
    assert part[0] > 0.3
    assert part[-1] < 0.05


def test_an_uneven_halo_has_larger_errors():
    some = shown(star=False)
    even = even_halo()
    lopsided = []
    for view in some:
        x, y = offsets(view.light_px, SIZE, 1.0)
        light = 1.0 + 0.3 * np.cos(np.arctan2(y, x))
        lopsided.append(replace(view, pixels=(view.pixels * light[..., None]).astype(np.float32)))
    uneven = fit_halo(lopsided, [view.pixels for view in lopsided])
    assert np.median(np.array(uneven.uncertainty) / np.array(even.uncertainty)) > 1.5


def test_light_along_the_line_of_ghosts_makes_no_star_of_two_spikes():
    known = registered(star=True)
    right, up = known.polar()
    band = 6.0 * np.exp(-0.5 * (up / np.maximum(0.4 * np.abs(right), 1.0)) ** 2)
    # as bright as spikes, but wide
    found = fit_star(Registered((known.picture + band[..., None]).astype(np.float32), known.side))
    assert found.spikes == 14


@pytest.mark.parametrize(
    ("spikes", "blades"), [(6, 6), (8, 8), (10, 5), (14, 7), (18, 9), (12, 12), (2, None), (40, None)]
)
def test_spikes_determine_the_blades(spikes, blades):
    found = iris_of(STAR.replace(spikes=spikes))
    assert found == (None if blades is None else Blades(count=blades, first_deg=STAR.first_deg))


def test_no_star_where_there_is_none():
    assert fit_star(registered(star=False)) is None


def test_subtracting_the_glow_keeps_the_ghosts():
    some = shown(star=True)[::2]
    pixels = [view.pixels for view in some]
    found = followed(some, pixels, masks_of(some), fit_halo(some, pixels), fit_star(register(some, pixels)))
    view = some[3]
    ghosts = sum(render(ghost, view) for ghost in GHOSTS[:2])
    x, y = offsets(view.light_px, SIZE, 1.0)
    far = np.hypot(x, y) > 30.0
    left = subtract_glow(some, *found)[3].pixels[..., 1]
    raw = view.pixels[..., 1]
    assert np.abs(left - ghosts)[far].mean() < 0.3 * np.abs(raw - ghosts)[far].mean()


def test_the_strength_of_halo_star_and_veil_follows_the_constellation():
    # rims shade the star; a large faint ghost brightens the whole picture
    views_of_it, some = shown(star=True)[::2], []
    fading, veil = np.linspace(1.0, 0.3, len(views_of_it)), np.linspace(0.0, 0.6, len(views_of_it))
    for k, view in enumerate(views_of_it):
        x, y = offsets(view.light_px, SIZE, 1.0)
        light = fading[k] * (halo_radiance(HALO, x, y) + 0.8 * star_radiance(STAR, x, y)) + veil[k] * np.array(
            [1, 2, 1]
        )
        noise = np.random.default_rng(k).normal(0.0, 0.02, light.shape)
        # an unknown ghost must not raise the halo
        light[20:50, 60:90] += 3.0
        noisy = np.full_like(view.variance, 0.02**2)
        some.append(replace(view, pixels=(light + noise).astype(np.float32), variance=noisy))
    masks = [np.hypot(*offsets(view.light_px, SIZE, 1.0)) > 14.0 for view in some]
    halo, star = followed(some, [view.pixels for view in some], masks, HALO, STAR)
    for k, view in enumerate(some[1:-1], 1):
        x, y = offsets(view.light_px, SIZE, 1.0)
        got = halo_at(halo, view.constellation_deg, x, y) + star_at(star, view.constellation_deg, x, y)
        known = masks[k].copy()
        known[20:50, 60:90] = False
        off = (got - view.pixels)[known]
        assert abs(float(np.mean(off))) < 0.01
        assert float(np.sqrt(np.mean(off**2))) < 0.04
    assert np.array([part for _, part in star.strength])[1:-1] == pytest.approx(0.8 * fading[1:-1], abs=0.06)


def test_a_star_far_outside_the_picture_has_no_strength():
    star = STAR.replace(radius_px=(2.0, 100.0), radiance=((40.0, 40.0, 30.0), (1e-25, 1e-25, 1e-25)))
    some = [replace(view, light_px=(SIZE[0] + 95.0, 79.5)) for view in shown(star=False)[::4]]
    known = [np.ones(view.variance.shape[:2], bool) for view in some]
    halo, found = followed(some, [view.pixels for view in some], known, HALO, star)
    assert all(strength == 0.0 for _, strength in found.strength)
    assert all(0.0 <= strength < 10.0 for _, strength in halo.strength)
