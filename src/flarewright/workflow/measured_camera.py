"""Flare of a measured camera in a scene, for `flarewright predict` and `flarewright scene check`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FlarewrightError, ProjectError
from .measured_flares import Counting, model_flare, refuse_others, sensor_width

if TYPE_CHECKING:
    from ..model.measurement.ghost_model import GhostModel
    from ..model.project.scene import SceneCamera, SceneLight
    from ..predict.flare import Flare, Frame


def model_errors(camera: SceneCamera) -> dict[str, FlarewrightError]:
    """Return all errors that prevent the prediction of a measured camera.

    Parameters
    ----------
    camera : SceneCamera
        With a model.

    Returns
    -------
    dict of str to FlarewrightError
        By key of the camera.
    """
    checks: dict[str, Callable[[GhostModel], object]] = {
        "model": lambda model: _know_light(camera, model),
        "around_light": _counting(camera).around,
        "sensor_mm": lambda model: _sensor_width(camera, model),
    }
    try:
        model = _model(camera)
    except FlarewrightError as error:
        return {"model": error}
    found = {}
    for key, check in checks.items():
        try:
            check(model)
        except FlarewrightError as error:
            found[key] = error
    return found


def model_in_scene(camera: SceneCamera, light: SceneLight, width_px: int) -> tuple[Flare, Frame]:
    """Return the flare of a measured camera in a scene, and the camera's frame.

    Parameters
    ----------
    camera : SceneCamera
        With a model.
    light : SceneLight
    width_px : int

    Raises
    ------
    FlarewrightError
        The first error of `model_errors`.
    """
    for mistake in model_errors(camera).values():
        raise mistake
    model = _model(camera)
    name, reference = Path(camera.model or "").name, model.reference
    width_mm = _sensor_width(camera, model)
    flare = model_flare(model, name, width_mm, camera.unit_per_cd_m2, width_px, _counting(camera))
    own_remarks: list[str] = []
    if camera.f_number is not None and reference.f_number not in (None, camera.f_number):
        own_remarks.append(
            f"measured at f/{reference.f_number:g}: at f/{camera.f_number:g} flare and scene change together, but "
            "ghosts of another opening differ"
        )
    if light.spectrum != type(light).model_fields["spectrum"].default:
        own_remarks.append(f"measured in its captures' light: the spectrum of {light.name} makes no difference")
    signal, doubt = _over_clipping(model, camera)
    remarks = (*flare.remarks, *own_remarks, *doubt)
    recipe = partial(_made_again, camera, light, width_px)
    return replace(flare, over_clipping=signal, remarks=remarks, recipe=recipe), flare.sensor


def _made_again(camera: SceneCamera, light: SceneLight, width_px: int, _threads: int | None) -> Flare:
    return model_in_scene(camera, light, width_px)[0]


def _counting(camera: SceneCamera) -> Counting:
    return Counting(camera.count == "ghosts", camera.around_light, "around_light")


def _know_light(camera: SceneCamera, model: GhostModel) -> None:
    """Raise when a model has no luminance of the light in its captures."""
    if model.reference.luminance_cd_m2 is None or model.reference.solid_angle_sr is None:
        raise ProjectError(
            f"the model {camera.model} does not know luminance_cd_m2 and solid_angle_sr of the light in its captures; "
            "write both into the camera.json beside the captures and run flarewright measure run again, which keeps "
            "what it has measured, or write them into the model's reference"
        )


def _sensor_width(camera: SceneCamera, model: GhostModel) -> float:
    # a camera without a given sensor has the default of a lens
    sensor_mm = camera.sensor_mm if "sensor_mm" in camera.model_fields_set else None
    return sensor_width(model, sensor_mm, lambda width, height: f"sensor_mm = [{width:g}, {height:g}]")


def _model(camera: SceneCamera) -> GhostModel:
    assert camera.model is not None
    path = Path(camera.model)
    return _read(camera.model, path.stat().st_mtime_ns if path.is_file() else 0)


# unpacking the sprites of a file is slow
@lru_cache(maxsize=8)
def _read(path: str, _changed_ns: int) -> GhostModel:
    from ..io.measurement.ghost_model_file import read_ghost_model

    refuse_others(path, "a camera's model is")
    return read_ghost_model(path)


def _over_clipping(model: GhostModel, camera: SceneCamera) -> tuple[float | None, list[str]]:
    """Return the signal over clipping for light 1 at a scene camera's settings, or None and the reason."""
    from ..measure.replay.placement import over_clipping
    from ..model.measurement.replay_camera import ReplayCamera

    shot = ReplayCamera(f_number=camera.f_number, iso=camera.iso, exposure_s=camera.exposure_s)
    try:
        return over_clipping(model, shot), []
    except FlarewrightError as error:
        return None, [f"how near its brightest spot is to clipping is not known: {error}"]
