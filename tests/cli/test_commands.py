"""Every command does what its help says: one JSON object on stdout, text on stderr, complete files or none."""

import csv
import errno
import io
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from rich.markup import render as from_markup
from singlet_file import singlet_file
from typer.main import get_command

import flarewright as fw
from flarewright import __version__
from flarewright.cli.app import run
from flarewright.cli.command_tree import command_tree
from flarewright.cli.render import command as render_command
from flarewright.errors import OutputError
from flarewright.io.images.exr import read_exr
from flarewright.io.lens.lens_schema import lens_json_schema
from flarewright.io.lens.library import library_names
from flarewright.io.project.project_file import project_from_data, project_json_schema, read_project
from flarewright.model import (
    AsLens,
    BlackBody,
    Everywhere,
    Layer,
    Preset,
    Project,
    QuarterWave,
    Rectangle,
    Tabulated,
)
from flarewright.render.image.canvas import blank
from flarewright.render.image.partial_picture import PartialPicture

HELIAR_EFL = 99.235796


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(capsys, *words, code=0):
    assert run([str(word) for word in words]) == code
    return capsys.readouterr()


def call_json(capsys, *words):
    return json.loads(call(capsys, *words, "--json").out)


@dataclass(frozen=True)
class FakeRendering:
    project: Project
    layers: tuple[Layer, ...]
    summary: dict = field(default_factory=lambda: {"efl_mm": 1.0, "far": float("inf"), "f_number": 8.0})
    remarks: tuple[str, ...] = ("a remark",)
    ledger: None = None
    profile: None = None
    matte: None = None


@pytest.fixture
def projects(monkeypatch):
    """Replace the renderer by one that records its project."""
    seen = []

    def fake(project, **options):
        seen.append(project)
        width, height = project.camera.size_px
        beauty = Layer("beauty", np.full((height, width, 3), 1e5, np.float32), (0, 0, width, height))
        ghost = Layer("ghost.4-1", np.ones((2, 3, 3), np.float32), (1, 1, 3, 2))
        return FakeRendering(project, (beauty, ghost))

    monkeypatch.setattr("flarewright.render.render.render", fake)
    return seen


# ---------------------------------------------------------------------------------------------------------------------
# render


def test_render_writes_exr_and_preview_and_reports_them(capsys, projects, folder):
    said = call(capsys, "render", "heliar-tronnier", "--ideal", "--light", "-3,4", "--size", "8x6", "-o", "a.exr")
    assert said.out == ""
    assert said.err.splitlines()[0] == "flarewright: a remark"
    assert "holds irradiances times 1024" in said.err
    assert "exposure" in said.err
    assert sorted(path.name for path in folder.iterdir()) == ["a.exr", "a.png"]
    (project,) = projects
    assert project.lights[0].field_deg == (-3, 4)
    back = read_exr("a.exr")
    assert back.metadata["version"] == __version__
    (folder / "again.toml").write_text(back.metadata["project"])
    assert read_project("again.toml") == project
    assert [layer.name for layer in back.layers] == ["beauty", "ghost.4-1"]
    assert b"exposure" in (folder / "a.png").read_bytes()


@pytest.mark.parametrize(
    ("exposure", "said"),
    [
        (("--shutter", "250"), "100 % of the preview is white: the EXR holds all light"),
        (("--exposure", "-60"), "the preview is black at this exposure"),
        (("--exposure", "-17"), ""),
        ((), ""),
    ],
)
@pytest.mark.usefixtures("projects", "folder")
def test_an_exposure_that_shows_nothing_is_reported(capsys, exposure, said):
    """A shutter of 250 seconds, meant as 1/250, used to be a white PNG without a word."""
    words = ("render", "heliar-tronnier", "--ideal", "--light", "1,1", "--size", "8x6", "-o", "a.exr", *exposure)
    summary = call_json(capsys, *words)
    found = [remark for remark in summary["remarks"] if "preview is" in remark]
    assert len(found) == bool(said)
    assert all(said in remark for remark in found)


def test_render_json_is_one_object_and_holds_no_infinity(capsys, projects, folder):
    summary = call_json(
        capsys, "render", "heliar-tronnier", "--ideal", "--light", "1,1", "--size", "8x6", "--no-png", "-o", "a.exr"
    )
    assert summary["efl_mm"] == 1.0
    assert summary["far"] is None
    assert summary["output"] == "a.exr"
    assert summary["layers"] == ["beauty", "ghost.4-1"]
    assert summary["scale"] == 1024.0
    assert summary["remarks"][0] == "a remark"
    assert len(summary["remarks"]) == 2
    assert [path.name for path in folder.iterdir()] == ["a.exr"]


