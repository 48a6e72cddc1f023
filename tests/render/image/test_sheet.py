"""A sheet gives the light that was drawn on it, and is black for the next ghosts."""

import numpy as np
import pytest

from flarewright.kernels.raster.polygons import BLOCK
from flarewright.render.image.canvas import merge
from flarewright.render.image.sheet import Sheet


def lit(sheet, size_px, boxes):
    """Add light to boxes (x, y, width, height) of a canvas of the sheet; return the canvas and its whole picture."""
    canvas = sheet.canvas(size_px)
    for number, (x, y, width, height) in enumerate(boxes):
        canvas.add(np.full((height, width, 3), [1.0 + number, 2.0, 3.0], dtype=np.float32), 0, (x, y))
    return canvas, merge(canvas.planes, size_px).copy()


@pytest.mark.parametrize("boxes", [[(3, 5, 4, 2)], [(0, 0, 1, 1), (69, 49, 1, 1)], [(15, 40, 2, 3), (40, 41, 7, 1)]])
def test_the_window_holds_all_light_and_no_more(boxes):
    sheet = Sheet()
    canvas, whole = lit(sheet, (70, 50), boxes)
    light, (x, y) = sheet.lift(canvas)
    found = np.zeros_like(whole)
    found[y : y + light.shape[0], x : x + light.shape[1]] = light
    np.testing.assert_array_equal(found, whole)
    assert all(light[side].any() for side in (0, -1))
    assert all(light[:, side].any() for side in (0, -1))


def test_the_next_canvas_is_black_whatever_its_size():
    sheet = Sheet()
    for size in ((70, 50), (30, 20), (120, 90), (120, 90)):
        canvas, whole = lit(sheet, size, [(2, 3, size[0] - 4, size[1] - 5)])
        assert whole[3:-2, 2:-2].all()
        assert np.count_nonzero(whole) == whole[3:-2, 2:-2].size
        sheet.lift(canvas)
    assert not sheet.canvas((120, 90)).plane().any()


def test_a_dark_canvas_has_an_empty_window():
    sheet = Sheet()
    light, corner = sheet.lift(sheet.canvas((40, 30)))
    assert light.shape == (0, 0, 3)
    assert corner == (0, 0)


def test_light_beyond_the_width_is_dropped_and_cleared():
    """The last block of a row has pixels beyond the picture, which the kernels draw on."""
    sheet = Sheet()
    canvas = sheet.canvas((BLOCK + 1, 4))
    canvas.plane()[1, 1, :, 1:] = 1.0
    canvas.plane()[2, 0, :, 5] = 2.0
    light, corner = sheet.lift(canvas)
    assert light.tolist() == [[[2.0, 2.0, 2.0]]]
    assert corner == (5, 2)
    assert not sheet.canvas((BLOCK + 1, 4)).plane().any()
