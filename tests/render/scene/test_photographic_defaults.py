"""Default settings for lenses of the library."""

import numpy as np
import pytest
from scipy import ndimage

from flarewright.io.lens.library import library_names
from flarewright.model import Art, Bare, Camera, Light, Preset, Project, Rule
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.rays.pack import resolve_coatings
from flarewright.render.render import render
from flarewright.render.scene.photographic_defaults import LIGHT_DEG, as_photographed, plausible_preset, stopped_down
from flarewright.render.scene.resolve import load_lens


@pytest.mark.parametrize(
    ("wide_open", "stopped"), [(1.1, 4.0), (1.4, 4.0), (2.03, 4.0), (2.8, 5.6), (3.5, 7.1), (4.0, 8.0), (11.5, 22.0)]
)
def test_two_stops_down(wide_open, stopped):
    assert stopped_down(wide_open) == stopped


@pytest.mark.parametrize("name", library_names())
def test_every_lens_wears_films_of_its_time(name):
    """None before 1938; single films or stacks that differ from surface to surface after."""
    lens = load_lens(name)
    preset = plausible_preset(lens)
    assert stopped_down(lens.f_number) >= lens.f_number
    assert preset == ("blue-streak" if name == "anamorphic-heliar-2x" else "period")
    worn = [coating for coating in resolve_coatings(lens, Preset(name=preset)) if coating not in (None, Bare())]
    if name in ("biotar-50-f1.4", "speed-panchro-50"):
        assert not worn
    elif preset == "period":
        assert len(set(worn)) >= 4


def test_a_lens_without_films_of_its_time_wears_the_first_that_it_names():
    lens = load_lens("triplet-pestrecov")
    bare = lens.replace(coating_presets={})
    assert plausible_preset(bare) == "staggered"
    coatings = lens.coating_presets["single-coated"]
    assert plausible_preset(bare.replace(coating_presets={"single-coated": coatings, "maker": coatings})) == "maker"


def test_ghosts_have_rings_behind_cylinders_too():
    shot = Project(lens="anamorphic-heliar-2x", lights=(Light(field_deg=(6.0, 3.0)),))
    filled, reported = as_photographed(shot)
    assert filled.quality == shot.quality
    assert not any("rings" in one for one in reported)


@pytest.mark.parametrize(("name", "spikes"), [("takumar-50-f1.4", 6), ("flektogon-35", 18)])
def test_spikes_taper_from_a_round_core(name, spikes):
    """At one brightness spikes are nowhere much wider than at the core, narrow outwards, and have gaps between them."""
    camera = Camera(size_px=(480, 480), sensor_mm=(16.0, 16.0))
    shot, _ = as_photographed(Project(lens=name, lights=(Light(field_deg=(0.0, 0.0)),), camera=camera))
    star = render(shot, art=Art(rules=(Rule(select="all", enable=False),))).layers[0]
    green = star.pixels[..., 1]
    angles = np.radians(np.arange(0.0, 360.0, 0.1))

    def around(radius_px):
        return ndimage.map_coordinates(green, 239.5 + radius_px * np.array([np.sin(angles), np.cos(angles)]), order=1)

    disc_px = first_order(load_lens(name)).efl * np.radians(LIGHT_DEG / 2.0) * 480 / 16.0
    core = around(0.8 * disc_px)
    assert core.max() < 1.2 * core.min()
    level = 0.5 * around(200.0).max()
    widths = []
    for radius_px in (50.0, 100.0, 200.0, 230.0):
        seen = around(radius_px) > level
        assert (seen & ~np.roll(seen, 1)).sum() == spikes
        widths.append(radius_px * seen.mean())
    assert max(widths) < 1.2 * widths[0]
    assert widths[0] > widths[2] > 1.3 * widths[3]


def test_a_light_at_the_border_of_the_front_stays_a_point():
    edge, inner = Light(field_deg=(88.9, 0.0)), Light(field_deg=(80.0, 0.0))
    filled, reported = as_photographed(Project(lens="fisheye-nikkor-10.5", lights=(edge, inner)))
    assert [light.diameter_deg for light in filled.lights] == [0.0, LIGHT_DEG]
    assert reported[-1] == "lights of 0.25 degrees"
    filled, reported = as_photographed(Project(lens="fisheye-nikkor-10.5", lights=(edge,)))
    assert filled.lights == (edge,)
    assert not any("lights of" in each for each in reported)