def test_every_flag_reaches_the_project(capsys, projects, folder):
    (folder / "lamp.csv").write_text("400,1\n700,1\n")
    (folder / "iris.png").write_bytes(b"")
    call(
        capsys, "render", "heliar-tronnier", "--light", "-10,5", "--light", "2,-6", "--intensity", "1", "--intensity",
        "0.5", "--spectrum", "lamp.csv", "--fstop", "8", "--blades", "7", "--rotation", "-5", "--rounding", "0.5",
        "--coating", "quarter-wave:550", "--quality", "reference", "--wavelengths", "3",
        "--size", "10x8", "--sensor", "24x18", "--layers", "ghosts", "--brightest", "4", "--colorspace", "acescg",
        "--half", "--paths", "same-side", "--focus", "2000", "--no-starburst",
        "--full-windows", "--exposure", "-2", "--view", "filmic", "--threads", "1", "--seed", "5", "--error", "0.1",
        "--error-of", "total", "--samples", "1000", "--orders", "4", "--order4-limit", "1e-5", "-o", "a.exr",
    )  # fmt: skip
    # options that would make others ineffective
    call(
        capsys, "render", "heliar-tronnier", "--light", "1,1", "--size", "10x8", "--iris-image", "iris.png",
        "--sensor-distance", "82.5", "-o", "b.exr",
    )  # fmt: skip
    project, other = projects
    assert (other.iris.mask, other.camera.sensor_distance) == ("iris.png", 82.5)
    flat = Tabulated(wavelength_nm=(400, 700), power=(1, 1))
    assert [(x.field_deg, x.intensity, x.spectrum) for x in project.lights] == [
        ((-10, 5), 1.0, flat), ((2, -6), 0.5, flat)]  # fmt: skip
    assert (project.f_number, project.coating) == (8.0, Everywhere(coating=QuarterWave(center_wavelength_nm=550)))
    assert project.iris is not None
    iris = {"blades": 7, "rotation_deg": -5.0, "rounding": 0.5}
    assert project.iris.model_dump(include=set(iris)) == iris
    assert (project.quality.mode, project.quality.wavelengths, project.quality.paths) == ("reference", 3, "same-side")
    quality = project.quality
    assert (quality.seed, quality.reference_samples) == (5, 1000)
    assert (quality.orders, quality.order4_limit) == (4, 1e-5)
    assert (quality.reference_error, quality.reference_error_of) == (0.1, "total")
    assert (project.camera.size_px, project.camera.sensor_mm) == ((10, 8), (24, 18))
    assert project.camera.focus_distance == 2000
    output = project.output
    assert (output.layers, output.brightest, output.colorspace) == ("ghosts", 4, "acescg")
    assert (output.pixel_type, output.starburst) == ("half", False)
    assert read_exr("a.exr").layers[1].pixels.shape == (8, 10, 3)


def test_flags_win_over_the_project_file_and_the_rest_of_it_stays(capsys, projects, folder):
    (folder / "p.toml").write_text(
        'lens = "heliar-tronnier"\nf_number = 5.6\ncoating = "none"\n[iris]\nblades = 9\nrounding = 0.5\n'
        '[[lights]]\nfield_deg = [1, 2]\nspectrum = "black-body:3200"\n[[lights]]\nfield_deg = [3, 4]\n'
        '[camera]\nsize_px = [8, 6]\nsensor_mm = [36, 27]\n[output]\npixel_type = "half"\n'
    )
    call(capsys, "render", "--project", "p.toml", "-o", "a.exr")
    call(capsys, "render", "--project", "p.toml", "-o", "a.exr", "--rotation", "10", "--float", "--intensity", "3")
    call(
        capsys, "render", "tessar-brendel", "--project", "p.toml", "-o", "a.exr", "--light", "0,0", "--coating", "lens"
    )
    plain, changed, other = projects
    assert plain == read_project("p.toml")
    assert changed.iris == plain.iris.replace(rotation_deg=10)
    assert [(x.intensity, x.spectrum) for x in changed.lights] == [
        (3, plain.lights[0].spectrum), (3, plain.lights[1].spectrum)]  # fmt: skip
    assert changed.lights[0].spectrum == BlackBody(temperature_k=3200)
    assert (plain.output.pixel_type, changed.output.pixel_type) == ("half", "float")
    assert changed.camera == plain.camera
    assert (other.lens, other.coating, len(other.lights)) == ("tessar-brendel", AsLens(), 1)
    assert other.f_number == 5.6


