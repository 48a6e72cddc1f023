"""What halo and star leave around the light is told from ghosts."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import SIZE, shape, views

from flarewright.measure.dimmed import AROUND_LIGHT
from flarewright.measure.found import Found
from flarewright.measure.glow_left import glow_left

# where the light is at field 1, pixels from the axis
WAY = 70.0
ANGLES = np.linspace(1.0, 24.0, 12)
LAST = len(ANGLES) - 1


def seen_beside(glow, ghosts=()):
    """Return views of an even glow and ghosts, in which the light goes along."""
    out = []
    for view in views(ghosts, angles=ANGLES, noise=1e-4):
        x, y, cosine, sine, _ = view.frame
        away = WAY * view.sigma
        at = x + away * cosine, y - away * sine
        out.append(replace(view, light_px=at, pixels=view.pixels + np.float32(glow)))
    return out


def found(speed, size, level, first=0, last=LAST):
    one = shape(speed, size, level)
    return Found((one, one, one), first, last)


@pytest.mark.parametrize(
    ("ghost", "is_glow"),
    [
        (found(WAY, 40.0, 0.05), True),
        # too bright for an error of the glow
        (found(WAY, 40.0, 0.3), False),
        # its middle leaves the light
        (found(0.9 * WAY, 40.0, 0.05), False),
        (found(-WAY, 40.0, 0.05), False),
        # stands still around the axis, and the light is within it at small constellations
        (found(0.0, 40.0, 0.05), False),
        # barely there, it may be a little off
        (found(0.93 * WAY, 70.0, 0.012), True),
        (found(0.93 * WAY, 70.0, 0.05), False),
        # next to nothing of the light that is there, wherever it is
        (found(-WAY, 20.0, 0.002), True),
        (found(-WAY, 20.0, 0.05), False),
        # bright, but nearly all of it where nothing is looked for
        (found(WAY, 1.2 * AROUND_LIGHT * SIZE[0], 2.0), True),
        (found(0.5 * WAY, 1.2 * AROUND_LIGHT * SIZE[0], 2.0), False),
    ],
)
def test_glow_goes_with_the_light_and_is_faint_or_hidden(ghost, is_glow):
    assert glow_left([ghost], seen_beside(1.0, ghost.shapes[:1])) == [is_glow]


def test_each_ghost_is_told_by_the_views_that_show_it():
    # only in the first views, where the light is next to the axis, as if around it; in the last ones it is far off
    ghosts = [found(WAY, 40.0, 0.05), found(0.5 * WAY, 40.0, 0.05, 0, 2), found(WAY, 40.0, 0.05, 6, 11)]
    assert glow_left(ghosts, seen_beside(1.0)) == [True, False, True]


def test_a_ghost_that_no_pixel_shows_is_none():
    dark = [replace(view, variance=np.full_like(view.variance, np.inf)) for view in seen_beside(1.0)]
    assert glow_left([found(-WAY, 20.0, 1.0)], dark) == [True]
