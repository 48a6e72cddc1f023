"""Paraxial ghosts of many prescriptions: place, size and scale by prefix products, with exact derivatives.

Rays are (y, w) with the reduced angle w = n u. Then refraction, forward or backward, is w - phi y with
phi = (n' - n) c, a gap is y + t w with t = d / n, and a mirror is w + rho y with rho = 2 n c from the front and -2 n' c
from behind, where n and n' are the indices before and behind the row: the matrices of docs/physics.md with determinant
1. Ma is the matrix from the entrance to the stop, Ms that from the stop to the sensor. The mirrors of a ghost in front
of the stop change only Ma, those of a ghost behind it only Ms.

A prescription is one vector `q`: stop diameter, then thickness, curvature and index behind each row, 1 + 3 K numbers.
"""

import numpy as np

from ..jit.decorators import compiled, inner

# columns of a ghost's values
PLACE, RADIUS, SCALE, BOUND, REACH, REACH_THESIS = 0, 1, 2, 3, 4, 5
COLUMNS = 6

# rows of the working table
_POWER, _GAP, _FRONT, _BACK, _A, _B, _C, _D = 0, 1, 2, 3, 4, 5, 6, 7
WORK_ROWS = 8
# upper bound of the steps of a path per row
TRAIL = 8


@inner
def reduce_rows(q, rows, work):
    """Fill phi, t and the two rho of every row."""
    before = 1.0
    for k in range(rows):
        n, c = q[1 + 2 * rows + k], q[1 + rows + k]
        work[_POWER, k] = (n - before) * c
        work[_GAP, k] = q[1 + k] / n
        work[_FRONT, k] = 2.0 * before * c
        work[_BACK, k] = -2.0 * n * c
        before = n


@inner
def fill_suffix(first, last, work):
    """Fill the matrix from behind each row's vertex to the end of its half; return the matrix of the whole half."""
    a, b, c, d = 1.0, 0.0, 0.0, 1.0
    for k in range(last - 1, first - 1, -1):
        t, phi = work[_GAP, k], work[_POWER, k]
        b, d = b + t * a, d + t * c
        work[_A, k], work[_B, k], work[_C, k], work[_D, k] = a, b, c, d
        a, c = a - phi * b, c - phi * d
    return a, b, c, d


@inner
def note_ghost(a, b, c, d, e, f, stop_diameter, entrance, out, g):
    """Fill row g of `out` with a ghost's values, from Ma = [[a, b], [c, d]] and the upper row (e, f) of Ms.

    The edge with the smaller image, stop or entrance, bounds the ghost (Van Acoleyen 2025, section 5.5.1). The ghost is
    dark where the two discs do not overlap.
    """
    scale = e * a + f * c
    out[g, SCALE] = scale
    if stop_diameter <= entrance * abs(a):
        out[g, PLACE] = f / a
        out[g, RADIUS] = 0.5 * stop_diameter * scale / a
        out[g, BOUND] = 0.0
    else:
        out[g, PLACE] = e * b + f * d
        out[g, RADIUS] = 0.5 * entrance * scale
        out[g, BOUND] = 1.0
    span = entrance * abs(a)
    out[g, REACH] = 0.5 * (span + stop_diameter) / max(abs(b), 1e-300)
    out[g, REACH_THESIS] = 0.5 * max(span, stop_diameter) / max(abs(b), 1e-300)


@inner
def list_ghosts(q, rows, stop, mirrors, entrance, work, values):
    """Fill the ghosts of one prescription, those in front of the stop first, each half by (j, i); return the number."""
    reduce_rows(q, rows, work)
    ma, mb, mc, md = fill_suffix(0, stop, work)
    me, mf, _, _ = fill_suffix(stop, rows, work)
    count = 0
    for half in range(2):
        first, last = (0, stop) if half == 0 else (stop, rows)
        # matrix from the start of the half to before row j
        a, b, c, d = 1.0, 0.0, 0.0, 1.0
        for j in range(first, last):
            if mirrors[j]:
                rho = work[_FRONT, j]
                y0, y1, w0, w1 = a, b, c + rho * a, d + rho * b
                for i in range(j - 1, first - 1, -1):
                    t, phi, rho = work[_GAP, i], work[_POWER, i], work[_BACK, i]
                    y0, y1 = y0 + t * w0, y1 + t * w1
                    if mirrors[i]:
                        v0, v1 = w0 + rho * y0, w1 + rho * y1
                        ha, hb, hc, hd = work[_A, i], work[_B, i], work[_C, i], work[_D, i]
                        p0, p1 = ha * y0 + hb * v0, ha * y1 + hb * v1
                        if half == 0:
                            r0, r1 = hc * y0 + hd * v0, hc * y1 + hd * v1
                            note_ghost(p0, p1, r0, r1, me, mf, q[0], entrance, values, count)
                        else:
                            note_ghost(ma, mb, mc, md, p0, p1, q[0], entrance, values, count)
                        count += 1
                    w0, w1 = w0 - phi * y0, w1 - phi * y1
            t, phi = work[_GAP, j], work[_POWER, j]
            c, d = c - phi * a, d - phi * b
            a, b = a + t * c, b + t * d
    return count


