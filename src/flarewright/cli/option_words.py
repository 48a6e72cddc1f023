"""Placeholders of option values in help texts: NUMBER instead of the library's <float>."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
from typer.models import OptionInfo

# a switch takes no value
_WORDS = {bool: "", int: "N", float: "NUMBER", Path: "FILE", str: "TEXT"}


def name_values(app: typer.Typer) -> None:
    """Set a placeholder for every option without one.

    Parameters
    ----------
    app : Typer
        Modified: options of its commands and of the groups below it.
    """
    for command in (*app.registered_commands, app.registered_callback):
        if command is None or command.callback is None:
            continue
        hints = get_type_hints(command.callback, include_extras=True)
        for hint in hints.values():
            for option in getattr(hint, "__metadata__", ()):
                if isinstance(option, OptionInfo) and option.metavar is None:
                    option.metavar = next((_WORDS[kind] for kind in types_within(hint) if kind in _WORDS), None)
        # evaluate the annotation once and store it, or the change would be lost
        command.callback.__annotations__ = hints
    for group in app.registered_groups:
        if group.typer_instance is not None:
            name_values(group.typer_instance)


def types_within(hint: Any) -> Iterator[Any]:
    """Yield the types within an annotation, including those of lists and unions."""
    yield hint
    parts = get_args(hint)
    for part in parts[:1] if get_origin(hint) is Annotated else parts:
        yield from types_within(part)
