"""Values that a reader would take for something else than what was written: `true` for 1, "5" for 5, 1 for `true`.

Records take them, for a program may hand over what it has; in a file they are a slip of the pen more often than not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from .sentences import Keys, place, shorten, validation_sentences

Record = TypeVar("Record")


def record_of(
    read: Callable[[Any], Record], data: Any, say: Callable[[ValidationError], list[str]] | None = None
) -> tuple[Record | None, list[str]]:
    """Make a record of what a file holds, every value as it was written.

    Parameters
    ----------
    read : callable
        Makes the record, or raises ValidationError.
    data : object
        As read from the file.
    say : callable, optional
        Turns what was raised into sentences; None: `validation_sentences`.

    Returns
    -------
    record : object or None
        None when something is wrong.
    problems : list of str
        What is wrong, one sentence each.
    """
    try:
        record = read(data)
    except ValidationError as error:
        return None, validation_sentences(error, data) if say is None else say(error)
    problems = taken_for_another(data, record)
    return (None, problems) if problems else (record, [])


def taken_for_another(data: Any, record: Any) -> list[str]:
    """List the values that a record holds as another kind than a file has them.

    Parameters
    ----------
    data : object
        As read from the file.
    record : object
        What a reader made of it: a record, or a list or table of them. Where its form differs from that of `data`
        nothing is compared.

    Returns
    -------
    list of str
        Like "iris.blades should be a whole number, not true".
    """
    return [
        f"{place(keys)} should be {wanted}, not {shorten(value)}" for keys, value, wanted in _found([], data, record)
    ]


def _found(keys: Keys, data: Any, record: Any) -> Iterator[tuple[Keys, Any, str]]:
    if isinstance(data, dict):
        held = dict(record) if isinstance(record, BaseModel | dict) else {}
        for key, value in data.items():
            if key in held:
                yield from _found([*keys, key], value, held[key])
    elif isinstance(data, list | tuple):
        if isinstance(record, list | tuple) and len(record) == len(data):
            for k, (value, taken) in enumerate(zip(data, record, strict=True)):
                yield from _found([*keys, k], value, taken)
    elif isinstance(record, bool):
        if not isinstance(data, bool):
            yield keys, data, "true or false"
    elif isinstance(record, int | float) and isinstance(data, bool | str):
        yield keys, data, "a whole number" if isinstance(record, int) else "a number"
