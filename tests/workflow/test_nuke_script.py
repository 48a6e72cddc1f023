"""The script for Nuke, parsed and evaluated: with gains of 1 it gives the plate plus the beauty."""

import re
import shutil
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.errors import OutputError, ProjectError
from flarewright.io.images.exr import read_exr, write_exr
from flarewright.io.images.exr_attributes import shot_attributes
from flarewright.model import Layer
from flarewright.workflow.nuke_graph import quoted
from flarewright.workflow.nuke_script import nuke_script

SIZE = (16, 9)
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|\{|\}|[^\s{}"]+|\n')


@dataclass
class Parsed:
    """A node of a script."""

    kind: str
    knobs: dict
    inputs: list = field(default_factory=list)
    below: list = field(default_factory=list)


def parsed(text):
    """Return the nodes of a script in its order, with the nodes that their inputs are; a small twin of Nuke's reader.

    A command is a line outside braces: a node with its knobs, `set NAME [stack 0]`, `push $NAME`, `add_layer`,
    `version`, `end_group`.
    """
    lines, depth, command = [], 0, ""
    for line in text.splitlines():
        command += line + "\n"
        plain = re.sub(r"\\.", "", re.sub(r'"(?:\\.|[^"\\])*"', "", line))
        depth += plain.count("{") - plain.count("}")
        if depth == 0:
            lines.append(command.strip())
            command = ""
    assert depth == 0, "braces are not balanced"
    nodes, stack, names, outer = [], [], {}, []
    for line in lines:
        if found := re.fullmatch(r"set (\w+) \[stack 0\]", line):
            names[found[1]] = stack[-1]
        elif found := re.fullmatch(r"push \$(\w+)", line):
            stack.append(names[found[1]])
        elif line == "end_group":
            group, inside = outer.pop()
            group.below, nodes = nodes, inside
        elif found := re.fullmatch(r"(\w+) \{\n(.*)\}", line, re.DOTALL):
            node = Parsed(found[1], {})
            for knob in found[2].strip().splitlines():
                name, _, value = knob.strip().partition(" ")
                assert name not in node.knobs or name == "addUserKnob", f"{name} twice"
                node.knobs.setdefault(name, value)
                node.below += [value] if name == "addUserKnob" else []
            number = int(node.knobs.pop("inputs", 1))
            if node.kind in ("Root", "Gizmo"):
                nodes.append(node)
                if node.kind == "Gizmo":
                    outer.append((node, nodes))
                    nodes, stack = [], []
                continue
            # the first input is the last one pushed
            node.inputs = [stack.pop() for _ in range(number)]
            stack.append(node)
            nodes.append(node)
        else:
            assert re.fullmatch(r"version [\d.]+ v\d+|add_layer \{(\w+) \1\.red \1\.green \1\.blue\}", line), line
    assert outer == []
    return nodes


def value(text):
    """Return the text of a value without its quotation marks."""
    return re.sub(r"\\(.)", r"\1", text[1:-1]) if text.startswith('"') else text


def evaluated(node, files, inputs=(), parent=None):
    """Return the layers of a node's result: name to pixels, the unnamed layer is `rgb`."""
    knobs = node.knobs
    before = [evaluated(one, files, inputs, parent) for one in node.inputs]

    def number(text):
        if found := re.fullmatch(r"\{\{parent\.(\w+)\}\}", text):
            return parent[found[1]]
        return float(text)

    match node.kind:
        case "Read":
            assert knobs["name"] != "Flare_file" or (knobs["raw"], knobs["file_type"]) == ("true", "exr")
            return files[value(knobs["file"])]
        case "Input":
            return inputs[int(knobs.get("number", 0))]
        case "Output":
            return before[0]
        case "Multiply":
            assert knobs["channels"] == "all"
            return {name: number(knobs["value"]) * pixels for name, pixels in before[0].items()}
        case "Shuffle":
            assert knobs["alpha"] == "black"
            return before[0] | {"rgb": before[0][knobs["in"]]}
        case "Grade":
            assert (knobs["channels"], knobs["black_clamp"]) == ("rgb", "false")
            return before[0] | {"rgb": number(knobs["white"]) * before[0]["rgb"]}
        case "Merge2":
            # b is the first input
            b, a = (one["rgb"] for one in before)
            return {"rgb": a + b if knobs["operation"] == "plus" else b - a}
    raise AssertionError(node.kind)


@pytest.fixture
def shot(tmp_path):
    """Write three frames of a flare with negative channels, ghosts in windows, and return their pattern."""
    rng = np.random.default_rng(1)
    whole = (0, 0, *SIZE)

    def layer(name, window=whole):
        return Layer(name, rng.normal(0.02, 0.02, (window[3], window[2], 3)).astype(np.float32), window, {})

    for frame in (1001, 1002, 1004):
        singles = [layer("ghost_04_01", (2, 1, 6, 5)), layer("ghost_02_00", (0, 0, 3, 3))]
        starburst, ghosts, scatter = (layer(name) for name in ("starburst", "ghosts", "scatter"))
        beauty = Layer("beauty", starburst.pixels + ghosts.pixels + scatter.pixels, whole, {})
        write_exr(
            tmp_path / f"flare.{frame}.exr", [beauty, starburst, ghosts, scatter, *singles], SIZE, pixel_type="half",
            attributes=shot_attributes(frame=frame, fps=Fraction(24000, 1001), shutter_s=0.0), metadata={},
            pixel_aspect=2.0,
        )  # fmt: skip
    return str(tmp_path / "flare.####.exr")


def layers_of(path):
    """Return the layers of a file as Nuke reads them: values of the file, within the whole picture."""
    contents = read_exr(path)
    found = {}
    for one in contents.layers:
        x, y, w, h = one.window
        found[one.name] = np.zeros((SIZE[1], SIZE[0], 3))
        found[one.name][y : y + h, x : x + w] = contents.scale * one.pixels.astype(np.float64)
    found["rgb"] = found.pop("beauty")
    return found


@pytest.mark.parametrize("singles", [False, True], ids=["passes", "single ghosts"])
def test_the_script_gives_the_plate_plus_the_beauty(shot, tmp_path, singles):
    (tmp_path / "plate [1].0000.exr").write_bytes(b"")
    script = nuke_script(shot, plate=str(tmp_path / "plate [1].####.exr"), gain=2.0, singles=singles)
    nodes = parsed(script.text)
    flare, plate = layers_of(tmp_path / "flare.1001.exr"), {"rgb": np.full((9, 16, 3), 0.18)}
    files = {str(tmp_path / "flare.####.exr"): flare, str(tmp_path / "plate [1].####.exr"): plate}
    comp = nodes[-1]
    assert comp.knobs["name"] == "Comp"
    whole = evaluated(comp, files)["rgb"]
    np.testing.assert_allclose(whole, 0.18 + 2.0 * flare["rgb"] / 1024.0, atol=2e-4)
    # without one pass the rest stays
    off = "ghost_04_01" if singles else "scatter"
    grade = next(one for one in nodes if one.knobs.get("name") == f"Gain_{off}")
    grade.knobs["white"] = "0"
    np.testing.assert_allclose(evaluated(comp, files)["rgb"], whole - 2.0 * flare[off] / 1024.0, atol=1e-9)
    singles_of = ("scatter", "ghost_04_01", "ghost_02_00", "rest") if singles else ("ghosts", "scatter")
    assert script.passes == ("starburst", *singles_of)


def test_the_gizmo_does_the_same_with_a_knob_for_each_gain(shot, tmp_path):
    text = nuke_script(shot, singles=True, gizmo="Flare").text
    (gizmo,) = parsed(text)
    gains = {name: float(value) for name, value in gizmo.knobs.items() if name not in ("name", "addUserKnob")}
    passes = ["starburst", "scatter", "ghost_04_01", "ghost_02_00", "rest"]
    assert list(gains) == ["exposure", *(f"gain_{one}" for one in passes)]
    assert set(gains.values()) == {1.0}
    # 7 is a number with a slider
    assert re.findall(r"addUserKnob \{7 (\w+) l \w+ R 0 4\}", text) == list(gains)
    # every knob is declared, as a number
    assert [re.match(r"\{7 (\w+) l", one)[1] for one in gizmo.below[:0]] == []
    flare, plate = layers_of(tmp_path / "flare.1001.exr"), {"rgb": np.full((9, 16, 3), 0.18)}
    output = gizmo.below[-1]
    assert output.kind == "Output"
    whole = evaluated(output, {}, [plate, flare], gains)["rgb"]
    np.testing.assert_allclose(whole, 0.18 + flare["rgb"] / 1024.0, atol=1e-4)
    darker = evaluated(output, {}, [plate, flare], gains | {"exposure": 0.5, "gain_scatter": 0.0})["rgb"]
    np.testing.assert_allclose(darker, 0.18 + 0.5 * (whole - 0.18 - flare["scatter"] / 1024.0), atol=1e-9)


def test_a_rounded_rate_of_the_files_is_the_exact_one(tmp_path):
    """Other programs state 23.976 as 2997/125."""
    black = Layer("beauty", np.zeros((9, 16, 3), np.float32), (0, 0, *SIZE), {})
    stated = {"framesPerSecond": Fraction(2997, 125)}
    write_exr(tmp_path / "flare.1.exr", [black], SIZE, pixel_type="half", attributes=stated, metadata={})
    assert parsed(nuke_script(str(tmp_path / "flare.#.exr")).text)[0].knobs["fps"] == "23.976024"


def test_frames_rate_and_format_are_those_of_the_files(shot):
    script = nuke_script(shot)
    root, reader = parsed(script.text)[:2]
    assert script.frames == (1001, 1004)
    assert "no frames 1003" in script.remarks[0]
    assert (root.knobs["first_frame"], root.knobs["last_frame"], root.knobs["fps"]) == ("1001", "1004", "23.976024")
    assert value(root.knobs["format"]) == value(reader.knobs["format"]) == "16 9 0 0 16 9 2 flare_16x9"
    assert (reader.knobs["first"], reader.knobs["last"]) == ("1001", "1004")
    # asked for otherwise
    script = nuke_script(shot, frames=(1001, 1002), fps=Fraction(25))
    assert parsed(script.text)[0].knobs["fps"] == "25"
    assert script.frames == (1001, 1002)
    assert script.remarks == ()


def test_frames_without_a_file_are_remarked_however_they_were_chosen(shot):
    """With --frames a Read asked for frames of the flare or the plate that do not exist, without a word."""
    flare, plate = Path(shot), Path(shot).with_name("plate.####.exr")
    for frame in (1001, 1003):
        shutil.copyfile(flare.with_name("flare.1001.exr"), plate.with_name(f"plate.{frame}.exr"))
    chosen = nuke_script(shot, plate=str(plate), frames=(1001, 1002, 1004)).remarks
    assert [line.partition(" has ")[2] for line in chosen] == [
        "no frames 1003; Nuke reports an error there", "no frames 1002,1004; Nuke reports an error there",
    ]  # fmt: skip
    found = nuke_script(shot, plate=str(plate)).remarks
    assert [line.partition(" has ")[2] for line in found[1:]] == [
        "the frames 1001 to 1003 only", "no frames 1002; Nuke reports an error there",
    ]  # fmt: skip


@pytest.mark.parametrize("pattern", ["flare.%04d.exr", "flare.$F4.exr"])
def test_every_pattern_is_written_as_nuke_does(shot, tmp_path, pattern):
    reader = parsed(nuke_script(str(tmp_path / pattern)).text)[1]
    assert value(reader.knobs["file"]) == str(tmp_path / "flare.####.exr")


def test_layers_that_do_not_add_up_are_stay_together(tmp_path):
    pixels = np.full((9, 16, 3), 0.5, np.float32)
    path = tmp_path / "a.exr"
    write_exr(path, [Layer("beauty", pixels, (0, 0, *SIZE), {}), Layer("ghosts", pixels / 2, (0, 0, *SIZE), {})], SIZE)
    script = nuke_script(str(path), singles=True)
    assert script.passes == ("beauty",)
    assert script.remarks == (
        "there are no layers of single ghosts: draw them with --layers ghosts --brightest 20",
        "the layers ghosts do not add up to the beauty: the beauty is graded as a whole",
    )
    files = {str(path): layers_of(path)}
    np.testing.assert_allclose(evaluated(parsed(script.text)[-1], files)["rgb"], pixels)


def test_names_that_nuke_changes_stay_in_their_pass(shot, tmp_path):
    contents = read_exr(tmp_path / "flare.1001.exr")
    path = tmp_path / "b.exr"
    names = [one.name.replace("ghost_04_01", "ghost.4-1") for one in contents.layers]
    layers = [Layer(name, one.pixels, one.window, {}) for name, one in zip(names, contents.layers, strict=True)]
    write_exr(path, layers, SIZE)
    script = nuke_script(str(path), singles=True)
    assert "ghost_02_00" in script.passes
    assert "1 single ghosts stay in the pass ghosts, since Nuke changes names such as ghost.4-1" in script.remarks[0]


@pytest.mark.parametrize("text", ["a b", "[exec rm]", "$HOME", 'a"b', "a{b", "back\\slash", "", "line\nbreak", "ä"])
def test_values_are_quoted_so_that_tcl_reads_them_as_text(text):
    out = quoted(text)
    assert value(out) == text.replace("\n", " ")
    # no special character without a backslash
    assert not re.search(r'(?<!\\)(?:\\\\)*[\[\]{}$"]', out[1:-1])


@pytest.mark.parametrize(
    ("flare", "options", "sentence"),
    [
        ("none.exr", {}, "does not exist"),
        ("none.####.exr", {}, "there are no files"),
        ("flare.####.exr", {"frames": (7, 8)}, "none of those asked"),
        ("flare.####.exr", {"frames": (1000, 1001)}, "flare.1000.exr does not exist"),
        ("flare.####.exr", {"frames": (1001, 10**9)}, "1001 to 1000000000 are more than 1000000 frames"),
        ("flare.####.exr", {"gain": float("nan")}, "the gain nan is no factor above 0"),
        ("flare.####.exr", {"plate": "plate.####.exr"}, "there are no files"),
    ],
)
def test_what_is_not_there_is_one_sentence(shot, tmp_path, monkeypatch, flare, options, sentence):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ProjectError, match=re.escape(sentence)):
        nuke_script(flare, **options)


