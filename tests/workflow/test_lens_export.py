"""Lenses in other programs' formats: what is written reads back as the same lens."""

from __future__ import annotations

import csv
import io
from functools import cache

import numpy as np
import pytest

from flarewright.cli.app import run
from flarewright.errors import LensError
from flarewright.io.lens.library import library_names
from flarewright.model import Surface
from flarewright.optics.lens.dispersion import refractive_index
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.zoom import at_position
from flarewright.render.analysis import ghosts
from flarewright.render.scene.resolve import open_lens
from flarewright.workflow.lens_export import export_lens


def shape(lens):
    """Return what an exported lens has in common with its original: surfaces, rims, inner gaps and the stop's row."""
    surfaces = [row for row in lens.rows if isinstance(row, Surface)]
    rows = [
        (row.curvature, row.conic, row.asphere, row.meridian_x, row.medium and (row.medium.n_d, row.medium.v_d))
        for row in surfaces
    ]
    return rows, [row.semi_diameter for row in surfaces], [row.thickness for row in lens.rows[:-1]], lens.stop_row


@pytest.mark.parametrize("suffix", [".zmx", ".csv", ".lens", ".json"])
def test_every_shipped_lens_that_a_format_holds_reads_back(tmp_path, suffix):
    written, refused = 0, []
    for name in library_names():
        lens = open_lens(name).lens
        at_first = at_position(lens, lens.positions[0]) if lens.positions and suffix == ".zmx" else lens
        path = tmp_path / f"{name}{suffix}"
        try:
            export_lens(lens, path)
        except LensError as error:
            refused.append(str(error))
            continue
        found, wanted = open_lens(path).lens, first_order(at_first)
        for one, other in zip(shape(found), shape(at_first), strict=True):
            assert one == other
        order = first_order(found)
        assert order.efl == pytest.approx(wanted.efl, rel=1e-12)
        assert order.stop_semi_diameter == pytest.approx(wanted.stop_semi_diameter, rel=1e-12)
        assert found.rows[-1].thickness == pytest.approx(order.sensor_distance, rel=1e-12)
        written += 1
    assert all("different curvatures in its meridians" in why or "is no sphere" in why for why in refused)
    assert all("; write a .zmx or .toml file" in why for why in refused)
    assert written >= {".zmx": 19, ".csv": 18, ".lens": 12, ".json": 19}[suffix]


@cache
def ghosts_of(lens):
    return ghosts(lens, (10.0, 0.0), f_number=8.0, coating="none")


@pytest.mark.parametrize("suffix", [".zmx", ".csv", ".lens", ".json"])
def test_the_ghosts_are_the_same(tmp_path, suffix):
    path = tmp_path / f"triplet{suffix}"
    export_lens(open_lens("triplet-pestrecov").lens, path)
    one, other = ghosts_of("triplet-pestrecov"), ghosts_of(path)
    assert [row.name for row in one.ghosts] == [row.name for row in other.ghosts]
    for a, b in zip(one.ghosts, other.ghosts, strict=True):
        assert b.throughput_mm2 == pytest.approx(a.throughput_mm2, rel=1e-9)
        assert b.centroid_mm == pytest.approx(a.centroid_mm, abs=1e-9)


def test_positions_become_configurations_and_return(tmp_path):
    lens = open_lens("canon-70-200").lens
    path = tmp_path / "zoom.zmx"
    remarks = export_lens(lens, path)
    assert any("'wide', 'tele' are configurations 1 to 2" in remark for remark in remarks)
    found = open_lens(path).lens
    for before, after in zip(lens.positions, found.positions, strict=True):
        a, b = at_position(lens, before), at_position(found, after)
        assert shape(a) == shape(b)
        assert (b.f_number, b.field_deg) == pytest.approx((a.f_number, a.field_deg), rel=1e-12)
        assert first_order(b).efl == pytest.approx(first_order(a).efl, rel=1e-12)
    # the last gap of each configuration is the image distance
    cells = [line.split() for line in path.read_text().splitlines() if line.startswith("THIC")]
    last = [float(cell[3]) for cell in cells if int(cell[1]) == len(lens.rows)]
    wanted = [first_order(at_position(lens, position)).sensor_distance for position in lens.positions]
    assert last == pytest.approx(wanted, rel=1e-12)


