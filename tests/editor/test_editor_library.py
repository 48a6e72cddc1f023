"""The user's lenses in the editor: listed first, opened by name, drawn in the background."""

import time

import pytest

from flarewright.editor.preview import diagrams
from flarewright.editor.server.thumbnails import ThumbnailMaker
from flarewright.editor.session.files import open_any
from flarewright.editor.session.reach import Reach, files_of
from flarewright.io.lens.lens_writer import write_lens
from flarewright.model import Project
from flarewright.render.scene.resolve import open_lens
from flarewright.workflow.own_library.addition import add_lenses
from flarewright.workflow.own_library.thumbnails import missing_thumbnails, read_thumbnail


@pytest.fixture
def own(tmp_path):
    write_lens(open_lens("triplet-pestrecov").lens, tmp_path / "My Triplet.toml")
    add_lenses([tmp_path / "My Triplet.toml"])
    return "my-triplet"


def test_the_users_lenses_come_before_the_shipped_ones(own):
    first, *others = diagrams.library()
    assert (first["name"], first["own"], first["rows"]) == (own, True, len(open_lens(own).lens.rows))
    assert "my triplet.toml" in first["words"]
    assert {one["own"] for one in others} == {False}
    # the list is current: the page requests it whenever the panel opens
    add_lenses([open_lens("petzval-kodak").path], name="petzval-2")
    assert [one["name"] for one in diagrams.library()[:2]] == [own, "petzval-2"]


def test_a_lens_opens_by_its_name_wherever_the_page_may_read(own, tmp_path):
    project, file = open_any("My Triplet")
    assert (project.lens, file) == (own, None)
    # a file of the library by its path stays out of reach
    reach = Reach((tmp_path / "elsewhere",))
    reach.check_project(Project(lens=own, lights=project.lights))
    assert files_of(project) == ()
    assert files_of(project.replace(lens=str(open_lens(own).path))) != ()


def test_one_process_draws_what_is_missing_and_ends_with_the_editor(own, monkeypatch):
    started = []

    class Child:
        pid, code = 0, None

        def __init__(self, words, **_):
            started.append(words)

        def poll(self):
            return self.code

        def terminate(self):
            self.code = -15

        def wait(self, _timeout_s=None):
            return self.code

    monkeypatch.setattr("subprocess.Popen", Child)
    monkeypatch.setattr("os.setpriority", lambda *_: None, raising=False)
    assert read_thumbnail(own) is None
    maker = ThumbnailMaker()
    maker.ask(own)
    maker.ask("another")
    maker.ask("a third")
    assert [words[-2:] for words in started] == [["--", own]]
    # the next one starts when it has ended and something is still missing
    maker._child.code = 0
    maker.ask("another")
    # the latest request first
    assert started[1][-3:] == ["--", "another", "a third"]
    child = maker._child
    maker.close()
    assert child.code == -15
    maker.ask(own)
    assert len(started) == 2


@pytest.mark.slow
def test_a_real_process_draws_the_thumbnail(own):
    maker = ThumbnailMaker()
    maker.ask(own)
    until = time.monotonic() + 120.0
    while read_thumbnail(own) is None and time.monotonic() < until:
        time.sleep(0.1)
    maker.close()
    assert read_thumbnail(own)[:2] == b"\xff\xd8"
    assert list(missing_thumbnails()) == []
