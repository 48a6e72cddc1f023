"""Monte Carlo through the whole lens: at every surface a ray reflects or refracts, to any order of reflection.

This module does not use light paths. A ray that leaves a surface meets the neighbour in its direction of travel, until
a rim or the stop absorbs it, it lands on the sensor plane, or it leaves through the front.
"""

import numpy as np

from ..jit.decorators import compiled, inner
from ..raster.iris_mask import transmittance
from ..tracing.clip import blade_value
from ..tracing.general_ray import cross_shape
from ..tracing.intersect import intersect_conic
from ..tracing.lens_arrays import SHAPED, at_wavelength
from ..tracing.refract import bend
from .arguments import Ray, Scratch, scattering_at
from .philox import refill
from .radiance import radiance_from
from .scattered_rays import scatter_once

# tallies of light by where it ended; IN_PICTURE and BESIDE have four entries: 0, 2, 4 and more reflections
ENTERED, AT_STOP, AT_BARREL, RETURNED, LOST, IN_PICTURE, BESIDE = 0, 1, 2, 3, 4, 5, 9
TALLIES = 13

# a ray that has met this many surfaces without ending is stopped and counted as LOST
MOST_STEPS = 4096
# above this reflectance a ray after two or more reflections is not split: the refracted part would carry little light
SPLIT_BELOW = 0.5
# size of the stack of rays to trace
STACK = 512

# columns of the stack
_X, _Y, _Z, _DX, _DY, _DZ, _WEIGHT, _ROW, _HEADING, _ORDER, _ROWS = range(11)


@inner
def _passes_stop(blades, x, y):
    for b in range(blades.shape[0]):
        if blade_value(blades, b, x, y) > 0.0:
            return False
    return True


@inner
def _cross(lens, row, x, y, z, dx, dy, dz, heading, eta):
    """Trace a ray to a surface, and both refract and reflect it.

    Returns the hit, the refracted and the reflected direction, the squared distance from the surface's axis, the
    cosines before and behind the surface, and three flags: the ray hits, it refracts forward, it reflects backward.
    """
    vertex = lens.z_vertex[row]
    if len(lens) == SHAPED:
        hx, hy, hz, rx, ry, rz, radius2, cos_in, cos_out, back = cross_shape(
            lens.shapes, row, vertex, x, y, z, dx, dy, dz, heading, eta, 1.0
        )
        hx, hy, hz, tx, ty, tz, radius2, cos_in, cos_out, on = cross_shape(
            lens.shapes, row, vertex, x, y, z, dx, dy, dz, heading, eta, 0.0
        )
        return hx, hy, hz, tx, ty, tz, rx, ry, rz, radius2, cos_in, cos_out, on or back, on, back
    c, kappa = lens.curvature[row], lens.conic[row]
    zl = z - vertex
    t, root, discriminant = intersect_conic(c, kappa, x, y, zl, dx, dy, dz, heading)
    hx, hy, hz = x + t * dx, y + t * dy, zl + t * dz
    tx, ty, tz, cos_in, cos_out, _ = bend(c, kappa, hx, hy, hz, dx, dy, dz, root, heading, eta, 0.0)
    rx, ry, rz, _, _, _ = bend(c, kappa, hx, hy, hz, dx, dy, dz, root, heading, eta, 1.0)
    on, back = cos_out > 0.0 and tz * heading > 0.0, rz * heading < 0.0
    radius2 = hx * hx + hy * hy
    return hx, hy, hz + vertex, tx, ty, tz, rx, ry, rz, radius2, cos_in, cos_out, discriminant >= 0.0, on, back


