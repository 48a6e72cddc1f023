"""Projects with a measured flare: layers equal the replay's, lights add, and rules do only what they say."""

import json

import numpy as np
import pytest
from PIL import Image
from test_model_image import planted
from test_sprites import slope, sprite

from flarewright.cli.app import run
from flarewright.errors import FlarewrightError
from flarewright.io.images.exr import read_exr
from flarewright.io.images.half import rounded_to_half
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.io.project.project_file import read_project
from flarewright.io.project.project_text import project_text
from flarewright.measure.replay.measured_project import check_measured, render_any, render_measured, with_sensor
from flarewright.measure.replay.model_image import replay_model
from flarewright.model import Art, Camera, Iris, Light, Project, Rule
from flarewright.model.project.holdout import Holdout
from flarewright.optics.lens.field_angles import field_angles

SIZE = (160, 90)
PLACE = field_angles(12.0, 25.0)


def light(constellation_deg=12.0, roll_deg=25.0, **facts):
    return Light(field_deg=field_angles(constellation_deg, roll_deg), **facts)


@pytest.fixture
def project(tmp_path):
    """Return a measured flare of two ghosts, a halo, a star, and a residual."""
    rest = sprite([slope() + 20.0 * k for k in range(26)])
    path = tmp_path / "model.json"
    write_ghost_model(path, planted().replace(sprites=(rest,)))
    return Project(lens=str(path), lights=(light(),), camera=Camera(size_px=SIZE))


def model_of(project):
    from flarewright.io.measurement.ghost_model_file import read_ghost_model

    return read_ghost_model(project.lens)


def layers(project):
    return {layer.name: layer for layer in render_measured(project).layers}


def pixels(project, name="beauty"):
    return layers(project)[name].pixels


def near(drawn, reported, part=1e-4):
    """Return whether pictures differ by less than a part of the brightest value."""
    return drawn.shape == reported.shape and float(np.abs(drawn - reported).max()) <= part * float(
        np.abs(reported).max()
    )


def whole(layer):
    """Return a layer extended to the picture's size."""
    x, y, w, h = layer.window
    sheet = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
    sheet[y : y + h, x : x + w] = layer.pixels
    return sheet


def test_a_light_at_its_field_angles_is_the_replay_at_its_constellation_and_roll(project):
    drawn = layers(project)
    reported = {layer.name: layer for layer in replay_model(model_of(project), 12.0, roll_deg=25.0, size_px=SIZE)}
    assert list(drawn) == ["beauty", "ghosts", "starburst", "halo", "residual"]
    for name, layer in drawn.items():
        assert near(layer.pixels, reported[name].pixels), name
    total = sum(whole(drawn[name]) for name in list(drawn)[1:])
    assert near(drawn["beauty"].pixels, total)


def test_lights_add_and_their_intensities_multiply(project):
    one, other = light(8.0, 25.0), light(16.0, -100.0)
    parts = [pixels(project.replace(lights=(each,))) for each in (one, other)]
    both = pixels(project.replace(lights=(one, other.replace(intensity=0.25))))
    assert near(both, parts[0] + 0.25 * parts[1])


def test_what_one_side_has_shown_stands_for_the_other(project, tmp_path):
    other = tmp_path / "other.json"
    mirrored = model_of(project).replace(constellation_deg=(-25.0, 0.0), sprites=(), largest_deg=25.0)
    write_ghost_model(other, mirrored)
    drawn = render_measured(project.replace(lens=str(other)))
    assert drawn.summary["lights"][0]["constellation_deg"] == pytest.approx(-12.0)
    reported = replay_model(mirrored, -12.0, roll_deg=205.0, size_px=SIZE)[0]
    assert near(drawn.layers[0].pixels, reported.pixels)


def test_the_direct_image_is_reported_where_the_halo_is_brightest(project):
    (reported,) = render_measured(project).summary["lights"]
    halo = pixels(project, "halo")[..., 1]
    row, column = np.unravel_index(halo.argmax(), halo.shape)
    pitch = 36.0 / SIZE[0]
    x, y = (column + 0.5 - SIZE[0] / 2) * pitch, (SIZE[1] / 2 - row - 0.5) * pitch
    assert reported["direct_position_mm"] == pytest.approx([x, y], abs=pitch)


