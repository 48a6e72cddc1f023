"""Who may talk to the editor: this machine alone, or whoever has the token."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qs, quote, unquote, urlsplit

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

COOKIE = "flarewright_token"
LOOPBACK = ("127.0.0.1", "localhost", "::1")


class Guard:
    """Lets requests through that come from the editor's own page.

    Parameters
    ----------
    application : callable
        ASGI.
    token : str or None
        None: the editor is on the loopback address. Then the page's address must be a loopback name too, so that no
        site on the network can reach it through a name of its own.
    """

    def __init__(self, application: Application, token: str | None) -> None:
        self._application, self._token = application, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan" or self._welcome(scope):
            await self._application(scope, receive, self._with_cookie(scope, send))
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            body = b"flarewright: this editor needs its token: open the address that it printed"
            head = [(b"content-type", b"text/plain"), (b"content-length", str(len(body)).encode())]
            await send({"type": "http.response.start", "status": 403, "headers": head})
            await send({"type": "http.response.body", "body": body})

    def _welcome(self, scope: Scope) -> bool:
        headers = _headers(scope)
        host = headers.get("host", "")
        origin = headers.get("origin")
        # another site's page may not send requests here, with or without the token
        if origin is not None and urlsplit(origin).netloc != host:
            return False
        if self._token is None:
            return (urlsplit(f"//{host}").hostname or "") in LOOPBACK
        return any(hmac.compare_digest(given.encode(), self._token.encode()) for given in _given(scope, headers))

    def _with_cookie(self, scope: Scope, send: Send) -> Send:
        """Remember a token that came with the address."""
        token = self._token
        if token is None or scope["type"] != "http" or "token" not in parse_qs(scope["query_string"].decode()):
            return send
        name = _cookie_of(_headers(scope))

        async def remember(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                # whatever signs the token has, they must come back as they are
                cookie = f"{name}={quote(token, safe='')}; HttpOnly; SameSite=Strict; Path=/"
                message["headers"] = [*message.get("headers", []), (b"set-cookie", cookie.encode())]
            await send(message)

        return remember


def _headers(scope: Scope) -> dict[str, str]:
    return {key.decode().lower(): value.decode("latin-1") for key, value in scope["headers"]}


def _cookie_of(headers: dict[str, str]) -> str:
    """Return the name of the cookie: one a port, for browsers share cookies between the ports of a machine."""
    port = headers.get("host", "").rpartition(":")[2]
    return f"{COOKIE}_{port}" if port.isdigit() else COOKIE


def _given(scope: Scope, headers: dict[str, str]) -> list[str]:
    found = list(parse_qs(scope["query_string"].decode()).get("token", []))
    for part in headers.get("cookie", "").split(";"):
        name, _, value = part.strip().partition("=")
        if name == _cookie_of(headers):
            found.append(unquote(value))
    return found
