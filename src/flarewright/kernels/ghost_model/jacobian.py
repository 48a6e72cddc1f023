"""Derivatives of a measured ghost's picture by its parameters, through the mesh's places and the cells' densities.

A parameter changes the picture only through the positions of the edges between cells and the steps in density across
them. The derivatives are therefore drawn edge by edge, as the ghost is (`ghost_mesh`).
"""

import numpy as np

from ..jit.decorators import borrowing, compiled, inner
from .edge_coverage import add_edge_changes
from .gaussian_edges import add_spreading
from .ghost_mesh import (
    area_of,
    cell_areas,
    cell_light,
    draw_mesh,
    fill_densities,
    fill_mesh,
    join_cells,
    mesh_size,
    place_mesh,
    safe_divisor,
    soften_mesh,
)
from .lateral_colour import beyond, draw_rim_changes, draw_rims, shifts_of, wavelengths_of
from .pupil_mesh import (
    BELOW,
    FIRST_DISC,
    FIRST_G,
    FIRST_I,
    SOFT,
    TERMS,
    divisor_at,
    monomials,
    picture_step,
    place_point,
    pupil_change,
    slopes,
)


@inner
def _spot_changes(parameters, sigma, free, frame, pupil, pupil_by, spots_by):
    """Fill the derivatives of the mesh's places in the picture, (rings + 1, spokes, 2, Q), by the free parameters."""
    terms = np.empty(TERMS)
    w = sigma * sigma
    for i in range(pupil.shape[0]):
        for j in range(pupil.shape[1]):
            xi, eta = pupil[i, j, 0], pupil[i, j, 1]
            u, v = xi * xi + eta * eta, xi * sigma
            monomials(u, v, w, terms)
            x, y, a_xi, a_eta, c_xi, c_eta = place_point(parameters, xi, eta, sigma)
            value, follows = divisor_at(parameters, v, w)
            for q in range(free.size):
                n = free[q]
                if n >= BELOW:
                    # the monomials v and w follow those of the constant and u
                    part = follows * terms[n - BELOW + 2] / value
                    along, across = -x * part, -y * part
                elif n >= SOFT:
                    along, across = 0.0, 0.0
                elif n < FIRST_G:
                    along, across = sigma * terms[n] / value, 0.0
                elif n < FIRST_I:
                    along, across = xi * terms[n - FIRST_G] / value, eta * terms[n - FIRST_G] / value
                elif n < FIRST_DISC:
                    along, across = 0.0, 0.0
                else:
                    dxi, deta = pupil_change(n, sigma, pupil_by, i, j)
                    along, across = a_xi * dxi + a_eta * deta, c_xi * dxi + c_eta * deta
                spots_by[i, j, 0, q], spots_by[i, j, 1, q] = picture_step(frame, along, across)


@borrowing
def _add_triangle(
    parameters, sigma, free, pupil, pupil_by, spots, spots_by, ia, ja, ib, jb, ic, jc, terms, flux_by, area_by
):
    """Add the derivatives of a triangle's flux and of its signed area (`safe_divisor`) by the free parameters."""
    ax, ay = spots[ia, ja, 0], spots[ia, ja, 1]
    bx, by = spots[ib, jb, 0], spots[ib, jb, 1]
    cx, cy = spots[ic, jc, 0], spots[ic, jc, 1]
    raw = area_of(ax, ay, bx, by, cx, cy)
    if safe_divisor(raw) == raw:
        ax_by, ay_by = 0.5 * (by - cy), 0.5 * (cx - bx)
        bx_by, by_by = 0.5 * (cy - ay), 0.5 * (ax - cx)
        cx_by, cy_by = 0.5 * (ay - by), 0.5 * (bx - ax)
        for q in range(free.size):
            area_by[q] += ax_by * spots_by[ia, ja, 0, q] + ay_by * spots_by[ia, ja, 1, q]
            area_by[q] += bx_by * spots_by[ib, jb, 0, q] + by_by * spots_by[ib, jb, 1, q]
            area_by[q] += cx_by * spots_by[ic, jc, 0, q] + cy_by * spots_by[ic, jc, 1, q]
    pax, pay = pupil[ia, ja, 0], pupil[ia, ja, 1]
    pbx, pby = pupil[ib, jb, 0], pupil[ib, jb, 1]
    pcx, pcy = pupil[ic, jc, 0], pupil[ic, jc, 1]
    part = area_of(pax, pay, pbx, pby, pcx, pcy)
    xi, eta = (pax + pbx + pcx) / 3.0, (pay + pby + pcy) / 3.0
    u, v, w = xi * xi + eta * eta, xi * sigma, sigma * sigma
    intensity, i_u, i_v = slopes(parameters, FIRST_I, u, v, w)
    # negative intensity is drawn as 0
    if intensity <= 0.0:
        return
    i_xi, i_eta = 2.0 * xi * i_u + sigma * i_v, 2.0 * eta * i_u
    monomials(u, v, w, terms)
    for q in range(free.size):
        n = free[q]
        if n < FIRST_I or n >= SOFT:
            continue
        if n < FIRST_DISC:
            flux_by[q] += terms[n - FIRST_I] * part
            continue
        dax, day = pupil_change(n, sigma, pupil_by, ia, ja)
        dbx, dby = pupil_change(n, sigma, pupil_by, ib, jb)
        dcx, dcy = pupil_change(n, sigma, pupil_by, ic, jc)
        grown = 0.5 * (
            (dbx - dax) * (pcy - pay) + (pbx - pax) * (dcy - day) - (dcx - dax) * (pby - pay)
            - (pcx - pax) * (dby - day)
        )  # fmt: skip
        brighter = (i_xi * (dax + dbx + dcx) + i_eta * (day + dby + dcy)) / 3.0
        flux_by[q] += brighter * part + intensity * grown


