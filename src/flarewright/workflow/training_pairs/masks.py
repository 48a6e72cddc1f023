"""Masks of training pairs: which pixels show a light itself, and which show a ghost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...model import Layer, Light
from ...model.layer import part_inside
from ...optics.colour.rgb import brightest_channel, luminance_weights, xyz_to_rgb_matrix
from ...optics.colour.spectrum import spectrum_xyz
from ...typing import Floats, Pixels

# radius of a disc with the area of a pixel: a point's image
_POINT_PX = 0.5642
# a larger disc's area is right to 0.1 % without correction
_SMALL_PX = 8.0
# a starburst clips mostly nearer to the light than this
_FIRST_REACH_PX = 16.0


@dataclass(frozen=True)
class LightImage:
    """The sharp image of a light.

    Attributes
    ----------
    number : int
        From 1.
    place_px : tuple of float
        Column and row of its centre; the first pixel's centre is (0.5, 0.5).
    radius_px : float
        Up and down.
    radiance : ndarray, shape (3,)
        Linear Rec.709, in the unit of the background.
    stretch : float
        Its radius across over that down: a squeezed picture shows a disc as an oval.
    """

    number: int
    place_px: tuple[float, float]
    radius_px: float
    radiance: Floats
    stretch: float = 1.0

    def inside(self, size_px: tuple[int, int]) -> bool:
        """Return whether the centre is in the picture."""
        return all(0.0 <= at < side for at, side in zip(self.place_px, size_px, strict=True))

    def coverage(self, size_px: tuple[int, int]) -> tuple[tuple[slice, slice], Pixels]:
        """Return the window of the disc, and the part of each of its pixels that the disc covers (to about 1 %)."""
        spans, offsets = [], []
        for at, side, stretch in zip(self.place_px, size_px, (self.stretch, 1.0), strict=True):
            reach = self.radius_px * stretch + 1.0
            low, high = int(np.floor(at - reach)), int(np.ceil(at + reach))
            inside = max(0, low), max(0, low, min(side, high))
            spans.append(slice(*inside))
            # a small disc is drawn whole, so that its area is known, and then cropped
            first, last = (low, high) if self.radius_px < _SMALL_PX else inside
            offsets.append((np.arange(first, last) + 0.5 - at, slice(inside[0] - first, inside[1] - first)))
        (x, columns), (y, rows) = offsets
        cover = np.clip(self.radius_px - np.hypot(x[None, :] / self.stretch, y[:, None]) + 0.5, 0.0, 1.0)
        if self.radius_px < _SMALL_PX:
            cover *= np.pi * self.radius_px**2 * self.stretch / cover.sum()
        return (spans[1], spans[0]), cover[rows, columns].astype(np.float32)


def light_image(
    light: Light,
    number: int,
    place_mm: Sequence[float],
    efl: tuple[float, float],
    size_px: tuple[int, int],
    sensor_mm: Sequence[float],
) -> LightImage:
    """Return the sharp image of a light.

    Parameters
    ----------
    light : Light
        Its intensity is in the unit of the background, times steradians.
    number : int
    place_mm : sequence of float
        Right and up from the middle of the sensor, from the traced direct image.
    efl : tuple of float
        Focal lengths across and down the picture, mm.
    size_px, sensor_mm
        Of the picture.

    Returns
    -------
    LightImage
        A point's is a disc with the area of a pixel, with the same irradiance.
    """
    zoom = [side / mm for side, mm in zip(size_px, sensor_mm, strict=True)]
    place = (0.5 * size_px[0] + place_mm[0] * zoom[0], 0.5 * size_px[1] - place_mm[1] * zoom[1])
    across, down = (length * each for length, each in zip(efl, zoom, strict=True))
    stretch = across / down
    radius = max(_POINT_PX / sqrt(stretch), down * float(np.tan(np.radians(0.5 * light.diameter_deg))))
    steradians = np.pi * (radius / down) ** 2
    # of luminance one; deep reds lie outside Rec.709
    rgb = np.maximum(xyz_to_rgb_matrix("rec709") @ spectrum_xyz(light.spectrum), 0.0)
    return LightImage(number, place, radius, light.intensity / steradians * rgb, stretch)


def light_mask(images: Sequence[LightImage], starburst: Pixels) -> NDArray[np.uint8]:
    """Return the number of the light that each pixel shows, 0 for none.

    Parameters
    ----------
    images : sequence of LightImage
    starburst : ndarray, shape (H, W, 3)
        White at 1.

    Returns
    -------
    ndarray, shape (H, W), uint8
        A light covers its sharp image, and the largest disc around it in which the starburst clips everywhere: its
        spikes are flare. Where two lights do, the nearest counts.
    """
    high, wide = starburst.shape[:2]
    found = np.zeros((high, wide), np.uint8)
    nearest = np.full((high, wide), np.inf, np.float32)
    for image in images:
        radius = image.radius_px
        if image.inside((wide, high)):
            radius = _clipped_radius(image, starburst)
        rows, columns = _window(image, radius, (wide, high))
        far = _distances(image, rows, columns)
        mine = (far < radius) & (far < nearest[rows, columns])
        found[rows, columns][mine], nearest[rows, columns][mine] = image.number, far[mine]
    return found


def _clipped_radius(image: LightImage, starburst: Pixels) -> float:
    """Return the radius of the disc in which a starburst clips everywhere, at least that of the light's image."""
    high, wide = starburst.shape[:2]
    reach = max(_FIRST_REACH_PX, image.radius_px)
    while True:
        rows, columns = _window(image, reach, (wide, high))
        far = _distances(image, rows, columns)
        dark = brightest_channel(starburst[rows, columns]) < 1.0
        end = float(far[dark].min(initial=np.inf))
        whole = (rows, columns) == (slice(0, high), slice(0, wide))
        # a pixel outside the window may be nearer than one in its corners
        if end <= reach or whole:
            break
        reach *= 4.0
    if not np.isfinite(end):
        end = float(far.max() + 1.0)
    # at least the pixel in which a small disc lies
    return max(image.radius_px, float(far.min()) + 1e-3, end - 0.5)


