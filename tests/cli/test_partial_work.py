"""Finished parts of a command: beside its output, or in the state folder for a command without one."""

from __future__ import annotations

from contextlib import suppress

import pytest

from flarewright.cli.partial_work import partial_work


def draw(output, inputs, most):
    """Run a command of four parts that is interrupted after some new ones; return its parts, and how many are new."""
    new, found = [], []

    def make(k):
        if len(new) == most:
            raise KeyboardInterrupt
        new.append(k)
        return k * 0.1

    with suppress(KeyboardInterrupt), partial_work(output, inputs, "part", "parts") as steps:
        for k in range(4):
            found.append(steps.step(lambda k=k: make(k)))
    return found, len(new)


@pytest.mark.parametrize("named", [True, False])
def test_a_command_resumes_with_its_finished_parts(named, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    output = tmp_path / "out.png" if named else None
    whole, _ = draw(output, ["a"], 4)
    folder = tmp_path if named else tmp_path / "state" / "partial"
    assert list(folder.glob("*.json")) == []
    draw(output, ["a"], 3)
    (kept,) = folder.glob("*.json")
    capsys.readouterr()
    assert draw(output, ["a"], 4) == (whole, 1)
    assert capsys.readouterr().err == f"flarewright: {kept}: resuming after 3 parts of an interrupted run\n"
    assert list(folder.glob("*.json")) == []


def test_parts_of_other_inputs_are_dropped_with_one_sentence(tmp_path, capsys):
    output = tmp_path / "out.png"
    draw(output, ["a"], 3)
    capsys.readouterr()
    assert draw(output, ["b"], 4)[1] == 4
    kept = tmp_path / "out.partial.json"
    assert capsys.readouterr().err == f"flarewright: {kept} belongs to other settings; its steps are repeated\n"


def test_a_state_folder_that_cannot_be_written_costs_one_sentence(tmp_path, monkeypatch, capsys):
    (tmp_path / "state").write_text("a file of the user")
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    assert draw(None, ["a"], 4)[1] == 4
    said = capsys.readouterr().err
    assert said.startswith("flarewright: no checkpoint: cannot write ")
    assert said.count("\n") == 1
