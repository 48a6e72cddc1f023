"""Sequence files of CODE V: the numbers of the file, or an error with the reason."""

from __future__ import annotations

import math
import re

import pytest

from flarewright.cli.app import run
from flarewright.errors import LensError
from flarewright.model import Stop
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.zoom import positioned
from flarewright.render.scene.resolve import open_lens

DOUBLET = """\
RDM;LEN       "VERSION: 11.2       made up for a test"
TITLE 'Achromat; 100 mm' ! a comment
EPD   25.0
DIM   M
WL    656.3 587.6 486.1
REF   2
XAN   0.0 0.0
YAN   0.0 5.0
VUY   0.0 0.2
SO    0.0 0.1e14
S     61.47 6.0 NBK7_SCHOTT
  CCY 0; THC 0
  STO
  CIR 12.5
  CIR EDG 12.7
S     -44.64 2.5&
  673.322
S     -129.94 95.952
  CIR 12.5
  PIM
SI    0.0 0.0
GO
"""


def opened(tmp_path, text, **more):
    path = tmp_path / "lens.seq"
    path.write_text(text)
    return open_lens(path, **more)


def paraxial(surfaces):
    """Return the focal length of (curvature, thickness, index behind), from a ray parallel to the axis."""
    h, slope, before = 1.0, 0.0, 1.0
    for curvature, thickness, after in surfaces:
        slope = (before * slope - (after - before) * curvature * h) / after
        h, before = h + slope * thickness, after
    return -1.0 / slope


def test_radii_glasses_opening_and_field(tmp_path):
    found = opened(tmp_path, DOUBLET)
    lens = found.lens
    assert lens.name == "Achromat; 100 mm"
    assert [row.thickness for row in lens.rows] == [0.0, 6.0, 2.5, 95.952]
    assert isinstance(lens.rows[0], Stop)
    assert lens.rows[1].semi_diameter == 12.5
    assert (lens.rows[2].medium.n_d, lens.rows[2].medium.v_d) == (1.673, 32.2)
    order = first_order(lens)
    surfaces = [(1 / 61.47, 6.0, 1.5168), (-1 / 44.64, 2.5, 1.673), (-1 / 129.94, 0.0, 1.0)]
    assert order.efl == pytest.approx(paraxial(surfaces), rel=1e-5)
    assert order.entrance_pupil_diameter == pytest.approx(25.0)
    assert lens.field_deg == 5.0
    said = " | ".join(found.remarks)
    assert "vignetting factors" in said
    assert "left out" not in said.replace("vignetting factors (VUX to VLY) are left out", "")


def test_curvatures_and_radii_are_one_lens(tmp_path):
    text = DOUBLET.replace("RDM;", "RDM N;")
    for radius in ("61.47", "-44.64", "-129.94"):
        text = text.replace(f"S     {radius} ", f"S     {1 / float(radius)!r} ")
    lens = opened(tmp_path, text).lens
    assert [row.curvature for row in lens.rows[1:]] == pytest.approx([1 / 61.47, -1 / 44.64, -1 / 129.94], rel=1e-15)
    silent = text.replace("RDM N;", "")
    # commands such as render have no such option: the sentence names one that has it
    with pytest.raises(LensError, match=r"no RDM, so the first .* flarewright lens convert --first-column"):
        opened(tmp_path, silent)
    assert opened(tmp_path, silent, first_column="curvatures").lens.rows == lens.rows
    # what the file states takes precedence
    assert opened(tmp_path, text, first_column="radii").lens.rows == lens.rows