@compiled
def trace_batch(lens, samples, points, chances, batch, light, stop, frame, sums, fours, scatter):
    """Trace a batch of points of the front at several wavelengths each, through all orders of reflection.

    Parameters
    ----------
    lens : ConicLens or ShapedLens
        At the S spectral samples, in the lens' frame.
    samples : SpectralSamples
    points : FrontPoints
    chances : Chances
    batch, light : int
        Select the stream of random numbers.
    stop : StopArrays
    frame : PictureFrame
    sums : LightSums
        Added to.
    fours : ndarray, shape (N, 2)
        Filled, up to its length, with the rays that landed in the picture after four reflections: the rows of the
        reflections as one number in base K, the first times K^3, and the luminous flux. Length 0 to record none.
    scatter : Scattering or None
        Added to; None for no scatter.

    Returns
    -------
    int
        Number of rays that landed in the picture after four reflections, recorded or not.

    Notes
    -----
    Each point stands for an equal part of the box. At the first two reflections the ray is split: both parts are
    followed, with weights R and 1 - R. Later reflections are followed at random, with weights that keep the mean.
    Chaumond 2007 chooses one part at random at every surface, which has the same mean and more noise.
    """
    direction, axes, box, side, first = points
    count, heroes = side * side, samples.heroes
    unit = (box[1] - box[0]) * (box[3] - box[2]) / (count * heroes)
    cell_x, cell_y = (box[1] - box[0]) / side, (box[3] - box[2]) / side
    stream, pool = np.empty(6, dtype=np.uint64), np.empty(4)
    scratch = Scratch(stream, pool, np.empty((STACK, 11)))
    start = np.empty(6)
    stream[4], stream[5] = chances.key[0], chances.key[1]
    noted = 0
    for point in range(count):
        stream[0], stream[1] = np.uint64(0), np.uint64(point)
        stream[2], stream[3] = np.uint64(batch), np.uint64(2 * light)
        refill(stream, pool)
        px = box[0] + (point % side + pool[0]) * cell_x
        py = box[2] + (point // side + pool[1]) * cell_y
        x, y = px * axes[0, 0] + py * axes[1, 0], px * axes[0, 1] + py * axes[1, 1]
        # the rays of a near light diverge, and their irradiance falls (`kernels.tracing.refract.ray_from_near`)
        dx, dy, dz = direction[0] + direction[3] * x, direction[1] + direction[3] * y, direction[2]
        inverse = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz) if direction[3] > 0.0 else 1.0
        start[0], start[1], start[2] = x, y, 0.0
        start[3], start[4], start[5] = inverse * dx, inverse * dy, inverse * dz
        amount = unit * inverse * inverse * inverse
        front = _cross(lens, first, x, y, 0.0, start[3], start[4], start[5], 1.0, 1.0)
        if not front[12] or front[9] * lens.inv_semi[first] * lens.inv_semi[first] > 1.0:
            continue
        chance = pool[2]
        for hero in range(heroes):
            s = sample_at(samples, (hero + chance) / heroes)
            stream[0], stream[1] = np.uint64(0), np.uint64(point * heroes + hero)
            stream[2], stream[3] = np.uint64(batch), np.uint64(2 * light + 1)
            sums.tallies[ENTERED] += amount * samples.luminances[s]
            ray = Ray(start, 1, amount, samples.luminances[s], samples.rgbs[s])
            noted = trace_tree(
                at_wavelength(lens, s), ray, chances.boosts, scratch, stop, frame, sums, fours, noted,
                scattering_at(scatter, s), None,
            )  # fmt: skip
    return noted


@inner
def sample_at(samples, place):
    """Return the spectral sample at a place of the cumulative probability."""
    s = 0
    while s < samples.cumulative.shape[0] - 1 and samples.cumulative[s] < place:
        s += 1
    return s


