"""Flags that make each other ineffective are rejected or reported; light beyond all numbers is rejected."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.io.images.exr import read_exr

SMALL = ["render", "heliar-tronnier", "--light", "10,5", "--size", "32x18", "--quality", "draft", "--wavelengths", "1"]
# the starburst of a small round opening is faster
SMALL += ["--fstop", "16", "--blades", "0", "--no-png", "-o", "a.exr"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        ("--half --float", "--half and --float both set"),
        ("--float --compression dwaa", "--compression dwaa keeps 16 bits of a value and --float writes 32"),
        ("--physical --gain ghosts=2", "--gain is an override and --physical ignores"),
        ("--physical --mute 7-3", "--mute is an override"),
        ("--physical --starburst-size 2", "--starburst-size is an override"),
        ("--physical --ghost-offset 1", "--ghost-offset is an override"),
        ("--no-starburst --cats-eye", "--cats-eye shapes the starburst and --no-starburst omits it"),
        ("--no-starburst --starburst-spiral 3", "--starburst-spiral shapes the starburst"),
        ("--blades 0 --rounding 0.5", "--rounding shapes blades and --blades 0 is round without any"),
        ("--scatter none --surface-roughness 2", "--surface-roughness has no effect on --scatter none"),
        ("--scatter abg --surface-roughness 2", "--surface-roughness has no effect on --scatter abg"),
        ("--scatter chaumond --cleanliness 300", "--cleanliness has no effect on --scatter chaumond"),
    ],
)
def test_flags_that_contradict_each_other_are_refused(capsys, folder, flags, words):
    assert run([*SMALL, *flags.split()]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"flarewright: error: {words}")
    assert err.rstrip().endswith("keep one")
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        ("--full-windows", "--full-windows has no effect without layers of single ghosts: add --layers ghosts"),
        ("--matte-ranks 4", "--matte-ranks has no effect without a matte: add --matte ghosts"),
        ("--order4-limit 1e-3", "--order4-limit has no effect without ghosts of four reflections: add --orders 4"),
    ],
)
def test_flags_without_effect_are_reported(capsys, folder, flags, words):
    assert run([*SMALL, *flags.split()]) == 0
    assert words in capsys.readouterr().err


def test_gains_that_multiply_beyond_all_measure_are_refused_before_the_work(capsys, folder):
    assert run([*SMALL, "--rule", 'select = "7-3", gain = 1e9, tint = [1e9, 1, 1]', "--gain", "ghosts=2"]) == 2
    assert "ghost 7-3 and the pass gain multiply its light by 2e+18; keep their product" in capsys.readouterr().err
    assert run([*SMALL, "--gain", "7-3=1e9", "--gain", "ghosts=1e9", "--intensity", "1e20"]) == 0
    assert all(np.isfinite(layer.pixels).all() for layer in read_exr("a.exr").layers)


def test_light_beyond_the_numbers_of_a_picture_is_refused(capsys, folder):
    (folder / "shot.toml").write_text(
        'lens = "heliar-tronnier"\nf_number = 16\n[[lights]]\nfield_deg = [10, 5]\nintensity = 1e20\n'
        '[camera]\nsize_px = [32, 18]\n[quality]\nmode = "draft"\nwavelengths = 1\n'
        "[starburst]\nintensity = 1e9\n[art.gain]\nstarburst = 1e9\n"
    )
    assert run(["render", "--project", "shot.toml", "-o", "a.exr"]) == 2
    err = capsys.readouterr().err
    assert "the light of the layer beauty is beyond the numbers that a picture holds" in err
    assert "Warning" not in err
    assert [path.name for path in folder.iterdir()] == ["shot.toml"]


@pytest.mark.parametrize("intensity", ["1", "1e12"])
def test_half_floats_clip_no_light_however_bright(capsys, folder, intensity):
    assert run([*SMALL, "--intensity", intensity, "--gain", "starburst=1e6"]) == 0
    scale = 1024.0 / 2.0 ** (40 if intensity == "1e12" else 0)
    halves, err = read_exr("a.exr"), capsys.readouterr().err
    assert f"the EXR holds irradiances times {scale:.9g}, its attribute flarewright.scale" in err
    assert run([*SMALL, "--intensity", intensity, "--gain", "starburst=1e6", "--float"]) == 0
    floats = read_exr("a.exr")
    assert "flarewright.scale" not in capsys.readouterr().err
    assert (halves.scale, floats.scale) == (scale, 1.0)
    assert floats.layers[0].pixels.max() * scale > 65504.0
    for half, full in zip(halves.layers, floats.layers, strict=True):
        for channel in range(3):
            there, here = half.pixels[..., channel], full.pixels[..., channel]
            np.testing.assert_allclose(there, here, rtol=2.0**-11, atol=2.0**-25 / scale)


def test_a_light_s_path_through_the_picture_leaves_the_scale(folder):
    scales, words = [], ["--light", "-3,4", "--intensity", "100000", "--layers", "ghosts", "--paths", "same-side"]
    for place in ("0,0", "10,5"):
        assert run([*SMALL, "--light", place, *words]) == 0
        scales.append(read_exr("a.exr").scale)
    assert scales == [2.0**-7] * 2


def test_a_flag_without_effect_on_the_scatter_of_a_project_is_refused(capsys, folder):
    text = 'lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [10, 5]\n[scatter]\nmodel = "abg"\n'
    (folder / "p.toml").write_text(text)
    assert run(["render", "--project", "p.toml", "--surface-roughness", "50", "-o", "a.exr"]) == 2
    assert "--surface-roughness has no effect on the scatter of the project, abg" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('[quality]\nmode = "reference"\n[output]\nmatte = "ghosts"\n', "a matte needs each ghost alone"),
        ('[output]\nocio_space = "ACEScg"\nocio_config = "none.ocio"\n', "none.ocio"),
    ],
)
def test_a_project_that_cannot_be_rendered_is_not_usable(capsys, folder, lines, words):
    (folder / "p.toml").write_text(f'lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [10, 5]\n{lines}')
    assert run(["project", "check", "p.toml"]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("flag", ["--ringing off", "--ledger", "--profile"])
def test_a_measured_flare_refuses_flags_for_a_prescription(capsys, folder, flag):
    (folder / "model.json").write_text("{}")
    assert run(["render", "model.json", "--light", "5,0", *flag.split(), "-o", "a.exr"]) == 2
    name = flag.split()[0]
    assert f"model.json is a measured flare, which has no {name[2:]}; omit {name}" in capsys.readouterr().err
