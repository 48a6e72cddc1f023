"""Intersection of a ray with a surface: the single implementation for all kinds of surfaces.

Conics of revolution are solved in closed form; all others (aspheres, cylinders, toroids, figure errors) by Newton's
method on their sag.
"""

from math import sqrt

from ..jit.decorators import compiled, inlined, inner

# columns of a shape table, one table row for each row of the lens (`optics.lens.surface_shape.shape_table`)
KIND = 0  # CENTRED, CONIC or SAG
ORIGIN = 1  # vertex in the lens' frame, mm, relative to the row's vertex on the axis
AXES = 4  # the surface's x, y and z axis in the lens' frame, one after another
CURVATURE_X, CONIC_X, CURVATURE_Y, CONIC_Y = 13, 14, 15, 16
ASPHERE = 17  # A4, A6, ...
TERMS = 9
TANGENT = 26  # r^2 from which the asphere continues as its tangent
SCALE = 27  # 1 / normalisation radius of the figure's polynomial
DEGREE = 28  # degree of that polynomial; -1: none
POLYNOMIAL = 29  # coefficient of x^i y^j at 7 i + j
SIDE = 78  # knots per side of the height image; 0: none
HALF = 79  # the image spans [-HALF, HALF], mm
ODD_COUNT = 80  # number of odd terms; 0: none
ODD = 81  # A3, A5, ...; as many as even ones
TORUS = 90  # 1: the profile along y rotates about a line parallel to y; 0: biconic
HEIGHTS = 91  # row by row in x

CENTRED, CONIC, SAG = 0.0, 1.0, 2.0

# most Newton steps: rays that converge at all do so in a dozen
NEWTON_STEPS = 12
# largest distance of a converged hit from its surface, mm
SETTLED = 1e-11


@inlined
def intersect_conic(curvature, conic, x, y, z, dx, dy, dz, heading):
    """Step from a point to a conic of revolution whose vertex is the origin.

    Parameters
    ----------
    curvature, conic : float
        1/radius in 1/mm and the conic constant.
    x, y, z : float
        Start, mm, relative to the vertex.
    dx, dy, dz : float
        Unit direction.
    heading : float
        +1 on legs that run forward, -1 on legs that run backward.

    Returns
    -------
    t : float
        Signed path length, mm. It may be negative: the order of surfaces is fixed (Hullin 2011, section 4.1).
    root : float
        Square root of the discriminant; equals -gradient . direction * heading at the hit.
    discriminant : float
        Negative where the ray misses.

    Notes
    -----
    The vertex form c (x^2 + y^2 + (1 + k) z^2) = 2 z needs no branch for planes. Of the two hits the one on the vertex
    side is used: t = C / (-B + heading sqrt(B^2 - A C)), which for a sphere is
    t = -D.d - sgn(R d_z) sqrt((D.d)^2 - |D|^2 + R^2) (docs/physics.md, sequential tracing).
    """
    a = curvature * (1.0 + conic * dz * dz)
    b = curvature * (x * dx + y * dy + (1.0 + conic) * z * dz) - dz
    c = curvature * (x * x + y * y + (1.0 + conic) * z * z) - 2.0 * z
    discriminant = b * b - a * c
    root = sqrt(max(discriminant, 0.0))
    # not finite for a ray that grazes a plane; the discriminant is then not positive
    t = c / (heading * root - b)
    return t, root, discriminant


# least curvature for `intersect_sphere`, 1/mm: for flatter spheres rounding errors times the radius would be visible
FLATTEST = 1e-4


@inlined
def intersect_sphere(curvature, radius, x, y, z, dx, dy, dz, heading):
    """Step from a point to a sphere whose vertex is the origin, with a curvature above `FLATTEST`.

    Parameters
    ----------
    curvature, radius : float
        1/radius in 1/mm, and the radius in mm.
    x, y, z, dx, dy, dz, heading
        As in `intersect_conic`.

    Returns
    -------
    t, root, discriminant
        As `intersect_conic`.

    Notes
    -----
    A = c does not depend on the ray, so the same root of A t^2 + 2 B t + C = 0 is -(B + heading sqrt(B^2 - A C)) R,
    without a division, which takes as long as a dozen products. B and the root nearly cancel, so the error of t is
    2e-16 R, at most 2e-12 mm. The gradient c (x, y, z) - (0, 0, 1) at the hit is a unit vector.
    """
    b = curvature * (x * dx + y * dy + z * dz) - dz
    c = curvature * (x * x + y * y + z * z) - 2.0 * z
    discriminant = b * b - curvature * c
    root = sqrt(max(discriminant, 0.0))
    return -(b + heading * root) * radius, root, discriminant


