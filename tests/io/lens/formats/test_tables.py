"""Plain tables: CSV and the lens files of pbrt."""

from __future__ import annotations

import pytest

from flarewright.errors import LensError
from flarewright.model import Stop
from flarewright.optics.lens.paraxial import first_order
from flarewright.render.scene.resolve import open_lens

TABLE = """\
# name = Own triplet
# f_number = 4
# field_deg = 20
surface,radius,thickness,n_d,v_d,glass,semi_diameter,conic,A4
1,25.0,4.0,1.6,60,,8,-0.5,1e-6
2,flat,5.0,,,,8,,
3,-40,1.5,,,SF5,6,,
4,30,2.0,,,,6,,
5,stop,3.0,,,,5,,
6,120,4.0,1.6,60,,7,,
7,-30,60.0,,,,7,,
"""
# made up: a front and a rear lens about the stop
PBRT = """\
# Own pair
30 4 1.6 20
-90 5 1 20
0 5 0 12
90\t4\t1.6\t20
-30 40 1 20
"""


def opened(tmp_path, text, name="lens.csv"):
    path = tmp_path / name
    path.write_text(text)
    return open_lens(path)


def test_a_csv_table(tmp_path):
    lens = opened(tmp_path, TABLE).lens
    assert (lens.name, lens.f_number, lens.field_deg) == ("Own triplet", 4.0, 20.0)
    assert [row.thickness for row in lens.rows] == [4.0, 5.0, 1.5, 2.0, 3.0, 4.0, 60.0]
    assert isinstance(lens.rows[4], Stop)
    first = lens.rows[0]
    assert (first.curvature, first.conic, first.asphere, first.semi_diameter) == (1 / 25.0, -0.5, (1e-6,), 8.0)
    assert lens.rows[1].curvature == 0.0
    assert (first.medium.n_d, first.medium.v_d) == (1.6, 60.0)
    assert lens.rows[2].medium.n_d == pytest.approx(1.6727, abs=1e-4)


def test_semicolons_decimal_commas_and_other_words(tmp_path):
    lens = opened(tmp_path, TABLE).lens
    head, *lines = TABLE.replace("conic,A4", "k,a4").splitlines()[3:]
    other = [*TABLE.splitlines()[:3], head.replace("n_d", "Index").replace("radius", "Radius (mm)").replace(",", ";")]
    other += [line.replace(",", ";").replace(".", ",") for line in lines]
    assert opened(tmp_path, "\n".join(other)).lens == lens
    diameters = TABLE.replace("semi_diameter", "diameter")
    for wide, narrow in ((",8,", ",16,"), (",6,", ",12,"), (",5,", ",10,"), (",7,", ",14,")):
        diameters = diameters.replace(wide, narrow)
    assert opened(tmp_path, diameters).lens == lens


def test_a_table_of_curvatures_marks_its_stop_in_their_column(tmp_path):
    """It was refused: no row is the stop."""
    curvatures = TABLE.replace("radius", "curvature").replace("25.0,4.0", "0.04,4.0").replace("-40,1.5", "-0.025,1.5")
    curvatures = curvatures.replace("30,2.0", f"{1 / 30!r},2.0").replace("120,4.0", f"{1 / 120!r},4.0")
    curvatures = curvatures.replace("-30,60.0", f"{-1 / 30!r},60.0")
    assert opened(tmp_path, curvatures).lens == opened(tmp_path, TABLE).lens


@pytest.mark.parametrize("delimiter", [",", "; "])
def test_the_column_of_numbers_may_be_named_by_a_hash(tmp_path, delimiter):
    """Its header was taken for a comment, and the table refused."""
    # a comment that a spreadsheet filled up with empty cells stays one
    text = TABLE.replace("surface,radius", "# made up,,,,,,,,\n#,,,,,,,,\n#,radius").replace(",", delimiter)
    assert opened(tmp_path, text).lens.rows == opened(tmp_path, TABLE).lens.rows


def test_without_an_f_number_the_stop_gives_it(tmp_path):
    lens = opened(tmp_path, TABLE.replace("# f_number = 4\n", "")).lens
    assert first_order(lens).stop_semi_diameter == pytest.approx(5.0)


