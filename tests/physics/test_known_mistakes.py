"""Errors of other flare programs (last section of the physics page): one test per error, named after it.

Each error would exceed the tolerance of its test many times.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from oracle import estimate
from prescriptions import HELIAR, TRIPLET, ghost_table_of, lens, system
from sensor_rays import trace_rays

from flarewright.io.lens.formats.dotlens import read_dotlens
from flarewright.kernels.raster.bundle import draw_bundle, node_densities
from flarewright.kernels.raster.polygons import blank_plane, to_pixels
from flarewright.kernels.tracing.sequential import ALIVE, STOP_X, WEIGHT, X, Y
from flarewright.model import (
    Bare,
    Camera,
    Everywhere,
    Film,
    Iris,
    Layer,
    Lens,
    Light,
    Lines,
    Output,
    Project,
    Quality,
    QuarterWave,
    Stop,
)
from flarewright.optics.coatings.thin_film import film_stack, stack_reflectance
from flarewright.optics.colour.spectrum import band_weights
from flarewright.optics.lens.dispersion import D_LINE_NM
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_path, ghost_paths
from flarewright.optics.lens_import.patent_repair import repair
from flarewright.optics.pupil.mask_levels import mask_levels
from flarewright.optics.rays.pack import pack_lens
from flarewright.render.image.compose import beauty
from flarewright.render.image.display import srgb_oetf, view
from flarewright.render.render import render
from flarewright.render.scene.resolve import load_lens

FIELD = (8.0, 5.0)
# rings take a hundred times as long as rays
RINGING = ["off", pytest.param("collins", marks=pytest.mark.slow)]


@cache
def heliar_table():
    """Return the ghosts of the bare Heliar at f/8, cheaper than wide open; several tests use them."""
    return ghost_table_of(lens(HELIAR, 8.0), FIELD)


def direct_of(a_lens):
    """Return the direct image of a light on the axis, without the ghosts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flarewright.optics.rays.ghost_table.ghost_paths", lambda *_, **__: ())
        return ghost_table_of(a_lens, (0.0, 0.0)).direct


def rows_of(table) -> dict:
    return {(g.first_reflection, g.second_reflection): g for g in table.ghosts}


def rendering(a_lens, field=FIELD, *, size=(64, 36), sensor=None, layers="passes", **parts):
    light = Light(field_deg=field, spectrum=parts.pop("spectrum", Lines(lines=((D_LINE_NM, 1.0),))))
    return render(
        Project(
            lens=a_lens,
            f_number=parts.pop("f_number", 8.0),
            iris=Iris(),
            lights=(light,),
            camera=Camera(size_px=size, sensor_mm=sensor),
            quality=Quality(**{k: v for k, v in parts.items() if k in Quality.model_fields}),
            # single ghosts are compared without a starburst
            output=Output(layers=layers, starburst=layers == "passes"),
        )
    )


def layer(result, name):
    return next(x for x in result.layers if x.name == name)


def test_front_surface_skipped():
    """Row 0 reflects: seven of the Heliar's ghosts end at it, one of them among the brightest."""
    table = heliar_table()
    at_front = [g for g in table.ghosts if g.second_reflection == 0]
    assert len(at_front) == 7
    assert sum(g.throughput_mm2 for g in at_front) > 0.1 * sum(g.throughput_mm2 for g in table.ghosts)
    # the direct image carries T of the front surface as of all others
    front = lens(HELIAR, 8.0)
    bare = direct_of(front).throughput_mm2
    perfect = front.rows[0].replace(coating=QuarterWave(center_wavelength_nm=D_LINE_NM, index="ideal"))
    coated = front.replace(rows=(perfect, *front.rows[1:]))
    better = direct_of(coated).throughput_mm2
    r = ((1.652 - 1.0) / (1.652 + 1.0)) ** 2
    assert bare / better == pytest.approx(1.0 - r, abs=2e-3)


def test_stop_enumerated_as_a_mirror():
    a_lens = lens(HELIAR, 4.5)
    for path in ghost_paths(a_lens):
        assert a_lens.stop_row not in (path.first_reflection, path.second_reflection)
    assert len(ghost_paths(a_lens)) == 28  # 36 with the stop


