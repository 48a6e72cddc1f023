"""`.zmx` files that once failed or were read with parts dropped in silence: each gets its right value or true cause."""

from __future__ import annotations

import json

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.errors import LensError
from flarewright.optics.lens.paraxial import first_order
from flarewright.render.scene.resolve import load_lens

HEAD = """\
VERS 140124 258 36214
MODE SEQ
NAME Own test lens
UNIT MM X W X CM MR CPMM
FNUM 5.6 0
FTYP 0 0 1 3 0 0 0
XFLN 0
YFLN 12
"""
N_BK7 = "GLAS N-BK7 0 0 1.5 40 0 0 0 0 0 0"
STOP = ("TYPE STANDARD", "CURV 0", "DISZ 80", "DIAM 5", "STOP")
IMAGE = ("TYPE STANDARD", "CURV 0", "DISZ 0")
INDEX = 1.5168


def surface(number, *lines):
    return "\n".join([f"SURF {number}", *(f"  {line}" for line in lines), ""])


FRONT = ("CURV 0.02", "DISZ 6", N_BK7, "DIAM 10")
BACK = ("CURV -0.005", "DISZ 3", "DIAM 10")


def singlet(front=FRONT, back=BACK, head=""):
    """Return a lens of one glass; `front` and `back` are the lines of its surfaces."""
    surfaces = [("TYPE STANDARD", "CURV 0", "DISZ INFINITY"), front, back, STOP, IMAGE]
    return HEAD + head + "".join(surface(k, *lines) for k, lines in enumerate(surfaces))


def doublet(glass):
    """Return a lens with N-BK7 in front of a glass given by its GLAS line."""
    surfaces = [
        ("CURV 0", "DISZ INFINITY"), ("CURV 0.02", "DISZ 6", N_BK7, "DIAM 10"),
        ("CURV -0.025", "DISZ 2", f"GLAS {glass}", "DIAM 10"), ("CURV 0", "DISZ 3", "DIAM 10"), STOP, IMAGE,
    ]  # fmt: skip
    return HEAD + "".join(surface(k, *lines) for k, lines in enumerate(surfaces))


@pytest.fixture
def read(tmp_path):
    def read(text):
        path = tmp_path / "own.zmx"
        path.write_text(text)
        remarks = []
        return load_lens(path, remarks=remarks), " | ".join(remarks)

    return read


def refusal(read, text):
    with pytest.raises(LensError) as raised:
        read(text)
    return str(raised.value)


def thick(c1, c2, t, n):
    """Return the focal length of a thick lens in air (lensmaker's equation)."""
    return 1.0 / ((n - 1.0) * (c1 - c2 + (n - 1.0) * t * c1 * c2 / n))


@pytest.mark.parametrize("v_d", ["3.94", "170.21", "-3.45", "nan"])
def test_a_misprinted_abbe_number_is_unknown(read, v_d):
    lens, remarks = read(doublet(f"___BLANK 1 0 1.62 {v_d} 0 0"))
    assert lens.rows[1].medium.n_d == 1.62
    assert f"surface 2: the glass's V_d is {v_d}" in remarks
    assert "treated as unknown" in remarks


def test_an_impossible_index_is_refused_or_the_name_counts(read):
    message = refusal(read, singlet(front=("CURV 0.02", "DISZ 6", "GLAS XX 0 0 9.9 40", "DIAM 10")))
    assert "surface 1: the glass XX is in no catalogue and has an n_d that is 9.9" in message
    lens, remarks = read(singlet(front=("CURV 0.02", "DISZ 6", "GLAS N-BK7 0 0 9.9 40", "DIAM 10")))
    assert lens.rows[0].medium.n_d == pytest.approx(INDEX, abs=1e-4)
    assert "has an n_d that is 9.9: it must be below 4.5; using that of SCHOTT N-BK7" in remarks


