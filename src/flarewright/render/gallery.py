"""The library in pictures: every lens as photographed, every look on its own stage."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, degrees
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..io.library import shipped
from ..io.look_file import read_look, shipped_looks
from ..model import Camera, Light, Project
from .display import layers_exposure, view
from .looks import shown
from .photographed import as_photographed
from .prepare import first_order, load_lens
from .render import render

PLACE_MM = (-7.92, 4.37)
"""Where a light's direct image lies in the picture of a lens: up and left, so that ghosts cross the middle."""

Kind = Literal["lens", "look"]


@dataclass(frozen=True)
class Card:
    """A picture of the library.

    Attributes
    ----------
    kind : {"lens", "look"}
    name : str
        As commands take it.
    title, caption : str
        What a person reads below the picture.
    command : str
        What renders it.
    """

    kind: Kind
    name: str
    title: str
    caption: str
    command: str


def cards() -> tuple[Card, ...]:
    """Return the pictures of the library, lenses before looks, each by name."""
    return (*(_lens_card(name) for name in shipped()), *(_look_card(name) for name in shipped_looks()))


def card_project(card: Card, size_px: tuple[int, int]) -> Project:
    """Return what a picture of the library shows.

    Parameters
    ----------
    card : Card
    size_px : tuple of int

    Returns
    -------
    Project

    Raises
    ------
    ProjectError
        When there is no such look.
    """
    if card.kind == "look":
        return shown(read_look(card.name), size_px)
    lens = load_lens(card.name)
    camera = Camera(size_px=size_px, desqueeze=lens.squeeze is not None)
    lights = (Light(field_deg=light_place(card.name)),)
    return as_photographed(Project(lens=card.name, lights=lights, camera=camera))[0]


def light_place(name: str) -> tuple[float, float]:
    """Return the field angles, degrees, at which a lens images a light at `PLACE_MM`, to a hundredth."""
    efl = first_order(load_lens(name)).efl
    x, y = (round(degrees(atan(mm / efl)), 2) for mm in PLACE_MM)
    return x, y


def card_picture(card: Card, size_px: tuple[int, int]) -> NDArray[np.uint8]:
    """Render a picture of the library.

    Parameters
    ----------
    card : Card
    size_px : tuple of int

    Returns
    -------
    ndarray, shape (H, W, 3), uint8
        sRGB; without rings in ghosts, which small pictures do not show.
    """
    project = card_project(card, size_px)
    drawn = render(project.replace(quality=project.quality.replace(ringing="off")))
    return view(drawn.layers[0].pixels, layers_exposure(drawn.layers))


def _lens_card(name: str) -> Card:
    lens = load_lens(name)
    x, y = light_place(name)
    wide = " --desqueeze" if lens.squeeze is not None else ""
    command = f"flarewright render {name} --light {x:g},{y:g}{wide} -o {name}.exr"
    return Card("lens", name, lens.name, f"{len(lens.rows) - 1} surfaces, {lens.source}", command)


def _look_card(name: str) -> Card:
    look = read_look(name)
    return Card("look", name, look.name, look.notes, f"flarewright render --look {name} -o {name}.exr")
