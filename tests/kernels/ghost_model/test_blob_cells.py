"""The linear map from fine pictures to pixels, and its transpose, compared with a dense matrix."""

import numpy as np

from flarewright.kernels.ghost_model.blob_cells import gather_cells, read_cells, square_cells

PIXELS, TAPS, PICTURES, CELLS = 40, 9, 4, 25


def planted():
    rng = np.random.default_rng(3)
    return (
        rng.integers(0, CELLS, (PIXELS, TAPS)), rng.random((PIXELS, TAPS)), rng.integers(0, PICTURES - 1, PIXELS),
        rng.random(PIXELS), rng.random(PIXELS) + 0.1,
    )  # fmt: skip


def matrix(cells, weights, before, part, sure):
    """Return the weight of every cell of every picture in every pixel, shape (P, K, cells)."""
    out = np.zeros((PIXELS, PICTURES, CELLS))
    for p in range(PIXELS):
        for t in range(TAPS):
            out[p, before[p], cells[p, t]] += sure[p] * (1.0 - part[p]) * weights[p, t]
            out[p, before[p] + 1, cells[p, t]] += sure[p] * part[p] * weights[p, t]
    return out


def test_pixels_are_the_product_of_the_matrix_and_the_cells():
    reading = planted()
    pictures = np.random.default_rng(4).normal(size=(PICTURES, CELLS, 3))
    out = np.empty((PIXELS, 3))
    read_cells(*reading, pictures, out)
    assert np.allclose(out, np.einsum("pkc,kcm->pm", matrix(*reading), pictures), rtol=1e-12)


def test_gathering_is_the_transpose():
    reading = planted()
    pixels = np.random.default_rng(5).normal(size=(PIXELS, 3))
    out = np.ones((PICTURES, CELLS, 3))
    gather_cells(*reading, pixels, out)
    assert np.allclose(out - 1.0, np.einsum("pkc,pm->kcm", matrix(*reading), pixels), rtol=1e-10, atol=1e-12)


def test_squares_are_those_of_the_matrix_if_no_cell_is_read_twice():
    cells, weights, before, part, sure = planted()
    cells = np.argsort(np.random.default_rng(6).random((PIXELS, CELLS)), axis=1)[:, :TAPS].copy()
    out = np.zeros((PICTURES, CELLS))
    square_cells(cells, weights, before, part, sure, out)
    assert np.allclose(out, (matrix(cells, weights, before, part, sure) ** 2).sum(axis=0), rtol=1e-12)
