"""A film as the plate of a shot, and a film of its frames."""

from __future__ import annotations

import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("av", reason="the extra video: PyAV")

from film_samples import LOSSLESS, SIZE, lamp, write_sample

from flarewright import Camera, Light, LightKey, Output, Project, Quality, Timeline, shot
from flarewright.errors import FlarewrightError
from flarewright.io.files.temporary_file import temporary_beside
from flarewright.io.films.film_file import open_film
from flarewright.io.films.film_frame import read_film_frame
from flarewright.io.images.exr import read_exr
from flarewright.plates.settings import PlateSettings
from flarewright.workflow.films import assembly
from flarewright.workflow.films.assembly import assemble_film
from flarewright.workflow.plates.plate_files import plate_frames
from flarewright.workflow.plates.plate_sources import plate_shot

RATE = Fraction(24000, 1001)
SRGB = (1, 1, 13, 1)


def project(**changes):
    fields = {
        "lens": "heliar-tronnier", "f_number": 11.0, "lights": [Light(field_deg=(0.0, 0.0), intensity=0.0)],
        "camera": Camera(size_px=SIZE), "quality": Quality(mode="draft", wavelengths=1),
        "output": Output(starburst=False),
        "timeline": Timeline(fps=float(RATE), start=1001),
    }  # fmt: skip
    return Project(**{**fields, **changes})


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    """Return a folder with a film, and the same frames as pictures."""
    folder = tmp_path_factory.mktemp("film")
    write_sample(folder / "p.mp4", pixels="yuv444p", rate=RATE, tags=SRGB, options=LOSSLESS)
    for k in range(48):
        Image.fromarray(lamp(k)).save(folder / f"p.{1001 + k}.png")
    return folder


@pytest.fixture(scope="module")
def drawn(plates):
    """Draw three frames over the film, with their comps and a film of these."""
    folder = plates / "drawn"
    folder.mkdir()
    return folder, draw(plates, folder)


def draw(plates, folder, plate="p.mp4", **changes):
    arguments = {
        "frames": "1003-1004", "plate": PlateSettings(str(plates / plate), threshold=0.5), "processes": 1,
        "over": folder / "c.####.exr", "movie": folder / "c.mp4", **changes,
    }  # fmt: skip
    return shot(project(), folder / "f.####.exr", **arguments)


def test_a_film_has_the_lights_of_its_pictures(plates):
    film = PlateSettings(str(plates / "p.mp4"), threshold=0.5, first=1001)
    pictures = PlateSettings(str(plates / "p.####.png"), threshold=0.5)
    frames = plate_frames(film, None)
    assert frames == plate_frames(pictures, None) == tuple(range(1001, 1049))
    one, two = plate_shot(film, frames), plate_shot(pictures, frames)
    assert (one.fps, one.size_px, one.found) == (RATE, SIZE, two.found)
    assert one.lights.tracks.centre_px == pytest.approx(two.lights.tracks.centre_px, abs=0.02, nan_ok=True)
    # a step of the codes
    assert one.lights.tracks.light == pytest.approx(two.lights.tracks.light, rel=0.01)


def test_comps_over_a_film_are_those_over_its_pictures(plates, drawn, tmp_path):
    folder, _ = drawn
    draw(plates, tmp_path, "p.####.png", movie=None)
    for frame in (1003, 1004):
        one, two = (read_exr(each / f"c.{frame}.exr").layers[0].pixels for each in (folder, tmp_path))
        assert np.abs(one - two).max() < 0.012


def test_the_film_of_the_comp_shows_the_comp(drawn):
    folder, result = drawn
    film = open_film(folder / "c.mp4")
    assert (film.frames, film.fps, film.size_px) == (2, RATE, SIZE)
    assert (result.movie.frames, result.movie.fps, result.movie.exposure_stops) == ((1003, 1004), RATE, 0.0)
    for k in range(2):
        comp = np.clip(read_exr(folder / f"c.{1003 + k}.exr").layers[0].pixels, 0.0, 1.0)
        far = np.hypot(np.arange(SIZE[0])[None, :] - 10 - k, np.arange(SIZE[1])[:, None] - 12) > 6
        assert np.abs(read_film_frame(folder / "c.mp4", k).pixels - comp)[far].max() < 0.01


