"""The corpus of sixty foreign lens files: each is imported or rejected with a reason, and imported ones render."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flarewright.errors import LensError
from flarewright.model import Camera, Iris, Light, Output, Project, Quality
from flarewright.render.render import render
from flarewright.render.scene.resolve import load_lens

FOLDER = Path(os.environ.get("FLAREWRIGHT_CORPUS", Path(__file__).parents[3] / "shared" / "lens_corpus"))
FILES = sorted(FOLDER.glob("**/*.lens"))

pytestmark = pytest.mark.skipif(not FILES, reason=f"no lens corpus at {FOLDER}; set FLAREWRIGHT_CORPUS to its folder")


@cache
def verdict(path: Path):
    """Return the lens, or the reason for rejecting the file."""
    try:
        return load_lens(path), ""
    except LensError as error:
        return None, str(error)


def imported(path: Path):
    a_lens, reason = verdict(path)
    if a_lens is None:
        # a full reason
        assert len(reason.split()) >= 6
        pytest.skip(f"refused: {reason.splitlines()[0][:100]}")
    return a_lens


def picture(a_lens, *fields, **quality) -> dict:
    project = Project(
        lens=a_lens,
        # the starburst of a round opening is the cheapest one
        iris=Iris(),
        lights=tuple(Light(field_deg=field) for field in fields),
        camera=Camera(size_px=(64, 36)),
        quality=Quality(**quality),
        output=Output(layers="passes"),
    )
    return {layer.name: layer.pixels for layer in render(project).layers}


def test_the_corpus_is_whole():
    assert len(FILES) == 60
    verdicts = [verdict(path) for path in FILES]
    assert all(a_lens is not None or reason for a_lens, reason in verdicts)
    # most are camera lenses; some are damaged or not lenses
    assert sum(a_lens is not None for a_lens, _ in verdicts) >= 40


def a_twentieth(first: int) -> list:
    """Return all files; 19 of 20 are slow. `test_the_corpus_is_whole` reads all of them in every run."""
    return [
        pytest.param(path, marks=() if k % 20 == first else pytest.mark.slow, id=path.stem)
        for k, path in enumerate(FILES)
    ]


@pytest.mark.parametrize("path", a_twentieth(1))
def test_what_is_imported_renders(path):
    """Draft quality: finite everywhere, with a direct image."""
    layers = picture(imported(path), (0.0, 0.0), mode="draft", wavelengths=3)
    for name, pixels in layers.items():
        assert np.isfinite(pixels).all(), name
    # white light: the direct image is there, and its luminance positive
    assert layers["starburst"].max() > 0.0
    assert layers["ghosts"].sum() > 0.0


@pytest.mark.parametrize("path", a_twentieth(3))
def test_what_is_imported_renders_oblique_light(path):
    """Two more angles in one picture: a sum stays non-finite if one of them is."""
    for name, pixels in picture(imported(path), (8.0, 5.0), (-17.0, 3.0), mode="draft", wavelengths=3).items():
        assert np.isfinite(pixels).all(), name


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES[::7], ids=lambda path: path.stem)
def test_a_handful_renders_at_final_quality(path):
    a_lens = imported(path)
    for field in ((0.0, 0.0), (8.0, 5.0), (-17.0, 3.0)):
        layers = picture(a_lens, field, mode="final", wavelengths=3)
        assert all(np.isfinite(pixels).all() for pixels in layers.values())
        draft = picture(a_lens, field, mode="draft", wavelengths=3)
        if field == (0.0, 0.0):
            # rays and matrices agree about the direct image, and roughly about the ghosts
            assert layers["starburst"].sum() == pytest.approx(draft["starburst"].sum(), rel=1e-4)
            assert 0.02 < layers["ghosts"].sum() / draft["ghosts"].sum() < 50.0
