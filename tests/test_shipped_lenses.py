"""The shipped prescriptions, checked by a small separate tracer in plain Python, without Flarewright's optics."""

from __future__ import annotations

import math
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from flarewright.io.lens.toml_lens import read_lens_toml

FOLDER = Path(__file__).parents[1] / "src" / "flarewright" / "lenses"
FILES = sorted(FOLDER.glob("*.toml"))
NAMES = [file.stem for file in FILES]

# efl and bfl at n_d from physics.md, with its number of digits; None: not stated there
KNOWN = {
    "heliar-tronnier": (99.235796, 81.315056, 1e-6),
    "canon-28-80": (35.8423, 38.3787, 1e-4),
    "tessar-brendel": (99.96, 79.77, 1e-2),
    "nikon-28-75": (28.90, None, 1e-2),
    "angenieux-50-f1.1": (49.99, None, 1e-2),
}

GHOSTS = {"heliar-tronnier": (28, 13), "tessar-brendel": (21, 9), "canon-28-80": (351, 171)}

KINDS = {
    "triplet-pestrecov",
    "double-gauss-tronnier",
    "flektogon-35",  # retrofocus
    "nikkor-180-ed",  # telephoto
    "canon-70-200-wide",
    "canon-70-200-tele",
    "nikkor-85-f1.4",  # modern fast prime
    "fisheye-nikkor-10.5",
    "petzval-kodak",
}


def load(name: str) -> dict[str, Any]:
    """Parse a shipped file without checks."""
    with open(FOLDER / f"{name}.toml", "rb") as stream:
        return tomllib.load(stream)


def is_stop(row: dict[str, Any]) -> bool:
    """Return whether the row is the stop."""
    return bool(row.get("stop", False))


def curvature(row: dict[str, Any]) -> float:
    """Return the curvature of a row; 0 for the stop and flat surfaces."""
    return 0.0 if is_stop(row) or row["radius"] == "flat" else 1.0 / row["radius"]


def focal_lengths(rows: list[dict[str, Any]]) -> tuple[float, float]:
    """Return effective and back focal length from a paraxial ray from infinity."""
    y, u, n = 1.0, 0.0, 1.0
    for k, row in enumerate(rows):
        behind = n if is_stop(row) else row.get("n_d", 1.0)
        u = (n * u - y * (behind - n) * curvature(row)) / behind
        n = behind
        if k + 1 < len(rows):
            y += row["thickness"] * u
    return -1.0 / u, -y / u


def heights_on_axis(rows: list[dict[str, Any]], height: float) -> tuple[list[float], float]:
    """Return the heights of an exact meridional ray parallel to the axis at every row, and its axial crossing."""
    y, sine, n = height, 0.0, 1.0  # sine of the ray's angle to the axis, positive upwards
    heights = []
    sag = 0.0  # distance of the ray's point behind the vertex of its row
    for k, row in enumerate(rows):
        c = curvature(row)
        cosine = math.sqrt(1.0 - sine * sine)
        if k:
            to_plane = (rows[k - 1]["thickness"] - sag) / cosine
            y += to_plane * sine
            sag = 0.0
        # exact distance from the vertex plane to the sphere, in a form that is valid for c = 0
        a = c * y * y
        b = cosine - c * y * sine
        step = a / (b + math.sqrt(b * b - c * a)) if c else 0.0
        y += step * sine
        sag = step * cosine
        heights.append(abs(y))
        if not is_stop(row):
            behind = row.get("n_d", 1.0)
            angle, normal = math.asin(sine), math.asin(-c * y)
            sine = math.sin(normal + math.asin(n / behind * math.sin(angle - normal)))
            n = behind
    return heights, sag - y * math.sqrt(1.0 - sine * sine) / sine


