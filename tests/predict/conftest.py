"""What the tests of predictions share: pictures of pages are small."""

import pytest


@pytest.fixture(autouse=True)
def _small_pages(monkeypatch):
    """Draw the final pictures of pages small and at 5 wavelengths; curves and veils are judged at full size."""
    monkeypatch.setattr("flarewright.cli.predict_flares.SHOWN_PX", 120)
    monkeypatch.setattr("flarewright.cli.predict_flares.SHOWN_NM", 5)
