"""Ghosts of four reflections: which exist, which are drawn, and how art rules apply to them."""

from __future__ import annotations

from itertools import product
from math import ceil

import numpy as np
import pytest
from pupil_sum import mono, picture, scene

from flarewright.errors import ProjectError
from flarewright.kernels.tracing.sequential import REFLECT
from flarewright.model import Art, Camera, Rule
from flarewright.optics.lens.paths import four_path, ghost_paths
from flarewright.render.ghosts.final_ghosts import _level
from flarewright.render.ghosts.traced_ghosts import find_final
from flarewright.render.reference import four_reflections
from flarewright.render.reference.four_reflections import find_four_reflections
from flarewright.render.reference.search_sums import HITS, Tally
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

SIZE = (96, 64)


def project(*rules, gain=None, limit=1e-3, light=None, lens="triplet-pestrecov", **parts):
    made = scene(
        lens, light or mono((8.0, 5.0)), size_px=SIZE, sensor_mm=(150.0, 100.0), layers="ghosts",
        starburst=False, wavelengths=1, **parts,
    )  # fmt: skip
    quality = made.quality.replace(orders=4, order4_limit=limit)
    return made.replace(art=Art(rules=rules, gain=gain or {}), quality=quality)


def by_name(rendering):
    return {layer.name: layer for layer in rendering.layers}


def fours_of(rendering):
    return {name.removeprefix("ghost.") for name in by_name(rendering) if name.count("-") == 3}


def searched(given, limit=1e-4, **how):
    settled = resolve_project(given)
    return settled, find_four_reflections(
        settled.lens, make_shots(settled, make_opening(settled, None)), limit, 0, **how
    )


@pytest.fixture(scope="module")
def plain():
    return render(project())


# --- paths


def test_steps_of_a_path():
    """To row 6, back to 2, on to 8, back to 0, out: steps go to neighbours, mirrors reverse the light."""
    lens = load_lens("heliar-tronnier")
    path = four_path(lens, 6, 2, 8, 0)
    assert path.name == "6-2-8-0"
    np.testing.assert_array_equal(np.abs(np.diff(path.rows)), 1)
    assert tuple(path.rows[path.actions == REFLECT]) == path.mirrors == (6, 2, 8, 0)
    assert (path.rows[0], path.rows[-1]) == (0, len(lens.rows) - 1)
    assert path.stop_crossings == 5


def test_the_search_meets_paths_that_exist_and_no_others():
    settled, found = searched(project(lens="heliar-tronnier"))
    rows = range(len(settled.lens.rows))
    mirrors = [k for k in rows if k != settled.lens.stop_row]
    possible = {f"{j}-{i}-{k}-{m}" for j, i, k, m in product(mirrors, repeat=4) if i < j and k > i and m < k}
    assert len(found.flux) > 100
    assert set(found.flux) <= possible
    assert {path.name for path in found.paths} <= possible


def test_the_search_depends_on_neither_threads_nor_room(monkeypatch):
    _, one = searched(project(), threads=1)
    monkeypatch.setattr(four_reflections, "ROOM", 10)
    _, other = searched(project(), threads=3)
    assert [path.name for path in one.paths] == [path.name for path in other.paths]
    assert one.flux == other.flux


def test_a_lower_limit_draws_more_and_leaves_out_less(plain):
    more = render(project(limit=2e-4))
    assert fours_of(plain) < fours_of(more)
    assert plain.summary["ghosts.order4"]["left_out_share"] > more.summary["ghosts.order4"]["left_out_share"] > 0.0


def test_a_limit_too_low_says_so(monkeypatch):
    monkeypatch.setattr(four_reflections, "MOST_BATCHES", 5)
    assert any("may have been missed" in remark for remark in render(project(limit=1e-5)).remarks)


@pytest.mark.filterwarnings("error")
def test_a_limit_whose_quotient_overflows_takes_the_most_batches():
    tally = Tally()
    tally.add(np.array([[7.0, 0.5], [7.0, 0.5]]), 10.0)
    assert [tally.batches_for(limit) for limit in (1e-320, 5e-324)] == [10**9] * 2
    assert tally.batches_for(0.01) == ceil(HITS * 0.5 / 0.1)


def test_same_side_paths_stay_on_one_side():
    stop = load_lens("heliar-tronnier").stop_row
    names = fours_of(render(project(lens="heliar-tronnier", limit=2e-4, paths="same-side")))
    assert names
    for name in names:
        assert len({int(row) < stop for row in name.split("-")}) == 1


def test_draft_quality_has_none_and_says_so():
    drafted = render(project(mode="draft"))
    assert "ghosts.order4" not in by_name(drafted)
    assert any("draft quality has no ghosts of four reflections" in remark for remark in drafted.remarks)


