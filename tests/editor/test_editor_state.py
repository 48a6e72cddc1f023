"""History, autosave and commands of the editor, without a browser."""

import errno
import json
import os
import re
import subprocess
import sys
import threading
from importlib.resources import files

import pytest

from flarewright.editor.commands.design_targets import direction, ghost_target_names, new_discs, target_project
from flarewright.editor.commands.ghost_rules import GhostOverride, override_of, soloed
from flarewright.editor.commands.lens import own_lens, prescription, table_of
from flarewright.editor.commands.registry import COMMANDS, done
from flarewright.editor.common.latest_job import Lane
from flarewright.editor.server.uploads import take_in
from flarewright.editor.session import history as past
from flarewright.editor.session.autosave import Saved, autosave_path, read_autosave, write_autosave
from flarewright.editor.session.files import command_line
from flarewright.editor.session.session import begin
from flarewright.editor.session.view_settings import View
from flarewright.errors import FlarewrightError
from flarewright.io.lens.library import lens_path
from flarewright.io.project.project_file import read_project
from flarewright.model import BlackBody, Light, PerRow, Preset, QuarterWave, Stop, Surface
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.zoom import at_position
from flarewright.render.scene.resolve import open_lens, resolve_project


def do(project, command, /, **values):
    return done(project, command, values)[0]


def test_undo_and_redo_walk_the_same_projects(project):
    history = past.started(project)
    for k in range(5):
        history = past.committed(history, do(history.present, "move_light", light=0, x=k, y=1.0), "Move the light")
    shown = [moment.project for moment in history.moments]
    for k in range(5):
        assert history.undo_label == "Move the light"
        history = past.undone(history)
        assert history.present == shown[4 - k]
    assert history.undo_label == ""
    assert past.undone(history) == history
    for k in range(5):
        history = past.redone(history)
        assert history.present == shown[k + 1]
    assert past.redone(history) == history


def test_a_command_after_undo_drops_the_redo_list(project):
    history = past.committed(past.started(project), do(project, "move_light", light=0, x=1, y=1), "a")
    other = do(project, "move_light", light=0, x=2, y=2)
    history = past.committed(past.undone(history), other, "b")
    assert [moment.label for moment in history.moments] == ["Open", "b"]
    assert history.present == other


def test_one_stroke_is_one_step_and_nothing_is_none(project):
    history = past.started(project)
    for x in (1.0, 2.0, 3.0):
        history = past.committed(history, do(project, "move_light", light=0, x=x, y=0.0), "Move", "stroke")
    assert len(history.moments) == 2
    assert past.undone(history).present == project
    assert past.committed(history, history.present, "again") is history
    # the first state is never replaced, whatever its group
    assert len(past.committed(past.started(project), history.present, "Move", "").moments) == 2


def test_history_has_an_end(project):
    history = past.started(project)
    for k in range(past.MOST + 30):
        history = past.committed(history, do(project, "move_light", light=0, x=k / 10.0, y=0.0), str(k))
    assert len(history.moments) == past.MOST
    assert history.present.lights[0].field_deg[0] == pytest.approx((past.MOST + 29) / 10.0)


def test_autosave_gives_everything_back(project, tmp_path):
    history = past.committed(past.started(project), do(project, "set_cell", row=0, column="radius", text="33"), "Edit")
    history = past.committed(
        history, do(history.present, "set_ghost_target", ghost="4-1", values={"move_mm": 2.0}), "Wish"
    )
    saved = Saved(past.undone(history), View(look="filmic", exposure_stops=3.5), "shot.toml", clean=False)
    path = tmp_path / "a" / "x.json"
    write_autosave(path, saved)
    assert read_autosave(path) == saved


@pytest.mark.parametrize("text", ["", "{", '{"version": 1}', '{"version": 7}', "[1]", "[" * 100_000])
def test_a_damaged_autosave_is_no_obstacle(text, tmp_path):
    path = tmp_path / "x.json"
    path.write_text(text)
    assert read_autosave(path) is None


def test_a_changed_number_in_an_autosave_is_noticed(project, tmp_path):
    path = tmp_path / "x.json"
    saved = Saved(past.started(project), View(), None, clean=False)
    write_autosave(path, saved)
    text = path.read_text("utf-8")
    path.write_text(text.replace('"clean": false', '"clean": true '))
    assert read_autosave(path) is None
    # releases before the digest
    path.write_text(text.splitlines()[0])
    assert read_autosave(path) == saved


