"""Fitting: planted ghosts come back within their stated uncertainty, from wherever the fit begins."""

from dataclasses import replace

import numpy as np
import pytest
from planted_run import GHOSTS, LARGEST, NOISE, SIZE, shape, views

from flarewright.kernels.measure_mesh import parting_of
from flarewright.kernels.measure_pupil import BELOW, FIRST_DISC, FIRST_I, LATERAL, SOFT
from flarewright.measure import grow as growing
from flarewright.measure import pursuit
from flarewright.measure.compress import compress
from flarewright.measure.find import Candidate, candidates, slopes_of
from flarewright.measure.fit import refine, render
from flarewright.measure.found import Found
from flarewright.measure.grow import Growth, grow, spread_by_colour
from flarewright.measure.numbers import channel_numbers, channel_of
from flarewright.measure.patches import patches_of
from flarewright.measure.presence import presences
from flarewright.measure.pursuit import pursue
from flarewright.measure.replay import replay
from flarewright.measure.settle import Settling, settle, to_model
from flarewright.measure.shape import Shape, free_numbers, parted
from flarewright.measure.walch import circle, cost, descend, draw, edges, fit_bezier, window_of
from flarewright.model.ghost_model import GhostModel

FEW = np.linspace(1.0, LARGEST, 9)


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
    # and the uncertainty says something: places are known to a fraction of a pixel
    assert fit.uncertainty[0] < 0.5


def veil(seed):
    """Return light that no ghost makes, alike within a few pixels, shape (H, W), of mean square 1."""
    rows, columns = np.fft.fftfreq(SIZE[1])[:, None], np.fft.rfftfreq(SIZE[0])[None]
    noise = np.fft.rfft2(np.random.default_rng(seed).normal(size=SIZE[::-1]))
    smooth = np.fft.irfft2(noise * np.exp(-2.0 * (3.0 * np.pi) ** 2 * (rows**2 + columns**2)), s=SIZE[::-1])
    return smooth / smooth.std()


def veiled(planted, seed):
    """Return views of a ghost beside such light, 6 times the noise."""
    bare = views((planted,), angles=np.linspace(1.0, LARGEST, 12), seed=seed)
    return [
        view.showing((view.pixels + 6.0 * NOISE * veil(100 * seed + k)[..., None]).astype(np.float32))
        for k, view in enumerate(bare)
    ]


def test_what_neighbours_miss_alike_is_no_crowd_of_witnesses():
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
    # as pixels that are each a witness, they bent the ghost by 5 pixels a number
    assert np.sqrt(np.mean(np.square(off))) < 3.5


@pytest.mark.parametrize("seed", [0, 1])
def test_a_far_rim_stays_where_it_is_beside_light_of_others(seed):
    planted = shape(40.0, 24.0, 0.5, rim=(5.0, 5.5))
    free = free_numbers(1, 1, 1)
    shown = veiled(planted, seed)
    fit = refine(planted, patches_of(planted, shown, 1), free[free != 31], width=SIZE[0], steps=30)
    assert fit.doubt > 100.0
    assert fit.shape.numbers[32] == pytest.approx(5.5, abs=0.2)


def test_pixels_are_witnesses_of_their_own_where_noise_is_all_that_is_left():
    planted = GHOSTS[0]
    shown = views((planted,), angles=FEW)
    fit = refine(planted, patches_of(planted, shown, 1), free_numbers(1, 0, 1), width=SIZE[0])
    assert fit.doubt < 3.0


@pytest.mark.parametrize("variance", [0.3, 2.5])
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
    # sharp borders cannot stand in for soft ones
    sharp = refine(GHOSTS[0], patches_of(planted, shown, 1), free[:-1], width=SIZE[0], steps=30, error=0.0)
    assert sharp.cost > 2.0 * fit.cost