@inner
def trace_tree(lens, first, boosts, scratch, stop, frame, sums, fours, noted, scatter, lights):
    """Trace one ray and all rays that split off it; return the number of rays recorded in `fours` so far.

    If `lights` is None, light that reaches the sensor is added to the picture. Otherwise the ray was started at the
    sensor by `kernels.montecarlo.backward`, and `lights` are its pixel and the AreaLight that it may meet.
    """
    count, samples = lens.z_vertex.shape[0], lens.reflectance.shape[1]
    z_vertex, inv_semi, n_gap, reflectance = lens.z_vertex, lens.inv_semi, lens.n_gap, lens.reflectance
    start, forward, unit, rgb = first.start, first.forward, first.unit, first.rgb
    stream, pool, stack = scratch
    tallies = sums.tallies
    bright = unit * first.luminance
    drawn = 4
    x, y, z, dx, dy, dz = start[0], start[1], start[2], start[3], start[4], start[5]
    weight = 1.0
    # `mirrors` encodes the rows of the first four reflections in one number
    row, heading = np.int64(0 if forward > 0 else count - 1), np.int64(forward)
    order, mirrors = np.int64(0), np.int64(0)
    waiting = 0
    steps = 0
    # average number of rays that this ray may still split off
    budget = boosts[2]
    while True:
        ended = False
        if row < 0:
            if lights is None:
                tallies[RETURNED] += bright * weight
            else:
                radiance = radiance_from(lights[1], x, y, z, dx, dy, dz)
                if radiance > 0.0:
                    light = radiance * weight
                    _arrive(order, mirrors, bright * light, unit * light, rgb, lights[0], sums)
            ended = True
        elif row >= count and lights is not None:
            ended = True
        elif row >= count:
            t = (lens.sensor_z - z) / dz
            seen = _land(x + t * dx, y + t * dy, order, mirrors, bright * weight, unit * weight, rgb, frame, sums)
            if seen and order == 4:
                if noted < fours.shape[0]:
                    fours[noted, 0], fours[noted, 1] = mirrors, bright * weight
                noted += 1
            ended = True
        elif steps >= MOST_STEPS:
            tallies[LOST] += bright * weight
            ended = True
        elif row == stop.row:
            t = (z_vertex[row] - z) / dz
            x, y, z = x + t * dx, y + t * dy, z_vertex[row]
            passing = 1.0 if _passes_stop(stop.blades, x, y) else 0.0
            passing *= transmittance(stop.mask, stop.half, x, y)
            tallies[AT_STOP] += bright * weight * (1.0 - passing)
            weight *= passing
            ended = weight == 0.0
            row += heading
        else:
            steps += 1
            n_in = n_gap[row] if heading > 0 else n_gap[row + 1]
            n_out = n_gap[row + 1] if heading > 0 else n_gap[row]
            x, y, z, tx, ty, tz, rx, ry, rz, radius2, cos_in, cos_out, met, forth, back = _cross(
                lens, row, x, y, z, dx, dy, dz, np.float64(heading), n_in / n_out
            )
            if not met:
                tallies[LOST] += bright * weight
                ended = True
            elif radius2 * inv_semi[row] * inv_semi[row] > 1.0:
                tallies[AT_BARREL] += bright * weight
                ended = True
            else:
                R = 1.0
                # cos_out is 0 beyond the critical angle
                if cos_out > 0.0:
                    place = min(cos_in if n_in <= n_out else cos_out, 1.0) * (samples - 1)
                    cell = min(np.int64(place), samples - 2)
                    R = reflectance[row, cell] + (place - cell) * (reflectance[row, cell + 1] - reflectance[row, cell])
                # weights with which the reflected and the refracted ray are followed, 0 for not at all
                up, on = 0.0, 1.0 - R
                if R > 0.0:
                    # the first two reflections are always split: R and 1 - R
                    chance = 1.0 if order < 2 else min(1.0, boosts[0 if order < 4 else 1] * R)
                    alone = (order >= 2 and (R > SPLIT_BELOW or chance > budget)) or waiting == STACK
                    if order >= 2 and not alone:
                        budget -= chance
                    up = R
                    if alone or chance < 1.0:
                        if drawn == 4:
                            refill(stream, pool)
                            drawn = 0
                        u = pool[drawn]
                        drawn += 1
                        if alone:
                            up, on = (1.0, 0.0) if u < R else (0.0, 1.0)
                        else:
                            up = R / chance if u < chance else 0.0
                if up > 0.0 and not back:
                    tallies[LOST] += bright * weight * up
                    up = 0.0
                if on > 0.0 and not forth:
                    tallies[LOST] += bright * weight * on
                    on = 0.0
                if up > 0.0 and on > 0.0:
                    ray = stack[waiting]
                    ray[_X], ray[_Y], ray[_Z], ray[_DX], ray[_DY], ray[_DZ] = x, y, z, rx, ry, rz
                    ray[_WEIGHT], ray[_ROW], ray[_HEADING] = weight * up, row - heading, -heading
                    ray[_ORDER] = order + 1
                    ray[_ROWS] = mirrors * count + row if order < 4 else mirrors
                    waiting += 1
                if on > 0.0:
                    weight *= on
                    # a reflecting sensor is an additional row, and scatters nothing
                    if scatter is not None and order == 0 and row < scatter.tables.shape[0]:
                        weight *= 1.0 - scatter_once(
                            lens, row, (x, y, z), (tx, ty, tz), (rx - dx, ry - dy, rz - dz), scatter, scratch,
                            (bright * weight, unit * weight), rgb, stop, frame,
                        )  # fmt: skip
                        # `scatter_once` has refilled the pool
                        drawn = 4
                    dx, dy, dz = tx, ty, tz
                    row += heading
                elif up > 0.0:
                    weight *= up
                    dx, dy, dz = rx, ry, rz
                    mirrors = mirrors * count + row if order < 4 else mirrors
                    order += 1
                    heading = -heading
                    row += heading
                else:
                    ended = True
        if ended:
            if waiting == 0:
                return noted
            waiting -= 1
            ray = stack[waiting]
            x, y, z, dx, dy, dz = ray[_X], ray[_Y], ray[_Z], ray[_DX], ray[_DY], ray[_DZ]
            weight, row, heading = ray[_WEIGHT], np.int64(ray[_ROW]), np.int64(ray[_HEADING])
            order, mirrors = np.int64(ray[_ORDER]), np.int64(ray[_ROWS])
            steps = 0
            budget = boosts[2 if order < 4 else 3]


@inner
def _land(x, y, order, mirrors, bright, amount, rgb, frame, sums):
    """Add light on the sensor plane to the tallies and, in the picture, to its pixel; return whether it is inside."""
    to_pixels, size = frame
    planes, tallies, paths = sums
    column, line = to_pixels[0] - to_pixels[2] * x, to_pixels[1] + to_pixels[3] * y
    inside = 0.0 <= column < size[0] and 0.0 <= line < size[1]
    kind = min(order // 2, 3)
    tallies[(IN_PICTURE if inside else BESIDE) + kind] += bright
    if order == 2:
        count = paths.shape[1]
        paths[0 if inside else 1, mirrors // count, mirrors % count] += bright
    if inside and order > 0 and planes.shape[2] > 0:
        for channel in range(3):
            planes[min(kind, 2) - 1, channel, int(line), int(column)] += amount * rgb[channel]
    return inside


@inner
def _arrive(order, mirrors, bright, amount, rgb, pixel, sums):
    """Add the light at the end of a backward ray to the ray's pixel; light meets its reflections in reverse order."""
    planes, tallies, paths = sums
    kind = min(order // 2, 3)
    tallies[IN_PICTURE + kind] += bright
    if order == 2:
        count = paths.shape[1]
        paths[0, mirrors % count, mirrors // count] += bright
    if order > 0:
        for channel in range(3):
            planes[min(kind, 2) - 1, channel, np.int64(pixel[1]), np.int64(pixel[0])] += amount * rgb[channel]