@pytest.mark.parametrize("what", [None, "tessar-brendel"])
def test_a_damaged_autosave_is_kept_and_named(what):
    session, _ = begin(what)
    session.do("move_light", {"light": 0, "x": 3.0, "y": 2.0})
    session.writer.close()
    path = session.writer.path
    damaged = path.read_bytes()[:-1000]
    path.write_bytes(damaged)
    again, reported = begin(what)
    assert str(path) in reported
    assert path.with_suffix(".damaged").read_bytes() == damaged
    again.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    again.writer.close()
    resumed, reported = begin(what)
    assert resumed.project.lights[0].field_deg == (4.0, 2.0)
    assert str(path) not in reported
    resumed.writer.close()


def test_a_file_system_without_locks_keeps_one_autosave(monkeypatch):
    import fcntl

    def refuse(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    session, _ = begin(None)
    assert session.writer.number == 1
    session.writer.close()


def test_a_session_goes_on_where_it_was_cut_off(project):
    session, reported = begin(None)
    assert reported == ""
    session.do("move_light", {"light": 0, "x": 3.0, "y": 2.0})
    session.do("set_iris", {"values": {"blades": 8}})
    session.set_view({"look": "filmic"})
    session.writer.close()
    # the process is killed here: no further call
    again, reported = begin(None)
    assert again.history == session.history
    assert again.view == session.view
    assert "undo leads back" in reported
    again.undo()
    again.undo()
    assert again.project.lights[0].field_deg == (8.0, 4.4)


def test_without_a_name_it_goes_on_with_what_was_cut_off(tmp_path):
    """Also a session started with a lens or a file; not a saved one, or one open in another editor."""
    begin(None)[0].writer.close()
    session, _ = begin("tessar-brendel")
    session.do("move_light", {"light": 0, "x": 3.0, "y": 2.0})
    session.save(str(tmp_path / "shot"))
    session.do("set_iris", {"values": {"blades": 8}})
    session.writer._lane.wait(5.0)
    beside, _ = begin(None)
    assert beside.project != session.project
    beside.writer.close()
    session.writer.close()
    again, reported = begin(None)
    assert again.history == session.history
    assert again.file == session.file
    assert "undo leads back" in reported
    again.save(str(tmp_path / "shot"))
    again.writer.close()
    assert begin(None)[0].project != session.project


def test_saving_makes_the_autosave_clean_and_the_file_wins(project, tmp_path):
    session, _ = begin("tessar-brendel")
    session.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    path = session.save(str(tmp_path / "shot"))
    session.writer.close()
    assert path.name == "shot.toml"
    assert read_project(path) == session.project
    again, _ = begin(str(path))
    assert again.project == session.project
    assert again.clean
    again.do("move_light", {"light": 0, "x": 9.0, "y": 2.0})
    again.writer.close()
    third, _ = begin(str(path))
    assert third.project.lights[0].field_deg == (9.0, 2.0)
    assert third.file == str(path)


def test_undo_of_open_leads_back_to_the_file(tmp_path):
    session, _ = begin(None)
    session.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    path = session.save(str(tmp_path / "shot.toml"))
    session.open("tessar-brendel")
    assert session.file is None
    session.do("set_iris", {"values": {"blades": 8}})
    session.undo()
    session.undo()
    assert session.file == str(path)
    session.redo()
    assert session.file is None
    session.undo()
    session.writer.close()
    again, _ = begin(None)
    assert again.file == str(path)
    again.redo()
    assert again.file is None
    again.undo()
    # after saving under another name, that is the file of this state and the earlier ones
    other = again.save(str(tmp_path / "other.toml"))
    again.undo()
    assert again.file == str(other)
    again.writer.close()


def test_what_is_undone_back_to_what_was_saved_is_saved(tmp_path):
    session, _ = begin("tessar-brendel")
    assert not session.clean
    path = session.save(str(tmp_path / "shot"))
    assert session.clean
    session.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    assert not session.clean
    session.undo()
    assert session.clean
    session.redo()
    assert not session.clean
    session.save(str(path))
    session.undo()
    assert not session.clean
    session.writer.close()
    # also in the next session, as the file has these contents
    again, _ = begin(None)
    assert again.project == session.project
    assert not again.clean
    again.redo()
    assert again.clean
    # unless another program has changed it meanwhile
    again.undo()
    again.writer.close()
    path.write_text(path.read_text() + "\n# a remark")
    third, _ = begin(None)
    third.redo()
    assert third.project == read_project(path)
    assert not third.clean
    third.writer.close()


def test_another_project_differs_from_a_change(tmp_path):
    session, _ = begin(None)
    session.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    path = session.save(str(tmp_path / "shot"))
    assert session.opened == 0
    session.open("tessar-brendel")
    assert session.opened == 1
    session.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    assert session.opened == 1
    session.undo()
    session.undo()
    assert (session.file, session.opened) == (str(path), 2)
    take_in(session, "shot.toml", path.read_bytes())
    take_in(session, "canon.toml", lens_path("canon-28-80").read_bytes())
    assert session.opened == 2
    session.open(str(path))
    take_in(session, "other.toml", path.read_bytes().replace(b"4.0", b"5.0"))
    assert session.opened == 4
    session.writer.close()
    again, _ = begin(None)
    again.undo()
    assert again.opened == 1
    again.writer.close()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tesar", "there is no file and no lens 'tesar': did you mean tessar-brendel?"),
        ("qqqq", "there is no file and no lens 'qqqq': the panel Library shows every lens; a file is found by its"),
        ("shots/one.toml", "there is no file and no lens 'shots/one.toml': the panel Library shows every lens; a file"),
    ],
)
def test_errors_of_open_use_the_pages_words(text, said):
    session, _ = begin(None)
    with pytest.raises(FlarewrightError) as reported:
        session.open(text)
    assert str(reported.value).startswith(said)
    session.writer.close()


