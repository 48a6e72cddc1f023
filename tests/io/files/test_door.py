"""The door to files: claims are checked before memory is allocated, and every exception becomes one sentence."""

from __future__ import annotations

import csv
import io
import json
import resource
import struct
import tokenize
import zipfile
import zlib

import numpy as np
import pytest
from PIL import Image

from flarewright.errors import FileError, FlarewrightError, LensError, OutputError, ProjectError
from flarewright.io.files.atomic_write import write_atomically
from flarewright.io.files.door import (
    LIMIT_VARIABLE,
    expanded,
    outside,
    outside_arrays,
    read_limit_bytes,
    reason_of,
    sentences_for,
    shown,
)
from flarewright.io.files.text_file import read_json, read_toml
from flarewright.io.files.type_slips import MOST_ERRORS
from flarewright.io.images.exr import read_exr, write_exr
from flarewright.io.images.foreign_exr import read_exr_plane
from flarewright.io.images.height_image import read_heights
from flarewright.io.images.mask_image import read_mask
from flarewright.io.images.photo import open_photo
from flarewright.io.images.picture import read_picture
from flarewright.io.images.plate_image import read_matte
from flarewright.io.images.png import encode_png
from flarewright.io.lens.library import lens_path
from flarewright.io.measurement.captures import read_captures
from flarewright.io.measurement.ghost_model_file import read_ghost_model
from flarewright.io.project.look_file import read_look
from flarewright.io.render_state.flare_cache import read_cache, write_cache
from flarewright.model.layer import Layer


def peak_mb():
    """Return the largest memory of the process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000.0


@pytest.fixture
def less_than_100_mb():
    """Fail a test during which the process grows by more."""
    before = peak_mb()
    yield
    assert peak_mb() - before < 100.0


def png_of(width, height, path):
    """Write a PNG whose header states a size; its pixels are missing."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"\0")) + chunk(b"IEND", b""))
    return path


@pytest.mark.parametrize(
    "error",
    [
        RecursionError("maximum recursion depth exceeded"),
        csv.Error("field larger than field limit (131072)"),
        zlib.error("Error -3 while decompressing data"),
        tokenize.TokenError("EOF in multi-line statement", (2, 0)),
        MemoryError(),
        struct.error("unpack requires a buffer of 4 bytes"),
        UnicodeEncodeError("utf-8", "\udcff", 0, 1, "surrogates not allowed"),
        Exception("x" * 5000),
    ],
    ids=lambda error: type(error).__name__,
)
def test_any_exception_of_a_library_is_one_short_sentence(error):
    whole = r"^a\.txt cannot be read as a list \(.+\): is it the right file\?$"
    with pytest.raises(FileError, match=whole) as raised, sentences_for("a.txt", "a list"):
        raise error
    assert len(str(raised.value)) < 200


def test_our_own_sentences_stay():
    with pytest.raises(LensError, match=r"^row 3$"), sentences_for("a.txt", "a list"):
        raise LensError("row 3")


@pytest.mark.usefixtures("less_than_100_mb")
def test_pictures_that_claim_too_much_are_refused_before_they_are_read(tmp_path):
    path = png_of(30000, 30000, tmp_path / "huge.png")
    for reader in (read_mask, read_matte, read_picture, read_heights):
        with pytest.raises(FlarewrightError, match=rf"states 30000 x 30000 pixels, .* {LIMIT_VARIABLE}="):
            reader(path)


def test_a_plate_within_the_limit_passes_the_guard_of_the_image_library(tmp_path):
    path = png_of(16384, 12288, tmp_path / "plate.png")
    with outside(path, "a plate", pixel_bytes=8) as file, Image.open(file) as image:
        assert image.size == (16384, 12288)


def test_the_limit_is_an_environment_variable(tmp_path, monkeypatch):
    path = tmp_path / "small.png"
    Image.new("L", (100, 100), 200).save(path)
    monkeypatch.setenv(LIMIT_VARIABLE, "0.1")
    with pytest.raises(ProjectError, match=r"0 MB in memory, above the limit of 0\.1 MB"):
        read_mask(path)
    monkeypatch.setenv(LIMIT_VARIABLE, "1")
    assert read_mask(path).shape == (100, 100)
    monkeypatch.setenv(LIMIT_VARIABLE, "much")
    with pytest.raises(FileError, match="give a number of megabytes above 0"):
        read_limit_bytes()


@pytest.mark.usefixtures("less_than_100_mb")
def test_archives_that_unpack_a_thousandfold_are_refused(tmp_path):
    path = tmp_path / "zeros.npz"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("a.npy", "w") as part,
    ):
        np.lib.format.write_array_header_1_0(part, {"descr": "<f4", "fortran_order": False, "shape": (20_000_000,)})
        for _ in range(20):
            part.write(bytes(4_000_000))
    with (
        pytest.raises(FileError, match="would unpack to 80 MB, more than 100 times its size"),
        outside_arrays(path, "arrays", "restart"),
    ):
        pass
    with pytest.raises(FlarewrightError, match="holds no flares"):
        read_cache(path)


def test_an_array_larger_than_its_file_is_cut_short(tmp_path):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6, 3)})
    path = tmp_path / "a.npy"
    path.write_bytes(header.getvalue())
    with pytest.raises(FlarewrightError, match="cut short: its header states an array of 1000000 x 1000000 x 3"):
        open_photo(path)
    path.write_bytes(header.getvalue().replace(b"'fortran_order'", b"'fortran_order\n"))
    with pytest.raises(FlarewrightError, match="cannot be read as an NPY file"):
        open_photo(path)


