"""Pictures of the library: every lens with its photographic defaults, every look with its demonstration scene."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, degrees
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..io.lens.library import library_names
from ..io.project.look_file import read_look, shipped_looks
from ..model import Camera, Light, Project
from ..optics.lens.paraxial import first_order
from .image.display import layers_exposure, view
from .render import render
from .scene.looks import demonstration
from .scene.photographic_defaults import as_photographed
from .scene.resolve import open_lens

PLACE_MM = (-7.92, 4.37)
"""Position of the light's direct image in the picture of a lens: up and left, so that ghosts cross the centre."""

Kind = Literal["lens", "look"]


@dataclass(frozen=True)
class Card:
    """A picture of the library.

    Attributes
    ----------
    kind : {"lens", "look"}
    name : str
        The name that commands take.
    title, caption : str
        Text below the picture.
    command : str
        The command line that renders it.
    """

    kind: Kind
    name: str
    title: str
    caption: str
    command: str


def cards() -> tuple[Card, ...]:
    """Return the pictures of the library: lenses, then looks, each sorted by name."""
    return (*(lens_card(name) for name in library_names()), *(_look_card(name) for name in shipped_looks()))


def card_project(card: Card, size_px: tuple[int, int]) -> Project:
    """Return the project of a picture of the library.

    Raises
    ------
    ProjectError
        There is no such look.
    """
    if card.kind == "look":
        return demonstration(read_look(card.name), size_px)
    lens = open_lens(card.name).lens
    camera = Camera(size_px=size_px, desqueeze=lens.squeeze is not None)
    lights = (Light(field_deg=light_place(card.name)),)
    return as_photographed(Project(lens=card.name, lights=lights, camera=camera))[0]


def light_place(name: str) -> tuple[float, float]:
    """Return the field angles, degrees, at which a lens images a light at `PLACE_MM`, rounded to 0.01 degree."""
    efl = first_order(open_lens(name).lens).efl
    x, y = (round(degrees(atan(mm / efl)), 2) for mm in PLACE_MM)
    return x, y


def card_picture(card: Card, size_px: tuple[int, int]) -> NDArray[np.uint8]:
    """Render a picture of the library.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8
        sRGB. Rings in ghosts are off: they are not visible at this size.
    """
    project = card_project(card, size_px)
    drawn = render(project.replace(quality=project.quality.replace(ringing="off")))
    return view(drawn.layers[0].pixels, layers_exposure(drawn.layers))


def lens_card(name: str) -> Card:
    """Return the picture of a lens by its name."""
    lens = open_lens(name).lens
    x, y = light_place(name)
    wide = " --desqueeze" if lens.squeeze is not None else ""
    command = f"flarewright render {name} --light {x:g},{y:g}{wide} -o {name}.exr"
    return Card("lens", name, lens.name, f"{len(lens.rows) - 1} surfaces, {lens.source}", command)


def _look_card(name: str) -> Card:
    look = read_look(name)
    return Card("look", name, look.name, look.notes, f"flarewright render --look {name} -o {name}.exr")
