"""Ghosts over fields, wavelengths and f-numbers, and the gain of a coating at each surface."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
from singlet_file import singlet_file

from flarewright.cli.app import run
from flarewright.cli.render.ghost_sweep import sweep_axes
from flarewright.errors import FlarewrightError
from flarewright.io.lens.coating_text import coating_choice
from flarewright.model import Project
from flarewright.optics.lens.field_angles import field_angles
from flarewright.optics.rays import ghost_table
from flarewright.optics.rays.ghost_table import GhostQuery
from flarewright.render.analysis import ghosts
from flarewright.workflow.ghost_sweep import along, surface_gains, sweep_ghosts

LENS = "triplet-pestrecov"


@pytest.fixture
def few_rays(monkeypatch):
    """Limit the rays of grazing light, which take most of the time: for tests of what is analysed, not of numbers."""
    monkeypatch.setattr(ghost_table, "MOST_RAYS", 1000)


def swept(coating, fields=((0.0, 0.0),), wavelengths=(550.0,), f_numbers=(16.0,), lens=LENS):
    project = Project.model_validate(
        {"lens": lens, "coating": coating_choice(coating), "lights": [{"field_deg": (0.0, 0.0)}]}
    )
    return tuple(sweep_ghosts(project, GhostQuery((0.0, 0.0)), fields, wavelengths, f_numbers))


@pytest.mark.usefixtures("few_rays")
def test_each_point_is_the_analysis_of_its_combination(tmp_path):
    lens = singlet_file(tmp_path)
    points = swept("none", ((0.0, 0.0), (6.0, 8.0)), (450.0, 650.0), (16.0, 22.0), lens)
    assert [(point.f_number, point.field_deg, point.wavelength_nm) for point in points] == [
        (f_number, field, wavelength)
        for f_number in (16.0, 22.0)
        for field in ((0.0, 0.0), (6.0, 8.0))
        for wavelength in (450.0, 650.0)
    ]
    last = points[-1]
    wanted = ghosts(lens, (6.0, 8.0), f_number=22.0, wavelength_nm=650.0, coating="none")
    assert last.table.ghosts == wanted.ghosts


def test_a_film_without_reflection_removes_the_part_that_the_ranking_states(tmp_path):
    """The film is a quarter of the wavelength with the index of the geometric mean, and light is near normal."""
    bare = swept("none")
    total = bare[0].throughput_mm2
    gains = surface_gains(bare)
    assert [gain.part for gain in gains] == sorted((gain.part for gain in gains), reverse=True)
    assert sum(gain.part for gain in gains) == pytest.approx(2.0, rel=1e-12)
    rows = max(gain.row for gain in gains) + 1
    for gain in (gains[0], gains[-1]):
        entries = ["quarter-wave:550:ideal" if k == gain.row else "none" for k in range(rows)]
        path = tmp_path / f"row{gain.row}.toml"
        path.write_text(f"rows = {json.dumps(entries)}\n")
        left = swept(str(path))[0].throughput_mm2 / total
        # the other ghosts pass the surface one to three times, and gain its bare reflectance, below 0.07, each time;
        # rays that are not normal leave some reflection
        assert 1.0 - gain.part - 1e-9 <= left <= (1.0 - gain.part) / (1.0 - 0.07) ** 3 + 1e-3


def test_fields_lie_in_the_direction_of_the_light():
    """A field of 60 degrees on the diagonal was one of 53: field angles do not add as the sides of a right angle do."""
    assert along((0.0, 0.0), (5.0,)) == ((5.0, 0.0),)
    assert along((0.0, -3.0), (0.0, 5.0)) == ((0.0, 0.0), (0.0, -5.0))
    towards = np.degrees(np.arctan2(np.tan(np.radians(-20.0)), np.tan(np.radians(30.0))))
    for angle, found in zip((0.5, 10.0, 60.0, 89.0), along((30.0, -20.0), (0.5, 10.0, 60.0, 89.0)), strict=True):
        assert found == pytest.approx(field_angles(angle, towards), rel=1e-12)


def test_axes():
    axes = sweep_axes(["field=0:1:0.1", "fstop=2.8, 8"])
    assert len(axes.field) == 11
    assert axes.field[-1] == pytest.approx(1.0)
    assert (axes.fstop, axes.wavelength) == ((2.8, 8.0), None)
    for text, said in (
        ("focus=1", "is no axis"), ("field", "is no axis"), ("field=a", "is no list"), ("field=0:5", "is no list"),
        ("field=5:0:1", "the step must be above 0"), ("field=0:80:1e-9", "more than 1000 combinations"),
        ("field=0:95:5", "between 0 and 90"), ("wavelength=300", "is not visible"), ("fstop=0", "f-number"),
        ("field=nan", "is no list"),
    ):  # fmt: skip
        with pytest.raises(FlarewrightError, match=said):
            sweep_axes([text])
    with pytest.raises(FlarewrightError, match="given twice"):
        sweep_axes(["field=1", "field=2"])


@pytest.mark.usefixtures("few_rays")
def test_the_command_prints_a_table_json_and_csv(tmp_path, capsys):
    words = ["ghosts", singlet_file(tmp_path), "--light", "5,0", "--sweep", "field=0,5", "--sweep", "fstop=16"]
    assert run([*words, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert len(data["points"]) == 2
    assert run([*words, "--csv"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    flux = sum(float(row["throughput_mm2"]) for row in rows if row["path"] != "direct")
    assert flux == pytest.approx(sum(point["ghosts_throughput_mm2"] for point in data["points"]), rel=1e-12)
    assert run(words[:-2]) == 0
    assert "of ghost light" in capsys.readouterr().out
    assert run([*words, "--brightest", "3"]) == 2
    assert "leave it out" in capsys.readouterr().err


def test_without_a_direct_image_no_ghost_is_called_the_brightest(capsys):
    """Peaks are relative to the direct image, so at 60 degrees, where it is cut off, there are none to compare."""
    words = ["ghosts", "heliar-tronnier", "--light", "60,0", "--sweep", "field=60"]
    assert run([*words, "--json"]) == 0
    surfaces = json.loads(capsys.readouterr().out)["surfaces"]
    assert surfaces
    assert {surface["brightest"] for surface in surfaces} == {None}
    assert run(words) == 0
    table = capsys.readouterr().out
    point = next(line for line in table.splitlines() if "587.56" in line)
    assert [cell.strip() for cell in point.split("│")[5:8]] == ["-", "-", "-"]
    assert {line.split("│")[4].strip() for line in table.splitlines() if "%" in line and "│" in line} == {"-"}
