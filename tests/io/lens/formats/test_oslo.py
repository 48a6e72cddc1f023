"""Lens files of OSLO: the numbers of the file, or an error with the reason."""

from __future__ import annotations

import pytest

from flarewright.errors import LensError
from flarewright.model import Stop
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.zoom import positioned
from flarewright.render.scene.resolve import open_lens

DOUBLET = """\
// OSLO 6.6 58447     0     0
LEN NEW "Achromat; 100 mm // made up for a test" 100 5
EBR 12.5
ANG 5.0
DES "OSLO"
UNI 1.0
SNO1 "a note with GLA and ; in it"
// SRF 0
AIR
TH   1.0e+20
AP   1.0e+19
NXT  // SRF 1
AST
GLA  BK7
RD   61.47
TH   6.0
AP CHK 12.5
NXT  // SRF 2
WV 0.58756 0.48613 0.65627
GLA MOD FLINT 1.673 1.6877 1.6666
RD   -44.64
TH   2.5
NXT  // SRF 3
AIR
RD   -129.94
PY   0.0
AP   12.6
NXT  // SRF 4
PK TH -4
AIR
NXT  // SRF 5
AIR
WV 0.58756 0.48613 0.65627
WW 1.0 1.0 1.0
END  5
CFG NEW
TH 1 2 8
END
"""


def opened(tmp_path, text):
    path = tmp_path / "lens.len"
    path.write_text(text)
    return open_lens(path)


def paraxial(surfaces):
    """Return the focal length of (curvature, thickness, index behind), from a ray parallel to the axis."""
    h, slope, before = 1.0, 0.0, 1.0
    for curvature, thickness, after in surfaces:
        slope = (before * slope - (after - before) * curvature * h) / after
        h, before = h + slope * thickness, after
    return -1.0 / slope


def changed(old, new):
    assert old in DOUBLET
    return DOUBLET.replace(old, new, 1)


DOUBLET = DOUBLET.replace("NXT  // SRF 4\nPK TH -4\nAIR\nNXT  // SRF 5", "NXT  // SRF 4").replace("100 5", "100 4")
DOUBLET = DOUBLET.replace("END  5", "END  4")


def test_radii_glasses_opening_and_field(tmp_path):
    found = opened(tmp_path, DOUBLET)
    lens = found.lens
    assert lens.name == "Achromat; 100 mm // made up for a test"
    assert [row.thickness for row in lens.rows] == [0.0, 6.0, 2.5, 0.0]
    assert isinstance(lens.rows[0], Stop)
    crown, flint = lens.rows[1].medium, lens.rows[2].medium
    assert crown.n_d == pytest.approx(1.5168, abs=1e-4)
    assert (flint.n_d, flint.v_d) == pytest.approx((1.673, 0.673 / (1.6877 - 1.6666)), rel=1e-4)
    assert [row.semi_diameter for row in lens.rows[1:4:2]] == [12.5, 12.6]
    assert lens.field_deg == 5.0
    efl = paraxial([(1 / 61.47, 6.0, crown.n_d), (-1 / 44.64, 2.5, flint.n_d), (-1 / 129.94, 0.0, 1.0)])
    order = first_order(lens)
    assert order.efl == pytest.approx(efl, rel=1e-9)
    assert order.entrance_pupil_diameter == pytest.approx(25.0)
    assert "the last gap is solved in the file; the sensor is placed at the paraxial focus" in found.remarks
    assert not any("paraxial focus (" in remark for remark in found.remarks)
    assert "configuration 2 is left out: the glass behind row 1 has another thickness" in found.remarks


