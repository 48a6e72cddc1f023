"""Single scattering: the angular distribution of light scattered at surfaces, and its irradiance on the sensor.

Directions are compared by v, the difference of their optical direction components (index times sine) along the surface.
The scattered share per area of v is the same on both sides of a surface, whatever the indices, as in the grating
equation.
"""

from __future__ import annotations

from math import exp, log, sqrt
from typing import NamedTuple

import numpy as np

from ...typing import Floats
from ..jit.decorators import compiled, inner
from ..raster.iris_mask import transmittance
from ..tracing.clip import blade_value
from ..tracing.general_ray import cross_shape
from ..tracing.intersect import intersect_conic
from ..tracing.lens_arrays import SHAPED
from ..tracing.refract import bend

# scatter tables are uniform in log(v^2 + CORE^2), from LOW to HIGH
CORE = 1e-5
LOW, HIGH = log(CORE * CORE), log(16.0)
# rows of a table: roughness scatter over the squared phase depth, and scatter that does not depend on the phase depth
ROUGH, FIXED = 0, 1
# columns of the amounts: (2 pi rms / wavelength)^2, and Chaumond's share
DEPTH, SHARE = 0, 1

# columns of a node of the direct beam on a surface: direction behind it, front area per area of the surface's plane
# times the transmittance so far, largest r / semi-diameter met, place in the stop
TX, TY, FLUX, REL, STOP_X, STOP_Y = 0, 1, 2, 3, 4, 5

# Newton steps to aim a ray from a sensor point at a place in the lens, and slope step of the derivatives
AIM_STEPS, SLOPE_STEP = 4, 1e-4
# size of the grid of target places over the size of the light's domain
MARGIN = 1.12

# a pixel smaller than this part of its distance from the direct image has the light at its centre (a fall with the
# third power changes by 0.4 % within it); nearer ones have the mean over cells smaller than the other part (0.2 %)
FAR_PART, NEAR_PART = 0.1, 0.4
# place of the two nodes of Gauss' rule in half a cell, and room for the cells of a pixel: three for each halving
GAUSS = 1.0 / sqrt(3.0)
MOST_CELLS = 64


@inner
def chaumond_phase(cosine):
    """Return Chaumond's phase function per solid angle, normalised to 1 over the sphere.

    Notes
    -----
    5/8 (1 + cos^2) + cos, as his page of 2007 gives it ("Mie Scattering"); its integral over the sphere is 10 pi / 3.
    """
    return (0.625 * (1.0 + cosine * cosine) + cosine) * 3.0 / (10.0 * np.pi)


@inner
def _look_up(table, place):
    last = table.shape[0] - 2
    cell = min(np.int64(place), last)
    return exp(table[cell] + (place - cell) * (table[cell + 1] - table[cell]))


@inner
def scattered_density(table, amount, n_in, n_out, cos_spec, cos_s, v2, cos_between):
    """Return the share of the refracted light that a surface scatters, per area of v.

    Parameters
    ----------
    table : ndarray, shape (2, M)
        Logarithms of ROUGH and FIXED (`optics.scattering.brdf.ScatterTables`).
    amount : ndarray, shape (2,)
        DEPTH and SHARE.
    n_in, n_out : float
    cos_spec : float
        Cosine of the refracted light, behind the surface.
    cos_s : float
        Cosine of the scattered light, behind the surface.
    v2 : float
        Square of v between the two directions.
    cos_between : float
        Cosine of the angle between the two directions.

    Notes
    -----
    Rough surfaces to first order: (2 pi / lambda)^2 D D' PSD(v / lambda) / lambda^2. The phase depths
    D = |n_out cos_out - n_in cos_in| of the refracted ray and D' of the scattered ray make the result reciprocal; for
    mirrors they are 2 cos and 2 cos', the obliquity of Rayleigh and Rice (E. L. Church and P. Z. Takacs, SPIE 645,
    1986). Along the refracted ray the total is that of Harvey and Shack: 1 - exp(-(2 pi D rms / lambda)^2), which
    bounds it where the roughness is not small (J. E. Harvey, Understanding Surface Scatter Phenomena, SPIE 2019).
    """
    place = (log(v2 + CORE * CORE) - LOW) / (HIGH - LOW) * (table.shape[1] - 1)
    density = _look_up(table[FIXED], place)
    if amount[DEPTH] > 0.0:
        ratio2 = n_out * n_out
        before = n_in * n_in - ratio2 * (1.0 - cos_spec * cos_spec)
        depth = abs(n_out * cos_spec - sqrt(max(before, 0.0)))
        before = n_in * n_in - ratio2 * (1.0 - cos_s * cos_s)
        other = abs(n_out * cos_s - sqrt(max(before, 0.0)))
        square = amount[DEPTH] * depth * depth
        bound = (1.0 - exp(-square)) / square if square > 1e-6 else 1.0
        density += bound * depth * other * _look_up(table[ROUGH], place)
    if amount[SHARE] > 0.0:
        density += amount[SHARE] * chaumond_phase(cos_between) / (n_out * n_out * max(cos_s, 1e-3))
    return density


