"""Drawn values: the distributions of the specification, and splits by lens."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.errors import ProjectError
from flarewright.io.lens.lens_writer import write_lens
from flarewright.model.project.dataset import DatasetSpec
from flarewright.model.project.distribution import Choice, Integers, LogUniform, Normal, TextChoice, Uniform
from flarewright.render.scene.pixel_place import image_px
from flarewright.render.scene.resolve import open_lens
from flarewright.workflow.plates.plate_frame import plate_images
from flarewright.workflow.training_pairs.draw import (
    check_lenses,
    draw_item,
    draw_number,
    draw_text,
    drawn_lens,
    splits_of,
)

LENSES = ("heliar-tronnier", "triplet-pestrecov", "takumar-50-f1.4", "flektogon-35", "canon-28-80", "tessar-brendel")
MANY = 4000


def spec_of(**changes):
    return DatasetSpec.model_validate({"size_px": (64, 48), "lens": {"names": list(LENSES)}, **changes})


@pytest.mark.parametrize(
    ("given", "mean", "variance", "fourth"),
    [
        (Uniform(uniform=(2.0, 5.0)), 3.5, 0.75, 1.8),
        (Normal(normal=(1.0, 2.0), bounds=(-99.0, 99.0)), 1.0, 4.0, 3.0),
        (Choice(choice=(0.0, 10.0), weights=(3.0, 1.0)), 2.5, 18.75, 7 / 3),
        (Integers(integers=(3, 5)), 4.0, 2 / 3, 1.5),
    ],
)
def test_drawn_numbers_have_the_moments_of_their_distribution(given, mean, variance, fourth):
    rng = np.random.default_rng(1)
    drawn = np.array([draw_number(given, rng) for _ in range(MANY)])
    assert given.support[0] <= drawn.min() <= drawn.max() <= given.support[1]
    assert abs(drawn.mean() - mean) < 4.0 * np.sqrt(variance / MANY)
    # the variance of a variance, by the kurtosis
    assert abs(drawn.var() / variance - 1.0) < 4.0 * np.sqrt((fourth - 1.0) / MANY)


def test_log_uniform_numbers_halve_at_the_geometric_mean_and_bounds_cut_normal_ones():
    rng = np.random.default_rng(2)
    drawn = np.array([draw_number(LogUniform(log_uniform=(1.0, 100.0)), rng) for _ in range(MANY)])
    assert abs((drawn < 10.0).mean() - 0.5) < 4.0 * 0.5 / np.sqrt(MANY)
    cut = np.array([draw_number(Normal(normal=(0.0, 1.0), bounds=(0.5, 1.0)), rng) for _ in range(200)])
    assert 0.5 <= cut.min() <= cut.max() <= 1.0


def test_a_text_of_weight_zero_is_never_drawn():
    rng = np.random.default_rng(3)
    given = TextChoice(choice=("a", "b", "c"), weights=(1.0, 0.0, 2.0))
    assert {draw_text(given, rng) for _ in range(100)} == {"a", "c"}


def test_an_item_is_a_function_of_seed_and_number_and_groups_are_apart():
    spec = spec_of(iris={"blades": [5, 7], "repeat": 1}, lights={"count": {"integers": [1, 3]}})
    assert draw_item(spec, 5) == draw_item(spec, 5)
    assert draw_item(spec, 5) != draw_item(spec.replace(seed=1), 5)
    brighter = spec_of(iris={"blades": [5, 7], "repeat": 1}, lights={"count": 1, "stops": 9.0})
    for index in range(4):
        one, other = draw_item(spec, index).project, draw_item(brighter, index).project
        assert one.replace(lights=other.lights) == other


def test_items_in_sequence_share_an_iris():
    spec = spec_of(iris={"rounding": {"uniform": [0, 1]}, "repeat": 3}, lens={"names": "heliar-tronnier"})
    irises = [draw_item(spec, index).project.iris for index in range(6)]
    assert irises[0] == irises[2] != irises[3] == irises[5]


def test_the_iris_of_a_lens_file_keeps_its_shape(tmp_path):
    lens = open_lens("heliar-tronnier").lens
    write_lens(lens.replace(iris=lens.iris.replace(blades=6, rounding=0.5)), tmp_path / "own.toml")
    names = {"names": str(tmp_path / "own.toml")}
    kept, other = (draw_item(spec_of(lens=names, iris=iris), 0).project.iris for iris in ({}, {"rounding": 0.2}))
    assert (kept.blades, kept.rounding) == (6, 0.5)
    assert (other.blades, other.rounding) == (6, 0.2)


def test_a_lens_opens_no_wider_than_it_can_and_a_zoom_stays_in_its_range():
    spec = spec_of(lens={"names": "canon-70-200", "f_number": {"uniform": [1.0, 4.0]}})
    found = [draw_item(spec, index) for index in range(12)]
    assert {one.opened for one in found} == {True, False}
    assert min(one.project.f_number for one in found) >= 2.7
    assert all(72.0 < one.project.zoom < 195.0 for one in found)
    assert len({one.project.zoom for one in found}) == 12


def test_places_fill_the_frame_and_its_margin():
    spec = spec_of(lens={"names": "heliar-tronnier"}, lights={"count": 16, "place": {"kind": "frame", "margin": 0.5}})
    efl, sensor = 99.24, (24.0, 18.0)
    lights = [light for index in range(8) for light in draw_item(spec, index).project.lights]
    places = np.array([np.tan(np.radians(light.field_deg)) * efl / sensor for light in lights])
    assert 0.9 < np.abs(places).max() <= 1.0001
    inside = (np.abs(places) < 0.5).all(axis=1).mean()
    assert abs(inside - 0.25) < 4.0 * np.sqrt(0.25 * 0.75 / len(lights))


@pytest.mark.parametrize("focus_distance", [None, 500.0])
def test_lights_lie_inside_the_frame_at_a_near_focus_too(focus_distance):
    """Focused at half a metre, a sensor 25 mm behind the focus showed a third of the lights outside its frame."""
    lens = {"names": "heliar-tronnier"} | ({} if focus_distance is None else {"focus_distance": focus_distance})
    spec = spec_of(lens=lens, lights={"count": 16})
    projects = [draw_item(spec, index).project for index in range(3)]
    images = plate_images(projects[0])
    places = [image_px(images, light.field_deg) for project in projects for light in project.lights]
    parts = np.array(places) / spec.size_px
    assert 0.0 <= parts.min() <= 0.05
    assert 0.95 <= parts.max() <= 1.0


def test_splits_share_out_lenses_and_every_split_has_one():
    spec = spec_of(splits={"train": 4, "val": 1, "test": 1})
    shared = splits_of(spec)
    assert sorted(shared) == sorted(LENSES)
    assert sorted(shared.values()) == ["test", "train", "train", "train", "train", "val"]
    assert splits_of(spec_of(splits={"train": 9, "val": 0.01, "test": 0.01})) != {}
    assert set(splits_of(spec_of(splits={"train": 99, "val": 0.01, "test": 0.01})).values()) == {"train", "val", "test"}
    assert any(splits_of(spec.replace(seed=seed)) != shared for seed in range(1, 5))
    named = splits_of(spec_of(splits={"test": ["canon-28-80"], "val": ["flektogon-35"]}))
    assert {name for name, split in named.items() if split != "train"} == {"canon-28-80", "flektogon-35"}
    assert {drawn_lens(spec, index) for index in range(60)} == set(LENSES)


def test_a_lens_that_cannot_be_used_is_named_before_the_work():
    with pytest.raises(ProjectError, match=r"lens.names: heliar-tronnier: .*preset"):
        check_lenses(spec_of(lens={"names": "heliar-tronnier", "coating": "preset:gold"}))
    with pytest.raises(ProjectError, match=r"^lens.names: 'heliar' is neither a shipped lens nor a file"):
        check_lenses(spec_of(lens={"names": ["heliar-tronnier", "heliar"]}))


def test_stops_that_lead_beyond_the_largest_f_number_are_refused_before_the_work():
    # heliar-tronnier opens to f/3.5
    check_lenses(spec_of(lens={"names": "heliar-tronnier", "stops_down": {"uniform": [0, 12.3]}}))
    with pytest.raises(ProjectError, match=r"heliar-tronnier: lens.stops_down of 13 from f/3.5 .* give at most 12.3"):
        check_lenses(spec_of(lens={"names": "heliar-tronnier", "stops_down": [0, 13]}))


@pytest.mark.parametrize(
    ("section", "key", "least", "largest"),
    [
        ("scatter", "roughness_nm", 0.0, 50.0),
        ("scatter", "cleanliness_level", 10.0, 2000.0),
        ("dirt", "dust_per_mm2", 0.0, 200.0),
        ("dirt", "scratches_per_cm2", 0.0, 1000.0),
    ],
)
def test_a_value_that_no_item_can_have_is_refused_before_the_work(section, key, least, largest):
    """A roughness of 60 nm passed the checks, and ended the run at the first item that drew it."""
    for end in (least, largest):
        assert getattr(getattr(draw_item(spec_of(**{section: {key: end}}), 0).project, section), key) == end
    for beyond in (least - 0.5, largest + 0.5):
        with pytest.raises(ValueError, match=f"values lie between {least:g} and {largest:g}"):
            spec_of(**{section: {key: {"choice": [largest, beyond]}}})
