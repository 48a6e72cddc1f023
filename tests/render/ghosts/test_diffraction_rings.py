"""Rings inside ghosts: a ghost equals Collins' integral, flux is conserved, and ghosts without rings do not change."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import fresnel

from flarewright.model import D65, Art, Camera, Dirt, Iris, Light, Lines, Output, Project, Quality, Rule
from flarewright.optics.colour.spectrum import band_contents
from flarewright.optics.lens.paraxial import flare_matrices
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.ghosts import diffraction_rings as last_of
from flarewright.render.ghosts import ring_visibility
from flarewright.render.ghosts.diffraction_rings import Ringing, Textures, _Crossing
from flarewright.render.ghosts.ring_tables import edge_crossing
from flarewright.render.render import render
from flarewright.render.scene.resolve import resolve_project

LENS, WAVE = "heliar-tronnier", 560.0
GREEN = Lines(lines=((WAVE, 1.0),))
DUST = Dirt(dust_per_mm2=0.3, dust_um=(200.0, 400.0), seed=2, in_ghosts=True)


def project(ghost=None, ringing="collins", **changes):
    """Return a project of one ghost of a lens, or of all."""
    rules = () if ghost is None else (Rule(select="all", enable=False), Rule(select=ghost, enable=True))
    fields = {
        "lens": LENS,
        "f_number": 16.0,
        "iris": Iris(blades=4),
        "lights": (Light(field_deg=(0.0, 0.0), spectrum=GREEN),),
        "camera": Camera(size_px=(400, 400), sensor_mm=(20.0, 20.0)),
        "output": Output(starburst=False, layers="passes"),
        "quality": Quality(ringing=ringing, wavelengths=5),
        "art": Art(rules=rules),
    }
    return Project.model_validate({**fields, **changes})


def picture(wanted, **options):
    layer = {layer.name: layer for layer in render(wanted, **options).layers}["ghosts"]
    width, height = wanted.camera.size_px
    pixels = np.zeros((height, width, 3))
    x, y, w, h = layer.window
    pixels[y : y + h, x : x + w] = layer.pixels
    return pixels


def luminance(pixels):
    return pixels @ (0.2126, 0.7152, 0.0722)


def slit(at, half, scale):
    (s1, c1), (s2, c2) = fresnel((at + half) / scale), fresnel((at - half) / scale)
    return 0.5 * ((c1 - c2) ** 2 + (s1 - s2) ** 2)


@pytest.mark.parametrize(
    ("ghost", "width", "f_number"),
    [
        # a smaller opening has fewer fringes, which take fewer samples
        ("2-1", 10.0, 32.0),
        *(pytest.param(ghost, 36.0, 16.0, marks=pytest.mark.slow) for ghost in ("8-6", "4-1")),
        pytest.param("2-1", 20.0, 16.0, marks=pytest.mark.slow),
    ],
)
def test_a_ghost_on_the_axis_is_collins_integral(ghost, width, f_number):
    """Second method: the ghost's matrices and the analytic slit, pixel by pixel over a square ghost."""
    camera = Camera(size_px=(400, 400), sensor_mm=(width, width))
    wanted = project(ghost, camera=camera, f_number=f_number)
    settled = resolve_project(wanted)
    path = next(path for path in ghost_paths(settled.lens, "all") if path.name == ghost)
    z = sum(row.thickness for row in settled.lens.rows[:-1]) + settled.order.sensor_distance
    Ma, Ms = flare_matrices(settled.lens, path, WAVE, z)
    magnification = abs(Ms[0, 0] + Ms[0, 1] * Ma[1, 0] / Ma[0, 0])
    scale = math.sqrt(abs(1e-6 * WAVE * Ms[0, 1] / magnification) / 2.0)
    half = 0.5 * math.sqrt(math.pi) * settled.order.stop_semi_diameter
    sharp = luminance(picture(project(ghost, "off", camera=camera, f_number=f_number)))
    found = luminance(picture(wanted))
    # aberrations enlarge the sharp square slightly: measure its edge in the picture
    pixel, row = width / 400, sharp[200]
    first = int(np.flatnonzero(row > 0.01 * row.max())[0])
    size = pixel * (200.0 - (first + 1.0 - row[first] / row[first + 2]))
    assert size == pytest.approx(half * magnification, rel=0.02)
    fine = (np.arange(400 * 16) + 0.5) / 16 - 200.0
    # the edge includes the third order: x = M xi (1 + c xi^2) lands on the edge at xi = half
    stop = np.linspace(-1.2 * half, 1.2 * half, 4001)
    bend = (size / (half * magnification) - 1.0) / half**2
    at = np.interp(fine * pixel, magnification * stop * (1.0 + bend * stop**2), stop)
    across = slit(at, half, scale).reshape(400, 16).mean(axis=1)
    # the light of the sharp ghost, which is not quite uniform, times the pattern, in a strip across the centre
    inside = np.abs(np.arange(400) + 0.5 - 200.0) < size / pixel - 1.5
    strip = slice(195, 205)
    ripples = (found[strip].mean(axis=0) / np.maximum(sharp[strip].mean(axis=0), 1e-12))[inside]
    expected = across[inside] * across[strip].mean()
    assert expected.std() > 0.03
    assert np.sqrt(np.mean((ripples - expected) ** 2)) < min(0.02, 0.5 * expected.std())


