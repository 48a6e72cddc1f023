"""A shot: the same bytes whatever the order, chunks, processes and threads; finished frames are kept."""

from __future__ import annotations

import json
import os
import pickle
from fractions import Fraction
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from flarewright import (
    Camera,
    Light,
    LightCurve,
    LightKey,
    Output,
    Project,
    ProjectCurve,
    Quality,
    Timeline,
    read_project,
    render,
    shot,
)
from flarewright.errors import FlarewrightError, OutputError, ProjectError
from flarewright.io.images.exr import read_exr, write_exr
from flarewright.jobs.answers import Done
from flarewright.jobs.worker import named
from flarewright.model import Dirt, Holdout, Iris, Layer, Rectangle, Tabulated
from flarewright.workflow import shot_frame
from flarewright.workflow.keyframes import project_at, still

OUTPUT = Output(layers="ghosts", brightest=3, starburst=False)
KEYS = (LightKey(at_s=0.0, field_deg=(-6.0, 3.0)), LightKey(at_s=0.25, field_deg=(6.0, 3.0)))


def project(**changes):
    light = Light(
        field_deg=(5.0, 5.0), keyframes=KEYS,
        curves=(LightCurve(of="intensity", at_s=(0.0, 0.25), values=(1.0, 4.0)),),
    )  # fmt: skip
    fields = {
        "lens": "triplet-pestrecov", "f_number": 16, "lights": [light], "camera": Camera(size_px=(64, 36)),
        "quality": Quality(mode="draft", wavelengths=3), "output": OUTPUT,
        "curves": [ProjectCurve(of="rotation_deg", at_s=(0.0, 0.25), values=(0.0, 30.0))],
    }  # fmt: skip
    return Project(**{**fields, **changes})


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    shot(project(), folder / "f.####.exr", processes=1)
    return folder


def test_all_frames_to_the_last_key_are_drawn(whole):
    assert sorted(contents(whole)) == [f"f.{k:04d}.exr" for k in range(1, 8)]


def test_a_frame_is_what_render_draws_at_its_time(whole):
    found = read_exr(whole / "f.0003.exr")
    drawn = render(still(project_at(project(), 2 / 24)))
    assert [layer.name for layer in found.layers[:2]] == ["beauty", "ghosts"]
    assert len(found.layers) == len(drawn.layers) == 5
    for layer, other in zip(found.layers[:2], drawn.layers, strict=False):
        # half floats have 11 bits
        np.testing.assert_allclose(layer.pixels, other.pixels, rtol=2**-11, atol=0)


def sent_around(function, context, items, *, processes, threads, what, executor):
    """Work off the items in this process, last first, with all that several processes would send each other."""
    for item in reversed(items):
        sent = pickle.loads(pickle.dumps((context, item, threads)))
        yield Done(item, pickle.loads(pickle.dumps(named(function)(*sent))))


# new processes load the program first, which takes longer than their frames; tests/jobs start some with small functions
@pytest.mark.parametrize("workers", ["here", pytest.param("processes", marks=pytest.mark.slow)])
def test_two_processes_and_two_chunks_write_the_bytes_of_one_run(workers, whole, tmp_path, monkeypatch):
    if workers == "here":
        # the package has a function of this name
        monkeypatch.setattr(import_module("flarewright.workflow.shot"), "work_off", sent_around)
    pattern = tmp_path / "f.####.exr"
    second = shot(project(), pattern, chunk="2/2", processes=2)
    assert [result.frame for result in second.frames] == [4, 5, 6, 7]
    assert second.processes == 2
    first = shot(project(), pattern, chunk="1/2", processes=1, threads=1)
    assert [result.frame for result in first.frames] == [1, 2, 3]
    assert contents(tmp_path) == contents(whole)


def test_finished_frames_are_kept_and_others_drawn_with_the_same_bytes(whole, tmp_path):
    wanted = contents(whole)
    for name, data in wanted.items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "f.0002.exr").unlink()
    # cut short, and of another program
    (tmp_path / "f.0004.exr").write_bytes(wanted["f.0004.exr"][:-200])
    (tmp_path / "f.0006.exr").write_bytes(b"no picture")
    result = shot(project(), tmp_path / "f.####.exr", processes=1)
    assert [one.frame for one in result.frames if one.drawn] == [2, 4, 6]
    assert contents(tmp_path) == wanted
    assert sum("damaged or of another program" in line for line in result.remarks) == 2


