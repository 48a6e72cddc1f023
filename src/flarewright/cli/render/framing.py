"""`--sensor NAME`, `--crop` and `--overscan`: the part of the image plane that the picture shows."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ...errors import ProjectError
from ..common import picture_size

if TYPE_CHECKING:
    from ...io.project.camera_list import CameraFormat
    from ...model import Camera, Project
    from .options.record import RenderOptions

__all__ = ["framed", "on_sensor"]

# width of a picture of film, which has no pixels of its own
_FILM_WIDTH_PX = 1280
_PART = re.compile(r"^\s*(\d+(?:\.\d+)?)\s*(%|px)?\s*$")


def framed(project: Project, flags: RenderOptions) -> tuple[Project, tuple[int, int], list[str]]:
    """Return a project with the sensor and the frame of the flags.

    Parameters
    ----------
    project : Project
    flags : RenderOptions

    Returns
    -------
    project : Project
    counted_px : tuple of int
        Size of the picture without overscan, in which `--light-px` and tracks count.
    remarks : list of str

    Raises
    ------
    ProjectError
        An option is none, or the lens is a measured flare, whose frame is that of its captures.
    """
    from ...io.measurement.ghost_model_file import is_ghost_model_file
    from ...io.project.camera_list import camera_format, is_camera_name

    named = flags.sensor is not None and is_camera_name(flags.sensor)
    given = {"--crop": flags.crop, "--overscan": flags.overscan, "--sensor NAME": flags.sensor if named else None}
    used = [flag for flag, value in given.items() if value is not None]
    if not used:
        return project, project.camera.size_px, []
    if is_ghost_model_file(project.lens):
        raise ProjectError(f"{project.lens} is a measured flare and shows the field of its captures; omit {used[0]}")
    camera = project.camera
    remarks: list[str] = []
    squeeze = _squeeze(project)
    if named:
        assert flags.sensor is not None
        fixed = flags.size is not None or flags.project is not None or flags.resumed is not None
        camera, remarks = on_sensor(camera, camera_format(flags.sensor), squeeze, fixed)
    if flags.crop is not None:
        size = _cropped(camera.size_px, flags.crop)
        camera = _resized(camera, size, squeeze)
    counted = camera.size_px
    if flags.overscan is not None:
        camera = _resized(camera, _overscanned(counted, flags.overscan), squeeze)
        remarks.append(
            f"overscan: the picture is {camera.size_px[0]}x{camera.size_px[1]} pixels, the frame of "
            f"{counted[0]}x{counted[1]} in its middle"
        )
    return project.replace(camera=camera), counted, remarks


def _squeeze(project: Project) -> float:
    """Return the squeeze between the picture and the sensor: 1 for a picture that is as squeezed as the sensor."""
    if not project.camera.desqueeze:
        return 1.0
    if project.camera.squeeze is not None:
        return project.camera.squeeze
    from ...render.scene.resolve import open_lens

    return open_lens(project.lens).lens.squeeze or 1.0


def on_sensor(camera: Camera, known: CameraFormat, squeeze: float, fixed_size: bool) -> tuple[Camera, list[str]]:
    """Return a camera on the largest part of a sensor that has the proportions of the picture, and remarks.

    Parameters
    ----------
    camera : Camera
    known : CameraFormat
    squeeze : float
        Between picture and sensor, 1 for a picture that is not desqueezed.
    fixed_size : bool
        Whether the picture keeps its size; else it has the pixels of the sensor.
    """
    across, down = known.sensor_mm
    size = camera.size_px
    if not fixed_size:
        size = known.size_px or (_FILM_WIDTH_PX, max(1, round(_FILM_WIDTH_PX * down / across)))
        size = (round(size[0] * squeeze), size[1])
    # proportions of the picture on the sensor
    ratio = size[0] / (size[1] * squeeze)
    part = (across, across / ratio) if ratio >= across / down else (down * ratio, down)
    words = f"{known.title}: {size[0]}x{size[1]} pixels on {part[0]:.2f}x{part[1]:.2f} mm"
    if min(part[0] / across, part[1] / down) < 0.995:
        words += f", a part of its {across:.2f}x{down:.2f} mm with the proportions of the picture"
    elif not fixed_size:
        words += "; --size draws a smaller picture"
    return camera.replace(size_px=size, sensor_mm=part), [words]


def _resized(camera: Camera, size_px: tuple[int, int], squeeze: float) -> Camera:
    """Return a camera with another size of the same pixels around the axis."""
    width, height = camera.size_px
    across, down = camera.sensor
    if camera.sensor_mm is None and camera.desqueeze:
        # the default is 36 mm wide after desqueezing
        across = 36.0 / squeeze
    sensor = (across * size_px[0] / width, down * size_px[1] / height)
    resized: Camera = camera.replace(size_px=size_px, sensor_mm=sensor)
    return resized


def _cropped(size_px: tuple[int, int], text: str) -> tuple[int, int]:
    """Return the size that `--crop` leaves: WxH, or a percentage of both sides."""
    part = _PART.match(text)
    if part is not None and part[2] == "%":
        share = float(part[1]) / 100.0
        if not 0.0 < share <= 1.0:
            raise ProjectError(f"--crop {text!r} leaves no part of the picture; give 1% to 100%, or pixels: 1920x1080")
        return _even(size_px, share)
    if part is not None:
        raise ProjectError(f"--crop {text!r} is no part of the picture; give 80%, or the pixels that stay: 1920x1080")
    size = picture_size(text, "--crop")
    for own, whole, side in zip(size, size_px, ("wide", "high"), strict=True):
        if own > whole:
            raise ProjectError(f"--crop {text!r}: the picture is only {whole} pixels {side}; give at most {whole}")
        if (whole - own) % 2:
            raise ProjectError(
                f"--crop {text!r} cuts an odd number of the {whole} pixels, so the axis would lie in another part of a "
                f"pixel; give {own - 1 or own + 1}"
            )
    return size


def _overscanned(size_px: tuple[int, int], text: str) -> tuple[int, int]:
    """Return the size of a picture with overscan: a percentage of both sides, or pixels on each side."""
    part = _PART.match(text)
    if part is None:
        raise ProjectError(f"--overscan {text!r} is none; give 10% of the picture, or pixels on each side: 64px")
    value = float(part[1])
    if part[2] == "%":
        if not 0.0 <= value <= 400.0:
            raise ProjectError(f"--overscan {text!r} is too much; give 0% to 400%")
        return _even(size_px, 1.0 + value / 100.0)
    if value != int(value) or value > 32768:
        raise ProjectError(f"--overscan {text!r} is no number of pixels; give a whole number, or a percentage: 10%")
    return size_px[0] + 2 * int(value), size_px[1] + 2 * int(value)


def _even(size_px: tuple[int, int], factor: float) -> tuple[int, int]:
    """Return a size times a factor, rounded so that the same pixels are added or cut on both sides."""
    width, height = (max(side % 2 or 2, side + 2 * round(0.5 * side * (factor - 1.0))) for side in size_px)
    return width, height
