"""A measured flare in the editor: opened, moved, overridden, saved; without a browser."""

import numpy as np
import pytest

from flarewright.editor.commands.lens import choose_lens
from flarewright.editor.commands.registry import done
from flarewright.editor.design.search_job import DisplaySettings, Solver
from flarewright.editor.preview.drag import Drag
from flarewright.editor.preview.ghost_picking import ghost_csv
from flarewright.editor.preview.progressive_render import sharpen
from flarewright.editor.preview.queries import outline_png, picked
from flarewright.editor.preview.viewport import Screen
from flarewright.editor.server.page_state import ghost_rows, state_of
from flarewright.editor.server.uploads import take_in
from flarewright.editor.session.files import export_picture, imported, lens_text, open_any
from flarewright.editor.session.session import begin
from flarewright.errors import FlarewrightError
from flarewright.io.images.exr import read_exr
from flarewright.io.images.half import rounded_to_half
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of
from flarewright.measure.replay.model_image import replay_model
from flarewright.model.measurement.ghost_model import AberrationGhost, GhostModel, Halo, Reference
from flarewright.optics.lens.field_angles import constellation_and_roll


def flare(**facts):
    """Return a model with a ghost opposite to the light, one on its side, and a halo."""
    ghosts = []
    for name, speed, level in (("1", -60.0, 900.0), ("2", 150.0, 400.0)):
        numbers = np.zeros(NUMBERS)
        numbers[0], numbers[10], numbers[20] = speed, 14.0, level
        numbers[30], numbers[32] = 3.0, 3.0
        one = channel_of(numbers, 1)
        ghosts.append(AberrationGhost(name=name, red=one, green=one, blue=one, visible_deg=(0.0, 25.0)))
    return GhostModel(
        size_px=(160, 90), axis_px=(84.0, 42.0), focal_px=170.0, distortion=-0.1, largest_deg=25.0,
        constellation_deg=(0.0, 25.0), ghosts=tuple(ghosts),
        halo=Halo(radius_px=(1.0, 10.0, 100.0), radiance=((9.0, 8.0, 7.0), (0.9, 0.8, 0.7), (0.01, 0.01, 0.01))),
        reference=Reference(f_number=2.0), **facts,
    )  # fmt: skip


@pytest.fixture
def path(tmp_path):
    write_ghost_model(tmp_path / "model.json", flare())
    return str(tmp_path / "model.json")


@pytest.fixture
def screen(path, screen_size):
    session, _ = begin(path)
    screen = Screen(session, sharpen)
    screen.start()
    assert screen.wait(60.0)
    return screen


def state(screen):
    return state_of(screen, Solver(screen.session, lambda: DisplaySettings(screen.session.view, 0.0)))


def test_it_opens_with_its_whole_frame_and_a_light_that_was_photographed(path):
    project, file = open_any(path)
    assert file is None
    assert project.lens == path
    assert project.camera.size_px == (1920, 1080)
    slopes = np.tan(np.radians(project.lights[0].field_deg))
    angle, roll = constellation_and_roll(np.eye(3), [*slopes, 1.0])
    assert 5.0 < angle < 20.0
    assert 0.0 < roll < 90.0


def test_it_opens_with_the_sensor_of_its_captures(tmp_path):
    write_ghost_model(tmp_path / "model.json", flare(sensor_width_mm=22.5))
    project, _ = open_any(str(tmp_path / "model.json"))
    assert project.camera.sensor_mm == pytest.approx((22.5, 22.5 * 1080 / 1920))
    # a project that was saved before the model knew its sensor
    saved = tmp_path / "old.toml"
    saved.write_text('lens = "model.json"\n[camera]\nsize_px = [320, 180]\n[[lights]]\nfield_deg = [40.0, 0.0]\n')
    assert open_any(str(saved))[0].camera.sensor_mm == pytest.approx((22.5, 22.5 * 180 / 320))
    # and one that is dropped on the page
    whole = saved.read_bytes().replace(b"model.json", str(tmp_path / "model.json").encode())
    dropped = imported("old.toml", whole, tmp_path / "drops").project
    assert dropped.camera.sensor_mm == pytest.approx((22.5, 22.5 * 180 / 320))


def test_a_dropped_look_is_refused_as_one_of_the_library_is(path):
    session, _ = begin(path)
    before = session.project
    look = b'name = "Warm"\nlens = "heliar-tronnier"\nf_number = 8.0\n[[lights]]\nfield_deg = [1.0, 1.0]\n'
    with pytest.raises(FlarewrightError, match="a measured flare has the look of its lens"):
        take_in(session, "warm.look.toml", look)
    assert session.project == before


def test_the_screen_shows_the_replay_and_lists_its_ghosts(screen):
    picture = screen.picture
    assert screen.problem == ""
    assert picture.grade == "final"
    slopes = np.tan(np.radians(screen.session.project.lights[0].field_deg))
    angle, roll = (float(each) for each in constellation_and_roll(np.eye(3), [*slopes, 1.0]))
    height, width = picture.ghosts.shape[:2]
    reported = replay_model(flare(), angle, roll_deg=roll, size_px=(width, height))
    assert np.abs(picture.ghosts - reported[1].pixels).max() <= 1e-4 * reported[1].pixels.max()
    assert np.abs(picture.ghosts + picture.rest - reported[0].pixels).max() <= 1e-4 * reported[0].pixels.max()
    assert [row["name"] for row in ghost_rows(screen)["ghosts"]] == ["1", "2"]
    assert "ghost,flux_mm2" in ghost_csv(screen.seen)