def test_a_missing_lens_is_reported_without_a_command(tmp_path):
    text = 'schema_version = 1\nlens = "my-lens.toml"\n[[lights]]\nfield_deg = [3, 2]\n'
    (tmp_path / "shot.toml").write_text(text)
    session, _ = begin(None)
    with pytest.raises(FlarewrightError, match=r"choose a shipped lens of the panel Library$"):
        session.open(str(tmp_path / "shot.toml"))
    with pytest.raises(FlarewrightError, match="of the panel Library; a dropped file comes alone"):
        take_in(session, "shot.toml", text.encode())
    # its pictures do not come with it: the project would render without them
    before = session.project
    for more in ('[iris]\nmask = "m.png"', '[dirt]\nimage = "m.png"', '[holdout]\nimage = "m.png"'):
        with pytest.raises(FlarewrightError, match=r"^shot\.toml: m\.png does not exist; a dropped file comes alone"):
            take_in(session, "shot.toml", text.replace("my-lens.toml", "tessar-brendel").encode() + more.encode())
    assert session.project is before
    session.writer.close()


def test_without_a_name_the_last_file_is_opened_again(tmp_path):
    session, _ = begin(None)
    session.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    path = session.save(str(tmp_path / "shot.toml"))
    session.writer.close()
    again, _ = begin(None)
    again.writer.close()
    assert (again.file, again.project, again.history.undo_label) == (str(path), session.project, "Move the light")
    path.write_text(path.read_text().replace("f_number = 16.0", "f_number = 11.0"))
    changed, _ = begin(None)
    assert changed.project.f_number == 11.0
    changed.undo()
    assert changed.project.f_number == 16.0


def test_a_rejected_command_changes_nothing(project):
    session, _ = begin(None)
    before = session.history
    for name, values in (
        ("set_cell", {"row": 0, "column": "radius", "text": "round"}),
        ("set_cell", {"row": 0, "column": "glass", "text": "N-NONSENSE"}),
        ("set_cell", {"row": 8, "column": "n_d", "text": "1.5"}),
        ("remove_row", {"row": 5}),
        ("set_iris", {"values": {"rounding": 2.0}}),
        ("remove_light", {"light": 0}),
        ("set_coating", {"text": "gold"}),
        ("no such command", {}),
        ("move_light", {"light": 0}),
    ):
        with pytest.raises(FlarewrightError) as reported:
            session.do(name, values)
        assert "\n" not in str(reported.value)
    assert session.history is before
    assert json.dumps(str(session.project))


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("set_dirt", {"values": {"dust_per_mm2": -1}}, "dust per mm² must be at least 0, not -1"),
        ("set_cell", {"row": 0, "column": "n_d", "text": "-1"}, "row 0: index n_d must be more than 1, not -1"),
        ("set_cell", {"row": 0, "column": "v_d", "text": "x"}, "row 0: Abbe number V_d 'x' is no number; write"),
        ("set_cell", {"row": 0, "column": "semi_diameter", "text": "-1"}, "row 0: semi-diameter must be more than 0"),
        ("set_ghost", {"name": "8-6", "values": {"gain": -3}}, "gain must be at least 0, not -3"),
        ("set_pass_gain", {"name": "ghosts", "gain": -3}, "gain of the ghosts must be at least 0, not -3"),
        ("set_iris", {"values": {"roughness_um": -3}}, "roughness must be at least 0, not -3"),
    ],
)
def test_what_is_refused_is_said_in_words(project, name, values, said):
    with pytest.raises(FlarewrightError) as reported:
        done(project, name, values)
    assert str(reported.value).startswith(said)


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("move_light", {"light": 0, "x": 100.0, "y": 3.0}, "100° right became 80°: the largest angle of a light is"),
        ("move_light", {"light": 0, "x": 10.0, "y": -90.0}, "-90° up became -80°: the largest angle of a light is"),
        ("move_light", {"light": 0, "x": 10.0, "y": 3.0}, ""),
        ("set_iris", {"values": {"blades": 2}}, "2 blades became a round opening: an iris has 3 blades at least"),
        ("set_iris", {"values": {"blades": 5}}, ""),
        ("set_iris", {"values": {"rounding": 0.5}}, ""),
        ("set_fields", {"values": {"f_number": 1}}, "f/1 became f/3.5: this lens opens no wider"),
        ("set_fields", {"values": {"f_number": 5.6}}, ""),
        ("put_look", {"name": "neon-sign"}, "the look's f/2 is wider than "),
        ("put_look", {"name": "clean-product"}, ""),
        ("set_key", {"light": 0, "at_s": -1.0}, "-1 s became 0 s: a path starts there"),
        ("set_key", {"light": 0, "at_s": 0.123}, "0.123 s became 0.12 s: keys lie at hundredths"),
        ("set_key", {"light": 0, "at_s": 0.07}, ""),
    ],
)
def test_a_corrected_number_is_reported(name, values, said):
    session, _ = begin(None)
    reported = session.do(name, values)
    assert reported.startswith(said)
    assert bool(reported) == bool(said)
    # a slider shows the corrected value itself
    assert session.do(name, values, "stroke") == ""
    session.writer.close()


