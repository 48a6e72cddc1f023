"""Find the errors of a scene's lights and cameras; lenses and models are opened as in `predict`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FlarewrightError
from .measured_camera import model_errors

if TYPE_CHECKING:
    from ..model.project.scene import Scene, SceneCamera, SceneLight
    from ..predict.tracks import CameraSighting
    from ..render.scene.resolve import ResolvedProject

# keys of a camera that depend on its lens, in the order in which they are tested, each with those before it
_ASKED = ("zoom", "focus_m", "f_number", "coating")


def camera_errors(file: Path, scene: Scene, seen: Sequence[Sequence[CameraSighting]]) -> list[str]:
    """Open the lens or model of every camera and return all errors.

    Parameters
    ----------
    file : path
        File of the scene, for messages.
    scene : Scene
    seen : sequence of sequence of Sighting
        By camera and light.

    Returns
    -------
    list of str
        One sentence per error, with the camera's position in the file, key and name.
    """
    problems = []
    for c, (camera, row) in enumerate(zip(scene.cameras, seen, strict=True)):
        if camera.model is not None:
            mistakes = model_errors(camera)
        else:
            try:
                settled = _opened(file, camera, scene.lights[0])
            except FlarewrightError as error:
                mistakes = _lens_mistakes(file, camera, scene.lights[0]) or {"lens": error}
            else:
                mistakes = {}
                problems += _too_near(scene, c, row, settled)
        for key, mistake in mistakes.items():
            problems += [f"cameras[{c}].{key} ({camera.name}): {words}" for words in _findings(camera, mistake)]
    return problems


def light_errors(scene: Scene) -> list[str]:
    """Return an error for each light without visible light.

    Returns
    -------
    list of str
        One sentence per error, with the light's position in the file, key and name.
    """
    from ..optics.colour.spectrum import luminance_shares

    problems = []
    for k, light in enumerate(scene.lights):
        try:
            luminance_shares(light.spectrum)
        except FlarewrightError as error:
            problems.append(f"lights[{k}].spectrum ({light.name}): {error}")
    return problems


def _opened(file: Path, camera: SceneCamera, light: SceneLight) -> ResolvedProject:
    from .lens_flares import camera_project
    from .project_files import open_project_files

    return open_project_files(file, camera_project(camera, light, 0.0))


def _lens_mistakes(file: Path, camera: SceneCamera, light: SceneLight) -> dict[str, FlarewrightError]:
    """Return the keys of a camera that its lens does not allow, by adding one after the other."""
    fields = type(camera).model_fields
    asked: SceneCamera = camera.replace(**{key: fields[key].default for key in _ASKED})
    found: dict[str, FlarewrightError] = {}
    try:
        _opened(file, asked, light)
    except FlarewrightError as error:
        return {"lens": error}
    for key in _ASKED:
        more: SceneCamera = asked.replace(**{key: getattr(camera, key)})
        try:
            _opened(file, more, light)
        except FlarewrightError as error:
            found[key] = error
        else:
            asked = more
    return found


def _too_near(scene: Scene, c: int, row: Sequence[CameraSighting], settled: ResolvedProject) -> list[str]:
    """Return an error for each light that is inside a camera's lens."""
    from ..predict.lens_flare import largest_constellation
    from ..predict.plan import rounded_distance

    problems = []
    for k, (light, sighting) in enumerate(zip(scene.lights, row, strict=True)):
        distance_m = rounded_distance(sighting, settled.order.efl)
        try:
            largest_constellation(None if distance_m is None else 1e3 * distance_m, settled.order.efl)
        except FlarewrightError as error:
            problems.append(f"lights[{k}] ({light.name}) and cameras[{c}] ({scene.cameras[c].name}): {error}")
    return problems


def _findings(camera: SceneCamera, mistake: FlarewrightError) -> list[str]:
    """Return the messages of an error; several findings get the file's name as prefix."""
    if len(mistake.problems) < 2:
        return [str(mistake)]
    return [f"{camera.model or camera.lens}: {finding}" for finding in mistake.problems]
