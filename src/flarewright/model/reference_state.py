"""What a reference render has gathered so far: enough to go on later as if it had never stopped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .project import Project


@dataclass(frozen=True)
class ReferenceState:
    """Sums over the finished batches of a reference render.

    Attributes
    ----------
    project : Project
        What is rendered.
    fingerprints : dict of str to str
        A digest of each part of what decides the samples; two states of equal digests belong to the same random rays.
    batches : int
        Finished batches, numbered from 0.
    sums, squares : dict of str to ndarray
        By figure: the sum over batches of the batch's value, and of its square.
    """

    project: Project
    fingerprints: dict[str, str]
    batches: int
    sums: dict[str, NDArray[np.float64]]
    squares: dict[str, NDArray[np.float64]]