@compiled
def ghosts_of_many(many, stop, mirrors, entrance, values):
    """Compute the ghosts of many prescriptions of one structure.

    Parameters
    ----------
    many : ndarray, shape (B, 1 + 3 K), float64
        Stop diameter, thicknesses, curvatures, indices behind the rows.
    stop : int
        Row of the stop; it stands in air, with curvature 0.
    mirrors : ndarray, shape (K,), bool
        Which rows reflect.
    entrance : float
        Diameter of the entrance at the first vertex, mm.
    values : ndarray, shape (B, G, COLUMNS), float64
        Filled: PLACE of the centre, mm per unit slope of the light; RADIUS, signed by the magnification, mm; SCALE, mm
        on the sensor per mm at the entrance; BOUND, 0 by the stop, 1 by the entrance; REACH, the slope beyond which the
        two discs do not overlap; REACH_THESIS, the same by the thesis' program.
    """
    rows = (many.shape[1] - 1) // 3
    work = np.empty((WORK_ROWS, rows))
    for b in range(many.shape[0]):
        list_ghosts(many[b], rows, stop, mirrors, entrance, work, values[b])


@inner
def add_gradient(first, last, j, i, x0, x1, g0, g1, work, trail, slopes):
    """Add the derivatives of (g0, g1) M (x0, x1) by phi, t and rho, where M is the matrix of one half.

    Parameters
    ----------
    first, last : int
        First row of the half, and one past the last.
    j, i : int
        Mirrors in this half; j = -1: none.
    x0, x1, g0, g1 : float
        Ray at the start; weights at the end.
    work : ndarray, shape (WORK_ROWS, K)
    trail : ndarray, shape (TRAIL * K,)
        Scratch.
    slopes : ndarray, shape (4, K)
        Added to: derivatives by phi, t, rho from the front, rho from behind.
    """
    y, w, m = x0, x1, 0
    for k in range(first, j if j >= 0 else last):
        trail[m] = y
        w -= work[_POWER, k] * y
        m += 1
        trail[m] = w
        y += work[_GAP, k] * w
        m += 1
    if j >= 0:
        trail[m] = y
        w += work[_FRONT, j] * y
        m += 1
        for k in range(j - 1, i - 1, -1):
            trail[m] = w
            y += work[_GAP, k] * w
            m += 1
            trail[m] = y
            w += work[_BACK, k] * y if k == i else -work[_POWER, k] * y
            m += 1
        for k in range(i, last):
            if k > i:
                trail[m] = y
                w -= work[_POWER, k] * y
                m += 1
            trail[m] = w
            y += work[_GAP, k] * w
            m += 1
    # propagate the weights back along the same path
    if j >= 0:
        for k in range(last - 1, i - 1, -1):
            m -= 1
            slopes[1, k] += g0 * trail[m]
            g1 += work[_GAP, k] * g0
            if k > i:
                m -= 1
                slopes[0, k] -= g1 * trail[m]
                g0 -= work[_POWER, k] * g1
        for k in range(i, j):
            m -= 1
            if k == i:
                slopes[3, k] += g1 * trail[m]
                g0 += work[_BACK, k] * g1
            else:
                slopes[0, k] -= g1 * trail[m]
                g0 -= work[_POWER, k] * g1
            m -= 1
            slopes[1, k] += g0 * trail[m]
            g1 += work[_GAP, k] * g0
        m -= 1
        slopes[2, j] += g1 * trail[m]
        g0 += work[_FRONT, j] * g1
    for k in range((j if j >= 0 else last) - 1, first - 1, -1):
        m -= 1
        slopes[1, k] += g0 * trail[m]
        g1 += work[_GAP, k] * g0
        m -= 1
        slopes[0, k] -= g1 * trail[m]
        g0 -= work[_POWER, k] * g1


