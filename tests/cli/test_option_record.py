"""A command whose options are the fields of a record."""

from dataclasses import dataclass, field
from typing import Annotated, Any

import typer
from typer.testing import CliRunner

from flarewright.cli.option_record import with_options


@dataclass(frozen=True, kw_only=True)
class Size:
    width: Annotated[int, typer.Option(help="Columns.")]


@dataclass(frozen=True, kw_only=True)
class Options(Size):
    names: Annotated[list[str], typer.Option("--name", help="May be repeated.")] = field(default_factory=list)
    loud: Annotated[bool, typer.Option("--loud", help="In capitals.")] = False
    known: Any = None


def called(*words):
    """Return the exit code and the record of a command line."""
    app, seen = typer.Typer(), []

    @app.command()
    @with_options(Options)
    def show(options: Options) -> None:
        """Show it."""
        seen.append(options)

    result = CliRunner().invoke(app, words)
    return result.exit_code, seen, result.output


def test_options_become_a_record():
    assert called("--width", "3")[:2] == (0, [Options(width=3)])
    assert called("--width", "3", "--name", "a", "--name", "b", "--loud")[:2] == (
        0,
        [Options(width=3, names=["a", "b"], loud=True)],
    )


def test_what_is_required_and_what_is_no_option():
    assert called()[0] == 2
    assert called("--width", "3", "--known", "x")[0] == 2
    code, seen, words = called("--help")
    assert (code, seen) == (0, [])
    assert [line for line in ("Show it.", "Columns.", "May be repeated.", "In capitals.") if line not in words] == []
