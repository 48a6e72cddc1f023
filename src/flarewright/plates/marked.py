"""A picture of a plate with the lights that were found in it: outlines and a number each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..typing import Floats
from .lights import PlateTracks

# display codes of the marks, and of the plate under them
_MARK, _DIMMED = (60, 230, 90), 0.6
# least half width of an outline, and its distance from the light, pixels
_LEAST, _APART = 4.0, 2.0


def light_rows(plate: PlateTracks, frame: int) -> list[dict[str, float | int | str]]:
    """Return the lights of a frame in the plate's pixels and values, the brightest first.

    Returns
    -------
    list of dict
        "light" (number), "kind" (point, disc, rectangle, or joined of many), "x", "y", "width", "height" in pixels,
        "rotation_deg", "r", "g", "b" (sums of pixel values), and "share" of the light of the frame.
    """
    tracks = plate.tracks
    at = int(np.searchsorted(tracks.frames, frame).clip(0, len(tracks.frames) - 1))
    light = tracks.light[:, at]
    sums = light.sum(axis=1)
    rows: list[dict[str, float | int | str]] = []
    for k in sorted(np.flatnonzero(sums > 0.0), key=lambda k: (-sums[k], k)):
        kind = "point" if not plate.extended[k] else "disc" if plate.round[k] else "rectangle"
        kind = "joined" if k >= len(tracks) - plate.joined else kind
        sides, angle = _disc(tracks.moments_px2[k, at]) if kind == "disc" else _sides(tracks.moments_px2[k, at])
        x, y = tracks.centre_px[k, at]
        r, g, b = light[k]
        rows.append(
            {
                "light": int(k) + 1, "kind": kind, "x": round(float(x), 3), "y": round(float(y), 3),
                "width": round(float(sides[0]), 3), "height": round(float(sides[1]), 3),
                "rotation_deg": round(angle, 2), "r": float(r), "g": float(g), "b": float(b),
                "share": float(sums[k] / sums.sum()),
            }
        )  # fmt: skip
    return rows


def _disc(moments: Floats) -> tuple[Floats, float]:
    """Return the diameter of the disc with second moments, twice, and no angle; as `lights.lights_at` draws it."""
    xx, _, yy = moments
    return np.full(2, 4.0 * np.sqrt(0.5 * (xx + yy))), 0.0


def _sides(moments: Floats) -> tuple[Floats, float]:
    """Return the sides of the rectangle with second moments, and its angle in the upright picture, degrees."""
    xx, xy, yy = moments
    values, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    angle = float(np.degrees(np.arctan2(-axes[1, 1], axes[0, 1])))
    return np.sqrt(12.0 * np.maximum(values[::-1], 0.0)), (angle + 90.0) % 180.0 - 90.0


def marked_plate(codes: NDArray[np.uint8], plate: PlateTracks, frame: int) -> NDArray[np.uint8]:
    """Return a plate with an outline and a number for each light.

    Parameters
    ----------
    codes : ndarray, shape (H, W, 3), uint8
        The plate as displayed.
    plate : PlateTracks
    frame : int

    Returns
    -------
    ndarray, shape (H, W, 3), uint8
    """
    from PIL import Image, ImageDraw

    image = Image.fromarray((codes * _DIMMED).astype(np.uint8))
    draw = ImageDraw.Draw(image)
    for row in light_rows(plate, frame):
        x, y, angle = (float(row[name]) for name in ("x", "y", "rotation_deg"))
        half = [max(0.5 * float(row[name]) + _APART, _LEAST) for name in ("width", "height")]
        if row["kind"] == "rectangle":
            turn = np.radians(-angle)
            axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half @ axes + [x, y]
            draw.polygon([(float(a), float(b)) for a, b in corners], outline=_MARK)
        else:
            draw.ellipse((x - half[0], y - half[0], x + half[0], y + half[0]), outline=_MARK)
        draw.text((x + 0.7 * half[0] + 2, y - min(half) - 9), str(row["light"]), fill=_MARK)
    return np.asarray(image)
