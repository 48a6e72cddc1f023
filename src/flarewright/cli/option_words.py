"""What help says of an option's value: NUMBER, where the library of commands would say <float>."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
from typer.models import OptionInfo

# a switch takes no value
_WORDS = {bool: "", int: "N", float: "NUMBER", Path: "FILE", str: "TEXT"}


def name_values(app: typer.Typer) -> None:
    """Give every option that names its value not itself a word for it.

    Parameters
    ----------
    app : Typer
        Its commands' options are changed, and those of the groups below it.
    """
    for command in (*app.registered_commands, app.registered_callback):
        if command is None or command.callback is None:
            continue
        hints = get_type_hints(command.callback, include_extras=True)
        for hint in hints.values():
            for option in getattr(hint, "__metadata__", ()):
                if isinstance(option, OptionInfo) and option.metavar is None:
                    option.metavar = next((_WORDS[kind] for kind in _kinds(hint) if kind in _WORDS), None)
        # evaluated here once, or the words would be lost
        command.callback.__annotations__ = hints
    for group in app.registered_groups:
        if group.typer_instance is not None:
            name_values(group.typer_instance)


def _kinds(hint: Any) -> Iterator[Any]:
    """Yield the types within an annotation, those of its lists and choices too."""
    yield hint
    parts = get_args(hint)
    for part in parts[:1] if get_origin(hint) is Annotated else parts:
        yield from _kinds(part)
