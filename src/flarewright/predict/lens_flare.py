"""Build the flare of a lens, rendered at any constellation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import acos, cos, degrees, radians

from ..errors import LensError
from ..io.files.text_file import digest_of
from ..io.project.named_files import picture_files
from ..model import Camera, Dirt, Layer, Output, Project, Quality
from ..optics.lens.field_angles import field_angles
from ..optics.pupil.light_shape import WIDEST_DEG, shrunk_to_fit
from ..render.render import render
from ..render.scene.opening import make_opening
from ..render.scene.resolve import ResolvedProject, resolve_project
from ..render.scene.shots import make_shots
from .flare import Flare, Frame, fingerprint_of
from .wavelengths import luminous_lines

# largest constellation; field angles are below 90 degrees, and grazing light carries no energy
REACH_DEG = 85.0
# least distance of a light along the axis, focal lengths; nearer lights are inside the lens or hood
LEAST_FRONT = 2.0
# width in pixels of pictures for statistics; a flare is smooth except for its brightest spots
SIDE_PX = 192


def statistics_quality(mode: str) -> Quality:
    """Return the quality of renders for statistics, coarse where averages do not change.

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
        Its wavelengths are chosen for the luminance of the first light.
    """
    light = project.lights[0]
    lines = luminous_lines(light.spectrum, quality.wavelengths)
    return project.replace(lights=(light.replace(spectrum=lines),), quality=quality)


def lens_flare(project: Project, *, threads: int | None = None) -> Flare:
    """Return the flare of a project's lens and first light.

    Parameters
    ----------
    project : Project
        The flare varies the angle of its first light. Spectrum and size are kept, the intensity becomes 1. The distance
        of a near light is measured from the camera to the light in any direction.
    threads : int, optional

    Returns
    -------
    Flare
        Over the project's sensor.

    Raises
    ------
    FlarewrightError
        As `resolve_project`, and when drawing as `render`.
    """
    light = project.lights[0].replace(intensity=1.0, field_deg=(0.0, 0.0))
    prepared = project.replace(lights=(light,), output=Output(layers="passes", starburst=False))
    settled = resolve_project(prepared)
    # open the lens once; `resolve_project` reads little else from the project
    prepared = settled.project.replace(lens=settled.opened.lens)
    summary = render(prepared.replace(quality=Quality(mode="draft", wavelengths=3))).summary

    def draw(constellation_deg: float, roll_deg: float) -> Sequence[Layer]:
        # the renderer measures the distance along the axis
        along = None if light.distance is None else light.distance * cos(radians(constellation_deg))
        # of a light that reaches behind the camera, the part in front of it counts as all
        there = shrunk_to_fit(light.replace(field_deg=field_angles(constellation_deg, roll_deg), distance=along))
        return render(prepared.replace(lights=(there,)), threads=threads).layers

    width, height = prepared.camera.sensor
    # another mask or map of heights may come under the same name
    pictures = [digest_of(name) or "" for name in picture_files(prepared)]
    reach, remarks = largest_constellation(light.distance, settled.order.efl), settled.remarks
    if (widest := light.replace(field_deg=(reach, 0.0))) != shrunk_to_fit(widest):
        remarks += (
            f"towards {reach:g} degrees from the axis the light reaches beyond {WIDEST_DEG:g}: it is drawn smaller "
            "there, with the same illuminance",
        )
    return Flare(
        name=settled.lens.name,
        draw=draw,
        size_px=prepared.camera.size_px,
        sensor=Frame(width, height),
        f_number=settled.order.f_number,
        efl=settled.order.efl,
        scene_scale=float(summary["scene_irradiance_per_radiance"]),
        turns_by_deg=_turns_by(settled),
        reach_deg=reach,
        fingerprint=fingerprint_of(prepared.model_dump_json(), *pictures),
        remarks=remarks,
        recipe=partial(_made_again, project),
    )


def _made_again(project: Project, threads: int | None) -> Flare:
    return lens_flare(project, threads=threads)


def largest_constellation(distance: float | None, efl: float) -> float:
    """Return the largest constellation at which a light is in front of the lens, degrees.

    Parameters
    ----------
    distance : float or None
        Distance of the light from the camera, mm; None: infinite.
    efl : float
        Focal length, mm.

    Raises
    ------
    LensError
        When the light is inside the lens or too close to it.
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

    Returns
    -------
    flare : Flare
        Its luminance is right, its colours are not. It covers a square as wide as the sensor's diagonal, or the sensor
        if every roll changes the flare.
    frame : Frame
    """
    # the lens may state a squeeze, on which the width of a sensor depends
    frame = Frame(*resolve_project(project).project.camera.sensor)
    project = luminous(project, quality.replace(paths=project.quality.paths))
    turned = project.replace(camera=_square(project, frame))
    if _turns_by(resolve_project(turned)) is not None:
        return lens_flare(turned, threads=threads), frame
    high = max(1, round(SIDE_PX * frame.height / frame.width))
    camera = project.camera.replace(size_px=(SIDE_PX, high), sensor_mm=(frame.width, frame.height))
    return lens_flare(project.replace(camera=camera), threads=threads), frame


def _square(project: Project, frame: Frame) -> Camera:
    return project.camera.replace(size_px=(SIDE_PX, SIDE_PX), sensor_mm=(frame.diagonal, frame.diagonal))


def _turns_by(settled: ResolvedProject) -> float | None:
    """Return the roll that only rotates the flare, as `Flare.turns_by_deg`."""
    iris, dirt = settled.iris, settled.project.dirt
    if iris.mask is not None or (dirt.in_ghosts and dirt != Dirt()) or _stands_in_picture(settled.project):
        return None
    if not all(shot.packed.symmetric for shot in make_shots(settled, make_opening(settled, None))):
        return None
    return 0.0 if iris.blades == 0 or iris.rounding == 1.0 else 360.0 / iris.blades


def _stands_in_picture(project: Project) -> bool:
    """Return whether something else than the iris keeps its direction in the picture while the light goes round it."""
    light, camera, art = project.lights[0], project.camera, project.art
    grating = camera.sensor_grating is not None and camera.sensor_reflectance > 0.0
    moved = not art.physical and any(any(rule.offset_px or rule.offset_mm or ()) for rule in art.rules)
    return grating or moved or any(one is not None for one in (light.shape, light.holdout, project.holdout))