def test_art_flags_come_after_the_project_s_rules(capsys, projects, folder):
    (folder / "p.toml").write_text(
        'lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [1, 2]\n[camera]\nsize_px = [8, 6]\n'
        '[art.gain]\nstarburst = 0.5\n[[art.rules]]\nselect = "row:7"\ntint = [1, 0, 0]\n'
    )
    call(
        capsys, "render", "--project", "p.toml", "-o", "a.exr", "--solo", "4-1", "--solo", "bounded:entrance", "--mute",
        "largest:2", "--gain", "ghosts=2", "--gain", "not 4-1=0.5",
    )  # fmt: skip
    call(capsys, "render", "--project", "p.toml", "-o", "a.exr", "--physical")
    graded, physical = projects
    assert graded.art.gain == {"starburst": 0.5, "ghosts": 2.0}
    assert [(rule.select, rule.enable, rule.gain) for rule in graded.art.rules] == [
        ("row:7", None, 1.0), ("all", False, 1.0), ("4-1", True, 1.0), ("bounded:entrance", True, 1.0),
        ("largest:2", False, 1.0), ("not 4-1", None, 0.5)]  # fmt: skip
    assert physical.art.physical
    assert physical.art.rules == read_project("p.toml").art.rules


def test_a_flag_for_all_that_art_and_lights_can_be(capsys, projects, folder):
    """Rule, polygon and spiral have the meaning of a project file; rules come before mutes and gains."""
    (folder / "p.toml").write_text(
        'lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [1, 2]\n'
        'shape = { kind = "polygon", corners_deg = [[-1, 0], [3, 0], [3, 1]] }\n'
        "[camera]\nsize_px = [8, 6]\n[starburst]\nspiral_deg = 12\n"
        '[[art.rules]]\nselect = "row:7"\ntint = [1, 0.5, 0]\nramp = [[0, 1, 1, 1], [1, 2, 1, 1]]\noffset_mm = [1, 2]\n'
        '[[art.rules]]\nselect = "largest:2"\nscale = 2\nblur_px = 0.5\n'
    )
    call(capsys, "render", "--project", "p.toml", "-o", "a.exr")
    call(
        capsys, "render", "heliar-tronnier", "--ideal", "--light", "1,2", "--light-polygon", "-1,0 3,0 3,1", "--size",
        "8x6", "--starburst-spiral", "12", "--rule",
        'select = "row:7", tint = [1, 0.5, 0], ramp = [[0, 1, 1, 1], [1, 2, 1, 1]], offset_mm = [1, 2]',
        "--rule", "select = 'largest:2', scale = 2, blur_px = 0.5", "-o", "a.exr",
    )  # fmt: skip
    call(
        capsys, "render", "heliar-tronnier", "--light", "1,2", "--mute", "4-1", "--rule", "select = 'all', gain = 2",
        "--size", "8x6", "-o", "a.exr",
    )  # fmt: skip
    written, reported, order = projects
    assert reported == written
    assert [rule.select for rule in order.art.rules] == ["all", "4-1"]


def test_a_sun_stays_a_disc_beside_lights_of_a_size(capsys, projects):
    """As in the example of the help."""
    words = ["render", "heliar-tronnier", "--light", "sun@10,5", "--light", "-12,2", "--size", "8x6", "-o", "a.exr"]
    call(capsys, *words, "--light-size", "3x2")
    call(capsys, *words, "--light-diameter", "1", "--light-diameter", "2")
    shaped, discs = projects
    assert [(x.diameter_deg, x.shape) for x in shaped.lights] == [(0.53, None), (0.0, Rectangle(size_deg=(3, 2)))]
    assert [(x.diameter_deg, x.shape) for x in discs.lights] == [(1.0, None), (2.0, None)]


def test_turning_the_blades_keeps_the_lens_own_number(capsys, projects):
    call(capsys, "render", "heliar-tronnier", "--light", "1,1", "--size", "8x6", "--rotation", "10", "-o", "a.exr")
    call(
        capsys,
        "render",
        "heliar-tronnier",
        "--ideal",
        "--light",
        "1,1",
        "--size",
        "8x6",
        "--coating",
        "preset:thesis",
        "-o",
        "a.exr",
    )
    assert projects[0].iris.blades == fw.load_lens("heliar-tronnier").iris.blades > 0
    assert projects[1].iris is None
    assert projects[1].coating == Preset(name="thesis")


