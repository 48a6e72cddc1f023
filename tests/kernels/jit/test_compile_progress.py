"""Progress of a first run: from the finished kernels and the clock."""

import io
import sys
from contextlib import contextmanager

import pytest

from flarewright.cli import common
from flarewright.kernels.jit import compile_progress, warmup
from flarewright.kernels.jit.compile_progress import part_done, reporting, schedule


class Clock:
    """A clock that the test sets."""

    now = 100.0

    def __call__(self):
        return self.now


def test_a_schedule_ends_with_the_slowest_process():
    assert schedule([3.0, 1.0], [2.5]).ends_s == (3.0, 4.0)
    assert schedule([3.0, 1.0], [2.5]).whole_s == 4.0
    assert schedule([3.0], [2.5, 7.0]).whole_s == 7.0
    assert schedule([], [2.0]).whole_s == 2.0


def test_half_the_work_at_the_expected_pace_is_half():
    plan = schedule([2.0, 2.0, 4.0], [])
    assert part_done(plan, 2, 4.0, 4.0) == 0.5
    assert part_done(plan, 2, 4.0, 6.0) == 0.75
    # on a machine of half the speed the same time is half the progress
    assert part_done(plan, 2, 8.0, 8.0) == 0.5
    assert part_done(plan, 2, 8.0, 10.0) == 0.625


@pytest.mark.parametrize("slowness", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("others", [[], [9.0]], ids=["alone", "beside a slower one"])
def test_the_part_never_falls(slowness, others):
    own = [1.0, 3.0, 0.5, 0.1]
    plan = schedule(own, others)
    ends = [slowness * end for end in (0.0, *plan.ends_s)]
    parts = []
    for step in range(400):
        now = 0.05 * step * slowness
        finished = max(k for k, end in enumerate(ends) if end <= now)
        parts.append(part_done(plan, finished, ends[finished], now))
    assert parts == sorted(parts)
    assert parts[0] == 0.0
    assert len(set(parts)) > 50
    # the part never reaches 1: the run ends when the command resumes
    assert parts[-1] == 0.99


def test_a_slow_kernel_holds_the_part_at_its_end():
    plan = schedule([1.0, 3.0], [])
    assert part_done(plan, 0, 0.0, 60.0) == 0.25
    assert part_done(plan, 1, 60.0, 60.0) == 0.25
    assert part_done(schedule([], []), 0, 0.0, 1.0) == 0.0


def test_every_kernel_is_reported():
    reported, clock = [], Clock()
    with reporting(schedule([1.0, 3.0], []), lambda part, words: reported.append((part, words)), clock) as compiled:
        clock.now += 2.0
        compiled()
        clock.now += 6.0
        compiled()
    assert [reported[0][0], *sorted({part for part, _ in reported[1:]})] == [0.0, 0.25, 0.99]
    assert {words for _, words in reported} == {"compiling kernels"}
    with reporting(schedule([1.0], []), None) as compiled:
        compiled()


def test_reports_between_kernels(monkeypatch):
    """The tick is 0 here: the rate of the reports does not matter."""
    monkeypatch.setattr(compile_progress, "_TICK_S", 0.0)
    reported, clock = [], Clock()
    with reporting(schedule([10.0], []), lambda part, _: reported.append(part), clock):
        clock.now += 3.0
        while 0.2 not in reported:
            pass
    assert {*reported} == {0.0, 0.2}


@pytest.fixture
def uncompiled(monkeypatch):
    monkeypatch.delenv("FLAREWRIGHT_HELPER", raising=False)
    compiled = []

    class Kernel:
        def __init__(self, name):
            self.name = name

        def compile(self, _):
            compiled.append(self.name)

    monkeypatch.setattr(warmup, "kernel", Kernel)
    monkeypatch.setattr(warmup, "absent", lambda names: [name for name in names if name not in compiled])
    return compiled


def test_one_core_compiles_ahead_only_with_a_progress_display(uncompiled):
    reported = []

    @contextmanager
    def shown():
        yield lambda part, _: reported.append(part)

    @contextmanager
    def hidden():
        yield None

    warmup.compile_together(["collect", "add_doubled"], 1, hidden)
    assert uncompiled == []
    warmup.compile_together(["collect", "add_doubled"], 1, shown)
    assert sorted(uncompiled) == ["add_doubled", "collect"]
    # at the start, and after each kernel
    assert len(reported) >= 3
    assert reported[-1] == 0.99
    before = list(reported)
    warmup.compile_together(["collect", "add_doubled"], 1, shown)
    assert reported == before


class Terminal(io.StringIO):
    def __init__(self, terminal):
        super().__init__()
        self.terminal = terminal

    def isatty(self):
        return self.terminal


@pytest.mark.parametrize("terminal", [True, False])
def test_the_bar_is_shown_on_terminals_only(terminal, monkeypatch):
    screen = Terminal(terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    with common.first_run_bar() as progress:
        assert (progress is not None) == terminal
        if progress is not None:
            progress(0.5, "compiling kernels")
    assert ("first run: compiling kernels" in screen.getvalue()) == terminal


@pytest.mark.parametrize(
    "words", ["render heliar-tronnier --light 1,1 --no-png -o a.exr", "warm-up", "ghosts heliar-tronnier --light 1,1"]
)
def test_commands_pass_their_bar_to_the_compiler(words, monkeypatch, tmp_path):
    from flarewright.cli.app import run

    monkeypatch.chdir(tmp_path)
    given = []

    def together(names, processes, shown):
        given.append(shown)
        raise KeyboardInterrupt

    monkeypatch.setattr("flarewright.cli.app.head_start", lambda rings: contextmanager(lambda: (yield))())
    # tests are helpers, which compile nothing ahead
    monkeypatch.setattr("flarewright.render.warmup.is_helper", lambda: False)
    monkeypatch.setattr("flarewright.render.warmup.absent", list)
    monkeypatch.setattr(warmup, "absent", list)
    monkeypatch.setattr("flarewright.render.warmup.compile_together", together)
    monkeypatch.setattr(warmup, "compile_together", together)
    assert run(words.split()) == 130
    assert given == [common.first_run_bar]
