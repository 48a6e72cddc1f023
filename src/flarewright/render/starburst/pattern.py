"""The starburst of one light: its direct image, spread by diffraction at the iris, in physical scale.

Each pixel holds the flux that falls into it, divided by its area. Near the centre the flux comes from the iris's
Fourier pattern at each wavelength. That pattern covers a millimetre or less on the sensor; farther out the edge waves
of the blades continue it in closed form over the whole picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ...errors import ProjectError
from ...kernels.diffraction.resample import SpikeTables, blend_blade_wings, blend_fan_wings, deposit_core
from ...kernels.raster.plane_memory import black_picture
from ...optics.diffraction.fraunhofer import BladeWings, FanWings, Pattern
from ...optics.diffraction.spike_profile import spike_profile
from ...optics.pupil.dirt import VeilTerm
from ...typing import Floats, Pixels
from .bands import BAND, in_threads

NEAR_PIXELS = 8
"""Pixels this close to the centre are split NEAR_SPLIT times per side: blend and wings change within a pixel there."""

NEAR_SPLIT = 8

LEAST_CORE = 1.0
"""Least radius of the core, before the blend, in parts of a pixel: with less the blend loses flux."""

KNOTS = 1200
"""Radii in the tables of light from dirt: the fringes of a scratch are at least 1/100 of their radius apart."""

MOST_PARTS = 100_000_000
"""Largest number of parts of the pixels near the centre, limited by memory."""

# adds the wings to the rows at these heights
_Blend = Callable[[Floats, Pixels | Floats], None]


def starburst_layer(
    pattern: Pattern,
    f_number: float,
    pixel_mm: tuple[float, float],
    size_px: tuple[int, int],
    centre_px: tuple[float, float],
    wavelengths_nm: ArrayLike,
    weights_rgb: ArrayLike,
    *,
    split: int = NEAR_SPLIT,
    threads: int | None = 1,
) -> Pixels:
    """Return the irradiance of the diffracted direct image of a light.

    Parameters
    ----------
    pattern : Pattern
        From `optics.diffraction.fraunhofer.pupil_pattern`.
    f_number : float
        Working f-number N. The pattern's scale is x = 2 N lambda s for any focal length.
    pixel_mm : tuple of float
        Width and height of a pixel on the sensor.
    size_px : tuple of int
        Width and height of the picture.
    centre_px : tuple of float
        (x, y) of the direct image in the upright picture, in pixels from its upper left corner: (0.5, 0.5) is the
        centre of the first pixel. The image can lie outside the picture.
    wavelengths_nm : array_like, shape (M,)
        Rising; steps of 5 nm or finer for a continuous spectrum.
    weights_rgb : array_like, shape (M, 3)
        Flux of the direct image at each wavelength in each channel (band weight times throughput times intensity);
        negative values are kept.
    split : int
        Least number of parts per side into which pixels near the centre are divided, if the wings begin there; more if
        the core is smaller than a part. 1 is meant for drafts: it takes half the time and keeps the flux to 3e-5. Its
        error is 4e-6 of the peak, which is up to 0.4 of the value of some pixels within eight of the centre.
    threads : int or None
        None: all cores. The pixels do not depend on it.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        Flux per mm^2. Times the pixel area, the sum over an unbounded picture is the sum of the weights.

    Raises
    ------
    ValueError
        An argument has the wrong shape or is not positive and finite where it must be.

    Notes
    -----
    Hullin et al. 2011, section 3.3, without the artistic scales of its equations 3 and 4. On pixels finer than the
    fringes, monochromatic light shows them only within the Fourier table; the wings hold the mean over fringes. The
    spline that reads the table blurs by half a cell, 1/24 in s: 3.4 % at the centre of an Airy disc on infinitely fine
    pixels, nothing on pixels that are coarser than the disc.
    """
    wave, weights = _check(f_number, pixel_mm, size_px, wavelengths_nm, weights_rgb)
    width, height = size_px
    cx, cy = centre_px
    x_edges = (np.arange(width + 1, dtype=np.float64) - cx) * pixel_mm[0]
    y_edges = (cy - np.arange(height + 1, dtype=np.float64)) * pixel_mm[1]
    picture = black_picture(width, height)
    strength = np.abs(weights).max(axis=1)
    if not strength.any():
        return picture
    painter = painter_of(pattern, f_number, pixel_mm, wave, weights)
    # If the blend begins inside the near zone, the pixels there are too coarse for it.
    k = max(split, math.ceil(LEAST_CORE * max(pixel_mm) / painter.inner))
    left, right = _near(cx, width)
    top, bottom = _near(cy, height)
    if max((bottom - top) * (right - left), 1) * k * k > MOST_PARTS:
        raise ProjectError(
            f"pixels of {max(pixel_mm):.3g} mm are too coarse for the starburst, whose core has {painter.inner:.2g} "
            "mm; give a smaller --sensor or a larger --size, or leave the starburst out with --no-starburst"
        )
    painter.paint(x_edges, y_edges, pixel_mm, picture, threads)

    if k > 1 and painter.inner < NEAR_PIXELS * max(pixel_mm) and left < right and top < bottom:
        fine = np.zeros(((bottom - top) * k, (right - left) * k, 3))
        x_fine = (left + np.arange((right - left) * k + 1) / k - cx) * pixel_mm[0]
        y_fine = (cy - top - np.arange((bottom - top) * k + 1) / k) * pixel_mm[1]
        painter.paint(x_fine, y_fine, (pixel_mm[0] / k, pixel_mm[1] / k), fine)
        picture[top:bottom, left:right] = fine.reshape(bottom - top, k, right - left, k, 3).mean(axis=(1, 3))
    return picture


def painter_of(
    pattern: Pattern, f_number: float, pixel_mm: tuple[float, float], wavelengths_nm: Floats, weights: Floats
) -> Painter:
    """Prepare a pattern for pixels of a given size.

    Parameters
    ----------
    pattern : Pattern
    f_number, pixel_mm
        As in `starburst_layer`.
    wavelengths_nm : ndarray, shape (M,)
    weights : ndarray, shape (M, 3)
        Not all 0.
    """
    strength = np.abs(weights).max(axis=1)
    # At the outer radius the shortest relevant wavelength reaches the end of the table; longer ones stay inside.
    lit = np.cumsum(strength) > 1e-3 * strength.sum()
    outer = pattern.reach * 2.0 * f_number * float(wavelengths_nm[lit][0]) * 1e-6
    wave, finer = _finer(wavelengths_nm, weights, 2.0 * f_number, min(pixel_mm))
    return Painter(pattern, f_number, wave, finer, 0.5 * outer, outer)


class Painter:
    """The pattern of one light, ready to be drawn on any grid of pixels."""

    def __init__(
        self, pattern: Pattern, f_number: float, wave: Floats, weights: Floats, inner: float, outer: float
    ) -> None:
        self.pattern, self.f_number = pattern, f_number
        self.wave, self.weights = wave, weights
        self.inner, self.outer = inner, outer

    def paint(
        self,
        x_edges: Floats,
        y_edges: Floats,
        pixel_mm: tuple[float, float],
        out: Pixels | Floats,
        threads: int | None = 1,
    ) -> None:
        """Write the irradiance of every pixel between the edges into `out`, which must hold zeros."""
        self._core(x_edges, y_edges, pixel_mm, out)
        x, y = 0.5 * (x_edges[1:] + x_edges[:-1]), 0.5 * (y_edges[1:] + y_edges[:-1])
        if not (x.size and y.size):
            return
        farthest, wings = math.hypot(np.abs(x).max(), np.abs(y).max()), self.pattern.wings
        blend = (
            self._fans(wings, x, pixel_mm)
            if isinstance(wings, FanWings)
            else self._blades(wings, x, pixel_mm, farthest)
        )
        veils = [self._veil(term, farthest) for term in self.pattern.veil]

        def paint_band(first: int) -> None:
            rows, band = y[first : first + BAND], out[first : first + BAND]
            blend(rows, band)
            for veil in veils:
                band += veil(x, rows[:, None])

        in_threads(paint_band, range(0, len(y), BAND), threads)

    def _fans(self, wings: FanWings, x: Floats, pixel_mm: tuple[float, float]) -> _Blend:
        colour = 2.0 * self.f_number * (self.wave * 1e-6) @ self.weights
        cumulative = np.concatenate([[0.0], np.cumsum(wings.angular) / len(wings.angular)])

        def blend(y: Floats, out: Pixels | Floats) -> None:
            blend_fan_wings(x, y, np.array(pixel_mm), cumulative, colour, self.inner, self.outer, out)

        return blend

    def _blades(self, wings: BladeWings, x: Floats, pixel_mm: tuple[float, float], farthest: float) -> _Blend:
        profile = spike_profile(wings, self.wave, self.weights, self.f_number, pixel_mm)
        spikes = SpikeTables(
            wings.angle, wings.half_fan, profile.cumulative, profile.density, profile.half_total, profile.tail,
            profile.step, 0.5 / self.f_number,
        )  # fmt: skip

        def blend(y: Floats, out: Pixels | Floats) -> None:
            blend_blade_wings(x, y, np.array(pixel_mm), spikes, self.inner, self.outer, out)

        if self.pattern.rough is None:
            return blend
        spread, kept = self._fans(self.pattern.rough, x, pixel_mm), self._coherence(farthest)

        def blend_rough(y: Floats, out: Pixels | Floats) -> None:
            smooth = out.copy()
            spread(y, smooth)
            blend(y, out)
            out += (1.0 - kept(np.hypot(x, y[:, None]))) * (smooth - out)

        return blend_rough

    def _by_radius(self, value: Callable[[Floats], Floats], farthest: float) -> Callable[[Floats], Floats]:
        """Return the sum over wavelengths of a function of s = r / (2 N lambda): of any shape of r, with 3 channels.

        It is read from a table in ln r that ends at `farthest`, mm.
        """
        least = self.inner
        knots = np.geomspace(max(least, 1e-9), max(farthest, 2.0 * least), KNOTS)
        # multiplied by r^2 the table is nearly constant
        table = np.einsum("km,mc->kc", value(knots[:, None] / self._scale), self.weights).T * knots**2
        places = np.log(knots)

        def summed(r: Floats) -> Floats:
            at = np.log(np.maximum(r, least))
            found = [np.interp(at, places, channel) for channel in table]
            return np.asarray(np.stack(found, axis=-1) / np.maximum(r, least)[..., None] ** 2)

        return summed

    @property
    def _scale(self) -> Floats:
        """Millimetres on the sensor per unit of s, for each wavelength."""
        return 2.0 * self.f_number * self.wave * 1e-6

    def _coherence(self, farthest: float) -> Callable[[Floats], Floats]:
        """Return the part of a spike that rough blades keep, a function of the radius, for each channel."""
        sigma = self.pattern.roughness

        def spike(s: Floats) -> Floats:
            return self._scale * np.exp(-((2.0 * math.pi * sigma * s) ** 2))

        left = self._by_radius(spike, farthest)
        # weights of a channel can cancel, so divide by the same sum without roughness
        whole = self._scale @ self.weights
        return lambda r: np.clip(left(r) / np.where(whole == 0.0, 1.0, whole), 0.0, 1.0)

    def _veil(self, term: VeilTerm, farthest: float) -> Callable[[Floats, Floats], Floats]:
        def value(s: Floats) -> Floats:
            slope = np.log(term.radial[-1] / term.radial[-2]) / np.log(term.s[-1] / term.s[-2])
            inside = np.interp(s, term.s, term.radial)
            beyond = term.radial[-1] * (s / term.s[-1]) ** slope
            return np.where(s <= term.s[-1], inside, beyond) / self._scale**2

        light, count = self._by_radius(value, farthest), len(term.angular)

        def veil(x: Floats, y: Floats) -> Floats:
            r = np.hypot(x, y)
            t = np.clip((r - self.inner) / (self.outer - self.inner), 0.0, 1.0)
            window = t**3 * (t * (6.0 * t - 15.0) + 10.0)
            turns = np.arctan2(y, x) / math.pi * count
            share = np.interp(turns, np.arange(count), term.angular, period=count) if count > 1 else term.angular[0]
            return np.asarray((window * share)[..., None] * light(r))

        return veil

    def _core(self, x_edges: Floats, y_edges: Floats, pixel_mm: tuple[float, float], out: Pixels | Floats) -> None:
        """Add the flux of the Fourier pattern inside the square around the outer radius."""
        columns = np.flatnonzero((x_edges[1:] > -self.outer) & (x_edges[:-1] < self.outer))
        rows = np.flatnonzero((y_edges[:-1] > -self.outer) & (y_edges[1:] < self.outer))
        if not (columns.size and rows.size):
            return
        j0, j1, i0, i1 = columns[0], columns[-1] + 1, rows[0], rows[-1] + 1
        flux = np.zeros((i1 - i0, j1 - j0, 3))
        knots_per_mm = self.pattern.knots_per_s / (2.0 * self.f_number * self.wave * 1e-6)
        deposit_core(self.pattern.table, knots_per_mm, self.weights, x_edges[j0 : j1 + 1], y_edges[i0 : i1 + 1], flux)
        out[i0:i1, j0:j1] = flux / (pixel_mm[0] * pixel_mm[1])


def _near(centre: float, size: int) -> tuple[int, int]:
    """Return the first pixel and one past the last pixel of the near zone in the picture, along one axis."""
    middle = math.floor(min(max(centre, -1e9), 1e9))
    return min(max(middle - NEAR_PIXELS, 0), size), min(max(middle + NEAR_PIXELS + 1, 0), size)


def _finer(wave: Floats, weights: Floats, scale: float, pixel: float) -> tuple[Floats, Floats]:
    """Split wavelength steps where pixels resolve the fringes, or where the steps would alias with them.

    Fringes are half a unit of s apart, so at the border of the core wavelengths 5 nm apart differ by a whole unit. Only
    an evenly spaced, fine grid represents a continuous spectrum; single lines stay unchanged.
    """
    if len(wave) < 3:
        return wave, weights
    steps = np.diff(wave)
    resolved = pixel < 0.6 * scale * wave.mean() * 1e-6
    if not resolved or float(np.ptp(steps)) > 1e-6 * float(steps[0]) or steps[0] > 10.0:
        return wave, weights
    split = math.ceil(float(steps[0]) / 1.25)
    # A hat function is a sum of finer hats; each column sums to 1, so flux is conserved.
    fine = np.linspace(wave[0], wave[-1], split * (len(wave) - 1) + 1)
    hats = np.stack([np.interp(fine, wave, row) for row in np.eye(len(wave))], axis=1)
    spread: Floats = (hats / hats.sum(axis=0)) @ weights
    return fine, spread


def _check(
    f_number: float,
    pixel_mm: tuple[float, float],
    size_px: tuple[int, int],
    wavelengths_nm: ArrayLike,
    weights_rgb: ArrayLike,
) -> tuple[Floats, Floats]:
    wave = np.atleast_1d(np.asarray(wavelengths_nm, dtype=np.float64))
    weights = np.ascontiguousarray(np.atleast_2d(np.asarray(weights_rgb, dtype=np.float64)))
    if wave.ndim != 1 or weights.shape != (wave.size, 3):
        raise ValueError(f"weights of shape {weights.shape} do not fit {wave.size} wavelengths and 3 channels")
    if not (bool(np.all(wave > 0.0)) and bool(np.all(np.diff(wave) > 0.0)) and bool(np.isfinite(weights).all())):
        raise ValueError("wavelengths must be positive and rise, weights must be finite")
    if not (f_number > 0.0 and min(pixel_mm) > 0.0 and min(size_px) > 0):
        raise ValueError("the f-number, the pixel and the picture must be larger than 0")
    return wave, weights
