"""One run of the synthetic camera, merged once for all tests of this folder."""

import json

import pytest
from measured_run import SETUP, Measured
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
