"""Compilation before the first render."""

from flarewright.cli.app import run
from flarewright.kernels.jit import warmup


def test_missing_kernels_are_compiled_and_reported(monkeypatch, capsys):
    """Also in this process: on one core, where no helper may start, it is the only way."""
    missing, compiled = ["sum_rows", "collect"], []
    monkeypatch.setattr(warmup, "absent", lambda _: [name for name in missing if name not in compiled])
    monkeypatch.setattr(warmup, "compile_together", lambda names, *_: compiled.append(names[0]))
    monkeypatch.setattr(warmup, "compile_roots", compiled.extend)
    assert run(["warm-up"]) == 0
    assert compiled == missing
    said = capsys.readouterr()
    assert said.out == ""
    assert "compiling 2 kernels" in said.err
    assert "compiled in" in said.err
    assert run(["warm-up"]) == 0
    assert "all kernels are compiled already" in capsys.readouterr().err