def test_a_surface_of_glass_can_be_the_stop(tmp_path):
    text = (
        TABLE.replace("5,stop,3.0,,,,5,,\n", "")
        .replace("conic,A4", "conic,A4,stop")
        .replace(",,8,-0.5,1e-6", ",,8,-0.5,1e-6,yes")
    )
    lens = opened(tmp_path, text).lens
    glasses = [row.medium.n_d for row in lens.rows if not isinstance(row, Stop) and row.medium is not None]
    assert glasses == [1.6, pytest.approx(1.6727, abs=1e-4), 1.6]
    assert sum(isinstance(row, Stop) for row in lens.rows) == 1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("5,stop,3.0,,,,5,,\n", "", "no row is the stop"),
        ("4,30,2.0", "4,stop,2.0", "lines 8, 9 are stops; a lens has exactly one"),
        ("radius,thickness", "size,long", "the first line must name the columns"),
        ("25.0,4.0", "25.0,four", "line 5: thickness is 'four', a number was expected"),
        ("1.6,60,,8", "0.6,60,,8", "line 5: n_d is 0.6"),
        ("1.6,60,,8", ",60,,8", "line 5: an Abbe number alone is no glass"),
        ("SF5", "NOSUCH", "line 7: glass 'NOSUCH' is not in the catalogue"),
        ("f_number = 4", "f_number = four", "f_number is 'four', a number above 0 was expected"),
        ("f_number = 4", "f_number = 4000", "the f-number is 4000: it must lie between"),
        ("25.0,4.0", "1e-5,4.0", "line 5: the radius is 1e-05: less than a micrometre"),
        ("25.0,4.0", "25.0,-4.0", "line 5: glass cannot be -4 mm thick"),
        ("25.0,4.0", "25.0,1e9", "line 5: "),
        ("conic,A4", "conic,conic", "are the same; keep one"),
        ("2,flat,5.0", "2,flat,", "line 6: its thickness is missing"),
    ],
)
def test_faults_of_a_table_name_the_line(tmp_path, old, new, said):
    assert old in TABLE
    with pytest.raises(LensError) as raised:
        opened(tmp_path, TABLE.replace(old, new))
    assert said in " | ".join([str(raised.value), *raised.value.problems])


def test_unknown_columns_are_named(tmp_path):
    remarks = opened(tmp_path, TABLE.replace("conic", "coating")).remarks
    assert any("column 'coating' is left out" in remark for remark in remarks)


def test_a_lens_of_pbrt(tmp_path):
    found = opened(tmp_path, PBRT, "lens.dat")
    lens = found.lens
    assert lens.name == "Own pair"
    assert isinstance(lens.rows[2], Stop)
    assert [row.thickness for row in lens.rows] == [4.0, 5.0, 5.0, 4.0, 40.0]
    assert [row.semi_diameter for row in lens.rows if not isinstance(row, Stop)] == [10.0] * 4
    assert first_order(lens).stop_semi_diameter == pytest.approx(6.0)
    # two equal lenses with a gap, by Gullstrand's formula with principal planes of thick lenses
    n, thick, gap = 1.6, 4.0, 10.0
    p, q = (n - 1) / 30, (n - 1) / 90
    power = p + q - p * q * thick / n
    # from the rear principal plane of the first to the front one of the second
    apart = gap + 2 * (p / power) * thick / n
    assert first_order(lens).efl == pytest.approx(1 / (2 * power - apart * power**2), rel=1e-9)
    assert any("no V_d is given" in remark for remark in found.remarks)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PBRT.replace("-90 5 1 20", "-90 5 1"), "line 3: '-90 5 1' is no row of four numbers"),
        (PBRT.replace("0 5 0 12\n", ""), "no row is the stop"),
        (PBRT.replace("-90 5", "0 5"), "lines 3, 4 are stops"),
        ("# nothing\n", "the table has no rows"),
    ],
)
def test_faults_of_a_pbrt_table(tmp_path, text, said):
    with pytest.raises(LensError, match=said):
        opened(tmp_path, text, "lens.dat")


def test_a_table_without_an_aperture_is_refused_in_the_words_of_its_format(tmp_path):
    text = TABLE.replace("# f_number = 4\n", "").replace("5,stop,3.0,,,,5,,", "5,stop,3.0,,,,,,")
    with pytest.raises(LensError, match=r"is not specified: state # f_number = \.\.\. or the stop's semi-diameter$"):
        opened(tmp_path, text)
