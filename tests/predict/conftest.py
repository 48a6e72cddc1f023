"""Fixtures of the prediction tests: small pictures in pages."""

from importlib import import_module

import pytest


@pytest.fixture(autouse=True)
def _small_pages(monkeypatch):
    """Draw the final pictures of pages small and at 5 wavelengths; curves and veils keep their full size."""
    # the package has a function of this name
    module = import_module("flarewright.workflow.lens_flares")
    monkeypatch.setattr(module, "SHOWN_PX", 120)
    monkeypatch.setattr(module, "SHOWN_NM", 5)
