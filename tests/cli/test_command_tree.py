"""A command line imports the modules of one command only."""

import subprocess
import sys
from functools import cache

import pytest
from typer.main import get_command

from flarewright.cli.command_tree import COMMANDS, GROUPS, command_tree


@cache
def names(*words):
    """Return the names of all commands and groups of the tree of a command line, with those below them."""
    tree = get_command(command_tree(words))
    return {(name, *getattr(command, "commands", {})) for name, command in tree.commands.items()}


def test_every_command_is_in_the_tree_once():
    found = {" ".join(words) for first, *below in names() for words in ((first,), *((first, name) for name in below))}
    assert found == {command.words for command in COMMANDS} | set(GROUPS)
    assert len({command.words for command in COMMANDS}) == len(COMMANDS)


@pytest.mark.parametrize("words", [["render", "--help"], ["design", "sovle"], ["looks"], ["project", "check"]])
def test_the_tree_of_a_command_line_is_a_part_of_the_whole(words):
    assert names(*words) == {name for name in names() if name[0] == words[0]}


@pytest.mark.parametrize("words", [["--version"], ["rendr"]])
def test_any_other_command_line_has_all_commands(words):
    """So that the error names the command that is meant."""
    assert names(*words) == names()


def test_a_render_imports_no_other_command():
    code = (
        "import sys; from flarewright.cli.command_tree import command_tree; command_tree(['render']);"
        "print(*(name for name in sys.modules if name.startswith('flarewright.cli.')))"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "flarewright.cli.render.command" in loaded
    others = ("design", "measure", "predict", "library", "dataset", "render.shot_command", "render.ghosts_command")
    assert not [name for name in loaded if name.startswith(tuple(f"flarewright.cli.{other}" for other in others))]
