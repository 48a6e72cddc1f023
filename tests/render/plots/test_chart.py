"""Charts: a legend names every curve, at any length, and no two curves have the same colour."""

import re

import numpy as np
import pytest

from flarewright.render.plots.chart import COLOURS, Series, chart, with_deviation
from flarewright.render.plots.svg import Area, Box, Chart, EmbeddedImage, chart_pixels, to_svg


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
    figure = Chart(40, 20, "t", (EmbeddedImage(0.0, 0.0, 40.0, 20.0, pixels), Box(10.0, 5.0, 4.0, 4.0, "#ff0000")))
    assert 'href="data:image/png;base64,' in to_svg(figure)
    drawn = chart_pixels(figure)
    assert drawn[12, 30].tolist() == [0, 200, 0]
    assert drawn[7, 12].tolist() == [255, 0, 0]


def spots(text, tag):
    """Return the points of lines or polygons of an SVG, without those of the grid."""
    found = re.findall(rf'<{tag} points="([^"]+)"[^>]*(?:stroke-width="1.8"|fill-opacity)', text)
    return [np.array([[float(part) for part in spot.split(",")] for spot in one.split()]) for one in found]


def test_a_band_is_a_standard_deviation_to_each_side_of_its_curve():
    x, y, wide = np.linspace(0.0, 4.0, 5), np.array([10.0, 12.0, 9.0, 11.0, 10.0]), np.array([1.0, 2.0, 0.5, 1.0, 3.0])
    text = to_svg(chart("t", [Series("a", x, y, deviation=wide)], x_label="x"))
    (line,), (band,) = spots(text, "polyline"), spots(text, "polygon")
    upper, lower = band[:5], band[:4:-1]
    assert np.array_equal(upper[:, 0], line[:, 0])
    assert np.array_equal(lower[:, 0], line[:, 0])
    # pixels per unit, from the curve itself
    scale = (line[0, 1] - line[1, 1]) / 2.0
    assert (line[:, 1] - upper[:, 1]) / scale == pytest.approx(wide, abs=1e-2)
    assert (lower[:, 1] - line[:, 1]) / scale == pytest.approx(wide, abs=1e-2)
    assert text.index("<polygon") < text.index('stroke-width="1.8"')


@pytest.mark.parametrize("logarithmic", [False, True])
def test_a_curve_without_deviations_is_drawn_as_ever(logarithmic):
    x, y = np.linspace(0.0, 4.0, 6), np.array([1.0, 30.0, np.nan, 4.0, 0.2, 5.0])
    plain = to_svg(chart("t", [Series("a", x, y)], x_label="x", logarithmic=logarithmic))
    for none in (np.zeros(6), np.full(6, np.nan), np.full(6, np.inf)):
        drawn = chart("t", [Series("a", x, y, deviation=none)], x_label="x", logarithmic=logarithmic)
        assert to_svg(drawn) == plain


def test_a_band_stops_where_nothing_is_known_and_where_the_curve_stops():
    y = np.array([5.0, 5.0, 5.0, np.nan, 5.0, 5.0, 5.0, 5.0])
    wide = np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, np.nan])
    bands = spots(to_svg(chart("t", [Series("a", np.arange(8.0), y, deviation=wide)], x_label="x")), "polygon")
    assert [len(one) for one in bands] == [4, 6]


@pytest.mark.parametrize("logarithmic", [False, True])
def test_a_wide_band_is_cut_and_leaves_the_curves_readable(logarithmic):
    x, y = np.arange(3.0), np.array([2.0, 60.0, 4.0])
    series = [Series("a", x, y), Series("b", x, y, COLOURS[1], deviation=np.full(3, 1e6))]
    figure = chart("t", series, x_label="x", logarithmic=logarithmic)
    text = to_svg(figure)
    rows = np.concatenate(spots(text, "polyline"))[:, 1]
    assert np.ptp(rows) > 0.2 * figure.height
    (band,) = spots(text, "polygon")
    assert 0.0 < band[:, 1].min() < rows.min()
    assert rows.max() < band[:, 1].max() < figure.height - 40.0
    assert np.isfinite(band).all()


def test_what_lies_below_an_area_shows_through():
    around = [(10.0, 5.0), (30.0, 5.0), (30.0, 15.0), (10.0, 15.0)]
    figure = Chart(40, 20, "t", (Box(0.0, 0.0, 20.0, 20.0, "#0000ff"), Area(around, "#ff0000", 0.2)))
    assert '<polygon points="10.00,5.00 30.00,5.00' in to_svg(figure)
    drawn = chart_pixels(figure)
    assert drawn[10, 15] == pytest.approx([51, 0, 204], abs=1)
    assert drawn[10, 25] == pytest.approx([252, 202, 202], abs=2)
    assert drawn[17, 15].tolist() == [0, 0, 255]


@pytest.mark.parametrize(
    ("value", "deviation", "words"),
    [
        (12.3456, 0.234, "12.35 ± 0.23"), (12.3456, 0.5, "12.3 ± 0.5"), (5678.4, 1234.0, "5678 ± 1234"),
        (-0.2, 4.0, "0 ± 4"), (1.0, 0.0, "1"), (12.3456, np.nan, "12.35"), (np.nan, 1.0, "-"),
        (3e-9, 2e-10, "3e-9 ± 2e-10"),
    ],
)  # fmt: skip
def test_a_number_has_the_digits_that_its_deviation_leaves(value, deviation, words):
    assert with_deviation(value, deviation) == words


@pytest.mark.parametrize(
    ("value", "deviation", "matters", "words"),
    [
        (76.6, 3e-14, 0.0, "76.6"), (9.397593, 2e-5, 0.0, "9.398"), (-1.214, 6e-13, 1.0, "-1.214"),
        (0.0, 2e-15, 0.071, "0"), (0.0, 2e-15, np.inf, "0"), (0.0, 2e-15, 1e-12, "0 ± 2e-15"),
        (9.3976, 2e-4, 1.0, "9.39760 ± 0.00020"), (0.0, 0.5, 1.0, "0.0 ± 0.5"),
    ],
)  # fmt: skip
def test_a_deviation_at_rounding_level_is_omitted(value, deviation, matters, words):
    assert with_deviation(value, deviation, matters) == words