@compiled
def scattered_total(table, amount, n_in, n_out, cos_spec, rings, spokes):
    """Integrate the scattered share over all directions behind a surface.

    Parameters
    ----------
    table, amount, n_in, n_out, cos_spec
        As in `scattered_density`.
    rings, spokes : int
        Steps of the sum over v, uniform in the logarithm of its length and in its direction.

    Returns
    -------
    float
    """
    ahead = n_out * sqrt(max(1.0 - cos_spec * cos_spec, 0.0))
    low, high = log(0.1 * CORE), log(n_out + ahead)
    step = (high - low) / rings
    total = 0.0
    for ring in range(rings):
        v = exp(low + (ring + 0.5) * step)
        for spoke in range(spokes):
            angle = 2.0 * np.pi * (spoke + 0.5) / spokes
            x, y = ahead + v * np.cos(angle), v * np.sin(angle)
            square = 1.0 - (x * x + y * y) / (n_out * n_out)
            if square > 0.0:
                cos_s = sqrt(square)
                between = ahead * x / (n_out * n_out) + cos_spec * cos_s
                total += v * v * scattered_density(table, amount, n_in, n_out, cos_spec, cos_s, v * v, between)
    return total * step * 2.0 * np.pi / spokes


@inner
def _covered(blades, ramp, x, y):
    """Return the open part of the iris around a place, with the edge softened over `ramp` mm."""
    high = -np.inf
    for b in range(blades.shape[0]):
        high = max(high, blade_value(blades, b, x, y))
    return min(max(0.5 - high / ramp, 0.0), 1.0)


@inner
def _opening(blades):
    """Return the radius of the inscribed circle of the opening."""
    low = np.inf
    for b in range(blades.shape[0]):
        low = min(low, blades[b, 2])
    return low


@inner
def _within(rel, side):
    """Return the part of a ray's cell that lies within a rim: a ramp over one cell of the grid of rays."""
    return min(max(0.5 + 0.5 * (1.0 - rel) * side, 0.0), 1.0)


@inner
def _beam_at(beam, box, x, y, node):
    """Interpolate the direct beam on a surface into `node`; return False outside the beam."""
    side = beam.shape[0]
    u, v = (x - box[0]) * box[2], (y - box[1]) * box[3]
    if not (0.0 <= u <= side - 1.0 and 0.0 <= v <= side - 1.0):
        return False
    a, b = min(np.int64(u), side - 2), min(np.int64(v), side - 2)
    s, t = u - a, v - b
    if beam[a, b, FLUX] * beam[a + 1, b, FLUX] * beam[a, b + 1, FLUX] * beam[a + 1, b + 1, FLUX] <= 0.0:
        return False
    for m in range(6):
        node[m] = (1.0 - s) * ((1.0 - t) * beam[a, b, m] + t * beam[a, b + 1, m]) + s * (
            (1.0 - t) * beam[a + 1, b, m] + t * beam[a + 1, b + 1, m]
        )
    return True