def test_a_round_iris_gets_three_blades_where_one_is_typed():
    session, _ = begin(None)
    session.do("set_iris", {"values": {"blades": 0}})
    assert session.do("set_iris", {"values": {"blades": 1}}).startswith("1 blades became 3: an iris has 3 blades")
    session.writer.close()


def test_lights_that_are_added_have_names_of_their_own(project):
    three = do(do(project, "add_light"), "add_light")
    assert [light.name for light in three.lights] == ["light", "light 2", "light 3"]
    two = do(three, "remove_light", light=1)
    assert [light.name for light in do(two, "add_light").lights] == ["light", "light 3", "light 4"]


def test_no_added_light_is_hidden_by_another(project):
    """The third one used to lie exactly on the first, as it mirrored the second."""
    for first in ((6.0, 3.0), (-6.0, 0.0), (0.0, 0.0)):
        many = project.replace(lights=(project.lights[0].replace(field_deg=first),))
        for _ in range(7):
            many = do(many, "add_light")
        places = [light.field_deg for light in many.lights]
        assert places[1] == (-first[0] if any(first) else -1.0, first[1])
        assert len({(round(x, 1), round(y, 1)) for x, y in places}) == 8
        assert max(abs(x) for x, _ in places) <= 7.0


def test_a_command_on_a_row_does_not_apply_to_another_lens():
    session, _ = begin(None)
    with pytest.raises(FlarewrightError, match=r"^exposure must be at most 60, not 1000$"):
        session.set_view({"exposure_stops": 1000})
    seen = table_of(session.project)
    session.do("set_cell", {"row": 1, "column": "thickness", "text": "4"}, table=seen)
    # a cell unchanged in this lens
    session.do("set_cell", {"row": 0, "column": "radius", "text": "33"}, table=seen)
    for name, values in (("add_row", {"row": 1}), ("choose_lens", {"lens": "tessar-brendel"})):
        session.do(name, values)
        before = session.project
        with pytest.raises(FlarewrightError, match="the lens has changed since"):
            session.do("set_cell", {"row": 0, "column": "radius", "text": "44"}, table=seen)
        assert session.project is before
    session.writer.close()


def test_every_command_is_tried_here():
    tried = (
        "move_light set_light add_light remove_light set_camera set_quality set_fields set_iris set_dirt set_starburst "
        "set_pass_gain set_coating put_look set_row_wavelengths set_cell add_row duplicate_row remove_row move_stop "
        "choose_lens set_lens_facts set_ghost set_solo reset_art set_ghost_target add_ghost remove_ghost_target "
        "set_new_ghost_target set_design clear_ghost_targets set_key move_key remove_key clear_keys go_to set_holdout "
        "set_plate remove_plate"
    )
    assert sorted(tried.split()) == sorted(COMMANDS)


