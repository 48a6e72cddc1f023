"""`flarewright lens schema`: the JSON Schema of lens files."""

from __future__ import annotations

from ..common import print_json


def schema() -> None:
    """Print the JSON Schema of a lens file; TOML editors use it to check input."""
    from ...io.lens.lens_schema import lens_json_schema

    print_json(lens_json_schema())
