"""`flarewright edit`: the editor in a browser tab."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Annotated

import typer

from ..errors import ProjectError
from .common import tell

EPILOG = (
    "Examples:\n\nflarewright edit\n\nflarewright edit canon-28-80\n\nflarewright edit shot.toml --port 8100 "
    "--no-browser\n\nIt needs the extra ui: pip install 'flarewright\\[ui]'"
)

# of the extra ui
NEEDED = ("starlette", "uvicorn", "websockets")
LOOPBACK = ("127.0.0.1", "localhost", "::1")


def edit(
    what: Annotated[
        str | None,
        typer.Argument(metavar="[PROJECT|LENS]", help="A project file, a lens file, or a shipped lens' name."),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 is any that is free.")] = 8640,
    host: Annotated[
        str, typer.Option(help="Address to listen on; any but this machine's own needs --token.")
    ] = "127.0.0.1",
    token: Annotated[str | None, typer.Option(metavar="SECRET", help="Whoever opens the editor must know it.")] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
) -> None:
    """Edit a flare in the browser: drag the light, pull a ghost.

    Goes on where the last session ended, also after a crash. Everything stays on this machine.
    """
    if host not in LOOPBACK and token is None:
        raise ProjectError(f"--host {host} lets other machines in; give them a --token SECRET too, or leave --host out")
    if token is not None and len(token) < 8:
        raise ProjectError("--token is too short to keep anyone out; give at least 8 characters")
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise ProjectError(f"the editor needs the extra ui ({', '.join(missing)}): pip install 'flarewright[ui]'")
    from ..editor.desk import Desk
    from ..editor.server import serve
    from ..editor.session import begin

    session, greeting = begin(what)
    shown = f"[{host}]" if ":" in host else host

    def ready(found: int) -> None:
        address = f"http://{shown}:{found}/" + (f"?token={token}" if token else "")
        tell([f"the editor is at {address}  (Ctrl-C ends it)"])
        if not no_browser:
            import threading
            import webbrowser

            # the page is asked for once the server answers
            threading.Timer(0.3, webbrowser.open, [address]).start()

    serve(Desk(session, greeting), host, port, token, ready)
