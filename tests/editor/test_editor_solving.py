"""What a search says in the editor; the search itself is tried in tests/design and in the browser."""

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
    solver.start(0.1, 0.0)
    solver._thread.join(60.0)
    assert not solver.progress.running
    assert solver.progress.words.startswith("No lens was found" if possible else "No lens can do that: wish 0")
