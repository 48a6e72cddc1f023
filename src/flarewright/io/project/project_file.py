"""Project files: TOML that holds everything a render needs.

```toml
schema_version = 1
lens = "heliar-tronnier"        # a name of the library, or a file in the project's folder

[[lights]]
field_deg = [10.0, 5.0]
spectrum = "black-body:5600"
```

Relative paths (lens, iris mask, coating, spectrum table) start at the project file's folder. A light's `spectrum` and
the project's `coating` can be short texts, as on the command line, or tables.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ...errors import FlarewrightError, LensError, ProjectError, RecordError
from ...model.lens import coating as coatings
from ...model.lens import scatter as scatters
from ...model.lens.imperfection import Imperfection
from ...model.lens.iris import Iris
from ...model.lens.plate import Plate
from ...model.lens.prescription import Lens, Surface
from ...model.project import animation as animations
from ...model.project import art as arts
from ...model.project import design as designs
from ...model.project import light as lights
from ...model.project import project as choices
from ...model.project import starburst as starbursts
from ...model.project.backplate import Backplate, PlateSearch
from ...model.project.camera import Camera
from ...model.project.holdout import Holdout
from ...model.project.project import Output, Project, Quality
from ...sentences import Keys, did_you_mean, shorten, summary, validation_sentences
from ..files.type_slips import record_of
from ..lens.coating_text import coating_from, parse_coating, parse_coating_choice
from ..lens.plate_text import parse_plate
from ..lens.toml_lens import lens_from_table
from .file_of_kind import read_file_of_kind
from .project_text import ABOUT, FILES, HOLDOUT_FILES, lens_location
from .spectrum_text import parse_spectrum

Sections = dict[str, tuple[type[BaseModel], ...]]


def read_project(path: str | os.PathLike[str]) -> Project:
    """Read and check a project file.

    Parameters
    ----------
    path : path
        A TOML file, or an EXR that carries its project.

    Returns
    -------
    Project
        Short texts are parsed; relative paths are resolved from the file's folder.

    Raises
    ------
    ProjectError
        When the file cannot be read or has errors; `problems` then lists all of them.
    """
    path = Path(path)
    return project_from_data(read_file_of_kind(path, "project"), folder=path.parent, where=str(path))


def project_from_data(data: dict[str, Any], *, folder: Path, where: str) -> Project:
    """Return the project of parsed TOML (or JSON).

    Parameters
    ----------
    data : dict
        As read from the file; not changed.
    folder : path
        Base folder of relative paths.
    where : str
        The file's name for messages.

    Raises
    ------
    ProjectError
        When there are errors, with all of them.
    """
    problems: list[str] = []
    expanded = _expanded(data, folder, problems)
    project, wrong = record_of(Project.model_validate, expanded, lambda error: validation_messages(error, expanded))
    problems += wrong
    if project is not None and not problems:
        return project
    raise ProjectError(summary(where, problems), tuple(problems))


def _expanded(data: dict[str, Any], folder: Path, problems: list[str]) -> dict[str, Any]:
    """Return the data with short texts parsed and paths resolved; appends errors to the problems."""
    out = dict(data)
    match out.get("lens"):
        case str(name):
            out["lens"] = lens_location(name, folder)
        case dict(table):
            out["lens"] = _embedded_lens(table, folder, problems)
        case None:
            pass
        case other:
            problems.append(f"lens should be a name, a file or a table, not {shorten(other)}")
            out["lens"] = "?"
    for section, *keys in FILES:
        _expand_paths(out, section, keys, folder)
    output = out.get("output")
    if isinstance(output, dict) and "://" not in str(output.get("ocio_config", "://")):
        _expand_paths(out, "output", ["ocio_config"], folder)
    if "coating" in out:
        try:
            out["coating"] = expand_coating(out["coating"], folder)
        except FlarewrightError as error:
            # error sentences of short texts have this prefix already
            problems.append(str(error) if str(error).startswith("coating ") else f"coating: {error}")
            del out["coating"]
    for section, key in (("", "filter"), ("camera", "cover_glass")):
        _expand_plate(out, section, key, problems)
    if isinstance(out.get("lights"), list):
        out["lights"] = [expand_light(light, f"lights[{k}]", folder, problems) for k, light in enumerate(out["lights"])]
    return out


def _expand_paths(out: dict[str, Any], section: str, keys: list[str], folder: Path) -> None:
    """Resolve the paths in a table relative to the project's folder."""
    table = out.get(section)
    if isinstance(table, dict):
        out[section] = {**table, **{key: str(folder / table[key]) for key in keys if isinstance(table.get(key), str)}}


