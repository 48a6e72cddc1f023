"""Dust, scratches and fingerprints in the plane of the stop: positions, transmittance and scattered light.

Lengths are in radii of the round opening, as in `optics.diffraction.fraunhofer`; only the statistics are in mm. Dust
particles are opaque discs, scratches are opaque bands along arcs, a fingerprint is rows of half-transparent droplets.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...model.project.starburst import Dirt
from ...typing import Floats, Indices, Mask

FIELD = 1.65
"""Radius of the dirt, in radii of the opening: beyond the corners of any iris."""

DARK_DEPTH = 25.0
"""Depth of dirt (`mean_depth`) that leaves no light: 1e-11 on average."""

# fingerprint: ridge spacing, mean radius of droplets and their spacing along ridges, half axes of the oval
_RIDGE_MM, _DROPLET_MM, _DROPLET_STEP_MM, _PRINT_MM = 0.5, 0.06, 0.15, (7.0, 9.0)
# half the bend angle of a scratch
_BEND_DEG = (0.5, 5.0)
# scratch widths are log-uniform: ratio of widest to narrowest, and of narrowest to mean
_WIDTHS = 8.0
_NARROWEST = math.log(_WIDTHS) / (_WIDTHS - 1.0)
# width classes of scratches whose fringes are computed together
_CLASSES = 6
RAGGED = 0.1
"""Rms deviation of each edge of a scratch from its line, in widths; it damps the fringes with their order."""

# correlation length of that deviation, in widths; largest number of steps along a scratch
_RAGGED_STEP, _MOST_KNOTS = 2.0, 100_000
# order of a scratch's fringes beyond which none remain
_LAST_ORDER = 6.0


@dataclass(frozen=True)
class Elements:
    """Dirt particles as discs and arcs.

    Attributes
    ----------
    discs : ndarray, shape (D, 4)
        x, y, radius, and the fraction of the light that the disc blocks.
    arcs : ndarray, shape (S, 6)
        x, y of the middle, direction of the normal there (rad), length, width, half the bend angle.
    """

    discs: Floats
    arcs: Floats


@dataclass(frozen=True)
class VeilTerm:
    """One term of the light scattered by dirt: radial(s) times angular(phi).

    Attributes
    ----------
    s, radial : ndarray, shape (S,)
        Ascending frequencies and the term's value there; a power law beyond the last.
    angular : ndarray, shape (A,)
        Histogram over half a turn, bins centred at 0, pi / A, ...; its mean is 1.
    """

    s: Floats
    radial: Floats
    angular: Floats


Veil = tuple[VeilTerm, ...]


def generate_dirt(dirt: Dirt, radius_mm: float, turn: float = 0.0) -> Elements:
    """Generate the dirt in the plane of the stop.

    Parameters
    ----------
    dirt : Dirt
    radius_mm : float
        Radius of the round opening.
    turn : float
        Rotates all dirt counter-clockwise, rad.

    Notes
    -----
    Every square millimetre (square centimetre for scratches) has a separate seed, so the dirt at a place does not
    depend on how far the iris is opened. Particle diameters and scratch widths are log-uniform: scratches of one width
    would add up to a comb of equal fringes.
    """
    reach = FIELD * radius_mm
    discs = [np.empty((0, 4))]
    if dirt.dust_per_mm2 > 0.0:
        low, high = math.log(dirt.dust_um[0]), math.log(dirt.dust_um[1])
        for rng, corner in _tiles(dirt.seed, 1, 1.0, reach):
            count = rng.poisson(dirt.dust_per_mm2)
            place = corner + rng.random((count, 2))
            radius = 0.5e-3 * np.exp(rng.uniform(low, high, count))
            discs.append(np.column_stack([place, radius, np.ones(count)]))
    if dirt.fingerprint > 0.0:
        discs.append(_fingerprint(dirt))
    arcs = [np.empty((0, 6))]
    if dirt.scratches_per_cm2 > 0.0:
        for rng, corner in _tiles(dirt.seed, 2, 10.0, reach + dirt.scratch_mm):
            count = rng.poisson(dirt.scratches_per_cm2)
            place = corner + 10.0 * rng.random((count, 2))
            length = dirt.scratch_mm * rng.uniform(0.5, 1.5, count)
            bend = np.radians(rng.uniform(*_BEND_DEG, count))
            angle = rng.uniform(0.0, 2.0 * np.pi, count)
            width = 1e-3 * dirt.scratch_um * _NARROWEST * _WIDTHS ** rng.random(count)
            arcs.append(np.column_stack([place, angle, length, width, bend]))
    found, bands = np.concatenate(discs), np.concatenate(arcs)
    found[:, :3] /= radius_mm
    bands[:, [0, 1, 3, 4]] /= radius_mm
    found = found[np.hypot(found[:, 0], found[:, 1]) - found[:, 2] < FIELD]
    bands = bands[np.hypot(bands[:, 0], bands[:, 1]) - bands[:, 3] / 2.0 < FIELD]
    c, s = math.cos(turn), math.sin(turn)
    for table in (found, bands):
        table[:, 0], table[:, 1] = c * table[:, 0] - s * table[:, 1], s * table[:, 0] + c * table[:, 1]
    bands[:, 2] += turn
    return Elements(found, bands)


def mean_depth(dirt: Dirt) -> float:
    """Return the mean area of dust and scratches per area of the stop: pieces at random pass exp(-depth) of the light.

    Notes
    -----
    The coverage of a plane by pieces at random places, a Boolean model (Chiu, Stoyan, Kendall, Mecke: Stochastic
    Geometry and its Applications, section 3.1). A log-uniform diameter from a to b has the mean square
    (b^2 - a^2) / (2 log(b / a)).
    """
    low, high = (1e-3 * diameter for diameter in dirt.dust_um)
    square = (high**2 - low**2) / (2.0 * math.log(high / low)) if high > low else low**2
    dust = dirt.dust_per_mm2 * math.pi / 4.0 * square
    return dust + 1e-2 * dirt.scratches_per_cm2 * dirt.scratch_mm * 1e-3 * dirt.scratch_um


def _tiles(seed: int, kind: int, side: float, reach: float) -> list[tuple[np.random.Generator, Floats]]:
    """Return the squares that cover a disc, each with a random generator and its lower left corner."""
    last = math.ceil(reach / side)
    return [
        (np.random.default_rng([seed, kind, i + 100_000, j + 100_000]), side * np.array([i, j], dtype=np.float64))
        for i in range(-last, last)
        for j in range(-last, last)
        if math.hypot(max(i, -i - 1, 0), max(j, -j - 1, 0)) * side < reach
    ]


def _fingerprint(dirt: Dirt) -> Floats:
    """Return droplets along arched ridges inside an oval of random position and rotation."""
    rng = np.random.default_rng([dirt.seed, 3])
    wide, high = _PRINT_MM
    rows = np.arange(-2.0 * high, high, _RIDGE_MM)
    along = np.arange(-wide, wide, _DROPLET_STEP_MM)
    x, base = (grid.ravel() for grid in np.meshgrid(along, rows))
    y = base + 0.06 * (wide**2 - x**2) * np.exp(-(((base + 0.5 * high) / high) ** 2))
    x = x + rng.normal(0.0, 0.3 * _DROPLET_STEP_MM, x.size)
    y = y + rng.normal(0.0, 0.08 * _RIDGE_MM, x.size)
    inside = ((x / wide) ** 2 + (y / high) ** 2 < 1.0) & (rng.random(x.size) < 0.85)
    x, y = x[inside], y[inside]
    turn, shift = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-2.0, 2.0, 2)
    c, s = math.cos(turn), math.sin(turn)
    radius = _DROPLET_MM * rng.uniform(0.7, 1.3, x.size)
    return np.column_stack(
        [c * x - s * y + shift[0], s * x + c * y + shift[1], radius, np.full(x.size, dirt.fingerprint)]
    )


def rasterise(elements: Elements, at: Floats) -> tuple[Floats, Floats]:
    """Draw dirt on a regular grid.

    Parameters
    ----------
    elements : Elements
    at : ndarray, shape (G,)
        Sample positions on both axes; rows rise with y.

    Returns
    -------
    amplitude, light : ndarray, shape (G, G)
        Factors of the wave's amplitude and of the light: 1 where clean. Borders are softened by a triangle two samples
        wide along their normal; a particle smaller than a sample keeps its area.
    """
    spacing = float(at[1] - at[0])
    amplitude, light = np.ones((len(at), len(at))), np.ones((len(at), len(at)))
    kept = 1.0 - elements.discs[:, 3]
    small = elements.discs[:, 2] < 0.5 * spacing
    _splat(elements.discs[small], at[0], spacing, amplitude, light)
    for (x, y, radius, _), part in zip(elements.discs[~small], kept[~small], strict=True):
        rows, columns, px, py = _window(at, x, y, radius + 2.0 * spacing)
        if not px.size or not py.size:
            continue
        cover = _softened((np.hypot(px - x, py[:, None] - y) - radius) / spacing)
        total = cover.sum()
        cover *= min(math.pi * (radius / spacing) ** 2 / total, 1.0 / cover.max()) if total > 0.0 else 0.0
        _cover(amplitude, light, rows, columns, cover, part)
    for arc in elements.arcs:
        _scratch(arc, at, amplitude, light)
    return amplitude, light


def _scratch(arc: Floats, at: Floats, amplitude: Floats, light: Floats) -> None:
    """Draw a scratch, in place."""
    x, y, normal, length, width, bend = arc.tolist()
    spacing = float(at[1] - at[0])
    # an arc of radius R = length / (2 bend) with its middle at (x, y)
    R = length / (2.0 * bend)
    centre = x - R * math.cos(normal), y - R * math.sin(normal)
    # a band narrower than a sample keeps its area
    drawn = max(0.5 * width, 0.5 * spacing)
    edges = _ragged_edges(length, width, bend)
    far = drawn + float(np.abs(edges[1:]).max(initial=0.0)) + spacing
    rows, columns, *_ = _window(at, x, y, 0.5 * length + width + 2.0 * spacing)
    row, column = _near_arc(at, rows, columns, (*centre, normal), R, far)
    qx, qy = at[column] - centre[0], at[row] - centre[1]
    off_arc = np.hypot(qx, qy) - R
    near = np.abs(off_arc) < far
    row, column, qx, qy, off_arc = row[near], column[near], qx[near], qy[near], off_arc[near]
    turn = np.arctan2(qy, qx) - normal
    off = np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
    ends = _softened((R * (off - bend)) / spacing)
    inner, outer = (np.interp(turn * R, edges[0], edge) for edge in edges[1:])
    across = np.abs(off_arc - 0.5 * (outer - inner))
    cover = _softened((across - drawn - 0.5 * (outer + inner)) / spacing) * ends * (0.5 * width / drawn)
    amplitude[row, column] *= 1.0 - cover
    light[row, column] *= 1.0 - cover


def _near_arc(
    at: Floats, rows: slice, columns: slice, circle: tuple[float, float, float], R: float, far: float
) -> tuple[Indices, Indices]:
    """Return rows and columns of the samples of a window that can lie within `far` of a short arc of a circle.

    `circle` is the centre, and the direction in which the arc's middle lies from there. Beside the arc are a few
    samples per line of the grid, so the cost rises with its length, not with its square.
    """
    x, y, normal = circle
    steep = abs(math.cos(normal)) >= abs(math.sin(normal))
    lines, beside = (rows, columns) if steep else (columns, rows)
    across, along = (x, y) if steep else (y, x)
    side = math.copysign(1.0, math.cos(normal) if steep else math.sin(normal))
    line, first = np.arange(lines.start, lines.stop), np.full(lines.stop - lines.start, beside.start)
    number = beside.stop - beside.start
    if far < 0.1 * R:
        # the ring between R - far and R + far, on the arc's side of the circle
        squares = (at[line] - along) ** 2
        ends = [across + side * np.sqrt(np.maximum((R + step) ** 2 - squares, 0.0)) for step in (-far, far)]
        low, high = np.minimum(*ends), np.maximum(*ends)
        # one sample more on each side, for rounding
        first = np.searchsorted(at, low) - 1
        number = int((np.searchsorted(at, high) + 1 - first).max(initial=0))
    there = first[:, None] + np.arange(number)
    inside = (there >= beside.start) & (there < beside.stop)
    found = np.broadcast_to(line[:, None], there.shape)[inside], there[inside]
    return found if steep else (found[1], found[0])


def _cover(amplitude: Floats, light: Floats, rows: slice, columns: slice, cover: Floats, part: float) -> None:
    amplitude[rows, columns] *= 1.0 - (1.0 - math.sqrt(part)) * cover
    light[rows, columns] *= 1.0 - (1.0 - part) * cover


def _ragged_edges(length: float, width: float, bend: float) -> Floats:
    """Return positions along a scratch and the random deviations of its two edges there, seeded by its bend; (3, K)."""
    knots = np.arange(-0.6 * length, 0.6 * length, max(_RAGGED_STEP * width, 1.2 * length / _MOST_KNOTS))
    # linear interpolation between knots keeps two thirds of the variance
    heights = np.random.default_rng(int(1e12 * bend)).normal(0.0, RAGGED * width * math.sqrt(1.5), (2, len(knots)))
    return np.stack([knots, *heights])


def _softened(distance: Floats) -> Floats:
    """Return the coverage by a half plane at a distance of its border in samples; triangle filter two samples wide."""
    ramp = np.clip(0.5 - 0.5 * distance, 0.0, 1.0)
    return np.where(ramp < 0.5, 2.0 * ramp**2, 1.0 - 2.0 * (1.0 - ramp) ** 2)


def _window(at: Floats, x: float, y: float, reach: float) -> tuple[slice, slice, Floats, Floats]:
    """Return the samples within a square: slices of rows and columns, their x and their y."""
    columns = slice(*np.searchsorted(at, [x - reach, x + reach]))
    rows = slice(*np.searchsorted(at, [y - reach, y + reach]))
    return rows, columns, at[columns], at[rows]


def _splat(discs: Floats, first: float, spacing: float, amplitude: Floats, light: Floats) -> None:
    """Distribute particles smaller than a sample over their four neighbours, preserving area."""
    size = len(amplitude)
    u, v = (discs[:, 0] - first) / spacing, (discs[:, 1] - first) / spacing
    area = math.pi * (discs[:, 2] / spacing) ** 2
    column, row = np.floor(u).astype(np.intp), np.floor(v).astype(np.intp)
    for i in range(2):
        for j in range(2):
            share = area * np.abs(1 - i - (v - row)) * np.abs(1 - j - (u - column))
            r, c = row + i, column + j
            ok = (r >= 0) & (r < size) & (c >= 0) & (c < size)
            taken = discs[ok, 3]
            np.multiply.at(amplitude, (r[ok], c[ok]), 1.0 - (1.0 - np.sqrt(1.0 - taken)) * share[ok])
            np.multiply.at(light, (r[ok], c[ok]), 1.0 - taken * share[ok])


def scattered(elements: Elements, inside: Mask, inside_arcs: Mask, power: float) -> Veil:
    """Compute the light that dirt scatters far from the image, as a sum over pieces.

    Parameters
    ----------
    elements : Elements
    inside, inside_arcs : ndarray of bool, shape (D,) and (S,)
        Whether each piece lies in the opening.
    power : float
        Integral of the pupil's transmittance: the pattern is per unit of it.

    Notes
    -----
    Babinet: far from the image of the opening, dirt scatters as openings of its shape would. A disc of radius a that
    blocks the amplitude d scatters d^2 (pi a^2)^2 (2 J1(x) / x)^2, x = 2 pi a s. A band of width w along an arc of
    radius R scatters d^2 w^2 sinc^2(w s) R / s along its normals (stationary phase). Its two edges deviate
    independently by the rms r w, so that sinc^2(o) becomes (1 - exp(-(2 pi r o)^2) cos(2 pi o)) / (2 pi^2 o^2), the
    mean of |e1 - e2|^2 of two edges' waves. Pieces lie at random, so their irradiances add. Each scatters as much light
    as it blocks: d^2 times its area (tested). Overlaps are ignored.
    """
    s = np.geomspace(1.0, 1e6, 1201)
    terms = []
    discs = elements.discs[inside]
    if len(discs):
        depth = 1.0 - np.sqrt(1.0 - discs[:, 3])
        edges = np.geomspace(discs[:, 2].min() * 0.999, discs[:, 2].max() * 1.001, 33)
        bins = np.clip(np.digitize(discs[:, 2], edges) - 1, 0, 31)
        strength = np.bincount(bins, depth**2 * (math.pi * discs[:, 2] ** 2) ** 2, 32)
        middle = np.sqrt(edges[1:] * edges[:-1])
        radial = _airy(2.0 * math.pi * np.outer(s, middle)) @ strength / power
        terms.append(VeilTerm(s, radial, np.ones(1)))
    arcs = elements.arcs[inside_arcs]
    if len(arcs):
        w = arcs[:, 4]
        lowest, step = math.log(w.min()), math.log(w.max() / w.min()) / _CLASSES
        place = np.clip((np.log(w) - lowest) / max(step, 1e-12), 0.0, _CLASSES - 1.0).astype(np.intp)
        terms += [_fans(arcs[place == k], s, power) for k in np.unique(place)]
    return tuple(terms)


def _fans(arcs: Floats, s: Floats, power: float) -> VeilTerm:
    """Return the scatter of scratches of similar width: fans along their normals, averaged over their widths."""
    directions = 720
    angular = np.zeros(directions)
    at = math.pi / directions * np.arange(directions, dtype=np.float64)
    for _, _, normal, length, _, bend in arcs:
        off = np.abs((at - normal + 0.5 * math.pi) % math.pi - 0.5 * math.pi)
        fan = np.clip((bend - off) / (math.pi / directions) + 0.5, 0.0, 1.0)
        angular += fan * length / (2.0 * bend)
    mean = float(angular.mean())
    widths = arcs[:, 4]
    # sample spacing for their fringes
    fine = np.geomspace(0.02 / widths.max(), _LAST_ORDER / widths.min(), 2400)
    s = np.concatenate([s[s < fine[0]], fine, s[s > fine[-1]]])
    share = arcs[:, 3] / arcs[:, 3].sum()
    slits = sum(part * w * w * _slit(w * s) for part, w in zip(share, widths, strict=True))
    return VeilTerm(s, mean * slits / s / power, angular / mean)


def _slit(order: Floats) -> Floats:
    """Return the scatter of a slit with ragged edges, relative to a straight slit at order 0."""
    phase = 2.0 * math.pi * np.maximum(order, 1e-3)
    return 2.0 * (1.0 - np.exp(-((RAGGED * phase) ** 2)) * np.cos(phase)) / phase**2


def _airy(x: Floats) -> Floats:
    """Return (2 J1(x) / x)^2, and its mean over the rings, 4 / (pi x^3), beyond the tenth."""
    grid = np.linspace(0.0, 32.0, 2049)
    tau = (np.arange(64) + 0.5) * math.pi / 64
    # Bessel's integral; the trapezoidal rule is exact to rounding for a periodic integrand
    J1 = np.cos(tau - np.outer(grid, np.sin(tau))).mean(axis=1)
    table = np.ones_like(grid)
    table[1:] = (2.0 * J1[1:] / grid[1:]) ** 2
    near: Floats = np.interp(x, grid, table)
    return np.where(x > 31.5, 4.0 / (math.pi * np.maximum(x, 1.0) ** 3), near)


def spread_area(elements: Elements, inside: Mask, inside_arcs: Mask) -> float:
    """Return the sum of d^2 times the area of pieces: the light that they would scatter without overlaps.

    Parameters
    ----------
    elements, inside, inside_arcs
        As in `scattered`.
    """
    discs, arcs = elements.discs[inside], elements.arcs[inside_arcs]
    depth = 1.0 - np.sqrt(1.0 - discs[:, 3])
    return float(math.pi * (depth**2 * discs[:, 2] ** 2).sum() + (arcs[:, 3] * arcs[:, 4]).sum())
