"""Lights nearer than fifty focal lengths are drawn at their distance; an interrupted prediction resumes."""

import json
from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
from singlet_file import singlet_file

from flarewright.cli.app import run
from flarewright.cli.common import remembered
from flarewright.model import Camera, Light, Output, Project, Quality
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.predict import pictures
from flarewright.predict.curves import Curves, interpolated_statistics
from flarewright.predict.flare import Flare, fingerprint_of
from flarewright.predict.lens_flare import square_flare, statistics_quality
from flarewright.predict.plan import rounded_distance
from flarewright.predict.table import FlareTable
from flarewright.predict.tracks import CameraSighting
from flarewright.render.render import render


def test_a_near_light_makes_the_flare_that_a_direct_render_shows(monkeypatch):
    away, angle = 300.0, 14.0
    project = Project(
        lens="heliar-tronnier", f_number=5.6, lights=(Light(field_deg=(0.0, 0.0), distance=away),),
        camera=Camera(size_px=(240, 160), sensor_mm=(36.0, 24.0)), iris={},
    )  # fmt: skip
    flare, frame = square_flare(project, statistics_quality("final"))
    found = FlareTable(flare, frame).at(angle, 0.0)
    there = Light(field_deg=(angle, 0.0), distance=away * cos(radians(angle)))
    # rings move light within the picture
    shot = project.replace(lights=(there,), quality=Quality(ringing="off"), output=Output(starburst=False))
    light = render(shot).layers[0].pixels.astype(float) @ luminance_weights("rec709")
    assert found.mean == pytest.approx(light.mean(), rel=0.01)
    # the flare of a distant light differs
    far, _ = square_flare(project.replace(lights=(Light(field_deg=(0.0, 0.0)),)), statistics_quality("final"))
    assert abs(FlareTable(far, frame).at(angle, 0.0).mean / found.mean - 1.0) > 0.05
    assert far.fingerprint != flare.fingerprint
    # pictures of another version of the program are drawn again
    assert fingerprint_of("a") != fingerprint_of("b")
    of_this = fingerprint_of("a")
    monkeypatch.setattr("flarewright.predict.flare.__version__", "0.0.0")
    assert fingerprint_of("a") != of_this
    assert flare.reach_deg < far.reach_deg == 85.0


@pytest.mark.parametrize(
    ("distances", "lux", "drawn"),
    [
        ((10.0, 12.0), (1.0, 1.0), None),
        ((1.0, 1.0), (1.0, 1.0), 1.0),
        ((1.4, 1.5), (1.0, 1.0), 2.0**0.5),
        ((0.2, 30.0), (0.0, 1.0), None),
        ((0.2, 30.0), (0.0, 0.0), None),
        ((np.inf, np.inf), (1.0, 1.0), None),
    ],
)
def test_distances_are_rounded_where_they_matter(distances, lux, drawn):
    nothing = np.zeros(2)
    sighting = CameraSighting(nothing, nothing, np.array(lux), nothing, np.array(distances))
    assert rounded_distance(sighting, 100.0) == (None if drawn is None else pytest.approx(drawn))
    assert rounded_distance(sighting, None) is None


SCENE = """
schema_version = 1
[[cameras]]
name = "A"
lens = "heliar-tronnier"
f_number = 8.0
position_m = [0.0, 0.0, 0.0]
aim_m = [0.0, 10.0, 0.0]
[[lights]]
name = "torch"
position_m = [{x}, {y}, 0.0]
intensity_cd = 100.0
"""


def test_a_scene_with_a_near_lamp_draws_it_near_and_one_in_the_lens_is_reported(tmp_path, capsys):
    def veil(away):
        path = tmp_path / "s.toml"
        path.write_text(SCENE.format(x=away * sin(radians(14.0)), y=away * cos(radians(14.0))))
        assert run(["predict", str(path), "--quality", "draft", "--json"]) == 0
        return json.loads(capsys.readouterr().out)["ranking"][0]["worst_veil_cd_m2"] * away**2

    # except for the inverse square, a far lamp's flare does not depend on its distance; a near one's does
    assert veil(400.0) == pytest.approx(veil(40.0), rel=1e-6)
    assert abs(veil(0.3) / veil(400.0) - 1.0) > 0.005
    (tmp_path / "s.toml").write_text(SCENE.format(x=0.01, y=0.1))
    assert run(["predict", str(tmp_path / "s.toml")]) == 2
    assert "stands in or right at the lens" in capsys.readouterr().err


def test_between_samples_decades_are_divided_evenly():
    # more than a decade, constant, a factor of four, from darkness, a discontinuity
    a, b = np.array([1.0, 1.0, 4.0, 0.0, 1.0]), np.array([0.04, 1.0, 1.0, 2.0, 1e-3])
    np.testing.assert_allclose(interpolated_statistics(a, b, 0.5), [0.2, 1.0, 2.0, 1.0, 0.5005])
    curves = Curves(np.array([0.0, 10.0]), np.stack([a, b]), 0.0, 0.0)
    assert curves.at(5.0).sum_mm2 == pytest.approx(0.2)
    assert curves.at(-1.0).sum_mm2 == 1.0
    assert curves.at(99.0).sum_mm2 == pytest.approx(0.04)