def test_flat_surfaces_that_neither_refract_nor_reflect():
    """The Heliar's row 6 is flat: its ghosts carry light, and a very weak curvature instead changes nothing."""
    flat = lens(HELIAR, 8.0)
    curved = flat.replace(rows=tuple(r.replace(curvature=1e-9) if k == 6 else r for k, r in enumerate(flat.rows)))
    a, b = rows_of(heliar_table()), rows_of(ghost_table_of(curved, FIELD))
    assert sum(path[0] == 6 or path[1] == 6 for path in a) == 7
    for path in ((6, 4), (6, 0), (8, 6)):
        assert a[path].throughput_mm2 > 1e-3 * max(g.throughput_mm2 for g in a.values())
        assert b[path].throughput_mm2 == pytest.approx(a[path].throughput_mm2, rel=1e-5)
        assert b[path].rms_radius_mm == pytest.approx(a[path].rms_radius_mm, rel=1e-5)
    # Snell's law at a plane: an oblique ray is refracted
    packed = pack_lens(flat, first_order(flat), (None,) * 9, np.array([D_LINE_NM]))
    without = packed.n_gap.copy()
    without[0, 7] = 1.0
    changed = type(packed)(**{**packed.__dict__, "n_gap": without})
    rays = [trace_rays(p, direct_path(flat), np.zeros(1), np.zeros(1), (0.0, 10.0))["y"][0] for p in (packed, changed)]
    assert abs(rays[0] - rays[1]) > 0.1


def test_transmittances_left_out():
    """A ghost's weight is R R times T at every other crossing: near the axis, the product from the formula."""
    a_lens = lens(HELIAR, 4.5)
    n = [1.0, 1.652, 1.603, 1.0, 1.643, 1.0, 1.0, 1.581, 1.694, 1.0]
    r = [((n[k] - n[k + 1]) / (n[k] + n[k + 1])) ** 2 for k in range(9)]
    packed = pack_lens(a_lens, first_order(a_lens), (None,) * 9, np.array([D_LINE_NM]))
    for j, i in ((4, 1), (8, 6), (3, 0), (8, 0)):
        path = ghost_path(a_lens, j, i)
        expected = 1.0
        mirrors = 0
        for row, action in zip(path.rows, path.actions, strict=True):
            mirrors += action == 1
            expected *= r[row] if action == 1 else 1.0 - r[row]
        found = trace_rays(packed, path, np.zeros(1), np.array([1e-3]), (0.0, 0.0))["weight"][0]
        assert mirrors == 2
        assert found == pytest.approx(expected, rel=1e-5)
        assert expected < 0.95 * r[j] * r[i]  # without T the test would fail


@pytest.mark.parametrize("ringing", RINGING)
def test_one_intensity_per_ghost(ringing):
    """A ghost near a caustic is not uniform: its peak is many times its mean, and the flux is still correct."""
    result = rendering(
        "tessar-brendel", (12.0, 0.0), f_number=2.8, size=(320, 180), sensor=(72.0, 40.5), layers="ghosts",
        wavelengths=1, ringing=ringing,
    )  # fmt: skip
    contrasts = []
    for single in result.layers:
        if single.name.startswith("ghost."):
            light = np.abs(single.pixels[..., 0])
            lit = light[light > 1e-3 * light.max()]
            if lit.size > 200:
                contrasts.append(float(np.quantile(lit, 0.999) / np.median(lit)))
    assert max(contrasts) > 5.0


