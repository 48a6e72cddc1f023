"""Pictures through lenses without rotational symmetry."""

from __future__ import annotations

import numpy as np
import pytest

from flarewright.errors import LensError
from flarewright.model import (
    Art,
    Camera,
    Figure,
    Imperfection,
    Iris,
    Light,
    Output,
    Plate,
    Project,
    Quality,
    Rule,
    Stop,
)
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.surface_shape import transposed
from flarewright.render.reference import estimator
from flarewright.render.reference.estimator import ORDER_2
from flarewright.render.render import render
from flarewright.render.scene.resolve import load_lens

SIZE = (96, 96)


def picture(lens, field, mode="draft", blades=0, rotation=0.0, f_number=None, distance=None):
    project = Project(
        lens=lens, lights=(Light(field_deg=field),), f_number=f_number,
        camera=Camera(size_px=SIZE, sensor_mm=(36.0, 36.0), sensor_distance=distance),
        quality=Quality(mode=mode, wavelengths=3, ringing="off"), output=Output(starburst=False, layers="beauty"),
        iris=Iris(blades=blades, rotation_deg=rotation),
    )  # fmt: skip
    return render(project).layers[0].pixels.sum(axis=2, dtype=np.float64)


def everywhere(lens, change):
    return lens.replace(rows=tuple(row if isinstance(row, Stop) else row.replace(**change(row)) for row in lens.rows))


def nearly_round(row):
    return {"curvature_x": float(np.nextafter(row.curvature, 1.0))}