def test_aspheres_inches_and_private_glasses(tmp_path):
    # a Cauchy glass: n = 1.5 + 0.0042 um^2 / wavelength^2
    lines = [404.7, 486.1327, 587.5618, 656.2725, 800.0]
    indices = [1.5 + 4200.0 / nm**2 for nm in lines]
    text = f"""\
rdm y
dim i
fno 4
yim 0 0.2
prv
  pwl {" ".join(map(str, lines))}
  'own' {" ".join(map(repr, indices))}
end
so 0 1e20
s 1.0 0.2 'own'
  asp
  k -0.5; a -0.015; b 0.003; j 1e-4
s -2.0 0.1
s 0 1.0
sto
si 0 0
"""
    found = opened(tmp_path, text)
    row = found.lens.rows[0]
    assert (row.thickness, row.conic) == (pytest.approx(5.08), -0.5)
    assert row.asphere[0] == pytest.approx(-0.015 / 25.4**3)
    assert row.asphere[1] == pytest.approx(0.003 / 25.4**5)
    assert row.asphere[8] == pytest.approx(1e-4 / 25.4**19)
    n_d, n_f, n_c = indices[2], indices[1], indices[3]
    assert row.medium.n_d == pytest.approx(n_d, abs=1e-9)
    assert row.medium.v_d == pytest.approx((n_d - 1) / (n_f - n_c), rel=1e-9)
    efl = first_order(found.lens).efl
    assert found.lens.field_deg == pytest.approx(math.degrees(math.atan(0.2 * 25.4 / efl)), rel=1e-9)
    assert "lengths are in inches; converted to mm" in found.remarks


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("S     -129.94 95.952", "S     -129.94 95.952 REFL", "surface 3 is a mirror"),
        ("  PIM\n", "  ADE 5.0\n", "surface 3: ADE tilts, shifts or shapes it"),
        ("  PIM\n", "  DIF DOE\n", "surface 3: DIF tilts, shifts or shapes it"),
        ("NBK7_SCHOTT", "NOSUCH_SCHOTT", "surface 1: glass 'SCHOTT NOSUCH'"),
        ("61.47 6.0", "61.47 six", "surface 1: '61.47 six' is no radius and thickness"),
        ("DIM   M", "DIM   F", "DIM F is unknown"),
        ("  CIR 12.5\n  PIM", "  CIR wide\n  PIM", "surface 3: CIR is 'wide', a length was expected"),
        ("  STO\n", "  STO S9\n", "names a surface that does not exist"),
        ("  CIR EDG 12.7\n", "  CIR S9 12.7\n", "names a surface that does not exist"),
        ("  PIM\n", "  THI S1 7.0\n", "surface 1: THI changes it; give radius, thickness and glass in its line S"),
        ("  PIM\n", "  RMD REFL\n", "surface 3: RMD changes it"),
        ("S     -44.64 2.5&\n  673.322\nS     -129.94 95.952\n", "", "surfaces of object, lens and image"),
    ],
)
def test_what_is_not_supported_is_one_sentence(tmp_path, old, new, said):
    assert old in DOUBLET
    with pytest.raises(LensError) as raised:
        opened(tmp_path, DOUBLET.replace(old, new, 1))
    assert said in " | ".join([str(raised.value), *raised.value.problems])


def test_words_can_be_in_lower_case(tmp_path):
    small = opened(tmp_path, re.sub(r"\b(?!NBK7|673)[A-Z]+\b", lambda word: word[0].lower(), DOUBLET))
    assert small.lens.rows == opened(tmp_path, DOUBLET).lens.rows


def test_a_file_of_one_mirror_is_called_one(tmp_path):
    text = "len\ntit 'f/8, 200mm paraboloid'\ndim m\nrdm y\nso 0. 1e+11\ns -400 -200 refl\ncon\nk -1\nsi 0 0\nfno 8.0\n"
    with pytest.raises(LensError, match="surface 1 is a mirror: reflecting surfaces are not supported"):
        opened(tmp_path, text)


def test_a_command_can_name_its_surface(tmp_path):
    lens = opened(tmp_path, DOUBLET.replace("  PIM\n", "  CIR S2 11.0\n", 1)).lens
    plain = opened(tmp_path, DOUBLET).lens
    rims = [[row.semi_diameter for row in each.rows if not isinstance(row, Stop)] for each in (lens, plain)]
    assert rims[0][1] == 11.0
    assert rims[0][2] == rims[1][2] == 12.5


def test_idle_shifts_and_unknown_commands(tmp_path):
    found = opened(tmp_path, DOUBLET.replace("  PIM\n", "  XDE 0.0\n  QQQ 3\n"))
    assert any("surface 3: command 'QQQ' is left out" in remark for remark in found.remarks)
    no_stop = opened(tmp_path, DOUBLET.replace("  STO\n", ""))
    assert any("no STO; the stop is surface 1" in remark for remark in no_stop.remarks)


def test_the_flag_of_the_command_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.seq").write_text(DOUBLET.replace("RDM;", ""))
    assert run(["lens", "check", "a.seq"]) == 2
    assert "--first-column" in capsys.readouterr().err
    assert run(["lens", "check", "a.seq", "--first-column", "radii"]) == 0
    assert run(["lens", "convert", "a.seq", "b.toml", "--first-column", "radii"]) == 0
    assert run(["lens", "check", "b.toml", "--first-column", "radii"]) == 2
    assert "is no .seq file" in capsys.readouterr().err
    assert run(["lens", "check", "a.seq", "--first-column", "x"]) == 2


ZOOM = """\
RDM;LEN "VERSION: 2026"
TITLE 'Two lenses'
FNO 5.6
DIM M
WL 656.3 587.6 486.1
REF 2
YAN 0.0 8.0
SO 0.0 0.1e14
S 80 4 600.400
CIR 15
S -80 20
CIR 15
S 0 1
STO
CIR 6
S 60 4 600.400
CIR 15
S -60 30
CIR 15
PIM
SI 0 0
ZOO 3
ZOO TIT
TIT Z1 "wide"
TIT Z2 "normal"
ZOO FNO 5.6 6.0 4.5
ZOO YAN F2 8.0 7.0 &
 10.0
ZOO THI S2 20 26.5 12
ZOO THC S2 100 100 100
ZOO VUY F2 0.1 0.2 0.3
GO
"""


