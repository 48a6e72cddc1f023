"""Access control of the editor: clients with the token, and pages of the same origin only."""

from __future__ import annotations

import hashlib
import hmac
import re
from dataclasses import dataclass
from urllib.parse import parse_qs, quote, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ...errors import ProjectError

COOKIE = "flarewright_token"
LOOPBACK = ("127.0.0.1", "localhost", "::1")
# addresses that listen on all interfaces: the address to open here, and one outside any network, whose route names the
# address of the interface (nothing is sent)
EVERYWHERE = {"0.0.0.0": ("127.0.0.1", "192.0.2.1"), "::": ("::1", "2001:db8::1")}
# least length of a token, characters
SHORTEST = 8

NO_TOKEN = "this editor needs its token: open the address that it printed"
FOREIGN = "this editor answers its own page only: open the address that it printed; behind a proxy give --base-url"
# a page runs the editor's scripts and shows its pictures, which are sent or drawn; no other page may frame or read it
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
_PATH = re.compile(r"(/[\w.~@%+-]+)*/?")


@dataclass(frozen=True)
class Access:
    """Who may reach an editor, and at which address.

    Attributes
    ----------
    token : str
        Opens the editor.
    host : str
        Address on which the editor listens.
    base : str
        Path of the page without its last slash; empty at the root of a host.
    origin : str
        "https://hub.example.org" in front of `base`, behind a proxy; empty: the address on which the editor listens.
    """

    token: str
    host: str = LOOPBACK[0]
    base: str = ""
    origin: str = ""

    @property
    def hosts(self) -> tuple[str, ...]:
        """Host names of requests, as `TrustedHostMiddleware` takes them; a website's own name is not among them."""
        if self.host in EVERYWHERE:
            # the names of this computer in all its networks are unknown
            return ("*",)
        own = (*LOOPBACK, self.host, urlsplit(self.origin).hostname or "")
        return tuple({f"[{name}]" if ":" in name else name for name in own if name})

    @property
    def secret(self) -> str:
        """Value of the cookie: letters and digits, whatever the token is."""
        return hmac.new(self.token.encode(), b"cookie of the editor", hashlib.sha256).hexdigest()

    def address(self, host: str, port: int) -> str:
        """Return the address that opens the page at a host, or at the proxy."""
        shown = f"[{host}]" if ":" in host else host
        return f"{self.origin or f'http://{shown}:{port}'}{self.base}/?token={quote(self.token, safe='')}"


def access_of(token: str, host: str, base_url: str | None = None) -> Access:
    """Return the access to an editor.

    Parameters
    ----------
    token : str
    host : str
        Address on which it listens.
    base_url : str, optional
        Path of the page behind a proxy, "/user/me/proxy/8640/", or the whole address with it.

    Raises
    ------
    ProjectError
        When the token is short, or the address is none.
    """
    if len(token) < SHORTEST:
        raise ProjectError(f"the editor's token is too short to be safe; give at least {SHORTEST} characters")
    try:
        parts = urlsplit(base_url or "/")
        whole = parts.scheme in ("http", "https") and bool(parts.hostname) and (parts.port or 1) > 0
        bare = not (parts.scheme or parts.netloc)
    except ValueError:
        whole = bare = False
    if not (whole or bare) or parts.query or parts.fragment or not _PATH.fullmatch(parts.path):
        raise ProjectError(
            f"--base-url {base_url!r:.120} is no address; give a path like /user/me/proxy/8640/ or https://host/path/"
        )
    origin = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}" if whole else ""
    return Access(token, host, parts.path.rstrip("/"), origin)


class Guard:
    """Admit only requests with the token or its cookie that no other website makes.

    Parameters
    ----------
    app : callable
        ASGI.
    access : Access
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or reject it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        base, path = self._access.base, scope["path"]
        if base and path.startswith(f"{base}/"):
            # a proxy that keeps the prefix; others cut it off
            scope = {**scope, "root_path": base}
            path = path[len(base) :]
        request = HTTPConnection(scope)
        page = scope["type"] == "http" and scope["method"] == "GET" and path == "/"
        with_token = page and self._has_token(scope)
        why = self._objection(request, page, with_token)
        if why is not None:
            await _refuse(scope, receive, send, why)
        elif base and path == base:
            await RedirectResponse(f"{base}/")(scope, receive, send)
        else:
            await self._app(scope, receive, self._with_cookie(request.headers, send) if with_token else send)

    def _objection(self, request: HTTPConnection, page: bool, with_token: bool) -> str | None:
        """Return why a request is refused; None: it is admitted."""
        headers = request.headers
        site = headers.get("sec-fetch-site", "none")
        # a link may open the page, in a new tab
        opened = page and (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")) == ("navigate", "document")
        if site not in ("same-origin", "none") and not opened:
            return FOREIGN
        origin = headers.get("origin")
        if origin is not None and origin != self._access.origin and not _same_host(origin, headers.get("host", "")):
            return FOREIGN
        return None if with_token or self._has_cookie(request) else NO_TOKEN

    def _has_token(self, scope: Scope) -> bool:
        try:
            given = parse_qs(scope["query_string"].decode("latin-1"), max_num_fields=100).get("token", [])
        except ValueError:
            return False
        return any(hmac.compare_digest(each.encode(), self._access.token.encode()) for each in given)

    def _has_cookie(self, request: HTTPConnection) -> bool:
        given = request.cookies.get(_cookie_of(request.headers), "")
        return hmac.compare_digest(given.encode("utf-8", "replace"), self._access.secret.encode())

    def _with_cookie(self, headers: Headers, send: Send) -> Send:
        """Store the right to enter in a cookie, for the page's own requests."""
        access = self._access
        secure = "; Secure" if access.origin.startswith("https:") else ""
        cookie = f"{_cookie_of(headers)}={access.secret}; HttpOnly; SameSite=Strict; Path={access.base}/{secure}"

        async def remember(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).append("set-cookie", cookie)
            await send(message)

        return remember


class SafeHeaders:
    """Add headers that forbid other websites to frame, read or embed what the editor sends."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        await self._app(scope, receive, guarded)


def _same_host(origin: str, host: str) -> bool:
    try:
        return bool(host) and urlsplit(origin).netloc == host
    except ValueError:
        return False


async def _refuse(scope: Scope, receive: Receive, send: Send, why: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
    elif "/api/" in scope["path"]:
        # the page shows errors of its requests
        await JSONResponse({"error": why}, status_code=403)(scope, receive, send)
    else:
        await PlainTextResponse(f"flarewright: {why}", status_code=403)(scope, receive, send)


def _cookie_of(headers: Headers) -> str:
    """Return the name of the cookie, with the port, as browsers share cookies between ports."""
    port = headers.get("host", "").rpartition(":")[2]
    return f"{COOKIE}_{port}" if port.isascii() and port.isdigit() else COOKIE
