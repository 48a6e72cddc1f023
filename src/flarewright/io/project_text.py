"""Writing a project as TOML: exact for the machine, and with comments that teach for a person."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, cast

from ..errors import ProjectError
from ..model import Art, Dirt, Light, Starburst
from ..model import project as choices
from ..model.project import CoatingChoice, Project
from .coating_text import UNCOATED, format_coating
from .spectrum_text import spectrum_text

LENS_SUFFIXES = (".toml", ".lens", ".json", ".zmx", ".seq")
"""What ends like this is a lens file; any other word without a slash is a shipped lens' name."""

HOLDOUT_FILES = ("image", "depth")
FILES = (("iris", "mask"), ("dirt", "image"), ("holdout", *HOLDOUT_FILES))
"""Sections, and their keys that name files."""

_TAUGHT = ("camera", "quality", "output")

ABOUT = {
    "lens": "a shipped lens (`flarewright lenses`), or a lens file beside this project",
    "f_number": "2.8   # left out: wide open",
    "coating": '"lens", "none", "preset:NAME", "quarter-wave:NM" or a file, on every glass-air surface',
    "iris": "left out: the lens file's blades",
    "zoom": '35.0   # a focal length in mm, or "wide", a position of the lens file; left out: as its rows stand',
    "filter": '"N-BK7:2:5"   # a plane filter in front: glass, thickness, gap to the lens, mm',
    "imperfection": "{ seed = 1, decentre_um = 10.0, tilt_arcmin = 1.0, figure_nm = 0.0 }   # one sample of the lens; "
    "also: ghost_offset_mm, by hand",
    "camera.cover_glass": '"N-BK7:2:0.5"   # plane glass in front of the sensor, with its gap to the sensor, mm',
    "camera.sensor_reflectance": "part of the light that the sensor mirrors back",
    "camera.sensor_grating": "{ period_um = 8.0, fill = 0.7, orders = 3 }   # its pixels diffract what it reflects",
    "camera.squeeze": "2.0   # of an anamorphic lens; left out: the lens file's",
    "camera.desqueeze": "true: drawn wide, for size_px as shown",
    "iris.blades": "0 is round",
    "iris.mask": '"iris.png"   # an image instead of blades, white transmits',
    "lights.field_deg": "degrees right and up in the picture",
    "lights.distance": "2000.0   # mm in front of the first vertex; left out: so far away that its rays are parallel",
    "lights.shape": '{ kind = "rectangle", size_deg = [4.0, 3.0], rotation_deg = 15.0 }   # or "polygon", corners_deg',
    "lights.holdout": '{ image = "leaves.png", invert = true }   # what hides this light alone',
    "lights.intensity": "irradiance on a plane that faces the light",
    "lights.diameter_deg": "across the light's disc: 0.53 for the sun, 0 for a point",
    "iris.roughness_um": "rms of the blades' edges",
    "lights.spectrum": '"d65", "equal-energy", "black-body:3200", "lines:589.0,589.6", "rgb:1,0.6,0.2" or "lamp.csv"',
    "camera.sensor_mm": "[36.0, 20.25]   # left out: 36 mm wide, square pixels",
    "camera.sensor_distance": "80.0   # last vertex to sensor, mm; left out: the paraxial focus",
    "camera.focus_distance": "2000.0   # mm in front of the first vertex; left out: infinity",
    "quality.mode": '"draft": paraxial matrices, "final": traced ray bundles, "reference": random rays, all orders',
    "quality.wavelengths": "3 for a draft of the colours, 7 to 31 for final pictures",
    "quality.bridge": "draws colours between the traced wavelengths, so that lateral colour shows no steps",
    "quality.tolerance_px": "largest error of a ray's interpolated place, pixels",
    "quality.cull": "part of all ghost light that the faintest ghosts may carry and be left out",
    "quality.screen": "true: no finer than a screen shows it, for a quick look",
    "quality.paths": '"all" or "same-side" of the stop',
    "quality.orders": "4 also draws ghosts of four reflections (final)",
    "quality.order4_limit": "of those, what carries more than this part of the two-reflection light",
    "quality.ringing": '"collins": diffraction in ghosts (final), "frft": Hullin\'s estimate of it, "off"',
    "quality.source_step_deg": "an area light wider than this is traced in parts",
    "quality.seed": "begins the random numbers",
    "quality.reference_error": "where reference quality ends: relative standard error of the ghosts",
    "quality.reference_error_of": '"total": of their flux in the picture, "blocks": of blocks of 16 x 16 pixels',
    "quality.reference_from": 'where rays of area lights begin: "light", "camera", or "auto"',
    "quality.reference_samples": "10000000   # left out: as many points of the front as the error needs",
    "output.layers": '"beauty", "passes" or "ghosts" (one layer a ghost)',
    "output.brightest": "20   # of the single ghosts only so many",
    "output.colorspace": '"rec709" or "acescg", linear',
    "output.gamut": '"keep" negative channels, or "compress" colours until there are none',
    "output.pixel_type": '"half": 16 bits a value, or "float": 32 bits',
}