def test_the_listing_of_the_users_guide_has_its_focal_length(tmp_path):
    text = """\
// OSLO 5.00 31567 0 0
LEN NEW "He-ne f/2 doublet focusing lens" 60 5
EBR 15.0
ANG 0.0000572957795
UNI 1.0
AIR; TH 1.0e+20; AP 9.9999999977e+13; NXT
GLA LASF35; RD 100.0; TH 5.0; NXT
AIR; TH 1.0; NXT
PK GLA -2; RD 50.0; TH 5.0; NXT
AIR; PU -0.25; PY 0.0; NXT
AIR; CALLBACK 1; WV 0.6328; WW 1.0; END 5
"""
    with pytest.raises(LensError, match=r"surface 4: its curvature is solved, not stated"):
        opened(tmp_path, text)
    # the solve makes a beam of 15 mm converge with a slope of -0.25: a focal length of 60 mm
    glass = opened(tmp_path, text.replace("PU -0.25", "RD 500")).lens.rows[1].medium
    assert (glass.glass, glass.n_d) == ("LASF35", pytest.approx(2.02204, abs=1e-4))
    front = [(1 / 100.0, 5.0, glass.n_d), (0.0, 1.0, 1.0), (1 / 50.0, 5.0, glass.n_d)]
    low, high = (1.0 / paraxial([*front, (curvature, 0.0, 1.0)]) for curvature in (0.0, 0.01))
    # the power is linear in the last curvature
    curvature = 0.01 * (low - 1.0 / 60.0) / (low - high)
    lens = opened(tmp_path, text.replace("PU -0.25", f"CV {curvature!r}")).lens
    assert lens.rows[-2].medium == glass
    assert first_order(lens).efl == pytest.approx(60.0, rel=1e-6)
    # a field on the axis states none
    assert lens.field_deg is None


@pytest.mark.parametrize(
    ("command", "curvature", "conic", "terms"),
    [
        ("CC -0.5; AD 1e-6; AF -2e-11", 1 / 61.47, -0.5, (1e-6, 0.0, -2e-11)),
        ("ASP ASR 4; AS2 1e-6; AS3 1e-9", 1 / 61.47, 0.0, (1e-6, 1e-9)),
        ("RD 0; ASP 1; AS1 0.01; AS2 1e-6", 0.02, -1.0, (1e-6,)),
        ("CV 0.01; DCX 0; TLA 0.0", 0.01, 0.0, ()),
    ],
)
def test_shapes(tmp_path, command, curvature, conic, terms):
    row = opened(tmp_path, changed("RD   61.47", f"RD 61.47; {command}")).lens.rows[1]
    assert (row.curvature, row.conic) == pytest.approx((curvature, conic))
    assert row.asphere == pytest.approx(terms)


def test_units_scale_lengths_and_terms(tmp_path):
    text = changed("RD   61.47", "RD 61.47; AD 1e-6; AE 1e-9")
    mm, inches = (opened(tmp_path, text.replace("UNI 1.0", unit)) for unit in ("UNI 1.0", "UNI 25.4"))
    one, other = mm.lens.rows[1], inches.lens.rows[1]
    assert other.curvature == pytest.approx(one.curvature / 25.4)
    assert other.thickness == pytest.approx(one.thickness * 25.4)
    # the sag scales with the lens
    r = 10.0
    sag = one.asphere[0] * r**4 + one.asphere[1] * r**6
    scaled = other.asphere[0] * (25.4 * r) ** 4 + other.asphere[1] * (25.4 * r) ** 6
    assert scaled == pytest.approx(25.4 * sag)
    assert first_order(inches.lens).efl == pytest.approx(25.4 * first_order(mm.lens).efl)
    assert "lengths are in units of 25.4 mm; converted to mm" in inches.remarks


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("RD   61.47", "RD 61.47; RFL", "surface 1 is a mirror, which is not supported"),
        ("RD   61.47", "RD 61.47; TLA 3", "surface 1: TLA tilts, shifts or shapes it"),
        ("RD   61.47", "PFL 100", "surface 1 has PFL, which is not supported"),
        ("RD   61.47", "RD wide", "surface 1: RD is 'wide', a number was expected"),
        ("RD   61.47", "RD 61.47; AS2 1e-6", "surface 1 is an asphere of the kind ADO"),
        ("RD   61.47", "RD 61.47; ASP ARA; AS1 1e-3", "surface 1 is an asphere of the kind ARA"),
        ("RD   61.47", "RD 61.47; ASP ASR; AS1 1e-3", "surface 1 has a term of r^2 beside its curvature"),
        ("RD   61.47", "RD 61.47; ASP ASR; AS0 1e-3", "surface 1: AS0 is a shift along the axis"),
        ("TH   6.0", "PY 0", "surface 1: its thickness is solved, not stated"),
        ("TH   6.0", "TH -6", "surface 1: glass cannot be -6 mm thick"),
        ("TH   6.0", "TH 1e20", "the gap to the next surface is infinite"),
        ("TH   6.0", "PK LN 1 2", "surface 1: the pickup 'LN 1 2' is not supported"),
        ("GLA  BK7", "GLA UNOBTAINIUM", "surface 1: "),
        ("GLA  BK7", "GLA MOD OWN dense", "has no indices"),
        ("UNI 1.0", "UNI 0", "UNI is 0: the number of millimetres of a unit was expected"),
        ("END  4\nCFG NEW\nTH 1 2 8\nEND\n", "", "LEN states 4: the file is cut short or damaged"),
        ("100 4", "100 7", "it has surfaces up to 4, and LEN states 7"),
        ("LEN NEW", "// LEN NEW", "is it an OSLO .len file?"),
        ("AIR\nTH   1.0e+20", "GLA BK7\nTH   1.0e+20", "the lens stands in a medium"),
    ],
)
def test_what_is_not_supported_is_refused(tmp_path, old, new, sentence):
    with pytest.raises(LensError) as raised:
        opened(tmp_path, changed(old, new))
    assert any(sentence in problem for problem in (str(raised.value), *raised.value.problems))


