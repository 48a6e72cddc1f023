"""The rig: kinds take turns, one that this machine lacks is tried once, and the table counts what was tried."""

from __future__ import annotations

from types import SimpleNamespace

from tests.trust import __main__ as program
from tests.trust.verdict import Verdict


class Instant:
    """A worker whose inputs take no time."""

    def run(self, kind, seed):
        remark = "skipped: it needs a browser" if kind == "page" else f"seed {seed}"
        return SimpleNamespace(verdict=Verdict(kind, kind, True, remark), cpu_s=1.0, peak_mb=2.0)

    def stop(self):
        pass


def test_a_kind_that_this_machine_lacks_is_tried_once(monkeypatch):
    monkeypatch.setattr(program, "Worker", Instant)
    done = program.rig(["page", "flags"], 0.002, 5, lambda _: None)
    names = [kind for kind, _ in done]
    assert names.count("page") == 1
    assert names.count("flags") > 1
    assert [tried.verdict.remark for kind, tried in done if kind == "flags"][:2] == ["seed 5", "seed 6"]
    lines = program.table(done).splitlines()
    counts = {line.split()[0]: int(line.split()[1]) for line in lines[1:]}
    assert counts == {"page": 0, "flags": names.count("flags")}
    assert next(line for line in lines if line.startswith("page")).endswith("skipped: it needs a browser")


def test_the_rig_ends_where_nothing_can_be_tried(monkeypatch):
    monkeypatch.setattr(program, "Worker", Instant)
    assert len(program.rig(["page"], 60.0, 0, lambda _: None)) == 1