def test_a_cache_is_read_back(tmp_path):
    pictures = {"print": {(1.0, 2.0): np.eye(3, dtype=np.float32)}}
    write_cache(tmp_path / "a.npz", pictures)
    np.testing.assert_array_equal(read_cache(tmp_path / "a.npz")["print"][1.0, 2.0], np.eye(3))
    (tmp_path / "b.npz").write_bytes(b"text")
    with pytest.raises(FlarewrightError, match="holds no flares"):
        read_cache(tmp_path / "b.npz")


def exr_header(window, path):
    """Write the header of an EXR file with a window and one float channel; its pixels are missing."""
    channel = b"Y\0" + struct.pack("<iiii", 2, 0, 1, 1) + b"\0"
    parts = [(b"channels", b"chlist", channel)]
    parts += [(name, b"box2i", struct.pack("<4i", *window)) for name in (b"dataWindow", b"displayWindow")]
    body = b"".join(name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data for name, kind, data in parts)
    path.write_bytes(b"v/1\x01" + struct.pack("<I", 2) + body + b"\0")
    return path


@pytest.mark.usefixtures("less_than_100_mb")
@pytest.mark.parametrize(
    ("window", "words"),
    [((0, 0, 999999, 99999), "states windows of 100000000000 pixels"), ((5, 5, 1, 1), "states an empty window")],
)
def test_the_windows_of_an_exr_file_are_checked(tmp_path, window, words):
    with pytest.raises(FileError, match=words):
        read_exr_plane(exr_header(window, tmp_path / "a.exr"), (("Y",),))


@pytest.mark.usefixtures("less_than_100_mb")
def test_deep_keys_are_refused(tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text("a." * 20000 + "b = 1")
    with pytest.raises(FileError, match="line 1 has a key of more than 64 parts"):
        read_toml(path, "a lens file")
    path.write_text(f'notes = "{"a." * 200}"\nnumbers = [{"1.5, " * 200}]\n')
    assert len(read_toml(path, "a lens file")["numbers"]) == 200


@pytest.mark.usefixtures("less_than_100_mb")
def test_a_model_of_many_errors_names_the_first_and_the_number(tmp_path):
    path = tmp_path / "model.json"
    path.write_text(json.dumps({"ghosts": [{}] * 20 * MOST_ERRORS}))
    with pytest.raises(FlarewrightError) as raised:
        read_ghost_model(path)
    assert 2 < len(raised.value.problems) < 100
    assert raised.value.problems[-1].startswith("it has 2")
    assert raised.value.problems[-1].endswith("errors in all")


def test_json_that_is_too_deep_is_one_sentence(tmp_path):
    path = tmp_path / "deep.json"
    path.write_text("[" * 100_000)
    with pytest.raises(FileError, match="nested too deeply"):
        read_json(path, "a ghost model")


def test_a_cell_without_an_end_is_one_sentence(tmp_path):
    path = tmp_path / "captures.csv"
    path.write_text('file\n"' + "x" * 200_000)
    with pytest.raises(FileError, match=r"cannot be read as a list of captures \(field larger than field limit"):
        read_captures(path)


def test_a_user_that_does_not_exist_is_a_missing_file():
    assert expanded("~nosuchuser/a.toml").parts[0] == "~nosuchuser"
    with pytest.raises(LensError, match="does not exist"):
        lens_path("~nosuchuser/a.toml")
    with pytest.raises(ProjectError, match="is neither a look"):
        read_look("~nosuchuser")


def test_names_that_are_not_utf8_can_be_printed():
    assert shown("a\udcff.zmx") == "a?.zmx"
    shown("a\udcff.zmx").encode()


def test_a_picture_of_a_lens_with_a_name_that_is_not_utf8(tmp_path):
    plane = Layer("beauty", np.ones((2, 3, 3), np.float32), (0, 0, 3, 2))
    write_exr(tmp_path / "a.exr", [plane], (3, 2), metadata={"lens": "a\udcff.zmx"})
    assert read_exr(tmp_path / "a.exr").metadata["lens"] == "a?.zmx"
    assert b"a?.zmx" in encode_png(np.zeros((2, 3, 3), np.uint8), {"lens": "a\udcff.zmx"})
    with pytest.raises(OutputError, match=r"a\?\.exr: its name is not UTF-8; choose another name"):
        write_exr(tmp_path / "a\udcff.exr", [plane], (3, 2))
    (tmp_path / "a.exr").rename(tmp_path / "a\udcff.exr")
    with pytest.raises(FileError, match=r"\(its name is not UTF-8\)"):
        read_exr_plane(tmp_path / "a\udcff.exr", (("R",),))


def test_a_text_with_such_a_name_is_not_written(tmp_path):
    path = tmp_path / "a.toml"
    with pytest.raises(OutputError, match="the name of a file in it is not UTF-8; rename that file"):
        write_atomically(path, lambda temporary: temporary.write_text("a\udcff.zmx", "utf-8"))
    assert list(tmp_path.iterdir()) == []


def test_quoted_input_is_cut():
    with pytest.raises(FileError, match="longer than a file name can be") as raised:
        lens_path("y" * 5000)
    assert len(str(raised.value)) < 250
    with pytest.raises(LensError, match="is neither a shipped lens nor a file") as raised:
        lens_path("y z " * 50)
    assert len(str(raised.value)) < 250
    assert str(FlarewrightError("the file's row isn't " + "long " * 50 + "lens's")).count("long") == 50


def test_a_reason_names_no_object_of_python(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("name = 1\n")
    with path.open("rb") as file:
        said = reason_of(ValueError(f"cannot identify image file {file!r}"))
    assert said == "cannot identify image file"
