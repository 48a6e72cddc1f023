"""Some of many, evenly spread."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")


def evenly(items: Sequence[Item], most: int) -> list[Item]:
    """Return all items, or so many of them, evenly spread from the first to the last.

    Parameters
    ----------
    items : sequence
    most : int
        At least 2, or of more items only the first is returned.
    """
    return [items[int(k)] for k in np.linspace(0, len(items) - 1, min(most, len(items))).round()]
