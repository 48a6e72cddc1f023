"""`flarewright scene init`: write a new scene file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from ..common import check_free, check_place, print_remarks, write_text
from ..shared_options import Force, output_option

EPILOG = "Example:\n\nflarewright scene init -o match.toml\n\nflarewright predict match.toml -o match.html"


def init(
    output: Annotated[Path | None, output_option(help="The scene file, *.toml (default: stdout).")] = None,
    force: Force = False,
) -> None:
    """Write a scene with two cameras, the sun and a lamp, and a comment on every key."""
    from ...io.project.file_of_kind import example_file

    example = example_file("scene")
    if output is None:
        print(example, end="")
        return
    check_place(output, ".toml")
    check_free(output, force)
    write_text(output, example)
    print_remarks([f"wrote {output}"])
