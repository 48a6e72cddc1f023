"""A measured flare in the editor: the project that shows it, and what the page tells of it in a lens' place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..measure.rendering import check_measured, efl_mm, flare_of, is_measured, opening_of
from ..model import Camera, Light, Project
from ..optics.constellation import field_angles
from ..render.prepare import settle
from .edit_lens import Prescription, distortion_angles, distortion_of

# of a new project: how far out in what was photographed its light stands, and in which direction
PART, ROLL_DEG = 0.45, 28.0
WIDTH_PX = 1920


def project_for_measured(path: str) -> Project:
    """Return a project that shows a measured flare: the whole frame of its captures, a light where it was photographed.

    Parameters
    ----------
    path : str

    Returns
    -------
    Project

    Raises
    ------
    FlarewrightError
        The file is no ghost model.
    """
    there = Light(field_deg=(0.0, 0.0))
    flare = flare_of(Project(lens=path, lights=(there,)))
    width, height = flare.model.size_px
    low, high = flare.model.constellation_deg
    angle = low + PART * (high - low) if abs(low) <= abs(high) else high - PART * (high - low)
    x, y = (round(each, 3) for each in field_angles(angle, ROLL_DEG))
    camera = Camera(size_px=(WIDTH_PX, max(1, round(WIDTH_PX * height / width))))
    return Project(lens=path, lights=(there.replace(field_deg=(x, y)),), camera=camera)


def check_any(project: Project) -> None:
    """Refuse a project that cannot be drawn, be it of a lens or of a measured flare."""
    if is_measured(project):
        check_measured(project)
    else:
        settle(project)


def measured_facts(project: Project) -> Prescription:
    """Return what stands in the place of a measured flare's prescription: no rows, but where its light is imaged."""
    model = flare_of(project).model
    facts = {"efl": efl_mm(project, model)}
    f_number = opening_of(project, model)
    if f_number is not None:
        facts["f_number"] = f_number
    slopes = np.tan(np.radians(distortion_angles()))
    return Prescription((), facts, "", distortion_of(slopes * (1.0 + model.distortion * slopes**2), slopes))


def measured_lens(project: Project) -> dict[str, Any]:
    """Return what the page shows of a measured flare where it names a lens."""
    model = flare_of(project).model
    low, high = model.constellation_deg
    (width, height), (x, y) = model.size_px, model.axis_px
    pitch = project.camera.sensor[0] / width
    return {
        "axis_mm": [(x - 0.5 * width) * pitch, (0.5 * height - y) * pitch],
        "name": f"{Path(str(project.lens)).stem}, measured",
        "source": f"{len(model.ghosts)} ghosts, photographed from {low:.3g} to {high:.3g} degrees off the axis",
        "notes": " ".join(model.remarks), "open": model.reference.f_number, "f_number": project.f_number, "zoom": None,
        "positions": [], "presets": [], "stop_row": None, "shipped": None, "measured": True,
    }  # fmt: skip
