"""Open the editor: session, access and server together, and the addresses that open its page."""

from __future__ import annotations

import socket
import threading
import webbrowser
from collections.abc import Sequence
from pathlib import Path

from ...errors import ProjectError
from ...io.files.state_folder import state_folder
from ...typing import Report
from ..session.reach import reach_of
from ..session.session import begin
from .access import EVERYWHERE, LOOPBACK, Access, access_of
from .app import serve
from .tokens import token_of
from .workspace import Workspace


def open_editor(
    what: str | None,
    *,
    port: int,
    host: str,
    token_file: Path | None,
    base_url: str | None,
    folders: Sequence[Path],
    browser: bool,
    report: Report,
) -> bool:
    """Serve the editor until a signal or a request ends it.

    Parameters
    ----------
    what : str or None
        A project file, a lens file, or a shipped lens' name. None: the last session.
    port : int
        0: any free port.
    host : str
        Address to listen on.
    token_file : Path or None
        File with the secret that opens the editor.
    base_url : str or None
        Address or path of the page behind a proxy.
    folders : sequence of Path
        Folders whose files the page may open and save, besides that of `what`. Empty: the present folder.
    browser : bool
        Whether to open the page in a browser.
    report : callable
        Called with sentences; the first one has the address, for programs that start the editor.

    Returns
    -------
    bool
        Whether a signal ended it. Pictures in progress may still occupy threads then.

    Raises
    ------
    ProjectError
        When a file, the token or an address cannot be used, or the port is taken.
    """
    for folder in folders:
        if not folder.expanduser().is_dir():
            raise ProjectError(f"--root {folder} is no folder; give one that exists")
    access = access_of(token_of(token_file), host, base_url)
    session, greeting = begin(what)
    given = [] if what is None or not Path(what).exists() else [Path(what).resolve().parent]
    session.reach = reach_of([*(folders or [Path.cwd()]), *given, state_folder() / "imports"], session.history)

    def ready(found: int) -> None:
        address = _report_addresses(access, found, report)
        if greeting:
            report(greeting)
        if browser:
            # open the page once the server answers
            threading.Timer(0.3, webbrowser.open, [address]).start()

    return serve(Workspace(session, greeting), access, port, ready)


def _report_addresses(access: Access, port: int, report: Report) -> str:
    """Report the addresses of the page; return that for this computer."""
    here, *elsewhere = hosts(access.host)
    address = access.address(here, port)
    report(f"the editor is at {address}  (Ctrl-C ends it)")
    for name in elsewhere:
        report(f"from other computers it is at {access.address(name, port)}")
    if access.host not in LOOPBACK and not access.origin.startswith("https:"):
        report("other computers reach the editor unencrypted: use a network that you trust")
    return address


def hosts(host: str) -> tuple[str, ...]:
    """Return the addresses of a server that listens on `host`: for this computer first, then for others.

    Returns
    -------
    tuple of str
        A single one if it is the same for all.
    """
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