def test_a_file_of_another_kind_is_refused(tmp_path):
    (tmp_path / "a.exr").write_bytes(b"no picture")
    with pytest.raises(OutputError, match="cannot be read as an EXR file"):
        nuke_script(str(tmp_path / "a.exr"))


def test_frames_of_another_scale_are_refused(shot, tmp_path):
    # as `render` writes a frame with a brighter light
    beauty = Layer("beauty", np.ones((SIZE[1], SIZE[0], 3), np.float32), (0, 0, *SIZE), {})
    write_exr(tmp_path / "flare.1004.exr", [beauty], SIZE, scale=2.0**-7)
    with pytest.raises(ProjectError, match=r"flare\.1004\.exr holds .* times 0\.0078125, .*1001\.exr times 1024"):
        nuke_script(shot)
    assert nuke_script(shot, frames=(1001, 1002)).frames == (1001, 1002)


def test_the_command_writes_once(shot, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["nuke-script", "flare.####.exr", "-o", "a.nk"]) == 0
    assert "a.nk: grades starburst, ghosts, scatter" in capsys.readouterr().err
    text = (tmp_path / "a.nk").read_text()
    assert run(["nuke-script", "flare.####.exr", "-o", "a.nk", "--gain", "2"]) == 2
    assert "a.nk exists already" in capsys.readouterr().err
    assert (tmp_path / "a.nk").read_text() == text
    assert run(["nuke-script", "flare.####.exr", "-o", "a.nk", "--gain", "2", "--force"]) == 0
    assert (tmp_path / "a.nk").read_text() != text
    for words, sentence in (
        (["-o", "a.gizmo", "--plate", "flare.####.exr"], "leave --plate out"),
        (["-o", "a.txt"], "must be named *.nk or *.gizmo"),
        (["-o", "b.nk", "--fps", "-1"], "--fps -1 is no frame rate"),
    ):
        capsys.readouterr()
        assert run(["nuke-script", "flare.####.exr", *words]) == 2
        assert sentence in capsys.readouterr().err
    assert run(["nuke-script", "flare.####.exr", "-o", "7 sins.gizmo"]) == 0
    assert "name Flare_7_sins" in (tmp_path / "7 sins.gizmo").read_text()