@inner
def _through(lens, row, x, y, z, dx, dy, dz, eta):
    """Trace a backward ray to a surface and refract it.

    Returns the hit, the new direction, the squared distance from the surface's axis, the cosines before and behind the
    surface, whether the ray hits the surface, and whether the ray continues.
    """
    vertex = lens.z_vertex[row]
    if len(lens) == SHAPED:
        hx, hy, hz, tx, ty, tz, radius2, cos_in, cos_out, on = cross_shape(
            lens.shapes, row, vertex, x, y, z, dx, dy, dz, -1.0, eta, 0.0
        )
        return hx, hy, hz, tx, ty, tz, radius2, cos_in, cos_out, on, on
    c, kappa = lens.curvature[row], lens.conic[row]
    zl = z - vertex
    t, root, discriminant = intersect_conic(c, kappa, x, y, zl, dx, dy, dz, -1.0)
    hx, hy, hz = x + t * dx, y + t * dy, zl + t * dz
    tx, ty, tz, cos_in, cos_out, _ = bend(c, kappa, hx, hy, hz, dx, dy, dz, root, -1.0, eta, 0.0)
    on = cos_out > 0.0 and tz < 0.0
    return hx, hy, hz + vertex, tx, ty, tz, hx * hx + hy * hy, cos_in, cos_out, discriminant >= 0.0, on


@inner
def _normal(lens, row, x, y, z, dx, dy, dz):
    """Return the unit normal of a surface at the hit of a backward ray, pointing against the ray."""
    vertex = lens.z_vertex[row]
    if len(lens) == SHAPED:
        # a reflection changes the direction along the normal
        _, _, _, rx, ry, rz, _, _, _, _ = cross_shape(lens.shapes, row, vertex, x, y, z, dx, dy, dz, -1.0, 1.0, 1.0)
        nx, ny, nz = rx - dx, ry - dy, rz - dz
    else:
        c = lens.curvature[row]
        nx, ny, nz = -c * x, -c * y, 1.0 - c * (1.0 + lens.conic[row]) * (z - vertex)
    scale = 1.0 / sqrt(nx * nx + ny * ny + nz * nz)
    return nx * scale, ny * scale, nz * scale


@inner
def _back_to(lens, rows, stop_row, px, py, wx, wy):
    """Trace a ray from the sensor to the target row; return x and y of the hit, and whether there is one."""
    target, z_vertex, n_gap = rows.target, lens.z_vertex, lens.n_gap
    scale = -1.0 / sqrt(1.0 + wx * wx + wy * wy)
    x, y, z, dx, dy, dz = px, py, lens.sensor_z, wx * scale, wy * scale, scale
    row = np.int64(rows.rear)
    while True:
        if row == stop_row:
            t = (z_vertex[row] - z) / dz
            x, y, z = x + t * dx, y + t * dy, z_vertex[row]
            if row == target:
                return x, y, True
        else:
            eta = n_gap[row + 1] / n_gap[row]
            x, y, z, dx, dy, dz, _, _, _, met, on = _through(lens, row, x, y, z, dx, dy, dz, eta)
            if row == target or not met:
                return x, y, met
            if not on:
                return x, y, False
        row -= 1


@inner
def _aim(lens, rows, stop_row, start, domain, px, py, found):
    """Aim the ray from a sensor point at the centre of a domain, by Newton's method.

    Fills `found` with slope x, slope y, and the derivatives of the slopes by the place in the domain: xx, xy, yx, yy.
    """
    found[0], found[1] = start[0] * px + start[1] * domain[0], start[0] * py + start[1] * domain[1]
    found[2], found[3], found[4], found[5] = start[1], 0.0, 0.0, start[1]
    for _ in range(AIM_STEPS):
        wx, wy = found[0], found[1]
        x, y, ok = _back_to(lens, rows, stop_row, px, py, wx, wy)
        if not ok:
            return
        step = SLOPE_STEP
        ax, ay, ok_a = _back_to(lens, rows, stop_row, px, py, wx + step, wy)
        bx, by, ok_b = _back_to(lens, rows, stop_row, px, py, wx, wy + step)
        xx, yx, xy, yy = (ax - x) / step, (ay - y) / step, (bx - x) / step, (by - y) / step
        det = xx * yy - xy * yx
        if not (ok_a and ok_b) or abs(det) < 1e-12:
            return
        found[2], found[3], found[4], found[5] = yy / det, -xy / det, -yx / det, xx / det
        ex, ey = domain[0] - x, domain[1] - y
        found[0] = wx + found[2] * ex + found[3] * ey
        found[1] = wy + found[4] * ex + found[5] * ey
        if ex * ex + ey * ey < 1e-6 * domain[2] * domain[3]:
            return


