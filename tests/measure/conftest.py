"""One run of the synthetic camera, merged once for all tests of this folder."""

import json
import os
import sys
from collections.abc import Iterator
from functools import cache

import pytest

# as for the command line: the program's own threads share the work, and others beside them would spin
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from measured_run import SETUP, Measured, Staged
from planted_run import LARGEST, write_small
from synthetic_camera import make

from flarewright.io.captures import read_camera, read_captures
from flarewright.measure.merge_run import merge_captures


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    photographs = make(SETUP, tmp_path_factory.mktemp("photographs"))
    folder = tmp_path_factory.mktemp("run")
    captures = read_captures(photographs / "captures.csv")
    run = merge_captures(captures, photographs, folder, camera=read_camera(photographs / "camera.json"))
    return Measured(photographs, folder, json.loads((photographs / "truth.json").read_text()), run)


@pytest.fixture(scope="session")
def staged(tmp_path_factory: pytest.TempPathFactory) -> Staged:
    """Return a small run with all its stages: copy the folder before anything in it changes."""
    from flarewright.cli.measure_stages import STAGES, run_stages
    from flarewright.measure import pursuit
    from flarewright.measure.journal import Journal

    folder, steps, facts = tmp_path_factory.mktemp("staged"), {}, {}
    write_small(folder, angles=np.linspace(2.0, LARGEST, 4))
    done = []

    def counted(self, make, real=Journal.step):
        done.append(make)
        return real(self, make)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pursuit, "_lunes", lambda *_: [])
        patch.setattr(Journal, "step", counted)
        for stage in STAGES:
            # what is left beside the ghosts is learned by the last one
            facts |= run_stages(folder, [stage], 1, None, None, False, residual=stage == STAGES[-1])
            steps[stage] = len(done) - sum(steps.values())
    return Staged(folder, facts, steps)


@pytest.fixture(scope="module")
def no_lunes() -> Iterator[None]:
    """Leave out the dearest part of a search where none of what was planted is one (`test_lunes`)."""
    from flarewright.measure import pursuit

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pursuit, "_lunes", lambda *_: [])
        yield


@cache
def built(app):
    return built.as_ever(app)


@pytest.fixture(autouse=True, scope="module")
def _commands_built_once() -> Iterator[None]:
    """Build the command line once: Typer builds all commands again at every call, which takes longer than most."""
    typer = sys.modules.get("typer.main")
    if typer is None:
        yield
        return
    with pytest.MonkeyPatch.context() as patch:
        built.as_ever = typer.get_command
        patch.setattr(typer, "get_command", built)
        yield
