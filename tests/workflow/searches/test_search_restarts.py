"""Independent searches: the same minima for any number of processes, and interrupted ones go on."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from importlib import import_module
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from flarewright import Camera, Design, GhostTarget, Light, Project
from flarewright.design.problem.target import problem_of
from flarewright.design.solvers import pool_search
from flarewright.design.solvers.evolution_log import Limits
from flarewright.design.solvers.pool_search import PoolState, solve
from flarewright.design.solvers.restarts import merged, restart_seed, so_far
from flarewright.design.solvers.search_state import read_state, write_state
from flarewright.design.solvers.solvers import chosen
from flarewright.errors import FlarewrightError, ProjectError
from flarewright.io.project.project_text import project_text
from flarewright.workflow.searches.lens_search import search_lenses
from flarewright.workflow.searches.search_restarts import Restart, RestartPlan, Sharing, search_restart, search_restarts

module = import_module("flarewright.workflow.searches.search_restarts")
MOST = 48


def project():
    target = GhostTarget(ghost="4-1", height=1.6)
    return Project(
        lens="heliar-tronnier", f_number=16, lights=(Light(field_deg=(7.0, 3.0)),), camera=Camera(size_px=(64, 48)),
        design=Design(ghost_targets=(target,)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def problem():
    return problem_of(project())[0]


@pytest.fixture
def short_rounds(monkeypatch):
    """Make the rounds of a search short; it proposes from its pools soon."""
    monkeypatch.setattr(pool_search, "batch_size", lambda _: 4)
    monkeypatch.setattr(pool_search, "FIRST", 8)


def minima(state):
    return [(one.cost, one.structure, one.x.tolist()) for one in state.ended]


def in_turn(problem, folder, *, restarts=3, seed=5, most=MOST, processes=1, **limits):
    sharing = Sharing(folder, processes)
    ended = search_restarts(
        chosen("pools"), problem, PoolState(seed, restarts=restarts), sharing, limits=Limits(None, most, **limits)
    )
    return ended.state


def test_restarts_are_searches_of_their_own_and_the_first_is_the_search_without(problem, short_rounds, tmp_path):
    seen = []
    found = in_turn(problem, tmp_path, progress=seen.append)
    alone = [
        solve(problem, seed=restart_seed(5, number), time_limit=None, most_searches=MOST, threads=1)
        for number in range(3)
    ]
    assert minima(found) == minima(merged(5, alone))
    assert (found.seed, found.restarts, found.searches) == (5, 3, sum(one.searches for one in alone))
    assert alone[0].seed == 5
    assert found.best.cost == min(one.best.cost for one in alone)
    assert len({restart_seed(5, number) for number in range(1000)}) == 1000
    # sums rise, and the best one stays
    assert [one.searches for one in seen] == sorted(one.searches for one in seen)
    assert seen[-1].best.cost == found.best.cost
    files = sorted(path.name for path in (tmp_path / "restarts").iterdir())
    assert files == ["0001.json", "0002.json", "0003.json"]
    for path, one in zip(files, alone, strict=True):
        assert read_state(tmp_path / "restarts" / path).runs[0].members[0].cost == one.runs[0].members[0].cost


def test_no_best_minimum_before_the_first_round():
    assert so_far(1, [PoolState(1), PoolState(2)]).best is None
    assert merged(1, [PoolState(1), PoolState(2)]) == PoolState(1, restarts=2)


def test_cancelled_restarts_go_on_to_the_same_minima(problem, short_rounds, tmp_path, monkeypatch):
    whole = in_turn(problem, tmp_path / "whole")
    rounds, reported = [], []
    cut = in_turn(problem, tmp_path / "cut", progress=rounds.append, cancelled=lambda: len(rounds) >= 5)
    assert 0 < cut.searches < whole.searches
    before = {path.name: path.read_bytes() for path in (tmp_path / "cut" / "restarts").glob("*.json")}
    sharing = Sharing(tmp_path / "cut", 1)
    started = []
    real = module.search_restart
    monkeypatch.setattr(
        module, "search_restart", lambda plan, item, *a: started.append(item.number) or real(plan, item, *a)
    )
    state = PoolState(5, restarts=3)
    again = search_restarts(
        chosen("pools"), problem, state, sharing, limits=Limits(None, MOST), report=reported.append
    ).state
    assert minima(again) == minima(whole)
    assert reported == [f"{len(before)} of 3 searches go on where they were"]
    # what is finished is not repeated
    started.clear()
    third = search_restarts(chosen("pools"), problem, state, sharing, limits=Limits(None, MOST))
    assert minima(third.state) == minima(whole)
    assert started == []
    assert third.longest_s == 0.0
    # a larger number goes on
    more = search_restarts(chosen("pools"), problem, state, sharing, limits=Limits(None, 2 * MOST)).state
    assert more.searches > whole.searches
    assert started == [0, 1, 2]


def test_a_lost_worker_loses_the_rounds_since_its_last_checkpoint(problem, short_rounds, tmp_path, monkeypatch):
    running = tmp_path / "restarts" / ".searching-x"
    running.parent.mkdir()
    running.touch()
    plan = pickle.loads(pickle.dumps(RestartPlan(problem, chosen("pools"), "ours", MOST, running)))
    monkeypatch.setattr(module, "_STORE_S", 0.0)
    whole = solve(problem, seed=8, time_limit=None, most_searches=MOST, threads=1)

    class Lost(BaseException):
        pass

    def lose(state):
        if state.searches > MOST // 2:
            raise Lost

    with pytest.raises(Lost):
        search_restart(plan, Restart(0, 8, None), 1, lose)
    kept = read_state(plan.state_file(0))
    assert MOST // 2 < kept.searches < whole.searches
    again = search_restart(plan, Restart(0, 8, None), 1)
    assert again.best.cost == whole.best.cost
    assert again.searches == whole.searches
    # its time is over: nothing is searched
    rounds = []
    over = search_restart(plan, Restart(0, 8, 0.0), 1, rounds.append)
    assert rounds == []
    assert over.searches == whole.searches


def test_a_worker_ends_when_nobody_waits_for_it(problem, short_rounds, tmp_path):
    plan = RestartPlan(problem, chosen("pools"), "ours", 10**9, tmp_path / ".searching-x")
    with pytest.raises(FlarewrightError, match=r"^search 3 ends: nothing waits for it, or .* is not seen here$"):
        search_restart(plan, Restart(2, 8, None), 1)
    assert list(tmp_path.iterdir()) == []


def test_marks_of_killed_commands_are_removed(problem, short_rounds, tmp_path):
    folder = tmp_path / "restarts"
    folder.mkdir()
    (folder / ".searching-old").touch()
    in_turn(problem, tmp_path, restarts=2, most=1)
    assert not list(folder.glob(".searching-*"))


@pytest.mark.parametrize("what", ["seed", "rows", "damaged"])
def test_states_of_another_search_are_one_sentence(problem, short_rounds, tmp_path, what):
    in_turn(problem, tmp_path, restarts=2, most=1)
    if what == "damaged":
        (tmp_path / "restarts" / "0001.json").write_text("{")
        with pytest.raises(ProjectError, match=r"0001\.json"):
            in_turn(problem, tmp_path, restarts=2)
        return
    triplet = Project(lens="triplet-pestrecov", f_number=8, lights=(Light(field_deg=(7.0, 3.0)),))
    other = problem if what == "seed" else problem_of(triplet)[0]
    with pytest.raises(ProjectError, match=r"0001\.json belongs to another search; remove the folder"):
        in_turn(other, tmp_path, restarts=2, seed=6 if what == "seed" else 5)


def test_restarts_need_a_folder():
    with pytest.raises(ProjectError, match="4 restarts, which need a folder"):
        search_lenses(project(), state=PoolState(1, restarts=4))


def test_the_number_of_restarts_is_stored(tmp_path):
    write_state(PoolState(3, restarts=4), tmp_path / "a.json")
    assert read_state(tmp_path / "a.json") == PoolState(3, restarts=4)
    write_state(PoolState(3), tmp_path / "b.json")
    assert "restarts" not in json.loads((tmp_path / "b.json").read_text())
    assert read_state(tmp_path / "b.json").restarts == 1


# ---------------------------------------------------------------------------------------------------------------------
# With other processes: seconds for their start

MORE = 400


@pytest.fixture(scope="module")
def whole(problem, tmp_path_factory):
    return in_turn(problem, tmp_path_factory.mktemp("whole"), most=MORE)


@pytest.mark.slow
@pytest.mark.parametrize("cluster", [None, "local:2"])
def test_two_processes_find_the_minima_of_one(problem, whole, tmp_path, cluster):
    if cluster is not None:
        pytest.importorskip("distributed", reason="needs the extra cluster")
    ended = search_restarts(
        chosen("pools"), problem, PoolState(5, restarts=3), Sharing(tmp_path, None if cluster else 2, cluster),
        limits=Limits(None, MORE),
    )  # fmt: skip
    assert minima(ended.state) == minima(whole)
    assert ended.longest_s > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("cluster", [None, "local:2"])
def test_ending_early_takes_seconds_and_keeps_what_is_stored(problem, tmp_path, cluster):
    if cluster is not None:
        pytest.importorskip("distributed", reason="needs the extra cluster")
    states = tmp_path / "restarts"
    ended = search_restarts(
        chosen("pools"), problem, PoolState(5, restarts=3), Sharing(tmp_path, None if cluster else 2, cluster),
        limits=Limits(None, 10**9, cancelled=lambda: len(list(states.glob("*.json"))) == 2),
    )  # fmt: skip
    assert 0 < ended.state.searches < 10**6
    assert minima(ended.state)
    kept = sorted(path.name for path in states.iterdir())
    # on a cluster the scheduler chooses which two of the three come first
    firsts = list(combinations(("0001.json", "0002.json", "0003.json"), 2))
    assert tuple(kept) in (firsts if cluster else firsts[:1])


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_loses_no_restart(problem, whole, tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    monkeypatch.setattr(module, "_STORE_S", 0.3)
    killed, said = [], []

    def kill_one(state):
        if not killed and state.searches > 0:
            killed.append(worker())
            os.kill(killed[0], signal.SIGKILL)
            # it has ended when the workers are looked at next, and is not yet forgotten
            os.waitid(os.P_PID, killed[0], os.WEXITED | os.WNOWAIT)

    ended = search_restarts(
        chosen("pools"), problem, PoolState(5, restarts=3), Sharing(tmp_path, None, "local:2", said.append),
        limits=Limits(None, MORE, kill_one),
    )  # fmt: skip
    assert len(killed) == 1
    assert minima(ended.state) == minima(whole)
    assert any("ended by signal 9; another one takes its place" in line for line in said)


def worker():
    """Return a worker process of this one."""
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and b"worker_side" in (folder / "cmdline").read_bytes():
                parent = (folder / "stat").read_text().rpartition(")")[2].split()
                if parent[0] != "Z" and int(parent[1]) == os.getpid():
                    return int(folder.name)
        except OSError:
            continue
    raise AssertionError("there is no worker")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("how", ["SIGKILL", "SIGINT"])
def test_a_command_that_is_ended_in_the_middle_resumes_to_the_same_lenses(tmp_path, how):
    (tmp_path / "p.toml").write_text(project_text(project()))

    def command(*words):
        code = (
            f"import sys; sys.path[:] = {sys.path!r}\n"
            "from flarewright.cli.app import end_as_interrupted, run; end_as_interrupted()\n"
            f"sys.exit(run({list(words)!r}))"
        )
        return subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, stderr=subprocess.PIPE, text=True)

    wanted = ("--searches", "2000", "--lenses", "1", "--time", "600", "--processes", "2")
    one = command("design", "solve", "p.toml", "-o", "one", "--restarts", "3", *wanted)
    assert one.wait(300) == 0, one.stderr.read()
    cut = command("design", "solve", "p.toml", "-o", "cut", "--restarts", "3", *wanted)
    end = time.monotonic() + 60.0
    while not list((tmp_path / "cut").glob("restarts/*.json")):
        assert time.monotonic() < end
        assert cut.poll() is None
        time.sleep(0.02)
    cut.send_signal(getattr(signal, how))
    said = cut.communicate(timeout=60)[1]
    if how == "SIGINT":
        assert cut.returncode == 0
        assert "ended early; to resume: flarewright design resume cut" in said
    states = [read_state(path) for path in (tmp_path / "cut" / "restarts").glob("*.json")]
    assert sum(state.searches for state in states) < 6000
    again = command("design", "resume", "cut", *wanted)
    assert again.wait(300) == 0
    assert "of 3 searches go on where they were" in again.stderr.read()
    lens = "lens-1.toml"
    assert (tmp_path / "cut" / lens).read_bytes() == (tmp_path / "one" / lens).read_bytes()
    assert np.array_equal(
        *([found.cost for found in read_state(tmp_path / name / "search.json").ended] for name in ("one", "cut"))
    )