def _caused_by(error, cause):
    """Return what llvmlite raises when it finds no memory for its library."""
    error.__cause__ = cause
    return error


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (KeyboardInterrupt(), 130, "flarewright: interrupted; nothing was left half-written"),
        (MemoryError(), 2, "flarewright: error: there is not enough memory"),
        (ImportError("x.so: failed to map segment from shared object"), 2, "flarewright: error: there is not enough m"),
        (
            _caused_by(OSError("library not found"), OSError("x.so: failed to map segment")),
            2,
            "flarewright: error: there is",
        ),
        (RuntimeError("can't start new thread"), 2, "flarewright: error: there is not enough memory"),
        (
            OSError(28, "No space left on device"),
            2,
            "flarewright: error: cannot write the output: no space left on device; free some space",
        ),
    ],
)
def test_what_stops_a_render_is_one_sentence_and_leaves_nothing(capsys, monkeypatch, folder, error, code, words):
    def stop(*args, **kwargs):
        raise error

    for place in ("flarewright.render.render.render", "flarewright.io.images.exr.write_exr"):
        with monkeypatch.context() as patch:
            if place.endswith("write_exr"):
                patch.setattr("flarewright.render.render.render", lambda p, **_: FakeRendering(p, ()))
            patch.setattr(place, stop)
            said = call(capsys, "render", "heliar-tronnier", "--light", "1,1", "-o", "a.exr", code=code)
        assert said.out == ""
        assert len(said.err.splitlines()) == 1
        assert said.err.startswith(words)
    assert list(folder.iterdir()) == []


def test_a_module_in_c_that_a_signal_ends_is_an_interruption(capsys, monkeypatch, folder):
    """Numba's reports "failed to import" instead of the KeyboardInterrupt."""

    def stop(*args, **kwargs):
        raise ImportError("numba._devicearray failed to import")

    monkeypatch.setattr("flarewright.render.render.render", stop)
    words = ("render", "heliar-tronnier", "--light", "1,1", "-o", "a.exr")
    with pytest.raises(ImportError):
        call(capsys, *words)
    monkeypatch.setattr("flarewright.cli.common._received", [15])
    assert "interrupted; nothing was left" in call(capsys, *words, code=130).err


def test_a_call_that_fails_without_a_reason_lacks_memory_only_where_none_is_left(capsys, monkeypatch, folder):
    """The interpreter's own word for a call from C that failed without setting an error."""
    resource = pytest.importorskip("resource", reason="limits of a process need a POSIX system")
    old = resource.getrlimit(resource.RLIMIT_AS)

    def stop(*args, limited, **kwargs):
        if limited:
            resource.setrlimit(resource.RLIMIT_AS, (1, old[1]))
        raise SystemError("error return without exception set")

    words = ["render", "heliar-tronnier", "--light", "1,1", "-o", "a.exr"]
    monkeypatch.setattr("flarewright.render.render.render", partial(stop, limited=False))
    with pytest.raises(SystemError, match="without exception"):
        run(words)
    monkeypatch.setattr("flarewright.render.render.render", partial(stop, limited=True))
    try:
        said = call(capsys, *words, code=2)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, old)
    assert said.err.startswith("flarewright: error: there is not enough memory")


def test_an_unexpected_end_of_a_file_is_no_interruption(monkeypatch):
    """Typer turns an EOFError of any call into the end of a Ctrl-C."""

    def stop(*args, **kwargs):
        raise EOFError("a library met the end of a file")

    monkeypatch.setattr("flarewright.render.render.render", stop)
    with pytest.raises(EOFError, match="a library met"):
        run(["render", "heliar-tronnier", "--light", "1,1", "-o", "a.exr"])


@pytest.mark.parametrize(
    ("words", "goes_on"),
    [
        ("measure run list.csv -o run", True),
        ("measure merge list.csv -o run", True),
        ("measure find run", True),
        ("measure fit run --by walch", True),
        ("measure track run", True),
        ("measure compress run", True),
        ("measure replay model.json --constellation 3 -o a.exr", False),
        ("predict heliar-tronnier -o page.html", True),
        ("predict heliar-tronnier -o page.html --glare", True),
        ("predict heliar-tronnier", True),
        ("predict heliar-tronnier --cache=kept.npz --glare", True),
        ("ghosts heliar-tronnier --light 1,1", True),
        ("design benchmark heliar", True),
        ("sources plate.png", True),
        ("render heliar-tronnier --light 1,1 -o a.exr", False),
    ],
)
def test_ctrl_c_reports_commands_that_resume(capsys, monkeypatch, words, goes_on):
    def stopped(**_):
        raise KeyboardInterrupt

    monkeypatch.setattr("flarewright.cli.app.command_tree", lambda words: stopped)
    assert run(words.split()) == 130
    more = ", and the same command resumes" if goes_on else ""
    assert capsys.readouterr().err == f"flarewright: interrupted; nothing was left half-written{more}\n"


