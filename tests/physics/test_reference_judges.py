"""Final quality against the reference: every block of 16 x 16 pixels and every path, with the variance."""

import numpy as np
import path_rays
import pytest
from judge import blocks_of, deviations, judge, probabilities
from path_rays import path_flux
from scipy import stats

from flarewright.kernels.montecarlo.forward import IN_PICTURE
from flarewright.model import Camera, Everywhere, Iris, Light, Lines, Output, Project, Quality, QuarterWave, Surface
from flarewright.render.reference.batches import ray_source, run_batch
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

D_LINE = Lines(lines=((587.56, 1.0),))

LENSES = {
    "heliar-tronnier": (10.0, 5.0),
    "tessar-brendel": (9.0, 4.0),
    "canon-28-80": (10.0, 5.0),
    "biotar-50-f1.4": (8.0, 4.0),
    "double-gauss-tronnier": (8.0, 4.0),
    "flektogon-35": (14.0, 8.0),
    "nikkor-180-ed": (3.0, 1.5),
    "nikon-28-75": (15.0, 8.0),
}

# significance level: there are thirty-two comparisons
CHANCE = 1e-4
# allowed error of a path's flux, apart from chance, for paths above this part of all ghosts
PATH, FAINTEST = 5e-3, 1e-3
# and above this, with rays of one path alone
FAINT = 1e-4


def scene(lens, field, f_number=None, *, size=(256, 160), light=None, wavelengths=1, **parts):
    return Project(
        lens=lens,
        f_number=f_number,
        lights=(Light(field_deg=field, spectrum=D_LINE) if light is None else light,),
        camera=Camera(size_px=size),
        quality=Quality(wavelengths=wavelengths, bridge=False, ringing="off"),
        output=Output(layers="ghosts", starburst=False),
        **parts,
    )


def picture(layer, size_px):
    """Return a layer's pixels at the size of the picture."""
    whole = np.zeros((size_px[1], size_px[0], 3), np.float32)
    x, y, w, h = layer.window
    whole[y : y + h, x : x + w] = layer.pixels
    return whole


def assert_paths_agree(judged):
    """Every path above a thousandth of the ghosts' flux: within half a percent, apart from chance."""
    flux = judged.total[1]
    worth = {name: path for name, path in judged.paths.items() if path[1] > FAINTEST * flux}
    assert sum(mean for _, mean, _ in worth.values()) > 0.9 * flux
    # bound of a t variable for the worst of all paths
    bound = stats.t.isf(CHANCE / (2 * len(worth)), judged.batches - 1)
    for name, (final, mean, error) in worth.items():
        assert abs(final - mean) < PATH * mean + bound * error, name


def reported_of_paths(judged):
    """Return how many paths are compared, how well the reference knows them, and the largest error."""
    flux = judged.total[1]
    worth = {name: path for name, path in judged.paths.items() if path[1] > FAINTEST * flux}
    off = {name: (final / mean - 1.0, error / mean) for name, (final, mean, error) in worth.items()}
    known = {name: pair for name, pair in off.items() if pair[1] < PATH / 4.0}
    share = np.mean([abs(deviation) < PATH + 2.0 * error for deviation, error in off.values()])
    reported = (
        f"{len(worth)} paths, {share:.0%} within {PATH:.1%} and two errors, {len(known)} known to {PATH / 4.0:.3%}"
    )
    if not known:
        return reported
    worst = max(known, key=lambda name: abs(known[name][0]))
    return f"{reported}, the worst of those ({worst}) {known[worst][0]:+.2%} +- {known[worst][1]:.2%} off"


@pytest.fixture(scope="module", params=[24, pytest.param(64, marks=pytest.mark.slow)])
def small(request):
    """A coated triplet with a pentagonal iris, two wavelengths, a small picture; batches of the reference."""
    coated = Everywhere(coating=QuarterWave(center_wavelength_nm=550.0))
    project = scene(
        "triplet-pestrecov", (8.0, 4.0), 4.0, size=(96, 64), coating=coated, iris=Iris(blades=5), wavelengths=2,
        light=Light(field_deg=(8.0, 4.0)),
    )  # fmt: skip
    return project, judge(project, batches=request.param, side=64)


