"""Requests and messages of sockets: JSON objects of bounded depth with finite numbers, and why one failed."""

from __future__ import annotations

import json
import math
import traceback
from typing import Any

from ...errors import FlarewrightError
from ..session.image_files import in_short
from ..session.session import Session

CROWDED = "the editor has too many unanswered requests; try again in a moment"

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


def why_failed(error: Exception, session: Session) -> str:
    """Return one sentence on why a request failed."""
    if isinstance(error, FlarewrightError):
        return in_short(str(error), session.project, session.file)
    if not isinstance(error, ValueError | LookupError | TypeError | ArithmeticError | AttributeError | OSError):
        # a bug, which a page can cause but not mend
        traceback.print_exception(error)
    return f"the editor did not understand the page: {brief(str(error) or type(error).__name__)}"