@inner
def _asphere(shapes, row, first, terms, odd, x, y):
    """Return an asphere's sum A4 r^4 + A6 r^6 + ..., or the odd A3 r^3 + A5 r^5 + ..., and its gradient.

    Beyond TANGENT, outside the rim, the sum continues as its tangent: rays there are blocked but still traced, and high
    powers would diverge. The odd sum is smooth on the axis.
    """
    r2 = x * x + y * y
    at = min(r2, shapes[row, TANGENT])
    value, slope = 0.0, 0.0
    for k in range(first + terms - 1, first - 1, -1):
        slope = slope * at + value
        value = value * at + shapes[row, k]
    # value and slope are those of A4 + A6 q + ... in q = r^2; the sum is q^2 times that, or q^1.5 times
    part, power = (sqrt(at), 1.5) if odd else (at, 2.0)
    slope = part * (power * value + at * slope)
    value = part * at * value + (r2 - at) * slope
    return value, 2.0 * x * slope, 2.0 * y * slope


@inner
def _polynomial(shapes, row, x, y):
    """Return the figure's polynomial in x / radius and y / radius, in mm, and its gradient."""
    scale = shapes[row, SCALE]
    u, v = x * scale, y * scale
    degree = int(shapes[row, DEGREE])
    value, along_x, along_y = 0.0, 0.0, 0.0
    for i in range(degree, -1, -1):
        inner, slope = 0.0, 0.0
        for j in range(degree - i, -1, -1):
            slope = slope * v + inner
            inner = inner * v + shapes[row, POLYNOMIAL + 7 * i + j]
        along_x = along_x * u + value
        value = value * u + inner
        along_y = along_y * u + slope
    return value, along_x * scale, along_y * scale


@inner
def height_of_image(shapes, row, x, y):
    """Return the height of the image's uniform cubic B-spline, in mm, and its gradient; constant beyond its border."""
    side = int(shapes[row, SIDE])
    step = 2.0 * shapes[row, HALF] / side
    u, v = (x + shapes[row, HALF]) / step - 0.5, (y + shapes[row, HALF]) / step - 0.5
    inside_x, inside_y = 0.0 <= u <= side - 1.0, 0.0 <= v <= side - 1.0
    u, v = min(max(u, 0.0), side - 1.0), min(max(v, 0.0), side - 1.0)
    a, b = int(u), int(v)
    s, t = u - a, v - b
    value, along_x, along_y = 0.0, 0.0, 0.0
    for m in range(4):
        i = min(max(a + m - 1, 0), side - 1)
        wx, dx = _spline(m, s)
        for n in range(4):
            j = min(max(b + n - 1, 0), side - 1)
            wy, dy = _spline(n, t)
            height = shapes[row, HEIGHTS + i * side + j]
            value += wx * wy * height
            along_x += dx * wy * height
            along_y += wx * dy * height
    return value, along_x / step if inside_x else 0.0, along_y / step if inside_y else 0.0