def test_a_small_picture_agrees(small):
    _, judged = small
    everywhere, worst = probabilities(judged)
    assert everywhere > CHANCE
    assert worst > CHANCE
    assert_paths_agree(judged)
    final, mean, error = judged.total
    assert abs(final - mean) < 2e-3 * mean + 4.0 * error


def test_wrong_pictures_are_refused(small):
    """The test is sharp: it detects 5 % too bright, a missing path, a shift by half a block, a mirrored picture."""
    project, judged = small
    layers = render(project).layers
    ghosts = next(layer for layer in layers if layer.name == "ghosts")
    assert blocks_of(ghosts.pixels, ghosts.window, project) == pytest.approx(judged.final)
    whole = picture(ghosts, (96, 64))
    shifted = np.roll(whole, 8, axis=1)
    wrong = [
        1.05 * judged.final,
        blocks_of(shifted, (0, 0, 96, 64), project),
        blocks_of(whole[:, ::-1], (0, 0, 96, 64), project),
    ]
    third = sorted((layer for layer in layers if layer.name.startswith("ghost.")),
                   key=lambda layer: -float(layer.about["flux_mm2"]))[2]  # fmt: skip
    wrong.append(judged.final - blocks_of(third.pixels, third.window, project))
    for blocks in wrong:
        everywhere, worst = probabilities(judged, blocks)
        assert min(everywhere, worst) < 1e-6


def two_singlets():
    """Return the triplet without its middle lens, which has 24 four-reflection paths instead of 190."""
    whole = load_lens("triplet-pestrecov")
    rows = (*whole.rows[:2], *whole.rows[4:])
    return whole.replace(name="two singlets", rows=rows, coating_presets={}, sensor_distance=None)


# two singlets have paths of the same kinds; finding the faintest of the triplet takes seconds
@pytest.fixture(scope="module", params=["two singlets", pytest.param("triplet", marks=pytest.mark.slow)])
def fours(request):
    """All relevant four-reflection ghosts of an uncoated lens; a side of the reference's batches."""
    lens, limit, side = (two_singlets(), 4e-6, 32) if request.param != "triplet" else ("triplet-pestrecov", 1e-6, 64)
    project = scene(lens, (8.0, 4.0), 4.0, size=(96, 64))
    project = project.replace(quality=project.quality.replace(orders=4, order4_limit=limit))
    return project, render(project), side


def test_ghosts_of_four_reflections_agree(fours):
    """Their sum, block by block, against rays that end after the fourth reflection."""
    project, rendering, side = fours
    layers = {layer.name: layer for layer in rendering.layers}
    facts = rendering.summary["ghosts.order4"]
    assert facts["drawn"] > (130 if len(resolve_project(project).lens.rows) > 5 else 20)
    assert facts["left_out_share"] < 1e-3
    singles = [layer for name, layer in layers.items() if name.count("-") == 3]
    assert len(singles) == facts["drawn"]
    ghosts = layers["ghosts.order4"]
    final = blocks_of(ghosts.pixels, ghosts.window, project)
    assert sum(float(layer.about["flux_mm2"]) for layer in singles) == pytest.approx(final.sum(), rel=1e-5)
    pairs = project.replace(quality=project.quality.replace(orders=2))
    judged = judge(pairs, batches=64, side=side, fours=True)
    everywhere, worst = probabilities(judged, final)
    assert everywhere > CHANCE
    assert worst > CHANCE
    _, mean, error = judged.total
    assert error < 0.02 * mean
    assert abs(final.sum() - mean) < 5e-3 * mean + 4.0 * error
    # without them the picture is otherwise the same
    two = {layer.name: layer for layer in render(pairs).layers}
    np.testing.assert_array_equal(two["ghosts"].pixels, layers["ghosts"].pixels)
    np.testing.assert_array_equal(
        layers["beauty"].pixels, two["beauty"].pixels + picture(ghosts, project.camera.size_px)
    )


