"""The `.zmx` importer: correct lenses, or an error with the reason."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from flarewright.cli.command_tree import command_tree
from flarewright.errors import LensError
from flarewright.io.lens.foreign_file import decoded
from flarewright.io.lens.lens_writer import write_lens
from flarewright.io.lens.toml_lens import read_lens
from flarewright.model import Stop, Surface
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.surface_shape import sag
from flarewright.optics.lens.zoom import positioned
from flarewright.render.scene.resolve import load_lens
from flarewright.workflow.lens_export import export_lens

HEAD = """\
VERS 140124 258 36214
MODE SEQ
NAME {name}
NOTE 0 made up for a test
UNIT {unit} X W X CM MR CPMM
{opening}
FTYP 0 0 2 3 0 0 0
XFLN 0 0 0 0
YFLN 0 {field} 0 0
WAVM 1 0.5876 1
SURF 0
  TYPE STANDARD
  CURV 0.0 0 0 0 0 ""
  DISZ INFINITY
  DIAM 0 0 0 0 1 ""
"""


def surface(number, curvature=0.0, gap=0.0, glass="", rim="5 1", kind="STANDARD", more=()):
    lines = [f"SURF {number}", *(["  STOP"] if "STOP" in more else []), f"  TYPE {kind}"]
    lines += [
        f'  CURV {curvature:.17E} 0 0 0 0 ""',
        *(f"  {line}" for line in more if line != "STOP"),
        f"  DISZ {gap!r}",
    ]
    if glass:
        lines.append(f"  GLAS {glass}")
    return "\n".join([*lines, f'  DIAM {rim} 0 0 1 ""', ""])


def text_of(*surfaces, name="Two lenses", unit="MM", opening="FNUM 4 0", field=10.0, tail="MNUM 1 1\n"):
    head = HEAD.format(name=name, unit=unit, opening=opening, field=field)
    return head + "".join(surfaces) + tail


def doublet(gap=96.5, **more):
    """Return a lens of two glasses with an iris between them."""
    return text_of(
        surface(1, 1 / 61.47, 6.0, "N-BK7 0 0 1.5 4.0E+1 0 0 0 0 0 0", "12.5 1"),
        surface(2, -1 / 44.64, 2.5, "SF5 0 0 1.5 4.0E+1 0 0 0 0 0 0", "12.5 1"),
        surface(3, -1 / 129.94, 3.0, rim="12.5 1"),
        surface(4, 0.0, 2.0, rim="9 0", more=["STOP"]),
        surface(5, 0.0, 1.5, "___BLANK 1 0 1.6 40.0 0 0 0 0 0 0", "12.5 0"),
        surface(6, 0.0, gap, rim="12.5 0"),
        surface(7),
        **more,
    )


def write(tmp_path, text, name="lens.zmx", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.replace("\n", "\r\n").encode(encoding))
    return path


def loaded(path):
    remarks: list[str] = []
    return load_lens(path, remarks=remarks), remarks


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_every_encoding_gives_the_same_lens(tmp_path, encoding):
    lens, _ = loaded(write(tmp_path, doublet(name="Ø 25 mm"), encoding=encoding))
    assert lens.name == "Ø 25 mm"
    assert [type(row) for row in lens.rows] == [Surface, Surface, Surface, Stop, Surface, Surface]
    assert lens.rows[0].curvature == pytest.approx(1 / 61.47, rel=1e-15)
    assert lens.rows[0].medium.n_d == pytest.approx(1.5168, abs=1e-5)
    assert lens.rows[4].medium.n_d == 1.6
    assert [row.thickness for row in lens.rows] == [6.0, 2.5, 3.0, 2.0, 1.5, 96.5]
    assert lens.rows[1].semi_diameter == 12.5
    assert lens.f_number == 4.0
    assert lens.field_deg == 10.0


def test_what_was_noticed_is_told(tmp_path):
    _, remarks = loaded(write(tmp_path, doublet(gap=80.0)))
    reported = " | ".join(remarks)
    assert "the rims of surfaces 5, 6 just pass the file's own fields" in reported
    assert "the file's image lies 80.00 mm behind the last surface" in reported


def test_the_opening_follows_from_whatever_the_file_gives(tmp_path):
    lens, _ = loaded(write(tmp_path, doublet()))
    efl = first_order(lens).efl
    # thin lenses in contact: the power is the sum within the effect of their thickness
    powers = 0.5168 * (1 / 61.47 + 1 / 44.64) + 0.67270 * (-1 / 44.64 + 1 / 129.94)
    assert efl == pytest.approx(1 / powers, rel=0.02)
    by_pupil, _ = loaded(write(tmp_path, doublet(opening="ENPD 20")))
    assert by_pupil.f_number == pytest.approx(efl / 20.0, rel=1e-12)
    by_stop, remarks = loaded(write(tmp_path, doublet(opening="FLOA 0")))
    assert first_order(by_stop).stop_semi_diameter == pytest.approx(9.0, rel=1e-9)
    assert any("the stop's semi-diameter of 9 mm gives" in remark for remark in remarks)


def test_inches_become_millimetres(tmp_path):
    aspheric = ["PARM 1 0", "PARM 2 -1.5E-2", "PARM 3 3.0E-3", "CONI -0.5"]
    text = text_of(
        surface(1, 0.4, 0.25, "N-BK7 0 0 1.5 40 0 0 0", "0.5 1", "EVENASPH", aspheric),
        surface(2, 0.0, 0.2, rim="0.5 1"), surface(3, 0.0, 4.0, rim="0.4 1", more=["STOP"]), surface(4),
        unit="IN",
    )  # fmt: skip
    lens, remarks = loaded(write(tmp_path, text))
    assert any("converted to mm" in remark for remark in remarks)
    assert lens.rows[0].thickness == pytest.approx(6.35)
    assert lens.rows[0].semi_diameter == pytest.approx(12.7)
    r = np.array([0.1, 0.3, 0.5])
    wanted = 0.4 * r**2 / (1 + np.sqrt(1 - 0.5 * 0.16 * r**2)) - 1.5e-2 * r**4 + 3.0e-3 * r**6
    np.testing.assert_allclose(sag(lens.rows[0], np.zeros(3), 25.4 * r), 25.4 * wanted, rtol=1e-12)


def test_aspheres_of_other_kinds(tmp_path):
    parabola = surface(1, 0.0, 4.0, "N-BK7 0 0 1.5 40", "6 1", "EVENASPH", ["PARM 1 0.02"])
    scaled = surface(
        2, -0.01, 2.0, "", "6 1", "XASPHERE", ["XDAT 1 2 0 0", "XDAT 2 10.0 0 0", "XDAT 3 0", "XDAT 4 0.25"]
    )
    oval = surface(4, 0.02, 3.0, "N-BK7 0 0 1.5 40", "6 1", "BICONICX", ["PARM 1 25.0", "PARM 2 -1.0"])
    text = text_of(parabola, scaled, surface(3, 0.0, 2.0, more=["STOP"]), oval, surface(5, 0.0, 20.0), surface(6))
    rows = loaded(write(tmp_path, text))[0].rows
    r = np.array([1.0, 3.0, 5.0])
    zero = np.zeros(3)
    np.testing.assert_allclose(sag(rows[0], zero, r), 0.02 * r**2, rtol=1e-12)
    assert rows[1].asphere == pytest.approx((0.25 / 10.0**4,))
    x_sag = sag(rows[3], r, zero)
    np.testing.assert_allclose(x_sag, r**2 / 50.0, rtol=1e-12)


def test_a_rim_beyond_its_own_sphere_is_left_out_and_told(tmp_path):
    path = tmp_path / "wide.zmx"
    path.write_text(doublet().replace("DIAM 12.5 1", "DIAM 50.5 1", 2), "utf-16")
    remarks = []
    lens = load_lens(path, remarks=remarks)
    rims = [row.semi_diameter for row in lens.rows if isinstance(row, Surface)]
    assert rims[0] == 50.5
    assert rims[1] < 1 / abs(lens.rows[1].curvature)
    assert any("row 1: a rim of 50.5 mm does not fit a surface that ends 44.64 mm" in reported for reported in remarks)


def test_a_stop_on_glass_gets_a_plane_of_its_own(tmp_path):
    front = text_of(surface(1, 0.02, 5.0, "N-BK7 0 0 1.5 40", more=["STOP"]), surface(2, 0.0, 90.0), surface(3))
    lens, remarks = loaded(write(tmp_path, front))
    assert isinstance(lens.rows[0], Stop)
    assert lens.rows[0].thickness == 0.0
    assert "surface 1 is the stop and refracts: the stop is placed in front of it" in remarks
    back = text_of(surface(1, 0.02, 5.0, "N-BK7 0 0 1.5 40"), surface(2, 0.0, 90.0, more=["STOP"]), surface(3))
    lens, remarks = loaded(write(tmp_path, back))
    assert isinstance(lens.rows[2], Stop)
    assert (lens.rows[1].thickness, lens.rows[2].thickness) == (0.0, 90.0)
    inside = text_of(
        surface(1, 0.02, 5.0, "N-BK7 0 0 1.5 40"), surface(2, 0.01, 2.0, "SF5 0 0 1.5 40", more=["STOP"]),
        surface(3, 0.0, 90.0), surface(4),
    )  # fmt: skip
    with pytest.raises(LensError, match="surface 2: the stop stands inside glass"):
        load_lens(write(tmp_path, inside))


def test_idle_planes_are_left_out(tmp_path):
    text = text_of(
        surface(1, 0.0, 10.0, rim="20 0"), surface(2, 0.02, 5.0, "N-BK7 0 0 1.5 40"), surface(3, 0.0, 1.0),
        surface(4, 0.0, 2.0, kind="COORDBRK", more=["PARM 3 0"]), surface(5, 0.0, 3.0, more=["STOP"]),
        surface(6, 0.0, 85.0), surface(7),
    )  # fmt: skip
    lens, remarks = loaded(write(tmp_path, text))
    assert [row.thickness for row in lens.rows] == [5.0, 3.0, 88.0]
    assert any(remark.startswith("surfaces 1, 4, 6: the same medium on both sides") for remark in remarks)


def test_an_idle_coordinate_break_in_glass_divides_no_glass(tmp_path):
    broken = text_of(
        surface(1, 0.02, 3.0, "N-BK7 0 0 1.5 40"), surface(2, 0.0, 2.0, kind="COORDBRK", more=["PARM 3 0", "PARM 6 1"]),
        surface(3, 0.0, 3.0), surface(4, 0.0, 85.0, more=["STOP"]), surface(5),
    )  # fmt: skip
    lens, remarks = loaded(write(tmp_path, broken))
    assert [row.thickness for row in lens.rows] == [5.0, 3.0, 85.0]
    assert any(remark.startswith("surface 2: the same medium on both sides") for remark in remarks)


REFUSED = [
    ("mirror", surface(1, 0.01, 5.0, "MIRROR 0 0 1.5 40"), "surface 1 is a mirror"),
    ("tilt", surface(1, 0.0, 0.0, kind="COORDBRK", more=["PARM 3 -3.5"]), r"surface 1 tilts or shifts what follows"),
    ("type", surface(1, 0.01, 5.0, kind="BINARY_2"), "surface 1 is of type BINARY_2; known are STANDARD"),
    ("glass", surface(1, 0.01, 5.0, "C79-80 0 0 0 0"), "the glass C79-80 is in no catalogue and has no index"),
    ("placeholder", surface(1, 0.01, 5.0, "UNOBTAINIUM 0 0 1.5 40"), "UNOBTAINIUM is in no catalogue and has no index"),
    ("number", surface(1, 0.01, 5.0).replace("DISZ 5.0", "DISZ five"), "surface 1: DISZ is 'five'"),
    ("square", surface(1, 0.01, 5.0, kind="EVENASPH", more=["PARM 1 0.1"]), "a term of r\\^2 beside its curvature"),
]


@pytest.mark.parametrize(("first", "reason"), [each[1:] for each in REFUSED], ids=[each[0] for each in REFUSED])
def test_what_cannot_be_traced_is_refused(tmp_path, first, reason):
    rest = [surface(2, 0.02, 5.0, "N-BK7 0 0 1.5 40"), surface(3, 0.0, 80.0, more=["STOP"]), surface(4)]
    with pytest.raises(LensError, match=reason):
        load_lens(write(tmp_path, text_of(first, *rest)))


def test_what_is_no_lens_is_refused(tmp_path):
    glass = surface(1, 0.02, 5.0, "N-BK7 0 0 1.5 40")
    for text, reason in [
        ("# nothing of use\n", "is it a .zmx file"),
        (doublet().replace("MODE SEQ", "MODE NSC"), "not sequential"),
        (doublet(unit="FURLONG"), "UNIT FURLONG is unknown"),
        (text_of(glass, surface(2, 0.0, 80.0), surface(3)), "0 surfaces are the stop"),
        (text_of(surface(1, 0.0, 2.0, more=["STOP"]), surface(2, 0.01, 80.0), surface(3)), "no surface refracts"),
        (text_of(surface(1, 0, 1.0, more=["STOP"]), glass.replace("SURF 1", "SURF 2"), surface(3)), "inside glass"),
        (doublet(opening="ENPD 1e4"), "out of range for a lens"),
    ]:
        with pytest.raises(LensError, match=reason):
            load_lens(write(tmp_path, text))


def test_a_near_object_is_where_the_lens_is_focused(tmp_path):
    lens, remarks = loaded(write(tmp_path, doublet().replace("DISZ INFINITY", "DISZ 500")))
    assert lens.focus_distance == 500.0
    assert any("focused there" in remark for remark in remarks)


def test_a_shipped_lens_comes_back(tmp_path):
    """All numbers of the Heliar, written as such a file by this test and read back."""
    lens = load_lens("heliar-tronnier")
    blocks = []
    for number, row in enumerate(lens.rows, start=1):
        if isinstance(row, Stop):
            blocks.append(surface(number, 0.0, row.thickness, more=["STOP"]))
            continue
        glass = "" if row.medium is None else f"___BLANK 1 0 {row.medium.n_d!r} {row.medium.v_d!r}"
        blocks.append(surface(number, row.curvature, row.thickness, glass, f"{row.semi_diameter!r} 1"))
    blocks.append(surface(len(lens.rows) + 1))
    text = text_of(*blocks, opening=f"FNUM {lens.f_number!r} 0")
    back, _ = loaded(write(tmp_path, text, encoding="utf-16"))
    wanted, found = first_order(lens), first_order(back)
    assert found.efl == pytest.approx(wanted.efl, rel=1e-9)
    assert found.stop_semi_diameter == pytest.approx(wanted.stop_semi_diameter, rel=1e-9)
    for mine, theirs in zip(back.rows, lens.rows, strict=True):
        assert mine.thickness == theirs.thickness
        if isinstance(theirs, Surface):
            assert mine.curvature == pytest.approx(theirs.curvature, rel=1e-15)
            assert mine.semi_diameter == theirs.semi_diameter


def test_check_and_convert_take_such_files(tmp_path):
    good = write(tmp_path, doublet(gap=80.0))
    bad = write(tmp_path, doublet().replace("SF5 0 0", "MIRROR 0 0"), "bad.zmx")
    runner = CliRunner()
    checked = runner.invoke(command_tree(), ["lens", "check", str(good), str(bad)])
    assert checked.exit_code == 2
    assert "lens.zmx: usable, Two lenses" in checked.output
    assert "from the paraxial focus" in checked.output
    assert "surface 2 is a mirror" in checked.output
    out = tmp_path / "own.toml"
    converted = runner.invoke(command_tree(), ["lens", "convert", str(good), str(out)])
    assert converted.exit_code == 0
    lens = read_lens(out).lens
    assert lens.f_number == 4.0
    assert "Imported from lens.zmx." in lens.notes
    assert first_order(lens).efl == pytest.approx(first_order(load_lens(good)).efl)


def test_bytes_that_are_no_text_do_not_break_it():
    assert decoded(b"\xff\xfeV\x00E\x00") == "VE"
    assert decoded(b"NAME \xd8") == "NAME Ø"


@pytest.mark.parametrize(("unit", "mm"), [("MM", 1.0), ("CM", 10.0), ("IN", 25.4)])
def test_a_field_given_as_a_height_is_in_the_unit_of_the_file(unit, mm, tmp_path):
    """FTYP 2 gives the height of the image, here half the focal length: atan(1/2) from the axis."""
    order = first_order(load_lens(write(tmp_path, doublet(), "plain.zmx")))
    text = doublet(unit=unit, field=0.5 * order.efl).replace("FTYP 0", "FTYP 2")
    lens = load_lens(write(tmp_path, text))
    assert first_order(lens).efl == pytest.approx(mm * order.efl, rel=1e-6)
    assert lens.field_deg == pytest.approx(np.degrees(np.arctan(0.5)), rel=1e-3)


def cells(key, place, *values):
    return "".join(f"{key}   {place}   {k} {value} 0 0 0 1 1 1 0 0\n" for k, value in enumerate(values, 1))


def zoom(tail, **more):
    """Return two thin doublets with a gap between them that a table of configurations changes."""
    return text_of(
        surface(1, 1 / 80.0, 4.0, "N-BK7 0 0 1.5 40", "10 1"), surface(2, -1 / 80.0, 20.0, rim="10 1"),
        surface(3, 0.0, 1.0, rim="6 0", more=["STOP"]),
        surface(4, 1 / 60.0, 4.0, "N-BK7 0 0 1.5 40", "10 1"), surface(5, -1 / 60.0, 30.0, rim="10 1"), surface(6),
        tail=tail, **more,
    )  # fmt: skip


def test_configurations_become_positions_with_the_focal_length_of_two_thin_lenses(tmp_path):
    tail = "MNUM 3 1\n" + cells("THIC", 2, 20.0, 30.0, 10.0) + cells("THIC", 5, 30, 25, 35) + cells("MOFF", 0, 1, 2, 3)
    lens, remarks = loaded(write(tmp_path, zoom(tail)))
    assert [position.gaps for position in lens.positions] == [((1, 20.0),), ((1, 30.0),), ((1, 10.0),)]
    index = 1.51680
    one, other = ((index - 1) * 2 / radius for radius in (80.0, 60.0))
    for position in lens.positions:
        # thin lenses a distance d apart, from principal plane to principal plane: 1/f = p + q - d p q
        apart = position.gaps[0][1] + 1.0 + 2 * 4.0 / (2 * index)
        thin = 1.0 / (one + other - apart * one * other)
        found = first_order(positioned(lens, position.name, None))
        assert found.efl == pytest.approx(thin, rel=0.01)
        assert position.name == f"{found.efl:.4g} mm"
    assert any("are positions" in remark for remark in remarks)
    assert not any("configuration " in remark for remark in remarks)
    # what is written reads back as the same lens
    write_lens(lens, tmp_path / "own.toml")
    assert loaded(tmp_path / "own.toml")[0].positions == lens.positions


def test_aperture_and_field_of_a_configuration(tmp_path):
    table = cells("THIC", 2, 20.0, 30.0) + cells("YFIE", 2, 10.0, 7.0)
    fixed, _ = loaded(write(tmp_path, zoom("MNUM 2 1\n" + table + cells("APER", 0, 4.0, 5.6))))
    assert [(each.f_number, each.field_deg) for each in fixed.positions] == [(None, None), (5.6, 7.0)]
    # the entrance pupil and the stop's size keep their values, so that the f-number changes with the focal length
    pupil, _ = loaded(write(tmp_path, zoom("MNUM 2 1\n" + table, opening="ENPD 10")))
    orders = [first_order(positioned(pupil, position.name, None)) for position in pupil.positions]
    assert [order.entrance_pupil_diameter for order in orders] == pytest.approx([10.0, 10.0], rel=1e-9)
    sized, _ = loaded(write(tmp_path, zoom("MNUM 2 1\n" + table + cells("SDIA", 3, 6, 5), opening="FLOA 0")))
    orders = [first_order(positioned(sized, position.name, None)) for position in sized.positions]
    assert [order.stop_semi_diameter for order in orders] == pytest.approx([6.0, 5.0], rel=1e-9)


def test_near_configurations_are_focus_positions(tmp_path):
    prime = cells("THIC", 0, "INFINITY", 500.0) + cells("THIC", 2, 20.0, 22.0)
    lens, _ = loaded(write(tmp_path, zoom("MNUM 2 1\n" + prime)))
    assert [(each.name, each.focus_distance) for each in lens.positions] == [("infinity", None), ("at 500 mm", 500.0)]
    # --focus interpolates the gap in 1 / distance
    assert positioned(lens, None, 1000.0).rows[1].thickness == pytest.approx(21.0)
    both = cells("THIC", 0, 1e10, 400.0, 1e10, 2000.0) + cells("THIC", 2, 20.0, 21.0, 30.0, 31.0)
    lens, _ = loaded(write(tmp_path, zoom("MNUM 4 1\n" + both)))
    names = [position.name for position in lens.positions]
    assert [name.partition(" at ")[2] for name in names] == ["", "400 mm", "", "2 m"]
    lengths = [position.focal_length for position in lens.positions]
    assert lengths[0] == lengths[1] != lengths[2] == lengths[3]
    by_rank = cells("THIC", 0, 1e10, 1e10, 900.0, 400.0) + cells("THIC", 2, 20.0, 30.0, 31.0, 21.0)
    lens, _ = loaded(write(tmp_path, zoom("MNUM 4 1\n" + by_rank)))
    lengths = [position.focal_length for position in lens.positions]
    assert lengths[0] == lengths[3] != lengths[1] == lengths[2]


@pytest.mark.parametrize(
    ("table", "kept", "said"),
    [
        (cells("THIC", 2, 20, 30, 40) + cells("CRVT", 4, 0.0166, 0.02, 0.0166), 2, "configuration 2 differs in CRVT 4"),
        (cells("THIC", 2, 20, 30, 40) + cells("GLSS", 1, "N-BK7", "SF6", "N-BK7"), 2, "differs in GLSS 1"),
        (cells("THIC", 2, 20, 30, 40) + cells("THIC", 4, 4, 5, 4), 2, "the glass behind row 3 has another thickness"),
        (cells("THIC", 2, 20, 30, -3), 2, "configuration 3 is left out: the moving gap behind row 1 is negative"),
        (cells("THIC", 2, 20, 30, "x"), 2, "configuration 3: THIC 2 is 'x', no number"),
        (cells("THIC", 2, 20, 30, 30), 2, "configuration 3 repeats the gaps of configuration 2"),
        (cells("THIC", 2, 20, 30, 40) + cells("SDIA", 4, 10, 9, 8), 3, "surface 4: the rim differs"),
        (cells("THIC", 5, 20, 30, 40), 0, "repeats the gaps of configuration 1"),
        (cells("THIC", 0, 1e10, 900, 500) + cells("THIC", 5, 30, 31, 33), 0, "as --focus does: no positions"),
        (cells("THIC", 0, 1e10, 1e10, 500) + cells("THIC", 2, 20, 30, 31), 2, "to which focal length each near"),
        (cells("THIC", 2, 20, 30, 20000), 2, "configuration 3 is left out: thickness should be less"),
    ],
)  # fmt: skip
def test_what_a_position_cannot_hold_is_reported(tmp_path, table, kept, said):
    lens, remarks = loaded(write(tmp_path, zoom("MNUM 3 1\n" + table)))
    assert len(lens.positions) == kept
    assert said in " | ".join(remarks)


def test_odd_aspheres_without_odd_powers_and_cylinders(tmp_path):
    even = surface(1, 0.01, 4.0, "N-BK7 0 0 1.5 40", "6 1", "ODDASPHE", ["PARM 3 0", "PARM 4 1E-5", "PARM 6 1E-7"])
    scaled = surface(
        2,
        -0.01,
        2.0,
        "",
        "6 1",
        "XOSPHERE",
        ["XDAT 1 4", "XDAT 2 10.0", "XDAT 3 0", "XDAT 4 0", "XDAT 5 0", "XDAT 6 2.0"],
    )
    line = surface(4, 0.0, 3.0, "N-BK7 0 0 1.5 40", "6 1", "TOROIDAL", ["PARM 1 40.0"])
    other = surface(5, 0.02, 20.0, "", "6 1", "TOROIDAL", ["CONI -0.5", "PARM 1 0"])
    text = text_of(even, scaled, surface(3, 0.0, 2.0, more=["STOP"]), line, other, surface(6))
    rows = loaded(write(tmp_path, text))[0].rows
    r, zero = np.array([1.0, 3.0, 5.0]), np.zeros(3)
    wanted = 0.01 * r**2 / (1 + np.sqrt(1 - 0.01**2 * r**2)) + 1e-5 * r**4 + 1e-7 * r**6
    np.testing.assert_allclose(sag(rows[0], zero, r), wanted, rtol=1e-12)
    assert rows[1].asphere == pytest.approx((2.0e-4,))
    # a circle of 40 mm turned about an axis at 40 mm, and an ellipse that is moved along x
    np.testing.assert_allclose(sag(rows[3], r, 2 * r), 40.0 - np.sqrt(40.0**2 - r**2), rtol=1e-12)
    ellipse = 0.02 * r**2 / (1 + np.sqrt(1 - 0.5 * 0.02**2 * r**2))
    np.testing.assert_allclose(sag(rows[4], 3 * r, r), ellipse, rtol=1e-12)


def test_odd_powers_are_read_and_written(tmp_path):
    odd = surface(1, 0.01, 4.0, "N-BK7 0 0 1.5 40", "6 1", "ODDASPHE", ["PARM 3 1E-4", "PARM 4 1E-5", "PARM 7 2E-8"])
    scaled = surface(
        2, -0.01, 2.0, "", "6 1", "XOSPHERE",
        ["CONI -0.5", "XDAT 1 10", "XDAT 2 10.0", "XDAT 5 0.1", "XDAT 8 0.5", "XDAT 11 3.0"],
    )  # fmt: skip
    tail = (surface(3, 0.0, 20.0, more=["STOP"]), surface(4))
    lens = loaded(write(tmp_path, text_of(odd, scaled, *tail)))[0]
    r = np.array([0.0, 1.0, 3.0, 5.0])
    sphere = 0.01 * r**2 / (1 + np.sqrt(1 - 0.01**2 * r**2))
    np.testing.assert_allclose(
        sag(lens.rows[0], r, 0 * r), sphere + 1e-4 * r**3 + 1e-5 * r**4 + 2e-8 * r**7, rtol=1e-12
    )
    conic = -0.01 * r**2 / (1 + np.sqrt(1 - 0.5 * 0.01**2 * r**2))
    terms = 0.1 * (r / 10) ** 3 + 0.5 * (r / 10) ** 6 + 3 * (r / 10) ** 9
    np.testing.assert_allclose(sag(lens.rows[1], 0 * r, r), conic + terms, rtol=1e-12)
    # inches
    inches = loaded(write(tmp_path, text_of(odd, scaled, *tail, unit="IN")))[0]
    wide = 25.4 * r
    for one, other in zip(lens.rows[:2], inches.rows[:2], strict=True):
        np.testing.assert_allclose(sag(other, wide, 0 * r), 25.4 * sag(one, r, 0 * r), rtol=1e-12)
    # both types, and our own format
    for name in ("again.zmx", "again.toml"):
        export_lens(lens, tmp_path / name)
        again = loaded(tmp_path / name)[0]
        assert [row.terms for row in again.rows[:2]] == [row.terms for row in lens.rows[:2]]
    written = (tmp_path / "again.zmx").read_text()
    assert "TYPE ODDASPHE" in written
    assert "TYPE XOSPHERE" in written
    for name in ("again.csv", "again.lens"):
        with pytest.raises(LensError, match="row 0"):
            export_lens(lens, tmp_path / name)
        assert not (tmp_path / name).exists()


def test_an_odd_asphere_of_even_powers_is_an_even_one(tmp_path):
    rest = (surface(2, 0.0, 2.0), surface(3, 0.0, 20.0, more=["STOP"]), surface(4))
    glass = "N-BK7 0 0 1.5 40"
    even = surface(1, 0.01, 4.0, glass, "6 1", "EVENASPH", ["CONI -0.5", "PARM 2 1E-5", "PARM 3 -2E-8"])
    odd = surface(1, 0.01, 4.0, glass, "6 1", "ODDASPHE", ["CONI -0.5", "PARM 4 1E-5", "PARM 6 -2E-8"])
    extended = ["CONI -0.5", "XDAT 1 6", "XDAT 2 1.0", "XDAT 6 1E-5", "XDAT 8 -2E-8"]
    wanted = loaded(write(tmp_path, text_of(even, *rest)))[0]
    assert loaded(write(tmp_path, text_of(odd, *rest)))[0] == wanted
    assert (
        loaded(write(tmp_path, text_of(surface(1, 0.01, 4.0, glass, "6 1", "XOSPHERE", extended), *rest)))[0] == wanted
    )


def test_a_toroid_is_its_profile_rotated_at_its_radius(tmp_path):
    more = ["CONI -0.5", "PARM 1 -40.0", "PARM 3 1E-5", "PARM 4 -2E-8"]
    rest = (surface(2, 0.0, 2.0), surface(3, 0.0, 20.0, more=["STOP"]), surface(4))
    text = text_of(surface(1, 0.01, 4.0, "N-BK7 0 0 1.5 40", "6 1", "TOROIDAL", more), *rest)
    lens = loaded(write(tmp_path, text))[0]
    x, y = np.array([0.0, 3.0, 5.0]), np.array([4.0, -1.0, 2.0])
    profile = 0.01 * y**2 / (1 + np.sqrt(1 - 0.5 * 0.01**2 * y**2)) + 1e-5 * y**4 - 2e-8 * y**6
    np.testing.assert_allclose(sag(lens.rows[0], x, y), -40.0 + np.sqrt((40.0 + profile) ** 2 - x**2), rtol=1e-12)
    # in centimetres it is the same shape
    more = ["CONI -0.5", "PARM 1 -4.0", "PARM 3 1E-2", "PARM 4 -2E-3"]
    small = text_of(
        surface(1, 0.1, 0.4, "N-BK7 0 0 1.5 40", "0.6 1", "TOROIDAL", more),
        surface(2, 0.0, 0.2), surface(3, 0.0, 2.0, more=["STOP"]), surface(4), unit="CM"
    )  # fmt: skip
    same = loaded(write(tmp_path, small))[0].rows[0]
    np.testing.assert_allclose(sag(same, x, y), sag(lens.rows[0], x, y), rtol=1e-12)
    for name in ("t.zmx", "t.toml", "t.json"):
        export_lens(lens, tmp_path / name)
        again = load_lens(tmp_path / name)
        np.testing.assert_allclose(sag(again.rows[0], x, y), sag(lens.rows[0], x, y), rtol=1e-13, err_msg=name)
    with pytest.raises(LensError, match=r"above y\^14"):
        export_lens(
            lens.replace(rows=(lens.rows[0].replace(asphere=(0.0,) * 6 + (1e-20,)), *lens.rows[1:])), tmp_path / "u.zmx"
        )


@pytest.mark.parametrize(
    ("kind", "curvature", "more", "said"),
    [
        ("ODDASPHE", 0.01, ["PARM 1 1E-4"], "surface 1 has a term of r, a tip without a normal on the axis"),
        ("XOSPHERE", 0.01, ["XDAT 1 21", "XDAT 23 1E-40"], r"surface 1 has terms beyond r\^19"),
        ("XOSPHERE", 0.01, ["XDAT 1 3", "XDAT 6 1E-4"], "XDAT 6 lies beyond the number of terms"),
        ("TOROIDAL", 0.01, ["PARM 1 40", "PARM 2 1E-4"], r"surface 1 has a term of r\^2 beside its curvature"),
        ("TOROIDAL", 0.01, ["PARM 1 40", "XDAT 3 1E-4"], r"surface 1 is a toroid with Zernike terms \(XDAT 3\)"),
    ],
)
def test_shapes_that_a_surface_cannot_have_are_refused(tmp_path, kind, curvature, more, said):
    text = text_of(
        surface(1, curvature, 4.0, "N-BK7 0 0 1.5 40", "6 1", kind, more),
        surface(2, 0.0, 2.0), surface(3, 0.0, 20.0, more=["STOP"]), surface(4),
    )  # fmt: skip
    with pytest.raises(LensError, match=said):
        loaded(write(tmp_path, text))