@inner
def _density_changes(parameters, sigma, free, pupil, pupil_by, spots, spots_by, span, densities, changes):
    """Fill the derivatives of the drawn densities; on entry `densities` are those of triangles, not yet of cells."""
    rings, spokes = densities.shape[0], densities.shape[1]
    terms, flux_by, area_by = np.empty(TERMS), np.empty(free.size), np.empty(free.size)
    wide = max(span, 1)
    for i in range(rings):
        halves = 2 if i > 0 else 1
        for first in range(0, spokes, wide):
            light, area = cell_light(spots, wide, densities, i, first)
            # without cells each triangle is a separate cell
            for alone in range(halves if span == 0 else 1):
                flux_by[:] = 0.0
                area_by[:] = 0.0
                for j in range(first, first + wide):
                    k = j + 1 if j + 1 < spokes else 0
                    for half in range(halves):
                        if span > 0 or half == alone:
                            _add_triangle(
                                parameters, sigma, free, pupil, pupil_by, spots, spots_by, i, j, i + 1,
                                k if half else j, i if half else i + 1, k, terms, flux_by, area_by,
                            )  # fmt: skip
                density = light / area
                if span == 0:
                    density, area = densities[i, first, alone], cell_areas(spots, i, first, spokes)[alone]
                for j in range(first, first + wide):
                    for half in range(halves):
                        if span > 0 or half == alone:
                            for q in range(free.size):
                                changes[i, j, half, q] = -(flux_by[q] + density * area_by[q]) / area


@inner
def _draw_changes(spots, spots_by, densities, changes, span, rim, left, top, width, height, out):
    """Draw the derivatives of every edge once; `rim` includes the edges of the outline."""
    rings, spokes = densities.shape[0], densities.shape[1]
    count = changes.shape[3]
    step, sweep = np.empty(count), np.empty((2, count))
    for i in range(rings):
        for j in range(spokes):
            k = j + 1 if j + 1 < spokes else 0
            before = j - 1 if j > 0 else spokes - 1
            ax, ay = spots[i, j, 0], spots[i, j, 1]
            bx, by = spots[i + 1, j, 0], spots[i + 1, j, 1]
            cx, cy = spots[i + 1, k, 0], spots[i + 1, k, 1]
            half = 1 if i > 0 else 0
            # nothing changes inside a cell
            if span == 0 or j % span == 0:
                for q in range(count):
                    step[q] = changes[i, j, 0, q] - changes[i, before, half, q]
                add_edge_changes(
                    ax, ay, bx, by, densities[i, j, 0] - densities[i, before, half], step, spots_by[i, j],
                    spots_by[i + 1, j], left, top, width, height, sweep, out,
                )  # fmt: skip
            if rim or i + 1 < rings:
                outer = densities[i + 1, j, 1] if i + 1 < rings else 0.0
                for q in range(count):
                    step[q] = changes[i, j, 0, q] - (changes[i + 1, j, 1, q] if i + 1 < rings else 0.0)
                add_edge_changes(
                    bx, by, cx, cy, densities[i, j, 0] - outer, step, spots_by[i + 1, j], spots_by[i + 1, k], left, top,
                    width, height, sweep, out,
                )  # fmt: skip
            if i > 0 and span == 0:
                for q in range(count):
                    step[q] = changes[i, j, 1, q] - changes[i, j, 0, q]
                add_edge_changes(
                    ax, ay, cx, cy, densities[i, j, 1] - densities[i, j, 0], step, spots_by[i, j], spots_by[i + 1, k],
                    left, top, width, height, sweep, out,
                )  # fmt: skip