def _window(image: LightImage, radius: float, size_px: tuple[int, int]) -> tuple[slice, slice]:
    """Return the rows and columns of a picture in which all pixels this near to a light's place lie."""
    spans = []
    for at, side, stretch in zip(image.place_px, size_px, (image.stretch, 1.0), strict=True):
        # a light beside the picture may be far away
        low, high = (
            min(max(edge, -1.0), side + 1.0) for edge in (at - radius * stretch - 1.0, at + radius * stretch + 1.0)
        )
        first = min(max(int(np.floor(low)), 0), side)
        spans.append(slice(first, max(first, min(int(np.ceil(high)), side))))
    return spans[1], spans[0]


def _distances(image: LightImage, rows: slice, columns: slice) -> Pixels:
    """Return the distances of some pixels' centres from a light's place, pixels up and down."""
    y, x = (np.arange(span.start, span.stop, dtype="f4") + 0.5 for span in (rows, columns))
    place, stretch = np.array(image.place_px, "f4"), np.float32(image.stretch)
    far: Pixels = np.hypot((x[None, :] - place[0]) / stretch, y[:, None] - place[1])
    return far


def ghost_mask(
    ghosts: Sequence[Layer], size_px: tuple[int, int], scale: float, threshold: float
) -> tuple[NDArray[np.uint8], list[dict[str, Any]]]:
    """Return which ghost each pixel shows, and a list of the ghosts.

    Parameters
    ----------
    ghosts : sequence of Layer
        Single ghosts, "ghost.7-3".
    size_px : tuple of int
    scale : float
        Multiplies their pixels; white is then 1.
    threshold : float
        A ghost covers the pixels where its luminance is at least this.

    Returns
    -------
    mask : ndarray, shape (H, W), uint8
        Identifier of the brightest ghost that covers the pixel, 0 for none.
    listed : list of dict
        The ghosts that cover any pixel, by falling flux: "id" from 1, "name", "box" [left, top, width, height] and
        "pixels" of its whole area, also where another ghost is brighter, "peak" and "mean" luminance there.
    """
    weights = (luminance_weights("rec709") * scale).astype(np.float32)
    mask = np.zeros((size_px[1], size_px[0]), np.uint8)
    best = np.zeros((size_px[1], size_px[0]), np.float32)
    listed: list[dict[str, Any]] = []
    planes = [(layer, layer.pixels @ weights) for layer in ghosts]
    planes.sort(key=lambda pair: -float(pair[1].sum(dtype=np.float64)))
    for layer, plane in planes:
        x, y, *_ = layer.window
        left, top, right, bottom = part_inside(layer.window, size_px)
        seen = plane[top - y : max(top, bottom) - y, left - x : max(left, right) - x]
        covers = seen >= threshold
        if not covers.any():
            continue
        rows, columns = np.flatnonzero(covers.any(axis=1)), np.flatnonzero(covers.any(axis=0))
        light = seen[covers]
        listed.append(
            {
                "id": len(listed) + 1,
                "name": layer.name.removeprefix("ghost."),
                "box": [
                    left + int(columns[0]), top + int(rows[0]),
                    int(columns[-1] - columns[0]) + 1, int(rows[-1] - rows[0]) + 1,
                ],
                "pixels": int(light.size),
                "peak": float(light.max()),
                "mean": float(light.mean(dtype=np.float64)),
            }
        )  # fmt: skip
        inside = (slice(top, bottom), slice(left, right))
        brighter = covers & (seen > best[inside])
        mask[inside][brighter], best[inside][brighter] = len(listed), seen[brighter]
    return mask, listed
