"""Rings along the blades of an iris: which ghosts tables of edges and corners serve, and how the kernel reads them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels import pattern as columns
from ..model import Lens, Light, Surface
from ..model.light import Lines
from ..optics.blade_form import BladeForm
from ..optics.edge_ringing import (
    CORNER_SAMPLES,
    EDGE_SAMPLES,
    PROFILE_SAMPLES,
    EdgeTables,
    averaged,
    gain,
    sharp_tables,
)
from ..optics.fresnel import REACH, SHADOW, Box

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


SHORTEST = 5.0
"""Half a blade and its distance from the middle are at least so long, in sqrt(lambda L / 2), to be served by tables."""

FINE = 0.02
"""Places in the stop may err by this part of sqrt(lambda L / 2) where a cell is drawn as one polygon."""


@dataclass(frozen=True)
class Piece:
    """What a crossing of the stop needs to be drawn.

    Attributes
    ----------
    values : ndarray, shape (P,), float32
        Its patterns.
    row : ndarray, shape (TABLE_COLUMNS,)
        Where they lie, counted from the first of `values` (`kernels.pattern`).
    gain : float
        What its light is multiplied by.
    """

    values: Singles
    row: Floats
    gain: float = 1.0


@dataclass(frozen=True)
class EdgeCrossing:
    """A crossing of the stop whose pattern is one of edges and corners, up to its wavelength.

    Attributes
    ----------
    form : BladeForm
    wavelengths_nm : ndarray, shape (W,)
        As traced.
    area : ndarray, shape (W,)
        lambda L there, mm^2, of one sign.
    pixel_mm : float
        Side of a pixel in the stop.
    reach : float
        How far out in the stop there is light, mm.
    """

    form: BladeForm
    wavelengths_nm: Floats
    area: Floats
    pixel_mm: float
    reach: float

    def pieces(self, bands: Sequence[tuple[Floats, Floats]]) -> list[Piece]:
        """Average the pattern over the light of some bands.

        Parameters
        ----------
        bands : sequence of (ndarray, ndarray)
            Of each its wavelengths in nm, and their parts of its light, which sum to 1.

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
        return edge_piece(self.form, tables, scale, margin * scale, gain(self.form, scale, tables))


def untabled(lens: Lens, lights: Sequence[Light], *, image: bool) -> str | None:
    """Say what keeps rings from being looked up in tables, so that each ghost's opening is transformed.

    Parameters
    ----------
    lens : Lens
    lights : sequence of Light
    image : bool
        The iris is one, or has dirt in it that ghosts show.

    Returns
    -------
    str or None
        None where nothing does.
    """
    if any(isinstance(row, Surface) and row.toroidal for row in lens.rows):
        return "a lens with cylinders"
    if image:
        return "an iris image, or of one with dirt,"
    return "a light of spectral lines" if any(isinstance(light.spectrum, Lines) for light in lights) else None


def edge_crossing(form: BladeForm, wavelengths_nm: Floats, area: Floats, pixel_mm: float) -> EdgeCrossing | None:
    """Describe a crossing whose blades are long beside its fringes; None where they are not.

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
    # light beyond the traced wavelengths belongs to the ends, and bands are a little wider than their mean
    largest = math.sqrt(0.6 * float(np.abs(area).max()))
    # far fringes of a blade hardly know of its other end; those of a circle come to a focus in its middle
    least = SHORTEST if len(form.corners) else REACH
    if min(form.half_length, form.offset) < least * largest + 0.5 * pixel_mm:
        return None
    return EdgeCrossing(form, wavelengths_nm, area, pixel_mm, form.distance + SHADOW * largest)


def sharp_piece(form: BladeForm, width: float) -> Piece:
    """Return the opening itself, its border `width` mm wide."""
    scale = CORNER_SAMPLES * width
    return edge_piece(form, sharp_tables(), scale, scale)


def edge_piece(form: BladeForm, tables: EdgeTables, scale: float, margin: float, brighter: float = 1.0) -> Piece:
    """Lay tables out as the kernel reads them.

    Parameters
    ----------
    form : BladeForm
    tables : EdgeTables
    scale : float
        Their unit, mm.
    margin : float
        Farther than this from the border nothing is known of it, mm.
    brighter : float
        The piece's gain.

    Returns
    -------
    Piece
    """
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


def picture_piece(values: Singles, box: Box) -> Piece:
    """Lay a picture of the stop out as the kernel reads it.

    Parameters
    ----------
    values : ndarray, shape (rows, columns), float32
        0 along its border, its first row the lowest.
    box : Box
        Where it lies, mm.

    Returns
    -------
    Piece
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
