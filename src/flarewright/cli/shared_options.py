"""Options that mean the same in many commands."""

from __future__ import annotations

from typing import Annotated

import typer

KnownLens = Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens (flarewright lenses) or a lens file.")]
FNumber = Annotated[float | None, typer.Option(help="f-number (default: wide open).")]
Zoom = Annotated[str | None, typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Number of threads (default: all cores).")]
Force = Annotated[bool, typer.Option("--force", help="Replace an existing file.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