def test_terms_of_an_extended_asphere_count_in_both_places(read):
    lines = ("TYPE XASPHERE", "CURV 0.02", "DISZ 6", N_BK7, "DIAM 10")
    parm = ("PARM 2 -2e-5", "PARM 3 -1e-8")
    xdat = ("XDAT 1 3 0 0", "XDAT 2 1 0 0", "XDAT 3 0", "XDAT 4 -2e-5", "XDAT 5 -1e-8")
    for more in (parm, xdat, (*parm, *xdat)):
        lens, _ = read(singlet(front=(*lines, *more)))
        assert lens.rows[0].asphere == (-2e-5, -1e-8)
    assert "different terms in PARM and in XDAT" in refusal(read, singlet(front=(*lines, "PARM 2 1e-5", *xdat)))
    _, remarks = read(singlet(front=("CURV 0.02", "DISZ 6", N_BK7, "DIAM 10", "PARM 2 -2e-5")))
    assert "surface 1: PARM has no meaning for the type STANDARD; left out" in remarks


def test_every_number_of_a_shape_has_an_effect_or_a_remark(read):
    """An odd asphere used XDAT beside a remark that it had no meaning; others dropped numbers without a word."""

    def lens(kind, *numbers):
        return singlet(front=(f"TYPE {kind}", "CURV 0.02", "DISZ 6", N_BK7, "DIAM 10", *numbers))

    found, remarks = read(lens("ODDASPHE", "PARM 4 1e-5", "XDAT 1 5", "XDAT 2 1", "XDAT 7 1e-4"))
    assert found.rows[0].terms == {4: 1e-5}
    assert "surface 1: XDAT has no meaning for the type ODDASPHE; left out" in remarks
    both = ("PARM 4 1e-5", "XDAT 1 5", "XDAT 2 1", "XDAT 6 2e-5")
    assert "different terms in PARM and in XDAT" in refusal(read, lens("XOSPHERE", *both))
    found, remarks = read(lens("XASPHERE", "XDAT 1 2", "XDAT 2 1", "XDAT 4 -2e-5", "XDAT 5 1e-8"))
    assert found.rows[0].terms == {4: -2e-5}
    assert "surface 1: XDAT 5 lies beyond the number of terms that XDAT 1 states; left out" in remarks
    _, remarks = read(lens("BICONICX", "PARM 1 50", "PARM 3 1e-5"))
    assert "surface 1: PARM 3 is no parameter of BICONICX; left out" in remarks


@pytest.mark.parametrize(("kind", "more"), [("BINARY_2", "XDAT 6 -2e-5"), ("FRESNELS", "PARM 1 0")])
def test_surfaces_that_are_not_supported_are_one_sentence(read, kind, more):
    message = refusal(read, singlet(front=(f"TYPE {kind}", "CURV 0.02", "DISZ 6", N_BK7, "DIAM 10", more)))
    assert f"surface 1 is of type {kind}; known are" in message


@pytest.mark.parametrize(
    ("line", "remark"),
    [
        ("OBDC 3 0", "surface 1: decentred apertures are treated as centred"),
        ("CLAP 2 6 0", "surface 1: annular apertures are treated as open in the middle"),
        ("SQAP 5 5", "surface 1: apertures that are not round are treated as round"),
        ("TILT 3 0", "surface 1: keyword 'TILT' is left out"),
        ("CONC -1", "surface 1: keyword 'CONC' is left out; did you mean 'CONI'?"),
        ("CURV 0.03", "surface 1: CURV is given twice; the first one is used"),
    ],
)
def test_what_the_reader_leaves_out_is_reported(read, line, remark):
    lens, remarks = read(singlet(front=("CURV 0.02", "DISZ 6", N_BK7, "DIAM 10", line)))
    assert remark in remarks
    assert lens.rows[0].curvature == 0.02


def test_a_plain_file_has_no_remark_on_keywords(read):
    _, remarks = read(singlet(front=("CURV 0.02", "DISZ 6", N_BK7, "DIAM 10", "CLAP 0 10 0", "OBDC 0 0")))
    assert "left out" not in remarks
    assert "treated as" not in remarks


