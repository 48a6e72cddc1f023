"""A project whose targets are ghosts seen in a photograph or in a measured flare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import ProjectError
from ...model import Camera, Light, Project
from ...model.project.design import Bounds, Design, GhostTarget

# tolerance of the lens' focal length around that of the picture, as a fraction
FOCAL_PART = 0.02


@dataclass(frozen=True)
class PhotoGhost:
    """A ghost as a picture shows it.

    Attributes
    ----------
    place_mm : float
        Position of its centre on the sensor, on the line from the middle towards the light.
    radius_mm : float
    rgb : tuple of float
        Radiance.
    """

    place_mm: float
    radius_mm: float
    rgb: tuple[float, float, float]


def seen_project(
    lights: Sequence[tuple[tuple[float, float], Sequence[PhotoGhost]]],
    *,
    size_px: tuple[int, int],
    sensor_mm: tuple[float, float],
    focal_mm: float | None = None,
) -> Project:
    """Return a project whose targets are the seen ghosts, and only these.

    Parameters
    ----------
    lights : sequence of (field angles in degrees, ghosts seen there)
    size_px : tuple of int
    sensor_mm : tuple of float
    focal_mm : float, optional
        Of the camera; the designed lens must match it, so that its pictures show the same field. None: any.

    Returns
    -------
    Project
        Radii have no sign, as a disc looks the same upright and inverted.

    Raises
    ------
    ProjectError
        When there are no ghosts.
    """
    if not any(ghosts for _, ghosts in lights):
        raise ProjectError("no ghost was found there, so there is no target; try another light or picture")
    ghost_targets = tuple(
        GhostTarget(
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
        # a placeholder: only its iris and name are used
        lens="heliar-tronnier", lights=tuple(Light(field_deg=angles) for angles, _ in lights),
        camera=Camera(size_px=size_px, sensor_mm=sensor_mm),
        design=Design(own_ghosts=False, signed=False, ghost_targets=ghost_targets, bounds=bounds),
    )  # fmt: skip


def _hue(rgb: tuple[float, float, float]) -> tuple[float, float, float] | None:
    most = max(rgb)
    if not most > 0.0:
        return None
    red, green, blue = (round(part / most, 4) for part in rgb)
    return red, green, blue