def test_a_tail_that_falls_by_decades_is_met_between_few_samples():
    """Linear interpolation of the values is three quarters too high where light falls tenfold between samples."""
    angles = np.linspace(0.0, 60.0, 7)
    truth = lambda angle: 10.0 ** (-0.1 * angle)  # noqa: E731
    curves = Curves(angles, np.repeat(truth(angles)[:, None], 5, axis=1), 0.0, 0.0)
    for angle in np.linspace(0.0, 60.0, 31):
        assert curves.at(angle).mean == pytest.approx(truth(angle), rel=1e-9)


def test_an_interrupted_prediction_resumes_beside_its_output(tmp_path, capsys, monkeypatch):
    page = tmp_path / "h.html"
    words = "--fstop 16 --quality draft --samples 5 -o"
    arguments = ["predict", singlet_file(tmp_path), *words.split(), str(page)]
    drawn = 0
    real = pictures.luminance

    def counted(picture, most):
        nonlocal drawn
        if drawn == most:
            raise KeyboardInterrupt
        drawn += 1
        return real(picture)

    monkeypatch.setattr(pictures, "luminance", lambda picture: counted(picture, 3))
    assert run(arguments) == 130
    assert not page.exists()
    assert (tmp_path / "h.partial.npz").is_file()
    assert "the same command resumes" in capsys.readouterr().err
    drawn = 0
    monkeypatch.setattr(pictures, "luminance", lambda picture: counted(picture, -1))
    assert run([*arguments, "--json"]) == 0
    reported = capsys.readouterr()
    assert "resuming with 3 pictures" in reported.err
    again = drawn
    # pictures of the interrupted run are reused, and its file is removed
    assert not (tmp_path / "h.partial.npz").exists()
    drawn = 0
    assert run([*arguments, "--json"]) == 0
    assert capsys.readouterr().out == reported.out
    assert drawn == again + 3


def test_a_given_cache_stays_and_nothing_is_kept_without_output(tmp_path):
    with remembered(Path(tmp_path / "c.npz"), tmp_path / "o.html") as memory:
        memory["x"] = {(0.0, 0.0): np.zeros((2, 2), np.float32)}
    assert (tmp_path / "c.npz").is_file()
    with remembered(None, None) as memory:
        assert memory == {}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.npz"]


def test_a_prediction_without_output_resumes_from_the_state_folder_with_its_checks(tmp_path, capsys, monkeypatch):
    lens = singlet_file(tmp_path)
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    arguments = ["predict", lens, "--fstop", "16", "--quality", "draft", "--samples", "5", "--check", "2"]
    drawn, real = [], Flare.picture

    def run_until(most):
        def picture(self, *angles):
            if len(drawn) == most:
                raise KeyboardInterrupt
            drawn.append(angles)
            return real(self, *angles)

        drawn.clear()
        monkeypatch.setattr(Flare, "picture", picture)
        return run([*arguments, "--json"]), capsys.readouterr()

    code, whole = run_until(-1)
    every = len(drawn)
    assert code == 0
    assert every == 7
    assert list((tmp_path / "state" / "partial").iterdir()) == []
    code, reported = run_until(every - 1)
    assert code == 130
    assert "the same command resumes" in reported.err
    (kept,) = (tmp_path / "state" / "partial").iterdir()
    # another command has another file
    assert run([*arguments, "--roll", "1", "--json"]) == 130
    assert kept.is_file()
    capsys.readouterr()
    code, reported = run_until(-1)
    assert code == 0
    assert len(drawn) == 1
    assert "resuming with 6 pictures" in reported.err
    assert reported.out == whole.out
    assert not kept.exists()


def test_a_wide_light_is_drawn_up_to_the_side():
    """Its disc used to reach beyond the half-space in front, and the whole prediction was refused."""
    project = Project(
        lens="triplet-pestrecov", lights=(Light(field_deg=(0.0, 0.0), diameter_deg=20.0),),
        camera=Camera(size_px=(48, 32)), iris={},
    )  # fmt: skip
    flare, frame = square_flare(project, statistics_quality("draft"))
    assert np.isfinite(FlareTable(flare, frame).at(flare.reach_deg, 30.0).values).all()
    assert any("it is drawn smaller there, with the same illuminance" in remark for remark in flare.remarks)
    small = project.replace(lights=(Light(field_deg=(0.0, 0.0), diameter_deg=2.0),))
    assert not any("drawn smaller" in remark for remark in square_flare(small, statistics_quality("draft"))[0].remarks)


def test_another_mask_of_the_same_name_makes_another_flare(tmp_path):
    from PIL import Image

    path, found = tmp_path / "mask.png", []
    for corner in (20, 30):
        opening = np.zeros((64, 64), np.uint8)
        opening[corner:-corner, corner:-corner] = 255
        Image.fromarray(opening).save(path)
        project = Project(
            lens="heliar-tronnier", iris={"mask": str(path)}, lights=(Light(field_deg=(0.0, 0.0)),),
            camera=Camera(size_px=(48, 32)),
        )  # fmt: skip
        found.append(square_flare(project, statistics_quality("draft"))[0].fingerprint)
    assert found[0] != found[1]
