"""Fraunhofer pattern of the iris: its core by Fourier transform, and its wings by asymptotic formulas.

All lengths in the pupil are in units of the pupil's radius efl / (2 N), so a pattern depends only on the shape:
frequency s (cycles per radius) lands at x = 2 N lambda s on the sensor, for any focal length. The pattern P(s) has unit
integral, and P(0) is the opening's area. The upright picture is the sensor turned by 180 degrees and P(-s) = P(s), so
the pattern has the orientation of the iris seen from behind the camera.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...model.lens.iris import Iris
from ...model.project.starburst import Dirt
from ...typing import Floats
from ..pupil.dirt import DARK_DEPTH, Elements, Veil, VeilTerm, generate_dirt, mean_depth, scattered, spread_area
from ..pupil.iris import blade_edges
from ..pupil.pupil_function import BLOCKED, FFT_SIZE, WINDOW, Pupil, PupilImage, pupil_amplitude

CORE_REACH = 60.0
"""Largest s of the core, a third of Nyquist: aliasing is 0.2 % there."""

FAN_BINS = 720


@dataclass(frozen=True)
class FanWings:
    """Wings P = g(phi) / s^3 of a border with normals in all directions.

    Attributes
    ----------
    angular : ndarray, shape (A,)
        g, a histogram of equal bins centred at 0, pi / A, ..., periodic in pi.
    """

    angular: Floats


@dataclass(frozen=True)
class BladeWings:
    """Wings of B equal blades, in the pupil's units.

    Attributes
    ----------
    angle : ndarray, shape (D,)
        Distinct directions of their normals, modulo pi.
    multiplicity : float
        Blades per direction: 2 when their number is even.
    length : float
        Length of a blade's edge.
    half_fan : float
        Half the angle that a blade's arc subtends at its centre; 0 when straight.
    """

    angle: Floats
    multiplicity: float
    length: float
    half_fan: float


@dataclass(frozen=True)
class Pattern:
    """The Fraunhofer pattern of one iris.

    Attributes
    ----------
    table : ndarray, shape (K, K)
        Summed-area table of P: flux left of and below each knot; rows rise with y; centre at knot (K - 1) / 2.
    knots_per_s : float
        Knots per unit of s.
    reach : float
        Largest s of the table.
    wings : FanWings or BladeWings
        P beyond the reach.
    roughness : float
        Rms of the blades' edge; it turns a fraction 1 - exp(-(2 pi roughness s)^2) of the spikes into fans.
    rough : FanWings or None
        Wings of the rough blades where no spike remains; None for smooth blades.
    veil : Veil
        Wings from dirt.
    transmittance : float
        Fraction of the light that dirt transmits.
    """

    table: Floats
    knots_per_s: float
    reach: float
    wings: FanWings | BladeWings
    roughness: float = 0.0
    rough: FanWings | None = None
    veil: Veil = ()
    transmittance: float = 1.0


@dataclass(frozen=True)
class Soil:
    """Dirt on a pupil.

    Attributes
    ----------
    dirt : Dirt
    image : ndarray, shape (rows, columns), or None
        Image of dirt, row 0 at the top, over the square around the round opening.
    """

    dirt: Dirt
    image: NDArray[np.floating] | None = None


def pupil_pattern(
    iris: Iris,
    mask: NDArray[np.floating] | None = None,
    *,
    span: float = 1.0,
    radius_mm: float = 1.0,
    soil: Soil | None = None,
    turn: float = 0.0,
) -> Pattern:
    """Compute the Fraunhofer pattern of an iris or of a mask image; the last few patterns are cached.

    Parameters
    ----------
    iris : Iris
    mask : ndarray, shape (rows, columns), or None
        As in `iris.transmission`; the wave's amplitude is the square root of its transmittance.
    span : float
        The mask spans [-span, span] squared, in radii.
    radius_mm : float
        The pupil's radius at the stop, for roughness and dirt, whose sizes are in mm.
    soil : Soil, optional
    turn : float
        Rotates the whole pupil counter-clockwise, rad.

    Raises
    ------
    ValueError
        When the mask, or the opening with its dirt, is dark everywhere.

    Notes
    -----
    Hullin et al. 2011, section 3.3, equation 2. The border of blades is softened by a triangle two samples wide along
    its normal. Light in a direction comes from the borders with that normal, so division by sinc^4 of |s| undoes the
    filter. (With a box of one sample, borders along the grid would alias by 10 %.)

    Beyond the core, an element ds of the border with normal phi sends ds / (4 pi^2 A s^2) ds' along phi and phi + pi
    (stationary phase, fringes averaged). A circle's wings are the mean Airy tail 1 / (2 pi^3 s^3), so 1 / (pi^2 s) of
    the light falls outside s. A mask's wings are g(phi) / s^3, the law of any sharp border; g is measured per direction
    from the pattern between a quarter of its reach and the whole. The reach of a mask is at most an eighth of its
    pixels per side.

    A rough edge of rms sigma keeps exp(-(2 pi sigma s)^2) of a spike; the other light goes along the normals of the
    edge (`_rough_fans`). Wings of dirt add to those of the border (`dirt.scattered`).
    """
    if iris.roughness_um == 0.0 and soil is None:
        radius_mm = 1.0  # sizes in mm have no effect: share the cache entry
    dirt = soil.dirt if soil is not None else None
    drawn = soil.image if soil is not None else None
    return _pattern(iris, _picture(mask), span, radius_mm, dirt, _picture(drawn), turn)


def _picture(pixels: NDArray[np.floating] | None) -> PupilImage | None:
    if pixels is None:
        return None
    held = np.ascontiguousarray(pixels, dtype=np.float64)
    digest = hashlib.blake2b(repr(held.shape).encode(), digest_size=16)
    # the array itself: its bytes would be a copy
    digest.update(held.data)
    return PupilImage(digest.digest(), held)


@lru_cache(maxsize=4)
def _pattern(
    iris: Iris,
    mask: PupilImage | None,
    span: float,
    radius_mm: float,
    dirt: Dirt | None,
    dirt_image: PupilImage | None,
    turn: float,
) -> Pattern:
    """Return the pattern of `pupil_pattern`, of arguments that a cache can compare."""
    spacing = WINDOW / FFT_SIZE
    reach = math.ceil(CORE_REACH * WINDOW)
    s = np.arange(-reach, reach + 1) / WINDOW
    if dirt is not None and mean_depth(dirt) > DARK_DEPTH:
        # before millions of pieces are drawn
        raise ValueError(BLOCKED)
    elements = None if dirt is None else generate_dirt(dirt, radius_mm, turn)
    pupil = pupil_amplitude(iris, mask, span, radius_mm, elements, dirt_image, turn)
    P = _power(pupil.amplitude, reach)
    wings: FanWings | BladeWings
    veil: Veil = ()
    if mask is not None:
        # its measured wings include those of dirt
        wings, trusted = _complete_image_core(P, s, spacing, min(mask.pixels.shape) / span)
    else:
        _complete_blade_core(P, s, spacing, None if dirt is None else pupil.light)
        wings, trusted = _wings(iris, turn), CORE_REACH
        if elements is not None:
            wings = _scaled_wings(wings, pupil.amplitude_left**2 / pupil.transmittance)
            veil = _veil_of(elements, pupil, s, spacing)
    P /= WINDOW**2
    rough = 1e-3 * iris.roughness_um / radius_mm
    fans = None
    if rough > 0.0 and isinstance(wings, BladeWings):
        fans = _rough_fans(wings, math.sqrt(2.0) * iris.roughness_um / iris.roughness_length_um)
    return Pattern(_summed_area(P), WINDOW, trusted, wings, rough, fans, veil, pupil.transmittance)


def _complete_blade_core(P: Floats, s: Floats, spacing: float, light: float | None) -> None:
    """Sharpen and normalize the pattern of blades, and fill its left half, in place.

    Parameters
    ----------
    P : ndarray, shape (R, R)
        From `_power`.
    s : ndarray, shape (R,)
        Frequencies of both axes.
    spacing : float
        Of the pupil's samples.
    light : float or None
        Integral of the pupil's transmittance. None: a clean binary pupil, whose integral is the root of the centre
        value. (Dirt below a sample needs the sum.)
    """
    reach = len(s) // 2
    _undo_softening(P[:, reach:], s, s[reach:], spacing)
    power = math.sqrt(P[reach, reach]) if light is None else light / spacing**2
    P[:, reach:] /= power * spacing**-2
    P[:, :reach] = P[::-1, :reach:-1]


def _complete_image_core(P: Floats, s: Floats, spacing: float, finest: float) -> tuple[FanWings, float]:
    """Fill the left half of the pattern of a mask image, sharpen and normalize it, in place.

    The border of an image is soft: pixels are means over their area, then interpolated linearly. Up to an eighth of a
    cycle per pixel, division undoes this (isotropic to second order); beyond, the pattern is unknown.

    Parameters
    ----------
    P, s, spacing
        As of `_complete_blade_core`.
    finest : float
        Pixels of the image per radius of the pupil.

    Returns
    -------
    wings : FanWings
    trusted : float
        Frequency up to which the pattern is known.
    """
    reach = len(s) // 2
    P[:, :reach] = P[::-1, :reach:-1]
    trusted = min(CORE_REACH, max(8.0, finest / 8.0))
    # one quadrant contains all radii
    radius = np.hypot(s[reach:], s[reach:, None])
    inside = np.minimum(radius, 2.0 * trusted)
    sharper = 1.0 / (np.sinc(spacing * inside) ** 2 * np.sinc(2.0 * inside / max(finest, 64.0)) ** 6)
    mirrored = np.abs(np.arange(-reach, reach + 1))
    P *= sharper[mirrored[:, None], mirrored]
    wings = _measured_fans(P, s, trusted)
    flux_outside = 2.0 * math.pi * wings.angular.mean() / trusted
    total = P[(radius <= trusted)[mirrored[:, None], mirrored]].sum() / WINDOW**2 + flux_outside
    P /= total
    return FanWings(wings.angular / total), trusted


def _veil_of(elements: Elements, pupil: Pupil, s: Floats, spacing: float) -> Veil:
    """Return the light that dirt on an iris of blades scatters far from the image."""
    open_area = math.pi * pupil.transmittance
    inside = pupil.holds(elements.discs), pupil.holds(elements.arcs)
    # overlapping pieces scatter less than separate ones
    alone = spread_area(elements, *inside) / math.pi
    share = pupil.spread / alone if alone > 0.0 else 1.0
    veil = tuple(replace(term, radial=share * term.radial) for term in scattered(elements, *inside, open_area))
    if pupil.drawn is None:
        return veil
    return (*veil, _drawn_veil(pupil.drawn, s, len(s) // 2, spacing, open_area))


def _summed_area(P: Floats) -> Floats:
    """Return the sums of a picture over all rectangles from its first corner, read-only."""
    table = np.zeros((len(P) + 1, len(P) + 1))
    np.cumsum(P, axis=1, out=table[1:, 1:])
    for row in range(1, len(table)):  # faster than a cumulative sum along the columns
        table[row] += table[row - 1]
    table.flags.writeable = False
    return table


def _rough_fans(wings: BladeWings, slope: float) -> FanWings:
    """Return the fans of rough blades by stationary phase: light goes along the normals of the edges.

    Heights of Gaussian statistics with the correlation exp(-(u / L)^2) and the rms sigma have normally distributed
    slopes of rms sqrt(2) sigma / L (Beckmann and Spizzichino 1963, chapter 5); the turn of a blade's arc adds to them.
    The edge is longer where it is steep, so an angle theta has the density
    exp(-tan^2 theta / (2 slope^2)) / cos^3 theta.
    """
    fine = FAN_BINS * 8
    theta = np.arange(-fine, fine + 1) * math.pi / fine
    steep = np.abs(theta) < 0.49 * math.pi
    normal = np.zeros_like(theta)
    normal[steep] = np.exp(-0.5 * (np.tan(theta[steep]) / max(slope, math.pi / fine)) ** 2) / np.cos(theta[steep]) ** 3
    # an odd number of steps is symmetric about its middle
    steps = 1 + 2 * round(wings.half_fan * fine / math.pi)
    arc = np.convolve(normal / normal.sum(), np.full(steps, 1.0 / steps), mode="same")
    angular = np.zeros(FAN_BINS)
    for normal_angle in wings.angle:
        at = (theta + normal_angle) * FAN_BINS / math.pi
        angular += np.bincount(np.round(at).astype(np.intp) % FAN_BINS, arc, FAN_BINS)
    # an element ds of the border with normal phi sends ds / (4 pi^2 A s^2) ds' along phi; the area A is pi
    per_angle = wings.multiplicity * wings.length * FAN_BINS / math.pi
    return FanWings(angular * per_angle / (4.0 * math.pi**3))


def _scaled_wings(wings: FanWings | BladeWings, factor: float) -> FanWings | BladeWings:
    if isinstance(wings, FanWings):
        return FanWings(wings.angular * factor)
    return replace(wings, multiplicity=wings.multiplicity * factor)


def _drawn_veil(taken: Floats, s: Floats, reach: int, spacing: float, open_area: float) -> VeilTerm:
    """Return the scatter of a drawn image of dirt: the pattern of the amplitude that it removes."""
    P = _power(taken, reach)
    P[:, :reach] = P[::-1, :reach:-1]
    P *= spacing**4 / open_area
    angular = _measured_fans(P, s, CORE_REACH).angular
    mean = float(angular.mean())
    far = np.geomspace(1.0, 1e6, 61)
    return VeilTerm(far, mean / far**3, angular / mean if mean > 0.0 else np.ones(1))


def _power(amplitude: Floats, reach: int) -> Floats:
    """Return |FFT|^2 at frequencies -reach..reach of both axes; the left half, the mirror image of the right, is unset.

    The two one-dimensional passes skip rows of zeros and columns beyond the core. They run in single precision (where
    NumPy supports it): amplitudes have an error of 1e-7 of the centre, and those at the core's border are 1e-4 of it.
    """
    lit = amplitude.any(axis=1)
    half = np.zeros((len(amplitude), reach + 1), dtype=np.complex64)
    half[lit] = np.fft.rfft(amplitude[lit].astype(np.float32), n=FFT_SIZE, axis=1)[:, : reach + 1]
    P = np.empty((2 * reach + 1, 2 * reach + 1))
    block = 64  # columns at a time, so that the padded transform fits the cache
    for k in range(0, reach + 1, block):
        columns = np.ascontiguousarray(half[:, k : k + block].T)
        A = np.fft.fft(columns, n=FFT_SIZE, axis=1)
        A = np.concatenate([A[:, -reach:], A[:, : reach + 1]], axis=1)
        P[:, reach + k : reach + k + len(A)] = (A.real**2 + A.imag**2).T
    return P


def _undo_softening(P: Floats, y: Floats, x: Floats, spacing: float) -> None:
    """Divide a pattern at frequencies (x, y) by sinc^4(spacing |s|), in place; y is symmetric about its middle.

    ln sinc u = -t - t^2 / 5 - 8 t^3 / 105 - ..., t = (pi u)^2 / 6; the first term is a product over the two axes, the
    remaining terms are a polynomial: exact to 1e-6 for u below 0.25.
    """
    t_y, t_x = (math.pi * spacing * y) ** 2 / 6.0, (math.pi * spacing * x) ** 2 / 6.0
    grow_y, grow_x = np.exp(4.0 * t_y), np.exp(4.0 * t_x)
    for row in range((len(y) + 1) // 2):
        both = t_y[row] + t_x
        rest = both * both * (0.8 + both * (32.0 / 105.0 + both * (24.0 / 175.0)))
        factor = (grow_y[row] * grow_x) * (1.0 + rest * (1.0 + rest * (0.5 + rest / 6.0)))
        P[row] *= factor
        if row < len(y) // 2:
            P[-1 - row] *= factor


def _wings(iris: Iris, turn: float) -> FanWings | BladeWings:
    edges = blade_edges(iris, 1.0)
    if len(edges) == 1:
        return FanWings(np.array([0.5 / math.pi**3]))
    B = len(edges)
    offset, curvature = float(edges[0, 2]), float(edges[0, 3])
    from_centre = np.hypot(*_corner(offset, curvature, B))
    chord = 2.0 * from_centre * math.sin(math.pi / B)
    half_fan = math.asin(0.5 * curvature * chord)
    length = chord / float(np.sinc(half_fan / math.pi))
    angle = np.arctan2(edges[:, 1], edges[:, 0]) + turn
    directions = B // 2 if B % 2 == 0 else B
    return BladeWings(angle[:directions], B / directions, float(length), half_fan)


def _corner(offset: float, curvature: float, blades: int) -> tuple[float, float]:
    """Return the meeting point of two blades relative to the normal of one of them: (along, across)."""
    cosine, sine = math.cos(math.pi / blades), math.sin(math.pi / blades)
    k = curvature * offset
    b = (1.0 - k) * cosine
    rho = offset * (2.0 - k) / (b + math.sqrt(b * b + k * (2.0 - k)))
    return rho * cosine, rho * sine


def _measured_fans(P: Floats, s: Floats, reach: float) -> FanWings:
    """Return g(phi) from the flux of a pattern between a quarter of its reach and the whole.

    The window in s is smooth, which averages the fringes of narrow slits and of opposite borders.
    """
    radius = np.hypot(s, s[:, None])
    y, x = np.nonzero((radius > 0.25 * reach) & (radius < reach) & (s[:, None] >= 0.0))
    flux = P[y, x] * _ring_window(radius[y, x] / reach) / WINDOW**2
    at = np.arctan2(s[y], s[x]) / math.pi * FAN_BINS
    bins = np.bincount(np.floor(at + 0.5).astype(np.intp) % FAN_BINS, flux, FAN_BINS)
    # a fan of g = 1 sends dphi ds / s^2 through the window
    t = 0.25 + 0.75 * (np.arange(1000) + 0.5) / 1000
    one = float(np.mean(_ring_window(t) / t**2)) * 0.75 / reach
    return FanWings(bins / (math.pi / FAN_BINS) / one)


def _ring_window(t: Floats) -> Floats:
    """Return a window that is 0 at a quarter and at 1, symmetric in the logarithm between."""
    return np.sin(0.5 * math.pi * np.log2(4.0 * t)) ** 2
