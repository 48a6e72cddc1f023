"""What a measured ghost does in the middle of its pupil: where that lands, how large the ghost is there, how bright."""

from ._jit import compiled
from .measure_pupil import FIRST_I, place, slopes

# an area below which the pupil's middle is folded to a point or a line, pixels
_FOLDED = 1e-9


@compiled
def fill_middles(parameters, sigma, out):
    """Fill place, size and radiance of the middle of a pupil.

    Parameters
    ----------
    parameters : ndarray, shape (K, N)
        Of one ghost, posed for each field.
    sigma : ndarray, shape (K,)
        Lengths of the field.
    out : ndarray, shape (3, K)
        Filled: pixels from the axis towards the light; pixels for a radius of the pupil, at right angles to that;
        radiance, not a number where the middle is folded.
    """
    for k in range(sigma.size):
        along, _, by_xi, _, _, by_eta = place(parameters[k], 0.0, 0.0, sigma[k])
        intensity, _, _ = slopes(parameters[k], FIRST_I, 0.0, 0.0, sigma[k] * sigma[k])
        # in the middle the map neither shears nor turns
        area = abs(by_xi * by_eta)
        out[0, k], out[1, k] = along, by_eta
        out[2, k] = max(intensity, 0.0) / area if area > _FOLDED else float("nan")
