"""Additions to a lens and its moving parts: filter, cover glass, sensor mirror, zoom, focus, imperfection."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import pytest
from prescriptions import HELIAR, ghost_table_of, lens

from flarewright.errors import ProjectError
from flarewright.model import (
    Bare,
    Camera,
    Everywhere,
    Imperfection,
    Light,
    Plate,
    Position,
    Project,
    Quality,
    Surface,
)
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.lens.tolerances import glass_groups
from flarewright.optics.lens.zoom import at_position
from flarewright.render.analysis import ghosts, paraxial
from flarewright.render.scene.direct_image import defocus_mm
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import build, load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

FIELD = (3.0, 2.0)
GLASS = Plate(thickness=2.0, gap=0.5, n_d=1.5, v_d=60.0)
FRESNEL = 0.04  # of that glass at right angles


@pytest.fixture(scope="module")
def heliar():
    return lens(HELIAR, 4.5)


@contextmanager
def only(*names):
    """Make ghost tables compute only some paths."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "flarewright.optics.rays.ghost_table.ghost_paths",
            lambda *which, **how: [path for path in ghost_paths(*which, **how) if path.name in names],
        )
        yield


def named(table):
    return {f"{row.first_reflection}-{row.second_reflection}": row for row in table.ghosts}


@pytest.fixture(scope="module")
def plain(heliar):
    return ghosts(heliar, FIELD, coating=Everywhere(coating=Bare()), f_number=8.0)


def test_a_filter_dims_the_picture_and_mirrors_it_onto_itself(heliar, plain):
    with only("1-0", "6-3"):
        table = ghosts(heliar, FIELD, coating=Everywhere(coating=Bare()), f_number=8.0, filter_plate=GLASS)
    assert table.efl == pytest.approx(plain.efl, rel=1e-12)
    assert table.sensor_distance == pytest.approx(plain.sensor_distance, rel=1e-12)
    # each face transmits 0.96 along the axis
    assert table.direct.throughput_mm2 == pytest.approx(plain.direct.throughput_mm2 * (1.0 - FRESNEL) ** 2, rel=1e-3)
    assert table.direct.centroid_mm == pytest.approx(plain.direct.centroid_mm, abs=1e-4)
    own = named(table)["1-0"]
    assert own.throughput_mm2 == pytest.approx(table.direct.throughput_mm2 * FRESNEL**2, rel=2e-3)
    assert own.centroid_mm == pytest.approx(table.direct.centroid_mm, abs=1e-3)
    # row numbers of the lens' own ghosts rise by two
    assert named(table)["6-3"].throughput_mm2 == pytest.approx(
        named(plain)["4-1"].throughput_mm2 * (1.0 - FRESNEL) ** 2, rel=2e-3
    )


def test_a_cover_glass_moves_the_focus_back_by_its_part(heliar):
    before = first_order(heliar)
    built = build(heliar, cover_glass=GLASS)
    order = first_order(built.lens)
    behind = built.lens.rows[-3].thickness + GLASS.thickness + order.sensor_distance
    assert behind == pytest.approx(before.sensor_distance + GLASS.thickness * (1.0 - 1.0 / 1.5), rel=1e-12)
    assert order.sensor_distance == pytest.approx(GLASS.gap)
    # and the sensor is in focus
    assert order.bfl == pytest.approx(order.sensor_distance, abs=1e-9)
    near = build(heliar, cover_glass=GLASS, focus_distance=2000.0)
    assert first_order(near.lens, focus_distance=2000.0).sensor_distance == pytest.approx(GLASS.gap, abs=1e-9)
    stated = build(heliar, cover_glass=GLASS, sensor_distance=90.0).lens
    assert stated.rows[-3].thickness == pytest.approx(90.0 - 2.5)


