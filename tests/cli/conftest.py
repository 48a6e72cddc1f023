"""Fixtures of the tests of commands."""

import pytest

from flarewright.design.problem import impossible
from flarewright.design.results import report
from flarewright.design.solvers import pool_search


@pytest.fixture
def plain(monkeypatch):
    """Write no pictures and no page, and prove no target impossible: that follows from lenses and targets, slowly."""
    for name, value in (("_draft", None), ("target_pictures", [None]), ("found_pictures", [None]), ("png_bytes", b"")):
        monkeypatch.setattr(report, name, lambda *_, value=value: value)
    monkeypatch.setattr(report, "html_page", lambda *_, **__: "")
    monkeypatch.setattr(impossible, "_out_of_reach", lambda _: ())


@pytest.fixture
def short_rounds(monkeypatch):
    """Make the rounds of a search short; it proposes from its pools soon."""
    monkeypatch.setattr(pool_search, "batch_size", lambda _: 4)
    monkeypatch.setattr(pool_search, "FIRST", 8)
