"""What is wrong with a scene's lights and cameras, of which lenses and models are opened as `predict` opens them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FlarewrightError
from .predict_measured_scene import model_mistakes

if TYPE_CHECKING:
    from ..model.scene import Scene, SceneCamera, SceneLight
    from ..predict.tracks import Sighting
    from ..render.prepare import Settled

# what a camera asks of its lens, each on top of those before it
_ASKED = ("zoom", "focus_m", "f_number", "coating")


def camera_mistakes(file: Path, scene: Scene, seen: Sequence[Sequence[Sighting]]) -> list[str]:
    """Open every camera's lens or model, and tell everything that is wrong with them.

    Parameters
    ----------
    file : path
        Where the scene stands, for messages.
    scene : Scene
    seen : sequence of sequence of Sighting
        By camera and light.

    Returns
    -------
    list of str
        A sentence each, with the camera's place, key and name.
    """
    problems = []
    for c, (camera, row) in enumerate(zip(scene.cameras, seen, strict=True)):
        if camera.model is not None:
            mistakes = model_mistakes(camera)
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


def light_mistakes(scene: Scene) -> list[str]:
    """Tell of every light without visible light, which lens and eye know nothing of.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    list of str
        A sentence each, with the light's place, key and name.
    """
    from ..optics.spectrum import luminance_shares

    problems = []
    for k, light in enumerate(scene.lights):
        try:
            luminance_shares(light.spectrum)
        except FlarewrightError as error:
            problems.append(f"lights[{k}].spectrum ({light.name}): {error}")
    return problems


def _opened(file: Path, camera: SceneCamera, light: SceneLight) -> Settled:
    from .predict_flares import camera_project
    from .project_check import read_everything

    return read_everything(file, camera_project(camera, light, 0.0))


def _lens_mistakes(file: Path, camera: SceneCamera, light: SceneLight) -> dict[str, FlarewrightError]:
    """Find which keys of a camera its lens cannot do, by asking for one after the other."""
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


def _too_near(scene: Scene, c: int, row: Sequence[Sighting], settled: Settled) -> list[str]:
    """Find the lights that stand in a camera's lens."""
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
    """Return all that a mistake tells; several findings in a file do not name it."""
    if len(mistake.problems) < 2:
        return [str(mistake)]
    return [f"{camera.model or camera.lens}: {finding}" for finding in mistake.problems]