def test_folded_cells_dropped():
    """A folded sheet: both leaves add light, for either orientation of their triangles on the sensor."""
    n = 41
    at = np.linspace(0.0, 1.0, n)
    px, py = (g.ravel() for g in np.meshgrid(at, at, indexing="ij"))
    data = np.zeros((n * n, STOP_X + 2))
    # y runs up and back down, so the upper half of the pupil lands mirrored on the position of the lower half
    data[:, X], data[:, Y] = 10.0 * px, 10.0 * np.minimum(py, 1.0 - py)
    data[:, WEIGHT] = data[:, ALIVE] = 1.0
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    pupil = np.stack([px, py], axis=1)
    plane = blank_plane(64, 64)
    draw_bundle(
        data, pupil, triangles, node_densities(data, pupil, triangles), 1, np.zeros((0, 4)),
        mask_levels(np.ones((2, 2)), 1.0), np.eye(2), np.array([32.0, 32.0, 2.0, 2.0]), 1.0, np.ones(3), plane, 2,
    )  # fmt: skip
    drawn = to_pixels(plane, 64)[..., 0]
    assert drawn.sum(dtype=float) == pytest.approx(2.0, rel=1e-5)  # the half and its mirror image
    inner = drawn[34:40, 16:30]
    assert inner.max() == pytest.approx(2.0 * 0.5 / (10.0 * 5.0) * 0.25, rel=1e-3)


@pytest.mark.parametrize("ringing", RINGING)
def test_tone_mapping_before_adding(ringing):
    """Light is added before the view: two greys of 0.5 make white, not the sum of their encoded pictures."""
    grey = np.full((2, 2, 3), 0.5, np.float32)
    one, two = Layer("starburst", grey, (0, 0, 2, 2)), Layer("ghosts", grey, (0, 0, 2, 2))
    total = beauty([one, two], (2, 2))
    np.testing.assert_array_equal(total.pixels, 1.0)
    assert (view(total.pixels, 0.0, "srgb") == 255).all()
    assert 2.0 * srgb_oetf(np.array(0.5)) > 1.4
    result = rendering("heliar-tronnier", wavelengths=1, ringing=ringing)
    parts = [layer(result, "starburst"), layer(result, "ghosts")]
    np.testing.assert_allclose(beauty(parts, (64, 36)).pixels, layer(result, "beauty").pixels, rtol=1e-6)


def test_coating_wavelength_used_as_thickness():
    """532 nm at index 1.38 is a film of 96.4 nm; a film of 532 nm would not be a quarter wave."""
    indices, thicknesses = film_stack(QuarterWave(center_wavelength_nm=532.0), 1.0, 1.5)
    assert indices == (1.38,)
    assert thicknesses[0] == pytest.approx(96.4, abs=0.05)
    at = np.array([1.0])
    quarter = stack_reflectance(1.0, 1.5, indices, thicknesses, 532.0, at)[0]
    as_thick = stack_reflectance(1.0, 1.5, *film_stack(Film(index=1.38, thickness_nm=532.0), 1.0, 1.5), 532.0, at)[0]
    assert quarter == pytest.approx(((1.5 - 1.38**2) / (1.5 + 1.38**2)) ** 2, rel=1e-9)
    assert as_thick > 1.5 * quarter


# a small opening has small Fresnel numbers, so rings are fast
@pytest.mark.parametrize(
    ("ringing", "f_number"),
    [("off", 8.0), ("collins", 128.0), pytest.param("collins", 8.0, marks=pytest.mark.slow)],
)
def test_clamped_negative_colours(ringing, f_number):
    """A spectral cyan has a negative red: layers keep it, and only the view moves it into the gamut."""
    cyan = Lines(lines=((500.0, 1.0),))
    (weights,) = band_weights(cyan, np.array([500.0]), "rec709")
    assert weights[0] < -0.1
    result = rendering("triplet-pestrecov", spectrum=cyan, f_number=f_number, ringing=ringing, paths="same-side")
    for name in ("beauty", "ghosts", "starburst"):
        pixels = layer(result, name).pixels
        lit = pixels[..., 1] > 0.0
        assert lit.any()
        assert (pixels[..., 0][lit] < 0.0).all()
        np.testing.assert_allclose(
            pixels[..., 0][lit].sum() / pixels[..., 1][lit].sum(), weights[0] / weights[1], rtol=1e-4
        )
    assert (view(layer(result, "ghosts").pixels, transform="srgb")[..., 0] == 0).all()


