"""Films that are damaged, cut, hostile or none: one sentence, within the limits of memory."""

from __future__ import annotations

import os
import struct
import sys

import numpy as np
import pytest

pytest.importorskip("av", reason="the extra video: PyAV")

import av
from film_samples import lamp, write_sample

from flarewright.errors import FileError
from flarewright.io.films.decoder import av_module
from flarewright.io.films.film_file import open_film
from flarewright.io.films.film_frame import read_film_frame


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    folder = tmp_path_factory.mktemp("films")
    write_sample(folder / "a.mp4")
    write_sample(folder / "a.mkv")
    write_sample(folder / "a.mov", codec="prores_ks", pixels="yuv422p10le")
    # its table of frames before the frames
    with (
        av.open(str(folder / "a.mp4")) as old,
        av.open(str(folder / "fast.mp4"), "w", options={"movflags": "+faststart"}) as new,
    ):
        stream = new.add_stream_from_template(old.streams.video[0])
        for packet in old.demux(old.streams.video[0]):
            if packet.dts is not None:
                packet.stream = stream
                new.mux(packet)
    with av.open(str(folder / "sound.mp4"), "w") as container:
        stream = container.add_stream("aac", rate=48000)
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
        sound.sample_rate = 48000
        container.mux(stream.encode(sound))
        container.mux(stream.encode())
    return folder


def half(data):
    return data[: len(data) // 2]


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("a.mp4", half, "cannot be read as a film (invalid data found when processing input): give MP4"),
        ("a.mkv", lambda data: data[: len(data) * 7 // 8], "is cut short: its header states 2.00 s, and its"),
        ("a.mkv", half, ""),
        ("fast.mp4", lambda data: data[: -len(data) // 4], "is cut short: its header states 48 frames, and"),
        ("a.mp4", lambda data: os.urandom(5000), "cannot be read as a film"),
        ("a.mp4", lambda data: b"", "is empty: a film was expected"),
        ("sound.mp4", lambda data: data, "has no pictures: give MP4"),
        # lists of other files, which would be opened, also from the network
        ("a.mp4", lambda data: b"#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\na.mkv\n#EXT-X-ENDLIST\n", "cannot be"),
        ("a.mp4", lambda data: b"ffconcat version 1.0\nfile a.mkv\n", "cannot be read as a film"),
    ],
)  # fmt: skip
def test_a_hostile_film_gets_one_sentence(films, tmp_path, name, change, words):
    (tmp_path / "a.mkv").write_bytes((films / "a.mkv").read_bytes())
    path = tmp_path / f"h{name}"
    path.write_bytes(change((films / name).read_bytes()))
    with pytest.raises(FileError) as error:
        open_film(path)
    assert words in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_a_damaged_frame_is_named_and_the_others_are_read(films, tmp_path):
    path = tmp_path / "d.mov"
    data = bytearray((films / "a.mov").read_bytes())
    with av.open(str(films / "a.mov")) as container:
        at = [packet.pos for packet in container.demux(video=0) if packet.size][12]
    data[at : at + 300] = bytes(300)
    path.write_bytes(data)
    with pytest.raises(FileError, match=r"frame 13 of .*d\.mov cannot be"):
        read_film_frame(path, 12)
    assert read_film_frame(path, 13).size_px == (64, 36)


def test_a_size_that_needs_too_much_memory_is_refused(films, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_READ_LIMIT_MB", "0.1")
    path = write_sample(films / "large.mkv", frames=1)
    with pytest.raises(FileError, match=r"states 64 x 36 pixels, 0 MB in memory, above the limit of 0\.1 MB"):
        open_film(path)


def test_a_later_frame_that_is_larger_is_refused(tmp_path):
    # streams of mpeg-2 can change their size
    small = write_sample(tmp_path / "s.mpg", codec="mpeg2video", frames=12)
    large = write_sample(
        tmp_path / "l.mpg", codec="mpeg2video", frames=12, size=(96, 64), draw=lambda k: lamp(k, (96, 64))
    )
    both = tmp_path / "both.mpg"
    both.write_bytes(small.read_bytes() + large.read_bytes())
    last = open_film(both).frames - 1
    with pytest.raises(FileError, match=r"changes its size to 96x64"):
        read_film_frame(both, last)


def test_a_changed_file_is_read_again(films, tmp_path):
    path = write_sample(tmp_path / "c.mp4", frames=3)
    before = open_film(path)
    write_sample(path, frames=5)
    assert (before.frames, open_film(path).frames) == (3, 5)
    assert before.digest != open_film(path).digest


def test_the_digest_is_that_of_the_pictures_and_not_of_the_file(tmp_path):
    one, two, other = (write_sample(tmp_path / f"{name}.mp4", frames=3) for name in "abc")
    assert open_film(one).digest == open_film(two).digest
    write_sample(other, frames=3, tags=(1, 1, 13, 1))
    assert open_film(one).digest != open_film(other).digest


def test_without_pyav_a_sentence_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(FileError, match=r"pip install 'flarewright\[video\]', or give an image sequence"):
        av_module("drive.mp4")


def test_a_trimmed_film_is_whole(films, tmp_path):
    """Its header counts the frames that it stores and does not show; it used to be called cut short."""
    data = bytearray((films / "a.mp4").read_bytes())
    # the edit list: its segment begins half a second into the media
    at = data.index(b"elst")
    (entries,) = struct.unpack(">I", data[at + 8 : at + 12])
    assert entries == 1
    long, begins, rate = struct.unpack(">IiI", data[at + 12 : at + 24])
    scale = struct.unpack(">I", data[(mdhd := data.index(b"mdhd")) + 16 : mdhd + 20])[0]
    movie = struct.unpack(">I", data[(mvhd := data.index(b"mvhd")) + 16 : mvhd + 20])[0]
    data[at + 12 : at + 24] = struct.pack(">IiI", long - movie // 2, begins + scale // 2, rate)
    path = tmp_path / "trimmed.mp4"
    path.write_bytes(data)
    film = open_film(path)
    with av.open(str(path)) as container:
        assert film.frames == sum(1 for _ in container.decode(video=0)) == 36
