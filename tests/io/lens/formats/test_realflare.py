"""Lenses of RealFlare: JSON with a list of elements."""

from __future__ import annotations

import copy
import json

import pytest

from flarewright.cli.app import run
from flarewright.errors import LensError
from flarewright.model import Stop
from flarewright.optics.lens.paraxial import first_order
from flarewright.render.scene.resolve import open_lens


def element(radius, distance, index=1.0, abbe=0.0, height=10.0):
    return {"radius": radius, "distance": distance, "refractive_index": index, "abbe_nr": abbe, "height": height}


LENS = {
    "name": "Own lens", "year": 1950, "patent_number": "US0", "notes": "Fig. 1", "focal_length": 50, "fstop": 4,
    "aperture_index": 2,
    "lens_elements": [
        element(51.6, 4.0, 1.516, 64.1), element(0.0, 2.0), element(0.0, 5.0, height=8.0),
        element(0.0, 4.0, 1.516, 64.1), element(-500.0, 80.0),
    ],
}  # fmt: skip


def opened(tmp_path, data):
    path = tmp_path / "lens.json"
    path.write_text(json.dumps(data))
    return open_lens(path)


def test_the_numbers_of_the_file(tmp_path):
    found = opened(tmp_path, LENS)
    lens = found.lens
    assert (lens.name, lens.f_number) == ("Own lens", 4.0)
    assert "Patent US0. Fig. 1" in lens.notes
    assert isinstance(lens.rows[2], Stop)
    assert lens.rows[0].medium.v_d == 64.1
    assert lens.rows[0].semi_diameter == 10.0
    # two plano-convex lenses: 1/f = p + q - d p q between their principal planes
    p, q = 0.516 / 51.6, 0.516 / 500.0
    apart = 7.0 + 2 * 4.0 / 1.516
    assert first_order(lens).efl == pytest.approx(1.0 / (p + q - apart * p * q), rel=1e-12)
    # the file says 50 mm
    assert any("the file says 50 mm" in remark for remark in found.remarks)


def test_it_is_a_lens_in_every_command_and_no_measured_flare(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.json").write_text(json.dumps(LENS))
    assert run(["lens", "show", "a.json"]) == 0
    assert run(["project", "init", "a.json", "-o", "p.toml"]) == 0, capsys.readouterr().err
    assert run(["project", "check", "p.toml"]) == 0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"aperture_index": 9}, "aperture_index is 9, the place of the stop"),
        ({"aperture_index": None}, "aperture_index is missing, the place of the stop"),
        ({"lens_elements": [{"radius": 50.0}]}, "element 0: distance is missing, a number was expected"),
        ({"lens_elements": [], "aperture_index": 0}, "the table has no rows"),
        ({"lens_elements": {}}, "has no list lens_elements"),
        ({"lens_elements": [3]}, "element 0 is 3, an object"),
        ({"lens_elements": [element("x", 1.0)]}, "element 0: radius is 'x', a number was expected"),
        ({"fstop": -1}, "fstop is -1, a number was expected"),
        ({"lens_elements": [element(50.0, 4.0, 0.5)]}, "element 0: n_d is 0.5"),
    ],
)
def test_faults_are_one_sentence(tmp_path, change, said):
    with pytest.raises(LensError) as raised:
        opened(tmp_path, LENS | change)
    assert said in " | ".join([str(raised.value), *raised.value.problems])


def test_unknown_keys_are_named(tmp_path):
    data = copy.deepcopy(LENS) | {"colour": 1}
    data["lens_elements"][0]["coating"] = 500
    said = " | ".join(opened(tmp_path, data).remarks)
    assert "keys left out: 'colour'" in said
    assert "element 0: keys left out: 'coating'" in said
