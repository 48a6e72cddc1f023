"""Words for what was wrong with a person's input, shared by all readers."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from pydantic import ValidationError


def validation_sentences(error: ValidationError) -> list[str]:
    """Turn pydantic's findings into short sentences, "field: what is wrong".

    Parameters
    ----------
    error : ValidationError

    Returns
    -------
    list of str
        One entry a finding.
    """
    sentences = []
    for finding in error.errors(include_url=False, include_context=False):
        # Tags of unions ("film") are pydantic's, not the person's: keep field names and positions only.
        where = ".".join(str(part) for part in finding["loc"])
        what = finding["msg"].removeprefix("Value error, ")
        what = what[:1].lower() + what[1:]
        given = finding.get("input")
        if isinstance(given, bool | int | float | str) and not where.endswith(repr(given)):
            what += f", not {shorten(given)}"
        sentences.append(f"{where}: {what}" if where else what)
    return sentences


def shorten(value: object, limit: int = 60) -> str:
    """Return `repr(value)`, cut in the middle when it is long."""
    text = repr(value)
    return text if len(text) <= limit else f"{text[: limit - 12]} ... {text[-6:]}"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return '; did you mean "x"?' for a misspelt word, or nothing."""
    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"; did you mean {near[0]!r}?" if near else ""


def count(number: int, noun: str, plural: str | None = None) -> str:
    """Return "1 row" or "3 rows"."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def summary(where: str, problems: list[str]) -> str:
    """Say in one sentence what is wrong with a file.

    Parameters
    ----------
    where : str
        The file.
    problems : list of str
        At least one.

    Returns
    -------
    str
    """
    if len(problems) == 1:
        return f"{where}: {problems[0]}"
    return f"{where} has {count(len(problems), 'problem')}, the first: {problems[0]}"