@inner
def add_by_prescription(q, rows, first, last, slopes, factor, row):
    """Convert derivatives by phi, t and rho of one half to those by d, c and n, add them to `row`, clear `slopes`."""
    for k in range(first, last):
        n, c = q[1 + 2 * rows + k], q[1 + rows + k]
        before = 1.0 if k == 0 else q[2 * rows + k]
        sp, sg, sf, sb = slopes[0, k], slopes[1, k], slopes[2, k], slopes[3, k]
        row[1 + k] += factor * sg / n
        row[1 + rows + k] += factor * ((n - before) * sp + 2.0 * before * sf - 2.0 * n * sb)
        row[1 + 2 * rows + k] += factor * (c * sp - sg * q[1 + k] / (n * n) - 2.0 * c * sb)
        if k > 0:
            row[2 * rows + k] += factor * c * (2.0 * sf - sp)
        for m in range(4):
            slopes[m, k] = 0.0


@inner
def differentiate_ghosts(q, rows, stop, mirrors, entrance, with_scale, work, trail, slopes, common, values, jacobian):
    """Fill the ghosts of one prescription and their derivatives.

    Parameters
    ----------
    q : ndarray, shape (1 + 3 K,)
    rows, stop : int
    mirrors : ndarray, shape (K,), bool
    entrance : float
    with_scale : bool
        Whether to fill the third block of `jacobian`.
    work : ndarray, shape (WORK_ROWS, K)
    trail : ndarray, shape (TRAIL * K,)
        Scratch.
    slopes : ndarray, shape (4, K)
        All 0.
    common : ndarray, shape (6, 1 + 3 K)
        Scratch.
    values : ndarray, shape (G, COLUMNS)
    jacobian : ndarray, shape (3, G, 1 + 3 K)
        Filled: derivatives of PLACE, RADIUS and SCALE by q.

    Returns
    -------
    int
        Number of ghosts.
    """
    count = list_ghosts(q, rows, stop, mirrors, entrance, work, values)
    size = 1 + 3 * rows
    # derivatives that the ghosts of one half share: of the direct Ma (four items) and of the upper row of Ms (two)
    e, f, _, _ = fill_suffix(stop, rows, work)
    a, b, c, d = fill_suffix(0, stop, work)
    for m in range(6):
        for v in range(size):
            common[m, v] = 0.0
    for m in range(4):
        x0, x1 = (1.0, 0.0) if m % 2 == 0 else (0.0, 1.0)
        g0, g1 = (1.0, 0.0) if m < 2 else (0.0, 1.0)
        add_gradient(0, stop, -1, -1, x0, x1, g0, g1, work, trail, slopes)
        add_by_prescription(q, rows, 0, stop, slopes, 1.0, common[m])
    for m in range(2):
        x0, x1 = (1.0, 0.0) if m == 0 else (0.0, 1.0)
        add_gradient(stop, rows, -1, -1, x0, x1, 1.0, 0.0, work, trail, slopes)
        add_by_prescription(q, rows, stop, rows, slopes, 1.0, common[4 + m])
    ghost = 0
    for half in range(2):
        first, last = (0, stop) if half == 0 else (stop, rows)
        for j in range(first, last):
            if not mirrors[j]:
                continue
            for i in range(j - 1, first - 1, -1):
                if not mirrors[i]:
                    continue
                if half == 0:
                    _front_ghost(q, rows, stop, j, i, e, f, entrance, with_scale, work, trail, slopes, common, values,
                                 jacobian, ghost)  # fmt: skip
                else:
                    _rear_ghost(q, rows, stop, j, i, a, b, c, d, entrance, with_scale, work, trail, slopes, common,
                                values, jacobian, ghost)  # fmt: skip
                ghost += 1
    return count


