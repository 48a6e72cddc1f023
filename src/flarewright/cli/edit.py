"""`flarewright edit`: the editor in a browser tab."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from ..errors import ProjectError
from .common import print_remark

EPILOG = (
    "Examples:\n\nflarewright edit\n\nflarewright edit canon-28-80\n\nflarewright edit shot.toml --port 8100 "
    "--no-browser\n\nIt needs the extra ui: pip install 'flarewright\\[ui]'"
)

# exit code after a signal
INTERRUPTED = 130
# packages of the extra ui
NEEDED = ("starlette", "uvicorn", "websockets")


def edit(
    what: Annotated[
        str | None,
        typer.Argument(metavar="[PROJECT|LENS]", help="A project file, a lens file, or a shipped lens' name."),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 is any free one (default: 8640).")] = 8640,
    host: Annotated[
        str, typer.Option(help="Address to listen on; another than the loopback address admits other computers.")
    ] = "127.0.0.1",
    token_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="File with the secret that opens the editor (default: FLAREWRIGHT_TOKEN, or random)."
        ),
    ] = None,
    base_url: Annotated[
        str | None, typer.Option(metavar="URL", help="Address or path of the page behind a proxy (default: /).")
    ] = None,
    root: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER",
            help="Folder whose files the page may open and save; repeatable (default: the present folder, and that of "
            "PROJECT).",
        ),
    ] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
) -> None:
    """Edit a flare in the browser: drag the light, drag a ghost.

    Resumes the last session, also after a crash. All data stay on this computer.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise ProjectError(f"the editor needs the extra ui ({', '.join(missing)}): pip install 'flarewright[ui]'")
    from ..editor.server.launch import open_editor

    if open_editor(
        what, port=port, host=host, token_file=token_file, base_url=base_url, folders=root or [],
        browser=not no_browser, report=print_remark,
    ):  # fmt: skip
        # a picture or a search in progress keeps its threads for minutes; the autosave is written
        print("flarewright: the editor has ended; its session is saved", file=sys.stderr, flush=True)
        os._exit(INTERRUPTED)
