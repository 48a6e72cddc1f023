"""The report's section about a model's parameters: both kinds of ghosts, bands of their deviations, full tables."""

import re
from functools import cache

import numpy as np
import pytest
from test_measure_report import run_of
from test_model_image import planted
from test_pupil_centre import CURVES, ghost, reported

from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.report.curves import curves_section
from flarewright.measure.report.page import write_report
from flarewright.measure.report.tables import numbers_table
from flarewright.measure.walch.polynomials import fit_polynomial
from flarewright.model.measurement.ghost_model import AberrationGhost, BezierGhost, Curves

COLOURS = {"1": "#1d5fa8", "2": "#c8413b", "3": "#2d8a5f"}
BY_ABERRATIONS = reported()
BY_BEZIER = (1.5, 0.0, 0.4, 0.5, 0.6, *(0.2,) * 4, *(0.1,) * 4, 0.15, 0.25, 0.1, 0.05, 0.06, 0.04)


def model(uncertainty=BY_ABERRATIONS, of_bezier=BY_BEZIER, curves=CURVES):
    """Return a model with two aberration ghosts and a Bezier ghost, all with standard deviations."""
    walch = planted().ghosts[1].replace(uncertainty=of_bezier)
    ghosts = (ghost(uncertainty, curves), walch, ghost(uncertainty, Curves(), shift=2.0).replace(name="3"))
    return planted().replace(ghosts=ghosts)


@cache
def whole_section():
    return curves_section(model(), COLOURS)


def charts_of(html):
    return {re.search(r"<title>(.*?)</title>", one)[1]: one for one in re.findall(r"<svg.*?</svg>", html, re.DOTALL)}


def row_of(html, name):
    """Return the cells of a ghost's row as pairs of a number and its deviation."""
    cells = re.search(rf"<td>{name}, at [-\d.]+</td>(.*?)</tr>", html)[1]
    return [tuple(float(part) for part in cell.split(" ± ")) for cell in re.findall(r"<td>(.*?)</td>", cells)]


def test_both_kinds_of_ghosts_are_drawn_with_a_band_each():
    charts = charts_of(whole_section())
    for title, count in (("Place along the light's line", 3), ("Size", 3), ("Brightness of the middle", 3),
                         ("Red's place", 2), ("Blue's place", 2)):  # fmt: skip
        assert charts[title.replace("'", "&#x27;")].count("<polygon") == count
    assert "Bezier ghosts&#x27; extent to the light: ghost 2" in charts
    assert "Bezier ghosts&#x27; border level: ghost 2" in charts


def test_ghosts_without_a_colour_are_in_the_table_alone():
    html = curves_section(model(), {"1": "#1d5fa8"})
    charts = charts_of(html)
    assert all("#c8413b" not in one for one in charts.values())
    assert not any("Bezier" in title for title in charts)
    assert len(row_of(html, "2")) == len(row_of(html, "3")) == 7


def test_a_bezier_ghosts_row_is_what_its_polynomials_and_their_scatter_say():
    place, size, red, green, blue, *apart = row_of(whole_section(), "2")
    # in the middle of 5 to 20 degrees every polynomial equals its first coefficient
    assert place == (30.0, 1.5)
    assert size == (9.0, 0.4)
    assert (red, green, blue) == ((0.5, 0.05), (0.4, 0.06), (0.3, 0.04))
    assert apart == [(0.0,), (0.0,)]


def test_a_bezier_ghosts_band_holds_what_scatters_about_its_polynomial():
    rng, angles = np.random.default_rng(3), np.linspace(5.0, 20.0, 60)
    z = (angles - 12.5) / 7.5
    fitted = [fit_polynomial(angles, 30.0 + 25.0 * z + 8.0 * z**2 + rng.normal(0.0, 2.0, 60), np.ones(60), (5.0, 20.0))]
    fitted += [fit_polynomial(angles, np.full(60, 5.0), np.ones(60), (5.0, 20.0))] * 18
    walch = BezierGhost(name="2", numbers=tuple(one.coefficients for one in fitted), visible_deg=(5.0, 20.0),
                        uncertainty=tuple(one.deviation for one in fitted))  # fmt: skip
    place, *_ = row_of(curves_section(planted().replace(ghosts=(walch,)), COLOURS), "2")
    assert place[0] == pytest.approx(30.0, abs=1.0)
    assert place[1] == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize(("uncertainty", "of_bezier"), [((), ()), ((0.0,) * 30, (0.0,) * 19), ((), (0.0,) * 3)])
def test_without_deviations_there_are_no_bands_and_only_numbers(uncertainty, of_bezier):
    html = curves_section(model(uncertainty, of_bezier, Curves()), COLOURS)
    assert "<polygon" not in html
    assert "±" not in html
    assert not re.search(r"\b(nan|inf)\b", html)
    assert len(row_of(html, "1")) == 7


