"""A few seeds of the editor's fuzzers; the rig runs more."""

import pytest

pytest.importorskip("starlette", reason="the extra ui is not installed")
pytest.importorskip("websockets", reason="the extra ui is not installed")

from flarewright.editor.preview import render_picture
from flarewright.editor.server.access import Guard

from . import foreign_account, hostile_page, posts, sockets


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch):
    """Draw as small as the editor that is tried sets for good; other tests have their size back."""
    monkeypatch.setattr(render_picture, "WIDEST", 96)
    monkeypatch.setattr(render_picture, "HIGHEST", 54)


@pytest.mark.slow
@pytest.mark.parametrize("trial", [posts.run, sockets.run])
def test_the_editor_holds(trial):
    fallen = [verdict for verdict in map(trial, range(60)) if not verdict.held]
    assert fallen == []


@pytest.mark.browser
def test_a_hostile_page_is_refused_and_the_rig_sees_an_open_door(monkeypatch):
    verdicts = list(map(hostile_page.run, range(4)))
    if verdicts[0].skipped:
        pytest.skip(verdicts[0].remark)
    assert all(verdict.held for verdict in verdicts), verdicts
    # an editor that admits every page
    monkeypatch.setattr(Guard, "_objection", lambda *_: None)
    assert not all(verdict.held for verdict in map(hostile_page.run, range(4)))


@pytest.mark.slow
def test_another_account_is_refused_and_the_rig_sees_an_open_door():
    verdict = foreign_account.run(0)
    if verdict.skipped:
        pytest.skip(verdict.remark)
    assert verdict.held, verdict
    folder, _, _ = foreign_account._editor()
    token = folder / "state" / "editor-token"
    token.chmod(0o644)
    try:
        assert foreign_account.run(1).remark == f"read {token}"
    finally:
        token.chmod(0o600)