def test_a_real_draft_render(capsys, folder):
    summary = call_json(
        capsys, "render", "heliar-tronnier", "--light", "8,4", "--quality", "draft", "--wavelengths", "3", "--size",
        "96x54", "--no-starburst", "--layers", "ghosts", "--brightest", "3", "-o", "a.exr",
    )  # fmt: skip
    assert summary["efl_mm"] == pytest.approx(HELIAR_EFL, abs=1e-5)
    back = read_exr("a.exr")
    assert [layer.name for layer in back.layers] == summary["layers"]
    assert len(back.layers) == 5
    assert all(np.isfinite(layer.pixels).all() for layer in back.layers)
    assert back.layers[0].pixels.max() > 0
    assert (folder / "a.png").stat().st_size > 100


# ---------------------------------------------------------------------------------------------------------------------
# ghosts, lenses, lens


def test_ghosts_json_is_the_promised_contract(capsys, folder):
    # stopped down, ghosts have no caustics that need many rays
    stopped = ("ghosts", "heliar-tronnier", "--light", "10,0", "--fstop", "16")
    data = call_json(capsys, *stopped, "--coating", "none")
    assert "veiling_glare" not in data
    assert data["efl_mm"] == pytest.approx(HELIAR_EFL, abs=1e-5)
    assert data["bfl_mm"] == pytest.approx(81.315056, abs=1e-5)
    assert data["f_number"] == 16.0
    assert data["entrance_pupil_diameter_mm"] == pytest.approx(HELIAR_EFL / 16.0, abs=1e-5)
    assert set(data["direct"]) == {"throughput_mm2", "centroid_mm", "rms_radius_mm"}
    assert len(data["ghosts"]) == 28
    wanted = {"first_reflection", "second_reflection", "throughput_mm2", "centroid_mm", "rms_radius_mm"}
    assert wanted | {"peak_irradiance", "peak_patch_mm", "bounded_by", "focus_distance_mm"} == set(data["ghosts"][0])
    flux = [row["throughput_mm2"] for row in data["ghosts"]]
    assert flux == sorted(flux, reverse=True)
    assert all(row["first_reflection"] > row["second_reflection"] for row in data["ghosts"])
    same_side = call_json(capsys, *stopped, "--paths", "same-side")
    assert len(same_side["ghosts"]) == 13
    # a lens is wide open without an f-number
    singlet_file(folder)
    wide_open = call_json(capsys, "ghosts", "singlet.toml", "--light", "10,0")
    assert wide_open["f_number"] == 5.0
    assert wide_open["entrance_pupil_diameter_mm"] == pytest.approx(wide_open["efl_mm"] / 5.0, rel=1e-9)
    assert len(wide_open["ghosts"]) == 1