def test_lights_camera_iris_and_coating(project):
    two = do(project, "add_light")
    assert len(two.lights) == 2
    two = do(two, "set_light", light=1, values={"spectrum": "black-body:2000", "intensity": 0.5})
    assert two.lights[1].spectrum.temperature_k == 2000.0
    assert do(two, "remove_light", light=0).lights[0].intensity == 0.5
    assert do(project, "move_light", light=0, x=500.0, y=-500.0).lights[0].field_deg == (80.0, -80.0)
    assert do(project, "set_camera", values={"size_px": (640, 480)}).camera.size_px == (640, 480)
    assert do(project, "set_quality", values={"wavelengths": 11}).quality.wavelengths == 11
    assert do(project, "set_fields", values={"f_number": 11.0}).f_number == 11.0
    # a slider on its way from 0 to 3 blades
    assert do(do(project, "set_iris", values={"blades": 0}), "set_iris", values={"blades": 1}).iris.blades == 3
    assert do(project, "set_iris", values={"blades": 2}).iris.blades == 0
    assert do(project, "set_dirt", values={"dust_per_mm2": 1.0}).dirt.dust_per_mm2 == 1.0
    assert do(project, "set_starburst", values={"size": 2.0}).starburst.size == 2.0
    gained = do(project, "set_pass_gain", name="ghosts", gain=2.0)
    assert gained.art.gain == {"ghosts": 2.0}
    assert do(gained, "set_pass_gain", name="ghosts", gain=1.0) == project
    worn = do(project, "put_look", name="low-sun")
    assert (worn.f_number, worn.coating) == (8.0, Preset(name="period"))
    assert worn.lights[0].spectrum == BlackBody(temperature_k=3800.0)
    assert worn.lights[0].field_deg == project.lights[0].field_deg
    assert do(project, "set_coating", text="quarter-wave:500").coating.coating == QuarterWave(center_wavelength_nm=500)
    mapped = do(project, "set_row_wavelengths", values={"0": 500.0, "4": 600.0})
    assert isinstance(mapped.coating, PerRow)
    assert mapped.coating.coatings[4] == QuarterWave(center_wavelength_nm=600.0)
    # the others keep the preset's coatings
    assert mapped.coating.coatings[1] == open_lens("heliar-tronnier").lens.coating_presets["thesis"][1]


def test_cells_change_the_lens_and_say_what_is_odd(project):
    edited = do(project, "set_cell", row=0, column="radius", text="33,5")
    assert own_lens(edited).rows[0].curvature == pytest.approx(1.0 / 33.5)
    assert do(project, "set_cell", row=6, column="radius", text="flat").lens.rows[6].curvature == 0.0
    glass = do(project, "set_cell", row=0, column="glass", text="N-BK7").lens.rows[0].medium
    assert glass.n_d == pytest.approx(1.5168, abs=1e-4)
    # another index is another glass
    other = do(project, "set_cell", row=0, column="n_d", text="1.7").lens.rows[0].medium
    assert (other.glass, other.n_d) == (None, 1.7)
    assert do(project, "set_cell", row=0, column="semi_diameter", text="").lens.rows[0].semi_diameter is None
    coated = do(project, "set_cell", row=0, column="coating", text="film:1.38:100")
    assert coated.coating.coatings[0].thickness_nm == 100.0
    with pytest.raises(FlarewrightError, match="opening follows from the f-number"):
        do(project, "set_cell", row=5, column="radius", text="10")
    crossing = prescription(do(project, "set_cell", row=0, column="thickness", text="0.2"))
    assert "cross" in crossing.rows[0]["notes"]["thickness"]
    assert (
        "equator"
        in prescription(do(project, "set_cell", row=0, column="radius", text="10")).rows[0]["notes"]["semi_diameter"]
    )


def test_an_image_distance_that_is_not_used_says_so(project):
    last = len(own_lens(project).rows) - 1
    changed = prescription(do(project, "set_cell", row=last, column="thickness", text="60"))
    assert "without effect: the sensor is at" in changed.rows[last]["notes"]["thickness"]
    place = changed.facts["sensor_distance"]
    kept = prescription(do(project, "set_cell", row=last, column="thickness", text=f"{place:.2f}"))
    assert "thickness" not in kept.rows[last]["notes"]


def test_facts_of_the_table_are_those_of_the_lens(project):
    table = prescription(project)
    order = first_order(open_lens("heliar-tronnier").lens, 8.0)
    assert table.facts["efl"] == order.efl
    assert table.facts["bfl"] == order.bfl
    assert [row["stop"] for row in table.rows].index(True) == 5
    assert table.problem == ""


def test_a_lens_without_an_image_has_a_reason_and_keeps_its_table(project):
    flat = project
    for row in (0, 1, 2, 3, 4, 7, 8):
        flat = do(flat, "set_cell", row=row, column="radius", text="flat")
    table = prescription(flat)
    assert table.facts == {}
    assert table.problem
    assert table.rows[0]["radius"] == "flat"
    # it can be repaired from there
    assert prescription(do(flat, "set_cell", row=0, column="radius", text="30.81")).problem == ""