def test_a_draft_has_no_rest_and_the_same_ghosts(project):
    draft, final = layers(project.replace(quality={"mode": "draft"})), layers(project)
    assert "residual" not in draft
    for name in ("ghosts", "starburst", "halo"):
        assert np.array_equal(draft[name].pixels, final[name].pixels)


def test_single_ghosts_add_up_and_the_brightest_come_first(project):
    drawn = layers(project.replace(output={"layers": "ghosts"}))
    singles = [layer for name, layer in drawn.items() if name.startswith("ghost.")]
    assert {layer.name for layer in singles} == {"ghost.1", "ghost.2"}
    assert near(sum(whole(layer) for layer in singles), drawn["ghosts"].pixels)
    fluxes = [layer.about["flux_mm2"] for layer in singles]
    assert fluxes == sorted(fluxes, reverse=True)
    for layer, flux in zip(singles, fluxes, strict=True):
        luminance = layer.pixels.astype(float) @ [0.2126, 0.7152, 0.0722]
        assert flux == pytest.approx(luminance.sum() * (36.0 / SIZE[0]) ** 2, rel=1e-3)
    few = layers(project.replace(output={"layers": "ghosts", "brightest": 1}))
    assert [name for name in few if name.startswith("ghost.")] == [singles[0].name]


@pytest.mark.parametrize(
    ("rules", "ghosts"),
    [
        ([{"select": "1", "enable": False}], {"2": (1, 1, 1)}),
        ([{"select": "not 1", "enable": False}], {"1": (1, 1, 1)}),
        ([{"select": "1,2", "gain": 2.0}, {"select": "2", "tint": (0.5, 1.0, 0.0)}], {"1": (2, 2, 2), "2": (1, 2, 0)}),
        ([{"select": "all", "enable": False}, {"select": "2", "enable": True}], {"2": (1, 1, 1)}),
    ],
)
def test_rules_choose_and_colour_ghosts(project, rules, ghosts):
    singles = layers(project.replace(output={"layers": "ghosts"}))
    changed = layers(project.replace(art=Art(rules=[Rule(**rule) for rule in rules]), output={"layers": "ghosts"}))
    reported = sum(np.array(rgb, np.float32) * whole(singles[f"ghost.{name}"]) for name, rgb in ghosts.items())
    assert near(changed["ghosts"].pixels, reported)
    assert {name.removeprefix("ghost.") for name in changed if name.startswith("ghost.")} == set(ghosts)
    for name, rgb in ghosts.items():
        assert near(whole(changed[f"ghost.{name}"]), np.array(rgb, np.float32) * whole(singles[f"ghost.{name}"]))
    # the residual corrects ghosts, and removes no light where rules removed them
    assert changed["beauty"].pixels.min() >= -1e-5 * changed["beauty"].pixels.max()
    physical = Art(rules=[Rule(**rule) for rule in rules], physical=True)
    assert np.array_equal(pixels(project.replace(art=physical)), pixels(project))


@pytest.mark.parametrize("kind", ["brightest", "largest"])
def test_the_brightest_and_the_largest_are_those_in_the_picture(project, kind):
    singles = {
        name: whole(layer)[..., 1].astype(float)
        for name, layer in layers(project.replace(output={"layers": "ghosts"})).items()
        if name.startswith("ghost.")
    }

    def spread(one):
        y, x = np.mgrid[: one.shape[0], : one.shape[1]]
        return sum(np.average((at - np.average(at, weights=one)) ** 2, weights=one) for at in (x, y))

    first = max(singles, key=lambda name: singles[name].sum() if kind == "brightest" else spread(singles[name]))
    only = Art(rules=[Rule(select=f"not {kind}:1", enable=False)])
    left = layers(project.replace(art=only, output={"layers": "ghosts"}))
    assert [name for name in left if name.startswith("ghost.")] == [first]


