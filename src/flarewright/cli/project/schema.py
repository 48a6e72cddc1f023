"""`flarewright project schema`: the JSON Schema of project files."""

from __future__ import annotations

from ..common import print_json


def schema() -> None:
    """Print the JSON Schema of a project file; TOML editors use it to check input."""
    from ...io.project.project_file import project_json_schema

    print_json(project_json_schema())
