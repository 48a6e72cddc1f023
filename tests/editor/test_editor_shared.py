"""Light paths, occluders, chosen pictures, and two editors of one project; without a browser."""

import os
from pathlib import Path

import numpy as np
import pytest

from flarewright.editor.commands.registry import done
from flarewright.editor.preview.display_image import png
from flarewright.editor.preview.render_picture import pictured
from flarewright.editor.server.uploads import take_in
from flarewright.editor.session import known_files
from flarewright.editor.session import session as session_module
from flarewright.editor.session.history import before_mask
from flarewright.editor.session.session import begin
from flarewright.errors import FlarewrightError, ProjectError
from flarewright.io.project.project_file import read_project
from flarewright.model import Holdout, LightKey
from flarewright.workflow.keyframes import length_s


def do(project, command, /, **values):
    return done(project, command, values)[0]


def test_a_path_of_keys(project):
    keyed = do(project, "set_key", light=0, at_s=0.0)
    assert keyed.lights[0].keyframes == (LightKey(at_s=0.0, field_deg=(6.0, 3.0)),)
    keyed = do(do(keyed, "move_light", light=0, x=-2.0, y=1.0), "set_key", light=0, at_s=2.0)
    keyed = do(keyed, "set_key", light=0, at_s=3.0, field_deg=[-2.0, -3.0])
    assert length_s(keyed) == 3.0
    # straight lines between keys, and rest before and after
    places = {at: do(keyed, "go_to", at_s=at).lights[0].field_deg for at in (0.0, 0.5, 1.0, 2.5, 9.0)}
    assert places == {0.0: (6.0, 3.0), 0.5: (4.0, 2.5), 1.0: (2.0, 2.0), 2.5: (-2.0, -1.0), 9.0: (-2.0, -3.0)}
    # a key at the same time replaces the old one; a moved key keeps the order
    again = do(keyed, "set_key", light=0, at_s=2.004)
    assert len(again.lights[0].keyframes) == 3
    moved = do(keyed, "move_key", light=0, number=0, at_s=2.5)
    assert [key.at_s for key in moved.lights[0].keyframes] == [2.0, 2.5, 3.0]
    with pytest.raises(ProjectError, match="there is a key at 2 s already"):
        do(keyed, "move_key", light=0, number=0, at_s=2.0)
    assert len(do(keyed, "remove_key", light=0, number=1).lights[0].keyframes) == 2
    cleared = do(keyed, "clear_keys", light=0)
    assert cleared.lights[0].keyframes == ()
    # the picture is that of the light's place; the path has no effect on it
    assert pictured(keyed) == pictured(cleared)
    for name, values in (("set_key", {"light": 5, "at_s": 0.0}), ("remove_key", {"light": 0, "number": 3})):
        with pytest.raises(ProjectError, match="there is no"):
            do(keyed, name, **values)


def test_a_path_is_kept_in_the_project_file(project, tmp_path):
    keyed = do(do(project, "set_key", light=0, at_s=0.5), "set_key", light=0, at_s=1.5, field_deg=[1.0, 2.0])
    session, _ = begin("tessar-brendel")
    session.put(keyed, "Key")
    path = session.save(str(tmp_path / "path.toml"))
    assert "[[lights.keyframes]]" in path.read_text()
    assert read_project(path).lights[0].keyframes == keyed.lights[0].keyframes
    path.write_text(path.read_text().replace("at_s = 1.5", "at_s = 0.5"))
    with pytest.raises(ProjectError, match=r"keyframes must rise in time: 0.5 s follows 0.5 s"):
        read_project(path)
    # with another lens the light keeps its places in the picture
    other = do(keyed, "choose_lens", lens="biotar-50-f1.4").lights[0]
    assert other.keyframes[0].field_deg == other.field_deg
    session.writer.close()


def test_what_hides_lights(project):
    hidden = do(project, "set_holdout", light=None, values={"image": "matte.png", "invert": True})
    assert hidden.holdout == Holdout(image="matte.png", invert=True)
    deep = do(hidden, "set_holdout", light=None, values={"depth": "depth.exr"})
    assert deep.holdout == Holdout(depth="depth.exr")
    assert do(deep, "set_holdout", light=None, values={"depth_unit_mm": 1.0}).holdout.depth_unit_mm == 1.0
    one = do(project, "set_holdout", light=0, values={"image": "leaves.png"})
    assert one.lights[0].holdout == Holdout(image="leaves.png")
    assert one.holdout is None
    assert do(one, "set_holdout", light=0, values=None) == project
    with pytest.raises(ProjectError, match="give one of them"):
        do(project, "set_holdout", light=None, values={"invert": True})


