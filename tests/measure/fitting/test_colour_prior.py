"""Prior between the colours of a ghost: it holds a faint colour near a bright one, and gives way to clear data."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import LARGEST, SIZE, shape, views

from flarewright.kernels.ghost_model.pupil_mesh import FIRST_DISC, FIRST_G, FIRST_I
from flarewright.measure.core.parameter_vector import Floats
from flarewright.measure.core.parameters import Shape, free_numbers, rescaled
from flarewright.measure.fitting.alternating_fit import fit_all
from flarewright.measure.fitting.colour_prior import expectation, nothing, ties
from flarewright.measure.fitting.detected_ghost import DetectedGhost, channel_noise, leading
from flarewright.measure.fitting.ghost_fit import priors, refine, render
from flarewright.measure.fitting.patches import patches_of
from flarewright.measure.fitting.settings import FitSettings

TRUE = shape(-60.0, 34.0, 0.5)
FREE = free_numbers(1, 0, 1)
FEW = np.linspace(1.0, LARGEST, 5)


def moved(one: Shape, place: float = 0.0, size: float = 0.0, light: float = 1.0) -> Shape:
    """Return a shape moved and enlarged by fractions of its size, with scaled brightness."""
    numbers = one.numbers.copy()
    numbers[0] += place * numbers[FIRST_G]
    numbers[FIRST_G] *= 1.0 + size
    numbers[FIRST_I:FIRST_DISC] *= light
    return Shape(numbers, one.discs)


def coloured(
    colours: tuple[Shape, Shape, Shape],
    beside: Shape | None = None,
    noise: float = 0.01,
    angles: Floats = FEW,
    size: tuple[int, int] = SIZE,
) -> list:
    """Return views of a ghost with different colours, and of another ghost over it in green."""
    seen = []
    for view in views((), noise=noise, angles=angles, size=size):
        light = np.stack([render(each, view) for each in colours], axis=-1)
        if beside is not None:
            light[..., 1] += render(beside, view)
        seen.append(view.showing((view.pixels + light).astype(np.float32)))
    return seen


def off(one: Shape, true: Shape) -> Floats:
    """Return the errors of position and size, pixels."""
    return np.abs(one.numbers[[0, FIRST_G]] - true.numbers[[0, FIRST_G]])


def test_ties_scale_with_the_picture_and_the_size_and_exclude_brightness():
    numbers = np.array([0, 1, FIRST_G, FIRST_I, FIRST_I + 1])
    small, large = (ties(shape(-60.0, size, 0.5), numbers, width, 0) for size, width in ((40.0, 720), (80.0, 1440)))
    assert large[:3] == pytest.approx(small[:3] / 4.0)
    assert not small[3:].any()
    # standard deviations of position and size, pixels, for ghosts of size 2, 100 and 300
    apart = [1.0 / np.sqrt(ties(shape(-60.0, size, 0.5), numbers[[0, 2]], 720, 0)) for size in (2.0, 100.0, 300.0)]
    assert np.array(apart) == pytest.approx(np.array([[2.05, 0.45], [3.5, 1.1], [6.5, 2.5]]), abs=0.05)
    # rims are tied only if the other colour has them
    rim = np.arange(FIRST_DISC, FIRST_DISC + 3)
    cut = shape(-60.0, 34.0, 0.5, rim=(0.9, 1.2))
    assert ties(cut, rim, 720, 1).all()
    assert not ties(cut, rim, 720, 0).any()


def test_the_prior_is_the_weighted_mean_of_0_and_the_other_colour():
    prior = priors(TRUE, FREE, SIZE[0])
    alone = expectation(prior, TRUE, FREE, SIZE[0], 1.0, None)
    assert np.array_equal(alone.weights, prior)
    assert not alone.toward.any()
    other = moved(TRUE, 0.1, 0.05)
    both = expectation(prior, TRUE, FREE, SIZE[0], 3.0, other)
    tied = 3.0 * ties(TRUE, FREE, SIZE[0], 0)
    numbers = TRUE.numbers[FREE]
    # the squares equal those of both priors, up to a constant
    for step in (0.0, 0.3):
        trial = numbers + step
        apart = prior @ trial**2 + tied @ (trial - other.numbers[FREE]) ** 2
        constant = prior @ both.toward**2 + tied @ (both.toward - other.numbers[FREE]) ** 2
        assert both.squares(trial) == pytest.approx(apart - constant, rel=1e-9)
    assert nothing(3).squares(np.ones(3)) == 0.0


def test_a_bright_colour_holds_a_faint_one_near_other_light():
    """Blue is bright; green is faint, and another ghost lies over it half a radius off."""
    blue = rescaled(TRUE, 0.7)
    green, beside = moved(blue, 0.01, -0.005, 0.06), moved(blue, 0.5, 0.0, 0.05)
    small = 168, 112
    seen = coloured((green, green, blue), beside, noise=0.014, angles=np.linspace(1.0, LARGEST, 12), size=small)
    start = moved(green, 0.05, 0.05)
    patches = patches_of(start, seen, 1)
    free, held = (refine(start, patches, FREE, width=small[0], steps=20, like=like).shape for like in (None, blue))
    assert off(free, green).max() > 3.0
    assert off(held, green).max() < 1.0
    assert off(held, green).max() < 0.15 * off(free, green).max()


def test_clear_data_override_the_prior():
    """A difference of a fifth of the size, rare for real glass: a high signal overrides the prior."""
    green, blue = moved(TRUE, 0.2, 0.1), TRUE
    seen = coloured((green, green, blue), noise=0.002)
    patches = patches_of(blue, seen, 1)
    fit = refine(moved(green, 0.02, 0.02), patches, FREE, width=SIZE[0], steps=40, like=blue)
    assert off(fit.shape, green).max() < 0.5


def test_the_leading_colour_has_the_highest_signal_to_noise_ratio():
    ghost = DetectedGhost((moved(TRUE, light=0.4), TRUE, moved(TRUE, light=2.0)), 0, 3)
    seen = views((TRUE,), angles=[3.0, 6.0, 9.0])
    assert leading(ghost, channel_noise(seen)) == 2
    noisy = []
    for view in seen:
        variance = view.variance.copy()
        variance[..., 2] *= 100.0
        noisy.append(replace(view, variance=variance))
    assert channel_noise(noisy)[2] == pytest.approx(10.0 * channel_noise(seen)[2])
    assert leading(ghost, channel_noise(noisy)) == 1
    dark = moved(TRUE, light=0.0)
    assert leading(DetectedGhost((dark, dark, dark), 0, 3), channel_noise(seen)) == 1


def test_settle_recovers_all_colours():
    red, green, blue = moved(TRUE, -0.01, 0.004, 0.3), moved(TRUE, 0.0, 0.0, 0.08), TRUE
    seen = coloured((red, green, blue))
    start = moved(green, 0.04, 0.05)
    (ghost,) = fit_all([DetectedGhost((start, start, start), 0, len(seen) - 1)], seen, settings=FitSettings(rounds=1))
    for found, true in zip(ghost.shapes, (red, green, blue), strict=True):
        assert off(found, true).max() < 0.5
