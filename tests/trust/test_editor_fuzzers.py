"""A few seeds of the editor's fuzzers; the rig runs more."""

import pytest

pytest.importorskip("starlette", reason="the extra ui is not installed")
pytest.importorskip("websockets", reason="the extra ui is not installed")

from . import editor_posts, socket_messages


@pytest.mark.slow
@pytest.mark.parametrize("trial", [editor_posts.run, socket_messages.run])
def test_the_editor_holds(trial):
    fallen = [verdict for verdict in map(trial, range(60)) if not verdict.held]
    assert fallen == []
