"""What the tests of predictions share: the tree of commands is built once, and pictures of pages are small."""

from functools import cache

import pytest
import typer.main


@pytest.fixture(scope="session", autouse=True)
def _one_tree_of_commands():
    """Keep the commands that Typer builds at every call, as `tests/cli/conftest.py` does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        yield


@pytest.fixture(autouse=True)
def _small_pages(monkeypatch):
    """Draw the final pictures of pages small and at 5 wavelengths; curves and veils are judged as ever."""
    monkeypatch.setattr("flarewright.cli.predict_flares.SHOWN_PX", 120)
    monkeypatch.setattr("flarewright.cli.predict_flares.SHOWN_NM", 5)
