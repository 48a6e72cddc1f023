"""Fixtures of this folder."""

from functools import lru_cache

import pytest

from flarewright.optics.diffraction import fraunhofer


@pytest.fixture(scope="session", autouse=True)
def _patterns_are_kept():
    """Keep more patterns of openings than a program needs at once: each is a transform of 4096 x 4096 samples."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fraunhofer, "_pattern", lru_cache(maxsize=16)(fraunhofer._pattern.__wrapped__))
        yield
