"""Read a TOML file that must be of one of our kinds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import ProjectError, raised_as
from ..files.file_kind import Kind, refuse_lens_suffix, refuse_other_kind
from ..files.text_file import read_toml


def read_file_of_kind(path: Path, kind: Kind, what: str) -> dict[str, Any]:
    """Return the parsed contents of a TOML file.

    Parameters
    ----------
    path : Path
    kind : {"dataset", "project", "scene"}
    what : str
        For messages: "a project file".

    Returns
    -------
    dict

    Raises
    ------
    ProjectError
        The file cannot be read, or is clearly of another kind.
    """
    with raised_as(ProjectError):
        refuse_lens_suffix(path, kind)
        data = read_toml(path, what)
        refuse_other_kind(path, data, kind)
    return data
