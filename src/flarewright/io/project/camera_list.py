"""Cameras by name: active areas of sensors and film, with their pixels and their sources."""

from __future__ import annotations

import difflib
import re
from functools import cache
from importlib.resources import files

from pydantic import Field

from ...errors import ProjectError
from ...model.base import Frozen
from ..files.text_file import read_toml


class CameraFormat(Frozen):
    """The active area of a camera.

    Attributes
    ----------
    name : str
        Of `--sensor`.
    title : str
    sensor_mm : tuple of float
        Width and height.
    size_px : tuple of int or None
        Recorded pixels; None for film and for sizes that many cameras share.
    source : str
    """

    name: str = Field(pattern=r"^[a-z0-9.-]+$")
    title: str
    sensor_mm: tuple[float, float]
    size_px: tuple[int, int] | None = None
    source: str = Field(min_length=1)


@cache
def camera_formats() -> tuple[CameraFormat, ...]:
    """Return all known cameras, in the order of the data file.

    Examples
    --------
    >>> camera_formats()[0].name
    'arri-alexa-35'
    """
    data = read_toml(str(files("flarewright").joinpath("io/data/cameras.toml")), "the list of cameras")
    return tuple(CameraFormat.model_validate(entry) for entry in data["cameras"])


def is_camera_name(text: str) -> bool:
    """Return whether a text is meant as the name of a camera, and not as a size like 36x24."""
    try:
        for side in text.lower().replace("×", "x").split("x"):
            float(side)
    except ValueError:
        return re.search(r"[a-wyz]", text.lower()) is not None
    return False


def camera_format(name: str) -> CameraFormat:
    """Return a camera by its name; case, spaces and underscores do not matter.

    Raises
    ------
    ProjectError
        There is no such camera; the message suggests near names.

    Examples
    --------
    >>> camera_format("ARRI Alexa LF").sensor_mm
    (36.7, 25.54)
    """
    key = re.sub(r"[\s_]+", "-", name.strip().lower())
    known = {camera.name: camera for camera in camera_formats()}
    if key in known:
        return known[key]
    near = difflib.get_close_matches(key, known, 3) or [each for each in known if key in each][:3]
    hint = f"did you mean {' or '.join(near)}? " if near else ""
    raise ProjectError(
        f"--sensor {name!r} is no known camera; {hint}flarewright cameras lists them, --sensor 36x24 is a size in mm"
    )