def test_every_path_of_four_reflections_agrees(fours):
    """Flux of each path against the reference's rays along it."""
    project, rendering, side = fours
    drawn = {str(layer.about["path"]): float(layer.about["flux_mm2"]) for layer in rendering.layers
             if layer.name.count("-") == 3}  # fmt: skip
    settled = resolve_project(project)
    shots = make_shots(settled, make_opening(settled, None))
    limit = project.quality.order4_limit
    sources = [ray_source(shot, 7, side=side, light=k, followed=(4.0, 0.0)) for k, shot in enumerate(shots)]
    batches, count = 24, len(settled.lens.rows)
    found = np.zeros((batches, count**4))
    two = 0.0
    for batch in range(batches):
        result = run_batch(sources, batch, picture=False, fours=1000)
        np.add.at(found[batch], result["fours"][:, 0].astype(int), result["fours"][:, 1])
        two += float(result["figures"][IN_PICTURE + 1]) / batches
    mean, error = found.mean(axis=0), found.std(axis=0, ddof=1) / np.sqrt(batches)
    keys = {"-".join(map(str, np.unravel_index(k, (count,) * 4))): k for k in np.flatnonzero(mean)}
    # no path clearly above the limit is missing
    assert {name for name, k in keys.items() if mean[k] - 4.0 * error[k] > 1.3 * limit * two} <= set(drawn)
    bright = {name: flux for name, flux in drawn.items() if flux > 3e-5 * two}
    assert len(bright) > (80 if len(settled.lens.rows) > 5 else 20)
    bound = stats.t.isf(CHANCE / (2 * len(bright)), batches - 1)
    for name, flux in bright.items():
        k = keys[name]
        assert abs(flux - mean[k]) < PATH * mean[k] + bound * error[k], name


def test_a_remark_states_the_missing_four_reflection_flux():
    project = scene("triplet-pestrecov", (8.0, 4.0), 8.0, size=(48, 32))
    found = {}
    for limit in (1e-3, 1e-4):
        quality = project.quality.replace(orders=4, order4_limit=limit)
        rendering = render(project.replace(quality=quality, output=Output(starburst=False)))
        facts = found[limit] = rendering.summary["ghosts.order4"]
        assert [layer.name for layer in rendering.layers] == ["beauty", "ghosts", "ghosts.order4"]
        assert any("ghosts of four reflections were drawn" in remark for remark in rendering.remarks)
        assert facts["left_out"] > 0
    assert found[1e-3]["drawn"] < found[1e-4]["drawn"]
    assert found[1e-3]["left_out_share"] > found[1e-4]["left_out_share"] > 0.0


def judged_paths(project, batches=8):
    """Return the flux of every path from final quality and from path rays of the reference, and its error."""
    settled = resolve_project(project)
    shot = make_shots(settled, make_opening(settled, None))[0]
    final = {str(layer.about["path"]): float(layer.about["flux_mm2"]) for layer in render(project).layers
             if layer.name.startswith("ghost.")}  # fmt: skip
    rows = [k for k, row in enumerate(settled.lens.rows) if isinstance(row, Surface)]
    pairs = [(j, i) for j in rows for i in rows if i < j]
    return {f"{j}-{i}": (final.get(f"{j}-{i}", 0.0), *path_flux(shot, j, i, batches)) for j, i in pairs}


@pytest.mark.slow
@pytest.mark.parametrize(("side", "points"), [(32, 6_000), (64, 12_000)])
def test_rays_of_one_path_are_the_references(side, points, monkeypatch):
    """All paths at once, and each separately: by z-test."""
    monkeypatch.setattr(path_rays, "POINTS", points)
    project = scene("triplet-pestrecov", (8.0, 4.0), 4.0, size=(96, 64), iris=Iris(blades=5))
    judged = judge(project, batches=64, side=side)
    alone = judged_paths(project)
    z = []
    for name, (_, mean, error) in judged.paths.items():
        if mean > 0.0:
            z.append((alone[name][1] - mean) / np.hypot(alone[name][2], error))
    assert len(z) > 10
    assert 2.0 * len(z) * stats.t.sf(np.abs(z).max(), 7) > CHANCE
    # each path is known much better
    assert all(error < 2e-3 * mean for _, mean, error in alone.values() if mean > 1e-6 * judged.total[1])