@pytest.mark.parametrize("ringing", RINGING)
def test_tiny_triangles_lost(ringing):
    """The same ghosts on pixels as large as the ghosts: no light is lost to triangles within a pixel."""
    fine, coarse = (
        rendering(
            "heliar-tronnier", size=(side, side), sensor=(600.0, 600.0), layers="ghosts", wavelengths=1, ringing=ringing
        )
        for side in (150, 6)
    )
    for single in fine.layers[2:]:
        a = single.pixels.sum(dtype=float) * 4.0**2
        b = layer(coarse, single.name).pixels.sum(dtype=float) * 100.0**2
        assert b == pytest.approx(a, rel=4e-3), single.name


def test_sensor_plane_taken_from_the_last_gap_of_the_patent(monkeypatch):
    """The Canon's last gap of 80 mm is not its image plane, and the Heliar's printed one is off by 0.54 mm."""
    for name, printed, focus in (("canon-28-80", 80.0, 38.3787), ("heliar-tronnier", 81.857, 81.315056)):
        a_lens = load_lens(name)
        assert a_lens.rows[-1].thickness == pytest.approx(printed)
        assert first_order(a_lens).sensor_distance == pytest.approx(focus, abs=1e-3)
        # the hundreds of ghosts of a zoom are not needed
        monkeypatch.setattr("flarewright.optics.rays.ghost_table.ghost_paths", lambda *_, **__: ())
        assert ghost_table_of(a_lens, FIELD).sensor_distance == pytest.approx(focus, abs=1e-3)


def test_stop_semi_diameter_and_diameter_confused():
    """Direct flux on the axis is pi (f / 2N)^2 T; a diameter for a semi-diameter would quadruple it."""
    a_lens = lens(HELIAR, 4.5)
    table = ghost_table_of(a_lens, (0.0, 0.0), f_number=11.0, paths="same-side")
    pupil = np.pi * (99.235796 / 22.0) ** 2
    n = [1.0, 1.652, 1.603, 1.0, 1.643, 1.0, 1.0, 1.581, 1.694, 1.0]
    through = np.prod([1.0 - ((n[k] - n[k + 1]) / (n[k] + n[k + 1])) ** 2 for k in range(9)])
    assert table.direct.throughput_mm2 == pytest.approx(pupil * through, rel=0.01)
    order = first_order(a_lens, 11.0)
    assert order.stop_semi_diameter < 0.5 * order.entrance_pupil_diameter


def test_apertures_of_a_file_taken_for_the_other_half(tmp_path):
    """A `.lens` column of diameters is halved with a remark, and gives the same lens as its semi-diameters."""
    text = (
        "# Some Triplet 100mm f/2.7\n#\n# Patent: US002453260\n# 7 surfaces, 3 glass elements, f/2.7\n\n"
        "name: Some Triplet 100mm f/2.7\nfocal_length: 99.0\n\nsurfaces:\n"
    )
    table = [
        (40.94, 8.74, 1.617, 55.0, 18.5), (0, 11.05, 1, 0, 18.5), (-55.65, 2.78, 1.649, 33.8, 14.0),
        (39.75, 2.5, 1, 0, 14.0), ("stop", 5.13, 1, 0, 14.0), (107.56, 9.54, 1.617, 55.0, 15.0),
        (-43.33, 79.34, 1, 0, 15.0),
    ]  # fmt: skip
    found = []
    for factor in (1.0, 2.0):
        path = tmp_path / f"{factor:g}.lens"
        path.write_text(text + "".join(f"{r} {t} {n} {v} {h * factor} 0\n" for r, t, n, v, h in table))
        a_lens, remarks = repair(read_dotlens(path))
        assert any("diameters" in remark for remark in remarks)
        found.append([row.semi_diameter for row in a_lens.rows if not isinstance(row, Stop)])
    assert found[0] == pytest.approx(found[1])
    assert found[0] == [18.5, 18.5, 14.0, 14.0, 15.0, 15.0]