def test_rows_come_and_go_with_everything_that_counts_them(project):
    lens = open_lens(project.lens).lens
    muted = do(project, "set_ghost", name="4-1", values={"muted": True})
    longer = do(muted, "add_row", row=2)
    assert len(longer.lens.rows) == len(lens.rows) + 1
    assert longer.lens.stop_row == 6
    assert longer.lens.rows[2].thickness + longer.lens.rows[3].thickness == pytest.approx(lens.rows[2].thickness)
    assert longer.lens.coating_presets["thesis"][4] == lens.coating_presets["thesis"][3]
    # the ghosts have other names now
    assert longer.art.rules == ()
    shorter = do(longer, "remove_row", row=3)
    assert [row.curvature for row in own_lens(shorter).rows if not isinstance(row, Stop)] == [
        row.curvature for row in lens.rows if not isinstance(row, Stop)
    ]
    assert first_order(open_lens(shorter.lens).lens).efl == pytest.approx(first_order(lens).efl, rel=1e-12)
    assert len(do(project, "duplicate_row", row=1).lens.rows) == len(lens.rows) + 1
    assert do(project, "set_lens_facts", values={"name": "Mine"}).lens.name == "Mine"


def test_a_row_removed_beside_a_moving_gap_leaves_every_position_its_length():
    """The gap in front of the removed row used to stay as short as before at the zoom's positions."""
    project = begin("canon-70-200")[0].project
    lens = own_lens(project)
    row = next(row for row, _ in lens.positions[0].gaps if row > 0 and row + 1 < len(lens.rows))
    longer = do(project, "add_row", row=row)
    shorter = own_lens(do(longer, "remove_row", row=row + 1))
    for old, new in zip(lens.positions, shorter.positions, strict=True):
        assert dict(new.gaps) == pytest.approx(dict(old.gaps))


@pytest.mark.parametrize(
    ("name", "every"),
    [("canon-70-200", 11), pytest.param("canon-70-200", 1, marks=pytest.mark.slow), ("nikkor-85-f1.4", 1),
     ("biotar-50-f1.4", 1)],
)  # fmt: skip
def test_the_stop_moves_and_the_lens_stays_as_sharp(name, every):
    project = begin(name)[0].project
    lens = open_lens(name).lens
    refused, moved = [], 0
    for row, one in enumerate(lens.rows):
        if isinstance(one, Stop) or row % every:
            continue
        try:
            found = done(project, "move_stop", {"row": row})[0]
        except FlarewrightError as error:
            refused.append(str(error))
            continue
        moved += 1
        now = open_lens(found.lens).lens
        assert now.stop_row != lens.stop_row
        assert [r.curvature for r in now.rows if isinstance(r, Surface)] == [
            r.curvature for r in lens.rows if isinstance(r, Surface)
        ]
        for position in (None, *(each.name for each in lens.positions)):
            before, after = (resolve_project(each.replace(zoom=position)).order for each in (project, found))
            assert after.efl == pytest.approx(before.efl, rel=1e-9)
            assert after.bfl == pytest.approx(before.bfl, rel=1e-9)
    assert moved >= 2
    assert all("choose a row" in words for words in refused)


def test_zoom_gaps_keep_their_surfaces():
    zoom = done(begin("canon-70-200")[0].project, "add_row", {"row": 0})[0]
    before = open_lens("canon-70-200").lens
    assert {row + 1 for row, _ in before.positions[0].gaps} == {row for row, _ in zoom.lens.positions[0].gaps}


def test_another_lens_keeps_the_light_where_it_was_in_the_picture(project):
    from math import radians, tan

    other = do(project, "choose_lens", lens="biotar-50-f1.4")
    place = [
        first_order(open_lens(one.lens).lens).efl * tan(radians(one.lights[0].field_deg[0])) for one in (project, other)
    ]
    assert place[1] == pytest.approx(place[0], rel=1e-4)
    assert other.f_number == 8.0


def test_mute_solo_gain_and_tint_are_rules_that_can_be_taken_back(project):
    loud = do(project, "set_ghost", name="4-1", values={"gain": 3.0, "tint": [1.0, 0.5, 0.25]})
    assert override_of(loud.art, "4-1") == GhostOverride(False, 3.0, (1.0, 0.5, 0.25))
    alone = do(loud, "set_solo", names=["4-1", "8-6"])
    assert soloed(alone.art) == ("4-1", "8-6")
    # muting a soloed ghost: the solo still decides about the others
    muted = do(alone, "set_ghost", name="8-6", values={"muted": True})
    assert soloed(muted.art) == ("4-1", "8-6")
    assert do(alone, "set_solo", names=[]) == loud
    assert do(loud, "set_ghost", name="4-1", values={"gain": 1.0, "tint": [1, 1, 1]}) == project
    assert do(muted, "reset_art") == project


def test_from_scratch_needs_a_ghost_that_was_added(project):
    with pytest.raises(FlarewrightError, match="there is none yet: add a ghost first"):
        do(project, "set_design", values={"own_ghosts": False, "structure": "any"})
    added = do(do(project, "add_ghost", place_mm=5.0, radius_mm=1.0), "set_design", values={"own_ghosts": False})
    assert added.design.own_ghosts is False
    # the last added ghost can be removed all the same
    assert do(added, "remove_ghost_target", number=0).design.own_ghosts is True


