"""Flares for `flarewright predict`, built from a lens or from a measured model: what predictions do not tell apart."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import ProjectError

if TYPE_CHECKING:
    from ..model import Layer, Project
    from ..model.ghost_model import GhostModel
    from ..model.scene import SceneCamera, SceneLight
    from ..predict.flare import Flare, Frame
    from ..predict.occurrence import Flares

# pixels across a measured flare that is drawn for statistics, or to be looked at
SIDE_PX, SHOWN_PX = 192, 240
# a sensor whose proportions differ by a larger part is not that of the captures
_OTHER_SHAPE = 0.03
# wavelengths of pictures to be looked at, evenly spread, and of those that judge, by Gauss
SHOWN_NM, JUDGED_NM = 15, 9


def _refuse_others(path: str) -> None:
    """Refuse JSON that is plainly no ghost model, of whose keys a list would be no help."""
    text = Path(path).read_text("utf-8", errors="ignore")
    if not all(f'"{key}"' in text for key in ("axis_px", "focal_px", "largest_deg")):
        raise ProjectError(
            f"{path} is no ghost model: predict takes a lens, a scene (.toml), or the model.json or compact.json that "
            "flarewright measure run writes"
        )


def lens_flares(project: Project, quality: str, threads: int | None) -> Flares:
    """Return the flare of a lens as it is sampled, judged and shown.

    Parameters
    ----------
    project : Project
    quality : {"draft", "final"}
    threads : int or None
    """
    from ..model import Quality
    from ..predict.lens_flare import lens_flare, luminous, square_flare, statistics_quality
    from ..predict.occurrence import Flares
    from ..render.first_run import compile_for_render

    final = project.replace(quality={"mode": "final", "wavelengths": SHOWN_NM})
    compile_for_render(final, threads)
    sampled, frame = square_flare(project, statistics_quality(quality), threads=threads)
    size = tuple(max(1, round(side / sampled.pitch_mm)) for side in (frame.width, frame.height))
    camera = final.camera.replace(size_px=size, sensor_mm=(frame.width, frame.height))
    judged = luminous(project.replace(camera=camera), Quality(wavelengths=JUDGED_NM, bridge=False, ringing="off"))
    judge = lens_flare(judged, threads=threads)
    return Flares(sampled, frame, quality, judge, lens_flare(final, threads=threads))


def model_flares(path: str, sensor_mm: tuple[float, float] | None, unit_per_cd_m2: float | None) -> Flares:
    """Return a measured flare as it is sampled and shown; nothing better judges it.

    Parameters
    ----------
    path : str
    sensor_mm : tuple of float or None
        None: 36 mm wide.
    unit_per_cd_m2 : float or None
        What a scene of 1 cd/m2 has in the captures; None: not known.

    Raises
    ------
    FlarewrightError
        When the file is no ghost model, or the sensor has other proportions than the captures.
    """
    from ..io.ghost_model_file import read_ghost_model
    from ..predict.occurrence import Flares

    _refuse_others(path)
    model = read_ghost_model(path)
    (wide, high), (width, height) = model.size_px, sensor_mm or (36.0, 36.0 * model.size_px[1] / model.size_px[0])
    if abs(height * wide / (width * high) - 1.0) > _OTHER_SHAPE:
        raise ProjectError(
            f"--sensor {width:g}x{height:g} has other proportions than the captures, which have {wide} x {high} "
            f"pixels; give --sensor {width:g}x{width * high / wide:.4g}"
        )
    sampled = model_flare(model, Path(path).name, width, unit_per_cd_m2, SIDE_PX)
    shown = model_flare(model, Path(path).name, width, unit_per_cd_m2, SHOWN_PX)
    return Flares(sampled, sampled.sensor, "measured", None, shown)


def model_flare(
    model: GhostModel, name: str, sensor_width_mm: float, unit_per_cd_m2: float | None, width_px: int
) -> Flare:
    """Return the ghosts of a measured flare as a function.

    Parameters
    ----------
    model : GhostModel
    name : str
    sensor_width_mm : float
    unit_per_cd_m2 : float or None
    width_px : int

    Returns
    -------
    Flare
        Per illuminance of the light, when the model tells that of its captures.
    """
    from ..measure.replay import BEYOND_DEG, replay
    from ..predict.flare import Flare, Frame
    from ..predict.table import DECIMALS

    remarks = ["star, halo and residual of the measured flare are not counted: the light's own image is in them"]
    reference = model.reference
    light_lx, unit = 1.0, "radiance in the captures' unit, with the light that was photographed"
    per_lux = reference.luminance_cd_m2 is not None and reference.solid_angle_sr is not None
    if reference.luminance_cd_m2 is not None and reference.solid_angle_sr is not None:
        light_lx = reference.luminance_cd_m2 * reference.solid_angle_sr
        unit = "radiance in the captures' unit over the illuminance that the light gives on a plane facing it"
    else:
        remarks.append("the model does not tell the light of its captures: values are in its own unit, not per lux")
    width, height = model.size_px
    size = (width_px, max(1, round(width_px * height / width)))

    def draw(constellation_deg: float, roll_deg: float) -> Sequence[Layer]:
        layers = replay(model, constellation_deg, roll_deg=roll_deg, size_px=size, gain=1.0 / light_lx,
                        colors="camera" if model.to_rec709 is None else "rec709")  # fmt: skip
        return [layer for layer in layers if layer.name == "ghosts"]

    low, high = model.constellation_deg
    # angles are asked for with so many digits: none shall lie beyond what is known
    grid = 10.0**DECIMALS
    return Flare(
        name=name,
        draw=draw,
        size_px=size,
        sensor=Frame(sensor_width_mm, sensor_width_mm * size[1] / size[0]),
        f_number=reference.f_number if reference.f_number is not None else math.nan,
        scene_scale=math.nan if unit_per_cd_m2 is None else unit_per_cd_m2,
        # its frame turns, but what lies beyond the captures' border was not measured
        turns_by_deg=None,
        least_deg=max(math.ceil((low - BEYOND_DEG) * grid) / grid, 0.0),
        reach_deg=math.floor((high + BEYOND_DEG) * grid) / grid,
        dark_beyond=False,
        unit=unit,
        per_lux=per_lux,
        fingerprint=hashlib.sha256(model.model_dump_json().encode() + str((size, unit_per_cd_m2)).encode()).hexdigest(),
        remarks=tuple(remarks),
    )


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
        Of which the spectrum counts.
    diameter_deg : float
        Across it.
    distance_m : float or None
        None: far away.
    quality : {"draft", "final"}
        Of pictures for statistics.
    shown : bool
        To be looked at, in final quality.
    threads : int or None
    """
    if camera.model is not None:
        return _model_in_scene(camera, light, SHOWN_PX if shown else SIDE_PX)
    from ..predict.lens_flare import lens_flare, square_flare, statistics_quality

    project = camera_project(camera, light, diameter_deg)
    if distance_m is not None:
        project = project.replace(lights=(project.lights[0].replace(distance=1e3 * distance_m),))
    if shown:
        flare = lens_flare(project.replace(quality={"mode": "final", "wavelengths": SHOWN_NM}), threads=threads)
        return flare, flare.sensor
    return square_flare(project, statistics_quality(quality), threads=threads)


