"""Bodies of requests and messages of sockets: JSON objects of bounded depth with finite numbers."""

from __future__ import annotations

import json
import math
from typing import Any

# levels of lists and objects; the page sends five
DEEPEST = 20
QUOTED = 120


def object_of(raw: str | bytes) -> dict[str, Any]:
    """Return the JSON object of a body or a message.

    Parameters
    ----------
    raw : str or bytes
        Empty: no values.

    Returns
    -------
    dict of str to object

    Raises
    ------
    ValueError
        When it is no JSON object, lists or objects are nested too deeply, or a number is not finite.
    """
    if not raw:
        return {}
    try:
        found = json.loads(raw)
    except RecursionError:
        raise ValueError(f"lists and objects are nested more than {DEEPEST} deep") from None
    if not isinstance(found, dict):
        raise ValueError(f"expected an object, got {brief(found)}")
    _check(found)
    return found


def _check(found: Any) -> None:
    level = [found]
    for _ in range(DEEPEST):
        if any(isinstance(one, float) and not math.isfinite(one) for one in level):
            raise ValueError("a number is not finite")
        level = [
            inner
            for one in level
            if isinstance(one, dict | list)
            for inner in (one.values() if isinstance(one, dict) else one)
        ]
        if not level:
            return
    raise ValueError(f"lists and objects are nested more than {DEEPEST} deep")


def brief(value: object) -> str:
    """Return a value in one line of at most `QUOTED` characters."""
    text = " ".join((value if isinstance(value, str) else repr(value)).split())
    return text if len(text) <= QUOTED else f"{text[: QUOTED - 1]}…"