@inner
def own_column(first, last, j, i, x0, x1, work):
    """Trace a paraxial ray through one half with its two mirrors; return height and reduced angle at the end."""
    y, w = x0, x1
    for k in range(first, j):
        w -= work[_POWER, k] * y
        y += work[_GAP, k] * w
    w += work[_FRONT, j] * y
    for k in range(j - 1, i, -1):
        y += work[_GAP, k] * w
        w -= work[_POWER, k] * y
    y += work[_GAP, i] * w
    w += work[_BACK, i] * y
    y += work[_GAP, i] * w
    for k in range(i + 1, last):
        w -= work[_POWER, k] * y
        y += work[_GAP, k] * w
    return y, w


@inner
def _front_ghost(q, rows, stop, j, i, e, f, entrance, with_scale, work, trail, slopes, common, values, jacobian, ghost):
    """Differentiate a ghost in front of the stop: Ma has its mirrors, (e, f) is the upper row of the direct Ms."""
    a, c = own_column(0, stop, j, i, 1.0, 0.0, work)
    b, d = own_column(0, stop, j, i, 0.0, 1.0, work)
    half_stop, half_entrance = 0.5 * q[0], 0.5 * entrance
    for m in range(3 if with_scale else 2):
        row = jacobian[m, ghost]
        by_stop = values[ghost, BOUND] == 0.0
        x0, x1 = 1.0, 0.0
        if m == 2:
            g0, g1, de, df, dh = e, f, a, c, 0.0
        elif m == 0 and by_stop:
            g0, g1, de, df, dh = -f / (a * a), 0.0, 0.0, 1.0 / a, 0.0
        elif m == 0:
            x0, x1 = 0.0, 1.0
            g0, g1, de, df, dh = e, f, b, d, 0.0
        elif by_stop:
            g0, g1 = -half_stop * f * c / (a * a), half_stop * f / a
            de, df, dh = half_stop, half_stop * c / a, 0.5 * (e + f * c / a)
        else:
            g0, g1 = half_entrance * e, half_entrance * f
            de, df, dh = half_entrance * a, half_entrance * c, 0.0
        for v in range(row.size):
            row[v] = de * common[4, v] + df * common[5, v]
        row[0] += dh
        add_gradient(0, stop, j, i, x0, x1, g0, g1, work, trail, slopes)
        add_by_prescription(q, rows, 0, stop, slopes, 1.0, row)


@inner
def _rear_ghost(
    q, rows, stop, j, i, a, b, c, d, entrance, with_scale, work, trail, slopes, common, values, jacobian, ghost
):
    """Differentiate a ghost behind the stop: Ms has its mirrors, Ma = [[a, b], [c, d]] is the direct one."""
    e, _ = own_column(stop, rows, j, i, 1.0, 0.0, work)
    f, _ = own_column(stop, rows, j, i, 0.0, 1.0, work)
    half_stop, half_entrance = 0.5 * q[0], 0.5 * entrance
    for m in range(3 if with_scale else 2):
        row = jacobian[m, ghost]
        by_stop = values[ghost, BOUND] == 0.0
        # derivatives by a, b, c, d and by the stop's diameter
        da, db, dc, dd, dh = 0.0, 0.0, 0.0, 0.0, 0.0
        if m == 2:
            x0, x1, da, dc = a, c, e, f
        elif m == 0 and by_stop:
            x0, x1, da = 0.0, 1.0 / a, -f / (a * a)
        elif m == 0:
            x0, x1, db, dd = b, d, e, f
        elif by_stop:
            x0, x1 = half_stop, half_stop * c / a
            da, dc, dh = -half_stop * f * c / (a * a), half_stop * f / a, 0.5 * (e + f * c / a)
        else:
            x0, x1 = half_entrance * a, half_entrance * c
            da, dc = half_entrance * e, half_entrance * f
        for v in range(row.size):
            row[v] = da * common[0, v] + db * common[1, v] + dc * common[2, v] + dd * common[3, v]
        row[0] += dh
        add_gradient(stop, rows, j, i, x0, x1, 1.0, 0.0, work, trail, slopes)
        add_by_prescription(q, rows, stop, rows, slopes, 1.0, row)


