"""What the tests of all commands share: the tree of commands is built once."""

from functools import cache

import pytest
import typer.main


@pytest.fixture(scope="session", autouse=True)
def _one_tree_of_commands():
    """Keep the commands that Typer builds at every call; building them costs more than most refusals do.

    Tests that start a process of their own, as `test_the_package_runs_as_a_module`, build the tree as a user does.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        yield
