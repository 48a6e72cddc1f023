"""The editor's tests keep their state to themselves, and say why they skip where the extra is absent."""

from importlib.util import find_spec

import pytest
from sample import few_ghosts

from flarewright.editor import ladder, studio
from flarewright.editor.jobs import Lane
from flarewright.editor.seen import see
from flarewright.model import Camera, Iris, Light, Output, Preset, Project, Quality

collect_ignore = [] if find_spec("starlette") else ["test_editor_server.py"]


@pytest.fixture(autouse=True)
def _own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    monkeypatch.setattr("flarewright.editor.session.sample_project", few_ghosts)


@pytest.fixture
def project():
    return Project(
        lens="heliar-tronnier", f_number=8.0, iris=Iris(blades=6), coating=Preset(name="thesis"),
        lights=(Light(field_deg=(6.0, 3.0)),), camera=Camera(size_px=(320, 180)),
    )  # fmt: skip


def plainly(project):
    """Return a project without a starburst or rings, at few wavelengths: what makes a picture slow."""
    return project.replace(output=Output(starburst=False), quality=Quality(wavelengths=3, ringing="off"))


_drawn = {}
"""What small screens have drawn in this process: nearly every one begins with the same picture."""


def drawn_once(draw):
    """Return what draws a project, be it a picture or its ghosts, and draws the same only once."""

    def known(project, *words, progress=None, **more):
        # `see` is called with its progress in third place
        words, last = (words[:1], words[1:]) if draw.__name__ == "see" else (words, ())
        told = [each.model_dump_json() if hasattr(each, "model_dump_json") else each for each in words]
        key = draw.__name__, project.model_dump_json(), *told, *sorted(more.items()), studio.WIDEST, studio.HIGHEST
        if key not in _drawn:
            _drawn[key] = draw(project, *words, *last, **({} if last else {"progress": progress}), **more)
        return _drawn[key]

    return known


@pytest.fixture(params=["small", pytest.param("full", marks=pytest.mark.slow)])
def screen_size(request, monkeypatch):
    """The viewport a fifth as wide, plain projects, drafts learned at one angle; at full size among the slow tests.

    Returns what makes a project as simple as the size asks for.
    """
    lanes = []

    def lane(name):
        lanes.append(Lane(name))
        return lanes[-1]

    monkeypatch.setattr("flarewright.editor.screen.Lane", lane)
    monkeypatch.setattr("flarewright.editor.solving.Lane", lane)
    small = request.param == "small"
    if small:
        monkeypatch.setattr(studio, "WIDEST", 192)
        monkeypatch.setattr(studio, "HIGHEST", 108)
        monkeypatch.setattr(ladder, "ANGLES_DEG", (20.0,))
        monkeypatch.setattr("flarewright.editor.session.sample_project", lambda: plainly(few_ghosts()))
        monkeypatch.setattr(studio, "take", drawn_once(studio.take))
        for module in ("ladder", "sharpening"):
            monkeypatch.setattr(f"flarewright.editor.{module}.see", drawn_once(see))
    yield plainly if small else lambda project: project
    # what a test leaves undrawn takes no time from the next one
    for each in lanes:
        each.close()
        assert each.wait(60.0)


@pytest.fixture
def shot(screen_size, project):
    """The project as simple as the size of the screen asks for."""
    return screen_size(project)


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
    try:
        yield (opened := Tab(context.new_page(), editor))
    finally:
        # also where the page did not open: an editor left alone goes on for ever
        context.close()
        editor.end()
    # the browser tells of every answer 400 by itself; the page told it in words
    assert [said for said in opened.said if "400" not in said] == []
    # no request leaves the machine
    assert {url.split("/")[2] for url in opened.asked if not url.startswith(("blob:", "data:"))} <= {
        editor.address.split("/")[2]
    }
