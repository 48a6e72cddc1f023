"""Estimators, contrast and curves against hand-computed cases, closed forms, and direct final renders."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from painted import disc_light, painted
from singlet_file import singlet_file

from flarewright.cli.app import run
from flarewright.errors import FlarewrightError
from flarewright.model import Camera, Light, Output, Project, Quality
from flarewright.optics.colour.rgb import luminance_weights
from flarewright.predict.contrast import contrast, washed_share
from flarewright.predict.curves import bins_of, check_curves, sample_curves
from flarewright.predict.flare import Frame
from flarewright.predict.lens_flare import lens_flare, square_flare, statistics_quality
from flarewright.predict.statistics import FLOOR, NAMES, covered_area, measure
from flarewright.predict.table import FlareTable
from flarewright.render.render import render

FRAME = Frame(36.0, 24.0)


def test_statistics_of_four_pixels():
    light = np.array([[1.0, 3.0], [0.0, 4.0]])
    found = measure(light, np.ones((2, 2)), 8.0)
    assert (found.sum_mm2, found.mean, found.maximum, found.minimum) == (16.0, 2.0, 4.0, 0.0)
    # the fourth root of 1 * 3 * FLOOR * 4
    assert found.log_average == pytest.approx((12.0 * FLOOR) ** 0.25, rel=1e-6)


@pytest.mark.parametrize(
    ("scene", "flare", "k_ideal", "k_real", "ratio"),
    [
        ((3.0, 1.0), 0.0, 0.5, 0.5, 1.0),
        ((3.0, 1.0), 2.0, 0.5, 0.25, 0.5),
        ((100.0, 0.0), 50.0, 1.0, 0.5, 0.5),
        ((9.0, 1.0), 0.5, 0.8, 8.0 / 11.0, 10.0 / 11.0),
    ],
)
def test_contrast_of_equations_9_1_to_9_3(scene, flare, k_ideal, k_real, ratio):
    found = contrast(*scene, flare)
    assert (found.k_ideal, found.k_real, found.ratio) == pytest.approx((k_ideal, k_real, ratio), rel=1e-14)


def test_contrast_of_faint_flare_is_the_approximation_of_9_3():
    assert contrast(900.0, 100.0, 1.0).ratio == pytest.approx(1.0 - 2.0 / 1000.0, abs=4e-6)


def test_washed_share_counts_where_contrast_falls_below_nine_tenths():
    # half of 10 * (1 / 0.9 - 1) is 0.5556
    flare = np.array([[0.55, 0.56], [0.0, 9.0]])
    assert washed_share(flare, np.array([[1.0, 1.0], [1.0, 0.5]]), 9.0, 1.0) == pytest.approx(1.5 / 3.5)


@pytest.mark.parametrize("roll", [0.0, 30.0, 90.0, -135.0])
def test_coverage_is_the_area_of_the_frame(roll):
    share = covered_area((180, 180), Frame(45.0, 45.0), FRAME, roll)
    assert share.sum() * (45.0 / 180) ** 2 == pytest.approx(FRAME.area, rel=3e-3)


def test_turning_the_frame_is_turning_the_light():
    """One picture at roll 0 serves all rolls: a disc at one side of the frame leaves it where its height ends."""
    turning = FlareTable(painted(), FRAME)
    by_blades = FlareTable(painted(turns_by_deg=60.0), FRAME)
    drawn = FlareTable(painted(turns_by_deg=None, size=(36.0, 24.0)), FRAME)
    for roll in (0.0, 45.0, 90.0, 135.0, -75.0):
        expected = drawn.at(50.0, roll).values[[0, 1, 2]]
        np.testing.assert_allclose(turning.at(50.0, roll).values[[0, 1, 2]], expected, rtol=0.03)
        np.testing.assert_allclose(by_blades.at(50.0, roll).values[[0, 1, 2]], expected, rtol=0.03)
    assert turning.at(50.0, 90.0).mean < 0.95 * turning.at(50.0, 0.0).mean


def test_a_picture_is_drawn_once():
    drawn, flare = [], painted()
    table = FlareTable(replace(flare, draw=lambda *at: drawn.append(at) or flare.draw(*at)), FRAME)
    for roll in (0.0, 10.0, 20.0):
        table.at(7.0, roll)
        table.between(7.25, roll)
    assert len(drawn) == 2  # 7 and 8 degrees


def test_a_flare_that_does_not_cover_the_turned_frame_is_refused():
    with pytest.raises(FlarewrightError, match=r"needs 43\.27 mm both ways"):
        FlareTable(painted(size=(36.0, 24.0)), FRAME)


def test_curves_follow_a_closed_form():
    curves = sample_curves(FlareTable(painted(), FRAME), tolerance=0.02, most=60)
    assert curves.worst_step < 0.02
    for angle in np.linspace(0.5, 28.0, 31):  # the disc is in the frame until 30 degrees
        found, light = curves.at(float(angle)), disc_light(angle)
        assert found.maximum == pytest.approx(light, rel=0.02)
        assert found.sum_mm2 == pytest.approx(light * np.pi * 36.0, rel=0.03)
        assert found.mean == pytest.approx(found.sum_mm2 / FRAME.area, rel=1e-12)


def test_samples_gather_at_a_peak_and_end_at_the_limit():
    curves = sample_curves(FlareTable(painted(peak_deg=21.0), FRAME), tolerance=1e-4, most=40)
    at = curves.constellation_deg
    assert len(at) == 40
    assert curves.worst_step > 1e-4
    near = (at[1:] > 17.0) & (at[1:] < 25.0)
    assert near.sum() >= 8
    assert np.diff(at)[at[1:] < 10.0].min() > 1.2
    assert curves.at(21.0).maximum == pytest.approx(0.1 + disc_light(21.0), rel=0.03)
    assert at[int(np.argmax(curves.column("maximum")))] == pytest.approx(21.0, abs=0.5)


def test_bins_between_the_extremes():
    edges, bins = bins_of(np.array([2.0, 4.0, 7.9, 8.0, 10.0]), 4)
    assert edges.tolist() == [2.0, 4.0, 6.0, 8.0, 10.0]
    assert bins.tolist() == [1, 2, 3, 4, 4]
    assert bins_of(np.full(3, 5.0), 4)[1].tolist() == [1, 1, 1]


def heliar(lens="heliar-tronnier", **changes):
    return Project(
        lens=lens,
        lights=(Light(field_deg=(0.0, 0.0)),),
        camera=Camera(size_px=(240, 160), sensor_mm=(36.0, 24.0)),
        **changes,
    )


@pytest.mark.parametrize(("iris", "error"), [pytest.param({}, 0.01, marks=pytest.mark.slow), ({"blades": 5}, 0.01)])
def test_occurrence_is_that_of_a_direct_final_render(iris, error, tmp_path):
    """The table's coarse square, cut and rotated, against a final render of the upright frame at that roll.

    A round iris turns with the light; blades do not, so their flare is drawn at several rolls.
    """
    project = heliar(singlet_file(tmp_path) if iris else "heliar-tronnier", f_number=5.6, iris=iris)
    flare, frame = square_flare(project, statistics_quality("final"))
    table = FlareTable(flare, frame)
    for field, constellation, roll in [((12.0, 0.0), 12.0, 0.0), ((0.0, 25.0), 25.0, 90.0)]:
        shot = project.replace(
            lights=(Light(field_deg=field, intensity=3.0),), quality=Quality(), output=Output(starburst=False)
        )
        rendering = render(shot)
        light = rendering.layers[0].pixels.astype(float) @ luminance_weights("rec709")
        found = table.at(constellation, roll)
        assert 3.0 * found.mean == pytest.approx(light.mean(), rel=error)
        assert 3.0 * found.sum_mm2 == pytest.approx(light.sum() * (36.0 / 240) ** 2, rel=error)
        assert 3.0 * found.log_average == pytest.approx(np.exp(np.log(light + FLOOR).mean()), rel=error)
        assert flare.scene_scale == pytest.approx(rendering.summary["scene_irradiance_per_radiance"], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("to_deg", "most"), [(24.0, 9), (40.0, 14)])
def test_curves_of_a_lens_hold_between_their_samples(to_deg, most):
    project = heliar(f_number=8.0)
    flare, frame = square_flare(project, statistics_quality("final"))
    curves = sample_curves(FlareTable(flare, frame), to_deg=to_deg, tolerance=0.1, most=most)
    upright = project.replace(camera=Camera(size_px=(160, 107), sensor_mm=(36, 24)), quality=Quality(wavelengths=5))
    check = check_curves(curves, lens_flare(upright), 3)
    wanted = [NAMES.index(name) for name in ("sum_mm2", "mean", "log_average")]
    np.testing.assert_allclose(check.predicted[:, wanted], check.rendered[:, wanted], rtol=0.12)


def test_the_frame_of_an_anamorphic_lens_is_that_of_its_render():
    """Its width was that of a lens without squeeze, twice too large."""
    lights = (Light(field_deg=(0.0, 0.0)),)
    project = Project(lens="anamorphic-heliar-2x", lights=lights, camera=Camera(size_px=(96, 40), desqueeze=True))
    draft = Quality(mode="draft", wavelengths=3)
    _, frame = square_flare(project, draft)
    rendered = render(project.replace(quality=draft, output=Output(starburst=False)))
    assert [frame.width, frame.height] == rendered.summary["sensor_mm"]


def test_a_round_iris_turns_with_the_light_blades_by_steps_and_an_anamorphic_lens_not():
    assert lens_flare(heliar(f_number=8.0, iris={}, quality={"mode": "draft"})).turns_by_deg == 0.0
    assert lens_flare(heliar(f_number=8.0, iris={"blades": 5}, quality={"mode": "draft"})).turns_by_deg == 72.0
    squeezed = heliar(quality={"mode": "draft"}).replace(lens="anamorphic-heliar-2x")
    assert lens_flare(squeezed).turns_by_deg is None


@pytest.mark.parametrize(
    "changes",
    [
        {"lights": ({"field_deg": (0.0, 0.0), "shape": {"kind": "rectangle", "size_deg": (30.0, 1.0)}},)},
        {"camera": {"size_px": (48, 32), "sensor_reflectance": 0.1, "sensor_grating": {"period_um": 4.0}}},
        {"art": {"rules": ({"select": "all", "offset_mm": (3.0, 0.0)},)}},
    ],
)
def test_what_stands_in_the_picture_does_not_turn_with_the_light(changes):
    """One picture served all rolls, so a bar of light, the sensor's grating and moved ghosts turned with the light."""
    given = heliar("triplet-pestrecov", iris={}, quality={"mode": "draft"}).model_dump() | changes
    assert lens_flare(Project.model_validate(given)).turns_by_deg is None
    unmoved = {**given, "art": {"physical": True, **changes.get("art", {})}}
    assert lens_flare(Project.model_validate(unmoved)).turns_by_deg == (0.0 if "art" in changes else None)


