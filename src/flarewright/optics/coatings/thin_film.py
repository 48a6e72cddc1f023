"""Reflectance of a coated surface by characteristic matrices; bare Fresnel is the empty stack.

A film stack is two sequences, `indices` and `thicknesses_nm`, in the order in which light along +z meets the films.
All media are lossless, so every cos^2 inside the stack is real (negative where the wave is evanescent) and the matrix
of a film needs no complex arithmetic: with x = delta^2 it contains only cos(delta) and sin(delta)/delta. Both are
even in delta and therefore real and smooth through the critical angle of the film.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlarewrightError
from ...model.lens.coating import Bare, Coating, Film, QuarterWave, Standard
from ...typing import Floats
from .presets import MGF2, standard_films

MAGNESIUM_FLUORIDE = MGF2
"""Lowest index of real coating materials."""


def film_stack(coating: Coating | None, n_front: float, n_back: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the films of a coating in the order in which light along +z meets them.

    Parameters
    ----------
    coating : Coating or None
        None is bare.
    n_front, n_back : float
        Index (n_d) of the media in front and behind.

    Returns
    -------
    indices : tuple of float
        Index of each film, front to back.
    thicknesses_nm : tuple of float
        Thickness of each film.

    Raises
    ------
    FlarewrightError
        When a negative `thickness_offset_nm` makes the thickness of a quarter-wave film negative.

    Notes
    -----
    Quarter wave: d = lambda0 / (4 n1) + offset, with n1 = sqrt(n0 n2) ("ideal"), at least that of magnesium fluoride
    ("real"), or the stated number. `Stack` and `Standard` list their films from the side of the lower index.
    """
    if coating is None or isinstance(coating, Bare):
        return (), ()
    if isinstance(coating, Film):
        return (coating.index,), (coating.thickness_nm,)
    if isinstance(coating, QuarterWave):
        return _quarter_wave(coating, n_front, n_back)
    if isinstance(coating, Standard):
        outward, factor = standard_films(coating.name, max(n_front, n_back)), coating.thickness
    else:
        outward, factor = coating.layers, 1.0
    films = outward if n_front <= n_back else outward[::-1]
    return tuple(film.index for film in films), tuple(factor * film.thickness_nm for film in films)