def _model_in_scene(camera: SceneCamera, light: SceneLight, width_px: int) -> tuple[Flare, Frame]:
    from dataclasses import replace

    from ..io.ghost_model_file import read_ghost_model

    assert camera.model is not None
    model = read_ghost_model(camera.model)
    reference = model.reference
    if reference.luminance_cd_m2 is None or reference.solid_angle_sr is None:
        raise ProjectError(
            f"{camera.name}: the model {camera.model} does not tell luminance_cd_m2 and solid_angle_sr of the light in "
            "its captures; write them into its reference, else it cannot be put into a scene"
        )
    flare = model_flare(model, Path(camera.model).name, camera.sensor_mm[0], camera.unit_per_cd_m2, width_px)
    told: list[str] = []
    if camera.f_number is not None and reference.f_number not in (None, camera.f_number):
        told.append(
            f"measured at f/{reference.f_number:g}: at f/{camera.f_number:g} flare and scene change together, but "
            "ghosts of another opening differ"
        )
    if light.spectrum != type(light).model_fields["spectrum"].default:
        told.append(f"measured in its captures' light: the spectrum of {light.name} makes no difference")
    return replace(flare, remarks=(*flare.remarks, *told)), flare.sensor


def camera_project(camera: SceneCamera, light: SceneLight, diameter_deg: float) -> Project:
    """Return the project of a camera of a scene and one light on its axis."""
    from ..model import Project

    width, height = camera.sensor_mm
    fields: dict[str, Any] = {
        "lens": camera.lens, "f_number": camera.f_number, "zoom": camera.zoom, "coating": camera.coating,
        "lights": ({"field_deg": (0.0, 0.0), "spectrum": light.spectrum, "diameter_deg": diameter_deg},),
        "camera": {
            "size_px": (SHOWN_PX, max(1, round(SHOWN_PX * height / width))), "sensor_mm": (width, height),
            "focus_distance": None if camera.focus_m is None else 1e3 * camera.focus_m,
        },
    }  # fmt: skip
    return Project.model_validate(fields)
