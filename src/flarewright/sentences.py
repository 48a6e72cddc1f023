"""Error sentences for invalid input, shared by all readers."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Sequence
from datetime import date, time
from typing import Any, cast, get_args

from pydantic import BaseModel, ValidationError

from .errors import RecordError

Keys = list[int | str]
"""Path of a value in a file: ["lights", 0, "field_deg"]."""
Finding = dict[str, Any]
"""One error of pydantic: type, loc, msg, input and ctx."""

INVALID = (ValidationError, RecordError)
"""What an invalid record raises: `model_validate` the first, its class and `replace` the second."""

_NUMBER, _INTEGER, _TEXT, _LIST, _TABLE = "a number", "a whole number", "a text in quotes", "a list", "a table"
_TIME = "a date with a time and its zone, like 2024-06-21T18:00:00+02:00"

# expected value by pydantic's error type; other types state their bound in the message
_EXPECTED = {
    "bool_type": "true or false", "bool_parsing": "true or false",
    "int_type": _INTEGER, "int_parsing": _INTEGER, "int_from_float": _INTEGER,
    "int_parsing_size": "a whole number of fewer digits",
    "float_type": _NUMBER, "float_parsing": _NUMBER, "finite_number": "a finite number",
    "string_type": _TEXT, "string_unicode": _TEXT, "string_too_short": "a text that is not empty",
    "string_too_long": "a text of at most {max_length} characters",
    "string_pattern_mismatch": "two rows like 7-3",
    "tuple_type": _LIST, "list_type": _LIST, "set_type": _LIST, "frozen_set_type": _LIST,
    "dict_type": _TABLE, "model_type": _TABLE, "model_attributes_type": _TABLE, "mapping_type": _TABLE,
    "none_required": "left out",
    "datetime_type": _TIME, "datetime_parsing": _TIME, "datetime_from_date_parsing": _TIME,
    "datetime_object_invalid": _TIME, "timezone_naive": _TIME,
}  # fmt: skip

_BOUNDS = {
    "greater_than": ("greater than", "gt"), "greater_than_equal": ("greater than or equal to", "ge"),
    "less_than": ("less than", "lt"), "less_than_equal": ("less than or equal to", "le"),
}  # fmt: skip

_LONGEST_KEY = 100

# exact lengths of places, sizes and colours; longer limits are upper bounds
_FIXED_LENGTHS = (2, 3)

# findings of a value where a file has a table, or several
_TABLES = ("model_type", "model_attributes_type", "union_tag_not_found", "tuple_type")
_NOT_KNOWN = "is not a known"
# fields of a record that a sentence lists
_MOST_LISTED = 6

# lists whose entries have separate headings in TOML
_HEADINGS = {
    "lights": "[[lights]]", "cameras": "[[cameras]]", "rules": "[[art.rules]]",
    "ghost_targets": "[[design.ghost_targets]]",
}  # fmt: skip


def validation_sentences(
    error: ValidationError | RecordError, data: Any = None, unknown: Callable[[Keys], str] = lambda _: ""
) -> list[str]:
    """Turn the errors of an invalid record into sentences for the user; this module alone reads pydantic's messages.

    Parameters
    ----------
    error : ValidationError or RecordError
        A RecordError has its sentences already.
    data : object, optional
        The validated data; names places as the file does. None: names of the record's fields.
    unknown : callable, optional
        Returns a suggestion for an unknown key.

    Returns
    -------
    list of str
        One entry per place and error: "iris.blades should be a whole number, not 'six'".
    """
    if isinstance(error, RecordError):
        return list(error.problems)
    return _sentences(error, data, unknown)


def record_sentences(error: ValidationError, record: type[BaseModel], fields: dict[str, Any]) -> list[str]:
    """Return the sentences on a record that a Python program makes, in words of Python.

    Parameters
    ----------
    error : ValidationError
    record : type of BaseModel
    fields : dict of str to object
        Its arguments.

    Returns
    -------
    list of str
        Unknown names first, as a misspelt field is also a missing one.
    """
    known = tuple(record.model_fields)

    def suggestion(keys: Keys) -> str:
        listed = f"; known are {', '.join(known)}" if len(known) <= _MOST_LISTED else ""
        return (did_you_mean(str(keys[0]), known) or listed) if len(keys) == 1 else ""

    return sorted(_sentences(error, fields, suggestion, record), key=lambda each: _NOT_KNOWN not in each)


def _sentences(
    error: ValidationError, data: Any, unknown: Callable[[Keys], str], record: type[BaseModel] | None = None
) -> list[str]:
    """Return the sentences on an error; in words of Python if its record is given."""
    # expected values by place: in a union each member reports a separate error
    found: dict[tuple[str, str], list[str]] = {}
    for finding in cast(list[Finding], error.errors(include_url=False)):
        if record and (alone := _record_alone(finding, data)):
            found.setdefault((f"{alone} should be a list: write {alone}=[...]", ""), [])
            continue
        if finding["type"] == "too_short" and finding.get("ctx", {}).get("actual_length") != len(finding["input"]):
            continue  # its items have separate errors
        keys = list(finding["loc"]) if data is None else _keys_in_file(finding["loc"], data, finding["type"])
        where = key_place(keys)
        match finding["type"]:
            case "missing":
                heading = None if record else _HEADINGS.get(str(keys[-1]))
                remedy = f": add at least one {heading}" if heading else ""
                found.setdefault((f"{where} is missing{remedy}", ""), [])
            case "extra_forbidden":
                found.setdefault((f"{where} {_NOT_KNOWN} {'field' if record else 'key'}{unknown(keys)}", ""), [])
            case "value_error":
                reason = finding["msg"].removeprefix("Value error, ")
                found.setdefault((f"{where}: {reason}" if where else reason, ""), [])
            case _:
                choices = found.setdefault((where, _given_text(finding)), [])
                wanted = (record and _expected_record(finding, keys, record)) or _expected_text(finding, keys)
                choices += [wanted] if wanted not in choices else []
    return [
        f"{start} should be {' or '.join(choices)}{given}".strip() if choices else start
        for (start, given), choices in found.items()
    ]


def _record_alone(finding: Finding, fields: dict[str, Any]) -> str:
    """Return the field that has one record where a list of records is expected; pydantic lists its values."""
    # an error of the whole record has no place
    field, *inside = finding["loc"] or ("",)
    listed = isinstance(inside[0], int) if inside else finding["type"] == "too_short"
    return str(field) if listed and isinstance(fields.get(field), BaseModel) else ""


def _expected_record(finding: Finding, keys: Keys, record: type[BaseModel]) -> str:
    """Return the records that a Python program can give at a place: "a Camera"; "" for a place of other values."""
    if finding["type"] not in _TABLES:
        return ""
    records = [record]
    for key in keys:
        if isinstance(key, str):
            fields = [one.model_fields[key].annotation for one in records if key in one.model_fields]
            records = [each for annotation in fields for each in _records_of(annotation)]
    names = " or ".join(", ".join(each.__name__ for each in records).rsplit(", ", 1))
    listed = "a list of " if finding["type"] == "tuple_type" else "an " if names[:1] in "AEIO" else "a "
    return f"{listed}{names}" if names else ""


def _records_of(annotation: Any) -> list[type[BaseModel]]:
    """Return the records that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return list(dict.fromkeys(each for part in get_args(annotation) for each in _records_of(part)))


