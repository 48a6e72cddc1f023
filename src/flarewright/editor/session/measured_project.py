"""Measured flares in the editor: a project for one, and the facts that the page shows instead of a lens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...measure.replay.measured_project import (
    check_measured,
    efl_mm,
    flare_of,
    is_measured,
    opening_of,
    sensor_of,
    with_sensor,
)  # fmt: skip
from ...model import Camera, Light, Project
from ...optics.lens.field_angles import field_angles
from ...render.scene.resolve import resolve_project
from ..commands.lens import Prescription, distortion_angles, distortion_of

# initial place of the light: fraction of the captured range of angles, and direction
PART, ROLL_DEG = 0.45, 28.0
WIDTH_PX = 1920


def project_for_measured(path: str) -> Project:
    """Return a project for a measured flare: the frame of its captures, and a light within the captured range.

    Raises
    ------
    FlarewrightError
        When the file is no ghost model.
    """
    there = Light(field_deg=(0.0, 0.0))
    flare = flare_of(Project(lens=path, lights=(there,)))
    width, height = flare.model.size_px
    low, high = flare.model.constellation_deg
    angle = low + PART * (high - low) if abs(low) <= abs(high) else high - PART * (high - low)
    x, y = (round(each, 3) for each in field_angles(angle, ROLL_DEG))
    camera = Camera(size_px=(WIDTH_PX, max(1, round(WIDTH_PX * height / width))))
    return with_sensor(Project(lens=path, lights=(there.replace(field_deg=(x, y)),), camera=camera))


def check_any(project: Project) -> None:
    """Raise an error if a project, of a lens or of a measured flare, cannot be drawn."""
    if is_measured(project):
        check_measured(project, limit=True)
    else:
        resolve_project(project)


def measured_facts(project: Project) -> Prescription:
    """Return the facts of a measured flare in place of a prescription: no rows, and its focal length."""
    model = flare_of(project).model
    facts = {"efl": efl_mm(project, model)}
    f_number = opening_of(project, model)
    if f_number is not None:
        facts["f_number"] = f_number
    slopes = np.tan(np.radians(distortion_angles()))
    return Prescription((), facts, "", distortion_of(slopes * (1.0 + model.distortion * slopes**2), slopes))


def measured_lens(project: Project) -> dict[str, Any]:
    """Return the facts of a measured flare that the page shows instead of a lens."""
    model = flare_of(project).model
    low, high = model.constellation_deg
    (width, height), (x, y) = model.size_px, model.axis_px
    pitch = sensor_of(project, model)[0] / width
    return {
        "axis_mm": [(x - 0.5 * width) * pitch, (0.5 * height - y) * pitch],
        "name": f"{Path(str(project.lens)).stem}, measured",
        "source": f"{len(model.ghosts)} ghosts, photographed from {low:.3g} to {high:.3g} degrees off the axis",
        "notes": " ".join(model.remarks), "open": model.reference.f_number, "f_number": project.f_number, "zoom": None,
        "positions": [], "presets": [], "stop_row": None, "shipped": None, "measured": True,
    }  # fmt: skip
