"""Films that are written: their colours, tags, rate and size, and the same bytes in parts and at once."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("av", reason="the extra video: PyAV")

import av

from flarewright.errors import OutputError
from flarewright.io.films.film_file import open_film
from flarewright.io.films.film_frame import read_film_frame
from flarewright.io.films.film_writer import FILM_CODECS, check_film_name, comment_of, join_films, write_film
from flarewright.render.image.display import srgb_oetf

RATE = Fraction(24000, 1001)
SIZE = (61, 49)
PATCHES = np.random.default_rng(0).integers(0, 256, (48, 4, 4, 3)).astype(np.uint8)
PICTURES = [np.repeat(np.repeat(each, 16, axis=0), 16, axis=1)[:49, :61] for each in PATCHES]


def join(folder, name, cuts=(0, 20, 40)):
    """Write the film in parts, and join them."""
    parts, suffix = [], Path(name).suffix
    for first, end in zip(cuts, (*cuts[1:], 48), strict=True):
        part = folder / f"part{first}{suffix}"
        write_film(part, enumerate(PICTURES[first:end]), SIZE, RATE, comment="part")
        parts.append((first, part))
    join_films(folder / name, parts, RATE, time_code="10:00:00:00", comment="Flarewright, a test")
    return folder / name


@pytest.mark.parametrize(("name", "size", "error"), [("f.mp4", (62, 50), 4.5), ("f.mov", (62, 49), 0.6)])
def test_a_film_has_its_pictures_rate_and_tags(tmp_path, name, size, error):
    path = join(tmp_path, name)
    film = open_film(path)
    assert (film.frames, film.fps, film.size_px, film.time_code) == (48, RATE, size, "10:00:00:00")
    assert (film.coding.matrix, film.coding.full_range, film.coding.transfer) == ("bt709", False, "srgb")
    assert comment_of(path) == "Flarewright, a test"
    with av.open(str(path)) as container:
        context = container.streams.video[0].codec_context
        tags = (context.colorspace, context.color_primaries, context.color_trc, context.color_range)
        assert tuple(map(int, tags)) == (1, 1, 13, 1)
        assert context.pix_fmt == FILM_CODECS[path.suffix].pixels
        assert context.name == {".mp4": "h264", ".mov": "prores"}[path.suffix]
    for k in (0, 19, 20, 21, 47):
        linear = read_film_frame(path, k).pixels[8:49:16, 8:61:16]
        assert np.abs(255.0 * srgb_oetf(np.clip(linear, 0.0, 1.0)) - PATCHES[k][:3]).max() < error
    data = path.read_bytes()
    # players begin before the whole film is there
    assert data.find(b"moov") < data.find(b"mdat")


@pytest.mark.parametrize("name", ["f.mp4", "f.mov"])
def test_the_bytes_depend_on_the_pictures_alone(tmp_path, name):
    first = join(tmp_path, name).read_bytes()
    assert join(tmp_path, name).read_bytes() == first


def test_frames_that_are_left_out_keep_the_time_of_the_others(tmp_path):
    write_film(tmp_path / "g.mp4", zip((0, 2, 4, 9), PICTURES, strict=False), SIZE, Fraction(24))
    with av.open(str(tmp_path / "g.mp4")) as container:
        assert [float(frame.time) for frame in container.decode(video=0)] == pytest.approx([0, 2 / 24, 4 / 24, 9 / 24])


def test_pixels_that_are_not_square_are_stated(tmp_path):
    write_film(tmp_path / "a.mp4", [(0, PICTURES[0])], SIZE, RATE, pixel_aspect=2.0)
    assert open_film(tmp_path / "a.mp4").pixel_aspect == 2.0


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("f.webm", r"must be named \*\.mp4 \(H\.264\) or \*\.mov"),
        ("none/f.mp4", "the folder .*none does not exist; create it first"),
        ("folder.mp4", "it is a folder"),
    ],
)
def test_a_name_that_cannot_be_written_is_refused_before_the_work(tmp_path, name, words):
    (tmp_path / "folder.mp4").mkdir()
    with pytest.raises(OutputError, match=words):
        check_film_name(tmp_path / name)


def test_nothing_remains_of_a_film_that_fails(tmp_path):
    pictures = [(0, PICTURES[0]), (1, PICTURES[1][:40])]
    with pytest.raises(OutputError, match="a frame has 61x40 pixels, the first one 61x49; give frames of one size"):
        write_film(tmp_path / "f.mp4", pictures, SIZE, RATE)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_gets_a_sentence(tmp_path):
    resource = pytest.importorskip("resource", reason="limits of a process need a POSIX system")
    import signal

    limits, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, limits[1]))
        with pytest.raises(OutputError, match=r"cannot write .*f\.mov: file too large; check the free space"):
            write_film(tmp_path / "f.mov", enumerate(PICTURES), SIZE, RATE)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("step", [2, 5])
def test_parts_whose_frames_lie_farther_apart_can_be_joined(tmp_path, step):
    """A part used to begin to decode before the previous one had ended, which no container holds."""
    write_film(tmp_path / "a.mp4", enumerate(PICTURES[:24]), SIZE, RATE, comment="part")
    later = [(step * k, each) for k, each in enumerate(PICTURES[24:])]
    write_film(tmp_path / "b.mp4", later, SIZE, RATE, comment="part")
    join_films(tmp_path / "f.mp4", [(0, tmp_path / "a.mp4"), (25, tmp_path / "b.mp4")], RATE)
    with av.open(str(tmp_path / "f.mp4")) as container:
        times = [float(frame.time * RATE) for frame in container.decode(video=0)]
    assert times == pytest.approx([*range(24), *(25 + moment for moment, _ in later)], abs=0.01)