def test_passes_are_graded_and_the_residual_goes_with_the_ghosts(project):
    plain = layers(project)
    changed = layers(project.replace(art=Art(gain={"ghosts": 2.0, "scatter": 0.5, "starburst": 3.0})))
    for name, gain in {"ghosts": 2.0, "residual": 2.0, "halo": 0.5, "starburst": 3.0}.items():
        assert np.array_equal(changed[name].pixels, np.float32(gain) * plain[name].pixels)


@pytest.mark.parametrize(
    "changes",
    [{"output": {"starburst": False}}, {"art": Art(gain={"scatter": 0.25})}, {"art": Art(gain={"ghosts": 3.0})}],
)
def test_no_pixel_is_below_0_without_the_star_or_with_other_gains(project, tmp_path, changes):
    """The residual also corrects star and halo; where they were dimmed or left out, the picture had negative light."""
    path = tmp_path / "model.json"
    less = sprite([slope() - 20.0 * k for k in range(26)])
    write_ghost_model(path, model_of(project).replace(sprites=(less,)))
    assert pixels(project).min() == pytest.approx(0.0, abs=1e-5)
    changed = layers(project.replace(**changes))
    assert changed["beauty"].pixels.min() >= -1e-5 * changed["beauty"].pixels.max()
    # elsewhere the residual is as before
    plain = layers(project)
    kept = plain["residual"].pixels > 0.0
    by = 3.0 if "ghosts" in changes.get("art", Art()).gain else 1.0
    np.testing.assert_allclose(changed["residual"].pixels[kept], by * plain["residual"].pixels[kept], rtol=1e-6)


def test_the_cameras_colours_become_those_of_the_picture(project, tmp_path):
    matrix = ((1.6, -0.4, -0.2), (-0.3, 1.5, -0.2), (0.1, -0.6, 1.5))
    path = tmp_path / "colours.json"
    write_ghost_model(path, model_of(project).replace(to_rec709=matrix))
    reported = pixels(project) @ np.array(matrix, np.float32).T
    assert near(pixels(project.replace(lens=str(path))), reported)
    # white is (1, 1, 1) in both spaces
    white = tmp_path / "white.json"
    write_ghost_model(white, model_of(project).replace(to_rec709=((0.0, 1.0, 0.0),) * 3))
    grey = [pixels(project.replace(lens=str(white), output={"colorspace": space})) for space in ("rec709", "acescg")]
    assert near(grey[1], grey[0])


def test_a_spectrum_tints_by_the_lights_own_colour_and_says_so(project):
    red = render_measured(project.replace(lights=(light(spectrum={"kind": "rgb", "rgb": (1.0, 0.25, 0.1)}),)))
    tint = np.array([1.0, 0.25, 0.1]) / ([0.2126, 0.7152, 0.0722] @ np.array([1.0, 0.25, 0.1]))
    plain = pixels(project)
    # the spectrum of a colour is smooth, so it matches that colour to a hundredth
    assert near(red.layers[0].pixels, plain * tint, 0.01)
    assert any("tinted" in remark for remark in red.remarks)
    assert not any("tinted" in remark for remark in render_measured(project).remarks)


def test_an_f_number_brightens_by_equation_8_3(project):
    # photographed at f/2
    assert near(pixels(project.replace(f_number=4.0)), 0.25 * pixels(project))


@pytest.mark.parametrize(("shade", "part"), [(0, 0.0), (255, 1.0)])
def test_what_stands_in_front_hides_the_light_where_its_image_is(project, tmp_path, shade, part):
    reported = render_measured(project)
    x, y = reported.summary["lights"][0]["direct_position_mm"]
    matte = np.full((180, 320), 255 - shade, np.uint8)
    column, row = round((x / 36.0 + 0.5) * 320), round((0.5 - y / 20.25) * 180)
    matte[row - 6 : row + 6, column - 6 : column + 6] = shade
    Image.fromarray(matte).save(tmp_path / "matte.png")
    hidden = render_measured(project.replace(holdout=Holdout(image=str(tmp_path / "matte.png"))))
    np.testing.assert_allclose(hidden.layers[0].pixels, part * reported.layers[0].pixels, rtol=1e-5, atol=1e-12)
    assert any("hides every light" in remark for remark in hidden.remarks) == (part == 0.0)