def _quarter_wave(coating: QuarterWave, n_front: float, n_back: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    ideal = float(np.sqrt(n_front * n_back))
    if coating.index == "ideal":
        n1 = ideal
    elif coating.index == "real":
        n1 = max(ideal, MAGNESIUM_FLUORIDE)
    else:
        n1 = coating.index
    quarter = coating.center_wavelength_nm / (4.0 * n1)
    thickness = quarter + coating.thickness_offset_nm
    if thickness < 0.0:
        raise FlarewrightError(
            f"quarter-wave coating for {coating.center_wavelength_nm:g} nm: thickness_offset_nm "
            f"{coating.thickness_offset_nm:g} exceeds the film's {quarter:.1f} nm; "
            f"use an offset above {-quarter:.1f}"
        )
    return (n1,), (thickness,)


def stack_reflectance(
    n_front: ArrayLike,
    n_back: ArrayLike,
    indices: Sequence[ArrayLike],
    thicknesses_nm: Sequence[ArrayLike],
    wavelength_nm: ArrayLike,
    cos_front: ArrayLike,
) -> Floats:
    """Return the reflectance of a film stack for unpolarised light, the mean of s and p.

    Parameters
    ----------
    n_front, n_back : array_like
        Indices of the media of the incident and of the transmitted light.
    indices, thicknesses_nm : sequence of array_like
        Films in the order in which the light meets them; arrays evaluate many stacks at once.
    wavelength_nm : array_like
        Vacuum wavelength.
    cos_front : array_like
        Cosine of the angle of incidence, 0 (grazing) to 1. All array arguments broadcast.

    Returns
    -------
    ndarray of float64
        R, of the broadcast shape; 1 under total reflection.

    Raises
    ------
    ValueError
        When a cosine is outside [0, 1], an index or wavelength is not positive, a thickness is negative, or the two
        lists differ in length.

    Notes
    -----
    docs/physics.md "Fresnel and thin films"; H. A. Macleod, Thin-Film Optical Filters, section 2.4.
    Limits are tested in tests/optics/coatings/test_thin_film.py.
    """
    fields = _fields(n_front, n_back, indices, thicknesses_nm, wavelength_nm, cos_front)
    mean: Floats = 0.5 * (_reflected(fields.s) + _reflected(fields.p))
    return np.broadcast_to(mean, fields.shape).copy() if mean.shape != fields.shape else mean


def stack_reflectance_transmittance(
    n_front: ArrayLike,
    n_back: ArrayLike,
    indices: Sequence[ArrayLike],
    thicknesses_nm: Sequence[ArrayLike],
    wavelength_nm: ArrayLike,
    cos_front: ArrayLike,
) -> tuple[Floats, Floats]:
    """Return reflectance and transmittance of a film stack for s and p light, each computed from the matrix.

    Parameters
    ----------
    n_front, n_back, indices, thicknesses_nm, wavelength_nm, cos_front
        As in `stack_reflectance`.

    Returns
    -------
    R, T : ndarray of float64, shape (2, ...)
        s in row 0, p in row 1; then the broadcast shape. T is the transmitted flux, not 1 - R.

    Raises
    ------
    ValueError
        As in `stack_reflectance`.

    Notes
    -----
    [B, C] = prod M [1, eta_sub]; r = (eta0 B - C)/(eta0 B + C); T = 4 eta0 Re(eta_sub) / |eta0 B + C|^2
    (Macleod, equations 2.96 and 2.98). For p, eta = n/cos is multiplied by the cosine so that grazing incidence stays
    finite. Where numerator and denominator both vanish (grazing between equal media without a film), R is its
    limit, 0.
    """
    fields = _fields(n_front, n_back, indices, thicknesses_nm, wavelength_nm, cos_front)
    R = _reflected(fields.s), _reflected(fields.p)
    T = _transmitted(fields.s, fields.flux), _transmitted(fields.p, fields.flux)
    return _pair(R, fields.shape), _pair(T, fields.shape)


def reflectance_table(
    n_front: float,
    n_back: float,
    indices: Sequence[float],
    thicknesses_nm: Sequence[float],
    wavelength_nm: float,
    samples: int = 1025,
) -> Floats:
    """Tabulate R against the cosine on the side of the lower index, for light from either side.

    Parameters
    ----------
    n_front, n_back : float
        Indices before and behind the surface.
    indices, thicknesses_nm : sequence of float
        The films, front to back.
    wavelength_nm : float
        Vacuum wavelength.
    samples : int
        Number of entries, at least 2.

    Returns
    -------
    ndarray of float64, shape (samples,)
        R at cos = k / (samples - 1); entry 0 is grazing. All 0 for equal media without a film.

    Raises
    ------
    ValueError
        When `samples` is below 2, or as in `stack_reflectance`.

    Notes
    -----
    A lossless stack has the same R from both sides at one Snell invariant n sin(theta) (Stokes), so one table serves
    both directions; from the denser side, R is 1 beyond the critical angle. R is smooth in this cosine: linear
    interpolation in 1025 entries has a relative error below 1e-5 for no film or one film on index steps above 0.2, and
    5e-5 for two films; where films bring R near 0 the absolute error is below 1e-5. Cemented steps rise steeply only
    towards grazing incidence: 1e-4 absolute at a step of 0.02.
    """
    if samples < 2:
        raise ValueError(f"a reflectance table needs at least 2 samples, not {samples}")
    if n_front == n_back and not indices:
        return np.zeros(samples)
    cos_low = np.arange(samples) / (samples - 1)
    if n_front <= n_back:
        return stack_reflectance(n_front, n_back, indices, thicknesses_nm, wavelength_nm, cos_low)
    return stack_reflectance(n_back, n_front, indices[::-1], thicknesses_nm[::-1], wavelength_nm, cos_low)


def _check(
    n0: Floats, nb: Floats, wave: Floats, c0: Floats, indices: Sequence[Floats], thicknesses_nm: Sequence[Floats]
) -> None:
    if not bool(np.all((c0 >= 0.0) & (c0 <= 1.0))):
        raise ValueError("cos_front must lie between 0 (grazing) and 1 (normal incidence)")
    if not bool(np.all((n0 > 0.0) & (nb > 0.0) & (wave > 0.0))):
        raise ValueError("indices and wavelengths must be positive")
    if len(indices) != len(thicknesses_nm):
        raise ValueError(f"{len(indices)} film indices but {len(thicknesses_nm)} thicknesses; each film needs both")
    if not (all(np.all(n > 0.0) for n in indices) and all(np.all(d >= 0.0) for d in thicknesses_nm)):
        raise ValueError("films need a positive index and a thickness that is not negative")


def _cos_squared(n0: Floats, n: Floats | float, c0: Floats) -> Floats:
    """Return cos^2 in the medium n by Snell's law, negative beyond the critical angle; exact for n = n0 at grazing."""
    return ((n - n0) * (n + n0) + (n0 * c0) ** 2) / (n * n)


class _Wave(NamedTuple):
    """Real and imaginary parts of a = eta0 B and of c = C of one polarisation: r = (a - c)/(a + c)."""

    a: tuple[Floats, Floats]
    c: tuple[Floats, Floats]


class _Fields(NamedTuple):
    """Fields in front of a stack for s and p light.

    Attributes
    ----------
    s, p : _Wave
    flux : ndarray
        4 eta0 Re(eta_sub), which T divides.
    shape : tuple of int
        The common shape of all arguments; the fields may have fewer axes.
    """

    s: _Wave
    p: _Wave
    flux: Floats
    shape: tuple[int, ...]


def _fields(
    n_front: ArrayLike, n_back: ArrayLike, indices: Sequence[ArrayLike], thicknesses_nm: Sequence[ArrayLike],
    wavelength_nm: ArrayLike, cos_front: ArrayLike,
) -> _Fields:  # fmt: skip
    # not broadcast to the common shape: operations on numbers cost less than on arrays of equal numbers
    n0, nb, wave, c0, *films = (
        np.asarray(a, dtype=np.float64) for a in (n_front, n_back, wavelength_nm, cos_front, *indices, *thicknesses_nm)
    )
    shape = np.broadcast_shapes(n0.shape, nb.shape, wave.shape, c0.shape, *(film.shape for film in films))
    films_n, films_d = films[: len(indices)], films[len(indices) :]
    _check(n0, nb, wave, c0, films_n, films_d)

    cos_back = _cos_squared(n0, nb, c0)
    # lossless films: the sign of an imaginary cosine in the last medium does not change any modulus
    real, imaginary = np.sqrt(np.maximum(cos_back, 0.0)), np.sqrt(np.maximum(-cos_back, 0.0))
    # from the back to the front, with the cosine q of the last medium kept apart, so that all factors are real:
    # s: B = s[0] + i s[1] q, C = s[2] q + i s[3]; p, multiplied by q: B = p[0] q + i p[1], C = p[2] + i p[3] q
    one, zero = np.ones(()), np.zeros(())
    s: _Factors = (one, zero, nb, zero)
    p = s
    decay: Floats | float = zero
    for n, d in zip(reversed(films_n), reversed(films_d), strict=True):
        c2 = _cos_squared(n0, n, c0)
        kd = 2.0 * np.pi * d / wave
        C, S, q = _cos_and_sinc(kd * kd * n * n * c2)
        along = S * kd
        across = along * n * n
        s = _through_film(s, C, along, across * c2)
        p = _through_film(p, C, along * c2, across)
        decay = decay + q
    front = n0 * c0
    return _Fields(
        _Wave((front * (s[0] - s[1] * imaginary), front * s[1] * real), (s[2] * real, s[2] * imaginary + s[3])),
        _Wave(
            (n0 * p[0] * real, n0 * (p[0] * imaginary + p[1])), (c0 * (p[2] - p[3] * imaginary), c0 * p[3] * real)
        ),
        4.0 * front * nb * real * np.exp(-2.0 * decay),
        shape,
    )  # fmt: skip


def _reflected(wave: _Wave) -> Floats:
    """Return R = |(a - c)/(a + c)|^2, and 0 where both vanish."""
    (a, ia), (c, ic) = wave
    return _where_not_zero(np.square(a - c) + np.square(ia - ic), np.square(a + c) + np.square(ia + ic), 0.0)


def _transmitted(wave: _Wave, flux: Floats) -> Floats:
    """Return T = flux / |a + c|^2, and 1 where |a + c| vanishes."""
    (a, ia), (c, ic) = wave
    return _where_not_zero(flux, np.square(a + c) + np.square(ia + ic), 1.0)


def _where_not_zero(top: Floats, bottom: Floats, otherwise: float) -> Floats:
    """Return top / bottom, and a number where the bottom is 0."""
    nothing = bottom == 0.0
    if not nothing.any():
        return top / bottom
    return np.where(nothing, otherwise, top / np.where(nothing, 1.0, bottom))


def _pair(values: tuple[Floats, Floats], shape: tuple[int, ...]) -> Floats:
    """Return values of s and p light as one array of shape (2, *shape)."""
    return np.stack([np.broadcast_to(part, shape) for part in values])


_Factors = tuple[Floats, Floats, Floats, Floats]


def _through_film(factors: _Factors, C: Floats, upper: Floats, lower: Floats) -> _Factors:
    """Multiply B and C by the matrix [[C, i upper], [i lower, C]] of a film."""
    b, ib, c, ic = factors
    return C * b - upper * ic, C * ib + upper * c, C * c - lower * ib, C * ic + lower * b


def _cos_and_sinc(x: Floats) -> tuple[Floats, Floats, Floats | float]:
    """Return cos(delta), sin(delta)/delta and q for x = delta^2; both are divided by e^q where x < 0.

    Without this scale a thick evanescent film overflows; it cancels in R and T compensates for it.
    """
    w = np.sqrt(np.abs(x))
    safe = np.where(w > 0.0, w, 1.0)
    # w is 0 where `safe` is not w, and sin(0)/0 is 1
    C, S = np.cos(w), np.where(w > 0.0, np.sin(w) / safe, 1.0)
    fades = x < 0.0
    if not fades.any():
        return C, S, 0.0
    q = np.where(fades, w, 0.0)
    C = np.where(fades, 0.5 * (1.0 + np.exp(-2.0 * q)), C)
    S = np.where(fades, -0.5 * np.expm1(-2.0 * q) / safe, S)
    return C, S, q
