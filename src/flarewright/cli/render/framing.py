"""`--sensor NAME`, `--crop` and `--overscan`: the part of the image plane that the picture shows."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ...errors import ProjectError
from ..common import picture_size

if TYPE_CHECKING:
    from ...io.project.camera_list import CameraFormat
    from ...model import Holdout, Project
    from .options.record import RenderOptions

# width of a picture of film, which has no pixels
_FILM_WIDTH_PX = 1280
_PART = re.compile(r"^\s*(\d+(?:\.\d+)?)\s*(%|px)?\s*$")


def framed(project: Project, flags: RenderOptions) -> tuple[Project, tuple[int, int], list[str]]:
    """Return a project with the sensor and the frame of the flags.

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
    from ...io.files.file_kind import is_ghost_model_file
    from ...io.project.camera_list import camera_format, is_camera_name
    from .project_flags import project_of

    named = flags.sensor is not None and is_camera_name(flags.sensor)
    given = {"--crop": flags.crop, "--overscan": flags.overscan, "--sensor NAME": flags.sensor if named else None}
    used = [flag for flag, value in given.items() if value is not None]
    if not used:
        return project, project.camera.size_px, []
    if is_ghost_model_file(project.lens):
        raise ProjectError(f"{project.lens} is a measured flare and shows the field of its captures; omit {used[0]}")
    squeeze = _squeeze(project)
    size = project.camera.size_px
    # the default sensor is 36 mm wide after desqueezing
    sensor = project.camera.replace(squeeze=squeeze).sensor if project.camera.desqueeze else project.camera.sensor
    remarks: list[str] = []
    if named:
        fixed = flags.size is not None or flags.project is not None
        size, sensor, words = on_sensor(camera_format(flags.sensor or ""), size if fixed else None, squeeze)
        remarks.append(words)
    counted = size if flags.crop is None else _cropped(size, flags.crop)
    sensor = _scaled(sensor, size, counted)
    size = counted if flags.overscan is None else _overscanned(counted, flags.overscan)
    sensor = _scaled(sensor, counted, size)
    if size != counted:
        remarks.append(
            f"overscan: the picture is {size[0]}x{size[1]} pixels, the frame of {counted[0]}x{counted[1]} in its middle"
        )
    camera = {**dict(project.camera), "size_px": size, "sensor_mm": sensor}
    project = project if size == counted else _with_frame(project, counted, size)
    return project_of({**dict(project), "camera": camera}), counted, remarks


def _with_frame(project: Project, frame_px: tuple[int, int], size_px: tuple[int, int]) -> Project:
    """Return a project whose holdouts lie over the frame in the middle of a picture with overscan."""
    shrunk = (frame_px[0] / size_px[0], frame_px[1] / size_px[1])

    def placed(holdout: Holdout | None) -> Holdout | None:
        if holdout is None:
            return None
        return holdout.replace(frame=tuple(own * part for own, part in zip(holdout.frame, shrunk, strict=True)))

    lights = tuple(light.replace(holdout=placed(light.holdout)) for light in project.lights)
    found: Project = project.replace(holdout=placed(project.holdout), lights=lights)
    return found


def on_sensor(
    known: CameraFormat, size_px: tuple[int, int] | None, squeeze: float = 1.0
) -> tuple[tuple[int, int], tuple[float, float], str]:
    """Return the largest part of a sensor that has the proportions of a picture.

    Parameters
    ----------
    known : CameraFormat
    size_px : tuple of int or None
        Size of the picture; None: the pixels of the sensor.
    squeeze : float
        Between picture and sensor, 1 for a picture that is not desqueezed.

    Returns
    -------
    size_px : tuple of int
    sensor_mm : tuple of float
        Width and height of the part.
    remark : str
    """
    across, down = known.sensor_mm
    if size_px is None:
        width, height = known.size_px or (_FILM_WIDTH_PX, max(1, round(_FILM_WIDTH_PX * down / across)))
        size = (round(width * squeeze), height)
    else:
        size = size_px
    # proportions of the picture on the sensor
    ratio = size[0] / (size[1] * squeeze)
    part = (across, across / ratio) if ratio >= across / down else (down * ratio, down)
    words = f"{known.title}: {size[0]}x{size[1]} pixels on {part[0]:.2f}x{part[1]:.2f} mm"
    if min(part[0] / across, part[1] / down) < 0.995:
        words += f", a part of its {across:.2f}x{down:.2f} mm with the proportions of the picture"
    elif size_px is None:
        words += "; --size draws a smaller picture"
    return size, part, words


def _squeeze(project: Project) -> float:
    """Return the squeeze between the picture and the sensor: 1 for a picture that is as squeezed as the sensor."""
    if not project.camera.desqueeze:
        return 1.0
    if project.camera.squeeze is not None:
        return project.camera.squeeze
    from ...render.scene.resolve import open_lens

    return open_lens(project.lens).lens.squeeze or 1.0


def _scaled(sensor: tuple[float, float], size_px: tuple[int, int], new_px: tuple[int, int]) -> tuple[float, float]:
    """Return the sensor of a picture with another number of the same pixels around the axis."""
    return sensor[0] * new_px[0] / size_px[0], sensor[1] * new_px[1] / size_px[1]


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
