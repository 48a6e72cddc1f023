"""Lights of a single plate as lights of a project: where they lie, how bright they are, what keeps them in place."""

import numpy as np
import pytest
from PIL import Image

from flarewright.errors import FlarewrightError, ProjectError
from flarewright.io.images.exr import read_exr
from flarewright.io.images.half import exr_scale
from flarewright.io.project.project_file import read_project
from flarewright.io.project.project_text import project_text
from flarewright.model import Backplate, Camera, Light, LightCurve, LightKey, PlateSearch, Project, Quality, Surface
from flarewright.render.scene.pixel_place import image_px
from flarewright.render.scene.resolve import load_lens
from flarewright.workflow.plates.found_lights import (
    kept_on_plate,
    plate_settings_of,
    search_plate,
    with_found_lights,
    without_found_lights,
)
from flarewright.workflow.plates.plate_frame import plate_images, with_plate_lights
from flarewright.workflow.shot import shot

LAMPS = {(12, 9): (255, 220, 160), (40, 18): (160, 200, 255), (54, 28): (255, 255, 255)}
"""Left upper corners of lamps of 2 x 2 pixels, and their codes."""


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    pixels = np.full((36, 64, 3), 8, np.uint8)
    for (x, y), code in LAMPS.items():
        pixels[y : y + 2, x : x + 2] = code
    path = tmp_path_factory.mktemp("plate") / "night.png"
    Image.fromarray(pixels).save(path)
    return Backplate(image=str(path))


@pytest.fixture(scope="module")
def project():
    return Project(
        lens="heliar-tronnier", f_number=8.0, lights=(Light(field_deg=(3.0, 3.0)),), camera=Camera(size_px=(64, 36))
    )


@pytest.fixture(scope="module")
def lit(project, plate):
    return with_found_lights(project, search_plate(plate))[0]


def places(project):
    return sorted(image_px(plate_images(project), light.field_deg) for light in project.lights)


def test_found_lights_lie_on_their_lamps_and_are_those_of_a_shot(project, plate, lit):
    wanted = sorted((x + 1.0, y + 1.0) for x, y in LAMPS)
    np.testing.assert_allclose(places(lit), wanted, atol=0.05)
    assert lit.plate.lights_above == pytest.approx(search_plate(plate).shot.threshold)
    # as `shot` over the same plate has them
    dark = project.replace(lights=(Light(field_deg=(0.0, 0.0), intensity=0.0),))
    shot, _ = with_plate_lights(dark, search_plate(plate).shot, 1)
    assert sorted(lit.lights, key=lambda light: light.name) == sorted(shot.lights, key=lambda light: light.name)
    assert [light.intensity for light in lit.lights] == sorted((one.intensity for one in lit.lights), reverse=True)


@pytest.mark.parametrize(
    "change",
    [{"f_number": 16.0}, {"lens": "biotar-50-f1.4"}, {"camera": Camera(size_px=(128, 72), sensor_mm=(24.0, 13.5))}],
)
def test_another_lens_keeps_lights_on_the_plate_as_a_new_search_would_place_them(project, plate, lit, change):
    kept = kept_on_plate(lit, lit.replace(**change))
    again, _ = with_found_lights(project.replace(**change), search_plate(plate))
    scale = np.array(kept.camera.size_px) / lit.camera.size_px
    np.testing.assert_allclose(places(kept), np.array(places(lit)) * scale, atol=0.05)
    for one, other in zip(kept.lights, again.lights, strict=True):
        assert one.intensity == pytest.approx(other.intensity, rel=1e-4)
        assert one.diameter_deg == pytest.approx(other.diameter_deg, rel=1e-4)
    assert kept.lights[0].intensity != pytest.approx(lit.lights[0].intensity, rel=0.1)


def test_a_lens_that_makes_no_image_keeps_the_lights_until_it_is_repaired(lit):
    lens = load_lens("heliar-tronnier")
    flat = tuple(row.replace(curvature=0.0) if isinstance(row, Surface) else row for row in lens.rows)
    broken = lit.replace(lens=lens.replace(rows=flat))
    assert kept_on_plate(lit, broken) == broken
    assert kept_on_plate(broken, lit) == lit


