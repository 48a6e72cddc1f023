"""A rendered picture for the viewport."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...model import Project
from ...typing import Floats, Pixels
from ..common.light_names import with_light_names

# lengths in pixels of the rendered picture: "53 px left of", "396.2 pixels wide"
_LENGTH = re.compile(r"\b(\d+(?:\.\d+)?) (px (?:left|right|above|below)|pixels wide)\b")

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


def page_remarks(picture: DrawnPicture) -> tuple[str, ...]:
    """Return the remarks on a picture with the page's names of lights, and with lengths in pixels of the file.

    The picture has the size of the page, so the lengths are those of a render up to rounding.
    """
    scale = picture.project.camera.size_px[0] / picture.ghosts.shape[1]

    def of_file(found: re.Match[str]) -> str:
        return found[0] if scale == 1.0 else f"about {float(found[1]) * scale:.0f} {found[2]}"

    return tuple(_LENGTH.sub(of_file, with_light_names(words, picture.project)) for words in picture.remarks)