def test_the_sensor_mirrors_its_image_back_onto_itself():
    # fewer ghosts than those of the Heliar
    triplet = load_lens("triplet-pestrecov")

    def shot(**more):
        return ghosts(triplet, FIELD, coating=Everywhere(coating=Bare()), f_number=16.0, cover_glass=GLASS, **more)

    dull, bright, brighter = shot(), shot(sensor_reflectance=0.05), shot(sensor_reflectance=0.1)
    assert not any("sensor" in name for name in named(dull))
    mirrored = {name: row for name, row in named(bright).items() if name.startswith("sensor-")}
    assert len(mirrored) == sum(isinstance(row, Surface) for row in triplet.rows) + 2
    # all other rows are unchanged
    for name, row in named(dull).items():
        assert named(bright)[name] == row
    for name, row in mirrored.items():
        assert named(brighter)[name].throughput_mm2 == pytest.approx(2.0 * row.throughput_mm2, rel=1e-9)
    # between the sensor and the glass' rear face: 0.05 of the light, 0.04 of that; its focus is twice the gap ahead
    rear, front = mirrored["sensor-8"], mirrored["sensor-7"]
    assert rear.throughput_mm2 == pytest.approx(bright.direct.throughput_mm2 * 0.05 * FRESNEL, rel=2e-3)
    assert rear.focus_distance_mm == pytest.approx(-2.0 * GLASS.gap, abs=1e-6)
    assert front.focus_distance_mm == pytest.approx(-2.0 * (GLASS.gap + GLASS.thickness / 1.5), abs=1e-6)


def test_paths_of_the_sensor_are_counted(heliar):
    assert len(ghost_paths(heliar)) == 28
    assert len(ghost_paths(heliar, sensor=True)) == 28 + 8
    assert len(ghost_paths(heliar, "same-side", sensor=True)) == 13 + 3
    assert ghost_paths(heliar, sensor=True)[-1].name == "sensor-8"


def test_a_tilted_glass_throws_its_reflection_aside_by_twice_the_tilt_times_the_lever(heliar):
    """First order: a mirror tilted by a turns the light by 2 a, which lands 2 a times its distance aside."""
    from flarewright.model import Element
    from flarewright.optics.rays.pack import SensorMirror

    built = build(heliar, cover_glass=Plate(thickness=0.5, gap=4.0, n_d=1.5, v_d=60.0)).lens
    angle = np.radians(0.2)
    tilted = built.replace(elements=(Element(rows=(9, 10), tilt_deg=(0.2, 0.0)),))
    with only("sensor-10", "sensor-9"):
        tables = [ghost_table_of(a, (0.0, 0.0), f_number=8.0, sensor=SensorMirror(0.1)) for a in (built, tilted)]
    one, other = map(named, tables)
    # a tilted plate also shifts the picture, by thickness times tilt times 1 - 1/n
    through = tables[1].direct.centroid_mm[1]
    assert abs(through) == pytest.approx(0.5 * angle / 3.0, rel=0.01)
    for name, lever in (("sensor-10", 4.0), ("sensor-9", 4.0 + 0.5 / 1.5)):
        before, after = one[name].centroid_mm, other[name].centroid_mm
        assert before == pytest.approx((0.0, 0.0), abs=1e-6)
        assert after[0] == pytest.approx(0.0, abs=1e-5)
        assert abs(after[1] - through) == pytest.approx(2.0 * angle * lever, rel=0.01), name
        # the light's cone is a disc there, whose rms is its radius over sqrt(2)
        cone = 2.0 * lever * 0.5 / tables[0].f_number / np.sqrt(2.0)
        assert one[name].rms_radius_mm == pytest.approx(cone, rel=0.03)
    # a positive rotation about x tilts the axis towards -y: the light moves to -y, which is up in the picture
    assert other["sensor-10"].centroid_mm[1] > 0.0


# Imperfection


def test_groups_are_what_is_cemented(heliar):
    assert glass_groups(heliar) == ((0, 2), (3, 4), (6, 8))


def test_a_seed_is_a_sample_and_no_tolerance_is_the_lens_itself(heliar):
    assert build(heliar, imperfection=Imperfection(seed=3, decentre_um=0.0, tilt_arcmin=0.0)).lens is heliar
    one, again, other = (build(heliar, imperfection=Imperfection(seed=s, figure_nm=30.0)).lens for s in (3, 3, 4))
    assert one == again
    assert one != other
    assert len(one.elements) == 3


