"""Which ghosts are the brightest of a pixel: against sorting all of them, and against their own layers."""

import numpy as np
import pytest

from flarewright import Art, Camera, Light, Output, Project, Quality, Rule, ghosts, render
from flarewright.errors import ProjectError
from flarewright.model import Scatter
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.render.image.ghost_ranking import GhostRanking, rank_remarks
from flarewright.render.scattering import scatter_pass

SIZE = (64, 36)


def pictures(number, seed=0):
    """Return windows and lights of objects, dark in half of their pixels."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(number):
        x, y, w, h = (int(k) for k in rng.integers((-8, -8, 1, 1), (50, 30, 60, 40)))
        light = rng.random((h, w)).astype(np.float32)
        found.append(((x, y, w, h), np.where(light > 0.5, light, np.float32(0.0))))
    return found


def whole(window, light):
    """Return a light in the frame of the picture, 0 outside its window."""
    (x, y, w, h), (width, height) = window, SIZE
    padded = np.zeros((height + 200, width + 200), np.float32)
    padded[100 + y : 100 + y + h, 100 + x : 100 + x + w] = light
    return padded[100 : 100 + height, 100 : 100 + width]


def ranked(found, ranks):
    ranking = GhostRanking(SIZE, ranks)
    for k, (window, light) in enumerate(found):
        ranking.add(str(k), light, window)
    return ranking


def test_the_ranks_are_those_of_sorting_all_objects():
    found = pictures(15)
    every = np.array([whole(*one) for one in found])
    matte = ranked(found, 4).matte(every.sum(axis=0))
    order = np.argsort(-every, axis=0, kind="stable")[:4]
    light = np.take_along_axis(every, order, axis=0)
    np.testing.assert_array_equal(matte.light, light)
    np.testing.assert_array_equal(matte.objects, np.where(light > 0.0, order, -1))
    assert matte.names == tuple(str(k) for k in range(15))
    assert np.all(matte.coverage.sum(axis=0) <= 1.0 + 1e-6)


def test_the_sum_of_mattes_is_the_matte_of_the_sum_where_ranks_suffice():
    first, second = pictures(6, 1), pictures(6, 2)
    # other numbers for the same names, as in another sub-frame
    both = GhostRanking(SIZE, 6)
    both.merge(ranked(first, 6).matte(np.zeros(SIZE[::-1], np.float32)))
    other = GhostRanking(SIZE, 6)
    for k in reversed(range(6)):
        other.add(str(k), second[k][1], second[k][0])
    both.merge(other.matte(np.zeros(SIZE[::-1], np.float32)))
    total = np.array([whole(*a) + whole(*b) for a, b in zip(first, second, strict=True)])
    matte = both.matte(total.sum(axis=0))
    assert np.all(np.diff(matte.light, axis=0) <= 0.0)
    for k in range(6):
        own = np.where(matte.objects == matte.names.index(str(k)), matte.light, 0.0).sum(axis=0)
        np.testing.assert_allclose(own, total[k], atol=1e-6)


def project(mode="draft", **output):
    quality = Quality(mode=mode, wavelengths=3, ringing="off")
    return Project(
        lens="triplet-pestrecov", f_number=11, lights=[Light(field_deg=(9, 5))], camera=Camera(size_px=SIZE),
        quality=quality, output=Output(**{"starburst": False, "layers": "ghosts", **output}),
        art=Art(gain={"ghosts": 2.0}, rules=(Rule(select="2-0", gain=3.0), Rule(select="5-1", enable=False))),
    )  # fmt: skip


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_a_matte_times_the_picture_is_the_ghost_alone(mode):
    drawn = render(project(mode, matte="ghosts", matte_ranks=16), threads=3)
    matte, weights = drawn.matte, luminance_weights("rec709")
    beauty, *layers = drawn.layers
    luminance = beauty.pixels @ weights
    singles = {layer.name.removeprefix("ghost."): layer for layer in layers if layer.name.startswith("ghost.")}
    assert set(singles) == set(matte.names)
    for name, layer in singles.items():
        alone = whole(layer.window, (layer.pixels @ weights).astype(np.float32))
        np.testing.assert_allclose(matte.share(name) * luminance, alone, atol=2e-6 * float(luminance.max()), rtol=1e-4)
    np.testing.assert_allclose(matte.coverage.sum(axis=0)[luminance > 0.0], 1.0, atol=1e-5)
    assert rank_remarks(matte) == ()
    listed = {row.name for row in ghosts("triplet-pestrecov", (9, 5), f_number=11).ghosts}
    assert set(matte.names) <= listed
    # a layer for each ghost draws the same picture
    np.testing.assert_array_equal(beauty.pixels, render(project(mode), threads=1).layers[0].pixels)


def test_few_ranks_keep_the_brightest_and_no_layers(monkeypatch):
    every = render(project(matte="ghosts", matte_ranks=16)).matte
    drawn = render(project(matte="ghosts", matte_ranks=2, layers="beauty"), threads=1)
    assert [layer.name for layer in drawn.layers] == ["beauty"]
    np.testing.assert_array_equal(drawn.matte.light, every.light[:2])
    np.testing.assert_array_equal(drawn.matte.objects, every.objects[:2])
    np.testing.assert_allclose(drawn.matte.total, every.total, rtol=1e-6)
    assert any("2 ghosts a pixel" in remark and "--matte-ranks" in remark for remark in drawn.remarks)


def test_scatter_is_an_object_among_the_ghosts(monkeypatch):
    # scatter at few points from few rays
    monkeypatch.setattr(scatter_pass, "FINE", scatter_pass.FINE._replace(rays=6, rings=12, spokes=12, fan=8))
    of_all = project(matte="ghosts", matte_ranks=16).replace(scatter=Scatter(model="harvey-shack"))
    drawn = render(of_all)
    scatter = next(layer for layer in drawn.layers if layer.name == "scatter")
    lit = whole(scatter.window, (scatter.pixels @ luminance_weights("rec709")).astype(np.float32))
    np.testing.assert_allclose(drawn.matte.share("scatter") * drawn.matte.total, lit, rtol=1e-4, atol=1e-9)


def test_pictures_without_single_ghosts_have_no_matte():
    with pytest.raises(ProjectError, match="reference quality does not draw"):
        render(project("reference", matte="ghosts"))
    with pytest.raises(ValueError, match="give an even number, such as 8"):
        Output(matte_ranks=7)
