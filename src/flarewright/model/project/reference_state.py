"""State of an interrupted reference render; resuming from it gives the same result as an uninterrupted run."""

from __future__ import annotations

from dataclasses import dataclass

from ...typing import Floats
from .project import Project


@dataclass(frozen=True)
class ReferenceState:
    """Sums over the finished batches of a reference render.

    Attributes
    ----------
    project : Project
        The rendered project.
    fingerprints : dict of str to str
        Digests of everything that determines the samples; states with equal digests share their random rays.
    batches : int
        Finished batches, numbered from 0.
    sums, squares : dict of str to ndarray
        By quantity: sum over batches of the batch value, and of its square.
    """

    project: Project
    fingerprints: dict[str, str]
    batches: int
    sums: dict[str, Floats]
    squares: dict[str, Floats]