def _expand_plate(out: dict[str, Any], section: str, key: str, problems: list[str]) -> None:
    """Parse the short text of a plate, "N-BK7:2:5", and that of its coating."""
    table = out.get(section) if section else out
    where = f"{section}.{key}" if section else key
    if not isinstance(table, dict) or key not in table:
        return
    plate = table[key]
    try:
        if isinstance(plate, str):
            plate = parse_plate(plate, where)
        elif isinstance(plate, dict) and isinstance(plate.get("coating"), str):
            plate = {**plate, "coating": parse_coating(plate["coating"])}
    except FlarewrightError as error:
        problems.append(str(error) if isinstance(plate, str) else f"{where}.coating: {error}")
        plate = None
    if section:
        out[section] = {**table, key: plate}
    else:
        out[key] = plate


def _embedded_lens(table: dict[str, Any], folder: Path, problems: list[str]) -> Any:
    """Parse a prescription in the project, as in a lens file or as `project_text` writes it (rows with a kind)."""
    rows = table.get("rows")
    if isinstance(rows, list) and all(isinstance(row, dict) and "kind" in row for row in rows):
        presets = table.get("coating_presets")
        if not isinstance(presets, dict) or not all(isinstance(entries, list) for entries in presets.values()):
            return table
        try:
            read = {name: [coating_from(entry) for entry in entries] for name, entries in presets.items()}
        except FlarewrightError as error:
            problems.append(f"lens.coating_presets: {error}")
            return "?"
        return {**table, "coating_presets": read}
    try:
        return lens_from_table(table, "lens", folder=folder).lens
    except LensError as error:
        problems.extend(f"lens: {problem}" for problem in error.problems or (str(error),))
        return "?"


def expand_coating(value: Any, folder: Path) -> Any:
    """Return a coating with the short texts in it parsed; raises ProjectError for other types."""
    if isinstance(value, str):
        return parse_coating_choice(value, folder=folder)
    if isinstance(value, dict) and isinstance(value.get("coatings"), list):
        return {**value, "coatings": [coating_from(item) for item in value["coatings"]]}
    if isinstance(value, dict) and isinstance(value.get("coating"), str):
        return {**value, "coating": coating_from(value["coating"])}
    if isinstance(value, dict):
        return value
    raise ProjectError(
        f'{shorten(value)} is neither a text nor a table; write "lens", "none", "preset:NAME", "quarter-wave:550" (or '
        "another film), the name of a coating file, or a table that begins with its kind"
    )


def expand_light(light: Any, where: str, folder: Path, problems: list[str]) -> Any:
    """Return a light's table with short texts parsed and paths resolved; appends errors and drops their keys."""
    if isinstance(light, dict):
        light = dict(light)
        _expand_paths(light, "holdout", list(HOLDOUT_FILES), folder)
    if not isinstance(light, dict) or not isinstance(light.get("spectrum"), str):
        return light
    try:
        return {**light, "spectrum": parse_spectrum(light["spectrum"], folder=folder)}
    except FlarewrightError as error:
        problems.append(f"{where}.spectrum: {error}")
        return {key: value for key, value in light.items() if key != "spectrum"}


# ---------------------------------------------------------------------------------------------------------------------
# Findings


