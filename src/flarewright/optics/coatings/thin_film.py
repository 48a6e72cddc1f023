"""Reflectance of a coated surface by characteristic matrices; bare Fresnel is the empty stack.

A film stack is two sequences, `indices` and `thicknesses_nm`, in the order in which light along +z meets the films.
All media are lossless, so every cos^2 inside the stack is real (negative where the wave is evanescent) and the matrix
of a film needs no complex arithmetic: with x = delta^2 it contains only cos(delta) and sin(delta)/delta. Both are
even in delta and therefore real and smooth through the critical angle of the film.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flarewright.errors import FlarewrightError
from flarewright.model.lens.coating import Bare, Coating, Film, QuarterWave, Standard

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
    R, _ = stack_reflectance_transmittance(n_front, n_back, indices, thicknesses_nm, wavelength_nm, cos_front)
    mean: Floats = 0.5 * (R[0] + R[1])
    return mean


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
    films = [np.asarray(a, dtype=np.float64) for a in (*indices, *thicknesses_nm)]
    n0, nb, wave, c0, *films = np.broadcast_arrays(
        *(np.asarray(a, dtype=np.float64) for a in (n_front, n_back, wavelength_nm, cos_front)), *films
    )
    films_n, films_d = films[: len(indices)], films[len(indices) :]
    _check(n0, nb, wave, c0, films_n, films_d)

    cb2 = _cos_squared(n0, nb, c0)
    # lossless films: the sign of an imaginary cosine in the last medium does not change any modulus
    cb = np.sqrt(cb2.astype(np.complex128))

    # from the back to the front: start with (B, C) of the last medium, for p multiplied by its cosine
    Bs, Cs = np.ones_like(cb), nb * cb
    Bp, Cp = cb, nb.astype(np.complex128)
    decay = np.zeros_like(c0)
    for n, d in zip(reversed(films_n), reversed(films_d), strict=True):
        c2 = _cos_squared(n0, n, c0)
        kd = 2.0 * np.pi * d / wave
        C, S, q = _cos_and_sinc(kd * kd * n * n * c2)
        Bs, Cs = C * Bs + 1j * (S * kd) * Cs, 1j * (S * kd * n * n * c2) * Bs + C * Cs
        Bp, Cp = C * Bp + 1j * (S * kd * c2) * Cp, 1j * (S * kd * n * n) * Bp + C * Cp
        decay = decay + q

    flux = 4.0 * n0 * c0 * nb * cb.real * np.exp(-2.0 * decay)
    Rs, Ts = _reflect(n0 * c0 * Bs, Cs, flux)
    Rp, Tp = _reflect(n0 * Bp, c0 * Cp, flux)
    return np.stack([Rs, Rp]), np.stack([Ts, Tp])


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


def _cos_and_sinc(x: Floats) -> tuple[Floats, Floats, Floats]:
    """Return cos(delta), sin(delta)/delta and q for x = delta^2; both are divided by e^q where x < 0.

    Without this scale a thick evanescent film overflows; it cancels in R and T compensates for it.
    """
    w = np.sqrt(np.abs(x))
    fades = x < 0.0
    q = np.where(fades, w, 0.0)
    safe = np.where(w > 0.0, w, 1.0)
    # np.sinc is sin(pi t)/(pi t) and exact at 0
    C = np.where(fades, 0.5 * (1.0 + np.exp(-2.0 * q)), np.cos(w))
    S = np.where(fades, -0.5 * np.expm1(-2.0 * q) / safe, np.sinc(w / np.pi))
    return C, S, q


def _reflect(a: NDArray[np.complex128], c: NDArray[np.complex128], flux: Floats) -> tuple[Floats, Floats]:
    """Return R = |(a - c)/(a + c)|^2 and T = flux / |a + c|^2."""
    num = np.abs(a - c) ** 2
    den = np.abs(a + c) ** 2
    nothing = den == 0.0
    den = np.where(nothing, 1.0, den)
    return np.where(nothing, 0.0, num / den), np.where(nothing, 1.0, flux / den)
