"""Ghosts in final quality: traced ray bundles on adaptive grids (Hullin et al. 2011).

For every path a pre-pass bounds the accepted pupil; a grid is refined where the map from pupil to sensor bends, folds
or is cut; and each triangle's flux is spread over its image. Bundles are interpolated between traced wavelengths, so
that lateral colour is smooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil, sqrt
from threading import Event
from typing import TYPE_CHECKING

import numpy as np

from ...kernels.raster.bundle import draw_bundle, measure_bundle, node_densities
from ...kernels.tracing.iris_edge import bounded_by_iris
from ...kernels.tracing.ray_interpolation import rays_between
from ...kernels.tracing.representative_rays import shift_quantile
from ...model import Quality
from ...optics.lens.paths import LightPath
from ...optics.pupil.polygon import mapped, points
from ...optics.rays.bundle import Bundle, Refinement, trace_bundle, trace_grid
from ...optics.rays.path_reflectance import PathSpectrum
from ...optics.rays.pupil_region import Region, find_region, measure_region, region_at_ends, widened_region
from ...optics.rays.torn_cells import cut_failed_triangles
from ...optics.scattering.sensor_grating import GratingOrder, grating_orders
from ...typing import Floats
from ..image.canvas import DETAIL_CONTRAST, DETAILS, Canvas
from ..image.sheet import Sheet
from ..scene.area_lights import NARROW_PX, halvings, motion, spread_border
from ..scene.art_rules import PLAIN, Frame, PathArt
from ..scene.path_color import traced_spectrum, visible_rays
from ..scene.shot import Shot, at_fine_wavelengths
from .art_filters import coarseness, filtered_ghost
from .cost import IDLE, CostMeter, Watch
from .extent_blur import placed, shape_kernel, spread_bands, spread_window
from .final_pass import FinalPass
from .steep_ghosts import bent_spectrum, steepness
from .wavelength_subset import gathered_weights

if TYPE_CHECKING:
    from ...optics.diffraction.fresnel import Box
    from .background_level import Surroundings
    from .diffraction_rings import Rings


# lateral colour wider than this between two drawn wavelengths is visible as steps, pixels
BRIDGE_PX = 2.0
SHIFT_QUANTILE = 0.9
# a colour step or a ring fainter than this part of the picture's mean is invisible
STEP_CONTRAST = 2e-3
# for screens: factor on STEP_CONTRAST, and how often the allowed error at a ghost's edge may be doubled
SCREEN, SCREEN_ROUGH = 10.0, 5
# a tolerance above this one scales the allowed steps and ripples of a screen picture too
SCREEN_PX = 0.5
# below STEP_CONTRAST times this, one colour suffices
ONE_COLOR = 1.0 / 6.0
# for ghosts bounded only by fringes: lateral colour between drawn wavelengths, in sqrt(lambda L / 2)
BRIDGE_FRINGES = 0.4
# allowed error of fringe positions due to the grid, in sqrt(lambda L / 2)
FRINGE_PART = 0.03
# beyond this part of the shadow's width the light is faint: 0.5 % or less
FAINT_SHADOW = 0.5
# largest relative growth of a region without a new search
MOST_GROWN = 0.25
# largest number of drawings between two traced wavelengths
MOST_BRIDGES = 32


def find_final(
    shot: Shot, path: LightPath, art: PathArt = PLAIN, entry: Region | None = None, around: Floats | None = None,
    quick: bool = False, traced: Floats | None = None,
) -> FinalPass | None:  # fmt: skip
    """Search the accepted pupil of a path; None if it passes no light.

    Parameters
    ----------
    shot : Shot
    path : LightPath
    art : PathArt
        Overrides of the path.
    entry : Region, optional
        Region of the light that reaches the stop without reflection, for a path with `LightPath.entry`.
    around : ndarray, shape (4,), optional
        A box of the pupil that contains all accepted light; only for point lights that `art` does not frame.
    quick : bool
        As in `optics.rays.pupil_region.find_region`.
    traced : ndarray, optional
        The path's part of `optics.rays.pupil_region.first_look`.

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


