"""`flarewright edit`: the editor in a browser tab."""

from __future__ import annotations

import os
import socket
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from ..errors import ProjectError
from .common import print_remarks

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
    from ..editor.server.access import LOOPBACK, access_of
    from ..editor.server.app import serve
    from ..editor.server.tokens import token_of
    from ..editor.server.workspace import Workspace
    from ..editor.session.reach import reach_of
    from ..editor.session.session import begin
    from ..io.files.state_folder import state_folder

    access = access_of(token_of(token_file), host, base_url)
    session, greeting = begin(what)
    given = [] if what is None or not Path(what).exists() else [Path(what).resolve().parent]
    session.reach = reach_of([*(root or [Path.cwd()]), *given, state_folder() / "imports"], session.history)

    def ready(found: int) -> None:
        here, *elsewhere = hosts(host)
        address = access.address(here, found)
        print_remarks([f"the editor is at {address}  (Ctrl-C ends it)"])
        print_remarks(f"from other computers it is at {access.address(name, found)}" for name in elsewhere)
        if host not in LOOPBACK and not access.origin.startswith("https:"):
            print_remarks(["other computers reach the editor unencrypted: use a network that you trust"])
        # the address is the first line, for programs that start the editor
        print_remarks([greeting] if greeting else [])
        if not no_browser:
            import threading
            import webbrowser

            # open the page once the server answers
            threading.Timer(0.3, webbrowser.open, [address]).start()

    if serve(Workspace(session, greeting), access, port, ready):
        # a picture or a search in progress keeps its threads for minutes; the autosave is written
        print("flarewright: the editor has ended; its session is saved", file=sys.stderr, flush=True)
        os._exit(INTERRUPTED)


def hosts(host: str) -> tuple[str, ...]:
    """Return the addresses of a server that listens on `host`: for this computer first, then for others.

    Parameters
    ----------
    host : str

    Returns
    -------
    tuple of str
        A single one if it is the same for all.
    """
    # a web server's library, which `--help` need not import
    from ..editor.server.access import EVERYWHERE

    if host not in EVERYWHERE:
        return (host,)
    here, beyond = EVERYWHERE[host]
    return here, _own_address(beyond) or socket.gethostname()


def _own_address(beyond: str) -> str | None:
    """Return this computer's address towards another one; None without a network."""
    family = socket.AF_INET6 if ":" in beyond else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((beyond, 9))
            return str(probe.getsockname()[0])
    except OSError:
        return None