def test_the_page_gets_the_data_for_the_lights_handle(screen):
    reported = state(screen)["lens"]
    assert reported["measured"]
    assert reported["rows"] == []
    assert reported["problem"] == ""
    pitch = 36.0 / 160.0
    assert reported["facts"]["efl"] == pytest.approx(170.0 * pitch)
    assert reported["axis_mm"] == pytest.approx([4.0 * pitch, 3.0 * pitch])
    # at 10 degrees, the fifth step, the image is nearer than focal length times tangent by this factor
    assert reported["distortion"][4] == pytest.approx(1.0 - 0.1 * np.tan(np.radians(10.0)) ** 2, abs=1e-5)
    # the table ends where heights would decrease: 1 - 0.3 t^2 reaches 0
    assert 2.0 * len(reported["distortion"]) <= np.degrees(np.arctan(0.3**-0.5)) + 2.0


def test_a_drag_moves_its_light(screen):
    session = screen.session
    moved = Drag(screen).picture(lambda project: done(project, "move_light", {"light": 0, "x": -8.0, "y": 3.0})[0],
                                 session.revision)  # fmt: skip
    assert moved is not None
    assert moved.project.lights[0].field_deg == (-8.0, 3.0)
    assert moved.jpeg[:2] == b"\xff\xd8"
    # beyond the photographed range the limit is drawn
    limit = [
        Drag(screen).picture(lambda project, x=x: done(project, "move_light", {"light": 0, "x": x, "y": 0.0})[0],
                             session.revision)
        for x in (25.0, 50.0)
    ]  # fmt: skip
    assert limit[1].project.lights[0].field_deg == (50.0, 0.0)
    assert limit[0].jpeg == limit[1].jpeg


def test_a_light_at_rest_beyond_the_photographed_range_shows_the_limit_and_says_so(screen):
    screen.session.do("move_light", {"light": 0, "x": 40.0, "y": 0.0})
    assert screen.wait(60.0)
    assert screen.problem == ""
    assert any("at the limit, 25 degrees" in line for line in state(screen)["picture"]["remarks"])
    screen.session.do("set_fields", {"values": {"f_number": 4.0}})
    assert screen.session.project.f_number == 4.0


def test_a_ghost_is_found_under_the_pointer_and_muted(screen):
    ghost = next(one for one in screen.seen.ghosts if one.name == "1")
    assert picked(screen, *ghost.centre)[0] == "1"
    assert outline_png(screen, "1")[:4] == b"\x89PNG"
    before = screen.picture.ghosts
    screen.session.do("set_ghost", {"name": "1", "values": {"muted": True}})
    assert screen.wait(60.0)
    assert screen.problem == ""
    column, row = (int(part * side) for part, side in zip(ghost.centre, before.shape[1::-1], strict=True))
    assert screen.picture.ghosts[row, column].max() < 0.01 * before[row, column].max()
    assert next(each for each in ghost_rows(screen)["ghosts"] if each["name"] == "1")["muted"]


def test_what_only_a_lens_has_is_refused_and_changes_nothing(screen, path):
    session = screen.session
    for name, values in (
        ("set_cell", {"row": 0, "column": "radius", "text": "20"}), ("set_iris", {"values": {"blades": 5}}),
        ("set_row_wavelengths", {"values": {"1": 500.0}}),
    ):  # fmt: skip
        with pytest.raises(FlarewrightError, match="no prescription"):
            session.do(name, values)
    with pytest.raises(FlarewrightError, match="zoom has no meaning"):
        session.do("set_fields", {"values": {"zoom": 50.0}})
    with pytest.raises(FlarewrightError, match="no prescription"):
        lens_text(session.project)
    assert session.project.lens == path
    session.do("set_fields", {"values": {"f_number": 4.0}})
    assert screen.wait(60.0)
    assert screen.problem == ""
    session.set_view({"grey": True})
    assert screen.wait(60.0)
    assert "no prescription" in screen.problem


def test_it_is_saved_beside_its_project_exported_and_dropped(screen, tmp_path, path):
    session = screen.session
    session.save(str(tmp_path / "shot.toml"))
    project, file = open_any(str(tmp_path / "shot.toml"))
    assert project == session.project
    assert file == str((tmp_path / "shot.toml").resolve())
    bright = session.project.lights[0].replace(intensity=100.0)
    small = session.project.replace(camera=session.project.camera.replace(size_px=(160, 90)), lights=(bright,))
    export_picture(small, tmp_path / "flare.exr")
    exported = read_exr(tmp_path / "flare.exr")
    assert [layer.name for layer in exported.layers] == ["beauty", "ghosts", "halo"]
    assert exported.scale == 2.0 ** (10 - 7)
    whole = small.replace(output=small.output.replace(pixel_type="float"))
    export_picture(whole, tmp_path / "float.exr")
    plain = read_exr(tmp_path / "float.exr")
    assert plain.scale == 1.0
    for half, full in zip(exported.layers, plain.layers, strict=True):
        np.testing.assert_array_equal(half.pixels, rounded_to_half(full.pixels * 8) / 8)
    dropped = imported("mine.json", (tmp_path / "model.json").read_bytes(), tmp_path / "drops").project
    assert dropped.lights == open_any(path)[0].lights
    with pytest.raises(FlarewrightError, match=r"^none\.json"):
        imported("none.json", b"{}", tmp_path / "drops")


def test_a_lens_in_its_place_keeps_the_light_in_the_picture(path):
    project, _ = open_any(path)
    chosen = choose_lens(project, "heliar-tronnier")
    # from 38 mm to 99: the image keeps its place
    near, far = (np.tan(np.radians(each.lights[0].field_deg)) for each in (project, chosen))
    assert far == pytest.approx(near * (170.0 * 36.0 / 160.0) / 99.236, rel=1e-3)