def without_the_last(session):
    """Remove the only new ghost as the page does; return the structure afterwards."""
    design = session.project.design
    before = past.design_before_added(session.history) or past.design_before_scratch(session.history)
    kept = None if before is None else {"structure": before.structure, "fixed_rows": before.fixed_rows}
    number = next(k for k, ghost_target in enumerate(design.ghost_targets) if ghost_target.ghost is None)
    session.do("remove_ghost_target", {"number": number, "before": kept})
    return session.project.design.structure


def test_what_a_new_ghost_needed_goes_with_the_last_one(project):
    session, _ = begin(None)
    session.put(project, "Begin", begins=True)
    add = ("add_ghost", {"place_mm": 5.0, "radius_mm": 1.0})

    def search(**values):
        session.do("set_design", {"values": values})

    # as the page shows without targets
    session.do(*add)
    assert session.project.design.structure == "any"
    assert without_the_last(session) == "lens"
    # and with the user's own settings, which must stay
    session.do("set_ghost_target", {"ghost": "4-1", "values": {"move_mm": 2.0}})
    search(fixed_rows=(0, 1))
    session.do(*add)
    session.do(*add)
    session.do("set_new_ghost_target", {"number": 2, "values": {"radius_mm": 2.0}})
    session.do("remove_ghost_target", {"number": 1, "before": None})
    assert session.project.design.structure == "any"
    assert without_the_last(session) == "lens"
    assert session.project.design.fixed_rows == (0, 1)
    # any structure was chosen before
    search(structure="any")
    session.do(*add)
    assert without_the_last(session) == "any"
    # or chosen since, directly or by a number of surfaces
    search(structure="lens")
    session.do(*add)
    search(structure="lens")
    search(structure="any")
    assert without_the_last(session) == "any"
    search(structure="lens")
    session.do(*add)
    search(surfaces=12, structure="any")
    assert without_the_last(session) == "any"
    # from scratch set it, for as long as there was an added ghost
    search(surfaces=None, structure="lens")
    session.do(*add)
    search(own_ghosts=False, structure="any")
    assert without_the_last(session) == "lens"
    session.do(*add)
    search(structure="lens")
    search(own_ghosts=False, structure="any")
    assert without_the_last(session) == "lens"
    # the state before is unknown for a file with such a ghost
    session.put(do(project, *add[:1], **add[1]), "Open", begins=True)
    assert past.design_before_added(session.history) is None
    assert without_the_last(session) == "any"
    session.writer.close()


def test_targets_make_the_target_picture(project):
    wanted = do(project, "set_ghost_target", ghost="4-1", values={"move_mm": 2.0, "height": 0.5})
    wanted = do(wanted, "set_ghost_target", ghost="8-6", values={"action": "remove"})
    assert wanted.design.structure == "lens"
    target = target_project(wanted)
    moved, gone = target.art.rules
    x, y = direction(project)
    assert moved.offset_mm == pytest.approx((2.0 * x, 2.0 * y))
    assert moved.scale == 0.5
    assert gone.enable is False
    new = do(wanted, "add_ghost", place_mm=5.0, radius_mm=1.0)
    assert new.design.structure == "any"
    assert new_discs(new) == (pytest.approx((5.0 * x, 5.0 * y, 1.0)),)
    assert do(new, "set_new_ghost_target", number=2, values={"radius_mm": 2.0}).design.ghost_targets[2].radius_mm == 2.0
    assert len(do(new, "remove_ghost_target", number=0).design.ghost_targets) == 2
    assert do(new, "set_design", values={"structure": "any"}).design.structure == "any"
    # a changed target keeps its position in the list
    again = do(new, "set_ghost_target", ghost="4-1", values={"move_mm": 3.0})
    assert [ghost_target.ghost for ghost_target in again.design.ghost_targets] == ["4-1", "8-6", None]
    assert (
        do(again, "set_ghost_target", ghost="4-1", values={"move_mm": 0.0, "height": 1.0}).design.ghost_targets[0].ghost
        == "8-6"
    )
    assert ghost_target_names(again.design) == ("ghost 4-1", "ghost 8-6", "added ghost 1")
    assert do(new, "clear_ghost_targets").design is None
    with pytest.raises(FlarewrightError, match="crosses the stop"):
        do(project, "set_ghost_target", ghost="8-0", values={"move_mm": 1.0})


def test_a_lane_does_the_newest_and_drops_the_rest():
    lane, gate, began, ran = Lane("test"), threading.Event(), threading.Event(), []

    def first(check):
        began.set()
        gate.wait(5.0)
        ran.append("first began")
        check()
        ran.append("first went on")

    lane.submit(first)
    assert began.wait(5.0)
    for name in ("a", "b", "c"):
        lane.submit(lambda check, name=name: ran.append(name))
    gate.set()
    assert lane.wait(5.0)
    assert ran == ["first began", "c"]
    lane.close()


