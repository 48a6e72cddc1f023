"""Names, makers and patents of the user's lenses, and their search."""

import math

import pytest

from flarewright.errors import ProjectError
from flarewright.io.lens.own.facts import maker_of, patent_of
from flarewright.io.lens.own.folder import LONGEST_NAME, key_of, spoken, unused_name
from flarewright.io.lens.own.record import LensRecord
from flarewright.io.lens.own.search import Query, matching, parse_range


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Zeiss Planar_50mm F/1,4 (1964)", "zeiss-planar-50mm-f-1.4-1964"),
        ("Voigtländer Heliar", "voigtlander-heliar"),
        ("Weißgerber", "weissgerber"),
        ("../../etc/passwd", "etc-passwd"),
        ("...", "lens"),
        ("COM1", "lens-com1"),
        ("NUL", "lens-nul"),
        ("株式会社", "lens"),
        ("a" * 500, "a" * LONGEST_NAME),
        ("word " * 40, "-".join(["word"] * 12)),
    ],
)
def test_names_can_be_spoken_and_typed(text, name):
    assert spoken(text) == name
    # a name is itself a name
    assert spoken(name) == name
    assert key_of(name) == name


def test_a_taken_name_gets_the_first_free_number():
    assert unused_name("Tessar", {"tessar", "tessar-2", "tessar-4"}) == "tessar-3"
    assert unused_name("Tessar", set()) == "tessar"


@pytest.mark.parametrize(
    ("texts", "maker"),
    [
        (("Summicron 50 mm f/2", "patents/nikon/0012.zmx"), "Leica"),
        (("50 mm f/2", "patents/nikon/0012.zmx"), "Nikon"),
        (("Voigtlander Ultron", ""), "Voigtländer"),
        # the maker's name before a line of lenses that others made as well
        (("Canon Sonnar copy", ""), "Canon"),
        (("Cross-section of a rose", ""), ""),
    ],
)
def test_makers_are_found_by_name_or_line(texts, maker):
    assert maker_of(*texts) == maker


@pytest.mark.parametrize(
    ("text", "patent"),
    [
        ("US Patent No. 2,645,156, example 1", "US 2,645,156"),
        ("patent US001849681; from a .lens table", "US 1,849,681"),
        ("US 2018/0284478 Example 1", "US 2018/0284478"),
        ("US20180284478", "US 2018/0284478"),
        ("U.S. Pat. 2645156", "US 2,645,156"),
        ("JP 1993-034592 Example 2", "JP 1993-034592"),
        ("DE 2 206 106 Example 1", "DE 2 206 106"),
        ("DRP 444150", "DE 444150"),
        ("a 50 mm lens of 1964, f/1.4", ""),
        ("bus 12345678", ""),
    ],
)
def test_patents_are_found_and_written_as_on_paper(text, patent):
    assert patent_of("", text) == patent


@pytest.mark.parametrize(
    ("text", "limits"), [("50", (48.0, 52.0)), ("35-85", (35.0, 85.0)), ("-35", (0.0, 35.0)), ("85-", (85.0, math.inf))]
)
def test_a_range_is_a_number_or_two_ends(text, limits):
    assert parse_range(text, "--focal") == pytest.approx(limits)


@pytest.mark.parametrize("text", ["", "-", "fast", "85-35", "nan", "-5-3", "1-2-3"])
def test_other_texts_are_no_range(text):
    with pytest.raises(ProjectError, match=r"--focal .* is no range"):
        parse_range(text, "--focal")


def test_a_lens_matches_all_that_is_asked():
    zoom = LensRecord(
        "zoom", "Zoom-Nikkor 35-70", maker="Nikon", patent="US 4,231,636", efl_mm=35.0, efl_range_mm=(35.0, 70.0),
        f_number=3.5, surfaces=24,
    )  # fmt: skip
    prime = LensRecord("prime", "Planar", efl_mm=51.6, efl_range_mm=(51.6, 51.6), f_number=1.4, field_deg=23.0)
    both = (zoom, prime)

    def found(**asked):
        return [one.name for one in matching(both, Query(**asked))]

    assert found() == ["zoom", "prime"]
    assert found(words=("ZOOM", "nikkor")) == ["zoom"]
    assert found(words=("4231636",)) == ["zoom"]
    # a zoom has every focal length between its ends
    assert found(focal_mm=(48.0, 52.0)) == ["zoom", "prime"]
    assert found(focal_mm=(80.0, 90.0)) == []
    assert found(patent="4231636", maker="nik") == ["zoom"]
    # an unknown field matches no range
    assert found(field_deg=(0.0, 90.0)) == ["prime"]
    assert found(surfaces=(20, 30), f_number=(3.0, 4.0)) == ["zoom"]
