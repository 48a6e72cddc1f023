"""Help names option values by words, never by Python types."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest
from typer.main import get_command

from flarewright.cli.app import run
from flarewright.cli.command_tree import command_tree
from flarewright.cli.render.options.record import RenderOptions
from flarewright.cli.render.project_flags import _OPTION_OF, _SECTIONS
from flarewright.model import Light, Project


def options(command: Any, name: str = "flarewright") -> dict[str, Any]:
    """Return every option below a command by its full name, except --help."""
    found = {f"{name} {one.opts[0]}": one for one in command.params if one.param_type_name == "option"}
    for below in getattr(command, "commands", {}).values():
        found |= options(below, f"{name} {below.name}")
    return found


def test_every_option_says_what_it_takes():
    found = options(get_command(command_tree()))
    assert len(found) > 200
    assert [name for name, option in found.items() if option.metavar is None] == []
    assert found["flarewright render --fstop"].metavar == "NUMBER"
    assert found["flarewright render --intensity"].metavar == "NUMBER"
    assert found["flarewright render --blades"].metavar == "N"
    assert found["flarewright render --iris-image"].metavar == "FILE"
    assert found["flarewright render --light"].metavar == "X,Y"
    # a switch takes no value
    assert {found[f"flarewright {name}"].metavar for name in ("render --half", "ghosts --json", "--version")} == {""}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("render heliar-tronnier --light 1,1 -o a.exr --fstop fast", "number"),
        ("render heliar-tronnier --light 1,1 -o a.exr --blades 5.5", "whole number"),
        ("render heliar-tronnier --light 1,1 -o a.exr --intensity 2024-06-21", "number"),
        ("render heliar-tronnier --light 1,1 -o a.exr --threads 0", ""),
        ("ghosts heliar-tronnier --light 1,1 --wavelength-nm red", "number"),
    ],
)
def test_a_value_of_another_kind_is_reported_in_words(capsys, words, said):
    assert run(words.split()) == 2
    err = capsys.readouterr().err
    assert f"invalid value for '{words.split()[-2]}': " in err
    assert words.split()[-1] in err
    assert said in err
    for python in ("Input should", "valid integer", "valid number", "float", "parse string"):
        assert python not in err


@pytest.mark.parametrize(("name", "said"), [("", "is empty"), ("a\0.exr", "has a null byte")])
def test_every_output_refuses_what_is_no_name(capsys, name, said):
    commands = [
        name.split()[1:-1] for name, option in options(get_command(command_tree())).items() if "--output" in option.opts
    ]
    assert len(commands) > 20
    for words in commands:
        assert run([*words, "-o", name]) == 2
        assert f"the name of the output {said}" in capsys.readouterr().err, words


def test_each_option_of_a_project_sets_a_key_that_exists():
    project = Project(lens="heliar-tronnier", lights=(Light(field_deg=(0.0, 0.0)),))
    for key, option in _OPTION_OF.items():
        section, _, name = key.partition(".")
        assert option in {one.name for one in fields(RenderOptions)}
        assert section not in _SECTIONS or hasattr(getattr(project, section), name), key
