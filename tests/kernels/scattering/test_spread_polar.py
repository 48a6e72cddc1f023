"""Pixels of the scatter layer against SciPy's integral of the same light."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from flarewright.kernels.jit.decorators import for_python
from flarewright.kernels.scattering import single_scatter

spread_polar = for_python(single_scatter.spread_polar)

# pixels of 1 x 0.8 mm, the direct image off the centre of one
TO_PIXELS = np.array([4.0, 3.0, 1.0, 1.25])
CENTRE = np.array([0.3, -0.2])
FIRST, LAST = 0.01, 20.0


def light_of(power):
    """Return the light at an offset, constant within the first circle; the interpolation holds powers exactly."""
    return lambda x, y: max(np.hypot(x, y), FIRST) ** -power


@pytest.mark.parametrize("power", [1.0, 2.0, 3.0])
def test_a_pixel_is_the_mean_of_its_light(power):
    rings, spokes = 60, 24
    radii = np.geomspace(FIRST, LAST, rings)
    level = np.repeat(-power * np.log(radii)[:, None], spokes, axis=1)
    colour = np.ones((rings, spokes, 3)) * [1.0, 2.0, 0.5]
    pixels = np.empty((6, 9, 3), dtype=np.float32)
    step = (np.log(FIRST), (rings - 1) / np.log(LAST / FIRST)), (0.0, spokes / (2.0 * np.pi))
    spread_polar(CENTRE, True, *step, level, colour, TO_PIXELS, pixels)
    light = light_of(power)
    for row, column in [(3, 4), (3, 3), (2, 4), (1, 6), (5, 0)]:
        left, low = column - TO_PIXELS[0] - CENTRE[0], (TO_PIXELS[1] - row - 1) / TO_PIXELS[3] - CENTRE[1]
        # split at the direct image and around it, where the light is steep
        xs = sorted({left, left + 1.0, *(x for x in (-0.1, 0.0, 0.1) if left < x < left + 1.0)})
        ys = sorted({low, low + 0.8, *(y for y in (-0.1, 0.0, 0.1) if low < y < low + 0.8)})
        total = sum(
            dblquad(lambda y, x: light(x, y), xs[i], xs[i + 1], ys[j], ys[j + 1], epsrel=1e-4)[0]
            for i in range(len(xs) - 1)
            for j in range(len(ys) - 1)
        )
        np.testing.assert_allclose(pixels[row, column], total / 0.8 * np.array([1.0, 2.0, 0.5]), rtol=8e-3)