def test_ghosts_csv_has_the_numbers_of_the_json(capsys):
    stopped = ("ghosts", "heliar-tronnier", "--light", "10,0", "--fstop", "16", "--coating", "none", "--brightest", "5")
    stopped += ("--paths", "same-side")
    data = call_json(capsys, *stopped)
    assert run([*stopped, "--csv"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [row["path"] for row in rows] == [
        "direct",
        *(f"{row['first_reflection']}-{row['second_reflection']}" for row in data["ghosts"]),
    ]
    for row, wanted in zip(rows, [data["direct"], *data["ghosts"]], strict=True):
        assert float(row["throughput_mm2"]) == wanted["throughput_mm2"]
        assert float(row["of_direct"]) == wanted["throughput_mm2"] / data["direct"]["throughput_mm2"]
        assert [float(row["centroid_x_mm"]), float(row["centroid_y_mm"])] == wanted["centroid_mm"]
    assert run([*stopped, "--csv", "--json"]) == 2
    assert "keep one" in capsys.readouterr().err


def test_ghosts_of_a_near_light(capsys):
    """Far away it is distant; near, the front covers its solid angle."""
    arguments = ("ghosts", "heliar-tronnier", "--light", "4,3", "--fstop", "16", "--paths", "same-side")
    distant, far, near = (call_json(capsys, *arguments, "--distance", distance) for distance in ("inf", "1e9", "300"))
    for table in (distant, far, near):
        table["ghosts"].sort(key=lambda row: (row["first_reflection"], row["second_reflection"]))
    assert [row["throughput_mm2"] for row in far["ghosts"]] == pytest.approx(
        [row["throughput_mm2"] for row in distant["ghosts"]], rel=5e-4
    )
    # a light at 300 mm is imaged behind the sensor, so the direct image is a wide disc
    assert near["direct"]["rms_radius_mm"] > 20.0 * distant["direct"]["rms_radius_mm"]
    project = fw.Project(
        lens="heliar-tronnier", f_number=16.0, iris={"blades": 0}, quality={"mode": "draft", "wavelengths": 1},
        lights=[{"field_deg": (4.0, 3.0), "distance": 300.0, "spectrum": {"kind": "lines", "lines": [(587.56, 1.0)]}}],
        output={"layers": "passes", "starburst": False}, camera={"size_px": (60, 40)},
    )  # fmt: skip
    rendered = fw.render(project).summary["lights"][0]
    assert near["direct"]["throughput_mm2"] == pytest.approx(rendered["direct_throughput_mm2"][0], rel=1e-3)
    assert near["direct"]["centroid_mm"] == pytest.approx(rendered["direct_position_mm"], abs=0.02)


def test_ghosts_prints_the_veiling_glare(capsys, monkeypatch):
    from flarewright.optics.scattering import dust
    from flarewright.render.scattering import veiling_glare

    # tests the printed output, not its accuracy (test_veiling_glare): few angles, few and small dust sizes
    monkeypatch.setattr(veiling_glare, "INNER_NODES", 2)
    monkeypatch.setattr(veiling_glare, "OUTER_NODES", 4)
    monkeypatch.setattr(dust, "SIZES", 12)
    monkeypatch.setattr(dust, "LARGEST", 100.0)
    monkeypatch.setattr(dust, "PER_ANGLE", 1)
    monkeypatch.setattr(dust, "_mie_spread", cache(dust._mie_spread.__wrapped__))
    words = ["ghosts", "triplet-pestrecov", "--light", "5,0", "--fstop", "16", "--brightest", "1", "--glare"]
    bare = call_json(capsys, *words, "--coating", "none")["veiling_glare"]
    dusty = call_json(capsys, *words, "--coating", "modern-broadband", "--cleanliness", "300")["veiling_glare"]
    assert bare["scatter"] == 0.0
    assert 0.01 < bare["index"] < 0.2
    assert dusty["ghosts"] < 0.1 * bare["ghosts"]
    assert dusty["scatter"] > 0.0
    assert dusty["index"] == pytest.approx(dusty["ghosts"] + dusty["scatter"] + dusty["blur"])
    known = veiling_glare.VeilingGlare(**{**bare, "wavelength_nm": 550.0})
    monkeypatch.setattr(veiling_glare, "veiling_glare", lambda *_, **__: known)
    assert run(words) == 0
    assert "veiling glare index" in capsys.readouterr().out


def test_ghosts_table_is_for_people(capsys):
    out = call(capsys, "ghosts", "heliar-tronnier", "--light", "-3,4", "--brightest", "2", "--fstop", "16").out
    assert "light at -3, 4 degrees" in out
    assert "direct" in out
    assert len([line for line in out.splitlines() if line.startswith("│")]) == 3


def test_ghosts_table_has_no_negative_zero(capsys):
    out = call(capsys, "ghosts", "heliar-tronnier", "--light", "10,0", "--fstop", "16").out
    assert "17.50, 0.00" in out
    assert "-0.00" not in out


def test_lenses_lists_all_that_ship(capsys):
    listed = call_json(capsys, "lenses")["lenses"]
    assert [row["name"] for row in listed] == list(library_names())
    by_name = {row["name"]: row for row in listed}
    assert by_name["heliar-tronnier"]["surfaces"] == 8
    assert by_name["heliar-tronnier"]["efl_mm"] == pytest.approx(HELIAR_EFL, abs=1e-5)
    assert "US 2,645,156" in call(capsys, "lenses").out


def test_lens_show_json_has_every_row(capsys):
    data = call_json(capsys, "lens", "show", "heliar-tronnier", "--fstop", "7")
    assert data["f_number"] == 7
    assert len(data["rows"]) == 9
    stop, flat = data["rows"][5], data["rows"][6]
    assert stop["stop"] is True
    assert stop["semi_diameter"] == data["stop_semi_diameter_mm"]
    assert flat["radius_mm"] is None
    assert flat["curvature"] == 0.0
    keys = {"row", "stop", "radius_mm", "curvature", "conic", "thickness", "n_d", "v_d", "glass", "semi_diameter"}
    keys |= {"semi_diameter_estimated", "coating", "radius_x_mm", "shape"}
    assert all(set(row) == keys for row in data["rows"])
    assert data["rows"][0]["glass"] == "LAKN7"
    # 1 / (1 / 30.81) is 30.810000000000002
    assert [row["radius_mm"] for row in data["rows"][:2]] == [30.81, -89.35]
    text = call(capsys, "lens", "show", "heliar-tronnier").out
    for words in ("LAKN7", "stop", "flat", "99.236", "thesis"):
        assert words in text


@pytest.mark.parametrize("ghost", [(), ("--ghost", "4-1"), ("--ghost", "sensor-8")])
def test_lens_show_names_the_ghost_it_draws(capsys, folder, ghost):
    said = call(capsys, "lens", "show", "heliar-tronnier", "--plot", "a.svg", "--light", "0,3", *ghost)
    assert "no ray" not in said.err
    assert "wrote a.svg" in said.err
    assert all(f"ghost {name}, light" in (folder / "a.svg").read_text("utf-8") for name in ghost[1:])


@pytest.mark.parametrize("more", [(), ("--light", "0,12"), ("--light", "0,12", "--ghost", "4-1")])
def test_lens_show_draws(capsys, folder, more):
    call(capsys, "lens", "show", "heliar-tronnier", "--plot", "a.svg", *more)
    svg = ET.parse("a.svg").getroot()
    tags = [element.tag.split("}")[1] for element in svg.iter()]
    assert svg.get("width") == "900"
    assert tags.count("polygon") == 5
    assert tags.count("polyline") > 15
    assert "nan" not in (folder / "a.svg").read_text("utf-8").lower().replace("tronnier", "")


def test_every_shipped_lens_can_be_drawn(capsys):
    from flarewright.optics.lens.paraxial import first_order
    from flarewright.render.plots.cross_section import cross_section

    for name in library_names():
        lens = fw.load_lens(name)
        svg = cross_section(lens, first_order(lens)).svg
        ET.fromstring(svg)
        assert ">nan" not in svg
        assert "nan," not in svg


def test_a_light_too_steep_to_draw_is_reported(capsys, folder):
    light = ("lens", "show", "fisheye-nikkor-10.5", "--plot", "a.svg", "--light")
    said = call(capsys, *light, "0,88")
    assert "flarewright: a light at 88 degrees is too steep to draw and taken at 85\n" in said.err
    assert "light at 85°" in (folder / "a.svg").read_text()
    assert "too steep" not in call(capsys, *light, "0,85").err


def test_lens_check_reports_and_converts(capsys, folder):
    said = call(capsys, "lens", "check", "heliar-tronnier")
    assert said.out.startswith("heliar-tronnier: usable, Heliar-Tronnier")
    assert "  - row 3: glass 'BAF9' is not in the catalogue" in said.out
    call(capsys, "lens", "convert", "heliar-tronnier", "copy.toml")
    assert fw.load_lens("copy.toml") == fw.load_lens("heliar-tronnier")
    call(capsys, "lens", "convert", "tessar-brendel", "copy.toml", "--force")
    assert fw.load_lens("copy.toml") == fw.load_lens("tessar-brendel")
    files = call_json(capsys, "lens", "check", "copy.toml")["files"]
    assert files[0]["usable"] is True
    assert [path.name for path in folder.iterdir()] == ["copy.toml"]


def test_schemas_are_schemas(capsys):
    """Those that are checked in tests/io."""
    for kind, schema in (("lens", lens_json_schema()), ("project", project_json_schema())):
        assert json.loads(call(capsys, kind, "schema").out) == json.loads(json.dumps(schema))


# ---------------------------------------------------------------------------------------------------------------------
# coating


def test_coating_list_states_what_the_coatings_do(capsys):
    listed = call_json(capsys, "coating", "list")["coatings"]
    assert [row["name"] for row in listed] == [
        "uncoated-1930s", "single-1950s", "early-multicoat", "modern-broadband"]  # fmt: skip
    assert all(row["source"] and row["era"] and row["design"] for row in listed)
    means = [row["on_glass"][0]["mean_reflectance"] for row in listed]
    assert means[0] > 2 * means[1] > 4 * means[2]
    assert [len(row["on_glass"][0]["films"]) for row in listed] == [0, 1, 3, 5]
    assert "modern-broadband" in call(capsys, "coating", "list").out


def test_coating_plot_prints_and_draws(capsys, folder):
    data = call_json(capsys, "coating", "plot", "quarter-wave:550", "--glass", "1.52")
    at = data["wavelengths_nm"].index(550.0)
    assert data["angles"][0]["reflectance"][at] == pytest.approx(((1.52 - 1.38**2) / (1.52 + 1.38**2)) ** 2, rel=1e-9)
    assert [row["angle_deg"] for row in data["angles"]] == [0, 15, 30, 45, 60]
    assert data["films"] == [{"index": 1.38, "thickness_nm": pytest.approx(550 / 4 / 1.38)}]
    assert "SCHOTT N-SF6" in call(capsys, "coating", "plot", "modern-broadband", "--glass", "n sf6").out
    # an ideal film reaches zero, which a logarithmic axis cannot show
    for name, coating in (("a.svg", "quarter-wave:550:ideal"), ("b.svg", "none"), ("a.png", "early-multicoat")):
        assert call(capsys, "coating", "plot", coating, "-o", name).out == ""
    for name, curves in (("a.svg", 5), ("b.svg", 5)):
        text = (folder / name).read_text("utf-8")
        assert sum(line.count('stroke-width="2"') for line in text.splitlines()) == curves
        ET.fromstring(text)
        assert "nan" not in text
    pixels = np.asarray(Image.open("a.png"))
    assert pixels.shape == (560, 900, 3)
    assert len(np.unique(pixels @ np.array([65536, 256, 1]))) > 200
    assert sorted(path.name for path in folder.iterdir()) == ["a.png", "a.svg", "b.svg"]


# ---------------------------------------------------------------------------------------------------------------------
# project


def test_project_init_teaches_and_is_usable(capsys, folder):
    (folder / "sub").mkdir()
    call(capsys, "lens", "convert", "tessar-brendel", "mine.toml")
    call(capsys, "project", "init", "mine.toml", "--light", "-1,2", "-o", "sub/p.toml")
    text = (folder / "sub" / "p.toml").read_text()
    assert 'lens = "../mine.toml"' in text
    assert "# f_number = 2.8" in text
    assert call(capsys, "project", "check", "sub/p.toml").out.startswith("sub/p.toml: usable, ")
    assert call_json(capsys, "project", "check", "sub/p.toml")["usable"] is True
    assert read_project("sub/p.toml").lights[0].field_deg == (-1, 2)
    out = call(capsys, "project", "init", "Heliar Tronnier").out
    import tomllib

    project = project_from_data(tomllib.loads(out), folder=Path(), where="stdout")
    assert project.lens == "heliar-tronnier"
    assert project.coating == AsLens()


# ---------------------------------------------------------------------------------------------------------------------
# the program itself


def test_flags_without_effect_are_reported(capsys):
    words = ["render", "heliar-tronnier", "--light", "8,5", "--size", "32x18", "--quality", "draft", "-o", "a.exr"]
    words += ["--wavelengths", "1", "--no-starburst"]
    err = call(capsys, *words, "--orders", "4", "--brightest", "3").err
    assert "draft quality draws ghosts of two reflections only: --orders 4 is for final quality" in err
    assert "--brightest has no effect without layers of single ghosts: add --layers ghosts" in err


def test_help_keeps_its_square_brackets(capsys):
    def texts(command):
        yield from (command.help, command.short_help, command.epilog)
        yield from (getattr(parameter, "help", None) for parameter in command.params)
        for each in getattr(command, "commands", {}).values():
            yield from texts(each)

    for text in filter(None, texts(get_command(command_tree()))):
        assert from_markup(text).plain == text.replace("\\[", "[")
    assert "flarewright[ui]" in call(capsys, "edit", "--help").out


@pytest.mark.parametrize("words", [(), ("lens",), ("coating",), ("project",), ("render", "--help"), ("ghosts", "-h")])
def test_help_is_given(capsys, words, monkeypatch):
    # tests/cli/test_gallery_command.py tests the pictures above the help
    monkeypatch.setattr("flarewright.cli.app._show_gallery", lambda: None)
    out = call(capsys, *words).out
    assert "Usage: flarewright" in out


def test_version(capsys):
    assert call(capsys, "--version").out == f"flarewright {__version__}\n"


@pytest.mark.skipif(os.name == "nt", reason="pipes close otherwise there")
def test_a_reader_that_goes_away_causes_no_complaint():
    # the lightest of the long outputs
    command = f'"{sys.executable}" -m flarewright lens schema | true'
    done = subprocess.run(["/bin/sh", "-c", command], check=False, capture_output=True, text=True, timeout=60)
    assert done.stderr == ""


@pytest.mark.parametrize(("number", "kept"), [(errno.EACCES, True), (errno.ENOSPC, False)])
def test_only_a_full_disk_costs_the_kept_part(number, kept, tmp_path, monkeypatch):
    part = PartialPicture(tmp_path / "f.partial", lambda _: None)
    part.begin("order2", 1)
    assert part.store("ghosts-0", 1, blank((4, 4)))
    tries = []

    def write(*_):
        tries.append(part.size_bytes)
        if part.size_bytes:
            raise OutputError("cannot write f.exr") from OSError(number, "no")
        return {}, []

    monkeypatch.setattr(render_command, "_write", write)
    options = SimpleNamespace(output=tmp_path / "f.exr", full_windows=False)
    if kept:
        with pytest.raises(OutputError):
            render_command._written(None, options, None, part)
        assert part.size_bytes
    else:
        assert render_command._written(None, options, None, part) == ({}, [])
        assert len(tries) == 2