def test_dispersion_in_the_stop_plane_but_not_on_the_sensor():
    """Red and blue land at different places: the direct image shifts with wavelength as the matrices predict."""
    a_lens = load_lens("triplet-pestrecov")
    order = first_order(a_lens)
    packed = pack_lens(a_lens, order, (None,) * len(a_lens.rows), np.array([450.0, 610.0]))
    for path in (direct_path(a_lens), *ghost_paths(a_lens)[:6]):
        rays = [trace_rays(packed, path, np.zeros(1), np.array([1.0]), (0.0, 5.0), w=w) for w in (0, 1)]
        on_sensor, at_stop = (abs(float(rays[0][k][0] - rays[1][k][0])) for k in ("y", "stop_y"))
        if all(r["status"][0] for r in rays) and at_stop > 1e-4:
            assert on_sensor > 1e-4, path.name
    # the analysis shows it too: sizes of a ghost differ between blue and red
    table = [ghost_table_of(a_lens, FIELD, f_number=8.0, wavelength_nm=nm) for nm in (450.0, 610.0)]
    blue, red = (rows_of(t) for t in table)
    shifts = [abs(blue[p].rms_radius_mm / red[p].rms_radius_mm - 1.0) for p in blue if red[p].throughput_mm2 > 0.0]
    assert max(shifts) > 0.01


def test_the_sign_of_the_second_mirror():
    """The first reflection is +2/R and the second -2/R: one sign for both would be completely wrong."""
    a_lens = lens(TRIPLET, 5.0)
    s = system(TRIPLET, 5.0)
    row = rows_of(ghost_table_of(a_lens, (3.0, 0.0), paths="same-side"))[(3, 2)]
    truth = estimate(s, (3, 2), (3.0, 0.0), film_sets=[[()] * len(s.rows)], samples=4000, replicas=4)[0]
    assert row.rms_radius_mm == pytest.approx(truth.rms_radius_mm, rel=0.03)


def test_the_shader_that_four_codes_copy():
    """At its design wavelength a real quarter wave reflects what the formula gives, not 1.2 to 2.6 times as much."""
    for n_glass in (1.5, 1.65, 1.8):
        indices, thicknesses = film_stack(QuarterWave(center_wavelength_nm=550.0), 1.0, n_glass)
        found = stack_reflectance(1.0, n_glass, indices, thicknesses, 550.0, np.array([1.0]))[0]
        n1 = indices[0]
        assert found == pytest.approx(((n_glass - n1**2) / (n_glass + n1**2)) ** 2, abs=1e-12)
    # near grazing incidence it is finite and below 1
    grazing = stack_reflectance(1.0, 1.5, (1.38,), (99.6,), 550.0, np.array([1e-6]))[0]
    assert 0.99 < grazing <= 1.0


def test_no_dispersion_assumed_in_silence(tmp_path):
    """V_d = 0 behind a glass means unknown, with a remark."""
    path = tmp_path / "unknown.lens"
    path.write_text(
        "# Some Triplet 100mm f/2.7\n# 7 surfaces, 3 glass elements, f/2.7\n\nname: x\nfocal_length: 99.0\n"
        "\nsurfaces:\n"
        "40.94 8.74 1.617 0 18.5 0\n0 11.05 1 0 18.5 0\n-55.65 2.78 1.649 33.8 14 0\n39.75 2.5 1 0 14 0\n"
        "stop 5.13 1 0 14 0\n107.56 9.54 1.617 55 15 0\n-43.33 79.34 1 0 15 0\n"
    )
    a_lens, remarks = repair(read_dotlens(path))
    assert isinstance(a_lens, Lens)
    assert any("1.617" in remark and ("V_d" in remark or "Abbe" in remark) for remark in remarks)
    assert a_lens.rows[0].medium.dispersion is not None


def test_bare_means_bare():
    """No film equals Fresnel: without a coating the ghosts are bare, and brighter than any coated ones."""
    bare, coated = (
        ghost_table_of(lens(HELIAR, 8.0), FIELD, coating=Everywhere(coating=c), paths="same-side")
        for c in (Bare(), QuarterWave(center_wavelength_nm=D_LINE_NM))
    )
    assert bare.ghosts[0].throughput_mm2 > 3.0 * coated.ghosts[0].throughput_mm2