def test_pictures_are_taken_for_what_they_were_chosen_for(tmp_path):
    session, _ = begin(None)
    grey = png(np.full((8, 8, 3), 255, dtype=np.uint8))
    take_in(session, "hole.png", grey, "mask")
    assert session.project.iris.mask.endswith("hole.png")
    take_in(session, "dirt.png", grey, "dirt")
    assert session.project.dirt.image.endswith("dirt.png")
    take_in(session, "leaves.png", grey, "image", 0)
    assert session.project.lights[0].holdout.image.endswith("leaves.png")
    take_in(session, "sky.png", grey)
    assert session.project.plate.image.endswith("sky.png")
    before = session.project
    for name, data, use in (
        ("lens.toml", b"schema_version = 1\n", "mask"), ("dark.png", png(np.zeros((8, 8, 3), np.uint8)), "mask"),
        ("hole.png", grey, "depth"), ("broken.png", b"nothing", "image"),
    ):  # fmt: skip
        with pytest.raises(FlarewrightError):
            take_in(session, name, data, use)
    assert session.project == before
    session.writer.close()


def test_the_rotation_of_blades_turns_no_image_that_takes_their_place(tmp_path):
    session, _ = begin(None)
    white = png(np.full((8, 8, 3), 255, dtype=np.uint8))
    grey = png(np.full((8, 8, 3), 128, dtype=np.uint8))
    assert session.project.iris.rotation_deg == 10.0
    (reported,) = take_in(session, "a.png", white, "mask")
    assert reported.startswith("the blades were rotated by 10°; the image is not rotated")
    assert session.project.iris.rotation_deg == 0.0
    assert before_mask(session.history).iris.rotation_deg == 10.0
    # a rotated image keeps its rotation
    session.do("set_iris", {"values": {"rotation_deg": 30.0}})
    assert take_in(session, "b.png", grey, "mask") == ()
    assert session.project.iris.rotation_deg == 30.0
    assert before_mask(session.history).iris.rotation_deg == 10.0
    for _ in range(3):
        session.undo()
    assert (session.project.iris.mask, session.project.iris.rotation_deg) == (None, 10.0)
    assert before_mask(session.history) is None
    # unrotated blades cause no message, and neither does a project that starts with an image
    session.do("set_iris", {"values": {"rotation_deg": 0.0}})
    assert take_in(session, "a.png", white, "mask") == ()
    session.put(session.project, "Open", begins=True)
    session.put(session.project.replace(f_number=11.0), "Open", begins=True)
    assert before_mask(session.history) is None
    session.writer.close()


def test_two_editors_of_one_project_do_not_fight(tmp_path):
    first, reported = begin("tessar-brendel")
    assert reported == ""
    second, reported = begin("tessar-brendel")
    assert reported.startswith("Another editor has this open too")
    assert first.writer.path != second.writer.path
    first.do("set_iris", {"values": {"blades": 8}})
    second.do("set_iris", {"values": {"blades": 5}})
    path = first.save(str(tmp_path / "shot.toml"))
    # the second editor reports the existing file, and may overwrite it
    with pytest.raises(ProjectError, match=r"shot.toml is there already; save again to overwrite it, or .* another"):
        second.save(str(path))
    assert read_project(path).iris.blades == 8
    second.save(str(path))
    # the first one reports this once
    first.do("set_iris", {"values": {"blades": 9}})
    with pytest.raises(ProjectError, match=r"shot.toml was changed by another program .* save again to overwrite it"):
        first.save(str(path))
    assert read_project(path).iris.blades == 5
    first.save(str(path))
    assert read_project(path).iris.blades == 9
    # unsaved changes are separate
    first.do("set_iris", {"values": {"blades": 11}})
    second.do("set_iris", {"values": {"blades": 7}})
    first.writer.close()
    second.writer.close()
    # each resumes its own session
    again, _ = begin("tessar-brendel")
    beside, _ = begin("tessar-brendel")
    assert [one.history.present.iris.blades for one in (again, beside)] == [11, 7]
    again.writer.close()
    beside.writer.close()


def turned(path):
    """Return a project file as changed by another program."""
    text = path.read_text()
    return text.replace("blades = ", "rotation_deg = 5.0\nblades = ", 1).replace("\nrotation_deg = 0.0", "")


