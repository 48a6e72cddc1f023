"""Lights and lengths in messages on the page: the names of its buttons, and the pixels of the file."""

import re

import pytest

from flarewright.editor.common.light_names import light_label, with_light_names
from flarewright.editor.design.search_job import named
from flarewright.editor.preview.picture import page_remarks
from flarewright.editor.preview.render_picture import take
from flarewright.editor.session.view_settings import View
from flarewright.model import Backplate, Camera, Light, Output, Quality
from flarewright.render.render import render


@pytest.fixture
def crowd(project):
    names = ("light", "light 2", "sun", "plate-7")
    return project.replace(lights=tuple(Light(name=name, field_deg=(3.0 + k, 2.0)) for k, name in enumerate(names)))


def test_messages_name_lights_as_their_buttons_do(crowd):
    """They count from 0 in renders and searches, and from 1 on the page."""
    assert [light_label(crowd, k) for k in range(4)] == ["Light 1", "Light 2", "Sun", "Plate-7"]
    assert with_light_names("light 0 (counted from 0) is outside", crowd) == "light 1 is outside"
    assert with_light_names("light 2 (counted from 0) is outside", crowd) == "Sun is outside"
    assert named("Lens 1: ghost 3-0 at light 1 is off", crowd) == "Lens 1: ghost 3-0 at light 2 is off"
    # words of other meaning, and numbers of no light, stay
    for words in ("at light 9", "the light 0 of day", "some light 1"):
        assert with_light_names(words, crowd) == words
    on_plate = crowd.replace(plate=Backplate(image="plate.png", lights_above=1.0))
    assert light_label(on_plate, 3) == "4"
    assert with_light_names("at light 3", on_plate) == "at light 4"


def test_lengths_are_those_of_the_file(project):
    """The page draws fewer pixels than the file has, and used to report how many of its own a light is outside."""
    shot = project.replace(
        lights=(Light(field_deg=(15.0, 12.0)), Light(field_deg=(1.0, 1.0))), camera=Camera(size_px=(1200, 675)),
        quality=Quality(mode="draft", wavelengths=3), output=Output(layers="passes", starburst=False),
    )  # fmt: skip
    (whole,) = (words for words in render(shot).remarks if "px right of" in words)
    drawn = take(shot, "draft", View(), scale=0.25)
    (reported,) = (words for words in page_remarks(drawn) if "px right of" in words)
    wanted, found = ([int(far) for far in re.findall(r"(\d+) px", words)] for words in (whole, reported))
    # half a pixel of the page
    assert found == pytest.approx(wanted, abs=0.5 * 1200 / drawn.ghosts.shape[1] + 1.0)
    assert reported.startswith("light 1 is about ")
    assert whole.startswith("light 0 (counted from 0) is ")
