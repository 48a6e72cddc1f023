"""Ghosts, final quality: traced ray bundles on adaptive grids (Hullin et al. 2011).

For every path a pre-pass bounds the accepted pupil, a grid is refined where the map bends, folds or is cut, and each
triangle's flux is spread over its image. Between traced wavelengths the bundles are interpolated, so that lateral
colour runs smoothly instead of in steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil, sqrt
from threading import Event
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels.bundle import draw_bundle, measure_bundle, node_densities
from ..kernels.lit_edge import bounded_by_iris
from ..kernels.standing import wide_shift
from ..kernels.trace import ALIVE, WEIGHT
from ..model import Quality
from ..optics.border import mapped, points
from ..optics.bundle import Bundle, trace_bundle, trace_grid
from ..optics.coating_curves import PathSpectrum
from ..optics.grating import GratingOrder, grating_orders
from ..optics.paths import LightPath
from ..optics.region import Region, find_region, grown, measure_region
from ..optics.tears import mended
from .art import PLAIN, Frame, PathArt
from .canvas import DETAIL_CONTRAST, DETAILS, Canvas, Plane, blank, merge
from .few_colors import gathered_weights
from .final_pass import FinalPass
from .grade import coarseness, finish
from .path_color import seen_of, traced_spectrum
from .shot import Shot, finer
from .sources import NARROW_PX, halvings, motion, spread_border
from .spread import shape_kernel, spread_within
from .steep import bundle_is_steep

if TYPE_CHECKING:
    from ..optics.fresnel import Box
    from .ringing import Rings
    from .surroundings import Surroundings

Floats = NDArray[np.float64]

# lateral colour wider than this many pixels between two drawn wavelengths would show as steps
BRIDGE_PX = 2.0
SHIFT_QUANTILE = 0.9
# a step of colour or a ring fainter than this part of the picture's mean is not seen
STEP_CONTRAST = 2e-3
# and on a screen, whose steps are this many times coarser, the rim's error may be doubled so often
SCREEN, SCREEN_ROUGH = 10.0, 5
# up to this tolerance; what may be misplaced farther may be as many times coarser in its steps and its ripples too
SCREEN_PX = 0.5
# and a ghost this many times fainter still needs one colour only
ONE_COLOR = 1.0 / 6.0
# and where nothing but fringes ends a ghost, steps of this part of their scale sqrt(lambda L / 2)
BRIDGE_FRINGES = 0.4
# by which a grid may get the places of fringes wrong, of the same
FRINGE_PART = 0.03
# farther into the shadow than this part of it light is faint: half a percent or less
FAINT_SHADOW = 0.5
# a region is made larger by this part at most without looking for it anew
MOST_GROWN = 0.25
# never more drawings than this between two traced wavelengths
MOST_BRIDGES = 32


def find_final(
    shot: Shot, path: LightPath, art: PathArt = PLAIN, entry: Region | None = None, around: Floats | None = None,
    quick: bool = False, traced: Floats | None = None,
) -> FinalPass | None:  # fmt: skip
    """Look where a path accepts light; None when it passes nothing.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    art : PathArt
        What is changed about it by hand.
    entry : Region, optional
        What reaches the stop without a mirror, of a path that begins so (`LightPath.entry`).
    around : ndarray, shape (4,), optional
        A part of the pupil known to hold all that the path accepts; of a point that `art` does not frame.
    quick : bool
        As in `optics.region.find_region`.
    traced : ndarray, optional
        The path's part of `optics.region.first_look`.

    Returns
    -------
    FinalPass or None
    """
    lens, tilt, iris_radius = shot.packed, shot.incidence.tilt, shot.opening.radius
    frame, within = None, None if entry is None else entry.box
    if art.framed:
        whole = find_region(lens, path, tilt, iris_radius, within=within)
        if whole is None:
            return None
        frame = _frame(shot, path, whole)
    view_radius, source, detail = art.view_radius(shot.view_radius, frame), None, 0
    to_pixels = art.place(shot.to_pixels, frame)
    if shot.border is not None:
        moved = motion(shot, path)
        if moved is not None:
            border = spread_border(shot, moved[0], to_pixels)
            ends = points(border)
            if np.abs(ends).max() > NARROW_PX:
                zoom = float(to_pixels[2:].min())
                source, detail = border, halvings(border, moved[1] * zoom, DETAILS - 1)
                view_radius += float(np.hypot(*ends.T).max()) / zoom
    orders: tuple[GratingOrder, ...] = ()
    if shot.grating is not None and path.sensor and path.second_reflection is not None and not path.later_reflections:
        orders = grating_orders(lens, path.second_reflection, shot.grating)
        view_radius += float(np.nanmax([np.hypot(*order.shift_mm.T) for order in orders]))
    if around is None:
        region = find_region(lens, path, tilt, iris_radius, view_radius, within, quick, traced)
    else:
        region = measure_region(lens, path, tilt, iris_radius, view_radius, around)
    if region is None:
        return None
    return FinalPass(shot, path, region, to_pixels, view_radius, art, frame, source, detail, orders)


def find_entry(shot: Shot, way_in: LightPath) -> Region | None:
    """Find the part of the pupil whose light reaches the stop, or None when nothing does.

    Parameters
    ----------
    shot : Shot
    way_in : LightPath
        `LightPath.entry` of any path that has one.

    Returns
    -------
    Region or None
    """
    return find_region(shot.packed, way_in, shot.incidence.tilt, shot.opening.radius)


def _frame(shot: Shot, path: LightPath, region: Region) -> Frame:
    """Measure a ghost's centre and size at the middle wavelength, on the unbounded sensor plane."""
    opening, tilt = shot.opening, shot.incidence.tilt
    # only the rim matters for its place
    bundle = trace_grid(shot.packed, path, tilt, (opening.radius, opening.inner), region, tolerance=0.25, scale=1e-6)
    data = trace_bundle(shot.packed, len(shot.packed.wavelengths_nm) // 2, bundle, tilt)
    sums = measure_bundle(
        data, bundle.pupil, bundle.triangles, path.stop_crossings, opening.blades, shot.incidence.axes, bundle.halves
    )
    if sums[0] <= 0.0:
        return Frame((0.0, 0.0), 0.0)
    x, y = float(sums[1] / sums[0]), float(sums[2] / sums[0])
    return Frame((x, y), sqrt(max(2.0 * (sums[3] / sums[0] - x * x - y * y), 0.0)))


def coarser(quality: Quality) -> float:
    """Tell how many times coarser than a screen at its best a picture for one may be; 1 for a file."""
    return max(quality.tolerance_px / SCREEN_PX, 1.0) if quality.screen else 1.0


def contrast(item: FinalPass, level: float) -> float:
    """Compare a path's irradiance with the mean of all ghosts in the picture.

    Parameters
    ----------
    item : FinalPass
    level : float
        Mean irradiance of all ghosts in the picture.

    Returns
    -------
    float
    """
    return item.region.brightness * item.gain / item.art.scale**2 / level if level > 0.0 else float("inf")


def detail_of(visibility: float) -> int:
    """Return how often the resolution may be halved for a ghost of this `contrast`."""
    return sum(visibility < limit for limit in DETAIL_CONTRAST)


def draw_final(
    item: FinalPass,
    quality: Quality,
    canvas: Canvas,
    visibility: float = float("inf"),
    stop: Event | None = None,
    around: Surroundings | None = None,
) -> None:
    """Trace one path of one light and add it to a canvas.

    Parameters
    ----------
    item : FinalPass
    quality : Quality
    canvas : Canvas
        Added to.
    visibility : float
        Its `contrast`: what cannot be told from its surroundings needs neither sharp edges nor many wavelengths.
    stop : Event, optional
        Set to leave off between two wavelengths.
    around : Surroundings, optional
        The light that its rings lie in; None: they are looked at by themselves.
    """
    detail = detail_of(visibility)
    shot, path = item.shot, item.path
    tilt, opening = shot.incidence.tilt, shot.opening
    to_pixels = item.to_pixels / 2.0**detail
    scale = float(max(to_pixels[2], to_pixels[3]))
    few = visibility < STEP_CONTRAST and quality.bridge and not item.orders
    one_color = visibility < ONE_COLOR * STEP_CONTRAST
    bundle = trace_grid(
        shot.packed, path, tilt, (opening.radius, opening.inner), item.region,
        tolerance=quality.tolerance_px, scale=scale, view_radius=item.view_radius, one_color=few and one_color,
        rough=detail + (SCREEN_ROUGH if quality.screen else 0), coarse=quality.screen,
    )  # fmt: skip
    count = len(shot.packed.wavelengths_nm)
    spectrum = traced_spectrum(shot, path, bundle, item.to_pixels)
    if not few and bundle_is_steep(shot, bundle, spectrum, item.to_pixels):
        draw_final(_finer(item), quality, canvas, visibility, stop, around)
        return
    if few and _drawn_in_few(item, bundle, spectrum, canvas.plane(detail), to_pixels, careful=not quality.screen):
        return
    rings, step_px, sharp = None, BRIDGE_PX, bundle
    if shot.ringing is not None and visibility >= STEP_CONTRAST:
        pixels_per_mm = (float(to_pixels[2]), float(to_pixels[3]))
        nearness = shot.packed.nearness / shot.incidence.tilt_cosine
        rings = shot.ringing.of(shot.packed, path, shot.light, bundle, pixels_per_mm, nearness)
        # only here: what has no rings need not know how they are seen
        from .ripples import LEAST_RIPPLE, SCREEN_RIPPLE, ripples_seen

        least = SCREEN_RIPPLE * coarser(quality) if quality.screen else LEAST_RIPPLE
        rings = rings if rings is not None and ripples_seen(item, rings, bundle, around, 2.0**detail, least) else None
    if rings is not None:
        if _is_soft(bundle, opening.radius):
            step_px = max(BRIDGE_PX, BRIDGE_FRINGES * rings.fringe_px)
        bundle = _with_shadow(item, rings, quality, scale)
    traced = [trace_bundle(shot.packed, w, bundle, tilt) for w in range(count)]
    pieces = [1] * (count - 1)
    if quality.bridge:
        limit = float("inf") if rings is None else opening.radius
        pieces = _bridges(traced, limit, item.view_radius, scale, visibility, step_px)
    steps = [(w, k / n) for w, n in enumerate(pieces) for k in range(n)] + [(count - 1, 0.0)]
    fine_nm = np.interp([w + part for w, part in steps], np.arange(count), shot.packed.wavelengths_nm)
    carried = None if spectrum is None else spectrum.carried
    patterns, flux = None, None
    if rings is not None:
        # as the patterns: what has no rings needs none of it
        from .ring_flux import ring_flux

        patterns = rings.textures(fine_nm, _seen(item, rings, bundle, traced, to_pixels, canvas, detail))
        middle = steps.index((count // 2, 0.0))
        flux = ring_flux(shot, patterns, sharp, bundle, middle, to_pixels, canvas.size(detail), carried)
    for k, ((w, part), color) in enumerate(zip(steps, shot.weights(fine_nm, spectrum) * item.art.rgb, strict=True)):
        if stop is not None and stop.is_set():
            return
        if not color.any():
            continue
        data = traced[w]
        if part > 0.0:
            data = _between(data, traced[w + 1], part, (1.0, 1.0) if carried is None else (carried[w], carried[w + 1]))
        whole, data = mended(bundle, data)
        densities = node_densities(data, whole.pupil, whole.triangles)
        plane = canvas.plane(detail)
        rgb = color if flux is None else color * flux.kept(k, w + part, whole, data, densities)
        for place, share in _places(item, to_pixels, w, part):
            if patterns is not None:
                patterns.draw(k, whole, data, densities, shot.incidence.axes, place, shot.gain, rgb * share, plane)
            else:
                draw_bundle(
                    data, whole.pupil, whole.triangles, densities, path.stop_crossings, opening.blades,
                    opening.levels, shot.incidence.axes, place, shot.gain, rgb * share, plane, whole.halves,
                )  # fmt: skip


def _finer(item: FinalPass) -> FinalPass:
    """Look again where a path accepts light, at more wavelengths."""
    shot = finer(item.shot)
    found = find_region(shot.packed, item.path, shot.incidence.tilt, shot.opening.radius, item.view_radius)
    orders = item.orders
    if orders and shot.grating is not None and item.path.second_reflection is not None:
        orders = grating_orders(shot.packed, item.path.second_reflection, shot.grating)
    return replace(item, shot=shot, region=item.region if found is None else found, orders=orders)


def _places(item: FinalPass, to_pixels: Floats, w: int, part: float) -> list[tuple[Floats, float]]:
    """Tell where a ghost is drawn between two traced wavelengths, and how much of it: once, or for each order."""
    if not item.orders:
        return [(to_pixels, 1.0)]
    places = []
    for order in item.orders:
        shift = order.shift_mm[w] if part == 0.0 else (1.0 - part) * order.shift_mm[w] + part * order.shift_mm[w + 1]
        if np.isfinite(shift).all():
            place = to_pixels + np.append(shift * to_pixels[2:], [0.0, 0.0])
            places.append((place, order.efficiency))
    return places


def _drawn_in_few(
    item: FinalPass, bundle: Bundle, spectrum: PathSpectrum | None, plane: Plane, to_pixels: Floats, *, careful: bool
) -> bool:
    """Draw a ghost whose steps of colour nobody sees at its grid's wavelengths alone, if these can stand for all."""
    shot, path, opening = item.shot, item.path, item.shot.opening
    shown = tuple(sorted(bundle.traced))
    colors = shot.weights(shot.packed.wavelengths_nm, spectrum) * item.art.rgb
    seen = seen_of(shot, item.to_pixels)
    weights = gathered_weights(shot.packed, bundle, shot.incidence.tilt, colors, shown, seen, careful=careful)
    if weights is None:
        return False
    for w, rgb in weights.items():
        whole, data = mended(bundle, trace_bundle(shot.packed, w, bundle, shot.incidence.tilt))
        draw_bundle(
            data, whole.pupil, whole.triangles, node_densities(data, whole.pupil, whole.triangles),
            path.stop_crossings, opening.blades, opening.levels, shot.incidence.axes, to_pixels, shot.gain,
            np.ascontiguousarray(rgb), plane, whole.halves,
        )  # fmt: skip
    return True


def _is_soft(bundle: Bundle, iris_radius: float) -> bool:
    """Tell whether nothing but the iris bounds a bundle: no rim cuts it, and it does not fold."""
    return all(bounded_by_iris(data, bundle.triangles, iris_radius) for data in bundle.traced.values())


def _with_shadow(item: FinalPass, rings: Rings, quality: Quality, scale: float) -> Bundle:
    """Lay a path's grid anew, beyond the iris too: as far as its diffraction throws light."""
    shot, opening, tilt = item.shot, item.shot.opening, item.shot.incidence.tilt
    more = rings.reach / opening.radius - 1.0
    if more < MOST_GROWN:
        region = grown(shot.packed, item.region, tilt, 0.75 * more)
    else:
        region = find_region(shot.packed, item.path, tilt, rings.reach, item.view_radius) or item.region
    shadow = rings.reach - opening.radius
    return trace_grid(
        shot.packed, item.path, tilt, (rings.reach, max(0.0, opening.inner - shadow)), region,
        tolerance=quality.tolerance_px, scale=scale, view_radius=item.view_radius,
        fringe_px=max(quality.tolerance_px, FRINGE_PART * rings.fringe_px),
        faint_radius=opening.radius + FAINT_SHADOW * shadow,
    )  # fmt: skip


def _seen(
    item: FinalPass, rings: Rings, bundle: Bundle, traced: list[Floats], to_pixels: Floats, canvas: Canvas, detail: int
) -> list[Box | None]:
    """Tell which part of the stop comes into the picture at each crossing, where that saves anything."""
    if not rings.local:
        return [None] * item.path.stop_crossings
    # only here: few ghosts need it
    from .seen_stop import seen_in_stop

    places = [place for w in range(len(traced)) for place, _ in _places(item, to_pixels, w, 0.0)]
    crossings, shown = item.path.stop_crossings, places if item.orders else places[:1]
    return seen_in_stop(item.shot, bundle, traced, crossings, shown, canvas.size(detail))


def draw_alone(
    items: Sequence[FinalPass],
    quality: Quality,
    canvas: Canvas,
    stop: Event | None = None,
    around: Surroundings | None = None,
) -> None:
    """Draw ghosts on a plane of their own, spread, ramp and blur it, and add it to a canvas.

    Parameters
    ----------
    items : sequence of FinalPass
        One with a ramp, or any number without that share a blur and a spread (`FinalPass.alone`): both are linear.
    quality : Quality
    canvas : Canvas
        Added to.
    stop : Event, optional
        Set to leave off between two wavelengths.
    around : Surroundings, optional
        As in `draw_final`.
    """
    art, shot, frame, source = items[0].art, items[0].shot, items[0].frame, items[0].source
    detail = max(items[0].detail, coarseness(art, shot.to_pixels) if art.blur > 0.0 else 0)
    own = shot.to_pixels / 2.0**detail
    mx, my = art.margin(own)
    kernel = None if source is None else shape_kernel(source, 0.5**detail)
    if kernel is not None:
        mx, my = mx + kernel.shape[1] // 2, my + kernel.shape[0] // 2
    width, height = canvas.size(detail)
    sheet = blank((width + 2 * mx, height + 2 * my))
    beside = None if around is None else around.moved((mx, my), detail)
    small = None if source is None else mapped(source, 0.5**detail * np.eye(2))
    for item in items:
        shifted = item.to_pixels / 2.0**detail + np.array([mx, my, 0.0, 0.0])
        draw_final(replace(item, to_pixels=shifted, source=small), quality, sheet, stop=stop, around=beside)
    pixels = merge(sheet.planes, sheet.size_px)
    if kernel is not None:
        pixels = spread_within(pixels, kernel)
    if not art.alone:
        canvas.add(pixels, detail)
        return
    canvas.add(finish(pixels, art, frame, items[0].to_pixels / 2.0**detail, own), detail)


def _bridges(
    traced: list[Floats], iris_radius: float, view_radius: float, scale: float, visibility: float, step_px: float
) -> list[int]:
    """Into how many pieces to divide each gap between traced wavelengths so that no step is seen."""
    most = min(MOST_BRIDGES, max(1, int(visibility / STEP_CONTRAST))) if visibility < float("inf") else MOST_BRIDGES
    if most == 1:
        return [1] * (len(traced) - 1)
    # the few nodes that fly farthest carry hardly any light
    gaps = [wide_shift(short, long, iris_radius, view_radius, SHIFT_QUANTILE) for short, long in pairwise(traced)]
    return [min(max(ceil(gap * scale / step_px), 1), most) for gap in gaps]


def _between(short: Floats, long: Floats, part: float, carried: tuple[float, float] = (1.0, 1.0)) -> Floats:
    """Interpolate a bundle between two wavelengths; a ray lives where both live.

    Where coatings let pass far more at one than at the other, it is a ray's light over the mean, `carried`, that is
    interpolated: the dark wavelength knows as much of where light goes as the bright one.
    """
    # what a ray that ended holds may be infinite, on either side
    with np.errstate(invalid="ignore"):
        data = (1.0 - part) * short + part * long
        if carried[0] != carried[1] and min(carried) > 0.0:
            mean = (1.0 - part) * carried[0] + part * carried[1]
            relative = (1.0 - part) / carried[0] * short[:, WEIGHT] + part / carried[1] * long[:, WEIGHT]
            data[:, WEIGHT] = mean * relative
    data[:, ALIVE] = np.minimum(short[:, ALIVE], long[:, ALIVE])
    return data