_TEACH_DIRT = """
# What shapes the starburst besides the iris; docs/diffraction.md.
# [dirt]
# dust_per_mm2 = 0.5
# dust_um = [5.0, 100.0]
# scratches_per_cm2 = 1.0   # also: scratch_um, scratch_mm
# fingerprint = 0.2
# image = "dirt.png"   # a drawing, white transmits
# seed = 1
# in_ghosts = true
# [starburst]
# cats_eye = true   # the pupil as the light finds it, clipped by rims
# size = 1.0   # by hand, as are intensity and spiral_deg
"""

_TEACH_SCATTER = """
# What the surfaces scatter; docs/scatter.md. Left out: as the lens file says, which is nothing for shipped lenses.
# [scatter]
# model = "harvey-shack"   # or "abg", "chaumond", "none"
# roughness_nm = 1.0   # also: correlation_um, slope
# cleanliness_level = 300.0   # dust by IEST-STD-CC1246
# abg = [2e-5, 1e-3, 2.0]   # for "abg": A, B, g
# share = 0.001   # for "chaumond": of the light, at every surface
# [[scatter.rows]]   # exceptions
# row = 0
# roughness_nm = 5.0
"""

_TEACH_HOLDOUT = """
# What hides lights, as an image in the picture's frame; docs/sources.md. A light may have one of its own.
# [holdout]
# image = "matte.png"   # white lets light through
# depth = "depth.exr"   # instead: what is nearer than a light hides it
# depth_unit_mm = 1000.0
# invert = true   # the image's white hides
# overscan = 1.2   # the image covers so many times the picture
"""

_TEACH_ART = """
# Changes by hand, on top of the physics; docs/art-direction.md. art.physical = true ignores them.
# [art.gain]
# ghosts = 2.0
# [[art.rules]]
# select = "7-3"   # or "all", "row:7", "brightest:5", "largest:10", "bounded:stop", "not 7-3"
# gain = 0.5   # also: enable, tint, ramp, offset_px, offset_mm, scale, blur_px, blur_mm
"""


def project_text(project: Project, *, folder: Path | None = None, comments: bool = False) -> str:
    """Return a project as TOML that `read_project` reads back to the same project.

    Parameters
    ----------
    project : Project
    folder : path, optional
        The folder that the text will lie in: files are named relative to it. None keeps paths as they are.
    comments : bool
        Teach: a comment beside the keys, and the keys that are left out as comments.

    Returns
    -------
    str
    """
    data = project_data(project, folder)
    nothing = _left_out(project) if comments else {}
    out: list[str] = []
    _emit_table(out, data, (), nothing, ABOUT if comments else {})
    teach = _TEACH_ART if comments and project.art == Art() else ""
    if comments and project.holdout is None:
        teach = _TEACH_HOLDOUT + teach
    if comments and project.scatter is None:
        teach = _TEACH_SCATTER + teach
    if comments and "dirt" not in data and "starburst" not in data:
        teach = _TEACH_DIRT + teach
    return "\n".join(out).strip() + "\n" + teach


def toml_text(data: dict[str, Any]) -> str:
    """Return a table as TOML, its own keys before its sub-tables."""
    out: list[str] = []
    _emit_table(out, data, (), {}, {})
    return "\n".join(out).strip() + "\n"


def project_data(project: Project, folder: Path | None = None) -> dict[str, Any]:
    """Return a project as its file says it: short texts where there are some, nothing that is None.

    Parameters
    ----------
    project : Project
    folder : path, optional
        As in `project_text`.

    Returns
    -------
    dict
    """
    data = cast(dict[str, Any], _without_none(project.model_dump(mode="json")))
    if folder is not None:
        _make_relative(data, folder)
    data["coating"] = _short_coating(project.coating)
    for section, plain in (("dirt", Dirt()), ("starburst", Starburst())):
        if getattr(project, section) == plain:
            del data[section]
    if project.art == Art():
        del data["art"]
    else:
        # what a rule leaves alone is not worth a line
        rules = [rule.model_dump(mode="json", exclude_defaults=True) for rule in project.art.rules]
        data["art"] = {**data["art"], "rules": rules}
    if project.design is not None:
        data["design"] = _without_none(project.design.model_dump(mode="json", exclude_defaults=True))
    for written, light in zip(data["lights"], project.lights, strict=True):
        written["spectrum"] = spectrum_text(light.spectrum) or written["spectrum"]
        if not light.keyframes:
            del written["keyframes"]
    return data