def test_a_lane_outlives_a_job_that_fails(capsys):
    lane, ran = Lane("test"), []

    def bad(check):
        raise RuntimeError("ours")

    lane.submit(bad)
    assert lane.wait(5.0)
    lane.submit(lambda check: ran.append("next"))
    assert lane.wait(5.0)
    assert ran == ["next"]
    assert "ours" in capsys.readouterr().err
    lane.close()


@pytest.mark.parametrize(
    "start",
    [
        "from flarewright.editor.common.latest_job import Lane; Lane('test').submit(work)",
        pytest.param(
            "from flarewright.editor.design.search_job import Solver; from flarewright.editor.session.session import "
            "begin; Solver(begin('heliar-tronnier')[0], None)._begin(work)",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["lane", "solver"],
)
def test_a_process_that_ends_while_a_job_submits_work_prints_nothing(start, tmp_path):
    text = f"""
import threading, time
from concurrent.futures import ThreadPoolExecutor

began, failed = threading.Event(), threading.Event()

def work(*_):
    began.set()
    while True:
        try:
            with ThreadPoolExecutor(1) as pool:
                pool.submit(int)
        except RuntimeError:
            failed.set()
            raise

{start}
began.wait()
# the interpreter waits for this worker after it has closed all pools
ThreadPoolExecutor(1).submit(lambda: (failed.wait(10.0), time.sleep(0.2), print("refused" if failed.is_set() else "")))
"""
    done = subprocess.run(
        [sys.executable, "-c", text], capture_output=True, text=True, timeout=120, check=False,
        env={**os.environ, "FLAREWRIGHT_STATE": str(tmp_path)},
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "refused\n", "")


def test_a_lens_named_on_the_command_line_has_a_separate_autosave():
    assert autosave_path(None) != autosave_path("tessar-brendel")
    assert Light(field_deg=(0, 0)) is not None


def test_the_spectra_of_the_page_are_found_again_by_their_text():
    """The list showed "lines:589*1,589.6*1" after a choice of its own Sodium lamp."""
    from flarewright.io.project.spectrum_text import parse_spectrum, spectrum_text

    page = (files("flarewright.editor") / "static" / "panel_light.js").read_text("utf-8")
    (listed,) = re.findall(r"^const SPECTRA = (.*);$", page, re.MULTILINE)
    keys = re.findall(r"\['([^']+)', '[^']+'\]", listed)
    assert len(keys) > 5
    assert [spectrum_text(parse_spectrum(key)) for key in keys] == keys


def test_a_dropped_project_does_not_overwrite_the_file_of_the_one_before(tmp_path):
    session, _ = begin(None)
    mine = session.save(str(tmp_path / "mine"))
    session.do("move_light", {"light": 0, "x": 4.0, "y": 2.0})
    other = session.save(str(tmp_path / "other"))
    session.open(str(mine))
    take_in(session, "other.toml", other.read_bytes())
    assert session.file is None
    session.undo()
    assert session.file == str(mine)
    session.writer.close()


def test_saving_names_no_project_before_it_was_opened(tmp_path):
    session, _ = begin(None)
    session.open("tessar-brendel")
    path = session.save(str(tmp_path / "tessar"))
    session.undo()
    assert session.file is None
    session.redo()
    assert session.file == str(path)
    session.writer.close()


def test_a_solo_of_the_sensors_ghost_ends(project):
    alone = do(project, "set_solo", names=["sensor-3"])
    assert soloed(alone.art) == ("sensor-3",)
    assert soloed(do(alone, "set_solo", names=["7-3"]).art) == ("7-3",)
    assert do(alone, "set_solo", names=[]).art == project.art


@pytest.mark.parametrize("row", [5, 15])
def test_a_row_in_a_moving_gap_changes_no_position(project, row):
    zoom = do(project, "choose_lens", lens="canon-70-200").replace(f_number=None)
    lens = open_lens("canon-70-200").lens
    moving = {k for k, _ in lens.positions[0].gaps}
    row = sorted(moving)[0 if row == 5 else -1]
    added = do(zoom, "add_row", row=row).lens
    for before, after in zip(lens.positions, added.positions, strict=True):
        efl = [first_order(at_position(one, position)).efl for one, position in ((lens, before), (added, after))]
        assert efl[1] == pytest.approx(efl[0], rel=1e-9)


def test_the_command_renders_the_saved_file_as_it_is():
    """A draft used to become final, which *Export* does not make of it."""
    assert command_line("a shot.toml") == "flarewright render --project 'a shot.toml' -o 'a shot.exr'"
