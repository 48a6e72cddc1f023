"""`design target`: from a picture or a measured flare to a project, and to a lens."""

import json

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.io.project.project_file import read_project

MODEL = {
    "schema_version": 1, "size_px": [720, 480], "axis_px": [360.0, 240.0], "focal_px": 1000.0, "largest_deg": 20.0,
    "constellation_deg": [0.0, 20.0], "ghosts": [],
}  # fmt: skip


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, (f, g, light) in {"1": (90.0, 24.0, 9.0), "2": (-160.0, -60.0, 4.0), "3": (40.0, 15.0, 1.0)}.items():
        zero = [0.0] * 9
        channel = {"f": [f, *zero], "g": [g, *zero], "intensity": [light, *zero]}
        blue = {**channel, "intensity": [3.0 * light, *zero]}
        MODEL["ghosts"] = [one for one in MODEL["ghosts"] if one["name"] != name] + [{
            "kind": "aberration", "name": name, "red": channel, "green": channel, "blue": blue,
            "visible_deg": [0.0, 20.0],
        }]  # fmt: skip
    (tmp_path / "model.json").write_text(json.dumps(MODEL))
    return tmp_path


def test_a_measured_flare_becomes_a_lens_with_these_ghosts(folder, plain, capsys):
    words = ["design", "target", "model.json", "-o", "shot.toml", "--light", "10,0", "--light", "0,16"]
    assert run([*words, "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert len(reported["ghosts"]) == 6
    project = read_project(folder / "shot.toml")
    assert project.camera.sensor == pytest.approx((36.0, 24.0))
    low, high = project.design.bounds.focal_length
    assert 0.5 * (low + high) == pytest.approx(50.0)
    s = np.tan(np.radians(16.0)) / np.tan(np.radians(20.0))
    ours = {(one.light, one.radius_mm): one for one in project.design.ghost_targets}
    assert ours[1, 3.0].place_mm == pytest.approx(-160.0 * s * 0.05, abs=1e-3)
    assert ours[0, 1.2].color == pytest.approx((1 / 3, 1 / 3, 1.0), abs=1e-3)
    assert run(["design", "solve", "shot.toml", "-o", "found", "--searches", "1500", "--lenses", "1", "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    errors = [abs(one["place_error_mm"]) + abs(one["radius_error_mm"]) for one in reported["lenses"][0]["ghosts"]]
    assert max(errors) < 0.3
    # the found lens can be coated
    words = ["design", "colors", "found/lens-1.colors.toml", "-o", "coated.toml", "--starts", "2", "--json"]
    assert run(words) == 0
    blue = [one for one in json.loads(capsys.readouterr().out)["ghosts"] if one["wanted"][2] > 2.9 * one["wanted"][0]]
    assert len(blue) == 3


def test_a_picture_becomes_a_project(folder, capsys):
    from test_single_image import DISCS, SIZE, picture

    cut = picture(toward_deg=30.0)[:330, :472]
    np.save(folder / "flare.npy", cut)
    x, y = 10.0, float(np.degrees(np.arctan(np.tan(np.radians(10.0)) * np.tan(np.radians(30.0)))))
    words = ["design", "target", "flare.npy", "-o", "shot.toml", "--light", f"{x},{y}", "--most", "3"]
    assert SIZE == (480, 320)
    assert run(words) == 0
    assert "3 ghosts" in capsys.readouterr().out
    project = read_project(folder / "shot.toml")
    found = sorted(one.radius_mm / 36.0 * 472 for one in project.design.ghost_targets)
    wanted = sorted(radius for _, radius, _ in DISCS)
    assert all(min(abs(one - other) for other in wanted) < 2.0 for one in found)
    assert not project.design.signed
    assert run([*words, "--force", "--focal", "35"]) == 0
    assert read_project(folder / "shot.toml").design.bounds.focal_length == pytest.approx((34.3, 35.7))


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["model.json", "-o", "shot.toml", "--light", "30,0"], "0 to 20 degrees"),
        (["model.json", "-o", "shot.toml", "--light", "0,0"], "on the axis"),
        (["model.json", "-o", "shot.json", "--light", "5,0"], "must be named"),
        (["model.json", "-o", "there.toml", "--light", "5,0"], "exists already"),
        (["no.json", "-o", "shot.toml", "--light", "5,0"], "no.json"),
        (["no.exr", "-o", "shot.toml", "--light", "5,0"], "does not exist"),
        (["there.toml", "-o", "shot.toml", "--light", "5,0"], "no photograph"),
        (["black.npy", "-o", "shot.toml", "--light", "5,0"], "no ghost was found"),
        (["black.npy", "-o", "shot.toml", "--light", "5,0", "--light", "6,0"], "one light"),
        (["black.npy", "-o", "shot.toml", "--light", "5,0", "--focal", "0"], "focal length"),
        (["black.npy", "-o", "shot.toml", "--light", "5,0", "--sensor-width", "nan"], "width of a sensor"),
        (["small.npy", "-o", "shot.toml", "--light", "5,0"], "too small"),
        (["broken.png", "-o", "shot.toml", "--light", "5,0"], "cannot be read as an image"),
    ],
)
def test_an_error_is_one_sentence(words, reported, folder, capsys):
    (folder / "there.toml").write_text("")
    (folder / "broken.png").write_text("no picture")
    np.save(folder / "black.npy", np.zeros((64, 96, 3), np.float32))
    np.save(folder / "small.npy", np.zeros((8, 8, 3), np.float32))
    assert run(["design", "target", *words]) == 2
    error = capsys.readouterr().err
    assert reported in error
    assert len(error.strip().splitlines()) == 1
    assert not (folder / "shot.toml").exists()
