"""Cubic convolution: exact for parabolas, equal to the cells at whole numbers, constant beyond the border."""

import numpy as np

from flarewright.kernels.ghost_model.cubic_sampling import cubic_samples


def read(cells, column, row):
    out = np.empty((np.size(column), 3))
    cubic_samples(np.asarray(cells, np.float32), np.asarray(column, float), np.asarray(row, float), out)
    return out


def test_parabolas_are_interpolated_exactly():
    def light(x, y):
        return np.stack([1.0 + 0.3 * x - 0.02 * x * x, 2.0 - 0.1 * y + 0.01 * y * y + 0.02 * x * y, 0.5 * x], axis=-1)

    rows, columns = np.mgrid[:12, :17].astype(float)
    rng = np.random.default_rng(1)
    x, y = rng.uniform(1.0, 15.0, 300), rng.uniform(1.0, 10.0, 300)
    assert np.abs(read(light(columns, rows), x, y) - light(x, y)).max() < 2e-6


def test_cells_are_reproduced_and_continued_beyond_the_border():
    cells = np.random.default_rng(2).normal(size=(4, 5, 3)).astype(np.float32)
    rows, columns = (each.ravel() for each in np.mgrid[:4, :5])
    assert np.allclose(read(cells, columns, rows).reshape(4, 5, 3), cells)
    assert np.allclose(read(cells, [-3.0, 9.0], [2.0, 7.5]), [cells[2, 0], cells[3, 4]])
