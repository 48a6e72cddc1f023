"""Checkpoints of long jobs."""

import threading

from flarewright.errors import OutputError
from flarewright.workflow.kept_work.checkpoints import checkpoints


def test_a_checkpoint_that_cannot_be_written_is_reported_once(monkeypatch):
    monkeypatch.setattr("flarewright.workflow.kept_work.checkpoints.CHECKPOINT_S", 0.0)
    tries, third = [], threading.Event()

    def full():
        tries.append(1)
        if len(tries) == 3:
            third.set()
        raise OutputError("cannot write found/search.json: no space left on device")

    reported: list[str] = []
    with checkpoints(full, reported.append):
        assert third.wait(60.0)
    assert reported == ["no checkpoint: cannot write found/search.json: no space left on device"]
