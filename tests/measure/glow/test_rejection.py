"""Residual glow around the light is distinguished from ghosts."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import SIZE, shape, views

from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.glow.rejection import (
    is_residual_glow,
    with_glow_among_removed,
    with_glow_unwanted,
    without_glow,
)
from flarewright.measure.glow.subtraction import AROUND_LIGHT

# distance of the light from the axis at field 1, pixels
WAY = 70.0
ANGLES = np.linspace(1.0, 24.0, 12)
LAST = len(ANGLES) - 1


def views_with_glow(glow, ghosts=()):
    """Return views of a uniform glow and ghosts, with a moving light."""
    out = []
    for view in views(ghosts, angles=ANGLES, noise=1e-4):
        x, y, cosine, sine, _ = view.frame
        away = WAY * view.sigma
        at = x + away * cosine, y - away * sine
        out.append(replace(view, light_px=at, pixels=view.pixels + np.float32(glow)))
    return out


def found(speed, size, level, first=0, last=LAST):
    one = shape(speed, size, level)
    return DetectedGhost((one, one, one), first, last)


@pytest.mark.parametrize(
    ("ghost", "is_glow"),
    [
        (found(WAY, 40.0, 0.05), True),
        # too bright for an error of the glow
        (found(WAY, 40.0, 0.3), False),
        # its centre moves away from the light
        (found(0.9 * WAY, 40.0, 0.05), False),
        (found(-WAY, 40.0, 0.05), False),
        # fixed around the axis, and the light is inside it at small constellations
        (found(0.0, 40.0, 0.05), False),
        # very faint, so a small offset is allowed
        (found(0.93 * WAY, 70.0, 0.012), True),
        (found(0.93 * WAY, 70.0, 0.05), False),
        # a negligible fraction of the light at any offset
        (found(-WAY, 20.0, 0.002), True),
        (found(-WAY, 20.0, 0.05), False),
        # bright, but nearly all of it in the masked disc
        (found(WAY, 1.2 * AROUND_LIGHT * SIZE[0], 2.0), True),
        (found(0.5 * WAY, 1.2 * AROUND_LIGHT * SIZE[0], 2.0), False),
    ],
)
def test_residual_glow_moves_with_the_light_and_is_faint_or_hidden(ghost, is_glow):
    assert is_residual_glow([ghost], views_with_glow(1.0, ghost.shapes[:1])) == [is_glow]


def test_only_the_views_of_a_ghost_decide():
    # the light is near the axis in the first views, so the ghost surrounds it there, and far away in the last ones
    ghosts = [found(WAY, 40.0, 0.05), found(0.5 * WAY, 40.0, 0.05, 0, 2), found(WAY, 40.0, 0.05, 6, 11)]
    assert is_residual_glow(ghosts, views_with_glow(1.0)) == [True, False, True]


def test_a_ghost_without_measured_pixels_is_rejected():
    dark = [replace(view, variance=np.full_like(view.variance, np.inf)) for view in views_with_glow(1.0)]
    assert is_residual_glow([found(-WAY, 20.0, 1.0)], dark) == [True]


def test_ghosts_detected_at_the_light_are_unwanted():
    at_light, bright, away, faint = (
        found(*each) for each in ((WAY, 40.0, 0.05), (WAY, 40.0, 0.3), (-WAY, 40.0, 0.05), (-WAY, 20.0, 0.002))
    )
    detected = [at_light, bright, away, faint, replace(away, unwanted=True)]
    marked = with_glow_unwanted(detected, views_with_glow(1.0, bright.shapes[:1]))
    assert all(now.shapes is before.shapes for now, before in zip(marked, detected, strict=True))
    # a faint one away from the light is judged after its fit
    assert [ghost.unwanted for ghost in marked] == [True, False, False, False, True]


@pytest.mark.parametrize(
    ("ghost", "stays"),
    [
        # beside the light, where the residual glow has 1.25 times its light
        (found(0.85 * WAY, 40.0, 0.04), False),
        (found(0.85 * WAY, 40.0, 0.06), True),
        # as faint, far from the residual glow
        (found(-WAY, 40.0, 0.04), True),
    ],
)
def test_a_ghost_that_residual_glow_outshines_where_it_lies_is_part_of_it(ghost, stays):
    glow = replace(found(WAY, 60.0, 0.05), unwanted=True)
    shown = views_with_glow(1.0)
    assert without_glow([ghost], shown) == [ghost]
    assert without_glow([glow, ghost], shown) == ([ghost] if stays else [])


@pytest.mark.parametrize(("removed", "stays"), [(found(-WAY, 40.0, 0.8), True), (found(WAY, 60.0, 0.05), False)])
def test_a_ghost_that_the_user_removed_takes_no_other_with_it(removed, stays):
    """All ghosts that were fainter than a removed one where it lies were left out, unnoticed."""
    faint = found(removed.shapes[1].numbers[0] * 0.85, 20.0, 0.04)
    shown = views_with_glow(1.0, (removed.shapes[1], faint.shapes[1]))
    marked = with_glow_among_removed([replace(removed, unwanted=True), faint], shown)
    assert [ghost.glow for ghost in marked] == [not stays, False]
    assert without_glow(marked, shown) == (marked[1:] if stays else [])
