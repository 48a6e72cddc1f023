"""Specifications of data sets: what they accept, and one sentence with its place for what they do not."""

from __future__ import annotations

import pytest

from flarewright import read_dataset_spec
from flarewright.errors import FlarewrightError
from flarewright.io.project.file_of_kind import example_file
from flarewright.model.project.distribution import Choice, Constant, LogUniform, Uniform

BASE = '[lens]\nnames = ["heliar-tronnier", "triplet-pestrecov"]\n'


def spec_of(tmp_path, text):
    (tmp_path / "pairs.toml").write_text(text)
    return read_dataset_spec(tmp_path / "pairs.toml")


def test_the_example_can_be_read_and_says_what_it_means(tmp_path):
    spec = spec_of(tmp_path, example_file("dataset"))
    assert spec.lens.stops_down == Uniform(uniform=(0.0, 4.0))
    assert spec.iris.blades == Choice(choice=(0.0, 5.0, 6.0, 7.0, 8.0, 9.0))
    assert spec.lights.diameter_deg == Constant(constant=0.0)
    assert spec.lights.temperature_k == LogUniform(log_uniform=(2700.0, 6500.0))
    assert spec.drawn_parts == ("clean", "flared", "ghosts", "starburst", "light_mask", "ghost_mask")


def test_paths_start_at_the_file_and_names_of_the_library_do_not(tmp_path):
    text = 'layout = "folder"\n[lens]\nnames = ["own/lens.toml", "heliar-tronnier"]\n[background]\nfolder = "plates"\n'
    spec = spec_of(tmp_path, text + '[splits]\ntest = ["own/lens.toml"]\n')
    assert spec.lens.names.choice == (str(tmp_path / "own/lens.toml"), "heliar-tronnier")
    assert spec.background.folder == str(tmp_path / "plates")
    assert spec.splits.test == (str(tmp_path / "own/lens.toml"),)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("stops_down = { uniform = [4, 1] }", "lens.stops_down.uniform: 4 to 1 runs backwards"),
        ("stops_down = { uniform = [4, 4] }", "lens.stops_down.uniform: 4 to 4 is a single number; write 4 alone"),
        ("stops_down = { uniform = [0, 40] }", "lens.stops_down: values lie between 0 and 16, not at 40"),
        ("stops_down = { log_uniform = [0, 4] }", "starts above 0, not at 0; write uniform instead"),
        ("stops_down = { normal = [1, 0], bounds = [0, 2] }", "a standard deviation of 0 is not above 0"),
        ("stops_down = { normal = [1, 1], bounds = [8, 9] }", "more than three deviations from the mean 1"),
        (
            "stops_down = { normal = [1, 1], bounds = [3, 3.000001] }",
            "the bounds 3 to 3.000001 hold 5e-08 of all values",
        ),
        ("stops_down = { normal = [1, 1] }", "lens.stops_down.bounds is missing"),
        ("stops_down = { choice = [1, 2], weights = [1] }", "there are 1 weights for 2 choices"),
        ("stops_down = { choice = [1, 2], weights = [1e308, 1e308] }", "the sum of the weights is too large"),
        ("stops_down = { choice = [1, 2], weights = [0, 0] }", "all weights are 0, so nothing can be drawn"),
        ("stops_down = { gauss = [1, 2] }", "lens.stops_down: a table is no distribution; write a number"),
        ("stops_down = true", "lens.stops_down: true is no distribution"),
        ('stops_down = ["1"]', "lens.stops_down[0] should be a number, not '1'"),
        ("stops_down = []", "lens.stops_down"),
        ("f_number = 0.1", "lens.f_number: values lie between"),
        ("f_number = 4\nstops_down = 1", "lens.f_number and lens.stops_down both set the aperture"),
        ('coating = "gold"', "lens.coating: "),
        ("fstop = 4", "lens.fstop is not a known key"),
        ("[iris]\nblades = { uniform = [5, 9] }", "iris.blades: values are whole numbers; write { integers"),
        ("[iris]\nblades = { integers = [0, 9] }", "an iris has 0 blades (round) or at least 3"),
        ("[lights]\ncount = { integers = [1, 99] }", "lights.count: values lie between 0 and 16, not at 99"),
        ('[lights]\nplace = { kind = "sky" }', "lights.place should be a table whose kind is"),
        ("[sensor]\nread_noise_e = 3", "sensor.read_noise_e needs sensor.full_well_e"),
        ('[sensor]\nnoise = "same"', "sensor.noise has no effect without sensor.full_well_e"),
        ("[sensor]\nclip = false", 'sensor.clip = false needs format = "exr"'),
        ('[sensor]\ntone = "log"', "'log' is no tone curve; write srgb, linear, or gamma:2.2"),
        ("[background]\ncrop = 0.5", "background.crop has no effect without background.folder"),
        ("[splits]\ntrain = 1\nval = 1\ntest = 1", "3 splits by lens need as many lenses; lens.names has 2"),
        ('[splits]\ntest = ["canon-28-80"]', "splits.test: 'canon-28-80' is not among lens.names"),
        ('[splits]\ntest = ["heliar-tronnier"]\nval = 0.5', "splits has names and weights"),
        ('[splits]\ntest = ["heliar-tronnier"]\nval = ["heliar-tronnier"]', "is in test and in val; keep one"),
    ],
)
def test_an_impossible_distribution_is_one_sentence_with_its_place(text, sentence, tmp_path):
    with pytest.raises(FlarewrightError) as caught:
        spec_of(tmp_path, BASE + text + "\n")
    assert sentence in str(caught.value)
    assert "pairs.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('format = "exr"\n', 'write tone = "linear" in [sensor]'),
        ('parts = ["veil"]\n', "parts has veil, which needs [scatter]"),
        ('layout = "flare7k"\nformat = "png16"\n', "layout flare7k has 8-bit pictures"),
        ('layout = "folder"\nitems_per_shard = 9\n', "items_per_shard has no effect in layout folder"),
        ("rings = true\n", 'rings = true needs quality = "final"'),
        ("size_px = [8, 8]\n", "8x8 is not between 16 and 8192 pixels a side"),
        ("schema_version = 2\n", "newer than this program's 1"),
    ],
)
def test_settings_that_exclude_each_other_are_named(text, sentence, tmp_path):
    with pytest.raises(FlarewrightError, match=r".") as caught:
        spec_of(tmp_path, text + BASE)
    assert sentence in str(caught.value)


def test_a_lens_listed_twice_and_a_file_of_another_kind_are_refused(tmp_path):
    with pytest.raises(FlarewrightError, match=r"lens.names: 'a.toml' is listed twice"):
        spec_of(tmp_path, '[lens]\nnames = ["a.toml", "a.toml"]\n')
    with pytest.raises(FlarewrightError, match="is a project file, not a dataset file"):
        spec_of(tmp_path, 'lens = "heliar-tronnier"\n')
