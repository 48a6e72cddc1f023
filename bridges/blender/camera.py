"""The picture of a perspective camera: the size of its pixels, the place of its axis, and what of it is drawn."""

from typing import Any, NamedTuple

from .vectors import Matrix


class CameraView(NamedTuple):
    """A perspective camera and the picture that it renders.

    Attributes
    ----------
    focal_mm : float
    sensor_mm : tuple of float
        Width and height as the camera states them; the picture uses one of both.
    fit : str
        "AUTO", "HORIZONTAL" or "VERTICAL".
    shift : tuple of float
        Right and up, parts of the side of the picture that fits the sensor.
    size_px : tuple of int
        Of the whole picture.
    pixel_aspect : tuple of float
        Width and height of a pixel.
    region : tuple of int
        Left, bottom, right and top of the part that is rendered, pixels from the bottom left corner.
    """

    focal_mm: float
    sensor_mm: tuple[float, float]
    fit: str
    shift: tuple[float, float]
    size_px: tuple[int, int]
    pixel_aspect: tuple[float, float]
    region: tuple[int, int, int, int]


class Window(NamedTuple):
    """The picture that is drawn.

    Its middle is the axis of the lens, about which ghosts are mirrored, and it holds the rendered part.

    Attributes
    ----------
    left, bottom : int
        Pixels from the bottom left corner of the whole picture; may be negative.
    size_px : tuple of int
    offset_px : tuple of float
        From the middle of the rendered picture to that of the window, right and up.
    """

    left: int
    bottom: int
    size_px: tuple[int, int]
    offset_px: tuple[float, float]


def pixel_mm(view: CameraView) -> tuple[float, float]:
    """Return width and height of a pixel on the sensor, mm.

    The side that fits the sensor is the longer one for "AUTO"; the sensor's height counts for "VERTICAL" only.
    """
    across, down = (side * aspect for side, aspect in zip(view.size_px, view.pixel_aspect, strict=True))
    fits_width = view.fit == "HORIZONTAL" or (view.fit == "AUTO" and across >= down)
    sensor = view.sensor_mm[1] if view.fit == "VERTICAL" else view.sensor_mm[0]
    scale = sensor / (across if fits_width else down)
    return view.pixel_aspect[0] * scale, view.pixel_aspect[1] * scale


def axis_px(view: CameraView) -> tuple[float, float]:
    """Return the place of the lens' axis, pixels from the bottom left corner of the whole picture."""
    wide, high = pixel_mm(view)
    sensor = view.sensor_mm[1] if view.fit == "VERTICAL" else view.sensor_mm[0]
    return (
        0.5 * view.size_px[0] - view.shift[0] * sensor / wide,
        0.5 * view.size_px[1] - view.shift[1] * sensor / high,
    )


def drawn_window(view: CameraView) -> Window:
    """Return the window of a picture: the smallest one around its axis that holds what is rendered.

    Its sides differ from those of the rendered part by even numbers, so that whole pixels lie on whole pixels.
    """
    axis = axis_px(view)
    spans = []
    for low, high, middle in ((*view.region[::2], axis[0]), (*view.region[1::2], axis[1])):
        # half a pixel beside the axis moves nothing that is seen; a window of other parity blurs all
        more = 2 * round(0.5 * abs(low + high - 2.0 * middle))
        spans.append((low - more, high) if low + high > 2.0 * middle else (low, high + more))
    (left, right), (bottom, top) = spans
    x0, y0, x1, y1 = view.region
    offset = (0.5 * (left + right - x0 - x1), 0.5 * (bottom + top - y0 - y1))
    return Window(left, bottom, (right - left, top - bottom), offset)


def camera_state(frame: int, matrix: Matrix, view: CameraView, window: Window) -> dict[str, Any]:
    """Return a camera at a frame, as the file has it."""
    wide, high = pixel_mm(view)
    axis = axis_px(view)
    width, height = window.size_px
    return {
        "frame": frame,
        "matrix": [list(row) for row in matrix],
        "focal_mm": view.focal_mm,
        "sensor_mm": [width * wide, height * high],
        "axis": [(axis[0] - window.left) / width, 1.0 - (axis[1] - window.bottom) / height],
    }
