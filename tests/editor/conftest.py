"""Fixtures of the editor's tests: isolated state, small pictures, and skips where the extra is not installed."""

from importlib.util import find_spec

import pytest
from sample import few_ghosts

from flarewright.editor.common.latest_job import Lane
from flarewright.editor.preview import draft_calibration, render_picture
from flarewright.editor.preview.ghost_picking import see
from flarewright.model import Camera, Iris, Light, Output, Preset, Project, Quality

collect_ignore = [] if find_spec("starlette") else ["test_editor_server.py"]


@pytest.fixture(autouse=True)
def _own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(tmp_path / "state"))
    monkeypatch.setattr("flarewright.editor.session.session.sample_project", few_ghosts)


@pytest.fixture
def project():
    return Project(
        lens="heliar-tronnier", f_number=8.0, iris=Iris(blades=6), coating=Preset(name="thesis"),
        lights=(Light(field_deg=(6.0, 3.0)),), camera=Camera(size_px=(320, 180)),
    )  # fmt: skip


def plainly(project):
    """Return a project without starburst and rings, at few wavelengths, with half the ghosts.

    These make a picture slow.
    """
    return project.replace(
        output=Output(starburst=False), quality=Quality(wavelengths=3, ringing="off", paths="same-side")
    )


_drawn = {}
"""Pictures drawn by small screens in this process, as nearly every test starts with the same picture."""


def drawn_once(draw):
    """Return a cached version of a function that draws a project or its ghosts."""

    def known(project, *words, progress=None, **more):
        # `see` takes its progress as the third argument
        words, last = (words[:1], words[1:]) if draw.__name__ == "see" else (words, ())
        reported = [each.model_dump_json() if hasattr(each, "model_dump_json") else each for each in words]
        key = (
            draw.__name__,
            project.model_dump_json(),
            *reported,
            *sorted(more.items()),
            render_picture.WIDEST,
            render_picture.HIGHEST,
        )
        if key not in _drawn:
            _drawn[key] = draw(project, *words, *last, **({} if last else {"progress": progress}), **more)
        return _drawn[key]

    return known


@pytest.fixture(params=["small", pytest.param("full", marks=pytest.mark.slow)])
def screen_size(request, monkeypatch):
    """Make the viewport a fifth as wide, projects plain, and calibrate drafts at one angle; full size in slow tests.

    Return a function that simplifies a project accordingly.
    """
    lanes = []

    def lane(name):
        lanes.append(Lane(name))
        return lanes[-1]

    monkeypatch.setattr("flarewright.editor.preview.viewport.Lane", lane)
    monkeypatch.setattr("flarewright.editor.design.search_job.Lane", lane)
    small = request.param == "small"
    if small:
        monkeypatch.setattr(render_picture, "WIDEST", 192)
        monkeypatch.setattr(render_picture, "HIGHEST", 108)
        monkeypatch.setattr(draft_calibration, "ANGLES_DEG", (20.0,))
        monkeypatch.setattr("flarewright.editor.session.session.sample_project", lambda: plainly(few_ghosts()))
        monkeypatch.setattr(render_picture, "take", drawn_once(render_picture.take))
        for module in ("draft_calibration", "progressive_render"):
            monkeypatch.setattr(f"flarewright.editor.preview.{module}.see", drawn_once(see))
    yield plainly if small else lambda project: project
    # pending drawing must not take time from the next test
    for each in lanes:
        each.close()
        assert each.wait(60.0)


@pytest.fixture
def shot(screen_size, project):
    """Return the project, simplified for the size of the screen."""
    return screen_size(project)


@pytest.fixture(scope="module")
def chrome():
    # tests without the extras skip before they request it
    from chromium import browser

    with browser() as found:
        yield found


@pytest.fixture
def tab(chrome, tmp_path):
    """Return a page with its own editor."""
    from chromium import Editor, Tab

    editor = Editor(tmp_path / "state")
    context = chrome.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True)
    try:
        yield (opened := Tab(context.new_page(), editor))
    finally:
        # also if the page did not open: an editor would run forever
        context.close()
        editor.end()
    # the browser logs every answer 400; the page has shown its message
    assert [said for said in opened.said if "400" not in said] == []
    # no request leaves the computer
    assert {url.split("/")[2] for url in opened.asked if not url.startswith(("blob:", "data:"))} <= {
        editor.address.split("/")[2]
    }
