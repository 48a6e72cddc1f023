"""Fixtures of the prediction tests: small pictures in pages."""

from importlib import import_module

import pytest


@pytest.fixture(autouse=True)
def _small_pages(monkeypatch):
    """Draw the final pictures of pages small and at 2 wavelengths, and measured flares at half the size.

    Curves and veils of lenses keep their full size.
    """
    # the package has functions of these names
    lens, measured = (import_module(f"flarewright.workflow.{name}_flares") for name in ("lens", "measured"))
    monkeypatch.setattr(lens, "SHOWN_PX", 48)
    monkeypatch.setattr(lens, "SHOWN_NM", 2)
    monkeypatch.setattr(lens, "SIDE_PX", 96)
    monkeypatch.setattr(measured, "SHOWN_PX", 48)
    monkeypatch.setattr(measured, "SIDE_PX", 96)
