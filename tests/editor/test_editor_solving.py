"""What a search says in the editor; the search itself is tried in tests/design and in the browser."""

import threading
import time
from types import SimpleNamespace

import pytest

from flarewright.editor import solving
from flarewright.editor.solving import Solver
from flarewright.model import Design, GhostWish, Light


class _Session:
    def __init__(self, project):
        self.project = project

    def tell(self, event):
        pass


@pytest.mark.parametrize("possible", [True, False])
def test_what_no_lens_can_do_is_told(project, monkeypatch, possible):
    monkeypatch.setattr(solving, "compile_kernels", lambda picture: None)
    monkeypatch.setattr(solving, "solve", lambda *_, **__: SimpleNamespace(searches=3, seconds=0.1))
    monkeypatch.setattr(solving, "outcomes", lambda *_, **__: ())
    wish = GhostWish(place_mm=1.0, radius_mm=1.0) if possible else GhostWish(at_mm=(0.0, 5.0), radius_mm=1.0)
    design = Design(wishes=(wish,), own_ghosts=False)
    solver = Solver(_Session(project.replace(lights=(Light(field_deg=(5.0, 0.0)),), design=design)))
    solver.start(0.1)
    solver._thread.join(60.0)
    assert not solver.progress.running
    assert solver.progress.words.startswith("No lens was found" if possible else "No lens can do that: wish 0")


def test_a_search_that_gets_ready_is_stopped_at_once(project, monkeypatch):
    """The first search of a machine compiles for a minute, which nothing can end: Stop waited for it."""
    compiled, searched = threading.Event(), []
    monkeypatch.setattr(solving, "compile_kernels", lambda picture: compiled.wait(60.0))
    monkeypatch.setattr(solving, "solve", lambda *_, **__: searched.append(1) or SimpleNamespace(searches=1, seconds=0))
    monkeypatch.setattr(solving, "outcomes", lambda *_, **__: ())
    design = Design(wishes=(GhostWish(place_mm=1.0, radius_mm=1.0),), own_ghosts=False)
    solver = Solver(_Session(project.replace(lights=(Light(field_deg=(5.0, 0.0)),), design=design)))
    solver.start(0.1)
    first = solver._thread
    begun = time.perf_counter()
    solver.stop()
    assert time.perf_counter() - begun < 5.0
    assert not solver.progress.running
    assert solver.progress.words.startswith("Stopped")
    # the next one may begin meanwhile, and what was stopped says nothing any more
    solver.start(0.1)
    compiled.set()
    first.join(60.0)
    solver._thread.join(60.0)
    assert searched == [1]
    assert solver.progress.words.startswith("No lens was found")


def test_colours_that_are_found_keep_the_shot_as_it_is(project):
    """Only coatings are new: opening, glass and what was changed meanwhile stay."""
    puts = []
    session = _Session(project.replace(design=Design(wishes=(GhostWish(ghost="8-6", color=(1.0, 0.2, 0.1)),))))
    session.put = lambda found, label: puts.append(found)
    solver = Solver(session)
    solver.start_colors("quarter-wave")
    solver._thread.join(60.0)
    assert len(solver.progress.found) == 1
    session.project = session.project.replace(lights=(Light(field_deg=(5.0, 0.0)),))
    solver.accept(0)
    (found,) = puts
    assert found.coating.kind == "per-row"
    assert found.design is None
    assert found == session.project.replace(coating=found.coating, design=None)
