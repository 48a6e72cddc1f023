"""Build the flares that `flarewright predict` needs, from a lens or a camera of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..errors import ProjectError
from .defaults import SHOWN_PX, SIDE_PX

if TYPE_CHECKING:
    from ..model import Project
    from ..model.project.scene import SceneCamera, SceneLight
    from ..predict.flare import Flare, Frame
    from ..predict.occurrence import Flares

# wavelengths of renders for viewing, evenly spaced, and of renders that check the curves, Gauss nodes
SHOWN_NM, JUDGED_NM = 15, 9


def lens_flares(project: Project, quality: str, threads: int | None) -> Flares:
    """Return the flare of a lens in the qualities for sampling, checking and viewing.

    Parameters
    ----------
    project : Project
    quality : {"draft", "final"}
    threads : int or None
    """
    from ..model import Quality
    from ..predict.lens_flare import lens_flare, luminous, square_flare, statistics_quality
    from ..predict.occurrence import Flares

    final = shown_project(project)
    sampled, frame = square_flare(project, statistics_quality(quality), threads=threads)
    size = tuple(max(1, round(side / sampled.pitch_mm)) for side in (frame.width, frame.height))
    camera = final.camera.replace(size_px=size, sensor_mm=(frame.width, frame.height))
    judged = luminous(project.replace(camera=camera), Quality(wavelengths=JUDGED_NM, bridge=False, ringing="off"))
    judge = lens_flare(judged, threads=threads)
    return Flares(sampled, frame, quality, judge, lens_flare(final, threads=threads))


def shown_project(project: Project) -> Project:
    """Return a project in the quality of renders for viewing."""
    return project.replace(quality={"mode": "final", "wavelengths": SHOWN_NM})


def scene_flare(
    camera: SceneCamera,
    light: SceneLight,
    diameter_deg: float,
    distance_m: float | None,
    *,
    quality: str,
    shown: bool,
    threads: int | None,
) -> tuple[Flare, Frame]:
    """Return the flare of a light in a camera of a scene, and the camera's frame.

    Parameters
    ----------
    camera : SceneCamera
    light : SceneLight
        Light whose spectrum is used.
    diameter_deg : float
        Angular diameter of the light.
    distance_m : float or None
        None: infinite.
    quality : {"draft", "final"}
        Quality of renders for statistics.
    shown : bool
        Whether the flare is drawn for viewing, in final quality.
    threads : int or None
    """
    if camera.model is not None:
        from .measured_camera import model_in_scene

        return model_in_scene(camera, light, SHOWN_PX if shown else SIDE_PX)
    from ..predict.lens_flare import lens_flare, square_flare, statistics_quality

    project = camera_project(camera, light, diameter_deg)
    if distance_m is not None:
        project = project.replace(lights=(project.lights[0].replace(distance=1e3 * distance_m),))
    if shown:
        flare = lens_flare(shown_project(project), threads=threads)
        return flare, flare.sensor
    return square_flare(project, statistics_quality(quality), threads=threads)


def camera_project(camera: SceneCamera, light: SceneLight, diameter_deg: float) -> Project:
    """Return a project of a camera of a scene and one light on its axis.

    Raises
    ------
    ProjectError
        When the camera's values are invalid for a project, such as an infinite focus.
    """
    from pydantic import ValidationError

    from ..io.project.project_file import validation_messages
    from ..model import Project

    width, height = camera.sensor_mm
    fields: dict[str, Any] = {
        "lens": camera.lens, "f_number": camera.f_number, "zoom": camera.zoom, "coating": camera.coating,
        "lights": ({"field_deg": (0.0, 0.0), "spectrum": light.spectrum, "diameter_deg": diameter_deg},),
        "camera": {
            "size_px": (SHOWN_PX, round(SHOWN_PX * height / width)),
            "sensor_mm": (width, height), "focus_distance": None if camera.focus_m is None else 1e3 * camera.focus_m,
        },
    }  # fmt: skip
    try:
        return Project.model_validate(fields)
    except ValidationError as error:
        raise ProjectError(validation_messages(error, fields)[0].removeprefix("camera.")) from None
