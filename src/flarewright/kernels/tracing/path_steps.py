"""The steps of a light path, one argument of the kernels."""

from __future__ import annotations

from typing import NamedTuple

from ...typing import Indices


class PathSteps(NamedTuple):
    """The steps of a light path, or of several paths with a common start.

    Attributes
    ----------
    rows, actions : ndarray, shape (S,), int64
        Row and action (REFRACT, REFLECT, STOP) of each step. For centred conics also KEEP and LAND, by which P paths
        with the same first steps trace these once (`optics.lens.paths.joined_path_steps`).
    """

    rows: Indices
    actions: Indices
