"""`flarewright edit`: the editor in a browser tab."""

from __future__ import annotations

import socket
from importlib.util import find_spec
from typing import Annotated
from urllib.parse import quote

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
# addresses that mean all of this machine's: the one of them to open here, and one that lies beyond any network, to ask
# the system by which of its own it would go there (nothing is sent)
EVERYWHERE = {"0.0.0.0": ("127.0.0.1", "192.0.2.1"), "::": ("::1", "2001:db8::1")}


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

    def ready(found: int) -> None:
        here, *elsewhere = hosts(host)
        address = _address(here, found, token)
        tell([f"the editor is at {address}  (Ctrl-C ends it)"])
        tell(f"from other machines it is at {_address(name, found, token)}" for name in elsewhere)
        if not no_browser:
            import threading
            import webbrowser

            # the page is asked for once the server answers
            threading.Timer(0.3, webbrowser.open, [address]).start()

    serve(Desk(session, greeting), host, port, token, ready)


def hosts(host: str) -> tuple[str, ...]:
    """Return by which addresses a server that listens on `host` can be opened: from this machine first.

    Parameters
    ----------
    host : str

    Returns
    -------
    tuple of str
        One where it is the same for all.
    """
    if host not in EVERYWHERE:
        return (host,)
    here, beyond = EVERYWHERE[host]
    return here, _own_address(beyond) or socket.gethostname()


def _own_address(beyond: str) -> str | None:
    """Return this machine's address towards another one; None without a network."""
    family = socket.AF_INET6 if ":" in beyond else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((beyond, 9))
            return str(probe.getsockname()[0])
    except OSError:
        return None


def _address(host: str, port: int, token: str | None) -> str:
    shown = f"[{host}]" if ":" in host else host
    return f"http://{shown}:{port}/" + (f"?token={quote(token, safe='')}" if token else "")