@pytest.mark.parametrize("mode", ["collins", "frft"])
@pytest.mark.parametrize("diameter", [0.0, 0.3])
def test_no_light_is_lost(mode, diameter):
    light = (Light(field_deg=(3.0, 2.0), diameter_deg=diameter),)
    sharp, found = (
        picture(project("2-1", ringing, lights=light, iris=Iris(blades=7, rotation_deg=5))) for ringing in ("off", mode)
    )
    assert np.abs(found - sharp).max() > 0.1 * sharp.max()
    assert found.sum() == pytest.approx(sharp.sum(), rel=2e-3)
    # the ghost stays in place
    for axis in (0, 1):
        line = np.arange(400)
        a, b = (luminance(p).sum(axis=axis) for p in (sharp, found))
        assert (a * line).sum() / a.sum() == pytest.approx((b * line).sum() / b.sum(), abs=0.3)


@pytest.mark.parametrize(
    ("lens", "path", "f_number", "field", "width"),
    [
        # two of its crossings are drawn at 0.38 and -0.41 of their size, so opposite blades coincide
        pytest.param("tessar-brendel", "7-0", 5.6, (6.0, 3.0), 160, marks=pytest.mark.slow),
        ("tessar-brendel", "7-0", 5.6, (6.0, 3.0), 320),
        pytest.param("tessar-brendel", "7-0", 5.6, (6.0, 3.0), 640, marks=pytest.mark.slow),
        # a few pixels wide
        ("flektogon-35", "10-3", 8.0, (8.0, 5.0), 640),
        ("flektogon-35", "4-2", 8.0, (8.0, 5.0), 640),
        ("flektogon-35", "8-2", 8.0, (8.0, 5.0), 640),
        # the picture cuts it
        ("heliar-tronnier", "8-3", 8.0, (9.0, 5.0), 640),
    ],
)  # fmt: skip
def test_a_ghost_keeps_its_flux(lens, path, f_number, field, width):
    """For any size and any number of stop crossings."""
    scene = {
        "lens": lens,
        "f_number": f_number,
        "iris": Iris(blades=8),
        "lights": (Light(field_deg=field),),
        "camera": Camera(size_px=(width, width * 9 // 16), sensor_mm=(72.0, 40.5)),
    }
    sharp, found = (luminance(picture(project(path, ringing, **scene))).sum() for ringing in ("off", "collins"))
    assert found == pytest.approx(sharp, rel=2e-3)


def test_crossings_that_share_a_picture_of_the_stop_are_drawn():
    """Hullin's estimate has one pattern for all crossings; where it is a picture, drawing failed."""
    scene = {
        "iris": Iris(blades=7),
        "lights": (Light(field_deg=(3.0, 2.0), spectrum=GREEN),),
        "camera": Camera(size_px=(200, 200), sensor_mm=(20.0, 20.0)),
    }
    sharp, found = (picture(project("6-2", ringing, **scene)) for ringing in ("off", "frft"))
    assert np.abs(found - sharp).max() > 0.1 * sharp.max()
    assert found.sum() == pytest.approx(sharp.sum(), rel=2e-3)


def test_a_disc_takes_the_rings_away_and_lines_show_more_than_white():
    # a strip across the centre of the ghost
    strip = Camera(size_px=(400, 40), sensor_mm=(20.0, 2.0))

    def ripple(**light):
        found = luminance(picture(project("2-1", lights=(Light(field_deg=(0.0, 0.0), **light),), camera=strip)))
        # along the edge, where the first fringes are
        profile = found[:, 86:150].mean(axis=0)
        return profile.std() / profile.mean()

    green, white, sun = ripple(spectrum=GREEN), ripple(), ripple(diameter_deg=0.53)
    assert green > 1.2 * white > 1.2 * 3.0 * sun


def test_where_there_are_no_rings_the_picture_is_the_plain_one():
    # pixels of 4 mm, fringes of a tenth of that
    coarse = Camera(size_px=(24, 24), sensor_mm=(96.0, 96.0))
    assert np.array_equal(picture(project("2-1", camera=coarse)), picture(project("2-1", "off", camera=coarse)))
    small = {"f_number": 64.0, "camera": Camera(size_px=(100, 100), sensor_mm=(5.0, 5.0))}
    assert not np.array_equal(picture(project("2-1", **small)), picture(project("2-1", "off", **small)))


def test_an_edge_that_is_not_lit_does_not_ring():
    """Wide open, other edges cut some ghosts before the iris does; light that misses the iris edge makes no rings."""
    wanted = project(f_number=4.5, iris=Iris(), lights=(Light(field_deg=(14.0, 0.0)),))
    settled = resolve_project(wanted)
    assert settled.order.f_number == 4.5
    unlit = []
    real = Ringing.of

    def watched(self, packed, path, light, bundle, *rest):
        rings = real(self, packed, path, light, bundle, *rest)
        inner = self.opening.inner
        nearest = 0.0
        for data in bundle.traced.values():
            radius = np.hypot(data[:, 5::2], data[:, 6::2])
            passing = (data[:, 4] > 0) & (data[:, 3] <= 1) & (radius <= inner).all(axis=1)
            nearest = max(nearest, float(radius[passing].max(initial=0.0)))
        if nearest < 0.9 * inner:
            unlit.append(rings)
        return rings

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Ringing, "of", watched)
        picture(wanted)
    assert unlit
    assert all(rings is None for rings in unlit)


def test_the_same_pixels_on_any_number_of_threads():
    wanted = project(
        lens="triplet-pestrecov",
        lights=(Light(field_deg=(6.0, 4.0)),),
        camera=Camera(size_px=(96, 54)),
        quality=Quality(ringing="collins", wavelengths=2),
    )
    one, four = (picture(wanted, threads=n) for n in (1, 4))
    assert np.array_equal(one, four)


def test_the_next_picture_of_an_iris_finds_its_patterns_and_looks_the_same(monkeypatch):
    """While the user drags a light, patterns are computed once, independent of earlier pictures."""
    lens = {"lens": LENS, "f_number": 8.0, "camera": Camera(size_px=(96, 54))}
    quality = Quality(mode="final", wavelengths=2, ringing="collins", paths="same-side")
    here, there = (
        Project(
            **lens, iris=Iris(blades=8), lights=(Light(field_deg=place),), quality=quality,
            output=Output(starburst=False),
        )
        for place in ((9.0, 5.0), (10.0, 4.0))
    )  # fmt: skip
    monkeypatch.setattr(last_of, "_LAST", last_of._Last())
    alone = render(there).layers[0].pixels
    first = last_of._LAST.held
    render(there)
    assert last_of._LAST.held is first
    # another iris has another pattern, and so has a stop of another size
    for changed in ({"iris": Iris(blades=6)}, {"f_number": 11.0}):
        render(here.replace(**changed))
        assert last_of._LAST.held is not first
        first = last_of._LAST.held
    made = render(here).layers[0].pixels
    after = render(there).layers[0].pixels
    assert np.array_equal(after, alone)
    assert not np.array_equal(after, made)


@pytest.mark.slow
def test_dirt_in_ghosts_diffracts_too():
    sharp, found = (picture(project("2-1", ringing, dirt=DUST)) for ringing in ("off", "collins"))
    middle = (slice(120, 280), slice(120, 280))
    assert np.abs(found - sharp)[middle].max() > 0.2 * sharp.max()
    assert found.sum() == pytest.approx(sharp.sum(), rel=0.01)


@pytest.mark.parametrize(
    ("lens", "ghost", "dirt", "sensor"),
    [
        (LENS, "2-1", DUST, (6.0, 4.5)),
        pytest.param("anamorphic-heliar-2x", "8-3", Dirt(), (24.0, 12.0), marks=pytest.mark.slow),
    ],
)
def test_a_part_of_an_opening_rings_as_all_of_it_does(lens, ghost, dirt, sensor, monkeypatch):
    """A ghost larger than the picture: through dirt, and between cylinders."""
    wanted = project(
        ghost, lens=lens, dirt=dirt, lights=(Light(field_deg=(3.0, 2.0)),), iris=Iris(blades=6, rotation_deg=10.0),
        quality=Quality(ringing="collins", wavelengths=3), camera=Camera(size_px=(120, 90), sensor_mm=sensor),
    )  # fmt: skip
    sharp, part = picture(wanted.replace(quality=Quality(ringing="off", wavelengths=3))), picture(wanted)
    asked = []
    chosen = _Crossing.window

    def never(crossing, seen):
        asked.append(chosen(crossing, seen) is not None)

    monkeypatch.setattr(_Crossing, "window", never)
    whole = picture(wanted)
    assert asked == [True]
    assert np.abs(whole - sharp).sum() > 0.01 * whole.sum()
    if dirt.in_ghosts:
        # grains whose shadows rays show have rings, and flux is conserved
        assert np.abs(part - sharp).max() > 0.2 * sharp.max()
        assert part.sum() == pytest.approx(sharp.sum(), rel=0.01)
    # both are sampled at different positions
    assert np.abs(part - whole).sum() < 0.08 * np.abs(whole - sharp).sum()
    assert part.sum() == pytest.approx(whole.sum(), rel=2e-3)


def test_a_remark_names_what_makes_rings_slow():
    small = Camera(size_px=(32, 18))
    white, sodium = (Light(field_deg=(3.0, 2.0), spectrum=one) for one in (D65(), Lines(lines=((589.3, 1.0),))))
    for ringing, wanted, light, slow in (
        ("collins", DUST, white, True),
        ("off", DUST, sodium, False),
        ("collins", Dirt(), white, False),
        ("collins", Dirt(), sodium, True),
    ):
        # a small opening has few rings, which are fast
        reported = render(project("2-1", ringing, f_number=64.0, dirt=wanted, lights=(light,), camera=small)).remarks
        assert any("--ringing off leaves them out" in remark for remark in reported) is slow
    # between cylinders rings take less time than the ghosts
    reported = render(project("9-7", lens="anamorphic-heliar-2x", f_number=64.0, lights=(white,), camera=small)).remarks
    assert not any("--ringing off" in remark for remark in reported)


def between_cylinders(ghost, iris, **light):
    return project(
        ghost, lens="anamorphic-heliar-2x", iris=iris, f_number=11.0, lights=(Light(field_deg=(4.0, 2.0), **light),),
        quality=Quality(ringing="collins", wavelengths=3), camera=Camera(size_px=(400, 160), desqueeze=True),
    )  # fmt: skip


@pytest.mark.parametrize(
    "iris", [Iris(blades=6, rotation_deg=10.0), pytest.param(Iris(blades=5, rounding=0.6), marks=pytest.mark.slow)]
)
def test_rings_behind_the_cylinders_come_from_tables(iris, monkeypatch):
    """The fringes of both meridians agree to 1/1000, so tables are used although pixels are oblong in the stop."""
    wanted = between_cylinders("14-6", iris)
    sharp, shared = picture(wanted.replace(quality=Quality(ringing="off", wavelengths=3))), picture(wanted)
    served = []
    known = last_of._crossing

    def watched(*given):
        served.append(known(*given))
        return served[-1]

    monkeypatch.setattr(last_of, "_LAST", last_of._Last())
    monkeypatch.setattr(last_of, "ALIKE", 1e-6)
    monkeypatch.setattr(last_of, "_crossing", watched)
    monkeypatch.setattr(last_of, "BAND_SPREAD", 0.01)
    own = picture(wanted)
    assert [type(crossing) for crossing in served] == [_Crossing]
    assert np.abs(own - sharp).sum() > 0.03 * own.sum()
    assert shared.sum() == pytest.approx(own.sum(), rel=2e-3)
    assert np.abs(shared - own).sum() < 0.2 * np.abs(own - sharp).sum()


@pytest.mark.parametrize("diameter", [pytest.param(0.0, marks=pytest.mark.slow), 0.3])
def test_patterns_between_cylinders_are_as_fine_as_is_seen(diameter, monkeypatch):
    """Second method: patterns as fine as pixels in both meridians and for any light, one per drawn colour."""
    wanted = between_cylinders("6-3", Iris(blades=6, rounding=0.3), diameter_deg=diameter)
    sharp, found = picture(wanted.replace(quality=Quality(ringing="off", wavelengths=3))), picture(wanted)
    grids = []
    real = last_of.fresnel_grid

    def fine(opening, reach, radius, least, most, shown, window):
        grids.append(real(opening, reach, radius, (min(least),) * 2, most, (0.5 * min(shown),) * 2, window))
        return grids[-1]

    def each(rings, drawn_nm, windows):
        bands = band_contents(rings.spectrum, drawn_nm)
        return Textures(rings, bands, ((),) * len(rings.crossings), windows, tuple((k, 0.0) for k in range(len(bands))))

    monkeypatch.setattr(last_of, "_LAST", last_of._Last())
    monkeypatch.setattr(last_of, "fresnel_grid", fine)
    monkeypatch.setattr(last_of, "_textures", each)
    monkeypatch.setattr(ring_visibility, "blurs", lambda *_: (1.0, 1.0))
    expected = picture(wanted)
    assert grids
    assert np.abs(expected - sharp).sum() > 0.02 * sharp.sum()
    assert found.sum() == pytest.approx(expected.sum(), rel=2e-3)
    assert np.abs(found - expected).sum() < 0.12 * np.abs(expected - sharp).sum()


def test_draft_says_that_it_has_no_rings():
    quality = Quality(mode="draft", ringing="frft")
    assert any("quality.ringing" in reported for reported in render(project(quality=quality)).remarks)


@pytest.mark.parametrize(
    ("iris", "size", "most", "of_rings"),
    [
        pytest.param(Iris(blades=8, rotation_deg=10.0), 400, 4e-3, 0.08, marks=pytest.mark.slow),
        (Iris(blades=5, rounding=0.6), 400, 4e-3, 0.08),
        pytest.param(Iris(), 400, 4e-3, 0.08, marks=pytest.mark.slow),
        # pixels as wide as fringes: the transform is only as fine as they can show
        (Iris(blades=8, rotation_deg=10.0), 100, 8e-3, 0.22),
    ],
)
def test_rings_of_shared_tables_are_those_of_the_ghosts_own_pattern(iris, size, most, of_rings, monkeypatch):
    """White light along long blades is drawn from tables; without them the ghost's opening is transformed."""
    wanted = project(
        "2-1", iris=iris, lights=(Light(field_deg=(3.0, 2.0)),),
        quality=Quality(ringing="collins", wavelengths=3), camera=Camera(size_px=(size, size), sensor_mm=(20.0, 20.0)),
    )  # fmt: skip
    sharp, shared = picture(wanted.replace(quality=Quality(ringing="off", wavelengths=3))), picture(wanted)
    served = []

    def none_served(*known):
        served.append(edge_crossing(*known) is not None)

    monkeypatch.setattr("flarewright.render.ghosts.diffraction_rings.edge_crossing", none_served)
    # the last picture's rings came from tables
    monkeypatch.setattr(last_of, "_LAST", last_of._Last())
    # narrow bands, so that only the tables cause differences
    monkeypatch.setattr("flarewright.render.ghosts.diffraction_rings.BAND_SPREAD", 0.01)
    own = picture(wanted)
    assert served == [True]
    # tables keep the flux of rays to 1e-4, a transform as coarse as pixels to 4e-4
    assert shared.sum() == pytest.approx(sharp.sum(), rel=2e-4)
    assert shared.sum() == pytest.approx(own.sum(), rel=5e-4)
    assert np.abs(shared - own).sum() < most * own.sum()
    assert np.abs(shared - own).sum() < of_rings * np.abs(shared - sharp).sum()