@inner
def light_values(q, rows, stop, mirrors, values, light):
    """Fill each ghost's log irradiance, log(R_j R_i prod T / SCALE^2), for uncoated surfaces at normal incidence.

    docs/physics.md, "Radiometry": A_in / A_out = 1 / SCALE^2. R = ((n - n') / (n + n'))^2.
    """
    through = 0.0
    for k in range(rows):
        before = 1.0 if k == 0 else q[2 * rows + k]
        r = (q[1 + 2 * rows + k] - before) / (q[1 + 2 * rows + k] + before)
        through += np.log(1.0 - r * r)
    ghost = 0
    for half in range(2):
        first, last = (0, stop) if half == 0 else (stop, rows)
        for j in range(first, last):
            if not mirrors[j]:
                continue
            between = 0.0
            for i in range(j - 1, first - 1, -1):
                before = 1.0 if i == 0 else q[2 * rows + i]
                ri = (q[1 + 2 * rows + i] - before) / (q[1 + 2 * rows + i] + before)
                if mirrors[i]:
                    before = 1.0 if j == 0 else q[2 * rows + j]
                    rj = (q[1 + 2 * rows + j] - before) / (q[1 + 2 * rows + j] + before)
                    light[ghost] = (
                        through + 2.0 * between + np.log(max(ri * ri * rj * rj, 1e-300))
                        - 2.0 * np.log(max(abs(values[ghost, SCALE]), 1e-300))
                    )  # fmt: skip
                    ghost += 1
                between += np.log(1.0 - ri * ri)


@inner
def brightness_of_ghosts(q, rows, stop, mirrors, values, jacobian, light, by):
    """Fill the logarithm of each ghost's irradiance (`light_values`) and its derivatives.

    Parameters
    ----------
    q, rows, stop, mirrors
        As in `differentiate_ghosts`.
    values, jacobian
        From `differentiate_ghosts`.
    light : ndarray, shape (G,)
        Filled.
    by : ndarray, shape (G, 1 + 3 K)
        Filled.
    """
    light_values(q, rows, stop, mirrors, values, light)
    ghost = 0
    for half in range(2):
        first, last = (0, stop) if half == 0 else (stop, rows)
        for j in range(first, last):
            if not mirrors[j]:
                continue
            for i in range(j - 1, first - 1, -1):
                if not mirrors[i]:
                    continue
                scale = values[ghost, SCALE]
                for v in range(q.size):
                    by[ghost, v] = -2.0 * jacobian[2, ghost, v] / scale
                for k in range(rows):
                    if k == stop:
                        continue
                    before = 1.0 if k == 0 else q[2 * rows + k]
                    n = q[1 + 2 * rows + k]
                    r = (n - before) / (n + before)
                    R = r * r
                    # derivatives of r by n and by the index before
                    rn, rb = 2.0 * before / (n + before) ** 2, -2.0 * n / (n + before) ** 2
                    weight = 0.0
                    if k in (j, i):
                        weight = 2.0 / r if r != 0.0 else 0.0
                    # light crosses surfaces between the mirrors three times, and the mirrors once
                    times = 3.0 if i < k < j else 1.0
                    weight -= times * 2.0 * r / (1.0 - R)
                    by[ghost, 1 + 2 * rows + k] += weight * rn
                    if k > 0:
                        by[ghost, 2 * rows + k] += weight * rb
                ghost += 1


@compiled
def ghosts_with_derivatives(q, stop, mirrors, entrance, values, jacobian, light, light_by):
    """Compute the ghosts of one prescription and their irradiance with uncoated surfaces, with all derivatives.

    Parameters
    ----------
    q, stop, mirrors, entrance
        As in `ghosts_of_many`, for one prescription.
    values : ndarray, shape (G, COLUMNS)
    jacobian : ndarray, shape (3, G, 1 + 3 K)
        Filled: derivatives of PLACE, RADIUS and SCALE.
    light : ndarray, shape (G,)
        Filled: log irradiance relative to the light.
    light_by : ndarray, shape (G, 1 + 3 K)
        Filled: its derivatives.
    """
    rows = (q.size - 1) // 3
    work, trail, slopes = np.empty((WORK_ROWS, rows)), np.empty(TRAIL * rows), np.zeros((4, rows))
    common = np.empty((6, q.size))
    # always True, but not a compile-time constant, so that the version of the search is reused
    with_scale = light.size >= 0
    differentiate_ghosts(q, rows, stop, mirrors, entrance, with_scale, work, trail, slopes, common, values, jacobian)
    brightness_of_ghosts(q, rows, stop, mirrors, values, jacobian, light, light_by)