def test_without_its_star_the_rest_stays_and_this_is_said(project):
    drawn = render_measured(project.replace(output={"starburst": False}))
    assert [layer.name for layer in drawn.layers] == ["beauty", "ghosts", "halo", "residual"]
    assert any("own image" in remark for remark in drawn.remarks)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"iris": Iris(blades=6)}, "iris has no meaning"),
        ({"zoom": 35.0}, "zoom has no meaning"),
        ({"coating": {"kind": "preset", "name": "thesis"}}, "coating has no meaning"),
        ({"camera": Camera(size_px=SIZE, focus_distance=900.0)}, "camera.focus_distance has no meaning"),
        ({"camera": Camera(size_px=SIZE, sensor_mm=(36.0, 36.0))}, "36x20.25 mm"),
        ({"lights": (light(), light(distance=500.0))}, r"lights\[1\].distance has no meaning"),
        ({"lights": (light(diameter_deg=0.5),)}, "diameter_deg has no meaning"),
        ({"lights": (light(40.0),)}, "does not cover 40"),
        ({"quality": {"mode": "reference"}}, "reference"),
        ({"quality": {"orders": 4}}, "quality.orders"),
        ({"art": Art(rules=[Rule(select="3", gain=2.0)])}, "has no ghost 3; those it has are 1, 2"),
        ({"art": Art(rules=[Rule(select="row:1", gain=2.0)])}, "no rows"),
        ({"art": Art(rules=[Rule(select="1", scale=2.0)])}, "stay where"),
    ],
)  # fmt: skip
def test_what_only_a_prescription_answers_is_refused_in_a_sentence(project, change, words):
    for judge in (render_measured, check_measured):
        with pytest.raises(FlarewrightError, match=words):
            judge(project.replace(**change))


def test_light_beyond_all_numbers_is_refused(project):
    with pytest.raises(FlarewrightError, match="beyond the numbers"):
        render_measured(
            project.replace(lights=(light(intensity=1e20),), art=Art(rules=[Rule(select="1", gain=1e9)] * 3))
        )


def test_beyond_the_photographed_range_the_limit_is_drawn_on_request(project):
    """The command line refuses; the editor, whose light is dragged, draws the last place that was photographed."""
    beyond, at_end = (project.replace(lights=(light(angle),)) for angle in (31.0, 25.0))
    with pytest.raises(FlarewrightError, match="measured from 0 to 25"):
        render_measured(beyond)
    check_measured(beyond, limit=True)
    drawn = render_measured(beyond, limit=True)
    there = {layer.name: layer.pixels for layer in render_measured(at_end).layers}
    assert near(next(layer for layer in drawn.layers if layer.name == "beauty").pixels, there["beauty"], 1e-3)
    assert any("31 degrees" in one and "at the limit, 25 degrees" in one for one in drawn.remarks)
    # within the range nothing is reported and nothing changes
    inside = render_measured(project, limit=True)
    assert inside.remarks == render_measured(project).remarks


def test_the_sensor_of_the_captures_gives_focal_length_and_sums(project, tmp_path):
    """A project without a sensor has that of the model; one with a sensor keeps it; an old model has 36 mm."""
    model = model_of(project)
    old = render_measured(project).summary
    assert old["sensor_mm"] == [36.0, 36.0 * 90 / 160]
    write_ghost_model(tmp_path / "model.json", model.replace(sensor_width_mm=22.5))
    found = render_measured(project).summary
    assert found["sensor_mm"] == pytest.approx([22.5, 22.5 * 90 / 160])
    assert found["efl_mm"] == pytest.approx(model.focal_px * 22.5 / model.size_px[0])
    assert with_sensor(project).camera.sensor_mm == pytest.approx((22.5, 22.5 * 90 / 160))
    given = project.replace(camera=project.camera.replace(sensor_mm=(36.0, 20.25)))
    assert render_measured(given).summary["efl_mm"] == pytest.approx(old["efl_mm"])
    assert with_sensor(given) == given


def test_any_project_is_drawn_by_what_stands_in_its_lens_place(project):
    assert render_any(project).summary["measured"]
    lens = render_any(Project(lens="triplet-pestrecov", lights=(light(),), camera=Camera(size_px=(64, 36)),
                              quality={"mode": "draft"}))  # fmt: skip
    assert "measured" not in lens.summary


