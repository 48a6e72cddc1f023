"""A camera of a scene whose flare was measured, for `flarewright predict` and `flarewright scene check`."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FlarewrightError, ProjectError
from .predict_measured import Counting, model_flare, sensor_width

if TYPE_CHECKING:
    from ..model.ghost_model import GhostModel
    from ..model.scene import SceneCamera, SceneLight
    from ..predict.flare import Flare, Frame


def model_in_scene(camera: SceneCamera, light: SceneLight, width_px: int) -> tuple[Flare, Frame]:
    """Return the flare of a camera of a scene that was measured, and the camera's frame.

    Parameters
    ----------
    camera : SceneCamera
        With a model.
    light : SceneLight
    width_px : int

    Raises
    ------
    FlarewrightError
        When the model cannot be read or does not tell the light of its captures, the sensor has other proportions than
        these, or nothing counts.
    """
    assert camera.model is not None
    model = _read(camera.model, Path(camera.model).stat().st_mtime_ns if Path(camera.model).is_file() else 0)
    reference = model.reference
    if reference.luminance_cd_m2 is None or reference.solid_angle_sr is None:
        raise ProjectError(
            f"{camera.name}: the model {camera.model} does not tell luminance_cd_m2 and solid_angle_sr of the light in "
            "its captures; write both into the camera.json beside the captures and give flarewright measure run again, "
            "which keeps what it has measured, or else into the model's reference"
        )
    counting = Counting(camera.count == "ghosts", camera.around_light, "around_light")
    name = Path(camera.model).name
    flare = model_flare(model, name, _sensor_width(camera, model), camera.unit_per_cd_m2, width_px, counting)
    told: list[str] = []
    if camera.f_number is not None and reference.f_number not in (None, camera.f_number):
        told.append(
            f"measured at f/{reference.f_number:g}: at f/{camera.f_number:g} flare and scene change together, but "
            "ghosts of another opening differ"
        )
    if light.spectrum != type(light).model_fields["spectrum"].default:
        told.append(f"measured in its captures' light: the spectrum of {light.name} makes no difference")
    signal, doubt = _over_clipping(model, camera)
    return replace(flare, over_clipping=signal, remarks=(*flare.remarks, *told, *doubt)), flare.sensor


def _sensor_width(camera: SceneCamera, model: GhostModel) -> float:
    # the sensor of a camera that tells none is a lens'
    told = camera.sensor_mm if "sensor_mm" in camera.model_fields_set else None
    return sensor_width(model, told, lambda width, height: f"sensor_mm = [{width:g}, {height:g}]")


# the cells of a file's sprites are unpacked once
@lru_cache(maxsize=8)
def _read(path: str, _changed_ns: int) -> GhostModel:
    from ..io.ghost_model_file import read_ghost_model

    return read_ghost_model(path)


def _over_clipping(model: GhostModel, camera: SceneCamera) -> tuple[float | None, list[str]]:
    """Return the signal of light 1 over clipping at a scene camera's settings, or None and why it is not known."""
    from ..measure.placing import over_clipping
    from ..model.replay_camera import ReplayCamera

    shot = ReplayCamera(f_number=camera.f_number, iso=camera.iso, exposure_s=camera.exposure_s)
    try:
        return over_clipping(model, shot), []
    except FlarewrightError as error:
        return None, [f"how near its brightest spot is to clipping is not known: {error}"]
