"""Colour correction for ghosts whose throughput changes fast between the traced wavelengths.

Final quality draws slivers at more wavelengths; for other steep ghosts it measures the throughput at more wavelengths
and corrects the colours. Drafts compute the flux in the picture at any wavelength from matrices and do the same. Steep
are ghosts whose throughput at the traced wavelengths and at the ends of the spectrum lies off the line
(docs/adr/0037-rays-carry-the-means-of-their-bands.md).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...kernels.raster.bundle import draw_bundle, node_densities
from ...kernels.tracing.sequential import ALIVE, WEIGHT
from ...optics.rays.bundle import Bundle, trace_bundle, trace_points
from ...optics.rays.path_reflectance import CURVE_NM, PathSpectrum
from ...optics.rays.steepness import bright_wavelengths, gap_errors, interpolation_error, throughput_ratios
from ...optics.rays.torn_cells import cut_failed_triangles
from ...typing import Floats, Mask
from ..image.canvas import blank
from ..scene.path_color import areas_between, lagrange
from ..scene.shot import Shot, seen_light

# lowest expected colour error for a correction, relative to the ghost's largest channel
COLOR_ERROR, DRAFT_COLOR_ERROR = 0.009, 0.0077
# the same for a draft that is dark at a wavelength: it begins like a square root, of which a spline sees a part
ENDED_COLOR_ERROR = 0.004
# above this error a few wavelengths do not suffice for the colour correction
LARGE_ERROR = 0.02
# above this error a gap between fine wavelengths is resolved
GAP_ERROR = 0.003
# a throughput below this part of the largest counts as zero, so the ghost ends within the spectrum
DARK_PART = 1e-3
# ghosts whose throughput changes less than this between ends and middle of the spectrum, relative, are not steep
LEAST_CHANGE = 0.1
# below this part of the largest throughput, a wavelength does not show the ghost's shape
SLIVER_PART = 0.2
# a ghost's light ends abruptly where it is dark at one wavelength and above this part of the largest at the next
ABRUPT_PART = 0.1
# light begins between two wavelengths if one has less than this part of the other's throughput, and matters if the gap
# has this share of the ghost's colour
BEGIN_PART, BEGIN_SHARE = 0.05, 0.05
# a ghost's flux is measured with rays traced at every fourth fine wavelength and at the ends, and interpolated between
# these; where it bends by less than a part of the largest flux between every other fine wavelength, it is interpolated:
# against rays traced and drawn at all, the colours of 59 steep ghosts of nine lenses differ by at most 0.3 %
RAY_STRIDE, BEND = 4, 5e-3
# size of the pictures by which a ghost's flux is measured
SMALL_PX = (64, 36)
# drafts do not correct ghosts fainter than this, relative to the largest channel of the brightest
FAINT_PART = 7e-4
# steps of the search for an end between two wavelengths of a curve, to 0.08 nm
BISECTIONS = 5
# places and shares of Gauss' rule from 0 to 1 (Abramowitz and Stegun 1964, 25.4.30)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
ROOTS, SHARES = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


def steepness(
    shot: Shot, bundle: Bundle, spectrum: PathSpectrum | None, to_pixels: Floats
) -> Literal["not", "little", "much"]:
    """Judge whether a ghost's colour is wrong because its throughput is steep between the traced wavelengths.

    Parameters
    ----------
    shot : Shot
    bundle : Bundle
    spectrum : PathSpectrum or None
        From `path_color.traced_spectrum`.
    to_pixels : ndarray, shape (4,)
        As in `path_color.traced_spectrum`.

    Returns
    -------
    str
        "not": correct, or not visible. "little": only the colour is wrong, because all traced wavelengths show the
        ghost. "much": a sliver, whose shape some traced wavelengths do not show.
    """
    if shot.between is None:
        return "not"
    fine_nm, traced_nm = shot.between.fine_nm, shot.packed.wavelengths_nm
    known_nm, drawn, few, others = _known_wavelengths(
        (fine_nm[0], fine_nm[-1]), tuple(traced_nm), tuple(sorted(bundle.traced))
    )
    throughput = np.empty(len(known_nm))
    throughput[few] = first = areas_between(shot, bundle, known_nm[few], to_pixels)
    # without a traced wavelength that shows the ghost, extrapolation is too rough to draw it at 21
    if not first[drawn[few]].any() or first.max() - first.min() <= LEAST_CHANGE * first.max():
        return "not"
    if others.size:
        throughput[others] = areas_between(shot, bundle, known_nm[others], to_pixels)
    passed = np.ones(len(CURVE_NM)) if spectrum is None else spectrum.passed
    error, total = interpolation_error(passed, seen_light(shot), known_nm, throughput, drawn)
    if not error > COLOR_ERROR * total and not _begins_in_a_gap(shot, passed, known_nm, throughput):
        return "not"
    throughput = throughput[drawn]
    return "much" if throughput.min() < SLIVER_PART * throughput.max() else "little"


@lru_cache(maxsize=64)
def _known_wavelengths(
    ends_nm: tuple[float, float], traced_nm: tuple[float, ...], waves: tuple[int, ...]
) -> tuple[Floats, Mask, NDArray[np.intp], NDArray[np.intp]]:
    """Return traced wavelengths and ends of the spectrum, ascending; the traced ones; ends and `waves`; all others."""
    known_nm = np.union1d(ends_nm, traced_nm)
    drawn = np.isin(known_nm, traced_nm)
    few = np.unique([0, *np.flatnonzero(drawn)[list(waves)], len(known_nm) - 1])
    return known_nm, drawn, few, np.setdiff1d(np.arange(len(known_nm)), few)


def _begins_in_a_gap(shot: Shot, passed: Floats, known_nm: Floats, throughput: Floats) -> bool:
    """Return whether much light is between two wavelengths of which one hardly shows the ghost.

    Throughput begins there like a square root or later: the line is wrong by up to a third of the gap, the spline by
    less.
    """
    low, high = np.minimum(throughput[1:], throughput[:-1]), np.maximum(throughput[1:], throughput[:-1])
    begins = (low < BEGIN_PART * high) & (high > ABRUPT_PART * throughput.max())
    if not begins.any():
        return False
    _, shares = gap_errors(passed, seen_light(shot), known_nm, throughput[None])
    return bool((shares[0][begins] > BEGIN_SHARE).any())


def bent_spectrum(
    shot: Shot, fine: Shot, bundle: Bundle, spectrum: PathSpectrum | None, to_pixels: Floats
) -> PathSpectrum:
    """Multiply a ghost's throughput between the traced wavelengths into the spectrum that coatings pass.

    Parameters
    ----------
    shot, fine : Shot
        The drawn shot, and the same at more wavelengths (`shot.at_fine_wavelengths`).
    bundle : Bundle
        Of `fine`.
    spectrum : PathSpectrum or None
        Of `shot`.
    to_pixels : ndarray, shape (4,)
        As in `path_color.traced_spectrum`.

    Returns
    -------
    PathSpectrum
        For `Shot.weights`.
    """
    # use one grid for both, so that its errors cancel
    found, known = _fluxes(shot, fine, bundle, to_pixels)
    assert shot.between is not None
    traced_nm = shot.packed.wavelengths_nm
    if spectrum is None:
        spectrum = PathSpectrum(np.ones(len(CURVE_NM)), np.ones(len(traced_nm)))
    if not known.min() > 0.0:
        return spectrum
    # not `@`, whose library threads busy-wait next to ours
    curve = np.einsum("m,ml->l", found, shot.between.spread)[None]
    _, ratios = throughput_ratios(np.ones(len(traced_nm), dtype=np.bool_), traced_nm, known[None], curve)
    return PathSpectrum(spectrum.passed * ratios[0], spectrum.carried)


def _fluxes(shot: Shot, fine: Shot, bundle: Bundle, to_pixels: Floats) -> tuple[Floats, Floats]:
    """Return the light in the picture if all rays carry 1, mm^2, at the wavelengths of `fine` and at those of `shot`.

    The bundle is drawn, small: a sum of nodes that pass would jump by 8 % from wavelength to wavelength where a ghost
    covers few cells.
    """
    assert shot.between is not None
    place = to_pixels * np.tile(np.array(SMALL_PX) / shot.size_px, 2)
    fine_rays, traced_rays = _rays(shot, fine, bundle)

    def flux(rays: Floats) -> float:
        rays[:, WEIGHT] = 1.0
        whole, data = cut_failed_triangles(bundle, rays)
        canvas = blank(SMALL_PX)
        draw_bundle(
            data, whole.pupil, whole.triangles, node_densities(data, whole.pupil, whole.triangles),
            bundle.path.stop_crossings, shot.opening.blades, shot.opening.levels, shot.incidence.axes, place, 1.0,
            np.ones(3), canvas.plane(), whole.halves,
        )  # fmt: skip
        return float(canvas.plane()[..., 0, :].sum(dtype=np.float64))

    fine_nm, traced_nm = fine.packed.wavelengths_nm, shot.packed.wavelengths_nm
    least_bend = BEND if shot.between.lines_nm is None else -1.0
    found = interpolated_where_straight(fine_nm, lambda w: flux(fine_rays(w)), least_bend)
    return found, np.array([flux(traced_rays(w)) for w in range(len(traced_nm))])


def interpolated_where_straight(wavelengths_nm: Floats, at: Callable[[int], float], bend: float = BEND) -> Floats:
    """Compute a curve at every other wavelength, and at those between only where it bends.

    Parameters
    ----------
    wavelengths_nm : ndarray, shape (M,)
        Rising.
    at : callable
        The value at one of them, at least 0.
    bend : float
        Where the cubic through the nearest four values is this close to the line through two, relative to the largest
        value, it stands for the value. Negative: compute all.

    Returns
    -------
    ndarray, shape (M,)

    Examples
    --------
    >>> interpolated_where_straight(np.arange(7.0), lambda w: max(w - 3.0, 0.0)).tolist()
    [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    """
    count = len(wavelengths_nm)
    known = np.union1d(np.arange(0, count, 2), [count - 1]) if bend >= 0.0 and count > 3 else np.arange(count)
    values = np.empty(count)
    values[known] = [at(w) for w in known.tolist()]
    limit = bend * values[known].max()
    for w in np.setdiff1d(np.arange(count), known).tolist():
        near = known[np.argsort(np.abs(known - w), kind="stable")[:4]]
        line, cubic = (
            float(lagrange(tuple(wavelengths_nm[nodes]), (wavelengths_nm[w],))[0] @ values[nodes])
            for nodes in (near[:2], near)
        )
        values[w] = max(cubic, 0.0) if abs(cubic - line) <= limit else at(w)
    return values


def _rays(shot: Shot, fine: Shot, bundle: Bundle) -> tuple[Callable[[int], Floats], Callable[[int], Floats]]:
    """Return functions that copy a bundle's rays at a wavelength of `fine`, and of `shot`; few of them are traced.

    Rays at the others are polynomials in 1 / wavelength^2 through the nearest three, as in `areas_between`, unless a
    ray ends in the lens at one of the three only. Lines may be far apart: they are all traced.
    """
    assert shot.between is not None
    fine_nm, tilt, is_lines = fine.packed.wavelengths_nm, shot.incidence.tilt, shot.between.lines_nm is not None
    # the last gap may be longer
    few = np.unique(np.append(np.arange(0, len(fine_nm) - RAY_STRIDE, RAY_STRIDE), len(fine_nm) - 1))

    @cache
    def traced(w: int) -> Floats:
        return trace_bundle(fine.packed, w, bundle, tilt)

    def between(wavelength_nm: float) -> Floats | None:
        nearest = int(np.abs(fine_nm - wavelength_nm).argmin())
        first = min(max(int(np.searchsorted(few, nearest)) - 1, 0), len(few) - 3)
        three = few[first : first + 3]
        a, b, c = (traced(int(w)) for w in three)
        if not (np.array_equal(a[:, ALIVE], b[:, ALIVE]) and np.array_equal(a[:, ALIVE], c[:, ALIVE])):
            return None
        of_a, of_b, of_c = lagrange(tuple(fine_nm[three] ** -2.0), (wavelength_nm**-2.0,))[0]
        rays: Floats = of_a * a + of_b * b + of_c * c
        return rays

    def at_fine(w: int) -> Floats:
        data = None if is_lines or w in few else between(fine_nm[w])
        return traced(w).copy() if data is None else data

    def at_traced(w: int) -> Floats:
        data = None if is_lines else between(shot.packed.wavelengths_nm[w])
        return trace_points(shot.packed, w, bundle.path, tilt, bundle.pupil) if data is None else data

    return at_fine, at_traced


def steep_paths(
    shot: Shot, known_nm: Floats, throughput: Floats, spectra: PathSpectrum | None, abrupt: Mask | bool = False
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Select the paths whose colours are wrong because their throughput is steep between the traced wavelengths.

    Parameters
    ----------
    shot : Shot
    known_nm : ndarray, shape (N,)
        The traced wavelengths and `Between.beyond`, ascending.
    throughput : ndarray, shape (P, N)
        Flux there over what rays carry.
    spectra : PathSpectrum or None
        Of all paths.
    abrupt : ndarray, shape (P,), bool, or bool
        Paths whose mirrors change fast with the angle: they are steep.

    Returns
    -------
    a_little, much : ndarray of int
        Indices by the size of the error; paths much fainter than the brightest are left out.
    """
    passed = np.ones(len(CURVE_NM)) if spectra is None else spectra.passed
    drawn = np.isin(known_nm, shot.packed.wavelengths_nm)
    error, total = interpolation_error(passed, seen_light(shot), known_nm, throughput, drawn)
    # most of a ghost's light may be the error
    seen = np.maximum(total, error) > FAINT_PART * total.max(initial=0.0)
    # a ghost that is dark at one of these wavelengths ends within the spectrum
    ended = throughput.min(axis=1) < DARK_PART * throughput.max(axis=1)
    much = seen & (abrupt | (error > np.where(ended, ENDED_COLOR_ERROR, LARGE_ERROR) * total))
    return np.flatnonzero(seen & ~much & (error > DRAFT_COLOR_ERROR * total)), np.flatnonzero(much)


def bent_weights(shot: Shot, throughput: Floats, spectra: PathSpectrum | None, fine: Floats) -> Floats:
    """Return the RGB weights of the traced wavelengths for paths whose throughput is known at many.

    Parameters
    ----------
    shot : Shot
    throughput : ndarray, shape (P, W)
        Their drawn flux at the traced wavelengths over what rays carry.
    spectra : PathSpectrum or None
        Of these paths.
    fine : ndarray, shape (P, L)
        Their throughput if `CURVE_NM` were traced.

    Returns
    -------
    ndarray, shape (P, W, 3)
        Weights that give the drawn ghosts the correct total light in each channel.
    """
    traced_nm, light = shot.packed.wavelengths_nm, seen_light(shot)
    lit = bright_wavelengths(throughput, fine)
    weights = np.zeros((*throughput.shape, 3))
    # a number for each combination: `unique` of rows takes as long as a kernel
    kinds = lit @ (1 << np.arange(lit.shape[1]))
    for kind in sorted({*kinds.tolist()} - {0}):
        alike = np.flatnonzero(kinds == kind)
        which = lit[alike[0]]
        shares, passed = throughput_ratios(which, traced_nm, throughput[alike], fine[alike])
        if spectra is not None:
            passed = passed * spectra.passed[alike]
        parts = (shares[:, :, None] * light).transpose(1, 0, 2).reshape(len(light), -1)
        weights[alike] = np.einsum("pl,lk->pk", passed, parts).reshape(len(alike), -1, 3)
    return weights if spectra is None else over(weights, spectra.carried[..., None])


def ends(throughput: Floats, least: float = DARK_PART) -> tuple[Mask, Mask]:
    """Find where the light of paths ends between two wavelengths.

    Parameters
    ----------
    throughput : ndarray, shape (P, M)
        At rising wavelengths.
    least : float
        Least part of the largest throughput beside the dark; `ABRUPT_PART`: ends as under total reflection.

    Returns
    -------
    rises, falls : ndarray, shape (P, M - 1), bool
        The gaps in which light begins and ends.
    """
    most = throughput.max(axis=1, keepdims=True)
    dark, bright = throughput < DARK_PART * most, throughput > least * most
    return dark[:, :-1] & bright[:, 1:], bright[:, :-1] & dark[:, 1:]


def gaps_at_ends(rises: Mask, falls: Mask) -> Mask:
    """Return the gaps in which the light of paths ends, and the next, where it changes fast, shape (P, M - 1).

    Parameters
    ----------
    rises, falls : ndarray, shape (P, M - 1), bool
        From `ends`.
    """
    gaps = rises | falls
    gaps[:, 1:] |= rises[:, :-1]
    gaps[:, :-1] |= falls[:, 1:]
    return gaps


def steep_gaps(shot: Shot, fine_nm: Floats, throughput: Floats, spectra: PathSpectrum | None) -> Mask:
    """Return the gaps in which a line between the fine wavelengths is not good enough, shape (P, M - 1).

    Parameters
    ----------
    shot : Shot
    fine_nm : ndarray, shape (M,)
        Rising.
    throughput : ndarray, shape (P, M)
        At these.
    spectra : PathSpectrum or None
        Of the paths.
    """
    passed = np.ones(len(CURVE_NM)) if spectra is None else spectra.passed
    errors, shares = gap_errors(passed, seen_light(shot), fine_nm, throughput)
    gently, abruptly = (gaps_at_ends(*ends(throughput, least)) for least in (DARK_PART, ABRUPT_PART))
    return abruptly | (gently & (shares > GAP_ERROR)) | (errors > GAP_ERROR)


def within_gaps(fine_nm: Floats, gaps: Mask) -> NDArray[np.intp]:
    """Return which of `CURVE_NM` lie within some gaps between rising wavelengths.

    Parameters
    ----------
    fine_nm : ndarray, shape (M,)
    gaps : ndarray, shape (M - 1,), bool
    """
    inner, gap = _inner_wavelengths(tuple(fine_nm))
    return inner[gaps[gap]]


@lru_cache(maxsize=64)
def _inner_wavelengths(fine_nm: tuple[float, ...]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which of `CURVE_NM` lie strictly within a gap between rising wavelengths, and the gap of each."""
    within = (fine_nm[0] < CURVE_NM) & (fine_nm[-1] > CURVE_NM)
    inner = np.flatnonzero(within & ~np.isin(CURVE_NM, fine_nm))
    return inner, np.searchsorted(fine_nm, CURVE_NM[inner]) - 1


def light_up_to_its_end(bright: float, at: Callable[[float], float]) -> tuple[float, float]:
    """Integrate the throughput over a gap in which light ends.

    Parameters
    ----------
    bright : float
        Throughput at the bright bound.
    at : callable
        Throughput at a distance from this bound, as a part of the gap.

    Returns
    -------
    near, far : float
        Integrals over the gap, of length 1, of throughput times the part that the bright and the dark bound have by
        linear interpolation.
    """
    lit, dark = 0.0, 1.0
    for _ in range(BISECTIONS):
        place = 0.5 * (lit + dark)
        if at(place) > DARK_PART * bright:
            lit = place
        else:
            dark = place
    end = 0.5 * (lit + dark)
    # light ends like the square root of the distance u^2 from the end, of which Gauss' rule over u has no error
    part = end * (1.0 - ROOTS**2)
    light = 2.0 * end * ROOTS * SHARES * np.maximum([at(place) for place in part.tolist()], 0.0)
    return float((light * (1.0 - part)).sum()), float((light * part).sum())


def over(values: Floats, carried: Floats) -> Floats:
    """Divide by the weight of rays; 0 where it is 0."""
    return np.divide(values, carried, out=np.zeros_like(values), where=carried > 0.0)
