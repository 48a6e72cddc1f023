"""Locks between processes."""

import subprocess
import sys
from threading import Thread

import pytest

from flarewright.io.files.file_lock import held, locked


def test_a_lock_is_held_once_and_free_afterwards(tmp_path):
    with locked(tmp_path / "lock"), (tmp_path / "lock").open("ab") as other:
        assert not held(other)
    with (tmp_path / "lock").open("ab") as other:
        assert held(other)


def test_the_one_that_waits_gets_the_lock_next(tmp_path):
    order = []

    def wait():
        with locked(tmp_path / "lock") as file:
            order.append(file.read())

    with locked(tmp_path / "lock") as file:
        waiting = Thread(target=wait)
        waiting.start()
        file.write(b"first")
        file.flush()
        order.append("released")
    waiting.join(10.0)
    assert order[0] == "released"


@pytest.mark.skipif(sys.platform == "win32", reason="kill is POSIX")
def test_a_killed_process_holds_no_lock(tmp_path):
    code = (
        "import fcntl, sys, time; file = open(sys.argv[1], 'ab'); fcntl.flock(file, fcntl.LOCK_EX); "
        "print('held', flush=True); time.sleep(60)"
    )
    child = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "lock")], stdout=subprocess.PIPE)
    assert child.stdout.readline() == b"held\n"
    with (tmp_path / "lock").open("ab") as file:
        assert not held(file)
        child.kill()
        child.wait()
        assert held(file)
    child.stdout.close()
