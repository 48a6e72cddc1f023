"""Default settings for lenses of the library."""

import pytest

from flarewright.io.lens.library import library_names
from flarewright.model import Bare, Light, Preset, Project
from flarewright.optics.rays.pack import resolve_coatings
from flarewright.render.scene.photographic_defaults import as_photographed, plausible_preset, stopped_down
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
