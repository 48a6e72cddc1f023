"""The editor's tests keep their state to themselves, and say why they skip where the extra is absent."""

from importlib.util import find_spec

import pytest

from flarewright.model import Camera, Iris, Light, Preset, Project

collect_ignore = [] if find_spec("starlette") else ["test_editor_server.py"]


@pytest.fixture(autouse=True)
def _own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))


@pytest.fixture
def project():
    return Project(
        lens="heliar-tronnier", f_number=8.0, iris=Iris(blades=6), coating=Preset(name="thesis"),
        lights=(Light(field_deg=(6.0, 3.0)),), camera=Camera(size_px=(320, 180)),
    )  # fmt: skip