class ScatterRows(NamedTuple):
    """Rows of a lens in a sum over scattered light.

    Attributes
    ----------
    target : int
        Row at whose domain the rays aim.
    first, last : int
        First and last row that scatter.
    rear : int
        Last row of the lens; a reflecting sensor behind it is not met.
    """

    target: int
    first: int
    last: int
    rear: int


class DirectBeam(NamedTuple):
    """The direct light on each row and what it scatters there.

    Attributes
    ----------
    tables : ndarray, shape (K, 2, M)
    amounts : ndarray, shape (K, 2)
        Scatter of each row (`scattered_density`).
    nodes : ndarray, shape (K, S, S, 6)
        Columns TX, TY, FLUX, REL, STOP_X, STOP_Y.
    boxes : ndarray, shape (K, 4)
        x0, y0, nodes per mm in x and y.
    """

    tables: Floats
    amounts: Floats
    nodes: Floats
    boxes: Floats


class ScatterTarget(NamedTuple):
    """Where in the lens the rays from the sensor aim.

    Attributes
    ----------
    start : tuple of float
        Paraxial slope at the sensor per place on the sensor and per place in the domain.
    domain : ndarray, shape (4,)
        Centre x, y, half width and half height of the part of its row from which light may come, mm.
    side : int
        Rays from each point: side x side, spread evenly over the domain.
    """

    start: tuple[float, float]
    domain: Floats
    side: int