def test_a_film_in_and_out_has_the_codes_and_the_tags_of_the_plate(tmp_path):
    """Away from the light, which has all of the flare that a code can show."""
    write_sample(tmp_path / "p.mp4", pixels="yuv444p", frames=2, rate=RATE, options=LOSSLESS)
    for name in ("c.mp4", "c.mov"):
        draw(tmp_path, tmp_path, frames="1001-1002", movie=tmp_path / name)
        before, after = open_film(tmp_path / "p.mp4"), open_film(tmp_path / name)
        assert (after.frames, after.fps, after.size_px) == (before.frames, before.fps, before.size_px)
        assert (after.coding.matrix, after.coding.full_range, after.coding.transfer) == ("bt709", False, "rec709")
        one, two = (read_film_frame(film.path, 1, transfer="linear").pixels for film in (before, after))
        far = np.hypot(np.arange(SIZE[0])[None, :] - 9, np.arange(SIZE[1])[:, None] - 12) > 8
        assert np.abs(one - two)[far].max() < 1.6 / 255


def test_a_repeated_command_draws_nothing_and_makes_the_same_film(plates, drawn):
    folder, _ = drawn
    before = (folder / "c.mp4").read_bytes()
    (folder / "c.mp4").unlink()
    (folder / "f.1004.exr").unlink()
    again = draw(plates, folder)
    assert [frame.frame for frame in again.frames if frame.drawn] == [1004]
    assert (folder / "c.mp4").read_bytes() == before
    assert not (folder / "c.mp4.parts").exists()


def test_other_frames_of_a_film_draw_all_again(plates, tmp_path):
    write_sample(tmp_path / "p.mp4", frames=6, pixels="yuv444p", rate=RATE, tags=SRGB, options=LOSSLESS)
    how = {"over": None, "movie": None, "frames": "1001"}
    assert all(frame.drawn for frame in draw(tmp_path, tmp_path, **how).frames)
    assert not any(frame.drawn for frame in draw(tmp_path, tmp_path, **how).frames)
    write_sample(
        tmp_path / "p.mp4", frames=6, pixels="yuv444p", rate=RATE, tags=SRGB, options=LOSSLESS,
        draw=lambda k: lamp(k + 1),
    )  # fmt: skip
    assert all(frame.drawn for frame in draw(tmp_path, tmp_path, **how).frames)


def test_an_interrupted_film_resumes_with_its_finished_parts(plates, tmp_path, monkeypatch):
    monkeypatch.setattr(assembly, "_PART_FRAMES", 16)
    files = str(plates / "p.####.png")
    whole = assemble_film(files, tmp_path / "whole.mp4")
    assert (len(whole.frames), whole.fps, whole.size_px) == (48, 24, SIZE)
    assert any("state no rate; the film has 24 frames per second" in line for line in whole.remarks)

    def stop(frame, done, of):
        if done == 40:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        assemble_film(files, tmp_path / "cut.mp4", report=stop)
    assert sorted(path.name for path in (tmp_path / "cut.mp4.parts").iterdir()) == ["00000.mp4", "00001.mp4"]
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    left = temporary_beside(tmp_path / "cut.mp4.parts" / "00002.mp4")
    left.with_name(left.name.replace(f"-{os.getpid()}-", f"-{int(gone.stdout)}-")).write_bytes(b"killed")
    seen = []
    assemble_film(files, tmp_path / "cut.mp4", report=lambda frame, done, of: seen.append(done))
    assert seen == [16, 32, *range(33, 49)]
    assert (tmp_path / "cut.mp4").read_bytes() == (tmp_path / "whole.mp4").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cut.mp4", "whole.mp4"]
    # 48 frames in, 48 out, in their order
    film = open_film(tmp_path / "cut.mp4")
    assert (film.frames, film.size_px, film.fps) == (48, SIZE, 24)
    columns = [np.nonzero(read_film_frame(film.path, k).pixels[..., 1] > 0.3)[1].mean() for k in (0, 15, 16, 31, 47)]
    assert columns == pytest.approx([7.5, 22.5, 23.5, 38.5, 54.5], abs=0.3)