def test_samples_lie_within_their_tolerances_and_fill_them(heliar):
    places, tilts, figures = [], [], []
    for seed in range(300):
        within = Imperfection(seed=seed, decentre_um=20.0, tilt_arcmin=3.0, figure_nm=50.0)
        sample = build(heliar, imperfection=within).lens
        places += [np.hypot(*e.decentre) / 0.02 for e in sample.elements]
        tilts += [np.hypot(*e.tilt_deg) / 0.05 for e in sample.elements]
        rows = [row for row in sample.rows if isinstance(row, Surface)]
        figures += [np.sqrt(sum(a * a for _, a in row.figure.zernike_nm)) / 50.0 for row in rows]
    for found, mean in ((places, 2.0 / 3.0), (tilts, 2.0 / 3.0), (figures, 0.5)):
        assert max(found) <= 1.0 + 1e-12
        assert max(found) > 0.95
        # the standard error of the mean of a disc's radius, or of a uniform number
        spread = np.sqrt(0.5 - 4.0 / 9.0) if mean > 0.6 else np.sqrt(1.0 / 12.0)
        assert abs(np.mean(found) - mean) < 4.0 * spread / np.sqrt(len(found))


def test_a_wider_tolerance_moves_everything_the_same_way(heliar):
    narrow, wide = (build(heliar, imperfection=Imperfection(seed=1, decentre_um=um)).lens for um in (5.0, 50.0))
    for a, b in zip(narrow.elements, wide.elements, strict=True):
        assert np.array(b.decentre) == pytest.approx(10.0 * np.array(a.decentre))
        assert b.tilt_deg == a.tilt_deg


def test_small_imperfections_move_ghosts_in_proportion(heliar, plain):
    def centroids(um: float):
        sample = Imperfection(seed=5, decentre_um=um, tilt_arcmin=um / 10.0)
        return named(ghosts(heliar, FIELD, coating=Everywhere(coating=Bare()), f_number=8.0, imperfection=sample))

    names = ("3-2", "4-0", "4-1", "6-4")
    with only(*names):
        little, more = centroids(20.0), centroids(40.0)
    before = named(plain)
    moved = 0.0
    for name in names:
        a, b = (np.subtract(found[name].centroid_mm, before[name].centroid_mm) for found in (little, more))
        assert np.abs(b - 2.0 * a).max() < 0.1 * np.abs(b).max() + 2e-3, name
        moved = max(moved, float(np.abs(b).max()))
    assert moved > 0.05


# Zoom and focus


def test_the_ends_of_a_zoom_are_the_patents():
    zoom = load_lens("canon-70-200")
    for name, alone, efl in (("wide", "canon-70-200-wide", 72.1), ("Tele", "canon-70-200-tele", 194.01)):
        order, other = first_order(build(zoom, zoom=name).lens), first_order(load_lens(alone))
        assert (order.efl, order.bfl) == (pytest.approx(other.efl, rel=1e-12), pytest.approx(other.bfl, rel=1e-12))
        assert order.efl == pytest.approx(efl, rel=2e-4)
    wide, tele = (build(zoom, zoom=name).lens for name in ("wide", "tele"))
    # semi-diameters are the same in all positions
    assert [getattr(r, "semi_diameter", 0) for r in wide.rows] == [getattr(r, "semi_diameter", 0) for r in tele.rows]
    for k, row in enumerate(wide.rows):
        if isinstance(row, Surface):
            assert row.semi_diameter >= load_lens("canon-70-200-tele").rows[k].semi_diameter - 1e-9


