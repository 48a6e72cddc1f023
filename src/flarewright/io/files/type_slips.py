"""Detect values of the wrong TOML type that pydantic would convert silently: `true` for 1, "5" for 5, 1 for `true`.

Records accept such values from Python code; in a file they are most likely errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from ...sentences import Keys, did_you_mean, key_place, shorten, validation_sentences

Record = TypeVar("Record")

MOST_ERRORS = 1000
"""Largest number of errors that are all described."""
_FIRST_ENTRIES, _FIRST_KEYS = 20, 200


def record_of(
    read: Callable[[Any], Record], data: Any, say: Callable[[ValidationError], list[str]] | None = None
) -> tuple[Record | None, list[str]]:
    """Make a record of a file's contents without type conversion.

    Parameters
    ----------
    read : callable
        Makes the record or raises ValidationError.
    data : object
        As read from the file.
    say : callable, optional
        Turns a ValidationError into sentences; None: `validation_sentences`.

    Returns
    -------
    record : object or None
        None when there are problems.
    problems : list of str
        One sentence each.
    """
    try:
        record = read(data)
    except ValidationError as error:
        number = error.error_count()
        if number > MOST_ERRORS:
            # every error is an object of a kilobyte: describe those of the first entries only
            shorter, total = _first_entries(data), f"it has {number} errors in all"
            try:
                read(shorter)
            except ValidationError as first:
                found = validation_sentences(first, shorter, _nearest(read)) if say is None else say(first)
                return None, [*found, total]
            return None, [total]
        return None, validation_sentences(error, data, _nearest(read)) if say is None else say(error)
    # like "iris.blades should be a whole number, not true"
    problems = [
        f"{key_place(keys)} should be {wanted}, not {shorten(value)}"
        for keys, value, wanted in _type_differences([], data, record)
    ]
    return (None, problems) if problems else (record, [])


def _first_entries(data: Any) -> Any:
    """Return the data with every list and table cut to its first entries."""
    if isinstance(data, dict):
        return {key: _first_entries(value) for key, value in islice(data.items(), _FIRST_KEYS)}
    if isinstance(data, list):
        return [_first_entries(value) for value in data[:_FIRST_ENTRIES]]
    return data


def _nearest(read: Callable[[Any], Any]) -> Callable[[Keys], str]:
    """Return a function that suggests the nearest key of a record for an unknown one."""
    known = tuple(getattr(getattr(read, "__self__", None), "model_fields", ()))
    return lambda keys: did_you_mean(str(keys[-1]), known) if keys else ""


def _type_differences(keys: Keys, data: Any, record: Any) -> Iterator[tuple[Keys, Any, str]]:
    """Yield place, value and expected type of each value of a file whose type in the record differs."""
    if isinstance(data, dict):
        held = dict(record) if isinstance(record, BaseModel | dict) else {}
        for key, value in data.items():
            if key in held:
                yield from _type_differences([*keys, key], value, held[key])
    elif isinstance(data, list | tuple):
        if isinstance(record, list | tuple) and len(record) == len(data):
            for k, (value, taken) in enumerate(zip(data, record, strict=True)):
                yield from _type_differences([*keys, k], value, taken)
    elif isinstance(record, bool):
        if not isinstance(data, bool):
            yield keys, data, "true or false"
    elif isinstance(record, int | float) and isinstance(data, bool | str):
        yield keys, data, "a whole number" if isinstance(record, int) else "a number"