def test_unknown_commands_are_named(tmp_path):
    found = opened(tmp_path, changed("RD   61.47", "RD 61.47; XYZ 3"))
    assert "surface 1: command 'XYZ' is left out" in found.remarks


ZOOM = """\
LEN NEW "Two lenses" 50 7
EBR 4.0
ANG 8.0
TH 1e20
NXT; GLA 1.6; RD 80; TH 4; AP 15
NXT; AIR; RD -80; TH 20; AP 15
NXT; AST; TH 1; AP 6
NXT; GLA 1.6; RD 60; TH 4; AP 15
NXT; AIR; RD -60; TH 30; AP 15
NXT; TH 0.5
NXT
END 7
CFG NEW
TH 2 2 26.5
TH 2 3 12
EBR 2 3.0
ANG 3 10
CFWT 2 0.5
WW1 2 0.3
END
"""


def test_configurations_are_positions(tmp_path):
    found = opened(tmp_path, ZOOM)
    lens = found.lens
    assert [position.gaps for position in lens.positions] == [((1, 20.0),), ((1, 26.5),), ((1, 12.0),)]
    for position, gap in zip(lens.positions, (20.0, 26.5, 12.0), strict=True):
        glass = [(1 / 80, 4.0, 1.6), (-1 / 80, gap + 1.0, 1.0), (1 / 60, 4.0, 1.6), (-1 / 60, 0.0, 1.0)]
        order = first_order(positioned(lens, position.name, None))
        assert order.efl == pytest.approx(paraxial(glass), rel=1e-9)
        # EBR is half the entrance pupil
        pupil = 6.0 if gap == 26.5 else 8.0
        assert order.entrance_pupil_diameter == pytest.approx(pupil, rel=1e-9)
    assert [position.field_deg for position in lens.positions] == [None, None, 10.0]


def test_a_gap_that_is_picked_up_moves_with_its_source(tmp_path):
    text = ZOOM.replace("NXT; AST; TH 1;", "NXT; AST; PK TH 2;")
    lens = opened(tmp_path, text).lens
    assert [position.gaps for position in lens.positions] == [
        ((1, 20.0), (2, 20.0)), ((1, 26.5), (2, 26.5)), ((1, 12.0), (2, 12.0))
    ]  # fmt: skip
    both = opened(tmp_path, text.replace("CFWT 2 0.5", "TH 3 2 5"))
    assert both.lens.positions == ()
    assert any("TH changes surface 3, whose gap is a pickup" in said for said in both.remarks)


@pytest.mark.parametrize(
    ("row", "remark"),
    [
        ("CV 1 3 0.02", "configuration 3 differs in CV 1, which no position of a lens can hold"),
        ("GLA 1 3 BK7", "configuration 3 differs in GLA 1, which no position"),
        ("DCY 4 3 1.0", "configuration 3 differs in DCY 4, which no position"),
        ("AP 1 3 9", "surface 1: the rim differs between the file's configurations"),
        ("TH 2 3", "the configurations (CFG) are left out: 'TH 2 3' is not understood"),
        ("TH 12 3 4", "the configurations (CFG) are left out: 'TH 12 3 4' is not understood"),
        ("TH 2.5 3 4", "the configurations (CFG) are left out: 'TH 2.5 3 4' is not understood"),
        ("TH 2 3 dense", "configuration 3: TH 2 is 'dense', no number; it is left out"),
        ("TH 3 500 4", "the configurations (CFG) are left out: 'TH 3 500 4' is not understood"),
    ],
)
def test_what_no_position_holds_is_told(tmp_path, row, remark):
    remarks = opened(tmp_path, ZOOM.replace("CFWT 2 0.5", row)).remarks
    assert any(remark in said for said in remarks), remarks