def test_lateral_colour_comes_back_within_its_uncertainty_and_through_a_model():
    numbers = GHOSTS[0].numbers.copy()
    numbers[SOFT], numbers[LATERAL : LATERAL + 2] = 0.3, (4.0, -1.0)
    planted = Shape(numbers)
    shown = views((planted,), angles=FEW)
    patches = patches_of(planted, shown, 1)
    soft = free_numbers(1, 0, 1, True)
    free = np.append(soft, [LATERAL, LATERAL + 1])
    fits = []
    # both signs are one ghost, so either is found
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
    # borders that are as soft all around cannot stand in for it
    even = refine(Shape(numbers * (np.arange(numbers.size) < LATERAL)), patches, soft, width=SIZE[0], error=0.0)
    assert even.cost > 1.5 * fits[0].cost


def test_uneven_and_growing_colour_comes_back_within_its_uncertainty_and_through_a_model():
    numbers = GHOSTS[0].numbers.copy()
    planted = (4.0, -1.0, 0.8, 0.6, 1.5, -1.5)
    numbers[SOFT], numbers[LATERAL:BELOW] = 0.3, planted
    shown = views((Shape(numbers),), angles=FEW)
    patches = patches_of(Shape(numbers), shown, 1)
    free, start = free_numbers(1, 0, 1, True, True), numbers.copy()
    start[LATERAL:BELOW] = 3.0, -0.5, 0.0, 0.0, 0.0, 0.0
    fit = refine(Shape(start), patches, free, width=SIZE[0], steps=60, offset=False, error=0.0)
    assert fit.cost / fit.count == pytest.approx(1.0, abs=0.03)
    assert np.abs((fit.shape.numbers - numbers)[free] / fit.uncertainty[free]).max() < 4.0
    # without them nothing stands in for it
    plain = refine(Shape(start), patches, free_numbers(1, 0, 1, True, True)[:-4], width=SIZE[0], steps=60, error=0.0)
    assert plain.cost > 1.02 * fit.cost
    written = channel_of(fit.shape.numbers, 0, fit.uncertainty)
    assert len(written.lateral_px) == 6
    assert len(written.uncertainty) == 37
    assert channel_numbers(written, None) == pytest.approx(fit.shape.numbers)


@pytest.fixture(scope="module")
def parting():
    """Return numbers of a ghost whose wavelengths lie apart, views of it, and fits without and with that."""
    numbers = GHOSTS[0].numbers.copy()
    numbers[SOFT], numbers[LATERAL : LATERAL + 2] = 0.3, (4.0, -1.0)
    numbers.flags.writeable = False
    shown = views((Shape(numbers),), angles=FEW)
    plain = grow(Shape(GHOSTS[0].numbers), shown, 1, most=Growth(discs=0))
    assert plain is not None
    return numbers, shown, plain, spread_by_colour(plain, shown, 1)


def test_wavelengths_part_where_that_pays_and_where_one_asks(parting):
    numbers, _, plain, apart = parting
    assert not plain.shape.numbers[LATERAL:BELOW].any()
    # windows differ, for one is wider
    assert apart.cost / apart.count < 0.9 * plain.cost / plain.count
    assert np.abs(apart.shape.numbers[LATERAL : LATERAL + 2]) == pytest.approx([4.0, 1.0], abs=0.8)
    # a ghost that is as soft all around keeps its numbers
    numbers = numbers * (np.arange(numbers.size) < LATERAL)
    shown = views((Shape(numbers),), angles=FEW)
    even = grow(Shape(GHOSTS[0].numbers), shown, 1, most=Growth(discs=0))
    assert even is not None
    assert spread_by_colour(even, shown, 1) is even


def test_wavelengths_do_not_part_by_more_than_a_ghost_is_thick(parting, monkeypatch):
    """What is thinner than that is not drawn by its rim alone: images of the light, lines near a focus."""
    numbers, shown, plain, apart = parting
    frame = views((), angles=FEW)[-1].frame
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
    monkeypatch.setattr("flarewright.measure.grow._FARTHEST", 0.5 * far)
    assert spread_by_colour(plain, shown, 1) is plain


