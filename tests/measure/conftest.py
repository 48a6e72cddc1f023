"""Fixtures: one run of the synthetic camera, merged once for all tests of this folder."""

import json
from collections.abc import Iterator

import numpy as np
import pytest
from measured_run import SETUP, Measured, Staged
from planted_run import LARGEST, SMALL_GHOSTS, write_small
from synthetic_camera import make

from flarewright.io.measurement.captures import read_camera, read_captures
from flarewright.measure.core.parameters import rescaled
from flarewright.measure.pipeline.merge_stage import merge_captures


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    photographs = make(SETUP, tmp_path_factory.mktemp("photographs"))
    folder = tmp_path_factory.mktemp("run")
    captures = read_captures(photographs / "captures.csv")
    run = merge_captures(captures, photographs, folder, camera=read_camera(photographs / "camera.json"))
    return Measured(photographs, folder, json.loads((photographs / "truth.json").read_text()), run)


@pytest.fixture(scope="session")
def staged(tmp_path_factory: pytest.TempPathFactory) -> Staged:
    """Return a small run with all its stages; a test must copy the folder before it changes files."""
    from flarewright.measure.core.checkpoint import Journal
    from flarewright.measure.detection import matching_pursuit
    from flarewright.workflow.measure_provenance import STAGES
    from flarewright.workflow.measure_run import run_stages

    folder, steps, facts = tmp_path_factory.mktemp("staged"), {}, {}
    ghost = rescaled(SMALL_GHOSTS[0], 0.7)
    write_small(folder, (ghost,), angles=np.linspace(2.0, LARGEST, 4), size=(84, 56))
    done = []

    def counted(self, make, real=Journal.step):
        done.append(make)
        return real(self, make)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matching_pursuit, "_crescents", lambda *_: [])
        patch.setattr(Journal, "step", counted)
        for stage in STAGES:
            # only the last stage fits the residual
            facts |= {each.stage: each for each in run_stages(folder, [stage], residual=stage == STAGES[-1])}
            steps[stage] = len(done) - sum(steps.values())
    return Staged(folder, facts, steps)


@pytest.fixture(scope="module")
def no_crescents() -> Iterator[None]:
    """Skip the crescent search, the most expensive part, for runs without crescents (`test_crescents` tests it)."""
    from flarewright.measure.detection import matching_pursuit

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matching_pursuit, "_crescents", lambda *_: [])
        yield
