"""The veiling glare of a lens that scatters resumes after an interruption, with the same number."""

from __future__ import annotations

import json

from flarewright.cli.app import run
from flarewright.render.scattering import veiling_glare

COMMAND = ["ghosts", "triplet-pestrecov", "--light", "5,0", "--fstop", "16", "--paths", "same-side"]
COMMAND += ["--glare", "--scatter", "abg"]


def test_the_glare_resumes_to_the_same_number(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    # this tests what is kept, not the light: some number for each direction
    asked, most = [], [1000]

    def light(_lens, _shot, _tables, angle, _pool):
        if len(asked) == most[0]:
            raise KeyboardInterrupt
        asked.append(angle)
        return angle / 3.0

    monkeypatch.setattr(veiling_glare, "_scattered_from", light)
    assert run([*COMMAND, "--json"]) == 0
    whole, every = json.loads(capsys.readouterr().out)["veiling_glare"], len(asked)
    assert every == veiling_glare.INNER_NODES + veiling_glare.OUTER_NODES
    asked.clear()
    most[0] = 15
    assert run([*COMMAND, "--json"]) == 130
    assert "the same command resumes" in capsys.readouterr().err
    asked.clear()
    most[0] = 1000
    assert run([*COMMAND, "--json"]) == 0
    found = capsys.readouterr()
    assert "resuming after 15 directions" in found.err
    assert json.loads(found.out)["veiling_glare"] == whole
    assert len(asked) == every - 15
    assert list((tmp_path / "state" / "partial").iterdir()) == []
