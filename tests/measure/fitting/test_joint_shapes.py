"""Joint fit of overlapping ghosts."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from planted_run import GHOSTS, LARGEST, shape, views

from flarewright.kernels.ghost_model.pupil_mesh import FIRST_G, FIRST_I, SOFT
from flarewright.measure.core.parameters import Shape, free_numbers
from flarewright.measure.fitting.detected_ghost import DetectedGhost, isolated_views, residual_of
from flarewright.measure.fitting.ghost_fit import improve, render
from flarewright.measure.fitting.joint_shapes import fit_shapes_jointly
from flarewright.measure.fitting.patches import patches_of

COUNT = 6
FEW = np.linspace(1.0, LARGEST, 5)
# error of the start position over the size of a ghost
OFF = 0.15


def crowd(seed=3):
    """Return ghosts that overlap at every angle."""
    rng = np.random.default_rng(seed)
    return [
        shape(rng.uniform(-90.0, 20.0), np.exp(rng.uniform(np.log(8.0), np.log(40.0))), rng.uniform(0.2, 1.0))
        for _ in range(COUNT)
    ]


def started(true, seen, seed=4):
    """Return ghosts with errors of position, size and brightness."""
    rng = np.random.default_rng(seed)
    ghosts = []
    for one in true:
        numbers = one.numbers.copy()
        numbers[0] += OFF * numbers[FIRST_G] * rng.normal()
        numbers[FIRST_G] *= 1.0 + 0.5 * OFF * rng.normal()
        numbers[FIRST_I] *= 1.0 + OFF * rng.normal()
        ghosts.append(found(Shape(numbers), seen))
    return ghosts


def found(one, seen):
    return DetectedGhost((one, one, one), 0, len(seen) - 1)


def missed(shapes, true, seen):
    """Return the relative root mean square error of the shapes' pictures."""
    drawn, there = ([sum(render(one, view) for one in some) for view in seen] for some in (shapes, true))
    return float(np.linalg.norm(np.subtract(drawn, there)) / np.linalg.norm(there))


def one_after_the_other(ghosts, seen, rounds=6):
    out = list(ghosts)
    for _ in range(rounds):
        for k, ghost in enumerate(out):
            shown = isolated_views(ghost, 1, seen, residual_of(out, seen, 1), 16)
            patches = patches_of(ghost.shapes[1], shown, 1)
            out[k] = found(improve(ghost.shapes[1], patches, free_numbers(1, 0, 1), width=240, steps=4)[0], seen)
    return [ghost.shapes[1] for ghost in out]


def green(seen):
    return [view.pixels[..., 1] for view in seen]


def test_a_joint_fit_recovers_a_crowd_that_single_fits_do_not():
    true = crowd()
    seen = views(true, angles=FEW)
    ghosts = started(true, seen)
    at_once = missed(fit_shapes_jointly(ghosts, seen, green(seen), 1, steps=24), true, seen)
    assert missed([ghost.shapes[1] for ghost in ghosts], true, seen) > 0.1
    assert at_once < 0.03
    # with the same number of steps
    assert at_once < 0.6 * missed(one_after_the_other(ghosts, seen), true, seen)


def test_a_soft_ghost_spreads_only_its_light():
    true = [softened(one) for one in crowd()[:4]] + crowd()[4:6]
    seen = views(true, angles=FEW)
    fitted = fit_shapes_jointly([found(one, seen) for one in true], seen, green(seen), 1, steps=8)
    assert missed(fitted, true, seen) < 0.005


def softened(one):
    numbers = one.numbers.copy()
    numbers[SOFT] = 2.0
    return Shape(numbers)


def test_threads_change_nothing():
    seen = views(GHOSTS, angles=FEW)
    ghosts = started(GHOSTS[:2], seen)
    alone_ = fit_shapes_jointly(ghosts, seen, green(seen), 1, steps=2)
    with ThreadPoolExecutor(3) as pool:
        shared = fit_shapes_jointly(ghosts, seen, green(seen), 1, steps=2, pool=pool)
    assert all(np.array_equal(a.numbers, b.numbers) for a, b in zip(alone_, shared, strict=True))


def test_a_ghost_is_fitted_in_its_views_only():
    true = GHOSTS[:1]
    seen = views(true, angles=np.linspace(1.0, LARGEST, 12))
    half = len(seen) // 2
    lit = [light if k < half else np.zeros_like(light) for k, light in enumerate(green(seen))]
    ghost = replace(started(true, seen)[0], last=half - 1)
    (one,) = fit_shapes_jointly([ghost], seen, lit, 1, steps=24)
    assert missed([one], true, seen[:half]) < 0.02


def test_no_ghosts_yield_no_shapes():
    assert fit_shapes_jointly([], views((), angles=FEW), [], 1, steps=3) == []
