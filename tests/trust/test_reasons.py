"""Files of other programs, and files with parts that are not read: the message names the true cause."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import tifffile

from flarewright.cli.app import run
from flarewright.cli.render.command import _without_effect
from flarewright.cli.render.options.record import RenderOptions
from flarewright.errors import FlarewrightError, ProjectError
from flarewright.io.images.photo import open_photo
from flarewright.io.lens.coating_text import read_coating_file
from flarewright.io.lens.formats.dotlens import read_dotlens
from flarewright.io.measurement.captures import read_camera
from flarewright.io.project.scene_file import read_scene
from flarewright.measure.merging.exposure_check import refuse_contradiction
from flarewright.measure.merging.hdr_merge import Exposure
from flarewright.measure.merging.noise import Noise
from flarewright.model import Light, Project
from flarewright.model.project.light import LightKey

REALFLARE = {"name": "x", "fstop": 4, "lens_elements": [{"radius": 50, "distance": 6, "refractive_index": 1.5168}]}
PBRT = "# a double Gauss\n30 3.8 1.67 25\n85 0.1 1 25\n19.5 4 1.67 23\n0 4.5 0 17\n-40 0 1 20\n"


@pytest.mark.parametrize(
    "command",
    [
        ["render", "--project", "FILE", "-o", "o.exr"],
        ["project", "check", "FILE"],
        ["scene", "check", "FILE"],
    ],
    ids=lambda command: " ".join(command[:2]),
)
@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("other.json", json.dumps(REALFLARE), "is a lens of RealFlare (JSON): name it with the suffix .json"),
        ("other.dat", PBRT, "other.dat is a lens"),
    ],
    ids=["realflare", "pbrt"],
)
def test_lenses_of_other_programs_get_one_hint_where_no_lens_is_read(
    tmp_path, monkeypatch, capsys, command, name, text, words
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(text)
    assert run([name if word == "FILE" else word for word in command]) == 2
    assert words in capsys.readouterr().err


def exposures(tmp_path, *, gamma, part=0.25, listed=0.25):
    """Return two photographs of a ramp as 16-bit TIFF with a curve, the first with `part` of the second's light."""
    light = np.linspace(0.05, 0.6, 64 * 96 * 3).reshape(64, 96, 3)
    found = []
    for name, share, seconds in (("a", part, listed), ("b", 1.0, 1.0)):
        path = tmp_path / f"{name}.tif"
        tifffile.imwrite(
            path, np.round(65535.0 * (share * light) ** (1.0 / gamma)).astype(np.uint16), photometric="rgb"
        )
        noise = Noise(1e-3, 4.0)
        black = np.zeros(3, np.float32)
        found.append(Exposure(open_photo(path), seconds, (noise, noise, noise), black, 65535.0))
    return found


@pytest.mark.parametrize("gamma", [1.8, 2.2, 2.4])
@pytest.mark.parametrize("part", [0.25, 0.4])
def test_gamma_encoded_captures_are_not_linear(tmp_path, gamma, part):
    with pytest.raises(FlarewrightError, match=r"a\.tif and b\.tif are not linear: .* a gamma curve"):
        refuse_contradiction(exposures(tmp_path, gamma=gamma, part=part, listed=part))


def test_linear_captures_pass_and_a_wrong_list_is_no_gamma(tmp_path):
    refuse_contradiction(exposures(tmp_path, gamma=1.0))
    with pytest.raises(FlarewrightError, match="contradict the list"):
        refuse_contradiction(exposures(tmp_path, gamma=1.0, part=0.25, listed=0.125))


TABLE = """\
# Own
name: one
name: two
surfaces:
50 5 1.5168 64.2 20 1.5
-50 2 1 0 20 0
stop 3 1.6 40 10 0
surfaces:
100 40 1 0 20 0
"""


def test_what_a_lens_table_leaves_out_is_reported(tmp_path):
    path = tmp_path / "own.lens"
    path.write_text(TABLE)
    remarks = " | ".join(read_dotlens(path).remarks)
    for words in (
        "line 3: name is given twice; the last one is used",
        "line 5: 1.5 coating layers, read as 1",
        "line 7: the stop states an index of 1.6, but it refracts nothing; left out",
        'line 8: a second "surfaces:"; its rows are added to the first table',
    ):
        assert words in remarks


@pytest.mark.parametrize(
    ("read", "text", "words"),
    [
        (read_camera, '{"black_levl": 1}', "black_levl is not a known key; did you mean 'black_level'?"),
        (read_scene, "[[camras]]\n[[cameras]]\n", "camras is not a known key; did you mean 'cameras'?"),
        (read_coating_file, 'rows = ["none"]\nrwos = 3\n', "has 'rwos' beside its coatings"),
        (read_coating_file, 'rows = "none"\n', "is no coating file"),
    ],
)
def test_unknown_keys_are_reported_with_the_nearest_known_one(tmp_path, read, text, words):
    path = tmp_path / "own.toml"
    path.write_text(text)
    with pytest.raises((FlarewrightError, ProjectError)) as raised:
        read(path)
    assert words in " | ".join((str(raised.value), *raised.value.problems))


def test_a_render_reports_keyframes():
    keys = tuple(LightKey(at_s=s, field_deg=(s, 5.0)) for s in (0.0, 2.0))
    shot = Project(
        lens="heliar-tronnier", lights=(Light(field_deg=(3.0, 5.0)), Light(field_deg=(1.0, 5.0), keyframes=keys))
    )
    options = RenderOptions(lens=None, light=[], output=Path("o.exr"))
    assert "keys of light 1 are left out" in " | ".join(_without_effect(options, shot))
    still = shot.replace(lights=shot.lights[:1])
    assert not any("keyframes" in remark for remark in _without_effect(options, still))
