"""An iris given as an image: multiply the light of polygons by the image's transmittance at each place of the stop.

`kernels.raster.stop_pattern.weave` multiplies pixel by pixel. The image is stored as a pyramid, each level at half the
resolution of the one before (`optics.pupil.mask_levels`), so that a pixel reads about the mean of the area it covers.
Where a summed-area table of the image's changes shows that the image is constant, no look-up is needed.
"""

from __future__ import annotations

from math import floor, log2
from typing import NamedTuple

import numpy as np

from ...typing import Floats
from ..jit.decorators import borrowing, inner
from ..tracing.clip import PSTOP, cut_to_rectangle, slope_over
from .polygons import fill_polygon, plane_size
from .stop_pattern import (
    AT_X,
    AT_Y,
    COLUMNS,
    CORNERS,
    FIRST,
    OPEN,
    PER_MM_X,
    PER_MM_Y,
    PICTURE,
    ROWS,
    TABLE_COLUMNS,
    U_LOW,
    WAY,
    pattern_value,
    room_to_weave,
)

# sample spacing of the chosen level over a pixel's extent in the stop, to the nearest octave: linear interpolation then
# blurs about as much as the mean over a pixel
LEVEL = 0.58


class StopArrays(NamedTuple):
    """The stop and the opening of the iris in it.

    Attributes
    ----------
    row : int
        Of the stop.
    blades : ndarray, shape (B, 4)
        Edges of the iris in the upright frame (`optics.pupil.iris.blade_edges`).
    mask : ndarray, shape (R, C), or None
        Transmittance (`mask_value`).
    half : float
        Half the side of the mask, mm.
    """

    row: int
    blades: Floats
    mask: Floats | None
    half: float


@borrowing
def mask_value(mask, half, u, v):
    """Interpolate a mask over the square [-half, half] x [-half, half], row 0 at +v; 0 outside."""
    rows, columns = mask.shape
    x = (u / half + 1.0) * 0.5 * columns - 0.5
    y = (1.0 - v / half) * 0.5 * rows - 0.5
    if x < -0.5 or y < -0.5 or x > columns - 0.5 or y > rows - 0.5:
        return 0.0
    x, y = min(max(x, 0.0), columns - 1.0), min(max(y, 0.0), rows - 1.0)
    c, r = min(int(floor(x)), columns - 2), min(int(floor(y)), rows - 2)
    fx, fy = x - c, y - r
    upper = mask[r, c] * (1.0 - fx) + mask[r, c + 1] * fx
    lower = mask[r + 1, c] * (1.0 - fx) + mask[r + 1, c + 1] * fx
    return upper * (1.0 - fy) + lower * fy


@inner
def transmittance(mask, half, u, v):
    """Return the transmittance of a mask as `mask_value`, or 1 if there is none.

    The compiler drops a branch on an argument that is None, but not one on a field of a record.
    """
    if mask is None:
        return 1.0
    return mask_value(mask, half, u, v)


@inner
def mask_texture(mask, crossings, width):
    """Return the `texture` argument of `fill_polygon` for a picture of a width in pixels."""
    places, light, where, beside, below = room_to_weave(crossings, width)
    table = np.empty((crossings, TABLE_COLUMNS))
    for k in range(crossings):
        for m in range(TABLE_COLUMNS):
            table[k, m] = 0.0
    return mask[0], table, np.empty((0, 2)), places, light, where, beside, below


@borrowing
def even_value(mask, u_low, u_high, v_low, v_high):
    """Return the mask's value if it is constant over a rectangle of the stop, else -1."""
    values, levels, changes = mask
    rows, columns = changes.shape
    left, right = u_low * levels[0, PER_MM_X] + levels[0, AT_X], u_high * levels[0, PER_MM_X] + levels[0, AT_X]
    # the image's first row is up
    top, bottom = v_high * levels[0, PER_MM_Y] + levels[0, AT_Y], v_low * levels[0, PER_MM_Y] + levels[0, AT_Y]
    if right < -0.5 or left > columns - 0.5 or bottom < -0.5 or top > rows - 0.5:
        return 0.0
    c0, c1 = int(min(max(floor(left), 0.0), columns - 1.0)), int(min(max(floor(right) + 1.0, 0.0), columns - 1.0))
    r0, r1 = int(min(max(floor(top), 0.0), rows - 1.0)), int(min(max(floor(bottom) + 1.0, 0.0), rows - 1.0))
    # the outer half of the border's samples lies in no interval between samples: take the nearest
    c0, c1 = max(min(c0, columns - 2), 0), min(max(c1, 1), columns - 1)
    r0, r1 = max(min(r0, rows - 2), 0), min(max(r1, 1), rows - 1)
    if changes[r1, c1] - changes[r0, c1] - changes[r1, c0] + changes[r0, c0] != 0:
        return -1.0
    return float(values[r0 * columns + c0])


