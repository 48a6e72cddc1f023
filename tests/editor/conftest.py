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


@pytest.fixture(scope="module")
def chrome():
    # those without the extras skip before they ask for it
    from chromium import browser

    with browser() as found:
        yield found


@pytest.fixture
def tab(chrome, tmp_path):
    """A page with an editor of its own."""
    from chromium import Editor, Tab

    editor = Editor(tmp_path / "state")
    context = chrome.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    yield (opened := Tab(context.new_page(), editor))
    context.close()
    editor.end()
    # the browser tells of every answer 400 by itself; the page told it in words
    assert [said for said in opened.said if "400" not in said] == []
    # no request leaves the machine
    assert {url.split("/")[2] for url in opened.asked if not url.startswith(("blob:", "data:"))} <= {
        editor.address.split("/")[2]
    }
