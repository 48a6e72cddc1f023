"""Compiling ahead of the first render."""

from flarewright.cli.app import run
from flarewright.kernels import first_run


def test_what_is_missing_is_compiled_and_told(monkeypatch, capsys):
    """In this process too: where no helper may start, on one core, it is all there is."""
    missing, compiled = ["row sums", "pixels"], []
    monkeypatch.setattr(first_run, "absent", lambda _: [name for name in missing if name not in compiled])
    monkeypatch.setattr(first_run, "compile_together", lambda names, *_: compiled.append(names[0]))
    monkeypatch.setattr(first_run, "compile_roots", compiled.extend)
    assert run(["warm-up"]) == 0
    assert compiled == missing
    said = capsys.readouterr()
    assert said.out == ""
    assert "compiling 2 kernels" in said.err
    assert "compiled in" in said.err
    assert run(["warm-up"]) == 0
    assert "all kernels are compiled already" in capsys.readouterr().err
