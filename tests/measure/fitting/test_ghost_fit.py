"""Fits recover planted ghosts within their stated uncertainty from any start."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.measure.lateral_colour import spread_by_colour, with_lateral_start
from planted_run import GHOSTS, LARGEST, NOISE, SIZE, SMALL, SMALL_GHOSTS, shape, views

from flarewright.kernels.ghost_model.ghost_mesh import parting_of
from flarewright.kernels.ghost_model.pupil_mesh import BELOW, FIRST_DISC, FIRST_I, LATERAL, SOFT
from flarewright.measure.core.parameter_vector import channel_numbers, channel_of
from flarewright.measure.core.parameters import Shape, free_numbers
from flarewright.measure.detection import matching_pursuit
from flarewright.measure.detection.matching_pursuit import pursue
from flarewright.measure.detection.rim_voting import RimCandidate, candidates, slopes_of
from flarewright.measure.fitting import model_growth as growing
from flarewright.measure.fitting.alternating_fit import fit_all, to_model
from flarewright.measure.fitting.amplitudes import presences
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.ghost_fit import refine, render
from flarewright.measure.fitting.model_growth import grow
from flarewright.measure.fitting.patches import patches_of
from flarewright.measure.fitting.settings import FitSettings, Growth
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.walch.gradient_descent import (
    circle,
    cost,
    descend_gradient,
    draw_single,
    edges,
    window_with_margin,
)
from flarewright.measure.walch.polynomials import fit_polynomial
from flarewright.model.measurement.ghost_model import GhostModel

FEW = np.linspace(1.0, LARGEST, 9)
FEWER = FEW[::2]


def masks(shown):
    return [np.ones(view.pixels.shape[:2], bool) for view in shown]


@pytest.mark.parametrize("planted", [GHOSTS[0], GHOSTS[2]])
def test_planted_numbers_come_back_within_their_uncertainty(planted):
    shown = views((planted,), angles=FEW)
    start = planted.numbers.copy()
    start[[0, 10]] += 3.0, -1.0
    start[20] *= 1.1
    free = free_numbers(1, planted.discs, 1)
    free = free[free != 31] if planted.discs else free
    fit = refine(
        Shape(start, planted.discs), patches_of(planted, shown, 1), free, width=SIZE[0], steps=30, offset=False,
        error=0.0,
    )  # fmt: skip
    pulls = (fit.shape.numbers - planted.numbers)[free] / fit.uncertainty[free]
    assert fit.cost / fit.count == pytest.approx(1.0, abs=0.03)
    assert np.sqrt(np.mean(pulls**2)) < 1.7
    assert np.abs(pulls).max() < 4.0
    # the uncertainty is meaningful: positions are known to a fraction of a pixel
    assert fit.uncertainty[0] < 0.5


def veil(seed):
    """Return light that no ghost makes, correlated over a few pixels, shape (H, W), with mean square 1."""
    rows, columns = np.fft.fftfreq(SIZE[1])[:, None], np.fft.rfftfreq(SIZE[0])[None]
    noise = np.fft.rfft2(np.random.default_rng(seed).normal(size=SIZE[::-1]))
    smooth = np.fft.irfft2(noise * np.exp(-2.0 * (3.0 * np.pi) ** 2 * (rows**2 + columns**2)), s=SIZE[::-1])
    return smooth / smooth.std()


def veiled(planted, seed):
    """Return views of a ghost with such light, 6 times the noise."""
    bare = views((planted,), angles=np.linspace(1.0, LARGEST, 12), seed=seed)
    return [
        view.showing((view.pixels + 6.0 * NOISE * veil(100 * seed + k)[..., None]).astype(np.float32))
        for k, view in enumerate(bare)
    ]


def test_correlated_misfit_does_not_count_as_independent_pixels():
    planted = shape(40.0, 24.0, 0.5)
    free = free_numbers(2, 0, 1)
    pulls, off = [], []
    for seed in range(3):
        shown = veiled(planted, seed)
        fit = refine(planted, patches_of(planted, shown, 1), free, width=SIZE[0])
        assert fit.doubt > 100.0
        away = (fit.shape.numbers - planted.numbers)[free]
        pulls.append(away / fit.uncertainty[free])
        off.append(away[:20])
    assert np.sqrt(np.mean(np.square(pulls))) < 1.7
    assert np.abs(pulls).max() < 4.0
    # with independent pixels this light would bend the ghost by 5 pixels per parameter
    assert np.sqrt(np.mean(np.square(off))) < 3.5


@pytest.mark.parametrize("seed", [0, 1])
def test_a_far_rim_stays_in_place_near_other_light(seed):
    planted = shape(40.0, 24.0, 0.5, rim=(5.0, 5.5))
    free = free_numbers(1, 1, 1)
    shown = veiled(planted, seed)
    fit = refine(planted, patches_of(planted, shown, 1), free[free != 31], width=SIZE[0], steps=30)
    assert fit.doubt > 100.0
    assert fit.shape.numbers[32] == pytest.approx(5.5, abs=0.2)


def test_pixels_are_independent_when_the_residual_is_noise():
    planted = GHOSTS[0]
    shown = views((planted,), angles=FEW)
    fit = refine(planted, patches_of(planted, shown, 1), free_numbers(1, 0, 1), width=SIZE[0])
    assert fit.doubt < 3.0


@pytest.mark.parametrize("variance", [0.3, pytest.param(2.5, marks=pytest.mark.slow)])
def test_softness_comes_back_within_its_uncertainty_and_through_a_model(variance):
    numbers = GHOSTS[0].numbers.copy()
    numbers[SOFT] = variance
    planted = Shape(numbers)
    shown = views((planted,), angles=FEW)
    free = free_numbers(1, 0, 1, True)
    fit = refine(
        GHOSTS[0], patches_of(planted, shown, 1), free, width=SIZE[0], steps=30, offset=False, error=0.0
    )  # fmt: skip
    pulls = (fit.shape.numbers - numbers)[free] / fit.uncertainty[free]
    assert fit.cost / fit.count == pytest.approx(1.0, abs=0.03)
    assert np.abs(pulls).max() < 4.0
    assert fit.uncertainty[SOFT] < 0.1
    written = channel_of(fit.shape.numbers, 0, fit.uncertainty)
    assert written.soft_px == pytest.approx(np.sqrt(variance), abs=0.1)
    assert channel_numbers(written, None) == pytest.approx(fit.shape.numbers)
    # sharp borders fit clearly worse
    sharp = refine(GHOSTS[0], patches_of(planted, shown, 1), free[:-1], width=SIZE[0], steps=30, error=0.0)
    assert sharp.cost > 2.0 * fit.cost


def test_lateral_colour_comes_back_within_its_uncertainty_and_through_a_model():
    numbers = GHOSTS[0].numbers.copy()
    numbers[SOFT], numbers[LATERAL : LATERAL + 2] = 0.3, (4.0, -1.0)
    planted = Shape(numbers)
    shown = views((planted,), angles=FEWER)
    patches = patches_of(planted, shown, 1)
    soft = free_numbers(1, 0, 1, True)
    free = np.append(soft, [LATERAL, LATERAL + 1])
    fits = []
    # both signs draw the same ghost
    for sign in (1.0, -1.0):
        start = numbers.copy()
        start[SOFT], start[LATERAL : LATERAL + 2] = 1.0, (1.0, sign)
        fits.append(refine(Shape(start), patches, free, width=SIZE[0], steps=40, offset=False, error=0.0))
    for fit in fits:
        turned = fit.shape.numbers.copy()
        turned[LATERAL:BELOW] *= np.sign(turned[LATERAL])
        assert np.abs((turned - numbers)[free] / fit.uncertainty[free]).max() < 4.0
        assert fit.cost / fit.count == pytest.approx(1.0, abs=0.03)
        assert fit.uncertainty[LATERAL:].max() < 0.3
    written = channel_of(fits[0].shape.numbers, 0, fits[0].uncertainty)
    assert len(written.uncertainty) == 33
    assert channel_numbers(written, None) == pytest.approx(fits[0].shape.numbers)
    # uniformly soft borders fit clearly worse
    even = refine(Shape(numbers * (np.arange(numbers.size) < LATERAL)), patches, soft, width=SIZE[0], error=0.0)
    assert even.cost > 1.5 * fits[0].cost


def test_uneven_and_growing_colour_comes_back_within_its_uncertainty_and_through_a_model():
    numbers = GHOSTS[0].numbers.copy()
    planted = (4.0, -1.0, 0.8, 0.6, 1.5, -1.5)
    numbers[SOFT], numbers[LATERAL:BELOW] = 0.3, planted
    shown = views((Shape(numbers),), angles=FEWER)
    patches = patches_of(Shape(numbers), shown, 1)
    free, start = np.array([*free_numbers(1, 0, 1, True), *range(LATERAL, BELOW)]), numbers.copy()
    start[LATERAL:BELOW] = 3.0, -0.5, 0.0, 0.0, 0.0, 0.0
    fit = refine(Shape(start), patches, free, width=SIZE[0], steps=60, offset=False, error=0.0)
    assert fit.cost / fit.count == pytest.approx(1.0, abs=0.03)
    assert np.abs((fit.shape.numbers - numbers)[free] / fit.uncertainty[free]).max() < 4.0
    # without these parameters the fit is clearly worse
    plain = refine(Shape(start), patches, free[:-4], width=SIZE[0], steps=60, error=0.0)
    assert plain.cost > 1.02 * fit.cost
    written = channel_of(fit.shape.numbers, 0, fit.uncertainty)
    assert len(written.lateral_px) == 6
    assert len(written.uncertainty) == 37
    assert channel_numbers(written, None) == pytest.approx(fit.shape.numbers)


@pytest.fixture(scope="module")
def parting():
    """Return parameters of a ghost with lateral colour, views of it, and fits without and with lateral colour."""
    numbers = GHOSTS[0].numbers.copy()
    numbers[SOFT], numbers[LATERAL : LATERAL + 2] = 0.3, (4.0, -1.0)
    shown = views((Shape(numbers),), angles=FEWER)
    plain = grow(Shape(GHOSTS[0].numbers), shown, 1, most=Growth(discs=0))
    assert plain is not None
    return numbers, shown, plain, spread_by_colour(plain, shown, 1)


def test_lateral_colour_is_added_where_it_lowers_the_cost(parting):
    numbers, _, plain, apart = parting
    assert not plain.shape.numbers[LATERAL:BELOW].any()
    # compare in equal windows, as one shape is wider
    assert apart.cost / apart.count < 0.9 * plain.cost / plain.count
    assert np.abs(apart.shape.numbers[LATERAL : LATERAL + 2]) == pytest.approx([4.0, 1.0], abs=0.8)
    # a uniformly soft ghost keeps its fit
    numbers = numbers * (np.arange(numbers.size) < LATERAL)
    shown = views((Shape(numbers),), angles=FEWER)
    even = grow(Shape(GHOSTS[0].numbers), shown, 1, most=Growth(discs=0))
    assert even is not None
    assert spread_by_colour(even, shown, 1) is even


def test_lateral_colour_stays_within_the_thickness_of_a_ghost(parting):
    """The rim alone does not draw thinner ghosts: images of the light, lines near a focus."""
    numbers, shown, plain, apart = parting
    frame = views((), angles=FEWER)[-1].frame
    far = parting_of(numbers, 0, 0.9, frame)
    assert 0.05 < far < 0.4
    twice = numbers.copy()
    twice[LATERAL:] *= 2.0
    assert parting_of(twice, 0, 0.9, frame) == pytest.approx(2.0 * far, rel=1e-6)
    twice[LATERAL:] = 0.0
    assert parting_of(twice, 0, 0.9, frame) == 0.0
    thin = numbers.copy()
    thin[:FIRST_I] *= 0.1
    assert parting_of(thin, 0, 0.9, frame) > 5.0 * far
    assert apart is not plain
    assert spread_by_colour(plain, shown, 1, spread=0.5 * far) is plain


def test_a_search_for_lateral_colour_starts_with_a_spread():
    numbers = GHOSTS[0].numbers.copy()
    numbers[SOFT] = 0.5
    apart = with_lateral_start(Shape(numbers))
    assert apart.numbers[SOFT] == 0.25
    assert apart.numbers[LATERAL:BELOW].tolist() == [0.5, 0.5, 0.0, 0.0, 0.0, 0.0]
    assert np.array_equal(with_lateral_start(apart).numbers, apart.numbers)


def test_replay_equals_the_fit_at_captured_angles():
    shown = views((), angles=FEW)
    found = [
        DetectedGhost((one, other, one), first, 8)
        for one, other, first in zip(GHOSTS, GHOSTS[::-1], range(4), strict=True)
    ]
    model = GhostModel(
        size_px=SIZE, axis_px=(float(shown[0].frame[0]), float(shown[0].frame[1])), focal_px=300.0, largest_deg=LARGEST,
        constellation_deg=(1.0, LARGEST), ghosts=to_model(found, shown),
    )  # fmt: skip
    for k in (0, 2, 8):
        there = [ghost for ghost in found if ghost.first <= k]
        for m in range(3):
            fitted = sum(render(ghost.shapes[m], shown[k]) for ghost in there)
            off = replay_model(model, float(FEW[k]))[0].pixels[..., m] - fitted
            # a replay has larger cells than a fit: their brightness steps by 5 %
            assert np.abs(off).max() < 0.05 * fitted.max()
            assert np.sqrt(np.mean(off**2)) < 0.006 * np.sqrt(np.mean(fitted**2))
            assert abs(off.sum()) < 1e-3 * fitted.sum()


@pytest.mark.slow
def test_exactly_the_planted_ghosts_are_found():
    shown = views(GHOSTS[:2])
    settled = fit_all(pursue(shown, masks(shown)), shown, settings=FitSettings(rounds=1, most=Growth(order=1, discs=1)))
    for planted in GHOSTS[:2]:
        near = min(settled, key=lambda ghost: abs(ghost.shapes[1].numbers[0] - planted.numbers[0]))
        assert near.shapes[1].numbers[[0, 10]] == pytest.approx(planted.numbers[[0, 10]], abs=2.0)
    assert len(settled) <= 3


def test_noise_alone_has_no_ghosts():
    shown = views((), angles=FEWER)
    assert pursue(shown, masks(shown)) == []


def test_a_ghost_that_is_bright_at_its_rim_is_found():
    # its intensity is slightly negative at the pupil centre, as fits of real ghosts can be
    ring = shape(-50.0, 30.0, 0.5)
    ring.numbers[20:22] = -0.1 * ring.numbers[20], 2.2 * ring.numbers[20]
    shown = views((ring,), angles=FEWER)
    found = pursue(shown, masks(shown), most=1)
    assert len(found) == 1
    assert found[0].shapes[1].numbers[0] == pytest.approx(-50.0, abs=2.0)


def test_a_refused_candidate_is_tried_again_when_more_ghosts_are_known(monkeypatch):
    tried, votes = [], [RimCandidate(80.0 * k, 10.0, 0, 8, 9.0 - k) for k in range(4)]

    def trial(candidate, *_):
        # the best candidate passes only after all others
        tried.append(candidate)
        if candidate is votes[0] and not all(each in tried for each in votes):
            return None
        return DetectedGhost((GHOSTS[0],) * 3, 0, 1)

    def left(*_):
        return [each for each in votes if each not in tried or (each is votes[0] and tried[-1] is not each)], []

    monkeypatch.setattr(matching_pursuit, "_fit_candidate", trial)
    monkeypatch.setattr(matching_pursuit, "_candidates", left)
    monkeypatch.setattr(
        matching_pursuit, "fit_shapes_jointly", lambda found, *_, **__: [ghost.shapes[1] for ghost in found]
    )
    shown = views(GHOSTS[:1], angles=FEW[:3])
    found = pursue(shown, masks(shown), most=4)
    assert len(found) == 4
    assert tried[0] is tried[-1] is votes[0]


def test_a_candidate_refused_three_times_is_not_tried_again(monkeypatch):
    tried, votes = [], [RimCandidate(80.0 * k, 10.0, 0, 8, 99.0 - k) for k in range(24)]

    def trial(candidate, *_):
        tried.append(candidate)
        return None if candidate is votes[0] else DetectedGhost((GHOSTS[0],) * 3, 0, 1)

    monkeypatch.setattr(matching_pursuit, "_fit_candidate", trial)
    monkeypatch.setattr(
        matching_pursuit, "_candidates", lambda *_: ([votes[0], *(e for e in votes if e not in tried)], [])
    )
    # the residual of these equal ghosts is rounding noise, so the result of a crescent search would be arbitrary
    monkeypatch.setattr(matching_pursuit, "_crescents", lambda *_: [])
    monkeypatch.setattr(
        matching_pursuit, "fit_shapes_jointly", lambda found, *_, **__: [ghost.shapes[1] for ghost in found]
    )
    shown = views(GHOSTS[:1], angles=FEW[:3])
    assert len(pursue(shown, masks(shown), most=40)) == 23
    assert tried.count(votes[0]) == 3


def test_a_rolled_camera_sees_the_same_ghosts():
    best = []
    for roll in (0.0, 37.0):
        shown = views(GHOSTS[:2], angles=FEW, roll_deg=roll)
        slopes = slopes_of(shown, [view.pixels[..., 1] for view in shown], masks(shown))
        best.append(candidates(slopes, SIZE[0], most=2))
        # no candidate is close to a better one: one per ghost, on its side of the axis
        assert min(each.speed for each in best[-1]) < 0.0 < max(each.speed for each in best[-1])
    for one, other in zip(*best, strict=True):
        assert other.speed == pytest.approx(one.speed, abs=8.0)
        assert other.radius == pytest.approx(one.radius, abs=3.0)


def test_permuted_starts_give_the_same_picture():
    planted = GHOSTS[1]
    shown = views((planted,), angles=FEW)
    pictures = []
    for speed, size in ((4.0, 1.5), (-5.0, -1.0)):
        fitted = shape(planted.numbers[0] + speed, planted.numbers[10] + size, 0.4)
        for order in (0, 1):
            patches = patches_of(planted, shown, 1)
            free = free_numbers(order, 0, order)
            fitted = refine(fitted, patches, free, width=SIZE[0], steps=30, error=0.0).shape
        pictures.append(render(fitted, shown[5]))
    assert np.abs(pictures[0] - pictures[1]).max() < 0.3 * NOISE


def test_presence_shows_births_and_deaths():
    there, gone = views((GHOSTS[1],), angles=FEW)[4], views((), angles=FEW)[4]
    seen = presences(GHOSTS[1], [there, gone], 1)
    assert [each.amplitude for each in seen] == [pytest.approx(1.0, abs=0.05), pytest.approx(0.0, abs=0.05)]
    assert all(np.isfinite(each.error) for each in seen)
    (beyond,) = presences(shape(3000.0, 5.0, 1.0), [there], 1)
    assert (beyond.amplitude, beyond.error) == (0.0, np.inf)


def test_candidates_hold_their_range_of_views():
    some = views((GHOSTS[0],), angles=FEW)[:5] + views((), angles=FEW)[5:]
    slopes = slopes_of(some, [view.pixels[..., 1] for view in some], masks(some))
    best = candidates(slopes, SIZE[0], most=1)[0]
    assert isinstance(best, RimCandidate)
    assert (best.first, best.last) == (0, 4)


BEZIER = np.array([
    20.0, 1.5, 30.0, 36.0, 24.0, 18.0, 15.0, 14.0, 17.0, 6.0, 15.0, 1.3, 1.8, 1.0, 0.8, 0.5, 0.3, 0.25, 0.2,
])  # fmt: skip
FRAME = np.array([80.2, 60.1, np.cos(0.4), np.sin(0.4), 1.0])


def test_gradient_descent_lowers_walchs_cost():
    window = window_with_margin(BEZIER, FRAME, (160, 120), 10)
    grey = BEZIER.copy()
    grey[13:16], grey[16:] = 0.8, 0.25
    wanted = draw_single(grey, FRAME, window)[..., 1]
    start = circle(20.5, 30.0, np.full(3, 0.8), np.full(3, 0.25))
    found = descend_gradient(start, wanted, FRAME, window, rounds=2)
    assert found.cost < 0.7 * cost(draw_single(start, FRAME, window)[..., 1], wanted)


def test_a_plane_has_no_edges():
    y, x = np.mgrid[:30, :40].astype(float)
    assert np.abs(edges(2.0 * x - y)[6:-6, 6:-6]).max() < 1e-12


@pytest.mark.parametrize("order", [0, 1, 3])
def test_compress_finds_the_order(order):
    rng = np.random.default_rng(order)
    angles = np.linspace(3.0, 21.0, 40)
    z = (angles - 12.0) / 9.0
    truth = np.polynomial.polynomial.polyval(z, [5.0, -3.0, 0.0, 2.0][: order + 1])
    values = truth + rng.normal(0.0, 0.05, 40)
    values[7] += 4.0
    curve = fit_polynomial(angles, values, np.full(40, 0.05), (3.0, 21.0))
    assert len(curve.coefficients) - 1 <= order + 1
    assert np.abs(np.polynomial.polynomial.polyval(z, curve.coefficients) - truth).max() < 0.1


def test_the_order_of_the_ghosts_does_not_change_the_fit():
    shown = views(SMALL_GHOSTS[:3], angles=FEW[::3], size=SMALL)
    replays = []
    for order in ((0, 1, 2), (2, 0, 1)):
        starts = [replace(SMALL_GHOSTS[k], numbers=SMALL_GHOSTS[k].numbers.copy()) for k in order]
        for one in starts:
            one.numbers[0] *= 1.02
        found = [DetectedGhost((one,) * 3, 0, len(shown) - 1) for one in starts]
        settled = fit_all(found, shown, settings=FitSettings(rounds=1, most=Growth(order=1, discs=0)))
        replays.append(np.stack([sum(render(one.shapes[1], view) for one in settled) for view in shown]))
    # sums of light differ in their last digits; fits run in order of brightness
    assert np.sqrt(np.mean((replays[1] - replays[0]) ** 2)) < 1e-3 * np.sqrt(np.mean(replays[0] ** 2))


def test_a_rim_that_leaves_nothing_to_fit_is_dropped(monkeypatch):
    """Regression: such a rim was tried endlessly."""
    seen = views(GHOSTS[1:2], angles=np.linspace(2.0, LARGEST, 6))
    gone = Shape(GHOSTS[1].numbers.copy(), 1)
    gone.numbers[:4] = 1e5, 0.0, 0.0, 0.0
    gone.numbers[FIRST_DISC : FIRST_DISC + 3] = 0.0, 0.0, 1.0
    assert not patches_of(gone, seen, 1)
    real = growing.cost_of
    monkeypatch.setattr(growing, "_with_rim", lambda *_: gone)
    monkeypatch.setattr(
        growing, "cost_of", lambda shape, *reported, **how: 0.0 if shape is gone else real(shape, *reported, **how)
    )
    fit = grow(GHOSTS[1], seen, 1, most=Growth(order=1, discs=1))
    assert fit is not None
    assert fit.shape.discs == 0


def test_a_free_background_hides_a_ghost_without_a_border_in_the_picture():
    """With a background per view, it would absorb all light of a ghost whose border is outside the picture."""
    wide, start = shape(0.0, 400.0, 0.3), shape(0.0, 400.0, 0.2)
    for each in (wide, start):
        each.numbers[1:10] = each.numbers[11:20] = each.numbers[21:] = 0.0
    seen = views([wide], angles=np.linspace(2.0, LARGEST, 6))
    fits = {offset: grow(start, seen, 1, most=Growth(order=0, discs=0, offset=offset)) for offset in (True, False)}
    assert render(fits[False].shape, seen[0]).mean() == pytest.approx(0.3, rel=0.05)
    assert abs(render(fits[True].shape, seen[0]).mean() - 0.3) > 0.05