def _make_relative(data: dict[str, Any], folder: Path) -> None:
    def relative(name: str) -> str:
        return Path(os.path.relpath(name, folder)).as_posix() if not Path(name).is_absolute() else name

    if isinstance(data["lens"], str) and lens_location(data["lens"], Path("x")) != data["lens"]:
        data["lens"] = relative(data["lens"])
        if "/" not in data["lens"] and not data["lens"].lower().endswith(LENS_SUFFIXES):
            data["lens"] = f"./{data['lens']}"
    hiding = [light["holdout"] for light in data["lights"] if "holdout" in light]
    tables = [(data[section], keys) for section, *keys in FILES if section in data]
    for table, keys in [*tables, *((table, HOLDOUT_FILES) for table in hiding)]:
        table.update({key: relative(table[key]) for key in keys if table.get(key)})


def _short_coating(choice: CoatingChoice) -> str | dict[str, Any]:
    match choice:
        case choices.AsLens():
            return "lens"
        case choices.Preset():
            return f"preset:{choice.name}"
        case choices.Everywhere():
            return format_coating(choice.coating)
        case choices.InTurn():
            return {"kind": "in-turn", "coatings": [format_coating(item) for item in choice.coatings]}
        case choices.PerRow():
            texts = [UNCOATED if item is None else format_coating(item) for item in choice.coatings]
            return {"kind": "per-row", "coatings": texts}


def _without_none(value: Any) -> Any:
    """TOML has no null: leave such keys out; inside a list of coatings, "-" stands for it."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [UNCOATED if item is None else _without_none(item) for item in value]
    return value


def _left_out(project: Project) -> dict[tuple[str, ...], list[str]]:
    """Return by section the keys whose value is None and which are worth a commented line."""
    found: dict[tuple[str, ...], list[str]] = {}
    records = [("", project), ("iris", project.iris), *((name, getattr(project, name)) for name in _TAUGHT)]
    for section, record in records:
        for name in () if record is None else type(record).model_fields:
            if getattr(record, name) is None and f"{section}.{name}".strip(".") in ABOUT:
                found.setdefault((section,) if section else (), []).append(name)
    # lights share their words: a key is taught where none of them has it
    unsaid = [name for name in Light.model_fields if all(getattr(light, name) is None for light in project.lights)]
    found["lights",] = [name for name in unsaid if f"lights.{name}" in ABOUT]
    return found


def _emit_table(
    out: list[str],
    table: dict[str, Any],
    path: tuple[str, ...],
    left_out: dict[tuple[str, ...], list[str]],
    about: dict[str, str],
) -> None:
    """Append a table's own keys, then its sub-tables under their headings."""
    below: list[tuple[str, Any]] = []
    for key, value in table.items():
        if isinstance(value, dict) or (
            isinstance(value, list) and value and all(isinstance(item, dict) for item in value)
        ):
            below.append((key, value))
            continue
        # where a key is left out its words begin with an example
        note = about.get(".".join((*path, key)), "").split("   # ")[-1]
        out.append(f"{_key(key)} = {_value(value)}" + (f"   # {note}" if note else ""))
    for key in left_out.get(path, ()):
        if key != "iris":
            out.append(f"# {key} = {about['.'.join((*path, key))]}")
    for key, value in below:
        heading = ".".join(_key(part) for part in (*path, key))
        for item in value if isinstance(value, list) else [value]:
            out.extend(["", f"[[{heading}]]" if isinstance(value, list) else f"[{heading}]"])
            _emit_table(out, item, (*path, key), left_out, about)


def _key(key: str) -> str:
    plain = key.replace("-", "").replace("_", "")
    return key if plain.isalnum() and plain.isascii() else _value(key)


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            # JSON's string escapes are TOML's, except for DEL, which TOML wants escaped.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case int() | float():
            return repr(value)
        case list():
            return "[" + ", ".join(_value(item) for item in value) + "]"
        case dict():
            return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    raise ProjectError(f"a project cannot hold {value!r}")


def lens_location(name: str, folder: Path) -> str:
    """Return a shipped lens' name as it is, and a file's name as a path from the working folder."""
    is_file = name.lower().endswith(LENS_SUFFIXES) or "/" in name or "\\" in name
    return str(folder / name) if is_file else name