def test_wavelengths_part_before_a_search_for_how_far():
    numbers = GHOSTS[0].numbers.copy()
    numbers[SOFT] = 0.5
    apart = parted(Shape(numbers))
    assert apart.numbers[SOFT] == 0.25
    assert apart.numbers[LATERAL:BELOW].tolist() == [0.5, 0.5, 0.0, 0.0, 0.0, 0.0]
    assert np.array_equal(parted(apart).numbers, apart.numbers)


def test_replay_equals_the_fit_at_captured_angles():
    shown = views((), angles=FEW)
    found = [
        Found((one, other, one), first, 8) for one, other, first in zip(GHOSTS, GHOSTS[::-1], range(4), strict=True)
    ]
    model = GhostModel(
        size_px=SIZE, axis_px=(float(shown[0].frame[0]), float(shown[0].frame[1])), focal_px=300.0, largest_deg=LARGEST,
        constellation_deg=(1.0, LARGEST), ghosts=to_model(found, shown),
    )  # fmt: skip
    for k in (0, 2, 8):
        there = [ghost for ghost in found if ghost.first <= k]
        for m in range(3):
            fitted = sum(render(ghost.shapes[m], shown[k]) for ghost in there)
            off = replay(model, float(FEW[k]))[0].pixels[..., m] - fitted
            # a replay's cells are larger than a fit's: their brightness steps by 5 %
            assert np.abs(off).max() < 0.05 * fitted.max()
            assert np.sqrt(np.mean(off**2)) < 0.006 * np.sqrt(np.mean(fitted**2))
            assert abs(off.sum()) < 1e-3 * fitted.sum()


@pytest.mark.slow
def test_all_ghosts_are_found_and_none_besides():
    shown = views(GHOSTS[:2])
    settled = settle(pursue(shown, masks(shown)), shown, how=Settling(rounds=1, most=Growth(order=1, discs=1)))
    for planted in GHOSTS[:2]:
        near = min(settled, key=lambda ghost: abs(ghost.shapes[1].numbers[0] - planted.numbers[0]))
        assert near.shapes[1].numbers[[0, 10]] == pytest.approx(planted.numbers[[0, 10]], abs=2.0)
    assert len(settled) <= 3


def test_noise_alone_has_no_ghosts():
    shown = views((), angles=FEW)
    assert pursue(shown, masks(shown)) == []


def test_a_ghost_that_is_bright_at_its_rim_is_found():
    # its law falls a little below 0 in the middle of the pupil, as that of a lens' ghost may where it bends
    ring = shape(-50.0, 30.0, 0.5)
    ring.numbers[20:22] = -0.1 * ring.numbers[20], 2.2 * ring.numbers[20]
    shown = views((ring,), angles=FEW)
    found = pursue(shown, masks(shown), most=1)
    assert len(found) == 1
    assert found[0].shapes[1].numbers[0] == pytest.approx(-50.0, abs=2.0)


def test_what_was_refused_is_tried_again_when_more_is_known(monkeypatch):
    tried, votes = [], [Candidate(80.0 * k, 10.0, 0, 8, 9.0 - k) for k in range(4)]

    def trial(candidate, views, rest, pool):
        # the best one explains enough only beside all others
        tried.append(candidate)
        if candidate is votes[0] and not all(each in tried for each in votes):
            return None
        return Found((GHOSTS[0],) * 3, 0, 1)

    def left(*_):
        return [each for each in votes if each not in tried or (each is votes[0] and tried[-1] is not each)], []

    monkeypatch.setattr(pursuit, "_try", trial)
    monkeypatch.setattr(pursuit, "_candidates", left)
    monkeypatch.setattr(pursuit, "fitted_jointly", lambda found, *_, **__: [ghost.shapes[1] for ghost in found])
    shown = views(GHOSTS[:1], angles=FEW[:3])
    found = pursue(shown, masks(shown), most=4)
    assert len(found) == 4
    assert tried[0] is tried[-1] is votes[0]


