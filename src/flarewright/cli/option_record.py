"""Commands whose options are the fields of a record: one frozen dataclass a section of the help page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from functools import update_wrapper
from inspect import Parameter, Signature
from typing import Annotated, Any, TypeVar, get_origin, get_type_hints

Record = TypeVar("Record")


def with_options(kind: type[Record]) -> Callable[[Callable[[Record], None]], Callable[..., None]]:
    """Make a function of a record a command with an option for every annotated field.

    Parameters
    ----------
    kind : type
        A dataclass. A field `Annotated[T, typer.Option(...)]` is an option, in the order of the fields; a field without
        an annotation keeps its default. A list without a default is required; another missing list is empty.

    Returns
    -------
    callable
        Decorator.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import typer
    >>> @dataclass(frozen=True)
    ... class Options:
    ...     times: Annotated[int, typer.Option(help="How often.")] = 1
    >>> @with_options(Options)
    ... def greet(options: Options) -> None:
    ...     print("hello " * options.times)
    >>> greet(times=2)
    hello hello
    """
    hints = {
        name: hint
        for name, hint in get_type_hints(kind, include_extras=True).items()
        if get_origin(hint) is Annotated and hint.__metadata__
    }
    lists = {name for name, hint in hints.items() if get_origin(hint.__origin__) is list}
    parameters = [
        Parameter(
            each.name, Parameter.KEYWORD_ONLY, default=_default(each, each.name in lists), annotation=hints[each.name]
        )
        for each in fields(kind)  # type: ignore[arg-type]
        if each.name in hints
    ]

    def decorate(command: Callable[[Record], None]) -> Callable[..., None]:
        def run(**given: Any) -> None:
            command(kind(**{name: list(value or ()) if name in lists else value for name, value in given.items()}))

        update_wrapper(run, command)
        del run.__wrapped__  # type: ignore[attr-defined]
        run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = dict(hints)
        return run

    return decorate


def _default(field: Field[Any], is_list: bool) -> Any:
    """Return the default of an option; the empty parameter's for one that is required."""
    if field.default is MISSING and field.default_factory is MISSING:
        return Parameter.empty
    return None if is_list else field.default