@inner
def _spline(knot, t):
    """Return weight and slope of one of the four knots of a uniform cubic B-spline around a place t in [0, 1]."""
    if knot == 0:
        return (1.0 - t) ** 3 / 6.0, -0.5 * (1.0 - t) ** 2
    if knot == 1:
        return (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, 1.5 * t * t - 2.0 * t
    if knot == 2:
        return (-3.0 * t * t * t + 3.0 * t * t + 3.0 * t + 1.0) / 6.0, -1.5 * t * t + t + 0.5
    return t * t * t / 6.0, 0.5 * t * t


@inlined
def biconic_form(shapes, row):
    """Return what `biconic_sag` needs of a row: both curvatures and (1 + k) c^2 of both meridians."""
    cx, cy = shapes[row, CURVATURE_X], shapes[row, CURVATURE_Y]
    return cx, cy, (1.0 + shapes[row, CONIC_X]) * cx * cx, (1.0 + shapes[row, CONIC_Y]) * cy * cy


@inlined
def biconic_sag(form, x, y):
    """Return the biconic form, its gradient, and its room."""
    cx, cy, qx, qy = form
    room = 1.0 - qx * x * x - qy * y * y
    root = sqrt(max(room, 1e-6))
    whole = cx * x * x + cy * y * y
    below = 1.0 / (1.0 + root)
    # d(1 / (1 + root)) = below^2 (q x / root) dx
    bend = whole * below * below / root
    return whole * below, 2.0 * cx * x * below + bend * qx * x, 2.0 * cy * y * below + bend * qy * y, room


@inner
def torus_sag(shapes, row, x, y):
    """Return the height of a torus, its gradient, and its room.

    The profile f(y), a conic and its terms, rotates about a line parallel to y at the radius 1 / cx from the vertex
    (Zemax, "Toroidal"): z = (1 - S) / cx with S^2 = (1 - cx f)^2 - (cx x)^2, written without the difference.
    """
    cx, cy = shapes[row, CURVATURE_X], shapes[row, CURVATURE_Y]
    q = (1.0 + shapes[row, CONIC_Y]) * cy * cy
    inside = 1.0 - q * y * y
    root = sqrt(max(inside, 1e-6))
    value, _, slope = _asphere(shapes, row, ASPHERE, TERMS, False, 0.0, y)
    profile, slope = cy * y * y / (1.0 + root) + value, cy * y / root + slope
    beside = 1.0 - cx * profile
    around = beside * beside - cx * cx * x * x if beside > 0.0 else 0.0
    distance = sqrt(max(around, 1e-6))
    sag = (profile * (1.0 + beside) + cx * x * x) / (1.0 + distance)
    return sag, cx * x / distance, beside * slope / distance, min(inside, around)


@compiled
def sag_of_shape(shapes, row, x, y):
    """Return the height of a surface over the plane of its vertex, in the surface's frame.

    Parameters
    ----------
    shapes : ndarray, shape (K, P)
        The shape table (columns above).
    row : int
    x, y : float
        mm.

    Returns
    -------
    sag : float
        mm.
    slope_x, slope_y : float
        Its gradient.
    room : float
        1 - (1 + kx) cx^2 x^2 - (1 + ky) cy^2 y^2, or the lesser of a torus' two; not positive where the surface does
        not exist.

    Notes
    -----
    z = (cx x^2 + cy y^2) / (1 + sqrt(room)) + A4 r^4 + A6 r^6 + ... + A3 r^3 + A5 r^5 + ... + figure: the biconic form.
    It is a conic of revolution if both meridians are equal and a conic cylinder if one is straight. A torus has the
    form of `torus_sag` instead, with its own terms.
    """
    if shapes[row, TORUS] > 0.0:
        sag, slope_x, slope_y, room = torus_sag(shapes, row, x, y)
    else:
        sag, slope_x, slope_y, room = biconic_sag(biconic_form(shapes, row), x, y)
        value, along_x, along_y = _asphere(shapes, row, ASPHERE, TERMS, False, x, y)
        sag, slope_x, slope_y = sag + value, slope_x + along_x, slope_y + along_y
    if shapes[row, ODD_COUNT] > 0.0:
        value, along_x, along_y = _asphere(shapes, row, ODD, int(shapes[row, ODD_COUNT]), True, x, y)
        sag, slope_x, slope_y = sag + value, slope_x + along_x, slope_y + along_y
    if shapes[row, DEGREE] >= 0.0:
        value, along_x, along_y = _polynomial(shapes, row, x, y)
        sag, slope_x, slope_y = sag + value, slope_x + along_x, slope_y + along_y
    if shapes[row, SIDE] > 0.0:
        value, along_x, along_y = height_of_image(shapes, row, x, y)
        sag, slope_x, slope_y = sag + value, slope_x + along_x, slope_y + along_y
    return sag, slope_x, slope_y, room


@inlined
def quadric_of(shapes, row):
    """Return the curvatures of the osculating quadric cx x^2 + cy y^2 + w z^2 = 2 z of a row."""
    cx, cy = shapes[row, CURVATURE_X], shapes[row, CURVATURE_Y]
    wx, wy = (1.0 + shapes[row, CONIC_X]) * cx, (1.0 + shapes[row, CONIC_Y]) * cy
    w = wy if cx == 0.0 else (wx if cy == 0.0 else 0.5 * (wx + wy))
    return cx, cy, w


@inlined
def step_to_quadric(quadric, x, y, z, dx, dy, dz, heading):
    """Return the step from a point to a quadric, or to the plane of the vertex if the ray misses the quadric."""
    cx, cy, w = quadric
    a = cx * dx * dx + cy * dy * dy + w * dz * dz
    b = cx * x * dx + cy * y * dy + w * z * dz - dz
    c = cx * x * x + cy * y * y + w * z * z - 2.0 * z
    discriminant = b * b - a * c
    near = c / (heading * sqrt(max(discriminant, 0.0)) - b)
    return near if discriminant > 0.0 else -z / dz


@inner
def intersect_sag(shapes, row, x, y, z, dx, dy, dz, heading):
    """Step from a point to a surface given by its sag, in the surface's frame.

    Parameters
    ----------
    shapes, row
        As in `sag_of_shape`.
    x, y, z, dx, dy, dz, heading
        As in `intersect_conic`.

    Returns
    -------
    t : float
        Signed path length, mm.
    slope_x, slope_y : float
        Gradient of the sag at the hit.
    found : bool
        Whether the hit lies on the surface to 1e-11 mm.

    Notes
    -----
    Newton's method on F(t) = sag(x + t dx, y + t dy) - z - t dz (Spencer and Murty 1962). The start is the hit of
    `step_to_quadric`.
    """
    t = step_to_quadric(quadric_of(shapes, row), x, y, z, dx, dy, dz, heading)
    sag, slope_x, slope_y, room = 0.0, 0.0, 0.0, 0.0
    error = 1.0
    for _ in range(NEWTON_STEPS):
        sag, slope_x, slope_y, room = sag_of_shape(shapes, row, x + t * dx, y + t * dy)
        error = sag - z - t * dz
        # no further step after convergence, so that the gradient belongs to the hit
        if abs(error) < SETTLED:
            break
        t -= error / (slope_x * dx + slope_y * dy - dz)
    return t, slope_x, slope_y, abs(error) < SETTLED and room > 0.0