def test_a_light_that_brings_no_ghosts():
    """A light that is switched off: there is nothing to divide by."""
    dark = render(project(light=mono((8.0, 5.0), 0.0)))
    facts = dark.summary["ghosts.order4"]
    assert facts["drawn"] == 0
    assert facts["left_out_share"] == facts["share_of_two_reflections"] == 0.0
    assert not by_name(dark)["ghosts.order4"].pixels.any()


def test_two_lights_are_one_and_the_other(plain):
    lights = (mono((8.0, 5.0)), mono((-3.0, 4.0)))
    # the first of them alone is the plain picture
    alone = [by_name(found)["ghosts.order4"] for found in (plain, render(project(light=lights[1])))]
    both = project().replace(lights=lights)
    together = by_name(render(both))["ghosts.order4"]
    # a path that is bright for one light is drawn for both
    np.testing.assert_allclose(
        picture(together, SIZE).sum(), sum(picture(layer, SIZE).sum() for layer in alone), rtol=0.05
    )


def test_the_sensor_is_one_of_the_mirrors():
    shiny = project(limit=3e-4, light=mono((1.0, 0.5))).replace(
        camera=Camera(size_px=SIZE, sensor_mm=(150.0, 100.0), sensor_reflectance=0.3)
    )
    names = fours_of(render(shiny))
    assert any(name.startswith("sensor-") for name in names)
    assert any("-sensor-" in name for name in names)


# --- art direction


def test_rules_reach_them(plain):
    names = fours_of(plain)
    some = sorted(names)[0]
    row = some.split("-")[2]
    assert fours_of(render(project(Rule(select=some, enable=False)))) == names - {some}
    left = {name for name in names if row not in name.split("-")}
    assert fours_of(render(project(Rule(select=f"row:{row}", enable=False)))) == left
    # only the selected two-reflection ghost remains
    assert not fours_of(render(project(Rule(select="not 3-1", enable=False))))
    assert fours_of(render(project(Rule(select="brightest:3", gain=0.5)))) == names
    bright = by_name(render(project(Rule(select=some, gain=3.0))))[f"ghost.{some}"]
    np.testing.assert_allclose(bright.pixels, 3.0 * by_name(plain)[f"ghost.{some}"].pixels, rtol=1e-5)


def test_the_gain_of_the_pass_is_theirs_too(plain):
    graded = by_name(render(project(gain={"ghosts": 2.0})))
    np.testing.assert_allclose(graded["ghosts.order4"].pixels, 2.0 * by_name(plain)["ghosts.order4"].pixels)


@pytest.mark.parametrize("name", ["4-1-2-3", "4-1-1-0", "4-1-20-3", "4-1-5-3", "4-1-3", "4-1-sensor-2"])
def test_names_of_no_path_are_refused(name):
    with pytest.raises(ProjectError, match=r"has no ghost|the sensor reflects"):
        render(project(Rule(select=name, gain=2.0), lens="heliar-tronnier"))


def test_four_reflections_are_named_only_where_there_are_some():
    two = project(Rule(select="4-1-3-2", gain=2.0), lens="heliar-tronnier")
    with pytest.raises(ProjectError, match="has no ghost 4-1-3-2"):
        render(two.replace(quality=two.quality.replace(orders=2)))


def test_a_near_light_is_judged_by_the_irradiance_that_it_gives():
    """Its ghosts were weighed without the growth of its irradiance towards the pupil, the limit with it."""
    near = project(lens="canon-28-80", light=mono((5.0, 0.0)).replace(distance=60.0))
    settled = resolve_project(near)
    shots = make_shots(settled, make_opening(settled, None))
    assert shots[0].incidence.falloff > 2.0
    paths = ghost_paths(settled.lens)[:40]
    found = [item for path in paths if (item := find_final(shots[0], path)) is not None]
    assert _level([found], plain=True) == pytest.approx(_level([found]), rel=1e-12)


def test_an_interrupted_sum_holds_whole_batches_only(monkeypatch):
    random = np.random.default_rng(1)
    fours = np.column_stack([random.integers(0, 40, 200), random.random(200)])
    tally, whole = Tally(), Tally()
    for each in (tally, whole):
        each.add(fours, 1.0)

    def interrupted(values, *_, **__):
        for number, value in enumerate(zip(*values, strict=True)):
            if number == 20:
                raise KeyboardInterrupt
            yield value

    monkeypatch.setattr("flarewright.render.reference.search_sums.zip", lambda *v, **k: interrupted(v), raising=False)
    with pytest.raises(KeyboardInterrupt):
        tally.add(fours, 1.0)
    monkeypatch.undo()
    for one, other in zip(tally.arrays(), whole.arrays(), strict=True):
        assert np.array_equal(one, other)
