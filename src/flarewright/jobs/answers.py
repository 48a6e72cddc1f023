"""Answers of processes that work off items, and what the caller makes of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import FlarewrightError


@dataclass(frozen=True)
class Done:
    """A finished item.

    Attributes
    ----------
    item : object
    result : object
        What the function returned.
    """

    item: Any
    result: Any


def result_of(item: Any, answer: tuple[Any, ...], what: str) -> Any:
    """Return the result in an answer of `worker.attempt`, or raise its error.

    Parameters
    ----------
    item : object
    answer : tuple
    what : str
        What an item is, for messages.

    Raises
    ------
    FlarewrightError
        The function raised one.
    MemoryError
        The process has no memory for the item.
    RuntimeError
        Any other exception of the function, with its traceback.

    Examples
    --------
    >>> result_of(3, ("done", 5.0), "frame")
    5.0
    """
    match answer:
        case ("done", result):
            return result
        case ("refused", sentence, problems):
            raise FlarewrightError(sentence, problems)
        case ("memory",):
            raise MemoryError
        case _:
            raise RuntimeError(f"{what} {item}: {answer[-1]}")
