"""Read a TOML file that must be of one of our kinds, and examples of such files."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from ...errors import ProjectError, raised_as
from ..files.file_kind import Kind, refuse_lens_suffix, refuse_other_kind
from ..files.text_file import check_version, parsed_toml, read_text, read_toml

NEWEST = 1
"""Largest `schema_version` of a file that this program reads."""
_NAMES: dict[Kind, str] = {"project": "project file", "scene": "scene file", "dataset": "specification"}


def read_file_of_kind(path: Path, kind: Kind) -> dict[str, Any]:
    """Return the parsed contents of a TOML file; a project can also be in the header of an EXR that we wrote.

    Parameters
    ----------
    path : Path
    kind : {"dataset", "project", "scene"}

    Raises
    ------
    ProjectError
        The file cannot be read, is clearly of another kind, or is one of a newer program.
    """
    name = _NAMES[kind]
    with raised_as(ProjectError):
        refuse_lens_suffix(path, kind)
        what = f"a {name}{' of a data set' if kind == 'dataset' else ''}"
        if kind == "project" and path.suffix.lower() == ".exr":
            data = parsed_toml(_of_picture(path), path, what)
        else:
            data = read_toml(path, what)
        refuse_other_kind(path, data, kind)
        check_version(data, NEWEST, f"the {name} {path}")
    return data


def _of_picture(path: Path) -> str:
    """Return the text of the project that an EXR of ours carries in its header."""
    # TOML files need no library of images
    from ..images.exr import exr_note

    text = exr_note(path, "project")
    if text is None:
        raise ProjectError(f"{path} carries no project: give a picture that flarewright wrote, or a project file")
    return text


def example_file(kind: Literal["dataset", "scene"]) -> str:
    """Return an example of a file, with a comment on every key: what `scene init` and `dataset --example` print."""
    return read_text(str(files("flarewright").joinpath(f"io/data/{kind}.toml")), "an example")
