"""Rings along the blades of an iris: which ghosts tables of edges and corners serve, and how the kernel reads them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels import pattern as columns
from ..optics.blade_form import BladeForm
from ..optics.edge_ringing import (
    CORNER_SAMPLES,
    PROFILE_SAMPLES,
    REACH,
    EdgeTables,
    averaged,
    gain,
    sharp_tables,
)
from ..optics.ringing import SHADOW

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


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

    def piece(self, waves: Floats, shares: Floats) -> Piece:
        """Average the pattern over some light.

        Parameters
        ----------
        waves, shares : ndarray, shape (L,)
            Wavelengths in nm, and their parts of the light.

        Returns
        -------
        Piece
        """
        squared = 0.5 * np.interp(waves, self.wavelengths_nm, np.abs(self.area) / self.wavelengths_nm) * waves
        part = shares / shares.sum()
        scale = math.sqrt(float(part @ squared))
        logs = 0.5 * np.log(squared)
        spread = math.sqrt(max(float(part @ logs**2 - (part @ logs) ** 2), 0.0))
        tables = averaged(self.form, scale, spread, self.pixel_mm / scale)
        margin = len(tables.profile) // 2 / PROFILE_SAMPLES
        return edge_piece(self.form, tables, scale, margin * scale, gain(self.form, scale, tables))


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
    if min(form.half_length, form.offset) < REACH * largest + 0.5 * pixel_mm:
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
    rows, samples = tables.corner.shape, CORNER_SAMPLES / scale
    found = np.zeros(columns.TABLE_COLUMNS)
    found[columns.ROWS], found[columns.COLUMNS] = rows
    found[[columns.PER_MM_X, columns.PER_MM_Y, columns.AT_X]] = samples, samples, tables.first
    found[columns.OUTSIDE] = form.distance + margin
    found[columns.CORNERS] = len(form.corners)
    found[columns.EDGE], found[columns.EDGE_COUNT] = tables.corner.size, len(tables.profile)
    found[columns.EDGE_PER_MM] = PROFILE_SAMPLES / scale
    found[[columns.DISTANCE, columns.COSINE, columns.SINE]] = form.distance, math.cos(form.gamma), math.sin(form.gamma)
    found[columns.OFFSET] = form.offset
    found[columns.RADIUS] = 0.0 if form.curvature == 0.0 else 1.0 / form.curvature
    found[columns.MARGIN] = margin
    if len(form.corners):
        blunt = form.gamma - form.bend
        found[[columns.TO_ALONG, columns.TO_ACROSS]] = 0.5 / math.cos(blunt), 0.5 / math.sin(blunt)
    return Piece(np.concatenate([tables.corner.ravel(), tables.profile]), found, brighter)


def picture_piece(values: Singles, half: tuple[float, float]) -> Piece:
    """Lay a picture of the stop out as the kernel reads it.

    Parameters
    ----------
    values : ndarray, shape (rows, columns), float32
        0 along its border, its first row the lowest.
    half : tuple of float
        Half its width and height, mm.

    Returns
    -------
    Piece
    """
    found = np.zeros(columns.TABLE_COLUMNS)
    found[columns.ROWS], found[columns.COLUMNS] = values.shape
    found[columns.PER_MM_X], found[columns.PER_MM_Y] = (
        0.5 * count / side for count, side in zip(values.shape[::-1], half, strict=True)
    )
    found[columns.AT_X], found[columns.AT_Y] = 0.5 * values.shape[1] - 0.5, 0.5 * values.shape[0] - 0.5
    found[columns.OUTSIDE], found[columns.CORNERS] = max(half), -1.0
    return Piece(values.ravel(), found)


def joined(pieces: list[Piece]) -> tuple[Singles, Floats, float]:
    """Join the pieces of a path's crossings: their values, their table, and the gain of all."""
    starts = np.cumsum([0, *(piece.values.size for piece in pieces)])[:-1]
    table = np.stack([piece.row for piece in pieces])
    table[:, columns.FIRST] += starts
    table[:, columns.EDGE] += starts
    return np.concatenate([piece.values for piece in pieces]), table, math.prod(piece.gain for piece in pieces)