OWN = """\
schema_version = 1
name = "Own"
f_number = 5
focus_distance = 800
field_deg = 12
rows = [
  { radius = 40, conic = -0.5, asphere = [1e-6, -2e-9], thickness = 4, glass = "N-BK7", semi_diameter = 9 },
  { radius = "flat", radius_x = -300, conic_x = -1, thickness = 3, semi_diameter = 9 },
  { stop = true, thickness = 2 },
  { radius = "flat", thickness = 2, n_d = 1.7, v_d = 30, semi_diameter = 8, coating = "quarter-wave:550" },
  { radius = 200, tilt_deg = [0.1, 0], semi_diameter = 8 },
]
"""


def test_aspheres_cylinders_and_a_near_object(tmp_path):
    (tmp_path / "own.toml").write_text(OWN)
    lens = open_lens(tmp_path / "own.toml").lens
    path = tmp_path / "own.zmx"
    remarks = export_lens(lens, path)
    found = open_lens(path).lens
    assert shape(found)[1:] == shape(lens)[1:]
    for a, b in zip(shape(lens)[0], shape(found)[0], strict=True):
        assert b[:3] == a[:3]
        assert b[3] == pytest.approx(a[3], rel=1e-14)
    assert (found.focus_distance, found.field_deg, found.f_number) == (800.0, 12.0, 5.0)
    said = " | ".join(remarks)
    assert "files describe no coatings here" in said
    assert "decentres and tilts are left out (row 4)" in said
    with pytest.raises(LensError, match="row 1 has different curvatures in its meridians"):
        export_lens(lens, tmp_path / "own.csv")
    assert not (tmp_path / "own.csv").exists()


def test_a_csv_table_has_a_header_and_numbers(tmp_path):
    path = tmp_path / "nikon.csv"
    lens = open_lens("nikon-28-75").lens
    export_lens(lens, path)
    lines = path.read_text().splitlines()
    assert lines[:2] == [f"# name = {lens.name}", f"# f_number = {lens.f_number}"]
    rows = list(csv.DictReader(io.StringIO("\n".join(line for line in lines if not line.startswith("#")))))
    radii = [row["radius"] for row in rows]
    assert radii.index("stop") == lens.stop_row
    curvatures = [0.0 if radius == "flat" else 1 / float(radius) for radius in radii if radius != "stop"]
    assert curvatures == [row.curvature for row in lens.rows if isinstance(row, Surface)]


def test_convert_chooses_the_format_by_the_suffix(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["lens", "convert", "heliar-tronnier", "h.zmx"]) == 0
    assert "coating presets are left out" in capsys.readouterr().err
    assert run(["lens", "convert", "h.zmx", "h.toml"]) == 0
    assert run(["lens", "convert", "heliar-tronnier", "h.seq"]) == 2
    assert "h.seq" in capsys.readouterr().err
    assert run(["lens", "convert", "anamorphic-heliar-2x", "a.lens"]) == 2
    assert "meridians" in capsys.readouterr().err
    assert not (tmp_path / "a.lens").exists()


def test_glass_without_v_d_keeps_its_dispersion(tmp_path):
    """It used to be written as an ideal material, which does not disperse."""
    (tmp_path / "a.csv").write_text(
        "radius,thickness,n_d,semi_diameter\n60,6,1.7,12\n-200,2,,12\nstop,1,,8\n-80,3,1.6,12\n,90,,12\n"
    )
    lens = open_lens(tmp_path / "a.csv").lens
    assert lens.rows[0].medium.v_d is None
    remarks = export_lens(lens, tmp_path / "b.json")
    assert any(f"row 0 that of {lens.rows[0].medium.dispersion.glass}" in remark for remark in remarks)
    again = open_lens(tmp_path / "b.json").lens
    spread = [float(np.ptp(refractive_index(one.rows[0].medium, np.array([486.13, 656.27])))) for one in (lens, again)]
    assert spread[1] == pytest.approx(spread[0], rel=0.01)