@pytest.mark.parametrize(
    ("head", "remark"),
    [
        ("WAVM 1 10.6 1\nPWAV 1\n", "primary wavelength is 10600 nm, not visible"),
        ("WAVL 0.55 0.9\nPWAV 2\n", "primary wavelength is 900 nm, not visible"),
        ("VCYN 0 0.3\n", "vignetting factors (VCYN) are left out"),
        ("ENVD 60 1 1\n", "the indices hold at 60 degrees Celsius"),
        ("XYZW 1\n", "keyword XYZW left out"),
    ],
)
def test_what_the_header_says_is_reported(read, head, remark):
    assert remark in read(singlet(head=head))[1]
    plain = "WAVM 1 0.55 1\nWAVM 2 10.6 1\nPWAV 1\nVCYN 0 0\nENVD 20 1 0\n"
    assert "left out" not in (remarks := read(singlet(head=plain))[1])
    assert "not visible" not in remarks


def test_the_focal_length_at_another_wavelength_is_shown(tmp_path, capsys):
    path = tmp_path / "own.zmx"
    path.write_text(singlet(head="WAVM 1 1.06 1\nPWAV 1\n"))
    assert run(["lens", "show", str(path), "--wavelength", "1060", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    # n of N-BK7 at 1060 nm in SCHOTT's data sheet
    assert data["efl_mm"] == pytest.approx(thick(0.02, -0.005, 6.0, 1.50669), rel=1e-5)
    assert run(["lens", "show", str(path), "--wavelength", "nan"]) == 2
    assert "is not between 100 and 20000 nm" in capsys.readouterr().err
    assert run(["lens", "show", str(path), "--wavelength", "10600"]) == 2


def test_an_infinite_gap_inside_the_lens_is_refused(read):
    message = refusal(read, singlet(back=("CURV -0.005", "DISZ INFINITY", "DIAM 10")))
    assert "surface 2: the gap to the next surface is infinite" in message


def test_media_at_the_ends_are_refused(read):
    water = "GLAS ___BLANK 1 0 1.333 55.8"
    text = singlet().replace("DISZ INFINITY", f"DISZ INFINITY\n  {water}", 1)
    assert "the lens stands in a medium (n_d = 1.333)" in refusal(read, text)
    text = singlet(back=("CURV -0.005", "DISZ 83", "DIAM 10", water)).replace("DISZ 80", f"DISZ 80\n  {water}")
    assert "inside glass" in refusal(read, text)


def test_the_stated_catalogue_comes_first_and_numbers_win_over_the_name(read):
    # n_d of F5 in the makers' data sheets
    schott, cdgm = 1.60342, 1.62435
    plain = "F5 0 0 1.5 40 0 0 0 0 0 0"
    lens, remarks = read(doublet(plain))
    assert lens.rows[1].medium.n_d == pytest.approx(schott, abs=1e-5)
    lens, remarks = read(doublet(plain).replace("FTYP", "GCAT CDGM\nFTYP"))
    assert lens.rows[1].medium.n_d == pytest.approx(cdgm, abs=1e-5)
    assert "surface 1: glass N-BK7 is not in the catalogues that the file states (CDGM); using SCHOTT N-BK7" in remarks
    lens, remarks = read(doublet("F5 0 0 1.6062 38.0"))
    assert lens.rows[1].medium.n_d == 1.6062
    assert "F5 is stated with n_d = 1.6062, V_d = 38, but" in remarks
    assert "the stated numbers take precedence" in remarks
    lens, remarks = read(doublet("F5 0 0 1.6050 38.0"))
    assert lens.rows[1].medium.n_d == pytest.approx(schott, abs=1e-5)
    assert "precedence" not in remarks


def test_decimal_commas_are_points(read):
    lens, remarks = read(singlet(front=("CURV 0,02", "DISZ 6,5", "GLAS ___BLANK 1 0 1,5168 64,2", "DIAM 10")))
    assert lens.rows[0].thickness == 6.5
    assert first_order(lens).efl == pytest.approx(thick(0.02, -0.005, 6.5, 1.5168), rel=1e-9)
    assert "4 numbers with a decimal comma, read as a decimal point" in remarks
    assert "comma" not in read(singlet(head="NOTE 0 1,5 of 2,5\n"))[1]


@pytest.mark.parametrize("glass", ["___BLANK 1 0 1.00000 0.00 0 0", "AIR", "VACUUM"])
def test_air_may_have_a_line(read, glass):
    lens, _ = read(singlet(back=("CURV -0.005", "DISZ 3", "DIAM 10", f"GLAS {glass}")))
    assert lens.rows[1].medium is None
    assert first_order(lens).efl == pytest.approx(thick(0.02, -0.005, 6.0, INDEX), rel=1e-4)


def test_a_misprinted_rim_is_estimated(read):
    lens, remarks = read(singlet(front=("CURV 0.02", "DISZ 6", N_BK7, "DIAM 500000")))
    assert "surface 1: a rim of 500000 mm is no lens's; left out and estimated" in remarks
    assert np.isfinite(lens.rows[0].semi_diameter)
    assert lens.rows[0].semi_diameter < 50.0


def test_fields_that_are_not_used_are_reported(read):
    assert (
        "fields are heights of the object; the field of view is left out"
        in read(singlet().replace("FTYP 0", "FTYP 1"))[1]
    )
    assert "fields are 95 degrees" in read(singlet().replace("YFLN 12", "YFLN 95"))[1]


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("DIAM 10", "DIAM 10\n  PARM 9999999999999999999999 1", "'PARM 9999999999999999999999 1' is not understood"),
        ("MODE SEQ", f"MODE {'X' * 3000}", "MODE XXXX"),
        ("UNIT MM", f"UNIT {'X' * 3000}", "UNIT XXXX"),
        ("CURV 0.02", f"TYPE {'X' * 3000}\n  CURV 0.02", "is of type XXXX"),
        ("DISZ 6", f"DISZ {'y' * 3000}", "a number was expected"),
    ],
)
def test_broken_words_are_one_short_sentence(read, before, after, words):
    message = refusal(read, singlet().replace(before, after, 1))
    assert words in message
    assert len(message) < 400


