"""Lenses of Optiland (`.json`): reader and writer.

The file holds `aperture`, `fields` and `surface_group`, whose surfaces have a geometry (Plane, StandardGeometry,
EvenAsphere, OddAsphere, BiconicGeometry or ToroidalGeometry with a position `cs`), the material behind (AbbeMaterial,
Material or IdealMaterial), `is_stop` and `aperture`. Object and image are surfaces, too. Its BiconicGeometry adds the
sags of two profiles, which is the biconic form only for a cylinder. Source: files that the program saves, and its
documentation.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from ....errors import LensError
from ....model import Lens, Medium, Stop, Surface
from ....model.lens.prescription import MOST_TERMS
from ....model.lens.raw_lens import RawSequence, SequenceRow
from ....sentences import shorten
from ...files.door import sentences_for, shown
from ...files.text_file import read_json
from .. import media
from ..foreign_file import INFINITE, MOST_SURFACES, json_number, largest_field, lens_errors, sequence_row, whole
from ..glass_catalogue import F_D_C_UM
from ..lens_fields import CURVATURE
from ..medium_names import numbered_medium

_ROUNDED = 1e-6
_GEOMETRIES = ("Plane", "StandardGeometry", "EvenAsphere", "OddAsphere", "BiconicGeometry", "ToroidalGeometry")
_FREE = {"type": "IdealMaterial", "propagation_model": {"class": "HomogeneousPropagation"}, "index": 1.0, "absorp": 0.0}
_Findings = list[tuple[int, media.Finding]]


def read_optiland(path: str | Path) -> RawSequence:
    """Read a lens that Optiland saved; each glass gets its dispersion.

    Raises
    ------
    LensError
        When the file cannot be read or is not supported; `problems` gives each surface by its number, the object is 0.
    """
    problems: list[str] = []
    with lens_errors():
        data = read_json(path, "a lens of Optiland", foreign=True)
        with sentences_for(path, "a lens of Optiland"):
            raw = _sequence(Path(path), data, problems)
    return whole(path, raw, problems)


def _sequence(path: Path, data: Any, problems: list[str]) -> RawSequence | None:
    group = data.get("surface_group") if isinstance(data, dict) else None
    surfaces = group.get("surfaces") if isinstance(group, dict) else None
    if not isinstance(surfaces, list) or not 4 <= len(surfaces) <= MOST_SURFACES:
        problems.append("it has no surfaces of object, lens and image (surface_group): is it a lens of Optiland?")
        return None
    if not all(isinstance(entry, dict) and isinstance(entry.get("geometry"), dict) for entry in surfaces):
        problems.append("a surface has no geometry: is it a lens of Optiland?")
        return None
    findings: _Findings = []
    remarks: list[str] = []
    places = [json_number(_part(entry["geometry"], "cs").get("z")) for entry in surfaces]
    if None in places[1:]:
        problems.append("a surface has no place (geometry, cs, z)")
        return None
    z = [0.0 if value is None else value for value in places]
    gaps = [_gap(entry, after - before) for entry, (before, after) in zip(surfaces[:-1], pairwise(z), strict=True)]
    rows = [_row(k, surfaces[k], gaps[k], problems, findings, remarks) for k in range(1, len(gaps))]
    if _medium(0, _part(surfaces[0], "material_post"), problems, findings) is not None:
        problems.append("surface 0: the lens stands in a medium: Flarewright traces light that comes through air")
    if problems:
        return None
    kept = tuple(row for row in rows if row is not None)
    name = " ".join(data["name"].split()) if isinstance(data.get("name"), str) else ""
    distance = z[1] - z[0] if places[0] is not None else math.inf
    for key in ("pickups", "apodization"):
        if data.get(key):
            remarks.append(f"{key} of the file left out")
    opening, found = _opening(_part(data, "aperture"))
    return RawSequence(
        file=shown(path.name), name=name or shown(path.stem), rows=kept,
        stop_semi_diameter=next((row.surface.semi_diameter for row in kept if row.stop), None),
        focus_distance=distance if 0.0 < distance < INFINITE else None, **opening, **_field(_part(data, "fields")),
        remarks=(*remarks, *found, *media.remarks(findings, "surface")),
    )  # fmt: skip


def _row(
    k: int, entry: Mapping[str, Any], gap: float, problems: list[str], findings: _Findings, remarks: list[str]
) -> SequenceRow | None:
    where, before = f"surface {k}", len(problems)
    geometry, interaction = _part(entry, "geometry"), _part(entry, "interaction_model")
    kind = geometry.get("type")
    if kind not in _GEOMETRIES:
        problems.append(f"{where} is of type {shorten(kind)}; known are {', '.join(_GEOMETRIES)}")
        return None
    if interaction.get("is_reflective"):
        problems.append(f"{where} is a mirror: reflecting surfaces are not supported")
    if interaction.get("type", "RefractiveReflectiveModel") != "RefractiveReflectiveModel":
        problems.append(f"{where}: {shorten(interaction.get('type'))} is not supported, only refraction is")
    if interaction.get("coating"):
        remarks.append(f"{where}: its coating is left out")
    if any(_part(geometry, "cs").get(key) for key in ("x", "y", "rx", "ry", "rz")):
        problems.append(f"{where} is tilted or shifted, which is not supported")
    values = _shape(where, str(kind), geometry, problems)
    medium = _medium(k, _part(entry, "material_post"), problems, findings)
    aperture = entry.get("aperture")
    rim = None
    if isinstance(aperture, dict):
        rim = json_number(aperture.get("r_max")) if aperture.get("type") == "RadialAperture" else None
        if rim is None or aperture.get("r_min"):
            remarks.append(f"{where}: an aperture that is not round or annular is simplified")
    stop = bool(entry.get("is_stop"))
    return sequence_row(
        where, problems, before, number=k, stop=stop, **values, thickness=gap, medium=medium, semi_diameter=rim or None
    )


def _gap(entry: Mapping[str, Any], distance: float) -> float:
    """Return the thickness that the file states if it agrees with the places, which rounding changes."""
    stated = json_number(entry.get("thickness"))
    return stated if stated is not None and abs(stated - distance) < _ROUNDED else distance


def _shape(where: str, kind: str, geometry: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    """Return curvatures, conic constants and terms; that of r^2 is refused."""

    def curvature(key: str) -> float:
        value = geometry.get(key, math.inf)
        if isinstance(value, bool) or not isinstance(value, int | float) or value == 0 or math.isnan(value):
            problems.append(f"{where}: {key} is {shorten(value)}, a length was expected")
            return 0.0
        found = 1.0 / value
        CURVATURE.read(found, f"{where}: the curvature", problems)
        return found

    def conic(key: str) -> float:
        value = json_number(geometry.get(key, 0.0))
        if value is None:
            problems.append(f"{where}: {key} is {shorten(geometry[key])}, a number was expected")
        return value or 0.0

    if kind == "BiconicGeometry":
        found = {
            "curvature": curvature("radius_y"), "conic": conic("conic_y"), "curvature_x": curvature("radius_x"),
            "conic_x": conic("conic_x"),
        }  # fmt: skip
        if found["curvature"] and found["curvature_x"]:
            problems.append(
                f"{where}: a BiconicGeometry with a curvature in both meridians, whose sags Optiland adds, is not "
                "supported; give a ToroidalGeometry or a cylinder"
            )
        return found
    if kind == "ToroidalGeometry":
        return {
            "curvature": curvature("radius_y"), "conic": conic("conic_yz"), "curvature_x": curvature("radius_x"),
            "torus": True, "asphere": _terms(where, geometry, "coeffs_poly_y", ("y^2",), "y", problems)[1:],
        }  # fmt: skip
    values: dict[str, Any] = {"curvature": curvature("radius"), "conic": conic("conic")}
    if kind not in ("EvenAsphere", "OddAsphere"):
        return values
    zero = ("r^2",) if kind == "EvenAsphere" else ("r", "r^2")
    terms, step = _terms(where, geometry, "coefficients", zero, "r", problems), len(zero)
    values["asphere"] = terms[2 * step - 1 :: step]
    if step == 2:
        values["odd_asphere"] = terms[2::2]
    return values


def _terms(
    where: str, geometry: Mapping[str, Any], key: str, zero: tuple[str, ...], variable: str, problems: list[str]
) -> tuple[float, ...]:  # fmt: skip
    """Return all coefficients of a sag; the first ones, of the powers `zero`, must be 0."""
    stated, most = geometry.get(key, []), len(zero) * (MOST_TERMS + 1)
    numbers = [json_number(value) for value in stated] if isinstance(stated, list) else [None]
    if None in numbers or len(numbers) > most or any(numbers[: len(zero)]):
        problems.append(
            f"{where}: its {key} must be numbers of {' and '.join(zero)}, which must be 0, to "
            f"{variable}^{2 * MOST_TERMS + 2}"
        )
    return tuple(value or 0.0 for value in numbers[:most])


def _medium(k: int, material: Mapping[str, Any], problems: list[str], findings: _Findings) -> Medium | None:
    kind, where = material.get("type"), f"surface {k}"
    if kind == "Material" and isinstance(material.get("name"), str):
        return numbered_medium(material["name"], None, None, where, problems, findings, k)
    index, abbe = json_number(material.get("index")), json_number(material.get("abbe"))
    if kind in ("AbbeMaterial", "IdealMaterial") and index is not None:
        return numbered_medium(None, index, abbe if kind == "AbbeMaterial" else None, where, problems, findings, k)
    problems.append(f"{where}: its material {shorten(kind)} has no name and no index at 587.56 nm")
    return None


def _opening(aperture: Mapping[str, Any]) -> tuple[dict[str, float], list[str]]:
    names = {"imageFNO": "f_number", "EPD": "entrance_pupil_diameter"}
    kind, value = aperture.get("type"), json_number(aperture.get("value"))
    name = names.get(str(kind))
    if name is not None and value is not None and value > 0.0:
        return {name: value}, []
    return {}, [f"the aperture {shorten(kind)} is left out; the stop's size gives the f-number"]


def _field(fields: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest field if the file gives angles."""
    entries = fields.get("fields")
    if _part(fields, "field_definition").get("field_type") != "AngleField" or not isinstance(entries, list):
        return {}
    points = [one for one in entries if isinstance(one, dict)]
    largest = largest_field(*([json_number(one.get(axis)) for one in points] for axis in "xy"))
    return {"field_deg": largest} if 0.0 < largest < 90.0 else {}


