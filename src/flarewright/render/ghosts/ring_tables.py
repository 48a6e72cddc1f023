"""Rings at the blades of an iris from tables of edges and corners, laid out for the kernel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.raster import stop_pattern as columns
from ...model import Light
from ...model.project.light import Lines
from ...optics.diffraction.edge_patterns import (
    CORNER_SAMPLES,
    EDGE_SAMPLES,
    PROFILE_SAMPLES,
    EdgeTables,
    averaged,
    gain,
    sharp_tables,
)
from ...optics.diffraction.fresnel import REACH, SHADOW, Box
from ...optics.pupil.blade_form import BladeForm
from ...typing import Floats, Pixels

SHORTEST = 5.0
"""Least half length and offset of a blade, in sqrt(lambda L / 2), for which the tables are accurate."""

FINE = 0.02
"""Allowed error of positions in the stop, in sqrt(lambda L / 2), for drawing a cell as one polygon."""


@dataclass(frozen=True)
class Piece:
    """The patterns of one crossing of the stop, for drawing.

    Attributes
    ----------
    values : ndarray, shape (P,), float32
        The patterns, flattened.
    row : ndarray, shape (TABLE_COLUMNS,)
        Their layout in `values` (`kernels.raster.stop_pattern`).
    gain : float
        Factor of the light.
    """

    values: Pixels
    row: Floats
    gain: float = 1.0


@dataclass(frozen=True)
class EdgeCrossing:
    """A crossing of the stop whose pattern comes from edge tables, before the choice of a wavelength.

    Attributes
    ----------
    form : BladeForm
    wavelengths_nm : ndarray, shape (W,)
        The traced wavelengths.
    area : ndarray, shape (W,)
        lambda L at these, mm^2; all of one sign.
    pixel_mm : float
        Side of a pixel in the stop.
    reach : float
        Largest distance of light from the centre of the stop, mm.
    """

    form: BladeForm
    wavelengths_nm: Floats
    area: Floats
    pixel_mm: float
    reach: float

    def pieces(self, bands: Sequence[tuple[Floats, Floats]]) -> list[Piece]:
        """Average the pattern over bands.

        Parameters
        ----------
        bands : sequence of (ndarray, ndarray)
            Wavelengths of each band in nm, and their shares of its light, which sum to 1.

        Returns
        -------
        list of Piece
        """
        waves, shares = (np.concatenate(column) for column in zip(*bands, strict=True))
        first = np.cumsum([0, *(len(band) for band, _ in bands)])[:-1]
        squared = 0.5 * np.interp(waves, self.wavelengths_nm, np.abs(self.area) / self.wavelengths_nm) * waves
        logs = 0.5 * np.log(squared)
        scales = np.sqrt(np.add.reduceat(shares * squared, first))
        middle, square = (np.add.reduceat(shares * values, first) for values in (logs, logs**2))
        spreads = np.sqrt(np.maximum(square - middle**2, 0.0))
        return [self._piece(scale, spread) for scale, spread in zip(scales.tolist(), spreads.tolist(), strict=True)]

    def _piece(self, scale: float, spread: float) -> Piece:
        tables = averaged(self.form, scale, spread, self.pixel_mm / scale)
        margin = len(tables.profile) // 2 / PROFILE_SAMPLES
        return _edge_piece(self.form, tables, scale, margin * scale, gain(self.form, scale, tables))


def table_obstacle(lights: Sequence[Light], *, image: bool) -> str | None:
    """Return what prevents the use of edge tables, so that each ghost needs transforms of the opening.

    Parameters
    ----------
    lights : sequence of Light
    image : bool
        Whether the iris is an image, or has dirt that is visible in ghosts.

    Returns
    -------
    str or None
        None if tables can be used. Between cylinders some openings are transformed, in less time than the ghosts take.
    """
    if image:
        return "an iris image, or of one with dirt,"
    return "a light of spectral lines" if any(isinstance(light.spectrum, Lines) for light in lights) else None


def edge_crossing(form: BladeForm, wavelengths_nm: Floats, area: Floats, pixel_mm: float) -> EdgeCrossing | None:
    """Describe a crossing whose blades are long compared with its fringes; None otherwise.

    Parameters
    ----------
    form : BladeForm
    wavelengths_nm, area : ndarray, shape (W,)
    pixel_mm : float
        As in `EdgeCrossing`.

    Returns
    -------
    EdgeCrossing or None
    """
    # light outside the traced wavelengths counts to the end bands, and bands are slightly wider than their mean
    largest = math.sqrt(0.6 * float(np.abs(area).max()))
    # the end of a blade hardly affects distant fringes along it, but the fringes of a circle focus at its centre
    least = SHORTEST if len(form.corners) else REACH
    if min(form.half_length, form.offset) < least * largest + 0.5 * pixel_mm:
        return None
    return EdgeCrossing(form, wavelengths_nm, area, pixel_mm, form.distance + SHADOW * largest)


def sharp_piece(form: BladeForm, width: float) -> Piece:
    """Return the opening itself as a piece, with a border `width` mm wide."""
    scale = CORNER_SAMPLES * width
    return _edge_piece(form, sharp_tables(), scale, scale)


def _edge_piece(form: BladeForm, tables: EdgeTables, scale: float, margin: float, brighter: float = 1.0) -> Piece:
    """Arrange edge tables, of unit `scale` mm and valid up to `margin` mm from the border, for the kernel."""
    (rows, across), samples = tables.corner.shape, CORNER_SAMPLES / scale
    row = [0.0] * columns.TABLE_COLUMNS
    row[columns.ROWS], row[columns.COLUMNS] = rows, across
    row[columns.PER_MM_X], row[columns.PER_MM_Y], row[columns.AT_X] = samples, samples, tables.first
    row[columns.OUTSIDE] = form.distance + margin
    row[columns.CORNERS] = len(form.corners)
    row[columns.EDGE], row[columns.EDGE_COUNT] = tables.corner.size, tables.edge_count
    row[columns.EDGE_PER_MM] = EDGE_SAMPLES / scale
    row[columns.DISTANCE], row[columns.COSINE], row[columns.SINE] = (
        form.distance,
        math.cos(form.gamma),
        math.sin(form.gamma),
    )
    row[columns.OFFSET] = form.offset
    row[columns.RADIUS] = 0.0 if form.curvature == 0.0 else 1.0 / form.curvature
    row[columns.MARGIN], row[columns.DEEP] = margin, max(form.offset - margin, 0.0)
    row[columns.FINE] = FINE * scale
    if len(form.corners):
        blunt = form.gamma - form.bend
        row[columns.TO_ALONG], row[columns.TO_ACROSS] = 0.5 / math.cos(blunt), 0.5 / math.sin(blunt)
    return Piece(tables.values, np.array(row), brighter)


def picture_piece(values: Pixels, box: Box) -> Piece:
    """Arrange a picture of the stop for the kernel.

    Parameters
    ----------
    values : ndarray, shape (rows, columns), float32
        0 along the border; the first row is the lowest.
    box : Box
        Position of the picture, mm.
    """
    found = np.zeros(columns.TABLE_COLUMNS)
    found[columns.ROWS], found[columns.COLUMNS] = values.shape
    for count, (low, high), per_mm, at in zip(
        values.shape[::-1], box, (columns.PER_MM_X, columns.PER_MM_Y), (columns.AT_X, columns.AT_Y), strict=True
    ):
        found[per_mm] = count / (high - low)
        found[at] = -low * found[per_mm] - 0.5
    found[columns.OUTSIDE], found[columns.CORNERS] = float(np.abs(box).max()), -1.0
    found[columns.FINE] = 0.5 / max(found[columns.PER_MM_X], found[columns.PER_MM_Y])
    return Piece(values.ravel(), found)