def test_the_command_renders_it_and_its_project(project, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    x, y = PLACE
    words = f"render model.json --light {x},{y} --size 160x90 --mute 2 --json -o out.exr".split()
    assert run(words) == 0
    reported = json.loads(capfd.readouterr().out)
    assert reported["measured"] is True
    assert reported["ghosts"] == {"known": 2, "muted": 1}
    held = {layer.name: layer.pixels for layer in read_exr("out.exr").layers}
    muted = project.replace(lens="model.json", art=Art(rules=[Rule(select="2", enable=False)]))
    assert np.array_equal(held["beauty"], rounded_to_half(pixels(muted) * 1024) / 1024)
    (tmp_path / "shot.toml").write_text(project_text(muted, folder=tmp_path), "utf-8")
    assert 'lens = "model.json"' in (tmp_path / "shot.toml").read_text("utf-8")
    assert read_project("shot.toml") == muted
    assert run(["project", "init", "model.json", "--light", f"{x},{y}", "-o", "new.toml"]) == 0
    assert read_project("new.toml") == project.replace(lens="model.json", camera=Camera(size_px=(160, 90)))
    assert run(["project", "check", "shot.toml"]) == 0
    assert "model.json at f/2, 1 light, 160x90 pixels, measured" in capfd.readouterr().out
    assert run(["render", "--project", "shot.toml", "-o", "again.exr"]) == 0
    assert np.array_equal(read_exr("again.exr").layers[0].pixels, held["beauty"])


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        ("render model.json --light 5,2 --blades 6 -o out.exr", "has no prescription"),
        ("render model.json --light 5,2 --ledger -o out.exr", "omit --ledger"),
        ("render model.json --light 5,2 --mute 9 -o out.exr", "--mute 9: model.json has no ghost 9"),
        ("render broken.json --light 5,2 -o out.exr", "broken.json"),
        ("render none.json --light 5,2 -o out.exr", "none.json"),
        ("lens show model.json", "no prescription"),
        ("ghosts model.json --light 5,2", "no prescription"),
        ("project check shot.toml", "shot.toml: model.json is a measured flare"),
    ],
)
def test_commands_refuse_in_one_sentence_what_they_cannot_do(project, tmp_path, capfd, monkeypatch, words, reported):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.json").write_text("{}", "utf-8")
    text = project_text(project.replace(iris=Iris(blades=5)), folder=tmp_path)
    (tmp_path / "shot.toml").write_text(text, "utf-8")
    assert run(words.split()) == 2
    said = capfd.readouterr().err
    assert reported in said
    assert said.count("error:") == 1
    assert not (tmp_path / "out.exr").exists()


def test_an_exposure_value_without_an_f_number_is_refused_before_anything_is_drawn(
    project, tmp_path, capfd, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    model = model_of(project)
    write_ghost_model(tmp_path / "unknown.json", model.replace(reference=model.reference.replace(f_number=None)))
    words = ["--light", "5,2", "--size", "40x22", "-o", "out.exr"]

    def drawn(*_, **__):
        raise AssertionError("it was drawn")

    with monkeypatch.context() as patch:
        patch.setattr("flarewright.measure.replay.measured_project.render_measured", drawn)
        assert run(["render", "unknown.json", *words, "--ev", "12"]) == 2
    assert "--ev needs an f-number, but that of the captures of unknown.json is unknown" in capfd.readouterr().err
    assert not (tmp_path / "out.exr").exists()
    # a shutter speed needs no f-number
    for lens, exposure in (("unknown.json", ["--shutter", "1/250"]), ("model.json", ["--ev", "9.9657843"])):
        assert run(["render", lens, *words, *exposure, "--json"]) == 0
        # 0.18 of white for 10 / ISO lux seconds: log2(0.18 * 100000 lx / 250 s * 100 / 10); at f/2 that is EV 9.966
        assert json.loads(capfd.readouterr().out)["exposure_stops"] == pytest.approx(9.492, abs=2e-3)