@pytest.mark.slow
@pytest.mark.parametrize("stopped", [False, True])
@pytest.mark.parametrize("lens", LENSES)
def test_every_path_agrees(lens, stopped):
    """Every path above 1e-4 of the ghost light in the picture: within half a percent, apart from chance.

    The zooms have at least 351 paths and take minutes.
    """
    widest = load_lens(lens).f_number
    f_number = (4.0 if widest < 2.0 else 2.8) * widest if stopped else None
    paths = judged_paths(scene(lens, LENSES[lens], f_number))
    flux = sum(mean for _, mean, _ in paths.values())
    # a path whose flux comes from one lucky ray is not known to be so bright
    worth = {name: path for name, path in paths.items() if max(path[0], path[1] - 3.0 * path[2]) > FAINT * flux}
    worst = max(worth, key=lambda name: abs(worth[name][0] / worth[name][1] - 1.0))
    final, mean, error = worth[worst]
    print(
        f"{lens} {'stopped down' if stopped else 'open'}: {len(worth)} of {len(paths)} paths, the worst ({worst}, "
        f"{mean / flux:.1e}) {final / mean - 1.0:+.2%} +- {error / mean:.2%}"
    )
    bound = stats.t.isf(CHANCE / (2 * len(worth)), 7)
    for name, (final, mean, error) in worth.items():
        assert abs(final - mean) < PATH * mean + bound * error, name
        # so that chance cannot hide an error
        assert error < PATH * mean, name
    assert sum(final for final, _, _ in paths.values()) == pytest.approx(flux, rel=2e-3)


@pytest.mark.slow
def test_a_lens_out_of_true_agrees():
    """Aspheric, slightly cylindrical, with a decentred and tilted rear surface: no symmetry."""
    lens = load_lens("triplet-pestrecov")
    rows = list(lens.rows)
    rows[0] = rows[0].replace(asphere=(-2e-6, 1e-9))
    rows[1] = rows[1].replace(curvature_x=0.9 * rows[1].curvature)
    last = max(k for k, row in enumerate(rows) if isinstance(row, Surface))
    rows[last] = rows[last].replace(decentre=(0.3, -0.2), tilt_deg=(0.4, 0.7))
    judged = judge(scene(lens.replace(rows=tuple(rows)), (8.0, 4.0), 4.0), batches=64, side=96)
    everywhere, worst = probabilities(judged)
    assert everywhere > CHANCE
    assert worst > CHANCE
    assert_paths_agree(judged)


@pytest.mark.slow
@pytest.mark.parametrize("stopped", [False, True])
@pytest.mark.parametrize("lens", LENSES)
def test_lenses_agree_block_by_block(lens, stopped):
    widest = load_lens(lens).f_number
    f_number = (4.0 if widest < 2.0 else 2.8) * widest if stopped else None
    judged = judge(scene(lens, LENSES[lens], f_number), batches=64, side=192 if stopped else 128)
    everywhere, worst = probabilities(judged)
    final, mean, error = judged.total
    print(
        f"{lens} {'stopped down' if stopped else 'open'}: total {final / mean - 1.0:+.2%} +- {error / mean:.2%}, "
        f"{deviations(judged).size} blocks p = {everywhere:.3f}, worst p = {worst:.3f}, "
        f"four and more reflections {judged.high_share:.2%}; {reported_of_paths(judged)}"
    )
    assert everywhere > CHANCE
    assert worst > CHANCE
    assert abs(final - mean) < 2e-3 * mean + 4.0 * error
    assert_paths_agree(judged)
    # higher orders always exist and are never the larger part
    assert 0.0 < judged.high_share < 0.3
