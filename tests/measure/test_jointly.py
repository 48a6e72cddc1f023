"""Ghosts that lie over each other, fitted at once."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from planted_run import GHOSTS, LARGEST, shape, views

from flarewright.kernels.measure_pupil import FIRST_G, FIRST_I, SOFT
from flarewright.measure.fit import improve, render
from flarewright.measure.found import Found, alone, rest_of
from flarewright.measure.jointly import fitted_jointly
from flarewright.measure.patches import patches_of
from flarewright.measure.shape import Shape, free_numbers

COUNT = 6
FEW = np.linspace(1.0, LARGEST, 5)
# of a ghost's size, by which it begins beside its place
OFF = 0.15


def crowd(seed=3):
    """Return ghosts that lie over each other at every angle."""
    rng = np.random.default_rng(seed)
    return [
        shape(rng.uniform(-90.0, 20.0), np.exp(rng.uniform(np.log(8.0), np.log(40.0))), rng.uniform(0.2, 1.0))
        for _ in range(COUNT)
    ]


def begun(true, seen, seed=4):
    """Return ghosts about where they are, and about as large and bright."""
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
    return Found((one, one, one), 0, len(seen) - 1)


def missed(shapes, true, seen):
    """Return how far shapes are from the light of true ones, as a part of it."""
    drawn, there = ([sum(render(one, view) for one in some) for view in seen] for some in (shapes, true))
    return float(np.linalg.norm(np.subtract(drawn, there)) / np.linalg.norm(there))


def one_after_the_other(ghosts, seen, rounds=6):
    out = list(ghosts)
    for _ in range(rounds):
        for k, ghost in enumerate(out):
            shown = alone(ghost, 1, seen, rest_of(out, seen, 1), 16)
            patches = patches_of(ghost.shapes[1], shown, 1)
            out[k] = found(improve(ghost.shapes[1], patches, free_numbers(1, 0, 1), width=240, steps=4)[0], seen)
    return [ghost.shapes[1] for ghost in out]


def green(seen):
    return [view.pixels[..., 1] for view in seen]


def test_a_crowd_is_found_at_once_and_not_one_after_the_other():
    true = crowd()
    seen = views(true, angles=FEW)
    ghosts = begun(true, seen)
    at_once = missed(fitted_jointly(ghosts, seen, green(seen), 1, steps=24), true, seen)
    assert missed([ghost.shapes[1] for ghost in ghosts], true, seen) > 0.1
    assert at_once < 0.03
    # which may step as often
    assert at_once < 0.6 * missed(one_after_the_other(ghosts, seen), true, seen)


def test_a_soft_ghost_spreads_no_light_but_its_own():
    true = [softened(one) for one in crowd()[:4]] + crowd()[4:6]
    seen = views(true, angles=FEW)
    fitted = fitted_jointly([found(one, seen) for one in true], seen, green(seen), 1, steps=8)
    assert missed(fitted, true, seen) < 0.005


def softened(one):
    numbers = one.numbers.copy()
    numbers[SOFT] = 2.0
    return Shape(numbers)


def test_threads_change_nothing():
    seen = views(GHOSTS, angles=FEW)
    ghosts = begun(GHOSTS[:2], seen)
    alone_ = fitted_jointly(ghosts, seen, green(seen), 1, steps=2)
    with ThreadPoolExecutor(3) as pool:
        shared = fitted_jointly(ghosts, seen, green(seen), 1, steps=2, pool=pool)
    assert all(np.array_equal(a.numbers, b.numbers) for a, b in zip(alone_, shared, strict=True))


def test_a_ghost_is_fitted_by_the_views_of_its_life_alone():
    true = GHOSTS[:1]
    seen = views(true, angles=np.linspace(1.0, LARGEST, 12))
    half = len(seen) // 2
    lit = [light if k < half else np.zeros_like(light) for k, light in enumerate(green(seen))]
    ghost = replace(begun(true, seen)[0], last=half - 1)
    (one,) = fitted_jointly([ghost], seen, lit, 1, steps=24)
    assert missed([one], true, seen[:half]) < 0.02


def test_of_no_ghosts_nothing_is_fitted():
    assert fitted_jointly([], views((), angles=FEW), [], 1, steps=3) == []