def test_at_least_twelve_lenses_ship() -> None:
    """At least twelve; each file name is in lower case without spaces."""
    assert len(FILES) >= 14
    assert set(KNOWN) | KINDS <= set(NAMES)
    assert all(name == name.lower() and " " not in name for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_focal_length_is_the_stated_one(name: str) -> None:
    """Within 1 %, by this file's trace."""
    lens = load(name)
    efl, bfl = focal_lengths(lens["rows"])
    assert efl == pytest.approx(lens["stated_focal_length"], rel=0.01)
    assert bfl > 0.0


@pytest.mark.parametrize("name", KNOWN)
def test_check_values_of_the_physics_page(name: str) -> None:
    """The numbers on the project's physics page."""
    efl, bfl, digits = KNOWN[name]
    found = focal_lengths(load(name)["rows"])
    assert found[0] == pytest.approx(efl, abs=digits)
    if bfl is not None:
        assert found[1] == pytest.approx(bfl, abs=digits)


@pytest.mark.parametrize("name", NAMES)
def test_a_source_is_named(name: str) -> None:
    """Every lens names its patent by country and number."""
    source = load(name)["source"]
    assert source.split()[0] in {"US", "DE", "GB", "JP"}
    assert any(character.isdigit() for character in source)


@pytest.mark.parametrize("name", NAMES)
def test_the_reader_accepts_it(name: str) -> None:
    """No problems, the same rows, and nothing of the file lost."""
    table = load(name)
    lens = read_lens_toml(FOLDER / f"{name}.toml").lens
    assert len(lens.rows) == len(table["rows"])
    assert [row.thickness for row in lens.rows] == [row["thickness"] for row in table["rows"]]
    assert is_stop(table["rows"][lens.stop_row])
    assert lens.f_number == table["f_number"]
    assert set(lens.coating_presets) == set(table.get("coating_presets", {}))


@pytest.mark.parametrize("name", NAMES)
def test_presets_leave_cemented_surfaces_bare(name: str) -> None:
    """One entry per row; the thesis' preset coats every row and is kept unchanged."""
    table = load(name)
    rows = table["rows"]
    for preset, coatings in table.get("coating_presets", {}).items():
        assert len(coatings) == len(rows)
        if preset == "thesis":
            continue
        if preset == "period" and name in ("biotar-50-f1.4", "speed-panchro-50"):
            # older than coatings
            assert set(coatings) == {"none"}
            continue
        before = False
        for row, coating in zip(rows, coatings, strict=True):
            behind = "n_d" in row
            assert (coating != "none") == (before != behind)
            before = behind


@pytest.mark.parametrize("name", NAMES)
def test_light_at_full_aperture_reaches_a_focus(name: str) -> None:
    """An exact ray at the f-number passes every clear radius and crosses the axis near the paraxial focus."""
    lens = load(name)
    rows = lens["rows"]
    efl, bfl = focal_lengths(rows)
    heights, crossing = heights_on_axis(rows, efl / (2.0 * lens["f_number"]))
    for k, (row, height) in enumerate(zip(rows, heights, strict=True)):
        assert height <= row.get("semi_diameter", math.inf), f"row {k}"
    # the Nikon's table is published without the aspheric terms that the zoom needs wide open
    assert abs(crossing - bfl) < (0.1 if name == "nikon-28-75" else 0.01) * efl


@pytest.mark.parametrize("name", NAMES)
def test_neighbouring_surfaces_do_not_cross_within_their_clear_radii(name: str) -> None:
    """Where both clear radii are given, glass and air have no negative thickness at the smaller of them."""
    rows = load(name)["rows"]
    for k, (front, back) in enumerate(pairwise(rows)):
        if "semi_diameter" not in front or "semi_diameter" not in back:
            continue
        h = min(front["semi_diameter"], back["semi_diameter"])
        sags = [curvature(row) * h * h / (1.0 + math.sqrt(1.0 - (curvature(row) * h) ** 2)) for row in (front, back)]
        assert front["thickness"] + sags[1] - sags[0] >= 0.0, f"rows {k} and {k + 1}"


@pytest.mark.parametrize("name", GHOSTS)
def test_ghost_counts(name: str) -> None:
    """Two-reflection paths, all and on the same side of the stop, follow from the rows."""
    rows = load(name)["rows"]
    stop = next(k for k, row in enumerate(rows) if is_stop(row))
    front, rear = stop, len(rows) - 1 - stop
    every = (front + rear) * (front + rear - 1) // 2
    assert (every, front * (front - 1) // 2 + rear * (rear - 1) // 2) == GHOSTS[name]


def test_both_ends_of_the_zoom_have_the_same_glass() -> None:
    """Only the gaps between the groups differ, and the image stays in place."""
    wide, tele = load("canon-70-200-wide")["rows"], load("canon-70-200-tele")["rows"]
    differ = [k for k, (one, other) in enumerate(zip(wide, tele, strict=True)) if one != other]
    assert len(differ) == 4
    for k in differ:
        assert {key: v for key, v in wide[k].items() if key != "thickness"} == {
            key: v for key, v in tele[k].items() if key != "thickness"
        }
        assert "n_d" not in wide[k]
    lengths = [sum(row["thickness"] for row in rows[:-1]) + focal_lengths(rows)[1] for rows in (wide, tele)]
    assert lengths[0] == pytest.approx(lengths[1], abs=0.05)


def test_the_heliar_is_the_one_of_the_thesis() -> None:
    """The stop is row 5, row 6 is flat, and the preset has the nine centre wavelengths."""
    lens = load("heliar-tronnier")
    assert is_stop(lens["rows"][5])
    assert lens["rows"][6]["radius"] == "flat"
    centres = [int(text.removeprefix("quarter-wave:")) for text in lens["coating_presets"]["thesis"]]
    assert centres == [430, 370, 510, 600, 310, 460, 550, 580, 650]
