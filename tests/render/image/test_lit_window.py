"""The smallest window that contains all light."""

import numpy as np
import pytest

from flarewright.render.image.canvas import lit_window


@pytest.mark.parametrize("size", [(1, 1), (7, 100), (70, 33), (64, 64)])
def test_the_window_is_that_of_a_plain_search(size):
    rng = np.random.default_rng(sum(size))
    for lit in (0, 1, 2, 5):
        pixels = np.zeros((*size, 3), dtype=np.float32)
        pixels[rng.integers(0, size[0], lit), rng.integers(0, size[1], lit), rng.integers(0, 3, lit)] = -1.0
        rows, columns = np.nonzero(pixels.any(axis=2))
        wanted = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1) if lit else (0, 0, 0, 0)
        assert lit_window(pixels) == wanted