def test_a_changed_project_draws_only_the_frames_that_it_changes(whole, tmp_path):
    for name, data in contents(whole).items():
        (tmp_path / name).write_bytes(data)
    # the light rests from 0.125 s, frame 4, on: this path differs from the other after frame 4 only
    half = LightKey(at_s=0.125, field_deg=(0.0, 3.0))
    light = project().lights[0].replace(keyframes=(KEYS[0], half))
    result = shot(project(lights=[light]), tmp_path / "f.####.exr", processes=1)
    assert [one.frame for one in result.frames if one.drawn] == [5, 6, 7]


@pytest.mark.parametrize("change", ["matte", "version", "layers"])
def test_another_image_version_or_output_draws_again(change, tmp_path, monkeypatch):
    from PIL import Image

    matte = tmp_path / "matte.png"
    Image.new("L", (64, 36), 255).save(matte)
    given = {"holdout": Holdout(image=str(matte))}
    out = tmp_path / "f.#.exr"
    shot(project(**given), out, frames=[1], processes=1)
    if change == "matte":
        Image.new("L", (64, 36), 128).save(matte)
    elif change == "version":
        monkeypatch.setattr(shot_frame, "__version__", "99")
    else:
        given["output"] = Output(layers="beauty")
    again = shot(project(**given), out, frames=[1], processes=1)
    assert again.frames[0].drawn
    assert not shot(project(**given), out, frames=[1], processes=1).frames[0].drawn


def test_an_image_that_the_lens_file_names_draws_again(tmp_path):
    from PIL import Image

    from flarewright.io.lens.library import lens_path

    mask = tmp_path / "iris.png"
    Image.new("L", (32, 32), 255).save(mask)
    head, iris, rows = lens_path("triplet-pestrecov").read_text("utf-8").partition("[iris]\n")
    lens = tmp_path / "own.toml"
    lens.write_text(f'{head}{iris}mask = "{mask.as_posix()}"\n{rows[rows.index("[") :]}')
    given, out = {"lens": str(lens), "curves": [], "iris": None}, tmp_path / "f.#.exr"
    shot(project(**given), out, frames=[1], processes=1)
    assert not shot(project(**given), out, frames=[1], processes=1).frames[0].drawn
    Image.new("L", (32, 32), 128).save(mask)
    assert shot(project(**given), out, frames=[1], processes=1).frames[0].drawn


def test_the_header_has_the_standard_attributes_and_the_moment(whole):
    contents = read_exr(whole / "f.0004.exr")
    header = contents.header
    assert header["framesPerSecond"] == Fraction(24, 1)
    code = header["timeCode"]
    assert (code.hours, code.minutes, code.seconds, code.frame) == (0, 0, 0, 4)
    assert header["aperture"] == pytest.approx(16)
    assert header["focus"] == np.inf
    assert "expTime" not in header
    assert contents.metadata["frame"] == "4"
    assert '"field_deg": [0.0, 3.0]' in contents.metadata["lights"]
    assert '"intensity": 2.5' in contents.metadata["lights"]
    assert '"spectrum": "d65"' in contents.metadata["lights"]
    assert "field_deg = [0.0, 3.0]" in contents.metadata["project"]


def test_the_header_states_the_size_and_the_table_of_a_light(tmp_path):
    table = Tabulated(wavelength_nm=(500.0, 600.0), power=(1.0, 2.0))
    lights = [
        Light(field_deg=(1.0, 2.0), diameter_deg=0.5, spectrum=table, distance=2000.0),
        Light(field_deg=(3.0, 2.0), shape=Rectangle(size_deg=(2.0, 1.0))),
    ]
    shot(project(lights=lights, curves=[]), tmp_path / "f.#.exr", frames=[1], processes=1)
    disc, rectangle = json.loads(read_exr(tmp_path / "f.1.exr").metadata["lights"])
    assert disc["spectrum"] == {"kind": "table", "wavelength_nm": [500.0, 600.0], "power": [1.0, 2.0]}
    assert (disc["diameter_deg"], disc["distance_mm"], "shape" in disc) == (0.5, 2000.0, False)
    assert (rectangle["diameter_deg"], rectangle["shape"]["size_deg"]) == (0.0, [2.0, 1.0])


def test_the_scale_is_that_of_the_brightest_light_at_any_time(whole):
    assert {read_exr(path).scale for path in whole.iterdir()} == {256.0}