def test_a_ghost_that_was_never_photographed_is_listed_at_the_end_of_the_captures():
    late = ghost(reported()).replace(visible_deg=(30.0, 40.0))
    html = curves_section(planted().replace(ghosts=(late,)), COLOURS)
    assert "<td>1, at 25.0</td>" in html
    assert not re.search(r"\b(nan|inf)\b", html)
    assert curves_section(planted().replace(ghosts=()), {}) == ""


def test_every_number_of_a_ghost_is_listed_with_its_deviation():
    one = ghost(reported())
    html = numbers_table(one.replace(blades={"count": 6, "first_deg": 12.5}, fade_deg=(0.5, 1.0)))
    assert "<td>f, 1</td><td>-60.0 ± 0.6</td>" in html
    assert "<td>intensity, w</td><td>50 ± 5</td>" in html
    assert "<td>below, c</td><td>0.200 ± 0.015</td>" in html
    assert "<td>brightness, 12.50</td><td>1.400 ± 0.020</td>" in html
    assert "<td>size, 12.50</td><td>1.100 ± 0.010</td>" in html
    assert "6 blades, a side at 12.5 degrees" in html
    assert "fades in over 0.5 and out over 1" in html
    # terms that are 0 in all colours and were not fitted
    assert "f, uu" not in html
    assert "<td>centre, to the light</td><td>30.0 ± 1.5</td><td>30, 25</td>" in numbers_table(model().ghosts[1])


def test_a_colour_far_off_green_leaves_the_others_charts_readable():
    # all colours are inside the picture
    far = ghost(reported(), Curves(), shift=10.0).replace(name="2", visible_deg=(24.0, 25.0))
    several = [ghost(reported(), Curves(), shift=0.1).replace(name=str(k)) for k in range(3, 13)]
    colours = {one.name: f"#0000{k:02x}" for k, one in enumerate((far, *several))}
    charts = charts_of(curves_section(planted().replace(ghosts=(far, *several)), colours))
    assert 'stroke="#000000" stroke-width="1.8"' not in charts["Blue&#x27;s place"]
    assert 'stroke="#000001" stroke-width="1.8"' in charts["Blue&#x27;s place"]


def lines_of(svg, colour):
    """Return the points of a ghost's curve, one array per piece, shape (N, 2)."""
    found = re.findall(rf'<polyline points="([^"]+)" fill="none" stroke="{colour}" stroke-width="1.8"', svg)
    return [np.array([[float(part) for part in spot.split(",")] for spot in one.split()]) for one in found]


def of_numbers(name, **groups):
    """Return a ghost with equal colours; groups give the first and fourth number (1 and w) of its polynomials."""
    channel = ghost().red.replace(below=(0.0, 0.0), **{
        group: (first, 0.0, 0.0, by_w, *(0.0,) * 6) for group, (first, by_w) in groups.items()
    })  # fmt: skip
    return AberrationGhost(name=name, red=channel, green=channel, blue=channel, visible_deg=(0.0, 25.0))


def test_a_place_out_of_the_picture_leaves_the_others_charts_readable():
    # with two ghosts half of all places are far off; the picture's corners are at 92 pixels
    far, leaves = of_numbers("1", f=(-1400.0, 0.0)), of_numbers("2", f=(100.0, 0.0))
    charts = charts_of(curves_section(planted().replace(ghosts=(far, leaves)), COLOURS))
    s = np.tan(np.radians(np.linspace(0.0, 25.0, 41))) / np.tan(np.radians(25.0))
    for title in ("Place along the light&#x27;s line", "Red&#x27;s place", "Blue&#x27;s place"):
        assert sum(map(len, lines_of(charts[title], COLOURS["1"]))) == (1400.0 * s <= 92.2).sum() <= 3
        (line,) = lines_of(charts[title], COLOURS["2"])
        assert len(line) == (100.0 * s <= 92.2).sum() < 41
    (line,) = lines_of(charts["Place along the light&#x27;s line"], COLOURS["2"])
    assert np.ptp(line[:, 1]) > 80.0
    alone = of_numbers("1", f=(-1400.0, 0.0)).replace(visible_deg=(20.0, 25.0))
    html = curves_section(planted().replace(ghosts=(alone,)), COLOURS)
    assert row_of(html, "1")[0][0] == pytest.approx(
        -1400.0 * np.tan(np.radians(22.5)) / np.tan(np.radians(25.0)), abs=1
    )
    assert not lines_of(charts_of(html)["Place along the light&#x27;s line: ghost 1"], COLOURS["1"])