def test_one_exposure_shows_a_light_that_grows(tmp_path):
    keys = (LightKey(at_s=0.0, field_deg=(6.0, 3.0)), LightKey(at_s=1.0, field_deg=(6.0, 3.0)))
    light = Light(field_deg=(6.0, 3.0), keyframes=keys)
    curve = {"of": "intensity", "at_s": (0.0, 1.0), "values": (0.1, 1.0)}
    moving = project(lights=[light.replace(curves=(curve,))], timeline=Timeline(fps=24.0, start=1))
    result = shot(moving, tmp_path / "f.####.exr", frames="1,25", processes=1, movie=tmp_path / "f.mov")
    assert "(automatic)" in result.movie.view
    dark, bright = (read_film_frame(tmp_path / "f.mov", k).pixels.mean() for k in range(2))
    assert dark < 0.3 * bright
    # the last frame has the exposure that it would have alone
    alone = assemble_film(tmp_path / "f.####.exr", tmp_path / "g.mov", frames=[25])
    assert alone.exposure_stops == result.movie.exposure_stops


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"chunk": "1/2"},
            r"chunk 1/2 draws some; draw all chunks without a film, then: flarewright film .*c\.####",
        ),
        ({"movie": "c.webm"}, r"must be named \*\.mp4"),
        ({"movie": "c.####.mp4"}, "is one file; name it without a number"),
        ({"frames": "1-3"}, r"lacks frames 1-3; it has 1001-1048, the first one at 0 s: give --frames that exist"),
        ({"plate": "p.####.mp4"}, "is a film, which has all frames in one file"),
    ],
)
def test_what_cannot_be_made_is_refused_before_the_work(plates, tmp_path, changes, words):
    if "movie" in changes:
        changes = {"movie": tmp_path / changes["movie"]}
    with pytest.raises(FlarewrightError, match=words):
        draw(plates, tmp_path, **changes)
    assert list(tmp_path.iterdir()) == []


def test_no_film_of_another_program_is_replaced(plates, tmp_path):
    before = (plates / "p.mp4").read_bytes()
    with pytest.raises(FlarewrightError, match=r"p\.mp4 exists, and is no film of Flarewright; move it"):
        draw(plates, tmp_path, movie=plates / "p.mp4")
    assert (plates / "p.mp4").read_bytes() == before


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        (None, r"p\.####\.png, 1001-1003,1005, have gaps; draw what is missing, or give --frames: a frame stays"),
        ("1001-1009", r"lacks frames 1004,1006-1009; there are 1001-1003,1005: give frames that exist"),
    ],
)
def test_a_film_lacks_no_frame(tmp_path, frames, words):
    for k in (0, 1, 2, 4):
        Image.fromarray(lamp(k)).save(tmp_path / f"p.{1001 + k}.png")
    with pytest.raises(FlarewrightError, match=words):
        assemble_film(tmp_path / "p.####.png", tmp_path / "f.mp4", frames=frames)


def test_a_frame_of_another_size_is_named(tmp_path):
    for frame, width in ((1, 64), (2, 48)):
        Image.new("RGB", (width, 36)).save(tmp_path / f"p.{frame}.png")
    with pytest.raises(
        FlarewrightError, match=r"p\.2\.png has 48x36 pixels, the first frame 64x36; give frames of one"
    ):
        assemble_film(tmp_path / "p.#.png", tmp_path / "p.mp4")
    assert not (tmp_path / "p.mp4").exists()