def test_who_was_refused_three_times_is_not_tried_again(monkeypatch):
    tried, votes = [], [Candidate(80.0 * k, 10.0, 0, 8, 99.0 - k) for k in range(24)]

    def trial(candidate, views, rest, pool):
        tried.append(candidate)
        return None if candidate is votes[0] else Found((GHOSTS[0],) * 3, 0, 1)

    monkeypatch.setattr(pursuit, "_try", trial)
    monkeypatch.setattr(pursuit, "_candidates", lambda *_: ([votes[0], *(e for e in votes if e not in tried)], []))
    # what all these ghosts at one place leave is rounding, of which a search for lunes makes what it likes
    monkeypatch.setattr(pursuit, "_lunes", lambda *_: [])
    monkeypatch.setattr(pursuit, "fitted_jointly", lambda found, *_, **__: [ghost.shapes[1] for ghost in found])
    shown = views(GHOSTS[:1], angles=FEW[:3])
    assert len(pursue(shown, masks(shown), most=40)) == 23
    assert tried.count(votes[0]) == 3


def test_a_rolled_camera_sees_the_same_ghosts():
    best = []
    for roll in (0.0, 37.0):
        shown = views(GHOSTS[:2], angles=FEW, roll_deg=roll)
        slopes = slopes_of(shown, [view.pixels[..., 1] for view in shown], masks(shown))
        best.append(candidates(slopes, SIZE[0], most=2))
        # none is close to a better one: one is each ghost's, on its side of the axis
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


def test_presence_tells_births_and_deaths():
    there, gone = views((GHOSTS[1],), angles=FEW)[4], views((), angles=FEW)[4]
    seen = presences(GHOSTS[1], [there, gone], 1)
    assert [each.amplitude for each in seen] == [pytest.approx(1.0, abs=0.05), pytest.approx(0.0, abs=0.05)]
    assert all(np.isfinite(each.error) for each in seen)
    (beyond,) = presences(shape(3000.0, 5.0, 1.0), [there], 1)
    assert (beyond.amplitude, beyond.error) == (0.0, np.inf)


def test_candidates_say_which_views_saw_them():
    some = views((GHOSTS[0],), angles=FEW)[:5] + views((), angles=FEW)[5:]
    slopes = slopes_of(some, [view.pixels[..., 1] for view in some], masks(some))
    best = candidates(slopes, SIZE[0], most=1)[0]
    assert isinstance(best, Candidate)
    assert (best.first, best.last) == (0, 4)


BEZIER = np.array([
    20.0, 1.5, 30.0, 36.0, 24.0, 18.0, 15.0, 14.0, 17.0, 6.0, 15.0, 1.3, 1.8, 1.0, 0.8, 0.5, 0.3, 0.25, 0.2,
])  # fmt: skip
FRAME = np.array([80.2, 60.1, np.cos(0.4), np.sin(0.4), 1.0])


def test_bezier_ghosts_come_back_within_their_uncertainty():
    window = window_of(BEZIER, FRAME, (160, 120), 10)
    clean = draw(BEZIER, FRAME, window)
    noisy = clean + np.random.default_rng(2).normal(0.0, 0.02, clean.shape)
    start = circle(22.0, 29.0, np.full(3, 0.7), np.full(3, 0.3))
    fit, deviation = fit_bezier(start, noisy, np.full(clean.shape, 0.02**-2), FRAME, window)
    pulls = (fit.numbers - BEZIER) / deviation
    assert fit.cost / clean.size == pytest.approx(1.0, abs=0.03)
    assert np.sqrt(np.mean(pulls**2)) < 1.6
    assert np.abs(pulls).max() < 4.0


