"""Place, size and radiance of a measured ghost at the centre of its pupil."""

from ..jit.decorators import compiled
from .pupil_mesh import FIRST_I, place_point, slopes

# smallest area magnification, square pixels; below it the map at the pupil's centre is degenerate
_FOLDED = 1e-9


@compiled
def fill_middles(parameters, sigma, out):
    """Fill place, size and radiance of a ghost at the centre of its pupil.

    Parameters
    ----------
    parameters : ndarray, shape (K, N)
        Parameters of one ghost, with the pose of each field.
    sigma : ndarray, shape (K,)
        Field lengths.
    out : ndarray, shape (3, K)
        Filled: distance from the axis towards the light, pixels; size of the pupil radius perpendicular to that,
        pixels; radiance, NaN where the map is degenerate.
    """
    for k in range(sigma.size):
        along, _, by_xi, _, _, by_eta = place_point(parameters[k], 0.0, 0.0, sigma[k])
        intensity, _, _ = slopes(parameters[k], FIRST_I, 0.0, 0.0, sigma[k] * sigma[k])
        # at the centre the Jacobian of the map is diagonal
        area = abs(by_xi * by_eta)
        out[0, k], out[1, k] = along, by_eta
        out[2, k] = max(intensity, 0.0) / area if area > _FOLDED else float("nan")