def blurred(image, side=8):
    return image.reshape(SIZE[1] // side, side, SIZE[0] // side, side).sum(axis=(1, 3))


@pytest.mark.parametrize("field", [(9.0, 4.0), (-6.0, 11.0)])
def test_draft_draws_a_round_toroid_as_the_sphere_it_is(field):
    lens = load_lens("heliar-tronnier")
    plain, toroid = picture(lens, field, blades=5), picture(everywhere(lens, nearly_round), field, blades=5)
    # the edge of the entrance is a polygon whose corners lie elsewhere in the lens frame
    assert toroid.sum() == pytest.approx(plain.sum(), rel=1e-3)
    assert np.abs(blurred(toroid) - blurred(plain)).max() < 2e-3 * blurred(plain).max()


@pytest.mark.parametrize("mode", ["draft", "final"])
def test_a_picture_through_exchanged_meridians_is_the_exchanged_picture(mode):
    lens = load_lens("triplet-pestrecov")
    lens = lens.replace(rows=(lens.rows[0].replace(curvature_x=0.7 * lens.rows[0].curvature), *lens.rows[1:]))
    other = transposed(lens)
    # the y meridian determines stop and focus, so both are fixed
    order = first_order(lens, 8.0)
    f_number = 8.0 * first_order(other, 8.0).stop_semi_diameter / order.stop_semi_diameter
    one = picture(lens, (7.0, 3.0), mode, f_number=8.0, distance=order.sensor_distance)
    two = picture(other, (3.0, 7.0), mode, f_number=f_number, distance=order.sensor_distance)
    exchanged = two[::-1, ::-1].T
    assert one.sum() == pytest.approx(exchanged.sum(), rel=1e-3)
    assert np.abs(blurred(one) - blurred(exchanged)).max() < 1e-2 * blurred(one).max()
    # it differs from the picture itself
    assert np.abs(blurred(one) - blurred(two)).max() > 0.2 * blurred(one).max()


def test_between_two_meridians_the_direct_image_is_the_line_that_gauss_says():
    lens = load_lens("triplet-pestrecov")
    lens = lens.replace(rows=(lens.rows[0].replace(curvature_x=0.85 * lens.rows[0].curvature), *lens.rows[1:]))
    project = Project(
        lens=lens, lights=(Light(field_deg=(0.0, 0.0)),), f_number=16.0,
        camera=Camera(size_px=(256, 256), sensor_mm=(8.0, 8.0)), quality=Quality(wavelengths=3, ringing="off"),
        art=Art(rules=(Rule(select="all", enable=False),)),
    )  # fmt: skip
    rendering = render(project)
    # in the other meridian, the rays focus away from the sensor
    order, across = first_order(lens, 16.0), first_order(transposed(lens), 16.0)
    wide = across.entrance_pupil_diameter * order.stop_semi_diameter / across.stop_semi_diameter
    length = 256 / 8.0 * wide * abs(order.bfl_x - order.sensor_distance) / order.efl_x
    assert length > 40.0
    assert any(f"up to {length:.1f} pixels" in remark for remark in rendering.remarks)
    layer = next(layer for layer in rendering.layers if layer.name == "starburst")
    light = layer.pixels.sum(axis=2, dtype=np.float64)
    columns, rows = light.sum(axis=0), light.sum(axis=1)
    assert np.count_nonzero(columns > 0.2 * columns.max()) == pytest.approx(length, abs=2.0)
    assert np.count_nonzero(rows > 0.2 * rows.max()) <= 4


def test_final_draws_a_whole_pupil_as_two_halves():
    lens = load_lens("heliar-tronnier")
    plain, whole = (picture(one, (9.0, 4.0), "final", blades=6, rotation=10.0) for one in (
        lens, everywhere(lens, lambda row: {"figure": Figure()})
    ))  # fmt: skip
    assert whole.sum() == pytest.approx(plain.sum(), rel=1e-3)
    assert np.abs(blurred(whole) - blurred(plain)).max() < 1e-2 * blurred(plain).max()


def test_a_figure_image_is_read_and_tears_the_symmetry(tmp_path):
    from PIL import Image

    grey = np.random.default_rng(2).integers(0, 255, (16, 16), dtype=np.uint8)
    Image.fromarray(grey).save(tmp_path / "bumps.png")
    lens = load_lens("triplet-pestrecov")
    figure = Figure(image=str(tmp_path / "bumps.png"), peak_valley_nm=4000.0)
    bumpy = lens.replace(rows=(lens.rows[0].replace(figure=figure), *lens.rows[1:]))
    plain, torn = (picture(one, (0.0, 8.0), "final") for one in (lens, bumpy))
    assert np.abs(plain - plain[:, ::-1]).max() < 0.05 * plain.max()
    assert np.abs(torn - torn[:, ::-1]).max() > 0.1 * torn.max()
    assert torn.sum() == pytest.approx(plain.sum(), rel=0.05)
    missing = lens.replace(rows=(bumpy.rows[0].replace(figure=figure.replace(image="no.png")), *lens.rows[1:]))
    with pytest.raises(LensError, match=r"no\.png does not exist"):
        picture(missing, (0, 0))


def cylindrical():
    """Return the triplet with a front surface that differs between the meridians, and its sensor in focus."""
    lens = load_lens("triplet-pestrecov")
    return lens.replace(rows=(lens.rows[0].replace(curvature_x=0.85 * lens.rows[0].curvature), *lens.rows[1:]))


BUILT = {
    "one sample of it": {"imperfection": Imperfection(seed=2, decentre_um=200.0, tilt_arcmin=20.0, figure_nm=300.0)},
    "behind a filter, before a mirror": {
        "filter": Plate(thickness=2.0, n_d=1.5, v_d=60.0),
        "mirror": {"sensor_reflectance": 0.2, "cover_glass": Plate(thickness=1.0, gap=1.0, n_d=1.5, v_d=60.0)},
    },
    "anamorphic": {"lens": "anamorphic-heliar-2x"},
    "a cylindrical front": {"lens": cylindrical},
}
FAST = ("behind a filter, before a mirror", "a cylindrical front")


@pytest.mark.parametrize("thorough", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["few rays", "many rays"])
@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in FAST else pytest.mark.slow) for name in BUILT])
def test_the_judge_agrees(name, thorough, monkeypatch):
    """Final quality's ghosts in the picture against random rays through the same lens, two reflections each."""
    parts, wanted, waves, sensor = {"lens": "triplet-pestrecov", **BUILT[name]}, 4e-3, 3, (36.0, 27.0)
    if callable(parts["lens"]):
        parts["lens"] = parts["lens"]()
    if not thorough:
        # at least 16 batches are traced; batches of the usual size would be three times more accurate than needed
        monkeypatch.setattr(estimator, "SIDE", 40)
        # colours come from dispersion, which filter and cover glass have too
        waves = 2 if "filter" in parts else 1
        if name == "anamorphic":
            # few of its rays land in a small picture
            wanted, sensor = 8e-3, (120.0, 90.0)
    camera = Camera(size_px=(64, 48), sensor_mm=sensor, **parts.pop("mirror", {}))
    quality = Quality(wavelengths=waves, bridge=False, reference_error=wanted, reference_error_of="total")
    if not thorough:
        # random rays have no rings; their effect on flux is tested in test_diffraction_rings.py
        quality = quality.replace(ringing="off")
    project = Project(
        **parts, lights=(Light(field_deg=(6.0, 3.0)),), f_number=5.6, camera=camera, quality=quality,
        output=Output(layers="passes", starburst=False),
    )  # fmt: skip

    def flux(mode, layer):
        rendering = render(project.replace(quality=quality.replace(mode=mode)))
        return rendering, next(a.pixels.sum(dtype=np.float64) for a in rendering.layers if a.name == layer)

    final = flux("final", "ghosts")[1]
    judged, mean = flux("reference", ORDER_2)
    error = judged.summary["reference"]["relative_standard_error"] * mean
    assert mean > 0.0
    assert error <= wanted * mean
    assert abs(final - mean) < 4.0 * error + 2e-3 * mean