def test_gradient_descent_lowers_walchs_cost_but_needs_far_more_pictures():
    window = window_of(BEZIER, FRAME, (160, 120), 10)
    grey = BEZIER.copy()
    grey[13:16], grey[16:] = 0.8, 0.25
    wanted = draw(grey, FRAME, window)[..., 1]
    start = circle(20.5, 30.0, np.full(3, 0.8), np.full(3, 0.25))
    found = descend(start, wanted, FRAME, window, rounds=2)
    assert found.cost < 0.7 * cost(draw(start, FRAME, window)[..., 1], wanted)
    one = np.zeros((*wanted.shape, 3))
    one[..., 1] = 1.0
    fitted, _ = fit_bezier(start, np.repeat(wanted[..., None], 3, 2), one, FRAME, window)
    # with fewer pictures, a hundredth of the error; its cost is the sum of squares
    assert fitted.evaluations < found.evaluations
    assert fitted.cost / wanted.size < 0.01 * found.cost


def test_edges_of_a_plane_are_none():
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
    curve = compress(angles, values, np.full(40, 0.05), (3.0, 21.0))
    assert len(curve.coefficients) - 1 <= order + 1
    assert np.abs(np.polynomial.polynomial.polyval(z, curve.coefficients) - truth).max() < 0.1


def test_in_whatever_order_ghosts_come_the_fit_is_the_same():
    shown = views(GHOSTS[:3], angles=FEW[::2])
    replays = []
    for order in ((0, 1, 2), (2, 0, 1)):
        starts = [replace(GHOSTS[k], numbers=GHOSTS[k].numbers.copy()) for k in order]
        for one in starts:
            one.numbers[0] *= 1.02
        found = [Found((one,) * 3, 0, len(shown) - 1) for one in starts]
        settled = settle(found, shown, how=Settling(rounds=1, most=Growth(order=1, discs=0)))
        replays.append(np.stack([sum(render(one.shapes[1], view) for one in settled) for view in shown]))
    # sums of light differ in their last digits; fits go by the light
    assert np.sqrt(np.mean((replays[1] - replays[0]) ** 2)) < 1e-3 * np.sqrt(np.mean(replays[0] ** 2))


def test_a_rim_that_leaves_nothing_to_fit_is_none(monkeypatch):
    """It had been tried again and again, for ever."""
    seen = views(GHOSTS[1:2], angles=np.linspace(2.0, LARGEST, 6))
    gone = Shape(GHOSTS[1].numbers.copy(), 1)
    gone.numbers[:4] = 1e5, 0.0, 0.0, 0.0
    gone.numbers[FIRST_DISC : FIRST_DISC + 3] = 0.0, 0.0, 1.0
    assert not patches_of(gone, seen, 1)
    real = growing.cost_of
    monkeypatch.setattr(growing, "_with_rim", lambda *_: gone)
    monkeypatch.setattr(
        growing, "cost_of", lambda shape, *told, **how: 0.0 if shape is gone else real(shape, *told, **how)
    )
    fit = grow(GHOSTS[1], seen, 1, most=Growth(order=1, discs=1))
    assert fit is not None
    assert fit.shape.discs == 0


def test_of_light_beyond_the_frame_an_even_background_tells_nothing():
    """With one for each view, all that a ghost without a border in the picture adds would be nobody's."""
    wide, start = shape(0.0, 400.0, 0.3), shape(0.0, 400.0, 0.2)
    for each in (wide, start):
        each.numbers[1:10] = each.numbers[11:20] = each.numbers[21:] = 0.0
    seen = views([wide], angles=np.linspace(2.0, LARGEST, 6))
    fits = {offset: grow(start, seen, 1, most=Growth(order=0, discs=0, offset=offset)) for offset in (True, False)}
    assert render(fits[False].shape, seen[0]).mean() == pytest.approx(0.3, rel=0.05)
    assert abs(render(fits[True].shape, seen[0]).mean() - 0.3) > 0.05