def _part(data: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = data.get(key)
    return value if isinstance(value, dict) else {}


def optiland_text(lens: Lens, sensor_distance: float, stop_semi_diameter: float) -> str:
    """Return a lens as a file that Optiland loads.

    Parameters
    ----------
    lens : Lens
        All semi-diameters known.
    sensor_distance : float
        Last vertex to sensor, mm.
    stop_semi_diameter : float
        mm.

    Returns
    -------
    str
        JSON with `Infinity`, as Optiland writes it; glasses by n_d and V_d.

    Raises
    ------
    LensError
        A surface has aspheric terms and different curvatures in its meridians.
    """
    distance = lens.focus_distance
    start = -math.inf if distance is None else -distance
    surfaces: list[dict[str, Any]] = [
        {"type": "ObjectSurface", "geometry": _plane(start), "material_post": _FREE, "comment": ""}
    ]
    z = 0.0
    for k, row in enumerate(lens.rows):
        gap = row.thickness if k < len(lens.rows) - 1 else sensor_distance
        stop = isinstance(row, Stop)
        rim = stop_semi_diameter if isinstance(row, Stop) else row.semi_diameter
        surfaces.append(
            _entry(_plane(z) if isinstance(row, Stop) else _geometry(k, row, z), gap, stop)
            | {"material_post": _FREE if isinstance(row, Stop) else _material(row.medium)}
            | {"aperture": None if rim is None else {"type": "RadialAperture", "r_max": rim, "r_min": 0.0}}
        )
        z += gap
    surfaces.append(_entry(_plane(z), 0.0, False) | {"material_post": _FREE, "aperture": None})
    half = lens.field_deg or 0.0
    data = {
        "version": 1.0,
        "name": lens.name,
        "aperture": {"type": "imageFNO", "value": lens.f_number},
        "fields": {
            "fields": [{"x": 0.0, "y": part * half, "vx": 0.0, "vy": 0.0, "weight": 1.0} for part in (0.0, 0.7, 1.0)],
            "telecentric": False,
            "field_definition": {"field_type": "AngleField"},
        },
        "wavelengths": {
            "wavelengths": [
                {"value": um, "is_primary": um == F_D_C_UM[1], "unit": "um", "weight": 1.0} for um in F_D_C_UM
            ],
            "polarization": "ignore",
        },
        "apodization": None,
        "pickups": [],
        "solves": {"solves": []},
        "surface_group": {"surfaces": surfaces},
    }
    return json.dumps(data, indent=1) + "\n"


def _plane(z: float) -> dict[str, Any]:
    return {"type": "Plane", "cs": _place(z), "radius": math.inf}


def _place(z: float) -> dict[str, Any]:
    return {"x": 0.0, "y": 0.0, "z": z, "rx": 0.0, "ry": 0.0, "rz": 0.0, "reference_cs": None}


def _geometry(k: int, row: Surface, z: float) -> dict[str, Any]:
    radius = 1.0 / row.curvature if row.curvature else math.inf
    steps = {"tol": 1e-10, "max_iter": 100}
    if row.toroidal:
        if row.terms and not row.torus:
            raise LensError(
                f"row {k} has different curvatures in its meridians and aspheric terms, which a .json cannot hold"
            )
        across, conic = row.meridian_x
        if row.torus:
            return {
                "type": "ToroidalGeometry", "cs": _place(z), **steps, "radius": radius, "conic": 0.0,
                "radius_x": 1.0 / across if across else math.inf, "radius_y": radius, "conic_yz": row.conic,
                "coeffs_poly_y": [0.0, *row.asphere],
            }  # fmt: skip
        if across and row.curvature:
            raise LensError(
                f"row {k} has a curvature in both meridians, whose biconic form a .json cannot hold; make it a torus, "
                "or write a .zmx or .toml file"
            )
        return {
            "type": "BiconicGeometry", "cs": _place(z), **steps, "radius_x": 1.0 / across if across else math.inf,
            "radius_y": radius, "conic_x": conic, "conic_y": row.conic,
        }  # fmt: skip
    if any(row.odd_asphere):
        # its terms are those of r, r^2, r^3, ...
        return {
            "type": "OddAsphere", "cs": _place(z), "radius": radius, "conic": row.conic, **steps,
            "coefficients": [row.terms.get(n, 0.0) for n in range(1, max(row.terms) + 1)],
        }  # fmt: skip
    if any(row.asphere):
        return {
            "type": "EvenAsphere", "cs": _place(z), "radius": radius, "conic": row.conic, **steps,
            "coefficients": [0.0, *row.asphere],
        }  # fmt: skip
    if row.curvature == 0.0:
        return _plane(z)
    return {"type": "StandardGeometry", "cs": _place(z), "radius": radius, "conic": row.conic}


def _material(medium: Medium | None) -> dict[str, Any]:
    if medium is None or medium.v_d is None:
        return _FREE | {"index": 1.0 if medium is None else medium.n_d}
    kind = {"type": "AbbeMaterial", "propagation_model": _FREE["propagation_model"]}
    return kind | {"index": medium.n_d, "abbe": medium.v_d, "model": "buchdahl"}


def _entry(geometry: dict[str, Any], gap: float, stop: bool) -> dict[str, Any]:
    interaction = {"type": "RefractiveReflectiveModel", "is_reflective": False, "coating": None, "bsdf": None}
    entry = {"type": "Surface", "thickness": gap, "geometry": geometry, "is_stop": stop}
    return entry | {"comment": "", "interaction_model": interaction}