def test_what_others_saved_meanwhile_is_never_overwritten_unasked(tmp_path):
    """In an interrupted session, after undo of Open, and with equal file times."""
    one, two = begin("tessar-brendel")[0], begin("heliar-tronnier")[0]
    path, other = one.save(str(tmp_path / "shot.toml")), two.save(str(tmp_path / "other.toml"))
    two.writer.close()
    one.do("set_iris", {"values": {"blades": 9}})
    one.open(str(other))
    one.do("set_iris", {"values": {"blades": 7}})
    one.writer.close()
    times = path.stat()
    changed = turned(path)
    path.write_text(changed)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    again = begin("tessar-brendel")[0]
    assert (again.file, again.clean) == (str(other), False)
    # the present contents were saved by this session: no question
    again.save(str(other))
    for _ in range(2):
        again.undo()
    assert (again.file, again.project.iris.blades) == (str(path), 9)
    with pytest.raises(ProjectError, match=r"shot.toml was changed by another program since it was opened or saved"):
        again.save(str(path))
    # it changes once more before the second attempt
    path.write_text(changed.replace("rotation_deg = 5.0", "rotation_deg = 6.0"))
    with pytest.raises(ProjectError, match="save again to overwrite"):
        again.save(str(path))
    assert read_project(path).iris.rotation_deg == 6.0
    again.save(str(path))
    assert read_project(path).iris.blades == 9
    again.writer.close()


def after(monkeypatch, module, name, call, work):
    """Let another program act right after the n-th call of a function."""
    ours, calls = getattr(module, name), []

    def both(*values, **named):
        found = ours(*values, **named)
        calls.append(found)
        if len(calls) == call:
            work()
        return found

    monkeypatch.setattr(module, name, both)


def test_what_others_save_while_this_is_written_is_not_overwritten(tmp_path, monkeypatch):
    session = begin("tessar-brendel")[0]
    path = session.save(str(tmp_path / "shot.toml"))
    theirs = turned(path)
    session.do("set_iris", {"values": {"blades": 9}})
    # changed between the first check and the last
    with monkeypatch.context() as patch:
        after(patch, Path, "write_bytes", 1, lambda: path.write_text(theirs))
        with pytest.raises(ProjectError, match=r"shot.toml was changed by another program since .* save again"):
            session.save(str(path))
    assert path.read_text() == theirs
    assert not session.clean
    session.save(str(path))
    assert read_project(path).iris.blades == 9
    # a new file appears, before the last check and right after it
    for name, module, call, function in (("a", Path, 1, "write_bytes"), ("b", known_files, 2, "stamp_of")):
        new = tmp_path / f"{name}.toml"
        with monkeypatch.context() as patch:
            after(patch, module, function, call, lambda new=new: new.write_text(theirs))
            with pytest.raises(ProjectError, match=f"{new.name} is there already; save again to overwrite it"):
                session.save(str(new))
        assert new.read_text() == theirs
    # no partial file remains
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.toml", "b.toml", "shot.toml", "state"]
    session.save(str(tmp_path / "b.toml"))
    assert read_project(tmp_path / "b.toml").iris.blades == 9
    session.writer.close()


def test_what_others_save_right_after_is_theirs(tmp_path, monkeypatch):
    """Written contents are identified by their bytes, and read ones by the bytes before reading."""
    session = begin("tessar-brendel")[0]
    path = session.save(str(tmp_path / "shot.toml"))
    theirs = turned(path)
    session.do("set_iris", {"values": {"blades": 9}})
    with monkeypatch.context() as patch:
        after(patch, known_files, "save_project", 1, lambda: path.write_text(theirs))
        session.save(str(path))
    session.do("set_iris", {"values": {"blades": 7}})
    with pytest.raises(ProjectError, match="was changed by another program"):
        session.save(str(path))
    session.writer.close()
    with monkeypatch.context() as patch:
        after(patch, session_module, "open_any", 1, lambda: path.write_text(theirs.replace("5.0", "6.0")))
        late = begin(str(path))[0]
    late.do("set_iris", {"values": {"blades": 5}})
    with pytest.raises(ProjectError, match="was changed by another program"):
        late.save(str(path))
    assert read_project(path).iris.rotation_deg == 6.0
    late.writer.close()


def test_without_a_place_for_its_state_the_editor_works_all_the_same(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setenv("FLAREWRIGHT_STATE", str(blocked))
    session, _ = begin(None)
    heard = []
    session.listeners.append(heard.append)
    session.do("set_iris", {"values": {"blades": 8}})
    session.writer.close()
    assert session.project.iris.blades == 8
    assert any("The autosave failed" in event.get("text", "") for event in heard)
