"""Find the light sources in a plate: connected areas above a threshold, each described by its sum and its moments.

A source keeps its light per channel exactly: the sums of all sources are the sum of the plate over the threshold. An
area that no rectangle resembles, such as a bent neon tube or two lamps that touch, is split until its parts do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..errors import ProjectError
from ..optics.colour.rgb import luminance_weights
from ..typing import Floats, Indices, Mask, Pixels

LUMINANCE = luminance_weights("rec709")
"""Luminance of linear Rec.709."""
# places at which a change of colour is searched
_CUTS = 8


@dataclass(frozen=True)
class SourceSettings:
    """How areas are described.

    Attributes
    ----------
    hot_factor : float
        A pixel inside an area that is this many times brighter than its brightest neighbour is a source by itself: a
        hot pixel, or a sparkle, must not move the centre of a lamp.
    split_px : float
        Areas of less than this width are never split.
    least_fill : float
        Split an area that fills less than this part of the rectangle with its moments.
    least_kurtosis : float
        Split an area whose light has a smaller kurtosis along its axis: a uniform bar has 1.8, two points have 1.
    colour_step : float
        Split an area whose halves differ more in the fraction of a channel.
    most_splits : int
        Depth to which an area is split.
    most_areas : int
        More are noise.
    """

    hot_factor: float = 8.0
    split_px: float = 8.0
    least_fill: float = 0.72
    least_kurtosis: float = 1.45
    colour_step: float = 0.15
    most_splits: int = 4
    most_areas: int = 20_000


@dataclass(frozen=True)
class Sources:
    """The sources of one frame.

    Attributes
    ----------
    centre_px : ndarray, shape (N, 2)
        Column and row of the centroid of the light; the centre of the first pixel is (0.5, 0.5).
    light : ndarray, shape (N, 3)
        Sum of the pixels' values.
    moments_px2 : ndarray, shape (N, 3)
        Second central moments xx, xy, yy of the light, pixels squared; those of one pixel are 1/12, 0, 1/12.
    peak : ndarray, shape (N,)
        Luminance of the brightest pixel of the whole area, without hot pixels.
    area_px : ndarray, shape (N,)
        Pixels of the whole area.
    """

    centre_px: Floats
    light: Floats
    moments_px2: Floats
    peak: Floats
    area_px: Floats

    def __len__(self) -> int:
        """Return the number of sources."""
        return len(self.peak)

    @property
    def table(self) -> Floats:
        """All values as one array, shape (N, 10)."""
        return np.column_stack([self.centre_px, self.light, self.moments_px2, self.peak, self.area_px])

    @classmethod
    def from_table(cls, table: Floats) -> Sources:
        """Return the sources of an array that `table` gave."""
        return cls(table[:, :2], table[:, 2:5], table[:, 5:8], table[:, 8], table[:, 9])


def plate_luminance(pixels: Pixels) -> Pixels:
    """Return the luminance of linear Rec.709 pixels, negative values as 0, shape (H, W)."""
    return np.maximum(pixels, 0.0) @ LUMINANCE.astype(np.float32)


def log_average_luminance(pixels: Pixels) -> float:
    """Return the geometric mean of the luminance of a plate, which a small bright sun hardly changes; 0 if it is black.

    Notes
    -----
    The "key" of Reinhard et al. (2002, equation 1); the luminance that keeps black pixels from the logarithm is a
    thousandth of the arithmetic mean.
    """
    luminance = plate_luminance(pixels)
    mean = float(luminance.mean(dtype=np.float64))
    if mean <= 0.0:
        return 0.0
    return float(np.exp(np.log(luminance + np.float32(1e-3 * mean)).mean(dtype=np.float64)))


def find_sources(
    pixels: Pixels,
    threshold: float,
    *,
    matte: Pixels | None = None,
    least_px: int = 1,
    settings: SourceSettings | None = None,
) -> Sources:
    """Find the sources of a plate.

    Parameters
    ----------
    pixels : ndarray, shape (H, W, 3)
        Linear Rec.709.
    threshold : float
        Luminance above which a pixel belongs to a source.
    matte : ndarray, shape (H, W), optional
        Factor of each pixel, 0 to 1.
    least_px : int
        Smaller areas are left out.
    settings : SourceSettings, optional

    Returns
    -------
    Sources
        In the order of the areas' first pixels, row by row.

    Raises
    ------
    ProjectError
        There are more areas than `SourceSettings.most_areas`.

    Notes
    -----
    With `least_px` of 1, the sums of `Sources.light` are the sums of the pixels above the threshold
    (tests/plates/test_detection.py).

    Examples
    --------
    >>> plate = np.zeros((8, 8, 3), np.float32)
    >>> plate[2:4, 3:5] = 5.0
    >>> found = find_sources(plate, 1.0)
    >>> found.centre_px.tolist(), found.light.tolist()
    ([[4.0, 3.0]], [[20.0, 20.0, 20.0]])
    """
    settings = settings or SourceSettings()
    values = np.maximum(pixels, np.float32(0.0))
    if matte is not None:
        values = values * matte[..., None]
    luminance = values @ LUMINANCE.astype(np.float32)
    over = luminance > threshold
    # neighbours by a side or a corner
    labels, count = ndimage.label(over, structure=np.ones((3, 3), dtype=np.int8))
    if count == 0:
        return Sources.from_table(np.zeros((0, 10)))
    areas = int((np.bincount(labels.ravel())[1:] >= least_px).sum())
    if areas > settings.most_areas:
        raise ProjectError(
            f"the plate has {areas} sources above {threshold:.3g}, which is noise; raise the threshold, or leave small "
            "ones out (--least-pixels 4)"
        )
    rows, columns = np.nonzero(over)
    order = np.argsort(labels[rows, columns], kind="stable")
    rows, columns = rows[order], columns[order]
    places = np.column_stack([columns + 0.5, rows + 0.5])
    light = values[rows, columns].astype(np.float64)
    bright = luminance[rows, columns].astype(np.float64)
    hot = _hot_pixels(luminance, over, rows, columns, settings.hot_factor)
    found = []
    ends = np.flatnonzero(np.diff(labels[rows, columns])) + 1
    for low, high in zip([0, *ends], [*ends, len(rows)], strict=True):
        if high - low >= least_px:
            part = slice(low, high)
            found += _sources_of(places[part], light[part], bright[part], hot[part], least_px, settings)
    return Sources.from_table(np.array(found).reshape(-1, 10))


def _hot_pixels(luminance: Pixels, over: Mask, rows: Indices, columns: Indices, factor: float) -> Floats:
    """Return the luminance that pixels inside areas would have without a defect; NaN for all others."""
    found = np.full(len(rows), np.nan)
    height, width = luminance.shape
    around = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    near = np.zeros((len(rows), 8))
    inside = np.zeros((len(rows), 8), dtype=np.bool_)
    for k, (i, j) in enumerate(around):
        row, column = np.clip(rows + i, 0, height - 1), np.clip(columns + j, 0, width - 1)
        # beyond the edge of the plate there is no neighbour
        there = (row == rows + i) & (column == columns + j)
        near[:, k] = np.where(there, luminance[row, column], 0.0)
        inside[:, k] = there & over[row, column]
    # three neighbours in the area: a lamp of one or two pixels is none
    hot = (luminance[rows, columns] > factor * near.max(axis=1)) & (inside.sum(axis=1) >= 3)
    found[hot] = np.median(near[hot], axis=1)
    return found


def _sources_of(
    places: Floats, light: Floats, bright: Floats, hot: Floats, least_px: int, settings: SourceSettings
) -> list[list[float]]:
    """Return the sources of one connected area as rows of `Sources.table`."""
    found: list[list[float]] = []
    defect = np.isfinite(hot)
    if defect.any():
        # what exceeds the neighbours is a point; the rest stays in the area
        kept = np.where(defect, hot / np.where(defect, bright, 1.0), 1.0)
        if least_px == 1:
            excess = (1.0 - kept)[:, None] * light
            found += [
                [*places[k], *excess[k], 1 / 12, 0.0, 1 / 12, bright[k] - hot[k], 1.0] for k in np.flatnonzero(defect)
            ]
        light, bright = kept[:, None] * light, kept * bright
    peak, area = float(bright.max()), float(len(places))
    for part in _split(places, light, bright, settings, settings.most_splits):
        centre, moments = _moments(places[part], bright[part])
        found.append([*centre, *light[part].sum(axis=0), *moments, peak, area])
    return found


def _split(places: Floats, light: Floats, bright: Floats, settings: SourceSettings, deep: int) -> list[Indices]:
    """Return the indices of the parts of an area."""
    everything: Indices = np.arange(len(places), dtype=np.intp)
    if deep == 0 or len(places) < settings.split_px:
        return [everything]
    centre, (xx, xy, yy) = _moments(places, bright)
    values, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    # sides of the uniform rectangle with these moments
    short, long = np.sqrt(12.0 * np.maximum(values, 0.0))
    if long < settings.split_px:
        return [everything]
    along = (places - centre) @ axes[:, 1]
    kurtosis = float(bright @ along**4) * float(bright.sum()) / float(bright @ along**2) ** 2
    cut, difference = _colour_cut(along, light)
    sparse = len(places) < settings.least_fill * short * long
    if difference > settings.colour_step:
        first = along < cut
    elif sparse or kurtosis < settings.least_kurtosis:
        first = along < 0.0
    else:
        return [everything]
    found = []
    for side in (np.flatnonzero(first), np.flatnonzero(~first)):
        parts = _split(places[side], light[side], bright[side], settings, deep - 1)
        found += [side[part] for part in parts]
    return found


def _colour_cut(along: Floats, light: Floats) -> tuple[float, float]:
    """Return where an area changes its colour most along its axis, and the difference of both sides in a channel."""
    best, cut, difference = 0.0, 0.0, 0.0
    low, high = float(along.min()), float(along.max())
    whole = light.sum(axis=0)
    for at in low + (high - low) * np.arange(1, _CUTS) / _CUTS:
        one = light[along < at].sum(axis=0)
        other = whole - one
        if min(one.sum(), other.sum()) <= 0.0:
            continue
        apart = float(np.abs(one / one.sum() - other / other.sum()).max())
        # a few pixels of another colour at an end are no part
        score = apart * float(one.sum() * other.sum()) ** 0.5
        if score > best:
            best, cut, difference = score, float(at), apart
    return cut, difference


def _moments(places: Floats, weights: Floats) -> tuple[Floats, tuple[float, float, float]]:
    """Return the centroid, and the second central moments with those of a pixel."""
    total = float(weights.sum())
    centre = weights @ places / total
    x, y = (places - centre).T
    return centre, (
        float(weights @ (x * x)) / total + 1 / 12,
        float(weights @ (x * y)) / total,
        float(weights @ (y * y)) / total + 1 / 12,
    )
