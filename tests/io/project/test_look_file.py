"""Look files: those of the library, round trips, and errors."""

import pytest

from flarewright.errors import ProjectError
from flarewright.io.images.thumbnails import SIZE_PX, thumbnail
from flarewright.io.project.look_file import look_path, look_text, read_look, shipped_looks
from flarewright.io.project.project_file import read_project
from flarewright.model import BlackBody

LOOK = """
name = "Dusk"
notes = "Warm and soft."
lens = "tessar-brendel"
f_number = 8.0
coating = { kind = "in-turn", coatings = ["quarter-wave:450", "modern-broadband*0.9"] }
[iris]
rounding = 0.1
[camera]
sensor_reflectance = 0.1
[[art.rules]]
select = "brightest:3"
gain = 0.5
[[lights]]
field_deg = [-5.0, 2.0]
intensity = 2.0
spectrum = "black-body:2500"
"""


def written(tmp_path, text, name="dusk.toml"):
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return str(path)


def test_a_look_says_what_its_file_does(tmp_path):
    look = read_look(written(tmp_path, LOOK))
    assert set(look.says) == {
        "f_number", "coating", "iris.rounding", "camera.sensor_reflectance", "art", "lights.spectrum",
    }  # fmt: skip
    assert look.of("iris") == {"rounding": 0.1}
    assert look.of("lights") == {"spectrum": BlackBody(temperature_k=2500.0)}


@pytest.mark.parametrize("name", shipped_looks())
def test_looks_that_ship_read_back_from_their_text_and_have_a_picture(name, tmp_path):
    from io import BytesIO

    from PIL import Image

    look = read_look(name)
    again = read_look(written(tmp_path, look_text(look)))
    assert set(again.says) == set(look.says)
    assert (again.name, again.notes, again.example) == (look.name, look.notes, look.example)
    assert look.notes
    assert Image.open(BytesIO(thumbnail("look", name))).size == SIZE_PX


def test_there_are_a_dozen_looks():
    assert len(shipped_looks()) >= 12
    assert look_path("Low Sun") == look_path("low-sun")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('name = "x"\nlens = "tessar-brendel"\n', "sets no key of a look; known are f_number, iris"),
        (LOOK + "[quality]\nmode = 'draft'\n", "a look has no key quality"),
        (LOOK.replace("sensor_reflectance = 0.1", "size_px = [4, 3]"), "a look cannot set camera.size_px"),
        (LOOK.replace("rounding = 0.1", "rounded = 0.1"), "a look cannot set iris.rounded"),
        (LOOK.replace("f_number = 8.0", "f_number = -8.0"), "f_number"),
        (LOOK.replace("f_number", "fnumber"), "has no key fnumber; did you mean 'f_number'"),
        (LOOK.replace('"Dusk"', '""'), "name"),
        ('lens = "tessar-brendel"\n[[lights]]\nfield_deg = [1, 2]\n', "is a project file, not a look file"),
        ("name = ", "is not valid TOML"),
    ],
)
def test_mistakes_in_a_look_are_told(tmp_path, text, words):
    with pytest.raises(ProjectError) as reported:
        read_look(written(tmp_path, text))
    assert words in " ".join((str(reported.value), *reported.value.problems))


def test_a_look_in_a_projects_place_is_told(tmp_path):
    with pytest.raises(ProjectError, match=r"is a look, not a project file: apply it to a lens with .* --look"):
        read_project(written(tmp_path, LOOK))


def test_pictures_of_the_library_are_found_by_name_alone():
    for name in ("../lenses/tessar-brendel", "secret", ""):
        with pytest.raises(ProjectError, match="is no lens of the library"):
            thumbnail("lens", name)