def _expected_text(finding: Finding, keys: Keys) -> str:
    """Return the description of the expected value."""
    kind, about = finding["type"], finding.get("ctx", {})
    if kind in _BOUNDS:
        words, name = _BOUNDS[kind]
        bound = about[name]
        # %g, because 1e9 is easier to read than ten digits
        return f"{words} {f'{bound:g}' if isinstance(bound, float) else bound}"
    match kind:
        case "tuple_type" if keys and keys[-1] in _HEADINGS:
            return f"tables, each under {_HEADINGS[str(keys[-1])]}"
        case "too_short":
            return f"a list of at least {about['min_length']}"
        case "too_long":
            return f"a list of {'' if about['max_length'] in _FIXED_LENGTHS else 'at most '}{about['max_length']}"
        case "literal_error":
            return str(about["expected"])
        case "union_tag_invalid":
            return f"a table whose {_tag(about)} is {' or '.join(str(about['expected_tags']).rsplit(', ', 1))}"
        case "union_tag_not_found":
            return f"a table that begins with its {_tag(about)}"
    return _EXPECTED.get(kind, "something else").format(**about)


def _tag(about: dict[str, Any]) -> str:
    return str(about["discriminator"]).strip("'")


def _given_text(finding: Finding) -> str:
    """Return a description of the given value, or "" when it does not help."""
    value = finding["input"]
    match finding["type"]:
        case "too_short" | "too_long" | "string_too_long":
            return f", not {len(value)}"
        case "union_tag_invalid":
            return f", not {shorten(value[_tag(finding['ctx'])])}"
        case "union_tag_not_found" if isinstance(value, dict):
            return ""
    if isinstance(value, BaseModel):
        return ""
    if isinstance(value, dict):
        return ", not a table"
    return ", not a list" if isinstance(value, list | tuple) else f", not {shorten(value)}"


