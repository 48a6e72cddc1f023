"""Evenly spaced items of a sequence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")


def evenly_spaced(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most `most` items, evenly spaced from the first to the last.

    Parameters
    ----------
    items : sequence
    most : int
        At least 2; 1 returns the first item.
    """
    return [items[int(k)] for k in np.linspace(0, len(items) - 1, min(most, len(items))).round()]
