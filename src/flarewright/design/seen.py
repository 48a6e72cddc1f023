"""From ghosts that were seen, in a photograph or a measured flare, to a project that wants them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import ProjectError
from ..model import Camera, Light, Project
from ..model.design import Bounds, Design, GhostWish

# the lens shall have the focal length that the picture was taken with, to this part
FOCAL_PART = 0.02


@dataclass(frozen=True)
class SeenGhost:
    """A ghost as a picture shows it.

    Attributes
    ----------
    place_mm : float
        Of its centre on the sensor, on the line from the middle towards the light.
    radius_mm : float
    rgb : tuple of float
        Radiance.
    """

    place_mm: float
    radius_mm: float
    rgb: tuple[float, float, float]


def seen_project(
    lights: Sequence[tuple[tuple[float, float], Sequence[SeenGhost]]],
    *,
    size_px: tuple[int, int],
    sensor_mm: tuple[float, float],
    focal_mm: float | None = None,
    lens: str = "heliar-tronnier",
) -> Project:
    """Make a project that wants ghosts that were seen, and only these.

    Parameters
    ----------
    lights : sequence of (field angles in degrees, ghosts seen there)
    size_px : tuple of int
    sensor_mm : tuple of float
    focal_mm : float, optional
        Of the camera; the designed lens shall have it, so that its pictures show the same field. None: any.
    lens : str
        Stands for its iris and place only.

    Returns
    -------
    Project
        Radii have no sign, for a disc does not tell which end is up.

    Raises
    ------
    ProjectError
        When no ghost was seen.
    """
    if not any(ghosts for _, ghosts in lights):
        raise ProjectError("no ghost was seen there, so there is nothing to aim at; try another light or picture")
    wishes = tuple(
        GhostWish(
            light=number if len(lights) > 1 else None, place_mm=round(one.place_mm, 4),
            radius_mm=max(round(one.radius_mm, 4), 1e-3),
            color=_hue(one.rgb),
        )
        for number, (_, ghosts) in enumerate(lights)
        for one in ghosts
    )  # fmt: skip
    bounds = Bounds()
    if focal_mm is not None:
        bounds = bounds.replace(focal_length=((1.0 - FOCAL_PART) * focal_mm, (1.0 + FOCAL_PART) * focal_mm))
    return Project(
        lens=lens, lights=tuple(Light(field_deg=angles) for angles, _ in lights),
        camera=Camera(size_px=size_px, sensor_mm=sensor_mm),
        design=Design(own_ghosts=False, signed=False, wishes=wishes, bounds=bounds),
    )  # fmt: skip


def _hue(rgb: tuple[float, float, float]) -> tuple[float, float, float] | None:
    most = max(rgb)
    if not most > 0.0:
        return None
    red, green, blue = (round(part / most, 4) for part in rgb)
    return red, green, blue
