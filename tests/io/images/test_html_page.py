"""Templates escape what they show once, and insert charts and sections as HTML."""

import base64
from pathlib import Path

import numpy as np
import pytest
from jinja2 import UndefinedError

import flarewright
from flarewright.io.images.html_page import html_page
from flarewright.io.images.png import encode_png
from flarewright.render.plots.svg import Chart, Text

NAME = '<b>&"'
ESCAPED = "&lt;b&gt;&amp;&#34;"
TEMPLATES = Path(flarewright.__file__).parent / "templates"


def shown(**changes):
    values = {
        "title": NAME, "lead": NAME, "left_out": [NAME, NAME], "captures": [(NAME, "1")], "run_remarks": (),
        "overview": (np.zeros((2, 3, 3), np.uint8), NAME), "sections": [], "geometry": [],
    }  # fmt: skip
    return html_page("measured/page", **{**values, **changes})


def test_words_are_escaped_wherever_they_stand():
    page = shown()
    assert "<b>" not in page
    for part in ("<title>{}</title>", "<h1>{}</h1>", "<p>{}</p>", "<td>{}</td>", ">{}</figcaption>", 'alt="{}"'):
        assert part.format(ESCAPED) in page
    # a remark is shown once
    assert page.count(f"<li>{ESCAPED}</li>") == 1


def test_charts_and_sections_are_not_escaped_again():
    chart = Chart(10, 10, NAME, (Text(0.0, 0.0, NAME),))
    tracks = html_page("measured/tracks", charts=[chart], rows=[(NAME,)])
    page = shown(sections=[tracks], geometry=[chart])
    assert page.count("<svg ") == page.count("</svg>") == 2
    assert f"<td>{ESCAPED}</td></tr>\n</table>" in page
    assert "&lt;h2&gt;" not in page
    assert "&amp;lt;" not in page
    assert "<b>" not in page


def test_a_picture_is_in_the_page():
    pixels = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)
    page = shown(overview=(pixels, ""))
    assert f'width="640" src="data:image/png;base64,{base64.b64encode(encode_png(pixels, {})).decode()}"' in page


def test_a_value_that_is_missing_is_no_blank():
    with pytest.raises(UndefinedError, match="charts"):
        html_page("measured/tracks", rows=[])


def test_pages_share_one_frame():
    pages = [path for path in TEMPLATES.rglob("*.html.j2") if "{% block content %}" in path.read_text("utf-8")]
    assert len(pages) > 5
    assert [path.name for path in pages if not path.read_text("utf-8").startswith("{% extends")] == ["base.html.j2"]