def test_single_ghosts_have_plain_names_and_the_windows_of_the_picture(whole, tmp_path):
    found = read_exr(whole / "f.0004.exr")
    singles = found.layers[2:]
    assert all(layer.name.replace("_", "").isalnum() and layer.name.startswith("ghost_") for layer in singles)
    assert {layer.window for layer in found.layers} == {(0, 0, 64, 36)}
    shot(project(), tmp_path / "f.####.exr", frames="4", cropped=True, processes=1)
    cropped = read_exr(tmp_path / "f.0004.exr").layers[2:]
    assert any(layer.window != (0, 0, 64, 36) for layer in cropped)


def test_one_part_has_all_layers(whole, tmp_path):
    shot(project(), tmp_path / "f.####.exr", frames="4", parts="single", processes=1)
    one, many = read_exr(tmp_path / "f.0004.exr"), read_exr(whole / "f.0004.exr")
    import OpenEXR

    assert len(OpenEXR.File(str(tmp_path / "f.0004.exr"), header_only=True).parts) == 1
    by = {layer.name: layer.pixels for layer in one.layers}
    assert set(by) == {layer.name for layer in many.layers}
    for layer in many.layers:
        assert np.array_equal(by[layer.name], layer.pixels)
    assert one.metadata["frame"] == "4"


def test_motion_blur_keeps_the_energy_of_each_channel(tmp_path):
    dim = project(lights=[Light(field_deg=(0, 0), keyframes=KEYS)], output=Output(pixel_type="float"), curves=[])
    times = [2 / 24 + (k + 0.5) / 4 / 48 - 0.25 / 24 for k in range(4)]
    sums = []
    for at_s in times:
        drawn = render(still(project_at(dim, at_s)))
        sums.append([layer.pixels.sum(axis=(0, 1), dtype=float) for layer in drawn.layers])
    shot(dim, tmp_path / "b.#.exr", frames="3", shutter_deg=180, subframes=4, processes=1)
    blurred = read_exr(tmp_path / "b.3.exr")
    for layer, wanted in zip(blurred.layers, np.mean(sums, axis=0), strict=True):
        assert layer.pixels.sum(axis=(0, 1), dtype=float) == pytest.approx(wanted, rel=1e-5)
    assert blurred.header["expTime"] == pytest.approx(1 / 48)
    assert blurred.metadata["subframes"] == "4"


