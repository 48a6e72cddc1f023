"""Write projects as TOML, exactly, and optionally with comments that explain the keys."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, cast

from ...errors import ProjectError
from ...model import Art, Dirt, Light, Starburst, Timeline
from ...model.project import project as choices
from ...model.project.project import CoatingChoice, Project
from ..files.file_kind import LENS_SUFFIXES
from ..lens.coating_text import UNCOATED, format_coating
from .spectrum_text import spectrum_text

HOLDOUT_FILES = ("image", "depth")
FILES = (("iris", "mask"), ("dirt", "image"), ("holdout", *HOLDOUT_FILES), ("plate", "image"))
"""Sections, and their keys that hold paths."""

_COMMENTED_SECTIONS = ("camera", "quality", "output")

ABOUT = {
    "lens": "a lens of the library (`flarewright lenses`), or a lens file in this folder",
    "f_number": "2.8   # default: wide open",
    "coating": '"lens", "none", "preset:NAME", "quarter-wave:NM" or a file, on every glass-air surface',
    "iris": "default: the lens file's blades",
    "zoom": '35.0   # a focal length in mm, or "wide", a position of the lens file; default: the gaps of its rows',
    "filter": '"N-BK7:2:5"   # a plane filter in front: glass, thickness, gap to the lens, mm',
    "imperfection": "{ seed = 1, decentre_um = 10.0, tilt_arcmin = 1.0, figure_nm = 0.0 }   # one sample of the lens; "
    "also: ghost_offset_mm, not physical",
    "camera.cover_glass": '"N-BK7:2:0.5"   # plane glass in front of the sensor, with its gap to the sensor, mm',
    "camera.sensor_reflectance": "reflectance of the sensor as a mirror",
    "camera.sensor_grating": "{ period_um = 8.0, fill = 0.7, orders = 3 }   # pixels that diffract reflected light",
    "camera.squeeze": "2.0   # of an anamorphic lens; default: the lens file's",
    "camera.desqueeze": "true: draw the wide picture; size_px is its size",
    "iris.blades": "0 is round",
    "iris.mask": '"iris.png"   # an image instead of blades, white transmits',
    "lights.field_deg": "degrees right and up in the picture",
    "lights.distance": "2000.0   # mm in front of the first vertex; default: infinity",
    "lights.shape": '{ kind = "rectangle", size_deg = [4.0, 3.0], rotation_deg = 15.0 }   # or "polygon", corners_deg',
    "lights.starburst": "false: without its direct image, which a plate shows already",
    "lights.holdout": '{ image = "leaves.png", invert = true }   # hides only this light',
    "lights.motion": '"linear" or "smooth", between keyframes',
    "timeline.fps": "frames per second of a shot",
    "timeline.start": "number of the frame at 0 s",
    "lights.intensity": "irradiance on a plane that faces the light",
    "lights.diameter_deg": "angular diameter: 0.53 for the sun, 0 for a point",
    "iris.roughness_um": "rms roughness of the blade edges",
    "lights.spectrum": '"d65", "equal-energy", "black-body:3200", "lines:589.0,589.6", "rgb:1,0.6,0.2" or "lamp.csv"',
    "camera.sensor_mm": "[36.0, 20.25]   # default: 36 mm wide, square pixels",
    "camera.sensor_distance": "80.0   # last vertex to sensor, mm; default: the paraxial focus",
    "camera.focus_distance": "2000.0   # mm in front of the first vertex; default: infinity",
    "quality.mode": '"draft": paraxial matrices, "final": traced ray bundles, "reference": random rays, all orders',
    "quality.wavelengths": "3 for draft colours, 7 to 31 for final pictures",
    "quality.bridge": "interpolates between the traced wavelengths, so that lateral colour shows no steps",
    "quality.tolerance_px": "largest interpolation error of a ray's position, pixels",
    "quality.cull": "skip the faintest ghosts up to this fraction of all ghost light",
    "quality.screen": "true: only as accurate as a screen shows, for a quick preview",
    "quality.paths": '"all" or "same-side" of the stop',
    "quality.orders": "4 also draws ghosts of four reflections (final)",
    "quality.order4_limit": "draw only those with more than this fraction of the two-reflection light",
    "quality.ringing": '"collins": diffraction in ghosts (final), "frft": Hullin\'s estimate of it, "off"',
    "quality.source_step_deg": "area lights wider than this are traced in parts",
    "quality.seed": "seed of the random numbers",
    "quality.reference_error": "reference quality stops at this relative standard error of the ghosts",
    "quality.reference_error_of": '"total": of their flux in the picture, "blocks": of blocks of 16 x 16 pixels',
    "quality.reference_from": 'start of the rays of area lights: "light", "camera", or "auto"',
    "quality.reference_samples": "10000000   # largest number of points on the front; default: no limit",
    "output.layers": '"beauty", "passes" or "ghosts" (one layer a ghost)',
    "output.brightest": "20   # number of single ghosts",
    "output.colorspace": '"rec709" or "acescg", linear',
    "output.ocio_space": '"scene_linear"   # of the file: a name, role or alias of an OpenColorIO configuration',
    "output.ocio_config": '"show.ocio"   # its configuration; default: that of the variable OCIO, else "ocio://default"',
    "output.gamut": '"keep" negative channels, or "compress" colours to avoid them',
    "output.matte": '"ghosts": a Cryptomatte of the ghosts\' shares of the light, or "none"',
    "output.matte_ranks": "ghosts that it keeps at a pixel, an even number",
    "output.pixel_type": '"half": 16 bits per value, or "float": 32 bits',
    "output.compression": '"zip": lossless, or "dwaa": lossy and smaller',
}

_COMMENTED_DIRT = """
# Starburst and dirt in the pupil; docs/diffraction.md.
# [dirt]
# dust_per_mm2 = 0.5
# dust_um = [5.0, 100.0]
# scratches_per_cm2 = 1.0   # also: scratch_um, scratch_mm
# fingerprint = 0.2
# image = "dirt.png"   # an image of dirt, white transmits
# seed = 1
# in_ghosts = true
# [starburst]
# cats_eye = true   # pupil clipped by rims at the light's field angle
# size = 1.0   # artistic, as are intensity and spiral_deg
"""

_COMMENTED_SCATTER = """
# Surface scatter; docs/scatter.md. Default: that of the lens file (none for lenses of the library).
# [scatter]
# model = "harvey-shack"   # or "abg", "chaumond", "none"
# roughness_nm = 1.0   # also: correlation_um, slope
# cleanliness_level = 300.0   # dust by IEST-STD-CC1246
# abg = [2e-5, 1e-3, 2.0]   # for "abg": A, B, g
# share = 0.001   # for "chaumond": fraction of the light, at every surface
# [[scatter.rows]]   # exceptions
# row = 0
# roughness_nm = 5.0
"""

_COMMENTED_HOLDOUT = """
# What hides lights, as an image in the picture's frame; docs/sources.md. A light can have a separate one.
# [holdout]
# image = "matte.png"   # white lets light through
# depth = "depth.exr"   # instead: objects nearer than a light hide it
# depth_unit_mm = 1000.0
# invert = true   # white hides
# overscan = 1.2   # size of the image relative to the frame
# frame = [0.9, 0.9]   # size of the frame relative to a picture with overscan
"""

_COMMENTED_PLATE = """
# A photograph under the flare, for the editor and for comps; docs/editor.md. A render draws the flare alone.
# [plate]
# image = "street.jpg"
# lights_above = 0.9   # pixels above this are the lights of this project, which have the plate's unit
"""

_COMMENTED_ART = """
# Art direction on top of the physics; docs/art-direction.md. art.physical = true ignores it.
# [art.gain]
# ghosts = 2.0
# [[art.rules]]
# select = "7-3"   # or "all", "row:7", "brightest:5", "largest:10", "bounded:stop", "not 7-3"
# gain = 0.5   # also: enable, tint, ramp, offset_px, offset_mm, scale, blur_px, blur_mm
"""

_COMMENTED_MOTION = """
# Values over time, for `flarewright shot`; docs/shots.md. A light has [[lights.keyframes]] and [[lights.curves]].
# [timeline]
# fps = 24.0
# start = 1001   # number of the frame at 0 s
# [[curves]]
# of = "f_number"   # also: zoom, focus_distance, rotation_deg, gain.ghosts
# at_s = [0.0, 2.0]
# values = [4.0, 8.0]
# motion = "smooth"   # default: "linear"
"""


def project_text(project: Project, *, folder: Path | None = None, comments: bool = False) -> str:
    """Return a project as TOML; `read_project` reads it back unchanged.

    Parameters
    ----------
    project : Project
    folder : path, optional
        Folder of the TOML file: paths are written relative to it. None keeps paths unchanged.
    comments : bool
        Add explanations: a comment after each key, and unset keys as comments.
    """
    data = project_data(project, folder)
    unset_keys = _unset_keys(project) if comments else {}
    out: list[str] = []
    _emit_table(out, data, (), unset_keys, ABOUT if comments else {})
    commented = _COMMENTED_MOTION if comments and not {"curves", "timeline"} & data.keys() else ""
    if comments and project.plate is None:
        commented = _COMMENTED_PLATE + commented
    if comments and project.art == Art():
        commented = _COMMENTED_ART + commented
    if comments and project.holdout is None:
        commented = _COMMENTED_HOLDOUT + commented
    if comments and project.scatter is None:
        commented = _COMMENTED_SCATTER + commented
    if comments and "dirt" not in data and "starburst" not in data:
        commented = _COMMENTED_DIRT + commented
    return "\n".join(out).strip() + "\n" + commented


def toml_text(data: dict[str, Any]) -> str:
    """Return a table as TOML, its keys before its sub-tables."""
    out: list[str] = []
    _emit_table(out, data, (), {}, {})
    return "\n".join(out).strip() + "\n"


def project_data(project: Project, folder: Path | None = None) -> dict[str, Any]:
    """Return a project as the data of its file: short texts where possible, without None.

    Parameters
    ----------
    project : Project
    folder : path, optional
        As in `project_text`.
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
        # omit values of a rule that change nothing
        rules = [rule.model_dump(mode="json", exclude_defaults=True) for rule in project.art.rules]
        data["art"] = {**data["art"], "rules": rules}
    if project.design is not None:
        data["design"] = _without_none(project.design.model_dump(mode="json", exclude_defaults=True))
    for written, light in zip(data["lights"], project.lights, strict=True):
        written["spectrum"] = spectrum_text(light.spectrum) or written["spectrum"]
        if not light.keyframes:
            del written["keyframes"], written["motion"]
        if not light.curves:
            del written["curves"]
    if not project.curves:
        del data["curves"]
    if project.plate is not None:
        own = _without_none(project.plate.model_dump(mode="json", exclude_defaults=True))
        # the path is relative by now
        data["plate"] = own | {"image": data["plate"]["image"]}
    if project.timeline == Timeline():
        del data["timeline"]
    return data


