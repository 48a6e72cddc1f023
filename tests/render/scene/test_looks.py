"""Looks applied to other lenses and lights, and extracted from projects."""

import pytest

from flarewright.errors import ProjectError
from flarewright.io.project.look_file import read_look, shipped_looks
from flarewright.model import (
    Art,
    Bare,
    BlackBody,
    Camera,
    Dirt,
    Holdout,
    InTurn,
    Iris,
    Light,
    LightCurve,
    PerRow,
    Preset,
    Project,
    ProjectCurve,
    QuarterWave,
    RowScatter,
    Rule,
    Scatter,
)
from flarewright.optics.rays.pack import resolve_coatings, rows_in_air
from flarewright.render.scene.looks import demonstration, look_of, with_look
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.workflow.keyframes import project_at

TESSAR, TAKUMAR = "tessar-brendel", "takumar-50-f1.4"


def shot(**changes):
    return Project(lens=TAKUMAR, lights=(Light(field_deg=(-9.0, 5.0), intensity=3.0),), **changes)


def rich(lens=TESSAR):
    count = len(load_lens(lens).rows)
    coatings = tuple(QuarterWave(center_wavelength_nm=400.0 + 10.0 * k) for k in range(count))
    return Project(
        lens=lens, f_number=8.0, iris=load_lens(lens).iris.replace(rounding=0.2), coating=PerRow(coatings=coatings),
        dirt=Dirt(dust_per_mm2=1.0), camera=Camera(size_px=(64, 36), sensor_reflectance=0.1),
        lights=(Light(field_deg=(5.0, 2.0), spectrum=BlackBody(temperature_k=2500.0), diameter_deg=0.4),),
        art=Art(gain={"ghosts": 2.0}, rules=(Rule(select="brightest:3", gain=0.5), Rule(select="5-3", enable=False))),
    )  # fmt: skip


def test_a_look_leaves_lens_places_and_strengths_alone():
    look, _ = look_of(rich(), "Dusk")
    before = shot(holdout=Holdout(image="leaves.png"), zoom=None)
    after, remarks = with_look(before, look)
    assert (after.lens, after.holdout, after.camera.size_px) == (TAKUMAR, before.holdout, before.camera.size_px)
    (light,) = after.lights
    assert (light.field_deg, light.intensity) == ((-9.0, 5.0), 3.0)
    assert (light.spectrum, light.diameter_deg) == (BlackBody(temperature_k=2500.0), 0.4)
    assert (after.f_number, after.dirt.dust_per_mm2, after.camera.sensor_reflectance) == (8.0, 1.0, 0.1)
    # the blades are those of the lens, their rounding is that of the look
    assert after.iris == load_lens(TAKUMAR).iris.replace(rounding=0.2)
    # a rule that names a ghost of another lens is left out, with a remark
    assert [rule.select for rule in after.art.rules] == ["brightest:3"]
    assert remarks == ("1 of the look's rules name ghosts of tessar-brendel and are left out",)


def test_values_of_a_look_replace_the_curves_of_a_project():
    """A curve would override the look; curves of other values stay."""

    def curve(of, first, last):
        record = LightCurve if of in ("rgb", "intensity") else ProjectCurve
        return record(of=of, at_s=(0.0, 1.0), values=(first, last))

    brightening = curve("intensity", 1.0, 2.0)
    light = Light(field_deg=(-9.0, 5.0), curves=(curve("rgb", (1.0, 0.5, 0.2), (1.0, 1.0, 1.0)), brightening))
    turning = curve("rotation_deg", 0.0, 90.0)
    project = Project(
        lens=TAKUMAR, lights=(light,), curves=(curve("f_number", 4.0, 11.0), turning, curve("gain.ghosts", 0.0, 1.0))
    )
    after, remarks = with_look(project, look_of(rich(), "Dusk")[0])
    moment = project_at(after, 1.0)
    assert (moment.f_number, moment.art.gain) == (8.0, {"ghosts": 2.0})
    assert moment.lights[0].spectrum == BlackBody(temperature_k=2500.0)
    assert (after.curves, after.lights[0].curves) == ((turning,), (brightening,))
    words = "the look's values replace the project's curves of f_number, gain.ghosts, rgb of light 0 (counted from 0)"
    assert words in remarks


def test_coatings_by_row_go_to_another_lens_in_turn():
    look, _ = look_of(rich(), "Dusk")
    after, _ = with_look(shot(), look)
    worn = [look.example.coating.coatings[k] for k in rows_in_air(load_lens(TESSAR))]
    assert after.coating == InTurn(coatings=tuple(worn))
    dealt = resolve_coatings(load_lens(TAKUMAR), after.coating)
    assert [dealt[k] for k in rows_in_air(load_lens(TAKUMAR))][: len(worn)] == worn
    # on their lens they stay unchanged
    own, remarks = with_look(Project(lens=TESSAR, lights=shot().lights), look)
    assert (own.coating, remarks) == (look.example.coating, ())
    assert own.art == look.example.art


