"""A matte of ghosts: which of them light each pixel, brightest first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..typing import Pixels


@dataclass(frozen=True)
class GhostMatte:
    """The brightest objects of each pixel, and their luminance.

    Attributes
    ----------
    names : tuple of str
        Objects: ghosts by the names of their paths, such as "7-3", and "starburst" and "scatter".
    objects : ndarray, shape (ranks, height, width), int32
        Indices of `names`, brightest first at each pixel; -1: no further object.
    light : ndarray, shape (ranks, height, width), float32
        Their luminance, in the unit of the layers; 0 where there is no object.
    total : ndarray, shape (height, width), float32
        Luminance of all objects, those without a rank as well; at least the sum of `light`.
    """

    names: tuple[str, ...]
    objects: NDArray[np.int32]
    light: Pixels
    total: Pixels

    def share(self, name: str) -> Pixels:
        """Return the part of the light of each pixel that an object has, shape (height, width); 0 without a rank."""
        return np.asarray(np.where(self.objects == self.names.index(name), self.coverage, 0.0).sum(axis=0))

    @property
    def coverage(self) -> Pixels:
        """Parts of the light of each pixel, shape (ranks, height, width), float32; their sum is at most 1."""
        lit = self.total > 0.0
        return np.asarray(np.divide(self.light, self.total, out=np.zeros_like(self.light), where=lit))
