"""`flarewright scene schema`: the JSON Schema of scene files."""

from __future__ import annotations

from ..common import print_json


def schema() -> None:
    """Print the JSON Schema of a scene file; TOML editors use it to check input."""
    from ...io.project.scene_file import scene_json_schema

    print_json(scene_json_schema())