@inner
def draw_changes(parameters, disc_count, sigma, free, frame, left, top, plane, out):
    """Compute `draw_with_changes`, for calls from kernels."""
    height, width = plane.shape[0], plane.shape[1] - 1
    spokes, rings, span = mesh_size(parameters, disc_count, sigma, frame, True)
    if spokes == 0:
        return
    derive = free.size > 0
    pupil, spots = np.empty((rings + 1, spokes, 2)), np.empty((rings + 1, spokes, 2))
    pupil_by = np.empty((rings + 1, spokes, 2, 2 * disc_count + 2 if derive else 0))
    if not fill_mesh(parameters, disc_count, sigma, frame, spokes, rings, derive, pupil, pupil_by):
        return
    place_mesh(parameters, pupil, sigma, frame, spots)
    densities = np.empty((rings, spokes, 2))
    fill_densities(parameters, sigma, pupil, spots, densities)
    # convert the irradiance from per model pixel to per picture pixel
    scale = frame[4] * frame[4]
    spots_by, changes = np.empty((rings + 1, spokes, 2, free.size)), np.zeros((rings, spokes, 2, free.size))
    if derive:
        _spot_changes(parameters, sigma, free, frame, pupil, pupil_by, spots_by)
        _density_changes(parameters, sigma, free, pupil, pupil_by, spots, spots_by, span, densities, changes)
        changes *= scale
    if span > 0:
        join_cells(spots, span, densities)
    densities *= scale
    shifts = np.empty((spokes, 4))
    far = shifts_of(parameters, sigma, frame, pupil, shifts)
    band = wavelengths_of(far)
    draw_mesh(spots, densities, span, True, far == 0.0, left, top, width, height, plane)
    if far > 0.0:
        draw_rims(spots, shifts, band, densities, left, top, width, height, plane)
    variance = parameters[SOFT] * scale
    if variance > 0.0:
        soften_mesh(plane.reshape((height, width + 1, 1)), variance, spots, beyond(far), left, top)
    if not derive:
        return
    _draw_changes(spots, spots_by, densities, changes, span, far == 0.0, left, top, width, height, out)
    if far > 0.0:
        draw_rim_changes(
            parameters, sigma, free, frame, pupil, pupil_by, spots, spots_by, shifts, band, densities, changes, span,
            left, top, width, height, out,
        )  # fmt: skip
    if variance > 0.0:
        soften_mesh(out, variance, spots, beyond(far), left, top)
    for q in range(free.size):
        if free[q] == SOFT:
            add_spreading(plane, scale, out[:, :, q])


@compiled
def draw_with_changes(parameters, disc_count, sigma, free, frame, left, top, plane, out):
    """Draw one ghost of one channel and its derivatives inside a window.

    Parameters
    ----------
    parameters : ndarray, shape (N,), float64
    disc_count : int
    sigma : float
    free : ndarray, shape (Q,), int64
        Indices of the parameters to differentiate by; with none no derivatives are computed.
    frame : ndarray, shape (5,)
    left, top : int
        First pixel of the window.
    plane : ndarray, shape (h, w + 1), float64
        Zeros on entry; filled with the picture, as differences along rows.
    out : ndarray, shape (h, w + 1, Q), float64
        Zeros on entry; filled with the derivatives, as differences along rows.

    Notes
    -----
    These are the exact derivatives of the drawn picture, including its mesh. Finite differences in
    tests/kernels/ghost_model/test_ghost_mesh.py check them.
    """
    draw_changes(parameters, disc_count, sigma, free, frame, left, top, plane, out)
