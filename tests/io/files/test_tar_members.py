"""Tar files joined from parts: other readers see the members, and equal contents make equal bytes."""

from __future__ import annotations

import tarfile

import pytest

from flarewright.errors import FileError
from flarewright.io.files.tar_members import join_parts, members, tar_member

FILES = {"00000001.a.png": b"x" * 512, "00000001.json": b"{}", "00000002.json": b""}


def test_joined_parts_are_a_tar_file(tmp_path):
    parts = []
    for k, (name, data) in enumerate(FILES.items()):
        parts.append(tmp_path / f"{k}.part")
        parts[-1].write_bytes(tar_member(name, data))
    join_parts(tmp_path / "a.tar", parts)
    with tarfile.open(tmp_path / "a.tar") as archive:
        assert {each.name: archive.extractfile(each).read() for each in archive} == FILES
        assert {(each.mtime, each.uid, each.mode) for each in archive.getmembers()} == {(0, 0, 0o644)}
    assert dict(members((tmp_path / "a.tar").read_bytes())) == FILES
    assert dict(members(parts[0].read_bytes() + parts[1].read_bytes())) == dict(list(FILES.items())[:2])


def test_a_missing_or_damaged_part_leaves_no_file(tmp_path):
    with pytest.raises(FileError, match="does not exist"):
        join_parts(tmp_path / "a.tar", [tmp_path / "none.part"])
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ValueError, match="cut short"):
        list(members(tar_member("a", b"b" * 600)[:-700]))
