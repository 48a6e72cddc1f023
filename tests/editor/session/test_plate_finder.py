"""Lights of the plate in a session: one step of the history, cancelled or refused in words of the page."""

import json
import threading

import numpy as np
import pytest
from PIL import Image

from flarewright.editor.preview.display_image import png
from flarewright.editor.server.uploads import take_in
from flarewright.editor.session.autosave import Saved, read_autosave, write_autosave
from flarewright.editor.session.plate_finder import PlateFinder, outlined
from flarewright.editor.session.session import begin
from flarewright.errors import ProjectError
from flarewright.io.project.project_file import read_project
from flarewright.model import Camera, Light

LAMPS = ((12, 9), (40, 18), (54, 28))


def night():
    pixels = np.full((36, 64, 3), 8, np.uint8)
    for x, y in LAMPS:
        pixels[y : y + 2, x : x + 2] = 255
    return pixels


@pytest.fixture
def session():
    found, _ = begin(None)
    found.put(found.project.replace(camera=Camera(size_px=(64, 36))), "Small")
    take_in(found, "night.png", png(night()))
    yield found
    found.writer.close()


@pytest.fixture
def finder(session):
    found = PlateFinder(session)
    yield found
    found.close()


def messages(session):
    heard = []
    session.listeners.append(lambda event: heard.append(event["text"]) if event["type"] == "message" else None)
    return heard


def test_finding_is_one_step_and_its_project_keeps_lights_and_plate(session, finder, tmp_path):
    heard, before, steps = messages(session), session.project, session.history.at
    finder.start()
    assert finder.wait(60.0)
    assert not finder.state.running
    assert (session.history.at, session.history.undo_label) == (steps + 1, "Find lights")
    assert len(session.project.lights) == 3
    assert heard == [
        "3 lights were found; sources are brighter than 0.0804, 5 stops above the plate's mean of 0.00251; the plate "
        "clips them, so they are brighter than it shows: raise Brighter by"
    ]
    saved = read_project(session.save(str(tmp_path / "shot.toml")))
    assert saved == session.project
    session.undo()
    assert session.project == before


def test_a_gain_brightens_found_lights_at_once_and_a_lens_keeps_them_in_place(session, finder):
    finder.start()
    assert finder.wait(60.0)
    found = session.project.lights
    session.do("add_light", {})
    # a million times fainter than the sun would be a white disc
    assert session.project.lights[-1].intensity == found[-1].intensity
    session.do("set_plate", {"values": {"search": {"gain": 8.0}}})
    assert [light.intensity for light in session.project.lights[:3]] == [8.0 * light.intensity for light in found]
    assert session.project.lights[-1].intensity == found[-1].intensity
    # half the diameter of the opening passes a quarter of the light
    session.do("set_fields", {"values": {"f_number": 32.0}})
    assert session.project.lights[0].intensity == pytest.approx(4.0 * 8.0 * found[0].intensity, rel=0.02)
    with pytest.raises(ProjectError, match="of another shape"):
        session.do("set_camera", {"values": {"size_px": (64, 64)}})
    # another picture has its own lights
    take_in(session, "other.png", png(night()[::-1]))
    assert not session.project.plate.lit
    assert session.project.plate.search.gain == 8.0
    session.do("remove_plate", {})
    assert session.project.plate is None


def test_a_cancelled_or_outdated_search_changes_nothing(session, finder, monkeypatch):
    from flarewright.workflow.plates import found_lights

    started, go, search = threading.Event(), threading.Event(), found_lights.search_plate

    def slow(plate, progress):
        started.set()
        assert go.wait(60.0)
        return search(plate, progress)

    monkeypatch.setattr(found_lights, "search_plate", slow)
    heard, before = messages(session), session.project
    finder.start()
    assert started.wait(60.0)
    assert finder.state.running
    finder.stop()
    go.set()
    assert finder.wait(60.0)
    assert (session.project, heard, finder.state.running) == (before, [], False)
    # the plate is another one when the search ends
    started.clear(), go.clear()
    finder.start()
    assert started.wait(60.0)
    session.do("set_plate", {"values": {"search": {"stops": 4.0}}})
    go.set()
    assert finder.wait(60.0)
    assert heard == ["the plate was changed during the search, so no lights were placed; find them again"]
    assert session.project.lights == before.lights


def test_outlines_follow_the_threshold_and_refusals_are_words_of_the_page(session, finder):
    def progress(*_):
        pass

    shown = outlined(session, progress)
    assert (shown["size"], len(shown["lights"])) == ([64, 36], 3)
    assert sorted((one["x"], one["y"]) for one in shown["lights"]) == [(x + 1.0, y + 1.0) for x, y in LAMPS]
    assert "--" not in shown["words"]
    session.do("set_plate", {"values": {"search": {"threshold": 5.0}}})
    none = outlined(session, progress)
    assert (none["lights"], none["words"]) == ([], "the plate has no source above 5; lower Threshold")
    session.do("set_plate", {"values": {"search": {"threshold": None, "source": "sun"}}})
    heard = messages(session)
    finder.start()
    assert finder.wait(60.0)
    assert "fill in White paper" in heard[0]
    assert "--" not in heard[0]
    with pytest.raises(ProjectError, match="stops must be at most 40, not 90"):
        session.do("set_plate", {"values": {"search": {"stops": 90.0}}})
    with pytest.raises(ProjectError, match="what a search has found"):
        session.do("set_plate", {"values": {"lights_above": 1.0}})
    session.do("remove_plate", {})
    with pytest.raises(ProjectError, match="there is no plate"):
        finder.start()


def test_a_plate_is_opened_by_its_path_and_names_of_sequences_are_plain(session, tmp_path):
    Image.fromarray(night()).save(tmp_path / "frame.tif")
    session.open(str(tmp_path / "frame.tif"))
    assert session.project.plate.image == str(tmp_path / "frame.tif")
    (tmp_path / "broken.png").write_bytes(b"nothing")
    before = session.project
    with pytest.raises(Exception, match=r"broken\.png"):
        session.open(str(tmp_path / "broken.png"))
    assert session.project == before
    take_in(session, "frame.####.png", png(night()))
    assert len(outlined(session, lambda *_: None)["lights"]) == 3
    assert isinstance(session.project.lights[0], Light)


def test_an_autosave_with_a_background_of_the_view_is_read(session, tmp_path):
    path = tmp_path / "old.autosave.json"
    write_autosave(path, Saved(session.history, session.view, None, False))
    data = json.loads(path.read_text("utf-8").splitlines()[0])
    data["view"]["plate"] = "sky.png"
    # without a digest, as the first ones
    path.write_text(json.dumps(data), "utf-8")
    assert read_autosave(path).history.present == session.project
