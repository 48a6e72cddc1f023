"""The texts of a coating's plot are legible: no overlaps, none outside the figure."""

import numpy as np
import pytest

from flarewright.io.lens.coating_text import STANDARD_NAMES, coating_from
from flarewright.optics.coatings.response import WAVELENGTHS_NM, coating_response
from flarewright.render.plots.coating_plot import PANEL, PLOT_ANGLES_DEG, SHEET, STRIP_ANGLES_DEG, coating_figure
from flarewright.render.plots.svg import Text

MANY_FILMS = "stack:" + ",".join(f"{1.38 + 0.05 * k:.2f}:{70.5 + 11 * k:.1f}" for k in range(9))


def _figure(coating, layout):
    index = np.full(len(WAVELENGTHS_NM), 1.62)
    curves, strip = (
        coating_response(coating_from(coating), 1.62, index, angles) for angles in (PLOT_ANGLES_DEG, STRIP_ANGLES_DEG)
    )
    bare = float(coating_response(None, 1.62, index, 0.0).luminous_reflectance[0])
    return coating_figure(curves, strip, bare, f"Row 10: {coating[:20]}", "SCHOTT N-LAK33B", layout)


def _box(text):
    wide = 0.5 * text.size * len(text.words)
    left = text.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[text.anchor] * wide
    return left, text.y - 0.72 * text.size, left + wide, text.y


@pytest.mark.parametrize("layout", [SHEET, PANEL], ids=["sheet", "panel"])
@pytest.mark.parametrize("coating", ["none", "quarter-wave:550", *STANDARD_NAMES, MANY_FILMS])
def test_words_stand_apart_and_on_the_sheet(coating, layout):
    figure = _figure(coating, layout)
    texts = [mark for mark in figure.marks if isinstance(mark, Text)]
    boxes = [_box(text) for text in texts]
    for text, (left, upper, right, lower) in zip(texts, boxes, strict=True):
        assert left >= 0.0, text
        assert upper >= 0.0, text
        assert right <= figure.width, text
        assert lower <= figure.height, text
    for k, (left, upper, right, lower) in enumerate(boxes):
        for other, (x0, y0, x1, y1) in zip(texts[k + 1 :], boxes[k + 1 :], strict=True):
            assert right <= x0 or x1 <= left or lower <= y0 or y1 <= upper, (texts[k], other)


@pytest.mark.parametrize("layout", [SHEET, PANEL], ids=["sheet", "panel"])
def test_every_film_is_listed_whole(layout):
    lines = [mark.words for mark in _figure(MANY_FILMS, layout).marks if isinstance(mark, Text)]
    films = [film for line in lines if " nm" in line and line.count("n ") for film in line.split(", n ")]
    assert sum(film.rstrip(",").endswith("nm") for film in films) == 9