def _keys_in_file(loc: tuple[int | str, ...], data: Any, kind: str) -> Keys:
    """Remove union tags, which pydantic inserts and the file does not contain, from a path."""
    keys: Keys = []
    for position, key in enumerate(loc):
        if isinstance(data, BaseModel):
            data = dict(data)
        if (isinstance(data, dict) and key in data) or (
            isinstance(data, list | tuple) and isinstance(key, int) and key < len(data)
        ):
            keys.append(key)
            data = data[cast(Any, key)]
        elif kind == "missing" and position == len(loc) - 1:
            keys.append(key)
    return keys


def key_place(keys: Keys) -> str:
    """Return a path in a file as text: "lights[0].field_deg"."""
    text = ""
    for key in keys:
        part = f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
        text += part if len(part) <= _LONGEST_KEY else f"{part[:_LONGEST_KEY]} ..."
    return text


def written(value: object) -> str:
    """Return a value as the file spells it: `true`, `2024-06-21`, `{ a = 1 }`, `null`."""
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case float() if float(short := f"{value:g}") == value:
            # 1e+09, not ten digits
            return short
        case date() | time():
            return value.isoformat()
        case list() | tuple():
            return f"[{', '.join(map(written, value))}]"
        case dict():
            return f"{{ {', '.join(f'{key} = {written(item)}' for key, item in value.items())} }}" if value else "{}"
    return repr(value)


def shorten(value: object) -> str:
    """Return a value as `written`, cut in the middle to 60 characters."""
    text = written(value)
    return text if len(text) <= 60 else f"{text[:48]} ... {text[-6:]}"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return '; did you mean "x"?' for a misspelt word, or nothing."""
    # a cutoff of 0.6 would suggest "holdout" for "colour"
    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.65)
    return f"; did you mean {near[0]!r}?" if near else ""


def listed(words: Sequence[str], most: int, noun: str = "") -> str:
    """Return "a, b, c", or "a, b and 3 more" beyond `most` words; "and 3 more gaps" with the noun "gaps"."""
    left = len(words) - most
    return ", ".join(words[:most]) + (f" and {left} more {noun}".rstrip() if left > 0 else "")


def count(number: int, noun: str, plural: str | None = None) -> str:
    """Return "1 row" or "3 rows"."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def summary(where: str, problems: list[str]) -> str:
    """Return one sentence on the problems of a file.

    Parameters
    ----------
    where : str
        The file's name.
    problems : list of str
        At least one.
    """
    if len(problems) == 1:
        return f"{where}: {problems[0]}"
    return f"{where} has {count(len(problems), 'problem')}, the first: {problems[0]}"
