"""A project at a time, against the papers' formulas and by hand."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from flarewright import Light, LightCurve, LightKey, Project, ProjectCurve, Timeline
from flarewright.errors import ProjectError
from flarewright.io.project.project_file import project_from_data
from flarewright.io.project.project_text import project_text
from flarewright.model.lens.prescription import LEAST_F_NUMBER
from flarewright.workflow.keyframes import (
    frame_rate,
    is_still,
    length_s,
    peak_intensity,
    project_at,
    still,
    time_of,
    value_at,
)

TIMES, VALUES = (0.0, 1.0, 1.5, 4.0), (2.0, 3.0, 8.0, 9.0)


def moving(**changes):
    keys = (LightKey(at_s=0.5, field_deg=(-12.0, 4.0)), LightKey(at_s=1.5, field_deg=(8.0, 6.0)))
    curves = (
        LightCurve(of="intensity", at_s=(0.0, 2.0), values=(1.0, 5.0)),
        LightCurve(of="rgb", at_s=(0.0, 2.0), values=((1.0, 0.5, 0.0), (1.0, 1.0, 1.0))),
    )
    light = Light(field_deg=(0.0, 0.0), keyframes=keys, curves=curves)
    return Project(lens="heliar-tronnier", lights=[light], **changes)


def test_smooth_values_have_the_slopes_of_fritsch_and_butland():
    h, delta = np.diff(TIMES), np.diff(VALUES) / np.diff(TIMES)
    for k in (1, 2):
        w1, w2 = 2 * h[k] + h[k - 1], h[k] + 2 * h[k - 1]
        slope = (w1 + w2) / (w1 / delta[k - 1] + w2 / delta[k])
        for side in (-1e-6, 1e-6):
            found = (value_at(TIMES[k] + side, TIMES, VALUES, "smooth") - VALUES[k]) / side
            assert found == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("motion", ["linear", "smooth"])
def test_values_pass_through_keys_rest_outside_and_never_overshoot(motion):
    values = (1.0, 8.0, 8.0, 2.0)
    assert [value_at(t, TIMES, values, motion) for t in TIMES] == pytest.approx(list(values))
    assert value_at(-3.0, TIMES, values, motion) == 1.0
    assert value_at(9.0, TIMES, values, motion) == 2.0
    found = np.array([value_at(t, TIMES, values, motion) for t in np.linspace(0, 4, 81)])
    assert found.min() >= 1.0
    assert found.max() <= 8.0


def test_every_value_moves():
    curves = [
        ProjectCurve(of="f_number", at_s=(0.0, 2.0), values=(8.0, 16.0)),
        ProjectCurve(of="focus_distance", at_s=(0.0, 2.0), values=(1000.0, 3000.0)),
        ProjectCurve(of="rotation_deg", at_s=(0.0, 2.0), values=(0.0, 90.0)),
        ProjectCurve(of="gain.ghosts", at_s=(0.0, 2.0), values=(1.0, 3.0)),
        ProjectCurve(of="gain.starburst", at_s=(0.0, 2.0), values=(1.0, 0.0)),
        ProjectCurve(of="zoom", at_s=(0.0, 2.0), values=(28.0, 80.0)),
    ]
    found = project_at(moving(curves=curves), 1.0)
    (light,) = found.lights
    assert light.field_deg == pytest.approx((-2.0, 5.0))
    assert light.intensity == 3.0
    assert light.spectrum.rgb == pytest.approx((1.0, 0.75, 0.5))
    assert (found.f_number, found.camera.focus_distance, found.zoom) == (12.0, 2000.0, 54.0)
    # the blades of the lens stay
    assert (found.iris.rotation_deg, found.iris.blades) == (45.0, project_at_rest_blades())
    assert found.art.gain == {"ghosts": 2.0, "starburst": 0.5}
    assert is_still(still(found))
    assert not is_still(found)


def project_at_rest_blades():
    from flarewright import load_lens

    return load_lens("heliar-tronnier").iris.blades


def test_temperature_moves():
    curve = LightCurve(of="temperature_k", at_s=(0.0, 2.0), values=(3000.0, 5000.0))
    project = Project(lens="heliar-tronnier", lights=[Light(field_deg=(1, 1), curves=(curve,))])
    assert project_at(project, 0.5).lights[0].spectrum.temperature_k == 3500.0


def test_the_last_key_and_the_peak_count_all_curves():
    project = moving()
    assert length_s(project) == 2.0
    assert peak_intensity(project) == 5.0
    assert length_s(still(project)) == 0.0


def test_the_project_file_keeps_all_keys(tmp_path):
    import tomllib

    project = moving(
        timeline=Timeline(fps=25.0, start=1001),
        curves=[ProjectCurve(of="f_number", at_s=(0.0, 2.0), values=(8.0, 16.0), motion="smooth")],
    )
    text = project_text(project)
    assert project_from_data(tomllib.loads(text), folder=tmp_path, where="p") == project
    # a project without keys says nothing about time
    assert not any(word in project_text(still(project)) for word in ("curves", "timeline", "motion", "keyframes"))


def test_frames_have_exact_times():
    assert frame_rate(23.98) == frame_rate(23.976) == Fraction(24000, 1001)
    assert frame_rate(29.97) == Fraction(30000, 1001)
    for nominal in (12, 15, 24, 30, 48, 60, 72, 90, 96, 120, 144, 240, 300, 480, 960):
        exact = Fraction(nominal * 1000, 1001)
        assert {frame_rate(round(float(exact), digits)) for digits in (2, 3, 6, 12)} == {exact}
        assert frame_rate(nominal) == nominal
    assert frame_rate(24.975) == Fraction(25000, 1001)
    assert frame_rate(0.04) == Fraction(1, 25)
    assert frame_rate(25) == 25
    assert time_of(1025, Timeline(fps=24, start=1001)) == 1.0
    assert time_of(24001, Timeline(fps=23.976, start=1)) == pytest.approx(1001.0, abs=1e-12)


@pytest.mark.parametrize(
    ("record", "fields", "said"),
    [
        (LightCurve, {"of": "intensity", "at_s": (0, 1), "values": (1,)}, "as many values as times"),
        (LightCurve, {"of": "intensity", "at_s": (1, 0), "values": (1, 2)}, "must rise"),
        (LightCurve, {"of": "intensity", "at_s": (0, 1), "values": (1, -2)}, "lies between 0 and"),
        (LightCurve, {"of": "rgb", "at_s": (0,), "values": (1,)}, "three numbers"),
        (LightCurve, {"of": "rgb", "at_s": (0,), "values": ((0, 0, 0),)}, "black has no colour"),
        (ProjectCurve, {"of": "f_number", "at_s": (0,), "values": ((1, 1, 1),)}, "one number"),
        (ProjectCurve, {"of": "speed", "at_s": (0,), "values": (1,)}, "f_number"),
    ],
)
def test_a_wrong_curve_is_refused(record, fields, said):
    with pytest.raises(ProjectError, match=said):
        record(**fields)


def test_a_value_has_one_curve():
    one = LightCurve(of="intensity", at_s=(0,), values=(1,))
    warm = LightCurve(of="temperature_k", at_s=(0,), values=(3000,))
    red = LightCurve(of="rgb", at_s=(0,), values=((1, 0, 0),))
    for curves, said in (((one, one), "keep one"), ((warm, red), "both set the colour")):
        with pytest.raises(ProjectError, match=said):
            Light(field_deg=(0, 0), curves=curves)


def test_values_that_do_not_fit_together_name_the_time():
    # the least f-number itself is none
    curve = ProjectCurve(of="f_number", at_s=(0.0,), values=(LEAST_F_NUMBER,))
    with pytest.raises(ProjectError, match=r"at 0\.5 s"):
        project_at(moving(curves=[curve]), 0.5)


@pytest.mark.parametrize("seed", range(20))
def test_smooth_fades_end_within_the_range_of_their_keys(seed):
    rng = np.random.default_rng(seed)
    for _ in range(20):
        times = tuple(np.cumsum(rng.uniform(0.1, 3.0, 3)))
        values = (float(rng.uniform(0.1, 3.0)), float(rng.uniform(0.1, 3.0)), 0.0)
        # rounding of the cubic gives -1e-16 in a fifth of such fades
        curve = LightCurve(of="intensity", at_s=times, values=values, motion="smooth")
        faded = project_at(
            Project(lens="heliar-tronnier", lights=(Light(field_deg=(1.0, 1.0), curves=(curve,)),)), times[-1]
        )
        assert 0.0 <= faded.lights[0].intensity < 1e-12


def test_an_iris_turns_more_than_once():
    turning = Project(
        lens="heliar-tronnier", lights=(Light(field_deg=(1.0, 1.0)),),
        curves=(ProjectCurve(of="rotation_deg", at_s=(0.0, 1.0), values=(0.0, 900.0)),),
    )  # fmt: skip
    assert project_at(turning, 1.0).iris.rotation_deg == pytest.approx(180.0)
    assert project_at(turning, 0.5).iris.rotation_deg == pytest.approx(90.0)
