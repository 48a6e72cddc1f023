"""A killed process leaves a temporary file; the next writer of the same target removes it, and no other file."""

import os
import subprocess
import sys

import pytest

from flarewright.io.files.atomic_write import delete_written, write_text_atomically
from flarewright.io.files.temporary_file import remove_abandoned, temporary_beside

KILLED = """
import os, signal, sys
from pathlib import Path
from flarewright.io.files.atomic_write import write_atomically

def write(path):
    path.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)

write_atomically(Path(sys.argv[1]), write)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_what_a_killed_writer_left_goes_with_the_next_write_or_the_end(tmp_path):
    target = tmp_path / "picture[1].npz"
    for following in (lambda: write_text_atomically(target, "whole"), lambda: delete_written(target)):
        subprocess.run([sys.executable, "-c", KILLED, str(target)], check=False)
        (left,) = tmp_path.glob(".*.part.npz")
        assert left.read_text() == "half"
        following()
        assert not left.exists()
    assert not target.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows refuses to delete a file in use instead")
def test_files_of_living_processes_other_machines_and_other_targets_stay(tmp_path):
    target = tmp_path / "a.exr"
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    own = temporary_beside(target).name
    machine, process, token = own.removeprefix(".a.").removesuffix(".part.exr").split("-")
    dead = int(gone.stdout)
    assert int(process) == os.getpid()
    kept = [
        own, f".a.{machine}-{os.getppid()}-{token}.part.exr", f".a.{machine}-1-{token}.part.exr",
        f".a.00000000-{dead}-{token}.part.exr", f".b.{machine}-{dead}-{token}.part.exr",
        f".a.{machine}-{dead}-{token}.part.npz", f".a.{machine}-{dead}-{token}.exr", "a.exr",
    ]  # fmt: skip
    for name in [*kept, f".a.{machine}-{dead}-{token}.part.exr"]:
        (tmp_path / name).touch()
    remove_abandoned(target)
    # the parent is process 1 where a shell left this one behind
    assert {path.name for path in tmp_path.iterdir()} == set(kept)
    remove_abandoned(tmp_path / "no" / "folder.exr")