def test_five_blades_are_drawn_at_four_rolls_and_turned_to_all_others():
    table = FlareTable(painted(turns_by_deg=72.0), FRAME)
    drawn = {view[0] for roll in np.linspace(-180.0, 180.0, 501) for view in table.views(float(roll))}
    assert drawn == {0.0, 18.0, 36.0, 54.0}
    for roll in (-170.0, 3.0, 100.0):
        views = table.views(roll)
        assert sum(weight for *_, weight in views) == pytest.approx(1.0)
        for at, turn, _ in views:
            assert at + turn == pytest.approx(roll)
            # pictures are rotated by whole blades plus less than a quarter of one
            assert abs((turn + 36.0) % 72.0 - 36.0) <= 18.0


def test_command_reports_curves_and_writes_a_page_that_asks_for_nothing(tmp_path, capsys):
    page = tmp_path / "report.html"
    arguments = [singlet_file(tmp_path), "--fstop", "8", "--quality", "draft", "--samples", "7", "--check", "1"]
    arguments += ["--luminance", "50,5000"]
    assert run(["predict", *arguments, "-o", str(page), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert len(data["constellation_deg"]) == len(data["statistics"]["mean"]["values"]) == len(data["k_ratio"]) == 7
    assert data["k_ideal"] == pytest.approx(4950.0 / 5050.0)
    assert data["k_real"][0] == pytest.approx(4950.0 / (5050.0 + 2.0 * data["veil_cd_m2"][0]))
    veil = data["statistics"]["mean"]["values"][0] * 1e5 / data["scene_irradiance_per_radiance"]
    assert data["k_ratio"][0] == pytest.approx(5050.0 / (5050.0 + 2.0 * veil))
    text = page.read_text("utf-8")
    assert text.count("<svg") == 6
    assert "data:image/png;base64," in text
    # the page has no address except names of standards
    assert set(re.findall(r"https?://[^\s\"'<>]+", text)) <= {"http://www.w3.org/2000/svg"}
    assert "<script" not in text


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--quality", "fine"], "--quality 'fine' is unknown here"),
        (["--to", "90"], "--to 90"),
        (["--roll", "nan"], "--roll nan"),
        (["--tolerance", "0"], "--tolerance 0"),
        (["--luminance", "5"], "--luminance"),
        (["--luminance", "50,20"], "the darkest first"),
        (["--illuminance", "-1"], "--illuminance -1"),
        (["--sensor", "0x24"], "--sensor"),
        (["--sensor", "1e-300x1e300"], "1e-300x1e+300 mm is no sensor"),
        (["--sensor", "36x0.05"], "36x0.05 mm is no sensor; give sides of 0.1 to 1000 mm"),
        (["--fstop", "1"], "faster than"),
        (["--fstop", "-1"], "--fstop"),
        (["--light-diameter", "-1"], "--light-diameter"),
        (["--spectrum", "moon"], "moon"),
        (["-o", "report.pdf"], "*.html"),
        (["--bins", "1"], "bins"),
    ],
)
def test_bad_input_is_one_sentence(flags, words, capsys):
    assert run(["predict", "heliar-tronnier", *flags]) == 2
    reported = capsys.readouterr().err
    assert words in reported
    assert "Traceback" not in reported
    assert reported.count("\n") == 1
