"""Folders and ZIP archives of lens files: what is a lens, and what an archive may not do."""

import struct
from zipfile import ZIP_DEFLATED, ZipFile

import pytest

from flarewright.errors import FileError, LensError
from flarewright.io.files import door
from flarewright.io.lens.own.archive import lens_files

LENS = b"# a lens\n"


def archive(path, parts):
    with ZipFile(path, "w", ZIP_DEFLATED) as file:
        for name, data in parts.items():
            file.writestr(name, data)
    return path


def listed(place):
    with lens_files(place) as found:
        return [(one.label, one.read()) for one in found.files], found.others


def test_a_folder_and_its_archive_hold_the_same_lenses(tmp_path):
    parts = {
        "b/x.zmx": b"X",
        "a.lens": LENS,
        "b/.hidden.zmx": b"no",
        "read.txt": b"t",
        "c.ZMX": b"C",
        ".git/d.lens": b"no",
    }
    for name, data in parts.items():
        (tmp_path / "all" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "all" / name).write_bytes(data)
    inside, others = listed(tmp_path / "all")
    assert [(label.rpartition("all/")[2], data) for label, data in inside] == [
        ("a.lens", LENS), ("c.ZMX", b"C"), ("b/x.zmx", b"X"),
    ]  # fmt: skip
    packed, same = listed(archive(tmp_path / "all.zip", parts))
    assert sorted(data for _, data in packed) == sorted(data for _, data in inside)
    assert others == same == {".txt": 1}


def test_a_part_of_an_archive_is_read_below_a_temporary_folder_whatever_its_name(tmp_path):
    place = archive(tmp_path / "slip.zip", {"../../../etc/evil.zmx": b"X", "/root/other.zmx": b"Y"})
    with lens_files(place) as found:
        for one in found.files:
            with one.as_path(one.read()) as path:
                assert path.name == "lens.zmx"
                assert "etc" not in path.parts
                assert "root" not in path.parts
            assert not path.exists()


def test_pictures_of_a_lens_in_an_archive_come_with_it(tmp_path):
    lens = b'[iris]\nmask = "pictures/iris.png"\n'
    place = archive(tmp_path / "a.zip", {"one/lens.toml": lens, "one/pictures/iris.png": b"PNG"})
    with lens_files(place) as found:
        (one,) = found.files
        with one.as_path(one.read()) as path:
            assert (path.parent / "pictures" / "iris.png").read_bytes() == b"PNG"


@pytest.mark.parametrize(
    ("picture", "reason"),
    [
        ("../iris.png", "outside its folder"),
        ("/etc/hostname", "outside its folder"),
        ("none.png", "not in the archive"),
    ],
)
def test_a_lens_in_an_archive_names_no_picture_outside(tmp_path, picture, reason):
    place = archive(tmp_path / "a.zip", {"one/lens.toml": f'[iris]\nmask = "{picture}"\n'.encode(), "iris.png": b"PNG"})
    with (
        lens_files(place) as found,
        pytest.raises(LensError, match=reason),
        found.files[0].as_path(found.files[0].read()),
    ):
        pass


def test_an_archive_that_unpacks_to_too_much_is_refused_unread(tmp_path, monkeypatch):
    monkeypatch.setattr(door, "_ALWAYS_BYTES", 1_000_000)
    place = archive(tmp_path / "bomb.zip", {f"{k}.zmx": bytes(1_000_000) for k in range(4)})
    with pytest.raises(FileError, match=r"would unpack to 4 MB, more than 100 times its size"), lens_files(place):
        pass


def test_a_part_larger_than_a_lens_is_refused_alone(tmp_path):
    place = archive(tmp_path / "a.zip", {"big.zmx": b"a " * 3_000_000, "good.zmx": b"X"})
    with lens_files(place) as found:
        big, good = found.files
        with pytest.raises(FileError, match=r"big.zmx has more than 4 MB"):
            big.read()
        assert good.read() == b"X"


def test_an_archive_whose_header_lies_about_a_size_is_refused(tmp_path):
    place = archive(tmp_path / "a.zip", {"lying.zmx": b"a " * 1000})
    data = bytearray(place.read_bytes())
    # the size before packing, in the central directory
    at = data.rindex(b"PK\x01\x02") + 24
    data[at : at + 4] = struct.pack("<I", 3)
    place.write_bytes(data)
    with pytest.raises(FileError, match=r"a\.zip cannot be read as a ZIP archive of lens files"), lens_files(place):
        pass


@pytest.mark.parametrize("data", [b"", b"no archive", b"PK\x03\x04 cut short"])
def test_what_is_no_archive_is_refused_in_one_sentence(tmp_path, data):
    (tmp_path / "a.zip").write_bytes(data)
    with pytest.raises(FileError, match=r"a\.zip .*ZIP archive"), lens_files(tmp_path / "a.zip"):
        pass


def test_the_library_does_not_add_itself(tmp_path, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path))
    (tmp_path / "library" / "lenses").mkdir(parents=True)
    (tmp_path / "library" / "lenses" / "own.toml").write_bytes(LENS)
    (tmp_path / "other.lens").write_bytes(LENS)
    assert len(listed(tmp_path)[0]) == 1
    with pytest.raises(FileError, match="is the lens library itself"), lens_files(tmp_path / "library" / "lenses"):
        pass
