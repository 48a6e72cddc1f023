"""The smallest window that contains all light."""

import numpy as np
import pytest

from flarewright.render.image.canvas import blank, lit_window, merge


@pytest.mark.parametrize("size", [(1, 1), (7, 100), (70, 33), (64, 64)])
def test_the_window_is_that_of_a_plain_search(size):
    rng = np.random.default_rng(sum(size))
    for lit in (0, 1, 2, 5):
        pixels = np.zeros((*size, 3), dtype=np.float32)
        pixels[rng.integers(0, size[0], lit), rng.integers(0, size[1], lit), rng.integers(0, 3, lit)] = -1.0
        rows, columns = np.nonzero(pixels.any(axis=2))
        wanted = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1) if lit else (0, 0, 0, 0)
        assert lit_window(pixels) == wanted


@pytest.mark.parametrize("corner", [(0, 0), (5, 3), (17, 9), (24, 20)])
@pytest.mark.parametrize("detail", [0, 1])
def test_a_window_is_added_at_its_corner(corner, detail):
    size, (x, y) = (37 * 2**detail, 23 * 2**detail), corner
    part = np.random.default_rng(5).random((3, 11, 3)).astype(np.float32)
    whole = np.zeros((23, 37, 3), dtype=np.float32)
    whole[y : y + 3, x : x + 11] = part
    one, other = blank(size), blank(size)
    for _ in range(2):
        one.add(part, detail, corner)
        other.add(whole, detail)
    np.testing.assert_array_equal(merge(one.planes, size), merge(other.planes, size))
    assert merge(one.planes, size).sum() == pytest.approx(2.0 * part.sum(), rel=1e-5)


def test_nothing_is_added_from_an_empty_window():
    canvas = blank((8, 8))
    canvas.add(np.zeros((0, 0, 3), dtype=np.float32))
    assert canvas.planes == [None, None, None]