@borrowing
def place_mask(polygon, count, crossings, corner, stops, mask, texture):
    """Set up the mask look-up over a polygon; return the factor that is constant over it, 0 where the mask is dark.

    Parameters
    ----------
    polygon : ndarray, shape (V, 6 + 2 C)
        Vertices in pixels with their places in the stop (`kernels.tracing.clip`).
    count, crossings : int
        Number of vertices; number of crossings of the stop.
    corner : ndarray, shape (3, >= 2)
        Three points in pixels that are not on a line.
    stops : ndarray, shape (C, >= 3, 2)
        The places of these points in the stop.
    mask, texture
        As in `fill_through_mask`.
    """
    table, places = texture[1], texture[3]
    x1, y1 = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1]
    x2, y2 = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1]
    inverse = 1.0 / (x1 * y2 - x2 * y1)
    alike = 1.0
    for c in range(places.shape[0]):
        places[c, WAY] = OPEN
    for c in range(crossings):
        for q in range(2):
            low, high = np.inf, -np.inf
            for k in range(count):
                low, high = min(low, polygon[k, PSTOP + 2 * c + q]), max(high, polygon[k, PSTOP + 2 * c + q])
            places[c, U_LOW + 2 * q], places[c, U_LOW + 2 * q + 1] = low, high
        u_low, u_high, v_low, v_high = (
            places[c, U_LOW],
            places[c, U_LOW + 1],
            places[c, U_LOW + 2],
            places[c, U_LOW + 3],
        )
        value = even_value(mask, u_low, u_high, v_low, v_high)
        if value == 0.0:
            return 0.0
        if value > 0.0:
            alike *= value
            continue
        covered = 0.0
        for q in range(2):
            d0, d1, d2 = stops[c, 0, q], stops[c, 1, q], stops[c, 2, q]
            gx, gy = slope_over(x1, y1, x2, y2, inverse, d1 - d0, d2 - d0)
            places[c, 3 * q] = d0 - gx * corner[0, 0] - gy * corner[0, 1]
            places[c, 3 * q + 1], places[c, 3 * q + 2] = gx, gy
            # a pixel covers at most the extent of the polygon
            extent = min(max(abs(gx), abs(gy)), places[c, U_LOW + 2 * q + 1] - places[c, U_LOW + 2 * q])
            covered = max(covered, extent * abs(mask[1][0, PER_MM_X if q == 0 else PER_MM_Y]))
        places[c, WAY] = PICTURE
        take_level(mask, table, c, covered)
    return alike


@borrowing
def take_level(mask, table, c, covered):
    """Fill a crossing's row of the table with the mask level for pixels that cover `covered` samples of the mask."""
    level = 0
    if LEVEL * covered > 1.0:
        level = int(min(floor(log2(LEVEL * covered) + 0.5), mask[1].shape[0] - 1.0))
    for m in (FIRST, ROWS, COLUMNS, PER_MM_X, PER_MM_Y, AT_X, AT_Y):
        table[c, m] = mask[1][level, m]
    # -1 marks the pattern as a picture
    table[c, CORNERS] = -1.0


@borrowing
def fill_through_mask(
    polygon, count, crossings, corner, stops, mask, texture, density, gx, gy, density_low, density_high, rgb, plane,
    other, values,
):  # fmt: skip
    """Draw a polygon as `fill_polygon` does, with its light multiplied by the mask at every crossing of the stop.

    Parameters
    ----------
    polygon : ndarray, shape (V, 6 + 2 C)
        Vertices in pixels with their places in the stop (`kernels.tracing.clip`); may reach outside the picture.
    count, crossings, corner, stops
        As in `place_mask`.
    mask : tuple of ndarray
        Levels of the mask, their table, and the summed-area table of its changes (`optics.pupil.mask_levels`).
    texture : tuple of ndarray
        From `mask_texture`; changed.
    density ... plane
        As in `fill_polygon`.
    other, values
        Scratch, as in `kernels.tracing.clip.clip_triangle`.

    Notes
    -----
    Over a polygon the places in the stop are linear functions of the pixel coordinates.
    """
    alike = place_mask(polygon, count, crossings, corner, stops, mask, texture)
    if alike == 0.0:
        return
    height, width = plane_size(plane)
    count = cut_to_rectangle(polygon, count, other, values, float(width), float(height))
    if count >= 3:
        fill_polygon(
            polygon, count, density * alike, gx * alike, gy * alike, density_low * alike, density_high * alike, rgb,
            plane, texture,
        )  # fmt: skip


@borrowing
def masked_point(polygon, crossings, mask, texture):
    """Return the mask's transmittance at the first vertex of a polygon, multiplied over the crossings."""
    part = 1.0
    for c in range(crossings):
        take_level(mask, texture[1], c, 0.0)
        u, v = polygon[0, PSTOP + 2 * c], polygon[0, PSTOP + 2 * c + 1]
        part *= pattern_value(texture[0], texture[1], texture[2], c, u, v)
    return part