def test_a_middle_that_is_dark_is_a_gap_in_its_curve_and_none_runs_along_the_bottom():
    # dark beyond w = 0.6, folded, and fainter than the chart's range
    ghosts = (of_numbers("1", intensity=(900.0, -1500.0)), of_numbers("2", g=(0.0, 0.0)),
              of_numbers("3", intensity=(0.08, 0.0)))  # fmt: skip
    svg = charts_of(curves_section(planted().replace(ghosts=ghosts), COLOURS))["Brightness of the middle"]
    (line,) = lines_of(svg, COLOURS["1"])
    w = (np.tan(np.radians(np.linspace(0.0, 25.0, 41))) / np.tan(np.radians(25.0))) ** 2
    assert len(line) == (w < 0.6).sum() < 35
    assert not lines_of(svg, COLOURS["2"])
    assert not lines_of(svg, COLOURS["3"])
    # the origin of the axes
    bottom = max(float(y) for y in re.findall(r'<polyline points="[^"]+,([\d.]+)" fill="none" stroke="#e3e8ed"', svg))
    assert line[:, 1].max() < bottom


def test_the_report_explains_a_negative_size():
    html = curves_section(planted().replace(ghosts=(of_numbers("1", g=(-8.0, 0.0)),)), COLOURS)
    assert row_of(html, "1")[1] == (-8.0,)
    assert "A negative size is an inverted ghost" in html
    assert "below 0 inverted" in charts_of(html)["Size: ghost 1"]


def test_a_model_of_bezier_ghosts_alone_says_nothing_of_pupils_and_colours():
    walch, mesh = model().ghosts[1], model().ghosts[0]
    html = curves_section(planted().replace(ghosts=(walch,)), COLOURS)
    assert "pupil" not in html
    assert "inverted" not in html
    assert "off green" not in html
    assert len(row_of(html, "2")) == 5
    assert "Bezier" not in curves_section(planted().replace(ghosts=(mesh,)), COLOURS)
    both = whole_section()
    assert "middle of its pupil" in both
    assert "For a Bezier ghost" in both


@pytest.mark.parametrize("angle", [-12.0, 12.0])
def test_places_of_both_kinds_are_on_the_side_on_which_replays_draw_them(angle):
    # measured on both sides, each ghost visible on one
    life = (angle - 3.0, angle + 3.0)
    walch = planted().ghosts[1].replace(numbers=((30.0,), *planted().ghosts[1].numbers[1:]), visible_deg=life)
    both = planted().replace(ghosts=(ghost().replace(visible_deg=life, curves=Curves()), walch), halo=None, star=None,
                             constellation_deg=(-25.0, 25.0))  # fmt: skip
    html = curves_section(both, COLOURS)
    for name in ("1", "2"):
        light = next(one for one in replay_model(both, angle, single=True) if one.name == f"ghost.{name}")
        columns = light.pixels[..., 1].sum(axis=0, dtype=float)
        middle = columns @ (light.window[0] + np.arange(columns.size) + 0.5) / columns.sum() - both.axis_px[0]
        assert row_of(html, name)[0][0] == pytest.approx(middle, abs=3.0)
        assert abs(middle) > 20.0


def test_a_bezier_ghosts_curve_crosses_the_axis_with_the_light():
    walch = planted().ghosts[1].replace(numbers=((30.0,), *planted().ghosts[1].numbers[1:]), visible_deg=(-20.0, 20.0))
    both = planted().replace(ghosts=(walch,), constellation_deg=(-25.0, 25.0))
    charts = charts_of(curves_section(both, COLOURS))
    (line,) = lines_of(charts["Place along the light&#x27;s line: ghost 2"], COLOURS["2"])
    assert (line[:20, 1] == line[:20, 1].max()).all()
    assert (line[20:, 1] == line[20:, 1].min()).all()
    assert np.ptp(line[:, 1]) > 100.0


def test_the_deviation_of_a_colour_without_light_is_left_out():
    deviation = [0.0] * 30
    deviation[20:24] = 9.0, 0.0, 0.0, 5.0
    one = ghost(tuple(deviation), Curves())
    dead = one.green.replace(intensity=(0.0,) * 10, uncertainty=tuple(1e-12 * each for each in deviation))
    one = one.replace(green=dead)
    cells = row_of(curves_section(planted().replace(ghosts=(one,)), COLOURS), "1")
    assert [len(cell) for cell in cells[2:5]] == [2, 1, 2]
    assert "<td>intensity, 1</td><td>900 ± 9</td><td>0</td><td>500 ± 9</td>" in numbers_table(one)


@pytest.mark.slow
def test_the_section_is_in_the_report_of_a_run(tmp_path):
    written = run_of(tmp_path, planted())
    write_report(tmp_path, written, model(), tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text()
    assert text.index("<h2>Ghosts</h2>") < text.index("<h2>The model's numbers</h2>")
    assert "Correlations are not in the model" in text
    assert text.count("<details>") == text.count("</details>") == 4
    assert not re.search(r"\b(nan|inf)\b", re.sub(r"base64,[^\"]*", "", text))
