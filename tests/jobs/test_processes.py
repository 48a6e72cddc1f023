"""Items shared among processes: all results, errors in sentences, and no process that outlives the work."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from flarewright.errors import FlarewrightError
from flarewright.jobs.processes import shares, work_off

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def alive(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    # a zombie has ended
    with open(f"/proc/{number}/stat") as file:
        return file.read().rpartition(")")[2].split()[0] != "Z"


def wait_for(condition, seconds=30.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


def test_all_items_come_back_from_several_processes():
    done = list(work_off("shared_work:add", 100, range(12), processes=2, threads=1))
    assert sorted(one.item for one in done) == list(range(12))
    assert all(one.result[0] == 100 + one.item for one in done)
    workers = {one.result[1] for one in done}
    assert len(workers) <= 2
    assert os.getpid() not in workers
    assert {one.result[2:] for one in done} == {(1, "1")}
    assert not any(alive(worker) for worker in workers)


def test_one_process_is_this_one():
    done = list(work_off("shared_work:add", 100, range(3), processes=1))
    assert [one.result[:2] for one in done] == [(100 + k, os.getpid()) for k in range(3)]


def test_errors_of_an_item_are_raised_here():
    with pytest.raises(FlarewrightError, match="no space left") as found:
        list(work_off("shared_work:fail", 2, range(3), processes=2))
    assert found.value.problems == ("one", "two")
    with pytest.raises(RuntimeError, match=r"item 2: [\s\S]*a bug"):
        list(work_off("shared_work:fail", 1, (2,), processes=2))


@posix
def test_a_lost_process_is_one_sentence():
    with pytest.raises(FlarewrightError, match=r"a process ended by signal 9 at frame 3, .*repeat the command"):
        list(work_off("shared_work:die", 3, (3,), processes=2, what="frame"))


@posix
def test_processes_end_with_their_parent_even_if_it_is_killed(tmp_path):
    code = (
        f"import sys; sys.path[:] = {sys.path!r}\n"
        "from flarewright.jobs.processes import work_off\n"
        f"list(work_off('shared_work:mark', {str(tmp_path)!r}, range(4), processes=2))"
    )
    parent = subprocess.Popen([sys.executable, "-c", code])
    assert wait_for(lambda: len(list(tmp_path.iterdir())) == 2)
    workers = [int(path.suffix[1:]) for path in tmp_path.iterdir()]
    parent.kill()
    parent.wait()
    assert wait_for(lambda: not any(alive(worker) for worker in workers))


@posix
def test_what_watches_can_end_the_work(tmp_path):
    class EnoughError(Exception):
        pass

    def watch():
        if len(list(tmp_path.iterdir())) == 2:
            raise EnoughError

    with pytest.raises(EnoughError):
        list(work_off("shared_work:mark", str(tmp_path), range(4), processes=2, watch=watch))
    workers = [int(path.suffix[1:]) for path in tmp_path.iterdir()]
    assert len(workers) == 2
    assert not any(alive(worker) for worker in workers)


def test_shares_never_oversubscribe():
    for items in (1, 3, 100):
        for threads in (1, 2, 7, 16):
            processes, each = shares(items, None, threads)
            assert processes <= items
            assert processes * each <= threads
    assert shares(10, processes=3, threads=1) == (3, 1)
