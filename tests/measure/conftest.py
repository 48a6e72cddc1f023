"""One run of the synthetic camera, merged once for all tests of this folder."""

import json
from collections.abc import Iterator

import numpy as np
import pytest
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
