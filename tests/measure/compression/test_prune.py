"""A compact model keeps the parameters that predict left-out constellations, and has curves only where needed."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from planted_run import LARGEST, SIZE, shape, views
from scipy.interpolate import CubicSpline
from test_follow import ANGLES, STRIP, drawn, grey

from flarewright.io.measurement.ghost_model_file import read_ghost_model, write_ghost_model
from flarewright.kernels.ghost_model.pupil_mesh import BELOW, LATERAL
from flarewright.measure.compression.order_selection import needed_numbers, parabola
from flarewright.measure.compression.prune import (
    compact_model,
    count_parameters,
    curves_of,
    fitted_in_model,
    held_error,
    rounded_to_error,
    written_numbers,
)
from flarewright.measure.core.checkpoint import Journal
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of
from flarewright.measure.core.parameters import Shape, free_numbers, rescaled
from flarewright.measure.core.pose_curves import Pose, posed, spline_basis, value_at
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.ghost_fit import cost_of, refine, render
from flarewright.measure.fitting.patches import patches_of
from flarewright.measure.glow.laws import offsets
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.tracking.follow import follow
from flarewright.measure.tracking.frame_fit import frame_halvings, measure_together
from flarewright.measure.tracking.smoothing_spline import smooth_curve
from flarewright.model.measurement.ghost_model import AberrationGhost, Curves, GhostModel


@pytest.mark.parametrize("knots", [3, 4, 7, 12])
def test_splines_are_natural_ones(knots):
    values = np.random.default_rng(knots).normal(size=knots)
    at = np.linspace(2.0, 9.0, 41)
    expected = CubicSpline(np.linspace(2.0, 9.0, knots), values, bc_type="natural")(at)
    np.testing.assert_allclose(spline_basis(at, (2.0, 9.0), knots) @ values, expected, atol=1e-12)


def test_a_curve_has_as_many_knots_as_its_values_need():
    rng = np.random.default_rng(5)
    at = np.linspace(0.0, 20.0, 40)
    error = np.full(40, 0.02)

    def curve(truth):
        values = truth + rng.normal(0.0, 0.02, 40)
        values[7] += 0.5  # an outlier
        return smooth_curve(at, values, error, (0.0, 20.0), usual=1.0, spread=0.5)

    assert curve(np.ones(40)) is None
    line = curve(1.0 + 0.02 * at)
    assert len(line.values) == 2
    np.testing.assert_allclose(line.values, (1.0, 1.4), atol=0.04)
    wave = 1.0 + 0.3 * np.sin(at / 3.0)
    bent = curve(wave)
    assert 5 <= len(bent.values) <= 12
    found = [value_at(bent, angle, (0.0, 20.0)) for angle in at]
    assert np.sqrt(np.mean((found - wave) ** 2)) < 0.02
    assert smooth_curve(at[:2], at[:2], error[:2], (0.0, 20.0), usual=1.0, spread=0.5) is None


@pytest.mark.parametrize(
    ("soft", "below", "lateral"),
    [(False, False, ()), (True, False, ()), (True, False, range(LATERAL, BELOW)), (True, True, ())],
)
def test_stored_uncertainty_marks_the_fitted_parameters(soft, below, lateral):
    # a run fits no lateral colour, but a model can hold it
    free = np.array([*free_numbers(1, 2, 1, soft, below), *lateral])
    numbers = shape(-80.0, 20.0, 0.5).numbers
    # two discs, their radii
    numbers[[32, 35]] = 1.0
    uncertainty = np.zeros(NUMBERS)
    uncertainty[free] = 0.1
    channel = channel_of(numbers, 2, uncertainty)
    ghost = AberrationGhost(name="1", red=channel, green=channel, blue=channel, visible_deg=(0.0, 9.0))
    assert np.array_equal(fitted_in_model(ghost), free)
    # without stored uncertainty, all count as fitted
    bare = channel.replace(uncertainty=())
    untold = AberrationGhost(name="1", red=bare, green=bare, blue=bare, visible_deg=(0.0, 9.0))
    assert np.array_equal(fitted_in_model(untold), free_numbers(2, 2, 2))


@cache
def fitted(seed=0):
    """Return a planted ghost of seven parameters fitted with thirty."""
    planted = shape(-80.0, 20.0, 0.5, bend=5.0)
    seen = views((planted,), seed=seed, angles=np.linspace(1.0, LARGEST, 12))
    patches = patches_of(planted, seen, 1)
    free = free_numbers(2, 0, 2)
    return planted, seen, patches, refine(planted, patches, free, width=SIZE[0], steps=4, error=0.0), free


def test_the_quadratic_form_predicts_the_cost_of_a_step():
    _, _, patches, fit, free = fitted()
    quadratic = parabola(fit.shape, patches, free, SIZE[0], 0.0)
    step = 2.0 * np.linalg.cholesky(fit.covariance) @ np.random.default_rng(2).normal(size=free.size)
    numbers = fit.shape.numbers.copy()
    numbers[free] += step
    there = np.array([cost_of(type(fit.shape)(numbers), [patch], error=0.0) for patch in patches])
    predicted = quadratic.cost - 2.0 * quadratic.side @ step + np.einsum("q,kqr,r->k", step, quadratic.matrix, step)
    np.testing.assert_allclose(
        predicted - quadratic.cost, there - quadratic.cost, atol=0.15 * np.abs(there - quadratic.cost).max()
    )


def test_parameters_that_predict_nothing_are_dropped():
    planted, _, patches, fit, free = fitted()
    needed = needed_numbers([parabola(fit.shape, patches, free, SIZE[0], 0.0)], free)
    # position and its cubic term, size, brightness and its slope are planted large
    assert {0, 3, 10, 20} <= set(needed)
    assert len(needed) <= 14 < len(free)
    again = refine(planted, patches, needed, width=SIZE[0], steps=4, error=0.0)
    assert again.cost < fit.cost + 2.0 * (len(free) - len(needed))


def model_of(ghosts, names, size=SIZE):
    return GhostModel(
        size_px=size, axis_px=(0.5 * size[0] + 2.3, 0.5 * size[1] - 1.6), focal_px=900.0, largest_deg=LARGEST,
        constellation_deg=(1.0, LARGEST),
        ghosts=tuple(
            AberrationGhost(
                name=name, visible_deg=(1.0, LARGEST),
                **dict.fromkeys(("red", "green", "blue"), channel_of(one.numbers, 0, 1.0 * (one.numbers != 0))),
            )
            for name, one in zip(names, ghosts, strict=True)
        ),
    )  # fmt: skip


def test_a_compact_model_has_the_needed_curves_and_no_unseen_ghosts(tmp_path):
    ghosts = (shape(-60.0, 20.0, 1.0), shape(55.0, 14.0, 0.6))
    unseen = shape(20.0, 8.0, 0.8)

    def poses(g, angle):
        return Pose(1.0 + 0.4 * np.sin(angle / 4.0), 0.1 * angle, 1.0) if g == 0 else Pose()

    seen = drawn(ghosts, poses, angles=ANGLES[2::3], size=STRIP)
    every = grey((*ghosts, unseen))
    small = compact_model(model_of((*ghosts, unseen), "abc", STRIP), follow("abc", every, seen), seen)
    assert [ghost.name for ghost in small.ghosts] == ["a", "b"]
    assert "dropped, as no frame shows them: c" in small.remarks
    curves = small.ghosts[0].curves
    # the polynomials absorb a shift proportional to the field, but not oscillations of the brightness
    assert len(curves.brightness.values) >= 4
    assert small.ghosts[1].curves == Curves()
    write_ghost_model(tmp_path / "compact.json", small)
    assert read_ghost_model(tmp_path / "compact.json") == small
    write_ghost_model(tmp_path / "model.json", model_of(ghosts, "ab"))
    assert count_parameters(small) < 3 * 2 * 12
    plain = small.replace(ghosts=tuple(ghost.replace(curves=Curves()) for ghost in small.ghosts))
    for view in drawn(ghosts, poses, noise=0.0, angles=ANGLES[4:-1:6], size=STRIP):
        missed, without = (
            np.sqrt(np.mean((replay_model(model, view.constellation_deg)[0].pixels - view.pixels) ** 2))
            for model in (small, plain)
        )
        assert missed < 0.06 * np.sqrt((view.pixels**2).mean())
        assert missed < 0.5 * without


@pytest.mark.parametrize(
    ("wide", "factor"),
    [
        (300.0, 0.2),
        *(pytest.param(wide, 1.0, marks=pytest.mark.slow) for wide in (60.0, 100.0, 300.0)),
    ],
)  # fmt: skip
def test_a_ghost_over_the_whole_picture_keeps_its_brightness(wide, factor):
    size = round(factor * SIZE[0]), round(factor * SIZE[1])
    # a free background in every view leaves its brightness almost undetermined
    rng = np.random.default_rng(1)
    seen, true = [], []
    for view in views((), angles=ANGLES[2 :: 3 if factor == 1.0 else 5], size=size):
        x, y = offsets((view.frame[0] + 20.0 * factor * view.sigma, view.frame[1]), size, 1.0)
        light = 0.2 / (1.0 + (x**2 + y**2) / (factor * wide) ** 2)
        seen.append(view.showing((light[..., None] + rng.normal(0.0, 0.01, view.pixels.shape)).astype(np.float32)))
        true.append(light)
    start = rescaled(shape(20.0, 200.0, 0.15), factor)
    order = 2 if factor == 1.0 else 1
    fit = refine(start, patches_of(start, seen, 1), free_numbers(order, 0, order), width=size[0], offset=False)
    every = grey((fit.shape,))
    reported = compact_model(model_of((fit.shape,), "a", size), follow("a", every, seen), seen)
    for view, light in zip(seen, true, strict=True):
        mine = replay_model(reported, view.constellation_deg)[0].pixels[..., 1]
        assert np.median(mine / light) == pytest.approx(1.0, abs=0.05)


def test_parameters_are_rounded_by_their_error():
    assert rounded_to_error(123.456789, 2.0) == 123.5
    assert rounded_to_error(0.00123456, 1e-4) == 0.001235
    assert rounded_to_error(1.0 / 3.0, 0.0) == 0.333333333


def test_a_rim_of_undetermined_size_stays_a_rim():
    held = np.zeros(NUMBERS)
    held[32] = 200.0
    rimmed = shape(-50.0, 20.0, 1.0, rim=(0.9, 1.2))
    assert written_numbers(rimmed, held)[32] == 1.2
    held[32] = 0.02
    assert written_numbers(rimmed, held)[32] == 1.2


def test_wide_pictures_are_halved_and_shifts_reported_in_full_pixels():
    assert [frame_halvings(width) for width in (240, 241, 480, 720)] == [0, 1, 1, 2]
    ghost = rescaled(shape(-50.0, 20.0, 1.0), 2.0)
    pose = Pose(1.3, 4.0, 1.0)
    seen = []
    for view in views((), angles=ANGLES[3::6], size=(2 * SIZE[0], 2 * SIZE[1])):
        light = render(replace(ghost, numbers=posed(ghost.numbers, view.sigma, pose)), view)
        seen.append(view.showing(np.repeat(light[..., None], 3, axis=2).astype(np.float32)))
    found = DetectedGhost((ghost, ghost, ghost), 0, len(seen) - 1)
    with ThreadPoolExecutor(2) as pool:
        (curves,) = curves_of([found], [(0.0, LARGEST)], seen, pool, Journal(), lambda *_: None)
    assert value_at(curves.along_px, 12.0, (0.0, LARGEST)) == pytest.approx(4.0, abs=0.05)
    assert value_at(curves.brightness, 12.0, (0.0, LARGEST)) == pytest.approx(1.3, abs=0.01)


def test_a_shift_is_in_pixels_with_any_denominator():
    one = shape(-50.0, 16.0, 1.0)
    one.numbers[BELOW:] = 0.2, -0.6
    (view,) = views((), angles=(0.8 * LARGEST,))
    x = np.arange(view.pixels.shape[1]) + 0.5
    middles = []
    for along in (0.0, 6.0):
        light = render(replace(one, numbers=posed(one.numbers, view.sigma, Pose(1.0, along, 1.0))), view)
        middles.append((light * x).sum() / light.sum())
    assert middles[1] - middles[0] == pytest.approx(6.0 * view.frame[2], rel=0.03)
    # the fit of a view uses the same definition of the shift
    shifted = render(replace(one, numbers=posed(one.numbers, view.sigma, Pose(1.0, 2.0, 1.0))), view)
    seen = view.showing(np.repeat(shifted[..., None], 3, axis=2).astype(np.float32))
    found = measure_together([(one, one, one)], [Pose()], seen)
    assert found.poses[0].along_px == pytest.approx(2.0, abs=0.05)


def test_rounding_changes_no_picture_of_correlated_parameters():
    """The thirty parameters are strongly correlated: rounding by marginal errors would change the picture."""
    _, _, patches, fit, _ = fitted()
    alone = held_error(fit)
    assert (alone[fit.free] <= fit.uncertainty[fit.free] * 1.01).all()
    numbers = [rounded_to_error(float(a), float(d)) for a, d in zip(fit.shape.numbers, alone, strict=True)]
    after = cost_of(Shape(np.array(numbers)), patches, error=0.0)
    before = cost_of(fit.shape, patches, error=0.0)
    assert after - before < 3.0


@pytest.mark.parametrize(("before", "fades"), [(0.0, True), (0.25, False)])
def test_a_ghost_that_appears_at_once_is_not_drawn_a_frame_before(before, fades):
    """It had all its light one frame too early: no curve of few knots follows a step."""
    ghosts, angles = (shape(-60.0, 20.0, 1.0), shape(55.0, 14.0, 0.6)), ANGLES[2::2]

    def poses(g, angle):
        return Pose(1.0 if g or angle >= angles[4] else before * (angle >= angles[3]))

    seen = drawn(ghosts, poses, angles=angles, size=STRIP)
    small = compact_model(model_of(ghosts, "ab", STRIP), follow("ab", grey(ghosts), seen), seen)
    one = small.ghosts[0]
    if fades:
        assert one.visible_deg[0] == pytest.approx(0.5 * (angles[3] + angles[4]), abs=2e-4)
        assert one.fade_deg == (pytest.approx(angles[4] - angles[3]), 0.0)
        drawn_early = replay_model(small, float(angles[3]))[0].pixels - seen[3].pixels
        assert np.sqrt((drawn_early**2).mean()) < 0.02
    else:
        # some of it is there: that frame belongs to the curve
        assert one.visible_deg[0] == pytest.approx(angles[3], abs=2e-4)
