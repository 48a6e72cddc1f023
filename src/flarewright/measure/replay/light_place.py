"""The field angles at which a measured flare has its light at a given pixel: the inverse of `model_image.light_px`."""

from __future__ import annotations

import numpy as np

from ...errors import ProjectError
from ...model import Project
from ..core.parameter_vector import fit_in
from .measured_project import flare_of

_STEPS = 50


def measured_angles_at(project: Project, place_px: tuple[float, float]) -> tuple[float, float]:
    """Return the field angles of a light whose image lies at a place of a measured flare's picture.

    Parameters
    ----------
    project : Project
        Of a measured flare.
    place_px : tuple of float
        Column and row from the top left corner.

    Returns
    -------
    tuple of float
        (X, Y) in degrees.

    Raises
    ------
    ProjectError
        The measured distortion images no light there.
    """
    model = flare_of(project).model
    zoom, top = fit_in(model, project.camera.size_px)
    right = (place_px[0] / zoom - model.axis_px[0]) / model.focal_px
    up = (model.axis_px[1] - (place_px[1] - top) / zoom) / model.focal_px
    reach = float(np.hypot(right, up))
    # t (1 + k t^2) = reach, by Newton's method from the undistorted tangent
    t = reach
    for _ in range(_STEPS):
        slope = 1.0 + 3.0 * model.distortion * t * t
        if slope <= 0.0:
            break
        t -= (t * (1.0 + model.distortion * t * t) - reach) / slope
    if not abs(t * (1.0 + model.distortion * t * t) - reach) <= 1e-9 * max(reach, 1.0):
        raise ProjectError(
            f"the measured distortion images no light at {place_px[0]:g},{place_px[1]:g} px; give a place nearer to "
            "the middle of the picture"
        )
    towards = t / reach if reach > 0.0 else 1.0
    x, y = np.degrees(np.arctan([right * towards, up * towards]))
    return float(x), float(y)