@compiled
def gather_scatter(lens, rows, beam, aimed, stop, axes, points, out):
    """Integrate the light that some surfaces scatter onto points of the sensor.

    Parameters
    ----------
    lens : ConicLens or ShapedLens
        At one wavelength.
    rows : ScatterRows
    beam : DirectBeam
    aimed : ScatterTarget
    stop : StopArrays
    axes : ndarray, shape (2, 2)
        Upright x, y of the frame's axes, for the iris.
    points : ndarray, shape (P, 2)
    out : ndarray, shape (P,)
        Added to: irradiance on the sensor per irradiance on the front.

    Notes
    -----
    Rays run backward from the sensor, so each point is a separate, deterministic integral. The scattered radiance
    behind a surface is E T rho(v) n^2, with E the irradiance of the direct beam there. Radiance over the squared index
    changes along a ray only by the factor T. The irradiance is its integral over slopes, dw / (1 + w^2)^2.
    """
    first, last = rows.first, rows.last
    z_vertex, inv_semi, n_gap, reflectance = lens.z_vertex, lens.inv_semi, lens.n_gap, lens.reflectance
    domain, side, (stop_row, blades, mask, half) = aimed.domain, aimed.side, stop
    samples = reflectance.shape[1]
    node, aim = np.empty(6), np.empty(6)
    # iris edges are softened over a cell of the grid of rays, both for the traced rays and for the direct beam
    ramp = 2.0 * MARGIN / side
    for p in range(points.shape[0]):
        px, py = points[p, 0], points[p, 1]
        _aim(lens, rows, stop_row, aimed.start, domain, px, py, aim)
        cell = 4.0 * MARGIN * MARGIN * domain[2] * domain[3] / (side * side)
        cell *= abs(aim[2] * aim[5] - aim[3] * aim[4])
        total = 0.0
        for ray in range(side * side):
            sx = (2.0 * (ray % side + 0.5) / side - 1.0) * MARGIN * domain[2]
            sy = (2.0 * (ray // side + 0.5) / side - 1.0) * MARGIN * domain[3]
            wx = aim[0] + aim[2] * sx + aim[3] * sy
            wy = aim[1] + aim[4] * sx + aim[5] * sy
            square = 1.0 + wx * wx + wy * wy
            scale = -1.0 / sqrt(square)
            x, y, z, dx, dy, dz = px, py, lens.sensor_z, wx * scale, wy * scale, scale
            weight = cell / (square * square)
            # use the least cover: a product would soften coinciding edges twice
            cover = 1.0
            row = np.int64(rows.rear)
            while row >= first and weight * cover > 0.0:
                if row == stop_row:
                    t = (z_vertex[row] - z) / dz
                    x, y, z = x + t * dx, y + t * dy, z_vertex[row]
                    u, v = x * axes[0, 0] + y * axes[1, 0], x * axes[0, 1] + y * axes[1, 1]
                    cover = min(cover, _covered(blades, ramp * min(domain[2], domain[3]), u, v))
                    weight *= transmittance(mask, half, u, v)
                    row -= 1
                    continue
                n_in, n_out = n_gap[row + 1], n_gap[row]
                hx, hy, hz, tx, ty, tz, radius2, cos_in, cos_out, met, on = _through(
                    lens, row, x, y, z, dx, dy, dz, n_in / n_out
                )
                if not met:
                    break
                cover = min(cover, _within(sqrt(radius2) * inv_semi[row], side))
                if cover <= 0.0:
                    break
                if row <= last and _beam_at(beam.nodes[row], beam.boxes[row], hx, hy, node):
                    nx, ny, nz = _normal(lens, row, hx, hy, hz, dx, dy, dz)
                    bx, by = node[TX], node[TY]
                    bz = sqrt(max(1.0 - bx * bx - by * by, 0.0))
                    cos_spec = bx * nx + by * ny + bz * nz
                    qx, qy, qz = -dx - bx, -dy - by, -dz - bz
                    along = qx * nx + qy * ny + qz * nz
                    v2 = n_in * n_in * max(qx * qx + qy * qy + qz * qz - along * along, 0.0)
                    lit = node[FLUX] * abs(nz)
                    beam_cover = min(cover, _within(node[REL], side))
                    if row > stop_row:
                        u = node[STOP_X] * axes[0, 0] + node[STOP_Y] * axes[1, 0]
                        v = node[STOP_X] * axes[0, 1] + node[STOP_Y] * axes[1, 1]
                        beam_cover = min(beam_cover, _covered(blades, ramp * _opening(blades), u, v))
                        lit *= transmittance(mask, half, u, v)
                    if lit * beam_cover > 0.0 and cos_spec > 0.0:
                        between = -(dx * bx + dy * by + dz * bz)
                        lit *= scattered_density(
                            beam.tables[row], beam.amounts[row], n_out, n_in, cos_spec, cos_in, v2, between
                        )
                        total += weight * beam_cover * lit
                if not on:
                    break
                place = min(cos_in if n_in <= n_out else cos_out, 1.0) * (samples - 1)
                k = min(np.int64(place), samples - 2)
                weight *= 1.0 - (reflectance[row, k] + (place - k) * (reflectance[row, k + 1] - reflectance[row, k]))
                x, y, z, dx, dy, dz = hx, hy, hz, tx, ty, tz
                row -= 1
        out[p] += total


@compiled
def spread_polar(centre, inside, radii, angles, level, colour, to_pixels, pixels):
    """Fill a picture from nodes on circles around the direct image, by cubic interpolation in radius and angle.

    Parameters
    ----------
    centre : ndarray, shape (2,)
        Centre of the circles in the upright picture, mm.
    inside : bool
        Whether the nodes cover the full circle.
    radii, angles : tuple of float
        Log of the first radius and nodes per unit of log radius; first angle and nodes per radian.
    level : ndarray, shape (A, B)
        Log of the light at radius A and angle B.
    colour : ndarray, shape (A, B, 3)
        Colour of the light.
    to_pixels : ndarray, shape (4,)
    pixels : ndarray, shape (H, W, 3), float32
        Filled with the means over pixels: beside the direct image light falls within a pixel by orders of magnitude.
    """
    weights, light, mean = np.empty((2, 4)), np.empty(3), np.empty(3)
    half_x, half_y = 0.5 / to_pixels[2], 0.5 / to_pixels[3]
    size = 2.0 * max(half_x, half_y)
    cells = np.empty((MOST_CELLS, 4))
    for row in range(pixels.shape[0]):
        y = (to_pixels[1] - row - 0.5) / to_pixels[3] - centre[1]
        for column in range(pixels.shape[1]):
            x = (column + 0.5 - to_pixels[0]) / to_pixels[2] - centre[0]
            if size * size <= FAR_PART * FAR_PART * (x * x + y * y):
                _light_at(x, y, inside, radii, angles, level, colour, weights, mean)
            else:
                _mean_over(x, y, half_x, half_y, inside, radii, angles, level, colour, weights, light, cells, mean)
            for m in range(3):
                pixels[row, column, m] = mean[m]


@inner
def _mean_over(x, y, half_x, half_y, inside, radii, angles, level, colour, weights, light, cells, mean):
    """Average the light over a pixel beside the direct image, by Gauss' rule in cells that shrink towards it."""
    for m in range(3):
        mean[m] = 0.0
    core = exp(radii[0])
    cells[0, 0], cells[0, 1], cells[0, 2], cells[0, 3] = x, y, half_x, half_y
    count = 1
    while count > 0:
        count -= 1
        cx, cy, ux, uy = cells[count, 0], cells[count, 1], cells[count, 2], cells[count, 3]
        size = 2.0 * max(ux, uy)
        if size > core and size * size > NEAR_PART * NEAR_PART * (cx * cx + cy * cy) and count + 4 <= MOST_CELLS:
            for m in range(4):
                cells[count, 0] = cx + (0.5 if m % 2 else -0.5) * ux
                cells[count, 1] = cy + (0.5 if m // 2 else -0.5) * uy
                cells[count, 2], cells[count, 3] = 0.5 * ux, 0.5 * uy
                count += 1
            continue
        share = 0.25 * (ux / half_x) * (uy / half_y)
        for m in range(4):
            px, py = cx + (GAUSS if m % 2 else -GAUSS) * ux, cy + (GAUSS if m // 2 else -GAUSS) * uy
            _light_at(px, py, inside, radii, angles, level, colour, weights, light)
            for n in range(3):
                mean[n] += share * light[n]


@inner
def _light_at(x, y, inside, radii, angles, level, colour, weights, light):
    """Fill the light at a place relative to the direct image, mm; arguments as of `spread_polar`."""
    rings, spokes = level.shape
    turn = 2.0 * np.pi
    u = (0.5 * log(max(x * x + y * y, 1e-12)) - radii[0]) * radii[1]
    angle = np.arctan2(y, x) - angles[0]
    angle -= turn * np.floor(angle / turn)
    v = angle * angles[1]
    u = min(max(u, 0.0), rings - 1.0)
    i = min(np.int64(u), rings - 2)
    if not inside:
        # an angle just before the first node must not wrap to a full turn
        v = 0.0 if angle > 0.5 * (turn + (spokes - 1) / angles[1]) else min(v, spokes - 1.0)
    j = np.int64(v) if inside else min(np.int64(v), spokes - 2)
    a, b = weights[0], weights[1]
    _cubic(u - i, a)
    _cubic(v - j, b)
    height, red, green, blue = 0.0, 0.0, 0.0, 0.0
    for m in range(4):
        r = min(max(i + m - 1, 0), rings - 1)
        for n in range(4):
            s = (j + n - 1 + spokes) % spokes if inside else min(max(j + n - 1, 0), spokes - 1)
            w = a[m] * b[n]
            height += w * level[r, s]
            red += w * colour[r, s, 0]
            green += w * colour[r, s, 1]
            blue += w * colour[r, s, 2]
    strength = exp(height)
    light[0], light[1], light[2] = strength * red, strength * green, strength * blue


@inner
def _cubic(t, weights):
    """Fill the weights of four equidistant nodes at t between the middle two (Catmull and Rom)."""
    weights[0] = 0.5 * t * (t * (2.0 - t) - 1.0)
    weights[1] = 0.5 * (t * t * (3.0 * t - 5.0) + 2.0)
    weights[2] = 0.5 * t * (t * (4.0 - 3.0 * t) + 1.0)
    weights[3] = 0.5 * t * t * (t - 1.0)