def _frame(shot: Shot, path: LightPath, region: Region) -> Frame:
    """Measure centre and size of a ghost at the middle wavelength, on the unbounded sensor plane."""
    opening, tilt = shot.opening, shot.incidence.tilt
    # only the edge of the bundle matters for centre and size
    bundle = trace_grid(shot.packed, path, tilt, (opening.radius, opening.inner), region, Refinement(1e-6))
    data = trace_bundle(shot.packed, len(shot.packed.wavelengths_nm) // 2, bundle, tilt)
    sums = measure_bundle(
        data, bundle.pupil, bundle.triangles, path.stop_crossings, opening.blades, shot.incidence.axes, bundle.halves
    )
    if sums[0] <= 0.0:
        return Frame((0.0, 0.0), 0.0)
    x, y = float(sums[1] / sums[0]), float(sums[2] / sums[0])
    return Frame((x, y), sqrt(max(2.0 * (sums[3] / sums[0] - x * x - y * y), 0.0)))


def coarser_detail(quality: Quality) -> float:
    """Return the factor on the allowed visible errors of a screen picture; 1 for a file."""
    return max(quality.tolerance_px / SCREEN_PX, 1.0) if quality.screen else 1.0


def edge_contrast(item: FinalPass, level: float) -> float:
    """Return the ratio of a path's irradiance to the mean of all ghosts in the picture.

    Parameters
    ----------
    item : FinalPass
    level : float
        Mean irradiance of all ghosts in the picture.
    """
    return item.region.brightness * item.gain / item.art.scale**2 / level if level > 0.0 else float("inf")


def detail_of(visibility: float) -> int:
    """Return how often the resolution can be halved for a ghost of this `edge_contrast`."""
    return sum(visibility < limit for limit in DETAIL_CONTRAST)


def draw_final(
    item: FinalPass,
    quality: Quality,
    canvas: Canvas,
    visibility: float = float("inf"),
    stop: Event | None = None,
    around: Surroundings | None = None,
    detail: int | None = None,
    costs: CostMeter | None = None,
) -> None:
    """Trace one path of one light and add it to a canvas.

    Parameters
    ----------
    item : FinalPass
    quality : Quality
    canvas : Canvas
        Added to.
    visibility : float
        Contrast of the ghost: a faint one needs neither sharp edges nor many wavelengths.
    stop : Event, optional
        Set to stop between two wavelengths.
    around : Surroundings, optional
        Light around the ghost's rings; None: they are judged alone.
    detail : int, optional
        How often the canvas' resolution is halved for it; None: according to `visibility`.
    costs : CostMeter, optional
        Gets the time and the work of each stage.
    """
    watch = IDLE if costs is None else costs.watch(item.path.name)
    detail = detail_of(visibility) if detail is None else detail
    shot, path = item.shot, item.path
    tilt, opening = shot.incidence.tilt, shot.opening
    to_pixels = item.to_pixels / 2.0**detail
    scale = float(max(to_pixels[2], to_pixels[3]))
    few = visibility < STEP_CONTRAST and quality.bridge and not item.orders
    one_color = visibility < ONE_COLOR * STEP_CONTRAST
    fine, rough = Refinement(scale, quality.tolerance_px, item.view_radius), SCREEN_ROUGH if quality.screen else 0
    bundle = trace_grid(
        shot.packed, path, tilt, (opening.radius, opening.inner), item.region,
        replace(fine, one_color=few and one_color, rough=detail + rough, coarse=quality.screen),
    )  # fmt: skip
    watch.built(bundle, detail)
    spectrum = traced_spectrum(shot, path, bundle, item.in_picture)
    steep = "not" if few else steepness(shot, bundle, spectrum, item.in_picture)
    if steep != "not":
        other = _seen_by(at_fine_wavelengths(shot), item, nearby=steep == "little")
        if steep == "much":
            watch.lap("colour")
            draw_final(replace(other, least_steps=2), quality, canvas, visibility, stop, around, detail, costs)
            return
        # as fine as the drawn grid: with errors four times as large, two of 468 ghosts miss the 2 % limit
        grid = trace_grid(other.shot.packed, path, tilt, (opening.radius, opening.inner), other.region, fine)
        spectrum = bent_spectrum(shot, other.shot, grid, spectrum, item.in_picture)
    watch.lap("colour")
    if few and _drawn_in_few(item, bundle, spectrum, canvas, detail, watch, careful=not quality.screen):
        return
    rings = None
    if visibility >= STEP_CONTRAST:
        rings = _seen_rings(item, quality, bundle, to_pixels, detail, around)
    most = _steps_shown(shot, spectrum, visibility) if quality.bridge else None
    _draw_in_all(item, bundle, spectrum, rings, fine, canvas, detail, most, stop, watch)


def _draw_in_all(
    item: FinalPass, sharp: Bundle, spectrum: PathSpectrum | None, rings: Rings | None, fine: Refinement,
    canvas: Canvas, detail: int, most: list[int] | None, stop: Event | None, watch: Watch,
) -> None:  # fmt: skip
    """Draw a ghost at all traced wavelengths, and between them in at most `most` steps a gap; None: not at all."""
    shot, path, bundle, step_px = item.shot, item.path, sharp, BRIDGE_PX
    tilt, opening, count = shot.incidence.tilt, shot.opening, len(shot.packed.wavelengths_nm)
    to_pixels = item.to_pixels / 2.0**detail
    if rings is not None:
        if _is_soft(bundle, opening.radius):
            step_px = max(BRIDGE_PX, BRIDGE_FRINGES * rings.fringe_px)
        bundle = _with_shadow(item, rings, fine)
        watch.built(bundle, detail)
    watch.lap("rings")
    traced = [trace_bundle(shot.packed, w, bundle, tilt) for w in range(count)]
    watch.traced(bundle, count)
    pieces = [1] * (count - 1)
    if most is not None:
        limit = float("inf") if rings is None else opening.radius
        found = _bridges(traced, limit, item.view_radius, fine.scale / step_px, most)
        pieces = [max(n, item.least_steps) for n in found]
    steps = [(w, k / n) for w, n in enumerate(pieces) for k in range(n)] + [(count - 1, 0.0)]
    fine_nm = np.interp([w + part for w, part in steps], np.arange(count), shot.packed.wavelengths_nm)
    carried = None if spectrum is None else spectrum.carried
    watch.lap("between")
    patterns, flux = None, None
    if rings is not None:
        # imported only where there are rings
        from .ring_flux import ring_flux

        patterns = rings.textures(fine_nm, _seen(item, rings, bundle, traced, to_pixels, canvas, detail))
        middle = steps.index((count // 2, 0.0))
        flux = ring_flux(shot, patterns, sharp, bundle, middle, to_pixels, canvas.size(detail), carried)
        watch.lap("rings")
    for k, ((w, part), color) in enumerate(zip(steps, shot.weights(fine_nm, spectrum) * item.art.rgb, strict=True)):
        if stop is not None and stop.is_set():
            return
        if not color.any():
            continue
        data = traced[w]
        if part > 0.0:
            data = rays_between(data, traced[w + 1], part, *((1.0, 1.0) if carried is None else carried[w : w + 2]))
        whole, data = cut_failed_triangles(bundle, data)
        watch.lap("between")
        densities = node_densities(data, whole.pupil, whole.triangles)
        watch.lap("density")
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
            watch.drew(whole, data, shot.incidence.axes, place, canvas.size(detail))


def _seen_by(shot: Shot, item: FinalPass, *, nearby: bool) -> FinalPass:
    """Search the accepted pupil of an item at the wavelengths of another shot; `nearby`: first around the known one."""
    search = (shot.packed, item.path, shot.incidence.tilt, shot.opening.radius, item.view_radius)
    found = (region_at_ends(*search, item.region) if nearby else None) or find_region(*search)
    orders = item.orders
    if orders and shot.grating is not None and item.path.second_reflection is not None:
        orders = grating_orders(shot.packed, item.path.second_reflection, shot.grating)
    return replace(item, shot=shot, region=item.region if found is None else found, orders=orders)


def _places(item: FinalPass, to_pixels: Floats, w: int, part: float) -> list[tuple[Floats, float]]:
    """Return positions and parts of a ghost between two traced wavelengths: one, or one per grating order."""
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
    item: FinalPass, bundle: Bundle, spectrum: PathSpectrum | None, canvas: Canvas, detail: int, watch: Watch, *,
    careful: bool,
) -> bool:  # fmt: skip
    """Draw a ghost with invisible colour steps at its grid's wavelengths only; False if these cannot stand for all."""
    shot, path, opening = item.shot, item.path, item.shot.opening
    plane, to_pixels = canvas.plane(detail), item.to_pixels / 2.0**detail
    shown = tuple(sorted(bundle.traced))
    colors = shot.weights(shot.packed.wavelengths_nm, spectrum) * item.art.rgb
    # one half: with both, the sum of a Tessar's faint ghosts is 0.8 % off in blue instead of 0.3 %
    seen = visible_rays(shot, item.in_picture, bundle.halves)
    weights = gathered_weights(shot.packed, bundle, shot.incidence.tilt, colors, shown, seen, careful=careful)
    watch.lap("colour")
    if weights is None:
        return False
    for w, rgb in weights.items():
        whole, data = cut_failed_triangles(bundle, trace_bundle(shot.packed, w, bundle, shot.incidence.tilt))
        watch.lap("between")
        densities = node_densities(data, whole.pupil, whole.triangles)
        watch.lap("density")
        draw_bundle(
            data, whole.pupil, whole.triangles, densities,
            path.stop_crossings, opening.blades, opening.levels, shot.incidence.axes, to_pixels, shot.gain,
            np.ascontiguousarray(rgb), plane, whole.halves,
        )  # fmt: skip
        watch.drew(whole, data, shot.incidence.axes, to_pixels, canvas.size(detail))
    return True


def _is_soft(bundle: Bundle, iris_radius: float) -> bool:
    """Return whether the iris alone bounds a bundle: no edge of an element cuts it, and it does not fold."""
    return all(bounded_by_iris(data, bundle.triangles, iris_radius) for data in bundle.traced.values())


def _seen_rings(
    item: FinalPass, quality: Quality, bundle: Bundle, to_pixels: Floats, detail: int, around: Surroundings | None
) -> Rings | None:
    """Return a ghost's rings with patterns as fine as the picture shows; None where no ripple is visible."""
    shot = item.shot
    if shot.ringing is None:
        return None
    # imported only where there are rings
    from .ring_visibility import LEAST_RIPPLE, SCREEN_RIPPLE, blurs, ripples_seen

    pixel_px, pixels_per_mm = 2.0**detail, (float(to_pixels[2]), float(to_pixels[3]))
    nearness, blur_px = shot.packed.nearness / shot.incidence.tilt_cosine, blurs(item.source, pixel_px)
    rings = shot.ringing.of(shot.packed, item.path, shot.light, bundle, pixels_per_mm, nearness, blur_px)
    least = SCREEN_RIPPLE * coarser_detail(quality) if quality.screen else LEAST_RIPPLE
    return rings if rings is not None and ripples_seen(item, rings, bundle, around, pixel_px, least) else None


def _with_shadow(item: FinalPass, rings: Rings, fine: Refinement) -> Bundle:
    """Trace a new grid of a path that extends beyond the iris, up to the reach of its diffraction."""
    shot, opening, tilt = item.shot, item.shot.opening, item.shot.incidence.tilt
    more = rings.reach / opening.radius - 1.0
    if more < MOST_GROWN:
        region = widened_region(shot.packed, item.region, tilt, 0.75 * more)
    else:
        region = find_region(shot.packed, item.path, tilt, rings.reach, item.view_radius) or item.region
    shadow = rings.reach - opening.radius
    fringe_px, faint = max(fine.tolerance, FRINGE_PART * rings.fringe_px), opening.radius + FAINT_SHADOW * shadow
    return trace_grid(
        shot.packed, item.path, tilt, (rings.reach, max(0.0, opening.inner - shadow)), region,
        replace(fine, fringe_px=fringe_px, faint_radius=faint),
    )  # fmt: skip


def _seen(
    item: FinalPass, rings: Rings, bundle: Bundle, traced: list[Floats], to_pixels: Floats, canvas: Canvas, detail: int
) -> list[Box | None]:
    """Return the visible part of the stop at each crossing, or None where that saves no work."""
    if not rings.local:
        return [None] * item.path.stop_crossings
    # imported only for the few ghosts that need it
    from .visible_stop import seen_in_stop

    places = [place for w in range(len(traced)) for place, _ in _places(item, to_pixels, w, 0.0)]
    crossings, shown = item.path.stop_crossings, places if item.orders else places[:1]
    return seen_in_stop(item.shot, bundle, traced, crossings, shown, canvas.size(detail))


def draw_alone(
    items: Sequence[FinalPass],
    quality: Quality,
    canvas: Canvas,
    sheet: Sheet,
    stop: Event | None = None,
    around: Surroundings | None = None,
    level: float = 0.0,
    costs: CostMeter | None = None,
) -> None:
    """Draw ghosts on a separate plane, spread, ramp and blur it, and add it to a canvas.

    Parameters
    ----------
    items : sequence of FinalPass
        One ghost with a ramp, or any number without that share a blur and a spread (`FinalPass.alone`), since both are
        linear.
    quality : Quality
    canvas : Canvas
        Added to.
    sheet : Sheet
        Memory for the separate plane.
    stop : Event, optional
        Set to stop between two wavelengths.
    around : Surroundings, optional
        As in `draw_final`.
    level : float
        Mean irradiance of all ghosts in the picture, for `edge_contrast`; 0: draw these in full detail.
    costs : CostMeter, optional
        As in `draw_final`.
    """
    art, shot, frame, source = items[0].art, items[0].shot, items[0].frame, items[0].source
    detail = max(items[0].detail, coarseness(art, shot.to_pixels) if art.blur > 0.0 else 0)
    own = shot.to_pixels / 2.0**detail
    mx, my = art_margin = art.margin(own)
    kernel = None if source is None else shape_kernel(source, 0.5**detail)
    if kernel is not None:
        mx, my = mx + kernel.shape[1] // 2, my + kernel.shape[0] // 2
    width, height = canvas.size(detail)
    apart = sheet.canvas((width + 2 * mx, height + 2 * my))
    beside = None if around is None else around.moved((mx, my), detail)
    small = None if source is None else mapped(source, 0.5**detail * np.eye(2))
    for item in items:
        shifted = item.to_pixels / 2.0**detail + np.array([mx, my, 0.0, 0.0])
        own_item = replace(item, to_pixels=shifted, source=small, pictured=item.to_pixels)
        visible = edge_contrast(item, level)
        draw_final(own_item, quality, apart, visible, stop=stop, around=beside, detail=0, costs=costs)
    light, corner = sheet.lift(apart)
    if not art.alone:
        lit = [(light, corner)] if kernel is None else spread_bands(light, corner, apart.size_px, kernel)
        for band, place in lit:
            canvas.add(band, detail, place)
        return
    if kernel is not None:
        light, corner = spread_window(light, corner, apart.size_px, kernel)
    # filters take the picture with its margin
    pixels = placed(light, corner, (width + 2 * art_margin[0], height + 2 * art_margin[1]))
    canvas.add(filtered_ghost(pixels, art, frame, items[0].to_pixels / 2.0**detail, own), detail)


def _steps_shown(shot: Shot, spectrum: PathSpectrum | None, visibility: float) -> list[int]:
    """Return the number of steps in each gap between traced wavelengths beyond which single steps are invisible.

    A step has an equal part of the light in its gap. It is seen in the channel to which the gap gives the largest part
    of the ghost's light.
    """
    waves = shot.packed.wavelengths_nm
    if visibility == float("inf"):
        return [MOST_BRIDGES] * (len(waves) - 1)
    light = np.abs(shot.weights(waves, spectrum)) * (1.0 if spectrum is None else spectrum.carried[:, None])
    parts = light / np.maximum(light.sum(axis=0), np.finfo(float).tiny)
    gaps = 0.5 * (parts[1:] + parts[:-1]).max(axis=1)
    return [min(max(int(part), 1), MOST_BRIDGES) for part in gaps * (visibility / STEP_CONTRAST)]


def _bridges(
    traced: list[Floats], iris_radius: float, view_radius: float, steps_per_mm: float, most: list[int]
) -> list[int]:
    """Return the number of steps in each gap between traced wavelengths so that no colour step is visible."""
    # use a quantile: the nodes that move farthest carry hardly any light
    shifts = [
        shift_quantile(short, long, iris_radius, view_radius, SHIFT_QUANTILE) if limit > 1 else 0.0
        for (short, long), limit in zip(pairwise(traced), most, strict=True)
    ]
    return [min(max(ceil(shift * steps_per_mm), 1), limit) for shift, limit in zip(shifts, most, strict=True)]
