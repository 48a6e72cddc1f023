"""Look files: settings of a flare for other lenses and lights, from the library or the user."""

from __future__ import annotations

import difflib
import os
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from ...errors import ProjectError, raised_as
from ...model import Iris, Look
from ...model.project.look import CAMERA_KEYS, LIGHT_KEYS, LOOK_SECTIONS
from ...sentences import INVALID, did_you_mean, summary, validation_sentences
from ..files.door import expanded, no_file
from ..files.file_kind import refuse_other_kind
from ..files.text_file import check_version, read_toml
from .project_file import project_from_data
from .project_text import project_data, toml_text

_NEWEST = 1
_EXAMPLE_KEYS = ("schema_version", "name", "notes", "lens", "zoom")
"""Keys of a look file that do not belong to the look: its texts, and the lens of its example."""


@cache
def shipped_looks() -> tuple[str, ...]:
    """Return the names of the library's looks in alphabetical order."""
    return tuple(sorted(entry.stem for entry in _folder().iterdir() if entry.suffix == ".toml"))


def look_path(name_or_path: str | Path) -> Path:
    """Return the path of a look, given by a name of the library or by its path.

    Parameters
    ----------
    name_or_path : str or Path
        "warm-vintage" (case, spaces and underscores do not matter) or "my/look.toml".

    Raises
    ------
    ProjectError
        When it is neither in the library nor a file.
    """
    text = str(name_or_path)
    key = "-".join(text.lower().replace("_", " ").replace("-", " ").split())
    if key in shipped_looks():
        return _folder() / f"{key}.toml"
    path = expanded(text)
    if path.is_file():
        return path
    if path.suffix or path.parent != Path() or path.exists():
        raise ProjectError(f"the look {text} {no_file(path)}; check the path, or choose one of `flarewright looks`")
    near = difflib.get_close_matches(key, shipped_looks(), n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else "flarewright looks lists them"
    raise ProjectError(f"{text!r} is neither a look of the library nor a file: {hint}")


def read_look(name_or_path: str | os.PathLike[str]) -> Look:
    """Read and check a look.

    Parameters
    ----------
    name_or_path : str or path
        As in `look_path`.

    Raises
    ------
    ProjectError
        When the look does not exist or its file has errors; `problems` then lists all of them.
    """
    path = look_path(Path(name_or_path) if not isinstance(name_or_path, str) else name_or_path)
    with raised_as(ProjectError):
        data = read_toml(path, "a look")
        refuse_other_kind(path, data, "look")
        check_version(data, _NEWEST, f"the look {path}")
    known = (*_EXAMPLE_KEYS, *LOOK_SECTIONS)
    problems = [
        f"a look has no key {key}{did_you_mean(key, known)}: known are {', '.join(LOOK_SECTIONS)}"
        for key in data
        if key not in known
    ]
    problems += [
        f"a look cannot set {section}.{key}: remove it, the shot decides"
        for section, keys in (("camera", CAMERA_KEYS), ("iris", tuple(Iris.model_fields)))
        for key in (data[section] if isinstance(data.get(section), dict) else ())
        if key not in keys
    ]
    if problems:
        raise ProjectError(summary(str(path), problems), tuple(problems))
    if not any(key in LOOK_SECTIONS for key in data):
        raise ProjectError(f"{path} sets no key of a look; known are {', '.join(LOOK_SECTIONS)}")
    stage = {key: value for key, value in data.items() if key not in ("name", "notes")}
    example = project_from_data(stage, folder=path.parent, where=str(path))
    try:
        name, notes = data.get("name", path.stem), data.get("notes", "")
        return Look(name=name, notes=notes, example=example, says=_look_keys(data))
    except INVALID as error:
        found = tuple(validation_sentences(error))
        raise ProjectError(summary(str(path), list(found)), found) from None


def look_text(look: Look, folder: Path | None = None) -> str:
    """Return a look as TOML; `read_look` reads it back unchanged.

    Parameters
    ----------
    look : Look
    folder : path, optional
        Folder of the TOML file: paths are written relative to it.
    """
    whole = project_data(look.example, folder)
    out: dict[str, Any] = {"schema_version": _NEWEST, "name": look.name}
    if look.notes:
        out["notes"] = look.notes
    out |= {key: whole[key] for key in ("lens", "zoom") if key in whole}
    for section in LOOK_SECTIONS:
        keys = [key.partition(".")[2] for key in look.says if key.partition(".")[0] == section]
        if section in ("iris", "camera") and keys:
            out[section] = {key: whole[section][key] for key in keys if key in whole[section]}
        elif keys and section != "lights" and section in whole:
            out[section] = whole[section]
    light_keys = [key.removeprefix("lights.") for key in look.says if key.startswith("lights.")]
    plain = {"intensity": 1.0}
    out["lights"] = [
        {
            key: value
            for key, value in light.items()
            if key in ("field_deg", "distance", *light_keys) or (key in plain and value != plain[key])
        }
        for light in whole["lights"]
    ]
    return toml_text(out)


def _look_keys(data: dict[str, Any]) -> tuple[str, ...]:
    """Return the keys of a look file that belong to the look: all but the lens and the lights' positions."""
    found = [key for key in data if key in LOOK_SECTIONS and key not in ("iris", "camera", "lights")]
    found += [f"{section}.{key}" for section in ("iris", "camera") for key in data.get(section, {})]
    lights = data.get("lights") or [{}]
    return (*found, *(f"lights.{key}" for key in LIGHT_KEYS if key in lights[0]))


@cache
def _folder() -> Path:
    return Path(str(files("flarewright") / "looks"))