def validation_messages(error: ValidationError | RecordError, data: Any, sections: Sections | None = None) -> list[str]:
    """Return one sentence per error of a failed validation.

    Parameters
    ----------
    error : ValidationError or RecordError
    data : object
        The validated data; names places as the file does.
    sections : dict of str to tuple of type, optional
        Record types of each section, for suggestions on unknown keys; None: those of a project.
    """
    return validation_sentences(error, data, lambda keys: _suggestion(keys, sections))


_SECTIONS: Sections = {
    "": (Project,),
    "iris": (Iris,),
    "camera": (Camera,),
    "quality": (Quality,),
    "output": (Output,),
    "lights": (lights.Light,),
    "keyframes": (lights.LightKey,),
    "curves": (animations.LightCurve,),
    "timeline": (animations.Timeline,),
    "shape": (lights.Rectangle, lights.Polygon),
    "filter": (Plate,),
    "cover_glass": (Plate,),
    "imperfection": (Imperfection,),
    "spectrum": (lights.EqualEnergy, lights.D65, lights.BlackBody, lights.Lines, lights.Tabulated, lights.Rgb),
    "coating": (
        choices.Preset, choices.Everywhere, choices.InTurn, choices.PerRow, coatings.QuarterWave, coatings.Film,
        coatings.Standard,
    ),
    "dirt": (starbursts.Dirt,),
    "starburst": (starbursts.Starburst,),
    "scatter": (scatters.Scatter,),
    "holdout": (Holdout,),
    "plate": (Backplate,),
    "search": (PlateSearch,),
    "art": (arts.Art,),
    "rules": (arts.Rule,),
    "lens": (Lens,),
    "rows": (Surface, scatters.RowScatter),
}  # fmt: skip


# sections whose keys are common words; suggestions do not search them
_DESIGN: Sections = {"design": (designs.Design,), "ghost_targets": (designs.GhostTarget,), "bounds": (designs.Bounds,)}


def _suggestion(keys: Keys, sections: Sections | None) -> str:
    wrong = str(keys[-1]) if keys else ""
    section = next((key for key in reversed(keys[:-1]) if isinstance(key, str)), "")
    known = [name for model in (sections or _SECTIONS | _DESIGN).get(section, ()) for name in model.model_fields]
    unfinished = any(name.startswith(f"{wrong}_") for name in known)
    for other, models in (_SECTIONS if sections is None else {}).items():
        if other and not unfinished and any(wrong in model.model_fields for model in models):
            heading = {"lights": "[[lights]]", "rules": "[[art.rules]]"}.get(other, f"[{other}]")
            return f" here; it belongs into {heading}"
    if near := did_you_mean(wrong, known):
        return near
    return f"; known are {', '.join(dict.fromkeys(known))}" if known else ""


def project_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a project file, for validation in text editors."""
    schema = Project.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "Flarewright project"
    spectra = schema["$defs"]["Light"]["properties"]["spectrum"]
    choice = schema["properties"]["coating"]
    for owner, words in ((choice, ABOUT["coating"]), (spectra, ABOUT["lights.spectrum"])):
        accept_text(owner, words)
    _accept_coating_texts(schema["$defs"])
    return schema


def accept_text(node: dict[str, Any], words: str) -> None:
    """Add a short text as an alternative to a schema node."""
    table = {key: node.pop(key) for key in list(node) if key in ("oneOf", "discriminator")}
    node.pop("default", None)
    node |= {"description": words, "anyOf": [{"type": "string"}, table]}


def _accept_coating_texts(node: Any) -> None:
    """Add a short text as an alternative to every coating below a schema node."""
    if isinstance(node, dict):
        if "quarter-wave" in node.get("discriminator", {}).get("mapping", {}):
            accept_text(node, "a table, or a short text like quarter-wave:550")
        else:
            for value in node.values():
                _accept_coating_texts(value)
    elif isinstance(node, list):
        for value in node:
            _accept_coating_texts(value)
