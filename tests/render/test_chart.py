"""Charts: a legend names every curve, whatever room that takes, and no two curves are of one colour."""

import re

import numpy as np
import pytest

from flarewright.render.chart import COLOURS, Series, chart
from flarewright.render.figure import Box, Figure, Picture, to_pixels, to_svg


@pytest.mark.parametrize("count", [2, 9, 30])
def test_every_curve_is_in_the_legend_and_the_curves_stand_below_it(count):
    x = np.arange(3.0)
    series = [Series(f"ghost {k}", x, x + k, COLOURS[k % len(COLOURS)]) for k in range(count)]
    figure = chart("Many", series, x_label="x")
    text = to_svg(figure)
    rows = [(float(left), float(y), words) for left, y, words in
            re.findall(r'<text x="([\d.]+)" y="([\d.]+)"[^>]*>(ghost \d+)<', text)]  # fmt: skip
    assert [words for _, _, words in rows] == [one.label for one in series]
    assert max(left for left, _, _ in rows) < 420.0
    assert len({(left, y) for left, y, _ in rows}) == count
    lines = re.findall(r'<polyline points="([^"]+)" fill="none" stroke="[^"]+" stroke-width="1.8"', text)
    tops = [float(spot.split(",")[1]) for line in lines for spot in line.split()]
    assert min(tops) > max(y for _, y, _ in rows)
    assert figure.height == 270 + 14 * (len({y for _, y, _ in rows}) - 1)


def test_no_two_colours_are_the_same():
    assert len(set(COLOURS)) == len(COLOURS) >= 12


def test_a_picture_lies_below_what_is_drawn_on_it():
    pixels = np.zeros((2, 4, 3), np.uint8)
    pixels[..., 1] = 200
    figure = Figure(40, 20, "t", (Picture(0.0, 0.0, 40.0, 20.0, pixels), Box(10.0, 5.0, 4.0, 4.0, "#ff0000")))
    assert 'href="data:image/png;base64,' in to_svg(figure)
    drawn = to_pixels(figure)
    assert drawn[12, 30].tolist() == [0, 200, 0]
    assert drawn[7, 12].tolist() == [255, 0, 0]
