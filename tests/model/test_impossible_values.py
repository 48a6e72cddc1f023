"""A record that a program makes with impossible values raises one sentence, as the command line prints for a flag."""

import inspect

import pytest
from pydantic import ValidationError

import flarewright as fw
from flarewright.model.base import Frozen

LIGHT = fw.Light(field_deg=(6.0, 3.0))
PUBLIC = [getattr(fw, name) for name in sorted(fw.__all__)]
RECORDS = [one for one in PUBLIC if inspect.isclass(one) and issubclass(one, Frozen)]


def refusal(make) -> str:
    with pytest.raises(fw.ProjectError) as refused:
        make()
    return str(refused.value)


def test_every_public_record_refuses_an_unknown_field_in_one_sentence():
    assert len(RECORDS) > 40
    for record in RECORDS:
        said = refusal(lambda record=record: record(nosuch=1))
        assert said.startswith(record.__name__)
        assert "nosuch is not a known field" in said
        assert "\n" not in said
        assert "pydantic" not in said


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: fw.Standard(name="wrong"),
            "Standard: name should be 'uncoated-1930s', 'single-1950s', 'early-multicoat' or 'modern-broadband', "
            "not 'wrong'",
        ),
        (lambda: fw.Light(field=(1, 2)), "Light has 2 problems, the first: field is not a known field; did you mean"),
        (lambda: LIGHT.replace(diameter=2), "Light: diameter is not a known field; did you mean 'diameter_deg'?"),
        (lambda: fw.Iris(blades=1), "Iris: blades: an iris has 0 blades (round) or at least 3"),
        (lambda: fw.Camera(sensor_mm=(0, 24)), "Camera: sensor_mm: a sensor has a width and a height above 0 mm"),
        (lambda: fw.Light(field_deg=(1, 2), spectrum="d65"), "Light: spectrum should be an EqualEnergy, D65, "),
        (lambda: fw.Project(lens="a", lights=(1, LIGHT)), "Project: lights[0] should be a Light, not 1"),
        (lambda: fw.Project(lens="a", lights=LIGHT), "Project: lights should be a list: write lights=[...]"),
        (
            lambda: fw.Project(lens="a", lights=[LIGHT], coating={"kind": "everywhere", "coating": {"kind": "film"}}),
            "Project has 2 problems, the first: coating.coating.index is missing",
        ),
    ],
)
def test_the_sentence_names_the_field_and_what_it_should_be(make, said):
    assert refusal(make).startswith(said)


def test_the_standard_coating_keeps_its_place_inside_a_record():
    wrong = {"kind": "everywhere", "coating": {"kind": "standard", "name": "wrong"}}
    assert "coating.coating.name should be" in refusal(lambda: fw.Project(lens="a", lights=[LIGHT], coating=wrong))


def test_readers_of_files_get_the_place_of_every_value():
    with pytest.raises(ValidationError):
        fw.Light.model_validate({"field_deg": (1,)})


def test_the_signature_has_the_fields():
    assert list(inspect.signature(fw.Iris).parameters) == list(fw.Iris.model_fields)
