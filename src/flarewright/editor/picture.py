"""A picture for the viewport."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..model import Project

Floats = NDArray[np.float32]
Grade = Literal["moving", "draft", "soon", "final", "working"]


@dataclass(frozen=True)
class Picture:
    """A rendered picture, linear.

    Attributes
    ----------
    project : Project
        That it shows.
    grade : {"moving", "draft", "soon", "final", "working"}
    ghosts, rest : ndarray, shape (H, W, 3)
        The ghosts, and everything else: starburst and scatter.
    seconds : float
        It took.
    remarks : tuple of str
    grey : bool
        Every ghost reflects alike, so that its brightness is none of the lens'.
    """

    project: Project
    grade: Grade
    ghosts: Floats
    rest: Floats
    seconds: float
    remarks: tuple[str, ...] = ()
    grey: bool = False

    @property
    def ghost_light(self) -> NDArray[np.float64]:
        """Mean of the ghosts, R, G, B."""
        return np.asarray(self.ghosts.mean(axis=0, dtype=np.float64).mean(axis=0))
