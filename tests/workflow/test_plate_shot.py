"""A shot over a plate: the same bytes in chunks, finished frames are kept, the comp has the values of the plate."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from flarewright import Camera, Light, Output, Project, Quality, shot
from flarewright.errors import FlarewrightError
from flarewright.io.images.exr import read_exr
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.project.project_file import read_project
from flarewright.model import Holdout, ProjectCurve
from flarewright.plates.settings import PlateSettings
from flarewright.render.remarks import DARK
from flarewright.render.scene.resolve import open_lens
from flarewright.workflow.plates.plate_files import plate_frames
from flarewright.workflow.plates.plate_frame import alike_lights
from flarewright.workflow.plates.plate_sources import plate_shot, sources_file
from flarewright.workflow.shot import shot_frames
from flarewright.workflow.shot_frame import _draw

SIZE = (64, 36)
ROWS, COLUMNS = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
UNLIT = Light(field_deg=(0.0, 0.0), intensity=0.0)


def project(**changes):
    fields = {
        "lens": "heliar-tronnier", "f_number": 11.0, "lights": [UNLIT], "camera": Camera(size_px=SIZE),
        "quality": Quality(mode="draft", wavelengths=3),
    }  # fmt: skip
    return Project(**{**fields, **changes})


def picture(k=0, lamp=60.0):
    pixels = np.full((*SIZE[::-1], 3), 0.1, np.float32)
    pixels[np.hypot(COLUMNS - 20 - 4 * k, ROWS - 12) < 1.5] = (lamp, lamp / 2, lamp / 4)
    return pixels


def write(path, pixels, frame=0):
    header = {"framesPerSecond": Fraction(25), "timeCode": OpenEXR.TimeCode(10, 0, 0, frame, *([0] * 14))}
    OpenEXR.File(header, {"RGB": pixels}).write(str(path))


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plates")
    for k in range(3):
        write(folder / f"p.{1001 + k}.exr", picture(k), k)
    return folder


@pytest.fixture(scope="module")
def whole(plates):
    folder = plates / "whole"
    folder.mkdir()
    return folder, draw(plates, folder)


def settings(plates, **changes):
    return PlateSettings(str(plates / "p.####.exr"), **changes)


def draw(plates, folder, project=None, **changes):
    arguments = {"plate": settings(plates, threshold=1.0), "over": folder / "c.####.exr", "processes": 1, **changes}
    return shot(project or globals()["project"](), folder / "f.####.exr", **arguments)


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


def test_every_frame_of_the_plate_is_drawn_where_its_light_is(whole):
    folder, result = whole
    assert [frame.frame for frame in result.frames] == [1001, 1002, 1003]
    for k in range(3):
        contents = read_exr(folder / f"f.{1001 + k}.exr")
        star = next(layer for layer in contents.layers if layer.name == "starburst").pixels.sum(axis=2)
        row, column = np.unravel_index(int(star.argmax()), star.shape)
        assert abs(column + 0.5 - 20 - 4 * k) <= 1.0
        assert abs(row + 0.5 - 12) <= 1.0
        assert (contents.scale, contents.header["framesPerSecond"]) == (1.0, Fraction(24))
        assert str(contents.header["timeCode"]) == str(OpenEXR.TimeCode(10, 0, 0, k, *([0] * 14)))


def test_the_comp_is_the_plate_with_the_flare_around_the_light(whole):
    folder, _ = whole
    comp, flare = (read_exr(folder / f"{name}.1001.exr") for name in "cf")
    (added,) = comp.layers
    assert (added.name, comp.pixel_type, comp.scale) == ("comp", "half", 1.0)
    beauty = flare.layers[0].pixels
    plate = picture()
    far = np.hypot(COLUMNS - 20, ROWS - 12) > 6
    np.testing.assert_allclose(added.pixels[far], (plate + beauty)[far], rtol=2e-3)
    # the light itself is that of the plate
    assert added.pixels[11, 19] == pytest.approx(plate[11, 19], rel=0.02)
    assert beauty[11, 19, 0] > 10.0


def test_two_chunks_give_the_bytes_of_one_run(plates, whole, tmp_path):
    for chunk in ("1/2", "2/2"):
        draw(plates, tmp_path, chunk=chunk)
    assert contents(tmp_path) == contents(whole[0])


def test_finished_frames_are_kept_and_a_changed_plate_draws_only_its_frame(plates, tmp_path):
    draw(plates, tmp_path)
    again = draw(plates, tmp_path)
    assert not any(frame.drawn for frame in again.frames)
    (tmp_path / "c.1002.exr").unlink()
    assert [frame.frame for frame in draw(plates, tmp_path).frames if frame.drawn] == [1002]
    for k in range(3):
        write(tmp_path / f"p.{1001 + k}.exr", picture(k, 90.0 if k == 1 else 60.0), k)
    assert [frame.frame for frame in draw(tmp_path, tmp_path).frames if frame.drawn] == [1002]


def test_a_moving_light_blurs_over_an_open_shutter(plates, tmp_path):
    result = draw(plates, tmp_path, frames="1002", shutter_deg=180.0, subframes=3, over=None)
    assert result.frames[0].subframes == 3
    blurred = draw(plates, tmp_path, frames=[1001, 1002, 1003], shutter_deg=180.0, over=None, chunk="2/3")
    assert blurred.frames[0].subframes >= 5


def test_a_matte_keeps_areas_from_flaring(plates, tmp_path):
    Image.fromarray(np.where(COLUMNS < 22, 0, 255).astype(np.uint8)).save(tmp_path / "m.png")
    found = plate_shot(settings(plates, threshold=1.0, matte=str(tmp_path / "m.png")), [1001, 1002, 1003])
    assert found.found == (0, 1, 1)
    assert any("no source in frame 1001" in line for line in found.remarks)


def test_a_sequence_of_mattes_hides_the_lights_of_its_frames(plates, tmp_path):
    for k in range(3):
        Image.fromarray(np.full(SIZE[::-1], 0 if k == 1 else 255, np.uint8)).save(tmp_path / f"h.{1001 + k}.png")
    hidden = project(holdout=Holdout(image=str(tmp_path / "h.####.png")), output=Output(layers="beauty"))
    draw(plates, tmp_path, hidden, over=None)
    bright = [read_exr(tmp_path / f"f.{1001 + k}.exr").layers[0].pixels.sum() for k in range(3)]
    assert bright[1] == 0.0
    assert min(bright[0], bright[2]) > 0.0
    (tmp_path / "h.1003.png").unlink()
    with pytest.raises(FlarewrightError, match=r"the holdout .*h.####.png lacks frame 1003; give frames that exist"):
        draw(plates, tmp_path, hidden, over=None)


def test_own_lights_stay_and_the_plates_lights_come_in_addition(plates, tmp_path):
    lamp = Light(name="own", field_deg=(-5.0, -3.0), intensity=1e-4)
    result = draw(plates, tmp_path, project(lights=[lamp, UNLIT]), frames="1001", over=None)
    assert result.frames[0].drawn
    assert "own" in read_exr(tmp_path / "f.1001.exr").metadata["project"]
    assert read_exr(tmp_path / "f.1001.exr").metadata["project"].count("[[lights]]") == 2


def test_the_project_in_a_comp_starts_at_the_folder_of_the_comp(plates, tmp_path, monkeypatch):
    """In another folder than the flare's it named a lens that does not exist."""
    monkeypatch.chdir(tmp_path)
    write_lens(open_lens("heliar-tronnier").lens, Path("own.toml"))
    for name in ("flare", "comps/deep"):
        Path(name).mkdir(parents=True)
    draw(plates, Path("flare"), project(lens="own.toml"), frames=[1001], over="comps/deep/c.####.exr")
    for file in ("flare/f.1001.exr", "comps/deep/c.1001.exr"):
        assert Path(read_project(file).lens).samefile("own.toml")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frames": "1001-1005"}, "lacks frames 1004-1005; there are 1001-1003: give --frames that exist"),
        ({"plate": PlateSettings("none.####.exr")}, "no file is named none.####.exr; check the folder"),
        ({"plate": PlateSettings("none.exr")}, "the plate none.exr does not exist"),
        ({"plate": PlateSettings(".")}, "the plate . is a folder; give a picture, a film, or a sequence"),
        ({"threshold": 1e4}, "the plate has no source above 1e\\+04; lower --threshold or --stops"),
        ({"plate": None, "frames": "1"}, "a comp is laid over a plate, and there is none"),
        ({"camera": Camera(size_px=(64, 64))}, "the plate is 64x36 and the picture 64x64, of another shape"),
        ({"camera": Camera(size_px=(128, 72))}, "the comp needs the size of the plate, 64x36, not 128x72"),
        ({"output": Output(layers="beauty")}, "the comp needs the passes"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_sentence(plates, tmp_path, changes, words):
    chosen = {key: changes.pop(key) for key in ("camera", "output") if key in changes}
    if "threshold" in changes:
        changes = {"plate": settings(plates, threshold=changes.pop("threshold"))}
    with pytest.raises(FlarewrightError, match=words):
        draw(plates, tmp_path, project(**chosen), **changes)
    assert not list(tmp_path.glob("*.exr"))


def test_a_comp_has_the_pixel_aspect_of_its_plate(tmp_path):
    OpenEXR.File({"pixelAspectRatio": 2.0}, {"RGB": picture()}).write(str(tmp_path / "p.1001.exr"))
    draw(tmp_path, tmp_path, frames=[1001])
    aspects = [read_exr(tmp_path / f"{name}.1001.exr").header["pixelAspectRatio"] for name in "fc"]
    assert aspects == [1.0, 2.0]


def test_frames_of_mixed_sizes_and_gaps_are_refused(plates, tmp_path):
    for k in (0, 1, 3):
        write(tmp_path / f"p.{1001 + k}.exr", picture(k)[: 36 if k < 1 else 30])
    with pytest.raises(FlarewrightError, match="lacks frame 1003; there are 1001-1002,1004"):
        plate_frames(settings(tmp_path), None)
    with pytest.raises(
        FlarewrightError, match=r"p\.1002\.exr has 64x30 pixels, the first frame 64x36; give frames of one"
    ):
        plate_shot(settings(tmp_path, threshold=1.0), [1001, 1002])


def test_frames_of_a_plate_outside_the_keys_of_the_project_are_not_drawn_in_silence(plates):
    stopping = ProjectCurve(of="f_number", at_s=(0.0, 1.0 / 24.0), values=(5.6, 16.0))
    moving = project(f_number=None, curves=(stopping,))
    with pytest.raises(FlarewrightError, match=r"frames 1001-1003 lie outside the project's 1-2 .* --start 1001"):
        shot_frames(moving, None, settings(plates))
    started = moving.replace(timeline=moving.timeline.replace(start=1001))
    frames, remarks = shot_frames(started, None, settings(plates))
    assert frames == (1001, 1002, 1003)
    assert remarks == ["frame 1003 lies outside the keys, 1001-1002: everything rests there"]


def test_the_file_of_sources_is_read_again_and_a_foreign_one_is_kept(plates, tmp_path):
    kept = sources_file(str(tmp_path / "f.####.exr"))
    seen = []
    arguments = {"kept": kept, "report": lambda frame, done, of: seen.append(frame)}
    first = plate_shot(settings(plates, threshold=1.0), [1001, 1002, 1003], **arguments)
    assert sorted(seen) == [1001, 1002, 1003]
    seen.clear()
    again = plate_shot(settings(plates, threshold=1.0, gain=2.0), [1001, 1002, 1003], **arguments)
    assert seen == []
    assert np.array_equal(again.lights.tracks.light, first.lights.tracks.light)
    kept.write_bytes(b"not ours")
    with pytest.raises(FlarewrightError, match="is no file of sources of a plate; move it"):
        plate_shot(settings(plates, threshold=1.0), [1001], **arguments)
    assert kept.read_bytes() == b"not ours"


@pytest.mark.parametrize("left", ["nothing", "half", "other arrays"])
def test_a_damaged_file_of_sources_costs_one_sentence_and_the_search(plates, tmp_path, left):
    kept = sources_file(str(tmp_path / "f.####.exr"))
    seen, said = [], []
    arguments = {"kept": kept, "report": lambda frame, done, of: seen.append(frame), "announce": said.append}
    first = plate_shot(settings(plates, threshold=1.0), [1001, 1002], **arguments)
    assert said == []
    data = kept.read_bytes()
    if left == "other arrays":
        np.savez(kept, made_of=np.array(["a"]), counts=np.array([3]), sources=np.zeros((2, 10)))
    else:
        kept.write_bytes(data[: len(data) // 2 if left == "half" else 0])
    seen.clear()
    again = plate_shot(settings(plates, threshold=1.0), [1001, 1002], **arguments)
    assert said == [f"{kept} is damaged; its frames are searched again"]
    assert sorted(seen) == [1001, 1002]
    assert np.array_equal(again.lights.tracks.light, first.lights.tracks.light)
    assert plate_shot(settings(plates, threshold=1.0), [1001, 1002], **arguments).found == first.found
    assert len(said) == 1


def test_a_threshold_in_stops_is_one_for_the_whole_shot(plates):
    found = plate_shot(settings(plates, stops=4.0), [1001, 1002, 1003])
    assert found.threshold == pytest.approx(0.1 * 16, rel=0.1)
    assert "4 stops above the plate's mean" in found.remarks[0]


def test_pixels_outside_the_data_window_of_a_plate_do_not_lower_its_mean(tmp_path):
    header = {"displayWindow": ((0, 0), (2 * SIZE[0] - 1, 2 * SIZE[1] - 1)), "dataWindow": ((0, 0), (63, 35))}
    for name, stated in (("whole", {}), ("window", header)):
        OpenEXR.File(stated, {"RGB": picture()}).write(str(tmp_path / f"{name}.exr"))
    whole, window = (
        plate_shot(PlateSettings(str(tmp_path / f"{name}.exr"), stops=4.0), [1]).threshold
        for name in ("whole", "window")
    )
    assert window == whole


def test_one_picture_lights_all_frames(plates, tmp_path):
    still = PlateSettings(str(plates / "p.1001.exr"), threshold=1.0)
    result = draw(plates, tmp_path, frames="7-8", plate=still)
    assert [frame.frame for frame in result.frames] == [7, 8]
    one, two = (read_exr(tmp_path / f"c.{frame:04d}.exr").layers[0].pixels for frame in (7, 8))
    assert np.array_equal(one, two)


@pytest.mark.parametrize(("fade", "said"), [(PlateSettings.fade, False), (2, True)])
def test_a_fade_of_a_single_plate_has_no_effect(plates, fade, said):
    found = plate_shot(PlateSettings(str(plates / "p.1001.exr"), threshold=1.0, fade=fade), [1001])
    assert any("--fade has no effect" in remark for remark in found.remarks) == said


def test_no_frame_of_the_plate_is_replaced(plates):
    before = (plates / "p.1001.exr").read_bytes()
    with pytest.raises(FlarewrightError, match=r"would replace p\.1001\.exr, which the shot reads or writes"):
        shot(project(), plates / "p.####.exr", plate=settings(plates, threshold=1.0))
    with pytest.raises(FlarewrightError, match=r"would replace p\.1001\.exr"):
        draw(plates, plates, over=plates / "p.%04d.exr")
    assert (plates / "p.1001.exr").read_bytes() == before


def test_a_lamp_that_is_switched_on_is_no_motion():
    off = Project(lens="heliar-tronnier", lights=[Light(name="plate", field_deg=(0, 0), intensity=0)])
    on = off.replace(lights=(Light(name="plate-1", field_deg=(9, 4)),))
    before, after = alike_lights([off, on])
    assert before == after


def test_a_frame_that_is_dark_only_at_first_is_not_called_black():
    on = Project(
        lens="heliar-tronnier", f_number=16, lights=[Light(field_deg=(5, 3))], camera=Camera(size_px=(64, 36)),
        quality=Quality(mode="draft", wavelengths=1),
    )  # fmt: skip
    off = on.replace(lights=(Light(field_deg=(5, 3), intensity=0.0),))
    assert DARK in _draw((off, off), 1).remarks
    assert DARK not in _draw((off, on), 1).remarks
