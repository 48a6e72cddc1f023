"""Scene files: TOML that holds cameras and lights in space, for `flarewright predict` (docs/predict.md).

Relative paths (lens, measured model, coating, spectrum table) start at the scene file's folder. A camera's `coating`
and a light's `spectrum` can be short texts, as in a project file.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ...errors import FlarewrightError, ProjectError, raised_as
from ...model.project import light as spectra
from ...model.project import project as choices
from ...model.project import scene as records
from ...model.project.scene import Scene
from ...sentences import shorten, summary
from ..files.text_file import check_version
from ..files.type_slips import record_of
from .file_of_kind import NEWEST, read_file_of_kind
from .project_file import Sections, accept_text, expand_coating, expand_light, validation_messages
from .project_text import ABOUT, lens_location

_SECTIONS: Sections = {
    "": (Scene,),
    "site": (records.Site,),
    "time": (records.Span,),
    "cameras": (records.SceneCamera,),
    "lights": (records.Lamp, records.Distant, records.Sun),
    "keyframes": (records.CameraKey, records.LampKey),
    "coating": (choices.Preset, choices.Everywhere, choices.InTurn, choices.PerRow),
    "spectrum": (spectra.BlackBody, spectra.Lines, spectra.Tabulated, spectra.Rgb),
}


def read_scene(path: str | os.PathLike[str]) -> Scene:
    """Read and check a scene file.

    Parameters
    ----------
    path : path
        A TOML file.

    Returns
    -------
    Scene
        Short texts are parsed; relative paths are resolved from the file's folder.

    Raises
    ------
    ProjectError
        When the file cannot be read or has errors; `problems` then lists all of them, each with its place.
    """
    path = Path(path)
    data = read_file_of_kind(path, "scene")
    return scene_from_data(data, folder=path.parent, where=str(path))


def scene_from_data(data: dict[str, Any], *, folder: Path, where: str) -> Scene:
    """Return the scene of parsed TOML; parameters and errors as `project_file.project_from_data`."""
    with raised_as(ProjectError):
        check_version(data, NEWEST, f"the scene file {where}")
    problems: list[str] = []
    out = dict(data)
    if isinstance(out.get("cameras"), list):
        out["cameras"] = [_camera(one, f"cameras[{k}]", folder, problems) for k, one in enumerate(out["cameras"])]
    if isinstance(out.get("lights"), list):
        out["lights"] = [_light(one, f"lights[{k}]", folder, problems) for k, one in enumerate(out["lights"])]
    scene, wrong = record_of(Scene.model_validate, out, lambda error: validation_messages(error, out, _SECTIONS))
    problems += wrong
    if scene is None or problems:
        raise ProjectError(summary(where, problems), tuple(problems))
    return scene


def _camera(table: Any, where: str, folder: Path, problems: list[str]) -> Any:
    if not isinstance(table, dict):
        return table
    out = dict(table)
    if isinstance(out.get("lens"), str):
        out["lens"] = lens_location(out["lens"], folder)
    if isinstance(out.get("model"), str):
        out["model"] = str(folder / out["model"])
    if "coating" in out:
        try:
            out["coating"] = expand_coating(out["coating"], folder)
        except FlarewrightError as error:
            problems.append(f"{where}.coating: {error}")
            del out["coating"]
    return out


def _light(table: Any, where: str, folder: Path, problems: list[str]) -> Any:
    """Parse a light's spectrum; the default kind is a lamp."""
    if not isinstance(table, dict):
        return table
    kind = table.get("kind", "lamp")
    if kind not in ("lamp", "distant", "sun"):
        # without a known kind no other key can be checked: report only the kind, and return a valid lamp
        problems.append(f"{where}.kind should be lamp, distant or sun, not {shorten(kind)}")
        return {"kind": "lamp", "name": f"?{where}", "position_m": (0.0, 0.0, 0.0), "intensity_cd": 1.0}
    return expand_light({**table, "kind": kind}, where, folder, problems)


def scene_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a scene file, for validation in text editors."""
    schema = Scene.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "Flarewright scene"
    accept_text(schema["$defs"]["SceneCamera"]["properties"]["coating"], ABOUT["coating"])
    for kind in ("Lamp", "Distant", "Sun"):
        accept_text(schema["$defs"][kind]["properties"]["spectrum"], ABOUT["lights.spectrum"])
    return schema
