"""The one intersection of a ray with a surface.

Every surface that comes later (aspheres, cylinders) adds its case here and nowhere else.
"""

from math import sqrt

from ._jit import inlined


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
        Signed path length, mm. Negative steps are legal: the order of surfaces is fixed (Hullin 2011, section 4.1).
    root : float
        sqrt of the discriminant; equals -gradient . direction * heading at the hit.
    discriminant : float
        Negative where the ray misses.

    Notes
    -----
    The vertex form c (x^2 + y^2 + (1 + k) z^2) = 2 z needs no branch for planes. Of the two hits it takes the one that
    tends to the vertex: t = C / (-B + heading sqrt(B^2 - A C)), which for a sphere is
    t = -D.d - sgn(R d_z) sqrt((D.d)^2 - |D|^2 + R^2) (docs/physics.md, sequential tracing).
    """
    a = curvature * (1.0 + conic * dz * dz)
    b = curvature * (x * dx + y * dy + (1.0 + conic) * z * dz) - dz
    c = curvature * (x * x + y * y + (1.0 + conic) * z * z) - 2.0 * z
    discriminant = b * b - a * c
    root = sqrt(max(discriminant, 0.0))
    # a ray that grazes a plane has no step; the discriminant tells
    t = c / (heading * root - b)
    return t, root, discriminant