@pytest.mark.parametrize("efl", [73.0, "100", "135 mm", 193.0])
def test_a_zoom_meets_the_focal_length_it_is_set_to(efl):
    zoom = load_lens("canon-70-200")
    set_to = build(zoom, zoom=efl).lens
    assert first_order(set_to).efl == pytest.approx(float(str(efl).removesuffix("mm")), rel=1e-8)
    assert set_to.positions == ()
    assert 6.35 < set_to.field_deg < 16.7


def test_a_filter_in_front_of_a_zoom_at_the_gaps_of_its_rows():
    """The moving gaps kept their numbers among rows that had others, so a gap of glass was called moving."""
    zoom = load_lens("canon-70-200")
    filtered = build(zoom, filter_plate=Plate(thickness=2.0)).lens
    assert first_order(filtered).efl == pytest.approx(first_order(zoom).efl)
    for before, after in zip(zoom.positions, filtered.positions, strict=True):
        gaps = [
            [row.thickness for row in at_position(lens, one).rows] for lens, one in ((zoom, before), (filtered, after))
        ]
        assert gaps[1][2:] == gaps[0]


def test_what_a_zoom_cannot_do_is_told():
    zoom = load_lens("canon-70-200")
    with pytest.raises(ProjectError, match=r"zooms from 72\.09 to 194\.00 mm, not to 300 mm"):
        build(zoom, zoom=300.0)
    with pytest.raises(ProjectError, match="has no position 'macro'; it has: 'wide', 'tele'"):
        build(zoom, zoom="macro")
    with pytest.raises(ProjectError, match="has no positions"):
        build(load_lens("heliar-tronnier"), zoom=50.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"field_deg": (100.0, 0.0)}, r"less than 90 degrees from the axis, not at \(100, 0\)"),
        ({"field_deg": (0.0, -90.0)}, "less than 90 degrees"),
        ({"field_deg": (np.nan, 0.0)}, "less than 90 degrees"),
        ({"paths": "same side"}, "'all' or 'same-side', not 'same side'"),
        ({"sensor_distance": 0.0}, "of the sensor is finite and above 0 mm, not 0"),
        ({"sensor_distance": np.inf}, "of the sensor is finite"),
        ({"focus_distance": np.inf}, "of the plane in focus is finite and above 0 mm, not inf"),
        ({"f_number": np.nan}, "an f-number is finite, not nan"),
    ],
)
def test_an_analysis_refuses_what_no_lens_can_be_given(heliar, given, words):
    """Each used to be analysed: a light at 100 degrees as one at -80, unknown paths as all."""
    with pytest.raises(ProjectError, match=words):
        ghosts(heliar, **{"field_deg": FIELD, **given})
    if set(given) <= {"sensor_distance", "focus_distance", "f_number"}:
        with pytest.raises(ProjectError, match=words):
            paraxial(heliar, **given)


def test_focus_positions_are_taken_by_the_distance(heliar):
    floating = heliar.replace(positions=(
        Position(name="far", gaps=((2, 3.52), (4, 4.18))),
        Position(name="near", gaps=((2, 3.12), (4, 4.98)), focus_distance=1000.0),
    ))  # fmt: skip
    half = build(floating, focus_distance=2000.0).lens
    assert (half.rows[2].thickness, half.rows[4].thickness) == (pytest.approx(3.32), pytest.approx(4.58))
    assert half.focus_distance == 2000.0
    assert build(floating).lens is floating
    assert build(floating, focus_distance=1000.0).lens.rows[4].thickness == pytest.approx(4.98)
    with pytest.raises(ProjectError, match="from infinity to 1000 mm, not for 500 mm"):
        build(floating, focus_distance=500.0)
    with pytest.raises(ProjectError, match="are for focus"):
        build(floating, zoom=100.0)
    # rows written for the near end: the far position is still focused at infinity
    near_end = floating.replace(focus_distance=1000.0)
    assert build(near_end, zoom="far").lens.focus_distance is None
    assert build(near_end, zoom="near").lens.focus_distance == 1000.0


