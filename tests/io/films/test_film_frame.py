"""Frames of films: the right one, with the right colours."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("av", reason="the extra video: PyAV")

from film_samples import BT601, BT709, LOSSLESS, SIZE, lamp, write_codes, write_sample

from flarewright.io.films.film_colour import FilmCoding, linear_pixels, to_rec709
from flarewright.io.films.film_file import open_film
from flarewright.io.films.film_frame import read_film_frame
from flarewright.io.images.transfer import decoded

ORDER = (0, 5, 47, 3, 20, 21, 22, 46, 1, 30)


def codes_of(rgb, matrix, full, bits):
    """Return the planes of red, green and blue by the definition of luma and colour differences."""
    kr, kb = {1: (0.2126, 0.0722), 5: (0.299, 0.114), 9: (0.2627, 0.0593)}[matrix]
    luma = rgb @ [kr, 1.0 - kr - kb, kb]
    blue, red = (rgb[..., 2] - luma) / (2.0 - 2.0 * kb), (rgb[..., 0] - luma) / (2.0 - 2.0 * kr)
    step, kind = 1 << (bits - 8), np.uint8 if bits == 8 else np.dtype("<u2")
    black, spans = (0, ((1 << bits) - 1,) * 2) if full else (16 * step, (219 * step, 224 * step))
    return [
        np.rint(v).astype(kind) for v in (black + luma * spans[0], *(128 * step + c * spans[1] for c in (blue, red)))
    ]


def shown_frame(picture):
    """Return the index of the frame that a picture shows."""
    bright = picture.pixels[..., 1] > 0.3
    return round(float(np.nonzero(bright)[1].mean()) + 0.5 - 8.0)


@pytest.mark.parametrize(
    ("name", "how"),
    [
        # B-frames, whose order in the file is not that of the film
        ("b.mp4", {"options": {"bf": "3", "g": "12"}}),
        ("b.avi", {"options": {"bf": "3", "g": "12"}}),
        # a stream that begins later, and whose container finds no key frames
        ("late.ts", {"options": {"g": "12"}}),
        ("late.mkv", {"moments": range(7, 55)}),
        ("open.mpg", {"codec": "mpeg2video", "rate": Fraction(25), "options": {"bf": "2"}}),
        # packets that are no frames
        ("hidden.webm", {"codec": "libvpx", "options": {"auto-alt-ref": "1", "lag-in-frames": "16"}}),
        ("intra.mov", {"codec": "prores_ks", "pixels": "yuv422p10le"}),
    ],
)
def test_frames_are_found_in_any_order(tmp_path, name, how):
    path = write_sample(tmp_path / name, **how)
    assert open_film(path).frames == 48
    assert [shown_frame(read_film_frame(path, k)) for k in ORDER] == list(ORDER)


@pytest.mark.parametrize("rate", [Fraction(24), Fraction(25), Fraction(24000, 1001), Fraction(30000, 1001)])
@pytest.mark.parametrize("suffix", [".mp4", ".mkv"])
def test_the_rate_is_exact(tmp_path, rate, suffix):
    film = open_film(write_sample(tmp_path / f"f{suffix}", rate=rate, frames=12, options=LOSSLESS))
    assert (film.fps, film.frames, film.size_px, film.remarks) == (rate, 12, SIZE, ())


@pytest.mark.parametrize("tags", [BT709, BT601, (9, 9, 14, 1)], ids=["709", "601", "2020"])
@pytest.mark.parametrize("full", [False, True], ids=["limited", "full"])
@pytest.mark.parametrize("bits", [8, 10])
def test_known_colours_come_back_within_the_step_of_the_codes(tmp_path, tags, full, bits):
    rgb = np.random.default_rng(bits).uniform(0.02, 0.98, (8, 16, 3))
    pixels = {8: "yuv444p", 10: "yuv444p10le"}[bits]
    path = write_codes(tmp_path / "c.mkv", codes_of(rgb, tags[0], full, bits), pixels, (*tags[:3], 2 if full else 1))
    coding = open_film(path).coding
    assert (coding.full_range, coding.bits) == (full, bits)
    matrix = to_rec709(coding.primaries)
    # half a step of luma and of a difference, which weighs up to 1.89
    step = 0.5 * (1.0 + 1.89) / (219 << (bits - 8)) * np.abs(matrix).sum(axis=1).max()
    assert read_film_frame(path, 0, transfer="linear").pixels == pytest.approx(rgb @ matrix.T, abs=float(step))


@pytest.mark.slow
@pytest.mark.parametrize("tags", [BT709, BT601, (9, 9, 14, 1)], ids=["709", "601", "2020"])
@pytest.mark.parametrize("full", [False, True], ids=["limited", "full"])
@pytest.mark.parametrize("bits", [8, 10])
def test_colours_are_those_of_colour_science(tmp_path, tags, full, bits):
    # its import takes seconds
    colour = pytest.importorskip("colour")
    rgb = np.random.default_rng(bits).uniform(0.02, 1.0, (8, 16, 3))
    weights = colour.WEIGHTS_YCBCR[{1: "ITU-R BT.709", 5: "ITU-R BT.601", 9: "ITU-R BT.2020"}[tags[0]]]
    codes = colour.RGB_to_YCbCr(rgb, K=weights, out_bits=bits, out_legal=not full, out_int=True)
    kind, pixels = (np.uint8, "yuv444p") if bits == 8 else (np.dtype("<u2"), "yuv444p10le")
    planes = [codes[..., k].astype(kind) for k in range(3)]
    path = write_codes(tmp_path / "c.mkv", planes, pixels, (*tags[:3], 2 if full else 1))
    back = colour.YCbCr_to_RGB(codes, K=weights, in_bits=bits, in_legal=not full, in_int=True, out_legal=False)
    # SMPTE-C and BT.2020 are converted to Rec.709
    space = {1: "ITU-R BT.709", 6: "SMPTE C", 9: "ITU-R BT.2020"}[tags[1]]
    matrix = colour.matrix_RGB_to_RGB(space, "ITU-R BT.709", chromatic_adaptation_transform=None)
    wanted = decoded(back.astype(np.float32), "rec709") @ matrix.T
    assert read_film_frame(path, 0).pixels == pytest.approx(wanted, abs=2e-3)


def test_patches_of_a_subsampled_film_keep_their_colours(tmp_path):
    patches = np.random.default_rng(1).integers(0, 256, (3, 4, 3), np.uint8)
    codes = np.repeat(np.repeat(patches, 12, axis=0), 16, axis=1)
    for name, pixels, error in (("a.mp4", "yuv420p", 2.5), ("b.mov", "yuv422p10le", 0.6)):
        codec = {"a.mp4": "libx264", "b.mov": "prores_ks"}[name]
        how = {"options": LOSSLESS} if codec == "libx264" else {}
        path = write_sample(tmp_path / name, codec=codec, pixels=pixels, frames=1, draw=lambda k: codes, **how)
        middle = read_film_frame(path, 0, transfer="linear").pixels[6::12, 8::16] * 255.0
        # codes beyond black are black
        assert np.abs(middle - patches).max() < error


@pytest.mark.parametrize(("name", "codec"), [("q.mov", "qtrle"), ("x.mkv", "libx264rgb"), ("p.mov", "png")])
def test_red_green_and_blue_are_read_as_they_are(tmp_path, name, codec):
    codes = np.arange(256, dtype=np.uint8).reshape(8, 32)[..., None] * np.ones(3, np.uint8)
    codes[..., 1] = codes[..., 0][::-1]
    how = {"options": LOSSLESS} if codec == "libx264rgb" else {}
    path = write_sample(
        tmp_path / name, codec=codec, pixels="rgb24", size=(32, 8), frames=1, tags=(2, 2, 2, 0), draw=lambda k: codes,
        **how,
    )  # fmt: skip
    picture = read_film_frame(path, 0, transfer="linear")
    assert picture.pixels == pytest.approx(codes / 255.0, abs=1e-6)
    assert open_film(path).coding.matrix is None
    assert read_film_frame(path, 0).transfer == "srgb"


@pytest.mark.parametrize(("pixels", "full"), [("gray", True), ("gray10le", True), ("gray", False), ("gray10le", False)])
def test_a_grey_film_has_its_range(tmp_path, pixels, full):
    bits = 10 if pixels == "gray10le" else 8
    grey = np.linspace(0.0, 1.0, 256).reshape(8, 32)
    step = 1 << (bits - 8)
    codes = grey * ((1 << bits) - 1) if full else 16 * step + grey * 219 * step
    plane = np.rint(codes).astype(np.uint8 if bits == 8 else np.dtype("<u2"))
    path = write_codes(tmp_path / "g.mkv", [plane], pixels, (1, 1, 1, 2 if full else 1))
    found = read_film_frame(path, 0, transfer="linear").pixels
    assert found == pytest.approx(np.repeat(grey[..., None], 3, axis=2), abs=0.6 / (219 * step))


def test_white_is_where_the_codes_clip(tmp_path):
    hlg = write_sample(tmp_path / "h.mkv", codec="ffv1", pixels="yuv420p10le", frames=1, tags=(9, 9, 18, 1), draw=lamp)
    picture = read_film_frame(hlg, 0)
    assert (picture.transfer, picture.colorspace) == ("hlg", "rec709")
    assert picture.white == pytest.approx(3.774, abs=0.01)
    assert any("white paper becomes 1" in line for line in picture.remarks)
    assert read_film_frame(hlg, 0, transfer="srgb").white == 1.0


def test_a_turned_film_is_turned_with_its_pixels(tmp_path):
    path = write_sample(tmp_path / "r.mp4", frames=2, rotation=90, aspect=Fraction(4, 3), options=LOSSLESS)
    film, picture = open_film(path), read_film_frame(path, 1)
    assert (film.size_px, picture.size_px, film.pixel_aspect) == ((36, 64), (36, 64), 0.75)
    flat = write_sample(tmp_path / "f.mp4", frames=2, options=LOSSLESS)
    assert np.array_equal(picture.pixels, np.rot90(read_film_frame(flat, 1).pixels))
    assert any("turned by 90 degrees" in line for line in film.remarks)


def test_time_codes_count_on(tmp_path):
    path = write_sample(
        tmp_path / "t.mov", codec="prores_ks", pixels="yuv422p10le", rate=Fraction(30000, 1001), frames=4,
        metadata={"timecode": "01:00:59;28"},
    )  # fmt: skip
    codes = [read_film_frame(path, k).header["timeCode"] for k in range(4)]
    # drop frame: a minute begins with number 2
    assert [(c.minutes, c.seconds, c.frame, c.dropFrame) for c in codes] == [
        (0, 59, 28, True), (0, 59, 29, True), (1, 0, 2, True), (1, 0, 3, True),
    ]  # fmt: skip
    assert read_film_frame(write_sample(tmp_path / "n.mp4", frames=1), 0).header is None


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"tags": (2, 2, 2, 0)}, "states no colour matrix; that of BT.601 is used, for its size"),
        ({"tags": (2, 2, 2, 0)}, "states no transfer function and counts as having codes of a video camera (BT.709)"),
        ({"tags": (1, 1, 13, 1)}, "the film has codes of sRGB"),
        ({"tags": (1, 1, 8, 1)}, "the film has codes of linear light"),
        ({"tags": (1, 1, 17, 1)}, "transfer function (number 17 of H.273) is not known here"),
        ({"moments": [0, 1, 9, 10]}, "not evenly spaced, 42 to 333 ms; they count one by one, at the mean rate of"),
        ({"codec": "prores_ks", "pixels": "yuva444p10le"}, "the film's alpha is not used"),
    ],
)  # fmt: skip
def test_what_a_film_leaves_open_is_remarked(tmp_path, how, words):
    path = write_sample(tmp_path / ("f.mov" if "codec" in how else "f.mkv"), frames=4, **how)
    assert any(words in line for line in read_film_frame(path, 0).remarks)


def test_only_a_given_transfer_silences_the_remark_on_it(tmp_path):
    path = write_sample(tmp_path / "f.mp4", frames=1)
    assert read_film_frame(path, 0, transfer="rec709").remarks == ()


def test_primaries_map_white_to_white():
    for primaries in ("bt2020", "p3", "smpte170m", "bt470bg"):
        assert to_rec709(primaries).sum(axis=1) == pytest.approx(1.0, abs=1e-5)
    grey = np.full((1, 1, 3), 1 << 15, np.uint16)
    grey[..., 0] = (16 + 219) << 8
    assert linear_pixels(grey, FilmCoding("bt2020", False, "rec709", "bt2020")) == pytest.approx(1.0, abs=1e-5)
