"""A search in a folder as a library call: files, and the state that resumes."""

from __future__ import annotations

from contextlib import nullcontext

import pytest

from flarewright import Camera, Design, GhostTarget, Light, OutputError, Project
from flarewright.design.solvers import pool_search
from flarewright.design.solvers.pool_search import PoolState
from flarewright.workflow import SearchLimits, search_in_folder
from flarewright.workflow.searches.search_folder import search_to_resume


@pytest.fixture(autouse=True)
def short_rounds(monkeypatch):
    monkeypatch.setattr(pool_search, "batch_size", lambda _: 4)


def project(**design):
    return Project(
        lens="heliar-tronnier", f_number=16, lights=(Light(field_deg=(7.0, 3.0)),), camera=Camera(size_px=(48, 32)),
        design=Design(ghost_targets=(GhostTarget(ghost="4-1", height=1.001),), **design),
    )  # fmt: skip


def test_a_cancelled_search_is_whole_in_its_folder_and_resumes(tmp_path, capsys):
    folder, seen = tmp_path / "found", []
    found = search_in_folder(
        project(), folder, search_to_resume(folder, project(), 3), SearchLimits(searches=1000, lenses=1),
        cancelled=lambda: len(seen) > 0, display=lambda unit: nullcontext(seen.append),
    )  # fmt: skip
    assert found.cut_off
    assert 0 < found.search.state.searches < 1000
    assert found.summary["searches"] == found.search.state.searches
    assert {"search.json", "project.toml", "report.html"} <= {path.name for path in folder.iterdir()}
    resumed = search_to_resume(folder, project(), 3)
    assert (resumed.searches, resumed.seed) == (found.search.state.searches, 3)
    for other, seed in ((project(surfaces=8), 3), (project(), 4)):
        with pytest.raises(OutputError, match="holds the search of another model"):
            search_to_resume(folder, other, seed)
    assert capsys.readouterr() == ("", "")


def test_a_new_folder_starts_a_search(tmp_path):
    assert search_to_resume(tmp_path / "new", project(), 5) == PoolState(5)


def test_two_searches_at_once_do_not_share_a_folder(tmp_path):
    """The second one began before the first was stored, and both wrote the same files."""
    folder, refused = tmp_path / "found", []

    def meanwhile(_state):
        with pytest.raises(OutputError, match="another process searches into "):
            search_in_folder(project(), folder, PoolState(4), SearchLimits(searches=4, lenses=1))
        refused.append(True)

    search_in_folder(
        project(), folder, PoolState(3), SearchLimits(searches=1000, lenses=1), cancelled=lambda: bool(refused),
        display=lambda unit: nullcontext(meanwhile),
    )  # fmt: skip
    assert refused
    assert not (folder / ".search.lock").exists()
    assert search_to_resume(folder, project(), 3).seed == 3
