"""Help names what an option takes in words, never by a type of Python."""

from __future__ import annotations

from typing import Any

from typer.main import get_command

from flarewright.cli.app import app


def options(command: Any, name: str = "flarewright") -> dict[str, Any]:
    """Return every option below a command by its full name, but for the one of help itself."""
    found = {f"{name} {one.opts[0]}": one for one in command.params if one.param_type_name == "option"}
    for below in getattr(command, "commands", {}).values():
        found |= options(below, f"{name} {below.name}")
    return found


def test_every_option_says_what_it_takes():
    found = options(get_command(app))
    assert len(found) > 200
    assert [name for name, option in found.items() if option.metavar is None] == []
    assert found["flarewright render --fstop"].metavar == "NUMBER"
    assert found["flarewright render --intensity"].metavar == "NUMBER"
    assert found["flarewright render --blades"].metavar == "N"
    assert found["flarewright render --iris-image"].metavar == "FILE"
    assert found["flarewright render --light"].metavar == "X,Y"
    # a switch takes nothing
    assert {found[f"flarewright {name}"].metavar for name in ("render --half", "ghosts --json", "--version")} == {""}
