"""A rendered picture for the viewport."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...model import Project
from ...typing import Floats, Pixels

Grade = Literal["moving", "draft", "soon", "final", "working"]


@dataclass(frozen=True)
class DrawnPicture:
    """A rendered picture, linear.

    Attributes
    ----------
    project : Project
        The rendered project.
    grade : {"moving", "draft", "soon", "final", "working"}
    ghosts, rest : ndarray, shape (H, W, 3)
        The ghosts, and all other light: starburst and scatter.
    seconds : float
        Render time.
    remarks : tuple of str
    haze : ndarray, shape (H, W, 3), or None
        The part of `rest` that is no image of a light: scatter. None: there is none.
    grey : bool
        All surfaces reflect alike, so the brightness of ghosts is not that of the lens.
    """

    project: Project
    grade: Grade
    ghosts: Pixels
    rest: Pixels
    seconds: float
    remarks: tuple[str, ...] = ()
    grey: bool = False
    haze: Pixels | None = None

    @property
    def ghost_light(self) -> Floats:
        """Mean of the ghosts, R, G, B."""
        return np.asarray(self.ghosts.mean(axis=0, dtype=np.float64).mean(axis=0))