def test_a_path_and_an_intensity_over_time_stay_on_the_plate_too(lit):
    light = lit.lights[0].replace(
        keyframes=(LightKey(at_s=0.0, field_deg=lit.lights[0].field_deg),),
        curves=(LightCurve(of="intensity", at_s=(0.0,), values=(lit.lights[0].intensity,)),),
    )
    keyed = lit.replace(lights=(light, *lit.lights[1:]))
    kept = kept_on_plate(keyed, keyed.replace(lens="biotar-50-f1.4")).lights[0]
    assert kept.keyframes[0].field_deg == pytest.approx(kept.field_deg)
    assert kept.curves[0].values[0] == pytest.approx(kept.intensity)


def test_a_second_search_replaces_what_it_found_and_keeps_other_lights(plate, lit):
    # the project's first light had another unit
    assert all(light.name.startswith("plate-") for light in lit.lights)
    own = Light(name="light 4", field_deg=(-20.0, 1.0), intensity=1e-3)
    higher = plate.replace(search=PlateSearch(threshold=0.9))
    again, remarks = with_found_lights(lit.replace(lights=(*lit.lights[1:], own)), search_plate(higher))
    assert [light.name for light in again.lights][1:] == ["light 4"]
    assert remarks[0] == "1 light was found"
    assert again.lights[-1] == own


def test_the_picture_gets_the_shape_of_the_plate(project, plate):
    square = project.replace(camera=Camera(size_px=(50, 50), sensor_mm=(24.0, 24.0)))
    framed, remarks = with_found_lights(square, search_plate(plate))
    assert framed.camera.size_px == (64, 36)
    assert framed.camera.sensor_mm == pytest.approx((24.0, 13.5))
    assert any(remark == "the picture has the size of the plate now, 64x36" for remark in remarks)
    with pytest.raises(ProjectError, match="of another shape"):
        kept_on_plate(framed, framed.replace(camera=Camera(size_px=(50, 50))))


def test_a_lit_project_reads_back_and_has_no_scale(lit, tmp_path):
    path = tmp_path / "shot.toml"
    path.write_text(project_text(lit, folder=tmp_path), "utf-8")
    again = read_project(path)
    assert again.plate == lit.plate
    assert [light.intensity for light in again.lights] == [light.intensity for light in lit.lights]
    # layers add to the plate as they are
    assert exr_scale(again) == 1.0
    assert exr_scale(again.replace(plate=again.plate.replace(lights_above=None))) > 1.0


def test_what_cannot_be_searched_is_refused_in_one_sentence(project, plate, tmp_path):
    with pytest.raises(ProjectError, match="stands for a sequence; give the file of one frame"):
        plate_settings_of(Backplate(image="plate.####.exr"))
    with pytest.raises(ProjectError, match="needs the scale of the plate"):
        plate_settings_of(plate.replace(search=PlateSearch(source="sun")))
    with pytest.raises(ProjectError, match="no known lamp"):
        plate_settings_of(plate.replace(search=PlateSearch(source="moon", white=0.9)))
    with pytest.raises(FlarewrightError, match=r"no source above 5"):
        search_plate(plate.replace(search=PlateSearch(threshold=5.0)))
    Image.new("RGB", (8, 8)).save(tmp_path / "black.png")
    with pytest.raises(FlarewrightError, match="the plate is black"):
        search_plate(Backplate(image=str(tmp_path / "black.png")))

    def cancel(part, _words):
        if part > 0.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search_plate(plate, cancel)


def test_the_comp_of_a_lit_project_is_that_of_its_plate_and_other_plates_replace_found_lights(lit, project, tmp_path):
    def comp(of, name, **more):
        over = tmp_path / f"{name}.####.exr"
        shot(of, tmp_path / f"{name}-flare.####.exr", frames="1", processes=1, threads=1, over=over, **more)
        return read_exr(tmp_path / f"{name}.0001.exr").layers[0].pixels

    draft = lit.replace(quality=Quality(mode="draft", wavelengths=3))
    own = comp(draft, "own")
    plate = plate_settings_of(lit.plate)
    dark = draft.replace(lights=(Light(field_deg=(0.0, 0.0), intensity=0.0),), plate=None)
    # the order of the lights differs, and so the rounding of their sum to half floats
    np.testing.assert_allclose(own, comp(dark, "searched", plate=plate), rtol=1e-3)
    # not twice the light
    np.testing.assert_allclose(own, comp(draft, "again", plate=plate), rtol=1e-3)
    free = draft.replace(plate=draft.plate.replace(lights_above=None))
    with pytest.raises(ProjectError, match="not those of its plate, so the flare has another unit"):
        comp(free, "free")
    assert without_found_lights(free) == free
