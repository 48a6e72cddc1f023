"""Search for ghosts too small to show a rim, by their contrast."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, NOISE, SIZE, shape, views

from flarewright.measure.detection.blobs import blobs
from flarewright.measure.detection.matching_pursuit import pursue
from flarewright.measure.detection.settings import PursuitSettings

BLOB = shape(70.0, 1.1, 6.0, bend=-5.0)
FEW = np.linspace(1.0, LARGEST, 10)


def everywhere(shown):
    return [np.ones(view.pixels.shape[:2], bool) for view in shown]


def looked_at(shown):
    return blobs(shown, [view.pixels[..., 1] for view in shown], everywhere(shown))


@pytest.mark.parametrize("roll_deg", [0.0, 130.0])
def test_a_blob_among_large_ghosts_is_found(roll_deg):
    best = looked_at(views((*GHOSTS, BLOB), roll_deg=roll_deg))[0]
    assert best.speed == pytest.approx(70.0, abs=1.5)
    assert best.bend == pytest.approx(-5.0, abs=2.0)
    assert best.last - best.first > 18


@pytest.mark.parametrize("ghosts", [GHOSTS, ()])
def test_neither_rims_nor_noise_are_blobs(ghosts):
    assert all(one.score < 3.0 * PursuitSettings().score for one in looked_at(views(ghosts)))


def test_unmeasured_pixels_yield_no_blob():
    shown = views((BLOB,), angles=FEW[:3])
    hidden = [np.zeros(view.pixels.shape[:2], bool) for view in shown]
    assert blobs(shown, [view.pixels[..., 1] for view in shown], hidden) == []


@pytest.mark.parametrize("others", [GHOSTS[1:2], pytest.param(GHOSTS[1:3], marks=pytest.mark.slow)])
def test_a_blob_is_fitted(others, no_crescents):
    shown = views((*others, BLOB), angles=FEW[::2], size=(240, 110))
    found = pursue(shown, everywhere(shown), most=len(others) + 1)
    best = min(found, key=lambda ghost: abs(ghost.shapes[1].numbers[0] - 70.0))
    numbers = best.shapes[1].numbers
    assert numbers[0] == pytest.approx(70.0, abs=0.3)
    assert numbers[3] == pytest.approx(-5.0, abs=0.5)
    assert numbers[10] == pytest.approx(1.1, abs=0.2)
    assert (best.first, best.last) == (0, len(shown) - 1)


@pytest.mark.slow
def test_a_blob_is_fitted_near_unexplained_light(no_crescents):
    """The surroundings are brighter: a fit that includes them drifts there, or explains too little of the light."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    unknown = (20.0 * NOISE * np.sin(x / 5.0) * np.cos(y / 4.0))[..., None]
    planted = views((shape(70.0, 1.1, 1.0, bend=-5.0),), angles=FEW)
    shown = [replace(view, pixels=(view.pixels + unknown).astype(np.float32)) for view in planted]
    numbers = pursue(shown, everywhere(shown), most=1)[0].shapes[1].numbers
    assert numbers[0] == pytest.approx(70.0, abs=0.5)
    assert numbers[3] == pytest.approx(-5.0, abs=0.5)
    assert numbers[10] == pytest.approx(1.1, abs=0.3)
