"""Flags that replace the golden layers; a replacement needs a reason.

`pytest tests/golden --update-golden --reason "why the pictures changed"` (name the folder, or pytest reads this file
too late to know the flags).
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

REASONS = Path(__file__).parent / "REASONS.md"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="replace the golden layers; needs --reason")
    parser.addoption("--reason", default="", help="why the golden layers change; kept in tests/golden/REASONS.md")


@pytest.fixture(scope="session")
def updating(request: pytest.FixtureRequest) -> bool:
    """Return whether to replace the layers, and record the reason; raise an error without one."""
    # the flags are not registered when the whole suite runs
    if not request.config.getoption("--update-golden", default=False):
        return False
    reason = " ".join(request.config.getoption("--reason").split())
    if len(reason.split()) < 3:
        pytest.exit('golden layers change for a reason: add --reason "what changed, and why the new ones are right"', 2)
    with REASONS.open("a", encoding="utf-8") as stream:
        stream.write(f"- {datetime.now(UTC):%Y-%m-%d}: {reason}\n")
    return True
