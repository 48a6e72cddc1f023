"""Progress of work in several parts, one after the other, as that of one piece of work."""

from __future__ import annotations

from collections.abc import Mapping

from ..typing import Progress


def progress_parts(progress: Progress | None, weights: Mapping[str, float]) -> dict[str, Progress | None]:
    """Return the callback of each part.

    Parameters
    ----------
    progress : callable or None
        Of the whole work.
    weights : mapping of str to float
        Parts in their order, with their time in any unit.

    Returns
    -------
    dict of str to callable or None
        Each takes the finished fraction of its part, and calls `progress` with that of the whole.

    Examples
    --------
    >>> parts = progress_parts(lambda done, what: print(f"{done:.2f} {what}"), {"search": 1.0, "draw": 3.0})
    >>> parts["search"](0.5, "searching"), parts["draw"](1.0, "drawing")
    0.12 searching
    1.00 drawing
    (None, None)
    """
    if progress is None:
        return dict.fromkeys(weights)
    whole, before, found = sum(weights.values()), 0.0, dict[str, Progress | None]()
    for name, weight in weights.items():
        found[name] = _between(progress, before / whole, (before + weight) / whole)
        before += weight
    return found


def _between(progress: Progress, start: float, end: float) -> Progress:
    return lambda part, words: progress(start + (end - start) * part, words)
