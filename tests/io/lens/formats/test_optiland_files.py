"""Lenses of Optiland: JSON with a surface group."""

from __future__ import annotations

import copy
import json
import math

import pytest

from flarewright.errors import LensError
from flarewright.model import Stop
from flarewright.optics.lens.paraxial import first_order
from flarewright.render.scene.resolve import open_lens
from flarewright.workflow.lens_export import export_lens

GLASS = {"type": "AbbeMaterial", "index": 1.6, "abbe": 60.0}
AIR = {"type": "IdealMaterial", "index": 1.0, "absorp": 0.0}


def surface(z, geometry, material=AIR, stop=False, rim=10.0):
    place = {"x": 0.0, "y": 0.0, "z": z, "rx": 0.0, "ry": 0.0, "rz": 0.0, "reference_cs": None}
    return {
        "type": "Surface", "geometry": {"cs": place, **geometry}, "material_post": material, "is_stop": stop,
        "aperture": {"type": "RadialAperture", "r_max": rim, "r_min": 0.0},
    }  # fmt: skip


PLANE = {"type": "Plane", "radius": math.inf}
LENS = {
    "version": 1.0, "name": "Own lens", "aperture": {"type": "EPD", "value": 10.0},
    "fields": {
        "fields": [{"x": 0.0, "y": 0.0}, {"x": 3.0, "y": 4.0}], "field_definition": {"field_type": "AngleField"}
    },
    "surface_group": {"surfaces": [
        surface(-math.inf, PLANE),
        surface(0.0, {"type": "EvenAsphere", "radius": 30.0, "conic": -0.5, "coefficients": [0.0, 1e-6, -2e-9]}, GLASS),
        surface(4.0, {
            "type": "BiconicGeometry", "radius_x": math.inf, "radius_y": -90.0, "conic_x": 0.0, "conic_y": 0.0
        }),
        surface(9.0, PLANE, stop=True, rim=5.0),
        surface(12.0, {"type": "StandardGeometry", "radius": 200.0, "conic": 0.0},
                {"type": "Material", "name": "N-BK7", "filename": "elsewhere"}),
        surface(15.0, PLANE),
        surface(60.0, PLANE),
    ]},
}  # fmt: skip


def opened(tmp_path, data):
    path = tmp_path / "lens.json"
    path.write_text(json.dumps(data))
    return open_lens(path)


def test_a_sum_of_two_curved_profiles_is_refused_and_not_written(tmp_path):
    """Optiland's BiconicGeometry adds the sags of both meridians; the biconic form has one root for both."""
    data = copy.deepcopy(LENS)
    data["surface_group"]["surfaces"][2]["geometry"]["radius_x"] = 80.0
    with pytest.raises(LensError, match="surface 2: a BiconicGeometry with a curvature in both meridians"):
        opened(tmp_path, data)
    lens = opened(tmp_path, LENS).lens
    bent = lens.rows[1].replace(curvature_x=1.0 / 80.0)
    with pytest.raises(LensError, match=r"row 1 has a curvature in both meridians, .* make it a torus"):
        export_lens(lens.replace(rows=(lens.rows[0], bent, *lens.rows[2:])), tmp_path / "out.json")


def test_the_numbers_of_the_file(tmp_path):
    lens = opened(tmp_path, LENS).lens
    assert (lens.name, lens.field_deg) == ("Own lens", 5.0)
    assert [row.thickness for row in lens.rows] == [4.0, 5.0, 3.0, 3.0, 45.0]
    assert isinstance(lens.rows[2], Stop)
    first, second = lens.rows[:2]
    assert (first.curvature, first.conic, first.asphere) == (1 / 30.0, -0.5, (1e-6, -2e-9))
    assert (second.curvature, second.meridian_x) == (-1 / 90.0, (0.0, 0.0))
    assert (first.medium.n_d, first.medium.v_d) == (1.6, 60.0)
    assert lens.rows[3].medium.n_d == pytest.approx(1.5168, abs=1e-5)
    assert first_order(lens).entrance_pupil_diameter == pytest.approx(10.0)
    # a ray parallel to the axis in the y-z plane
    h, slope, before = 1.0, 0.0, 1.0
    glass = lens.rows[3].medium.n_d
    for curvature, after, gap in ((1 / 30, 1.6, 4), (-1 / 90, 1.0, 8), (1 / 200, glass, 3), (0.0, 1.0, 0)):
        slope = (before * slope - (after - before) * curvature * h) / after
        h, before = h + slope * gap, after
    assert first_order(lens).efl == pytest.approx(-1.0 / slope, rel=1e-12)


