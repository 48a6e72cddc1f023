"""An interrupted analysis of ghosts resumes to the table of an uninterrupted one, from the file that it leaves."""

from __future__ import annotations

import numpy as np
import pytest
from singlet_file import singlet_file

from flarewright.cli.app import run
from flarewright.io.render_state.kept_arrays import read_arrays, write_arrays
from flarewright.optics.rays import ghost_table
from flarewright.render.reference import four_reflections

# stopped down, few rays graze a surface
LIGHT = ("--light", "3,2", "--fstop", "16")
FOUR = (*LIGHT[:2], "--orders", "4", "--order4-limit", "1e-3")


@pytest.fixture
def partial(tmp_path, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    # which parts are kept does not depend on the rays of grazing light, which take most of the time
    monkeypatch.setattr(ghost_table, "MOST_RAYS", 1000)
    return tmp_path / "state" / "partial"


@pytest.fixture
def printed(tmp_path, capsys):
    """Return a function that analyses a lens and returns the exit code, stdout and stderr."""
    lens = singlet_file(tmp_path)

    def call(*words):
        return (run(["ghosts", lens, *words]), *capsys.readouterr())

    return call


def counted(monkeypatch, module, name, most=None):
    """Count the calls of a function; the call after `most` is interrupted."""
    calls, real = [], getattr(module, name)

    def work(*given, **named):
        if most is not None and len(calls) >= most:
            raise KeyboardInterrupt
        calls.append(1)
        return real(*given, **named)

    monkeypatch.setattr(module, name, work)
    return calls


@pytest.mark.parametrize("place", [(ghost_table, "_measure", 2), (four_reflections, "run_batch", 6)])
def test_an_interrupted_analysis_resumes_to_the_same_table(place, partial, printed, monkeypatch):
    module, name, most = place
    with monkeypatch.context() as patch:
        every = counted(patch, module, name)
        _, whole, said = printed(*FOUR, "--csv")
    # a finished command leaves nothing and says nothing of it
    assert list(partial.iterdir()) == []
    assert "partial" not in said
    with monkeypatch.context() as patch:
        counted(patch, module, name, most)
        # the same analysis in another form
        code, _, said = printed(*FOUR, "--json")
    assert code == 130
    assert "the same command resumes" in said
    (kept,) = partial.iterdir()
    with monkeypatch.context() as patch:
        again = counted(patch, module, name)
        code, resumed, said = printed(*FOUR, "--csv")
    assert (code, resumed) == (0, whole)
    assert f"{kept}: resuming with" in said
    assert 0 < len(again) < len(every)
    assert list(partial.iterdir()) == []


def test_a_sweep_resumes_within_a_point(partial, printed, monkeypatch):
    words = (*LIGHT, "--sweep", "field=0,2,4", "--csv")
    with monkeypatch.context() as patch:
        every = counted(patch, ghost_table, "_measure")
        _, whole, _ = printed(*words)
    with monkeypatch.context() as patch:
        counted(patch, ghost_table, "_measure", 3)
        assert printed(*words)[0] == 130
    with monkeypatch.context() as patch:
        again = counted(patch, ghost_table, "_measure")
        code, resumed, _ = printed(*words)
    assert (code, resumed) == (0, whole)
    assert 0 < len(again) < len(every)


@pytest.mark.parametrize(
    ("harm", "sentence"),
    [
        ("emptied", "cannot be read as part of an analysis of ghosts"),
        ("other", "belongs to other settings"),
        ("numbers", "is damaged"),
    ],
)
def test_a_file_that_does_not_fit_is_dropped_with_one_sentence(harm, sentence, partial, printed, monkeypatch):
    _, whole, plain = printed(*LIGHT, "--csv")
    with monkeypatch.context() as patch:
        counted(patch, ghost_table, "_measure", 1)
        printed(*LIGHT, "--csv")
    (kept,) = partial.iterdir()
    about, arrays = read_arrays(kept, "", "")
    if harm == "emptied":
        kept.write_bytes(b"")
    elif harm == "other":
        write_arrays(kept, "other", arrays)
    else:
        write_arrays(kept, about["digest"], {name: np.append(array, 0.0) for name, array in arrays.items()})
    code, found, said = printed(*LIGHT, "--csv")
    assert (code, found) == (0, whole)
    (extra,) = set(said.splitlines()) - set(plain.splitlines())
    assert str(kept) in extra
    assert sentence in extra
    assert extra.endswith("its ghosts are traced again")
    assert list(partial.iterdir()) == []