@pytest.mark.parametrize(
    ("number", "said"), [("1", "is numbered '1'"), ("7", "is numbered '7'"), ("", "is not numbered")]
)
def test_a_surface_with_another_number_is_reported(read, number, said):
    """Pickups and configurations refer to surfaces by number, so the order of the file may not be the right one."""
    lens, remarks = read(singlet().replace("SURF 2", f"SURF {number}"))
    assert first_order(lens).efl == first_order(read(singlet())[0]).efl
    assert f"surface 2 {said} in the file; surfaces are counted in their order, from 0" in remarks
    assert "numbered" not in read(singlet())[1]


def test_a_mode_without_a_word_is_the_usual_one(read):
    assert first_order(read(singlet().replace("MODE SEQ", "MODE"))[0]).efl > 0.0


def test_a_batch_goes_on_after_each_file(tmp_path, capsys):
    texts = {
        "vd": doublet("___BLANK 1 0 1.62 3.94"), "index": doublet("XX 0 0 9.9 40"), "rim": singlet(),
        "junk": "\x00\x01", "deep": "SURF 0\n" * 5000, "empty": "", "last": singlet(),
    }  # fmt: skip
    for name, text in texts.items():
        (tmp_path / f"{name}.zmx").write_text(text)
    assert run(["lens", "check", "--json", *(str(tmp_path / f"{name}.zmx") for name in texts)]) == 2
    results = json.loads(capsys.readouterr().out)["files"]
    assert [one["usable"] for one in results] == [True, False, True, False, False, False, True]
    assert all(len(one["reason"]) < 300 for one in results if not one["usable"])