def test_scatter_by_row_stays_with_its_lens():
    scatter = Scatter(model="abg", rows=(RowScatter(row=1, share=0.1), RowScatter(row=4, share=0.2)))
    look, _ = look_of(rich().replace(scatter=scatter, art=Art()), "Dusk")
    after, remarks = with_look(shot(), look)
    assert after.scatter == Scatter(model="abg")
    assert remarks == ("the look's scatter at rows 1, 4 is for another lens, and left out",)
    own, remarks = with_look(Project(lens=TESSAR, lights=shot().lights), look)
    assert (own.scatter, remarks) == (scatter, ())


def test_presets_that_the_other_lens_has_are_its_own():
    for name, there in (("period", True), ("staggered", True), ("thesis", False)):
        look, _ = look_of(rich("heliar-tronnier").replace(coating=Preset(name=name)), "x")
        after, _ = with_look(shot(), look)
        assert (after.coating == Preset(name=name)) == there
        assert isinstance(after.coating, Preset | InTurn)


def test_a_light_that_has_a_size_keeps_it_and_an_opening_is_no_wider_than_the_lens():
    look, _ = look_of(rich().replace(f_number=2.8), "x")
    sun = Project(lens="heliar-tronnier", lights=(Light(field_deg=(1.0, 2.0), diameter_deg=0.53),))
    after, _ = with_look(sun, look)
    assert after.lights[0].diameter_deg == 0.53
    assert after.f_number == load_lens("heliar-tronnier").f_number


def test_what_is_taken_from_a_project_is_what_it_says():
    look, remarks = look_of(rich(), "Dusk", "notes")
    assert set(look.says) == {
        "f_number", "coating", "dirt", "art", "iris.rounding", "camera.sensor_reflectance", "lights.spectrum",
        "lights.diameter_deg",
    }  # fmt: skip
    assert remarks == ()
    two = rich().replace(lights=(*rich().lights, Light(field_deg=(1.0, 1.0))))
    assert look_of(two, "x")[1] == ("lights differ in colour or size: the look uses those of the first",)
    with pytest.raises(ProjectError, match="there is nothing in it for a look"):
        look_of(shot(), "x")


def test_a_look_with_a_long_name_or_notes_is_refused():
    """`looks save` ended in a traceback for a file with a name of 81 characters."""
    for words, sentence in (
        (("x" * 81,), "of the look, name should be a text of at most 80 characters, not 81"),
        (("a", "x" * 401), "of the look, notes should be a text of at most 400 characters, not 401"),
    ):
        with pytest.raises(ProjectError, match=sentence):
            look_of(rich(), *words)


@pytest.mark.parametrize("name", shipped_looks())
def test_looks_that_ship_fit_their_stage_and_other_lenses(name):
    look = read_look(name)
    stage = demonstration(look, (64, 36))
    assert stage.camera.size_px == (64, 36)
    assert stage.f_number is not None
    assert all(light.diameter_deg > 0.0 or light.shape is not None for light in stage.lights)
    for lens in ("biotar-50-f1.4", "canon-28-80"):
        after, _ = with_look(Project(lens=lens, lights=shot().lights), look)
        assert len(resolve_coatings(load_lens(lens), after.coating)) == len(load_lens(lens).rows)


def test_a_bare_coating_in_turn_is_bare():
    project = rich().replace(coating=PerRow(coatings=(None,) * len(load_lens(TESSAR).rows)), iris=Iris(blades=5))
    after, _ = with_look(shot(), look_of(project, "x")[0])
    assert set(after.coating.coatings) == {Bare()}


def test_a_look_can_be_given_by_name_or_file(tmp_path):
    """A name used to end in an AttributeError."""
    assert with_look(shot(), "low sun") == with_look(shot(), read_look("low-sun"))
    file = tmp_path / "dusk.toml"
    rows = ("schema_version = 1", 'name = "Dusk"', f'lens = "{TESSAR}"', "f_number = 8.0", "[[lights]]")
    file.write_text("\n".join((*rows, "field_deg = [1.0, 0.0]")), "utf-8")
    assert with_look(shot(), file)[0].f_number == 8.0
    with pytest.raises(ProjectError, match="did you mean low-sun"):
        with_look(shot(), "low-son")


def test_a_look_wider_than_the_lens_says_which_opening_is_used():
    """The f-number used to be changed without a word."""
    look = read_look("warm-vintage")
    after, remarks = with_look(Project(lens="heliar-tronnier", lights=shot().lights), look)
    assert after.f_number == 3.5 > look.example.f_number
    assert remarks == (
        f"the look's f/{look.example.f_number:g} is wider than Heliar-Tronnier 100 mm f/3.5 opens: f/3.5",
    )


def test_a_look_opens_a_zoom_as_far_as_its_position_does():
    zoom = load_lens("canon-70-200")
    slow = zoom.replace(positions=(*zoom.positions[:-1], zoom.positions[-1].replace(f_number=5.6)))
    before = Project(lens=slow, zoom=zoom.positions[-1].name, lights=(Light(field_deg=(3.0, 1.0)),))
    look, _ = look_of(rich().replace(f_number=4.0), "Fast")
    after, remarks = with_look(before, look)
    assert after.f_number == 5.6
    assert any(remark.endswith("opens: f/5.6") for remark in remarks)
    resolve_project(after)
