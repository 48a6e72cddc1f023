"""The flare of a lens: rendered at any constellation by the one renderer."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from math import acos, cos, degrees, radians

from ..errors import LensError
from ..model import Camera, Dirt, Layer, Output, Project, Quality
from ..optics.constellation import field_angles
from ..render.opening import make_opening
from ..render.prepare import Settled, as_lens, settle
from ..render.render import render
from ..render.shots import make_shots
from .flare import Flare, Frame
from .wavelengths import luminous_lines

# field angles are below 90 degrees, and grazing light carries nothing
REACH_DEG = 85.0
# nearer along the axis than so many focal lengths a light stands between lens and hood
LEAST_FRONT = 2.0
# pixels across what is drawn for statistics; a flare is smooth but for its brightest spots
SIDE_PX = 192

__all__ = ["largest_constellation", "lens_flare", "luminous", "square_flare", "statistics_quality"]


def statistics_quality(mode: str) -> Quality:
    """Return the quality that pictures for statistics are drawn in: coarse in what an average does not see.

    Parameters
    ----------
    mode : {"draft", "final"}
    """
    return Quality.model_validate(
        {"mode": mode, "wavelengths": 5, "bridge": False, "tolerance_px": 2.0, "ringing": "off"}
    )


def luminous(project: Project, quality: Quality) -> Project:
    """Return a project whose luminance is right with few wavelengths; its colours are not.

    Parameters
    ----------
    project : Project
    quality : Quality
        Its wavelengths are placed for the first light's luminance.
    """
    light = project.lights[0]
    lines = luminous_lines(light.spectrum, quality.wavelengths)
    same: Project = project.replace(lights=(light.replace(spectrum=lines),), quality=quality)
    return same


def lens_flare(project: Project, *, threads: int | None = None) -> Flare:
    """Return the flare of a project's lens and first light.

    Parameters
    ----------
    project : Project
        Its first light is moved about; its spectrum and disc stay, its intensity becomes 1. The distance of a near
        light is taken from the camera to it, whatever its direction.
    threads : int, optional

    Returns
    -------
    Flare
        Over the project's sensor.

    Raises
    ------
    FlarewrightError
        As `settle`, and later as `render`.
    """
    light = project.lights[0].replace(intensity=1.0, field_deg=(0.0, 0.0))
    prepared = project.replace(lights=(light,), output=Output(layers="passes", starburst=False))
    settled = settle(prepared)
    # the lens is loaded once; what `settle` reads from the project besides it costs nothing
    prepared = settled.project.replace(lens=as_lens(prepared.lens))
    summary = render(prepared.replace(quality=Quality(mode="draft", wavelengths=3))).summary

    def draw(constellation_deg: float, roll_deg: float) -> Sequence[Layer]:
        # the renderer measures along the axis
        along = None if light.distance is None else light.distance * cos(radians(constellation_deg))
        there = light.replace(field_deg=field_angles(constellation_deg, roll_deg), distance=along)
        return render(prepared.replace(lights=(there,)), threads=threads).layers

    width, height = prepared.camera.sensor
    return Flare(
        name=settled.lens.name,
        draw=draw,
        size_px=prepared.camera.size_px,
        sensor=Frame(width, height),
        f_number=settled.order.f_number,
        efl=settled.order.efl,
        scene_scale=float(summary["scene_irradiance_per_radiance"]),
        turns_by_deg=_turns_by(settled),
        reach_deg=largest_constellation(light.distance, settled.order.efl),
        fingerprint=hashlib.sha256(prepared.model_dump_json().encode()).hexdigest(),
        remarks=settled.remarks,
    )


def largest_constellation(distance: float | None, efl: float) -> float:
    """Return the largest constellation, degrees: a near light must stay in front of the lens.

    Parameters
    ----------
    distance : float or None
        Of the light from the camera, mm; None: far away.
    efl : float
        Focal length, mm.

    Raises
    ------
    LensError
        When the light stands in or right at the lens.
    """
    if distance is None:
        return REACH_DEG
    front = LEAST_FRONT * abs(efl)
    if distance <= front:
        raise LensError(
            f"a light {distance:.4g} mm from the camera stands in or right at the lens; move it at least "
            f"{front:.4g} mm away"
        )
    return min(REACH_DEG, degrees(acos(front / distance)))


def square_flare(project: Project, quality: Quality, *, threads: int | None = None) -> tuple[Flare, Frame]:
    """Return the flare of a project's lens for a `FlareTable`, and the frame of its sensor.

    Parameters
    ----------
    project : Project
    quality : Quality
    threads : int, optional

    Returns
    -------
    flare : Flare
        Its luminance is right, its colours are not. Over a square as wide as the sensor's diagonal, or over the sensor
        when no roll only turns the flare.
    frame : Frame
    """
    frame = Frame(*project.camera.sensor)
    project = luminous(project, quality.replace(paths=project.quality.paths))
    turned = project.replace(camera=_square(project, frame))
    if _turns_by(settle(turned)) is not None:
        return lens_flare(turned, threads=threads), frame
    high = max(1, round(SIDE_PX * frame.height / frame.width))
    camera = project.camera.replace(size_px=(SIDE_PX, high), sensor_mm=(frame.width, frame.height))
    return lens_flare(project.replace(camera=camera), threads=threads), frame


def _square(project: Project, frame: Frame) -> Camera:
    square: Camera = project.camera.replace(size_px=(SIDE_PX, SIDE_PX), sensor_mm=(frame.diagonal, frame.diagonal))
    return square


def _turns_by(settled: Settled) -> float | None:
    """Return the roll that only turns the flare, as `Flare.turns_by_deg`."""
    iris, dirt = settled.iris, settled.project.dirt
    if iris.mask is not None or (dirt.in_ghosts and dirt != Dirt()):
        return None
    if not all(shot.packed.symmetric for shot in make_shots(settled, make_opening(settled, None))):
        return None
    return 0.0 if iris.blades == 0 or iris.rounding == 1.0 else 360.0 / iris.blades