def _make_relative(data: dict[str, Any], folder: Path) -> None:
    # a reader goes up from where the folder really is
    real = os.path.realpath(folder)

    def relative(name: str) -> str:
        return Path(os.path.relpath(os.path.abspath(name), real)).as_posix() if not Path(name).is_absolute() else name

    if isinstance(data["lens"], str) and lens_location(data["lens"], Path("x")) != data["lens"]:
        data["lens"] = relative(data["lens"])
        if "/" not in data["lens"] and not data["lens"].lower().endswith(LENS_SUFFIXES):
            data["lens"] = f"./{data['lens']}"
    config = data["output"].get("ocio_config") if "output" in data else None
    if config and "://" not in config:
        data["output"] = {**data["output"], "ocio_config": relative(config)}
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
    """Remove keys of value None, which TOML lacks; in lists of coatings "-" represents it."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [UNCOATED if item is None else _without_none(item) for item in value]
    return value


def _unset_keys(project: Project) -> dict[tuple[str, ...], list[str]]:
    """Return by section the unset keys that deserve a comment."""
    found: dict[tuple[str, ...], list[str]] = {}
    records = [("", project), ("iris", project.iris), *((name, getattr(project, name)) for name in _COMMENTED_SECTIONS)]
    for section, record in records:
        for name in () if record is None else type(record).model_fields:
            if getattr(record, name) is None and f"{section}.{name}".strip(".") in ABOUT:
                found.setdefault((section,) if section else (), []).append(name)
    # lights share their comments: a key gets one if it is unset in all lights
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
    """Append a table's keys, then its sub-tables under their headings."""
    below: list[tuple[str, Any]] = []
    for key, value in table.items():
        if isinstance(value, dict) or (
            isinstance(value, list) and value and all(isinstance(item, dict) for item in value)
        ):
            below.append((key, value))
            continue
        # comments of unset keys begin with an example value
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
            # JSON's string escapes are TOML's, except for DEL, which TOML requires to escape
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case int() | float():
            return repr(value)
        case list():
            return "[" + ", ".join(_value(item) for item in value) + "]"
        case dict():
            return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    raise ProjectError(f"a project cannot hold {value!r}")


def lens_location(name: str, folder: Path) -> str:
    """Return a name of the library unchanged, and a file as a path from the working folder."""
    is_file = name.lower().endswith(LENS_SUFFIXES) or "/" in name or "\\" in name
    return str(folder / name) if is_file else name