def test_a_blurred_frame_chooses_the_brightest_ghosts_of_the_mean(tmp_path):
    result = shot(project(), tmp_path / "b.#.exr", frames="3", shutter_deg=180, processes=1)
    assert result.frames[0].subframes >= 5
    assert len(read_exr(tmp_path / "b.3.exr").layers) == 5
    # the digest includes the chosen moments
    assert not shot(project(), tmp_path / "b.#.exr", frames="3", shutter_deg=180, processes=1).frames[0].drawn
    assert shot(project(), tmp_path / "b.#.exr", frames="3", shutter_deg=90, processes=1).frames[0].drawn


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"frames": "100-120"}, r"frames 100-120 lie outside the project's 1-7 .* --start 100"),
        ({"frames": []}, "is empty"),
        ({"frames": [1, 1.5]}, r"frames are whole numbers, not \[1, 1.5\]"),
        ({"parts": "many"}, "parts 'many' is unknown; choose multi or single"),
        ({"movie": "f.mp4", "movie_view": "foo"}, "the view 'foo' is unknown; choose filmic, srgb, aces, rec709"),
        ({"processes": 0}, "0 processes are not possible; give 1 or more"),
        ({"threads": -1}, "-1 threads are not possible; give 1 or more"),
        ({"output": "a.exr"}, "all 7 frames would go to a.exr"),
        ({"output": "f.####.png"}, r"must be named \*\.exr"),
        ({"output": "missing/f.####.exr"}, "the folder .*missing does not exist; create it first"),
        ({"chunk": "3/2"}, "chunk 3/2 does not exist: the chunks of 2 are 1/2 to 2/2"),
        ({"shutter_deg": 720.0}, "give 0 to 360"),
        ({"subframes": 0}, "give 1 to 1000"),
    ],
)
def test_bad_input_is_one_sentence(changed, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = {"output": "f.####.exr", **changed}
    with pytest.raises((ProjectError, OutputError), match=said):
        shot(project(), given.pop("output"), **given)
    assert list(tmp_path.iterdir()) == []


def test_a_still_project_needs_its_frames_and_says_that_they_are_alike(tmp_path):
    with pytest.raises(ProjectError, match="nothing in the project moves"):
        shot(still(project()), tmp_path / "f.#.exr")
    result = shot(still(project()), tmp_path / "f.#.exr", frames="1-2", processes=1)
    assert "all frames are alike" in result.remarks[0]
    first, second = (read_exr(tmp_path / f"f.{k}.exr").layers[0].pixels for k in (1, 2))
    assert np.array_equal(first, second)


def test_frames_beyond_the_last_key_rest_with_a_remark(tmp_path):
    result = shot(project(), tmp_path / "f.#.exr", frames="7-8", processes=1)
    assert any("frame 8 lies outside the keys, 1-7" in line for line in result.remarks)


def test_values_that_no_lens_has_are_found_before_any_frame_is_drawn(tmp_path):
    wide = ProjectCurve(of="f_number", at_s=(0.0, 0.25), values=(16.0, 1.0))
    with pytest.raises(FlarewrightError, match=r"at 0\.25 s: .*faster than"):
        shot(project(curves=[wide]), tmp_path / "f.#.exr", processes=1)
    assert list(tmp_path.iterdir()) == []


def test_other_frame_rates_and_starts_give_other_times(tmp_path):
    slow = project(timeline=Timeline(fps=12, start=100))
    shot(slow, tmp_path / "f.#.exr", processes=1)
    assert sorted(contents(tmp_path)) == [f"f.{k}.exr" for k in range(100, 104)]
    assert '"field_deg": [-2.0, 3.0]' in read_exr(tmp_path / "f.101.exr").metadata["lights"]


def test_the_project_in_a_frame_draws_it_again(whole, tmp_path):
    file = tmp_path / "again.toml"
    found = read_exr(whole / "f.0005.exr")
    file.write_text(found.metadata["project"])
    again = render(read_project(file)).layers[0].pixels
    np.testing.assert_allclose(found.layers[0].pixels, again, rtol=2**-11, atol=0)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux")
def test_a_full_disk_is_one_sentence(tmp_path, monkeypatch):
    import errno

    from flarewright.io.images import exr

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(exr, "_write_parts", full)
    with pytest.raises(OutputError, match=r"cannot write .*f\.1\.exr: no space left on device"):
        shot(project(), tmp_path / "f.#.exr", processes=1)
    assert list(tmp_path.iterdir()) == []


def too_late(*_):
    pytest.fail("kernels compile before the error")


@pytest.mark.parametrize("kind", ["image", "depth"])
def test_an_unreadable_file_is_found_before_the_first_frame(kind, tmp_path):
    write_exr(tmp_path / "h.1.exr", [Layer("beauty", np.ones((36, 64, 3), np.float32), (0, 0, 64, 36), {})], (64, 36))
    (tmp_path / "h.2.exr").write_text("cut")
    holdout = Holdout(**{kind: str(tmp_path / "h.#.exr")}, **({"depth_unit_mm": 1.0} if kind == "depth" else {}))
    with pytest.raises(ProjectError, match=r"h\.2\.exr cannot be read as a holdout"):
        shot(project(holdout=holdout), tmp_path / "f.#.exr", frames="1-2", processes=1, prepare=too_late)
    broken = str(tmp_path / "h.2.exr")
    for changes in ({"iris": Iris(mask=broken)}, {"dirt": Dirt(image=broken)}, {"holdout": Holdout(**{kind: broken})}):
        with pytest.raises(FlarewrightError, match=r"h\.2\.exr cannot be read as"):
            shot(project(**changes), tmp_path / "f.#.exr", processes=1, prepare=too_late)
    assert not list(tmp_path.glob("f.*"))


def test_a_sequence_needs_only_the_frames_that_are_drawn(tmp_path):
    """Its first frame used to be opened as well, because a curve has a key at 0 s."""
    for frame in (3, 4):
        matte = Layer("beauty", np.ones((36, 64, 3), np.float32), (0, 0, 64, 36), {})
        write_exr(tmp_path / f"h.{frame}.exr", [matte], (64, 36))
    given = project(holdout=Holdout(image=str(tmp_path / "h.#.exr")))
    assert any(0.0 in curve.at_s for curve in given.curves)
    result = shot(given, tmp_path / "f.#.exr", frames="3-4", processes=1)
    assert [one.frame for one in result.frames] == [3, 4]