def test_zoom_positions(tmp_path):
    lens = opened(tmp_path, ZOOM).lens
    assert [position.gaps for position in lens.positions] == [((1, 20.0),), ((1, 26.5),), ((1, 12.0),)]
    for position, gap, f_number in zip(lens.positions, (20.0, 26.5, 12.0), (5.6, 6.0, 4.5), strict=True):
        glass = [(1 / 80, 4.0, 1.6), (-1 / 80, gap + 1.0, 1.0), (1 / 60, 4.0, 1.6), (-1 / 60, 0.0, 1.0)]
        at = positioned(lens, position.name, None)
        efl = paraxial(glass)
        assert first_order(at).efl == pytest.approx(efl, rel=1e-9)
        assert first_order(at).entrance_pupil_diameter == pytest.approx(efl / f_number, rel=1e-9)
    assert [position.field_deg for position in lens.positions] == [None, 7.0, 10.0]
    # one value a command is the same
    single = ZOOM.replace("ZOO THI S2 20 26.5 12", "ZOO THI S2\nTHI S2 Z1 20;THI S2 Z2 26.5;THI S2 Z3 12")
    assert opened(tmp_path, single).lens == lens


def test_a_near_object_of_a_zoom_position_is_a_focus_distance(tmp_path):
    head, tail = ZOOM[: ZOOM.index("ZOO 3")].replace("FNO 5.6", "EPD 6"), "GO\n"
    table = "ZOO 2; ZOO THI SO 1e13 500; ZOO THI S2 20 22; ZOO EPD 6 5\n"
    lens = opened(tmp_path, head + table + tail).lens
    assert [(each.name, each.focus_distance) for each in lens.positions] == [("infinity", None), ("at 500 mm", 500.0)]
    near = positioned(lens, None, 500.0)
    assert near.rows[1].thickness == 22.0
    pupils = [first_order(positioned(lens, each.name, None)).entrance_pupil_diameter for each in lens.positions]
    assert pupils == pytest.approx([6.0, 5.0], rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "remark"),
    [
        ("ZOO TIT", "ZOO RDY S1 80 80 90", "configuration 3 differs in RDY 1, which no position of a lens can hold"),
        ("ZOO TIT", "ZOO GLA S1 600.400 600.400 NBK7", "configuration 3 differs in GLA 1, which no position"),
        ("ZOO TIT", "ZOO YDE S4 0 0 1", "configuration 3 differs in YDE 4, which no position"),
        ("ZOO TIT", "ZOO CIR S1 15 15 9", "surface 1: the rim differs between the file's configurations"),
        ("ZOO TIT", "ZOO THI S9 1 2 3", "are left out: 'ZOO THI S9' names no surface or field of the file"),
        ("ZOO TIT", "ZOO THI S'G1' 1 2 3", "names no surface or field of the file"),
        ("ZOO TIT", "ZOO THI S3 1 2", "configuration 3 is left out: ZOO THI 3 has no value for it"),
        ("ZOO 3", "ZOO 2", "left out: ZOO 2 states fewer positions than a row has values"),
        ("ZOO 3", "ZOO 3000", "left out: ZOO 3000 is no number of positions"),
        ("26.5 12", "26.5 x", "configuration 3: THI 2 is 'x', no number; it is left out"),
        ("PIM", "PIM\nPIK THI S3 THI S2", "PIK sets the gap behind surface 3: write its values as ZOO THI S3"),
        ("SI 0 0", "SI 0 0\nTHI S3 OAL S2..4 25", "OAL sets the gap behind surface 3: write its values"),
        ("ZOO TIT", "THI S2 Z2", "'THI S2 Z2' is not understood"),
    ],
)
def test_what_no_zoom_position_holds_is_told(tmp_path, old, new, remark):
    assert old in ZOOM
    remarks = opened(tmp_path, ZOOM.replace(old, new)).remarks
    assert any(remark in said for said in remarks), remarks


def test_one_zoom_position_is_no_position(tmp_path):
    text = ZOOM[: ZOOM.index("ZOO 3")] + "ZOO 1\nGO\n"
    found = opened(tmp_path, text)
    assert found.lens.positions == ()
    assert not any("ZOO" in said or "position" in said for said in found.remarks)


@pytest.mark.parametrize("code", ["003283", "003.283", "003300.283000"])
def test_a_code_of_glass_denser_than_two(tmp_path, code):
    """A code holds the decimals of the index; 003 used to be read as 1.003."""
    medium = opened(tmp_path, DOUBLET.replace("673.322", code)).lens.rows[2].medium
    assert medium.n_d == pytest.approx(2.003, abs=4e-4)
    assert medium.v_d == pytest.approx(28.3, abs=0.05)
