"""A file is written completely or not at all, through a symbolic link, and never replaces a pipe."""

import os
import sys

import pytest

from flarewright.errors import OutputError
from flarewright.io.files.atomic_write import write_atomically, write_text_atomically

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links there need a privilege")


def test_an_output_that_is_a_link_writes_what_it_leads_to(tmp_path):
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    link, target = tmp_path / "here" / "flare.exr", tmp_path / "there" / "newest.data"
    link.symlink_to(os.path.join("..", "there", "newest.data"))
    # a link into the future is followed too
    for text in ("first", "second"):
        seen = []

        def write(temporary, text=text, seen=seen):
            seen.append(temporary)
            temporary.write_text(text)

        write_atomically(link, write)
        assert seen[0].parent == target.parent
        assert seen[0].suffix == ".exr"
        assert link.is_symlink()
        assert target.read_text() == text
        assert [each.name for each in target.parent.iterdir()] == [target.name]


def test_a_failed_write_leaves_the_file_behind_a_link(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("real.txt")

    def write(temporary):
        temporary.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "link.txt", write)
    assert (tmp_path / "real.txt").read_text() == "old"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["link.txt", "real.txt"]


def test_a_link_is_a_file_that_must_not_be_replaced(tmp_path):
    (tmp_path / "link.txt").symlink_to("gone.txt")
    with pytest.raises(FileExistsError):
        write_text_atomically(tmp_path / "link.txt", "new", replace=False)
    assert not (tmp_path / "gone.txt").exists()


@pytest.mark.parametrize(
    ("leads_to", "said"),
    [("loop.txt", "a link that leads to itself"), ("no/where.txt", "a link into the missing folder")],
)
def test_links_that_cannot_be_followed(tmp_path, leads_to, said):
    (tmp_path / "loop.txt").symlink_to(leads_to)
    with pytest.raises(OutputError, match=said):
        write_text_atomically(tmp_path / "loop.txt", "new")
    assert (tmp_path / "loop.txt").is_symlink()


def test_pipes_and_devices_stay(tmp_path):
    os.mkfifo(tmp_path / "pipe.txt")
    for path in (tmp_path / "pipe.txt", "/dev/null"):
        with pytest.raises(OutputError, match="it is not a regular file; give a file name"):
            write_text_atomically(path, "new")
    assert (tmp_path / "pipe.txt").is_fifo()
