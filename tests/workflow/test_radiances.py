"""A shot in the values of a picture that shows the radiance of the scene."""

from __future__ import annotations

from math import cos, pi, radians

import numpy as np
import pytest

from flarewright import Camera, Light, Project, Quality, shot
from flarewright.errors import ProjectError
from flarewright.io.images.exr import read_exr
from flarewright.plates.settings import PlateSettings
from flarewright.workflow.plates.plate_frame import with_radiances
from flarewright.workflow.shot_frame import ShotPlan, frame_project

SIZE, SENSOR = (64, 36), (16.0, 9.0)


def project(**changes):
    light = Light(field_deg=(0.0, 0.0), intensity=3.0, diameter_deg=2.0)
    fields = {
        "lens": "heliar-tronnier", "f_number": 8.0, "lights": [light],
        "camera": Camera(size_px=SIZE, sensor_mm=SENSOR), "quality": Quality(mode="draft", wavelengths=3),
    }  # fmt: skip
    return Project(**{**fields, **changes})


def test_the_direct_image_of_a_disc_has_its_radiance(tmp_path):
    shot(project(), tmp_path / "f.####.exr", frames="1", radiance=True, processes=1)
    star = next(each for each in read_exr(tmp_path / "f.0001.exr").layers if each.name == "starburst").pixels
    # of an irradiance E from a disc of half angle a: E = pi L sin(a)^2
    radiance = 3.0 / (pi * (1.0 - cos(radians(1.0)) ** 2))
    height, width = SIZE[1] // 2, SIZE[0] // 2
    middle = star[height - 3 : height + 3, width - 3 : width + 3].mean(axis=(0, 1))
    assert middle == pytest.approx([radiance] * 3, rel=0.02)


def test_the_factor_follows_the_f_number_of_the_moment():
    intensities = [
        frame_project(ShotPlan(project(f_number=f_number), "f.####.exr", radiance=True), 0.0).lights[0].intensity
        for f_number in (8.0, 16.0)
    ]
    assert np.divide(*intensities) == pytest.approx(0.25, rel=0.01)


def test_a_measured_flare_has_no_radiances(monkeypatch):
    monkeypatch.setattr("flarewright.workflow.plates.plate_frame.is_measured", lambda project: True)
    with pytest.raises(ProjectError, match="a measured flare, whose lens is unknown, so radiances are too"):
        with_radiances(project())


def test_a_plate_has_radiances_already(tmp_path):
    with pytest.raises(ProjectError, match="layers over a plate have its unit already; omit --radiance"):
        shot(project(), tmp_path / "f.####.exr", frames="1", radiance=True, plate=PlateSettings("p.exr"))