def test_a_zoom_that_focuses_by_its_gaps_takes_both_at_once(heliar):
    def position(name, efl, gaps, **more):
        return Position(name=name, focal_length=efl, gaps=tuple(zip((2, 4), gaps, strict=True)), **more)

    four = (
        position("wide", 99.24, (3.52, 4.18), f_number=4.5),
        position("tele", 105.0, (2.52, 4.18), f_number=5.5),
        position("wide near", 99.24, (3.52, 5.18), focus_distance=1000.0, f_number=4.5),
        position("tele near", 105.0, (2.52, 6.18), focus_distance=1000.0, f_number=5.5),
    )
    zoom = heliar.replace(positions=four)

    def gaps(**ghost_target):
        rows = build(zoom, **ghost_target).lens.rows
        return rows[2].thickness, rows[4].thickness

    assert gaps(zoom="wide") == (3.52, 4.18)
    assert gaps(zoom="tele near") == (2.52, 6.18)
    assert gaps(zoom="wide", focus_distance=2000.0) == pytest.approx((3.52, 4.68))
    middle = first_order(build(zoom, zoom="wide").lens).efl, first_order(build(zoom, zoom="tele").lens).efl
    efl = 0.5 * sum(middle)
    far = gaps(zoom=efl)
    assert first_order(build(zoom, zoom=efl).lens).efl == pytest.approx(efl, rel=1e-8)
    part = (3.52 - far[0]) / 1.0
    # the focus ring stays, so the focus moves by half of the step in 1 / distance
    assert gaps(zoom=efl, focus_distance=2000.0) == pytest.approx((far[0], 4.18 + 0.5 * (1.0 + part)))
    set_to = build(zoom, zoom=efl, focus_distance=2000.0)
    assert set_to.lens.f_number == pytest.approx(4.5 + part)
    assert first_order(set_to.lens, focus_distance=set_to.focus_distance).sensor_distance > first_order(set_to.lens).bfl
    with pytest.raises(ProjectError, match="several focal lengths; give the zoom too"):
        build(zoom, focus_distance=2000.0)
    with pytest.raises(ProjectError, match="not for 300 mm"):
        build(zoom, zoom=efl, focus_distance=300.0)


def test_a_cover_glass_may_lie_on_the_sensor(heliar):
    """A gap of 0 used to count as none: the sensor was moved, or the lens refused."""
    on, near = (build(heliar, cover_glass=GLASS.replace(gap=gap), sensor_distance=80.0).lens for gap in (0.0, 1e-4))
    for one in (on, near):
        order = first_order(one, 4.5)
        assert sum(row.thickness for row in one.rows[len(heliar.rows) - 1 : -1]) + order.sensor_distance == (
            pytest.approx(80.0, abs=2e-6)
        )
    # in focus too
    assert first_order(build(heliar, cover_glass=GLASS.replace(gap=0.0)).lens, 4.5).sensor_distance < 1e-5


@pytest.mark.parametrize("plate", [None, Plate(thickness=4.0, gap=20.0, n_d=1.5, v_d=60.0)])
def test_a_light_in_the_plane_of_focus_is_sharp_behind_a_filter(plate):
    """The plane in focus was measured from the filter and the light from the lens."""
    made = Project(
        lens="heliar-tronnier", f_number=8.0, filter=plate, camera=Camera(size_px=(320, 200), focus_distance=400.0),
        lights=(Light(field_deg=(1.0, 0.5), distance=400.0),), quality=Quality(mode="draft", wavelengths=1),
    )  # fmt: skip
    settled = resolve_project(made)
    (shot,) = make_shots(settled, make_opening(settled, None))
    assert defocus_mm(settled.lens, shot) < 1e-6
    beside = made.replace(lights=(made.lights[0].replace(distance=430.0),))
    settled = resolve_project(beside)
    assert defocus_mm(settled.lens, make_shots(settled, make_opening(settled, None))[0]) > 0.1
    if plate is not None:
        close = resolve_project(made.replace(lights=(made.lights[0].replace(distance=24.0),)))
        with pytest.raises(ProjectError, match="stands in or behind the filter; give more than 24 mm"):
            make_shots(close, make_opening(close, None))