def test_an_odd_asphere_has_the_terms_of_r(tmp_path):
    data = copy.deepcopy(LENS)
    geometry = data["surface_group"]["surfaces"][1]["geometry"]
    geometry |= {"type": "OddAsphere", "coefficients": [0.0, 0.0, 3e-5, 1e-6, 0.0, -2e-9, 1e-11]}
    lens = opened(tmp_path, data).lens
    assert lens.rows[0].terms == {3: 3e-5, 4: 1e-6, 6: -2e-9, 7: 1e-11}
    export_lens(lens, tmp_path / "again.json")
    written = json.loads((tmp_path / "again.json").read_text())["surface_group"]["surfaces"][1]["geometry"]
    assert (written["type"], written["coefficients"]) == ("OddAsphere", geometry["coefficients"])
    assert open_lens(tmp_path / "again.json").lens.rows[0].terms == lens.rows[0].terms
    for wrong in ([1e-4], [0.0, 1e-4], ["x"], 3.0, [0.0] * 21):
        geometry["coefficients"] = wrong
        with pytest.raises(LensError, match="surface 1: its coefficients must be numbers of r and r"):
            opened(tmp_path, data)


def test_a_near_object_and_what_is_left_out(tmp_path):
    data = copy.deepcopy(LENS)
    surfaces = data["surface_group"]["surfaces"]
    surfaces[0]["geometry"]["cs"]["z"] = -500.0
    surfaces[1]["interaction_model"] = {"type": "RefractiveReflectiveModel", "coating": {"type": "Simple"}}
    surfaces[4]["aperture"] = {"type": "RectangularAperture"}
    data |= {"pickups": [{"source": 1}], "aperture": {"type": "objectNA", "value": 0.1}}
    found = opened(tmp_path, data)
    assert found.lens.focus_distance == 500.0
    assert first_order(found.lens).stop_semi_diameter == pytest.approx(5.0)
    said = " | ".join(found.remarks)
    for words in ("surface 1: its coating is left out", "surface 4: an aperture", "pickups", "'objectNA' is left out"):
        assert words in said


@pytest.mark.parametrize(
    ("place", "change", "said"),
    [
        (1, {"geometry": {"type": "Zernike", "cs": {"z": 0.0}}}, "surface 1 is of type 'Zernike'; known are Plane"),
        (1, {"interaction_model": {"is_reflective": True}}, "surface 1 is a mirror"),
        (1, {"interaction_model": {"type": "ThinLens"}}, "surface 1: 'ThinLens' is not supported"),
        (1, {"material_post": {"type": "Mystery"}}, "surface 1: its material 'Mystery' has no name"),
        (1, {"material_post": {"type": "Material", "name": "NOSUCH"}}, "surface 1: glass 'NOSUCH'"),
        (0, {"material_post": GLASS}, "surface 0: the lens stands in a medium"),
        (2, {"geometry": {"type": "Plane", "cs": {"z": 4.0, "rx": 0.1}}}, "surface 2 is tilted or shifted"),
        (2, {"geometry": {"type": "Plane", "cs": {}}}, "a surface has no place"),
        (2, {"geometry": 3}, "a surface has no geometry"),
        (4, {"geometry": {"type": "StandardGeometry", "cs": {"z": 12.0}, "radius": 0}}, "surface 4: radius is 0"),
        (2, {"geometry": {"type": "Plane", "cs": {"z": -4.0}}}, "surface 1: glass cannot be -4 mm thick"),
    ],
)
def test_faults_are_one_sentence(tmp_path, place, change, said):
    data = copy.deepcopy(LENS)
    data["surface_group"]["surfaces"][place] |= change
    with pytest.raises(LensError) as raised:
        opened(tmp_path, data)
    assert said in " | ".join([str(raised.value), *raised.value.problems])


def test_terms_of_r_squared_and_empty_files_are_refused(tmp_path):
    data = copy.deepcopy(LENS)
    data["surface_group"]["surfaces"][1]["geometry"]["coefficients"] = [1e-3]
    with pytest.raises(LensError, match="surface 1: its coefficients must be numbers"):
        opened(tmp_path, data)
    with pytest.raises(LensError, match="no surfaces of object, lens and image"):
        opened(tmp_path, {"surface_group": {"surfaces": []}})
