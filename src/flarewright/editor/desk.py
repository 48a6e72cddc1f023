"""What the server serves: a session, what draws and searches for it, and the tabs that look at it."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocket, WebSocketDisconnect

from .hand import Hand
from .screen import Screen
from .session import Session
from .sharpening import sharpen
from .snapshot import picture_of, solve_of, state_of
from .solving import Seeing, Solver


class Desk:
    """A session with its screen and its solver, and the tabs that look at it."""

    def __init__(self, session: Session, greeting: str = "") -> None:
        self.session, self.greeting = session, greeting
        self.screen = Screen(session, sharpen)
        self.solver = Solver(session, lambda: Seeing(session.view, self.screen.exposure_stops))
        self.hand = Hand(self.screen)
        self.screen.idle = self.hand.prepare
        # the page whose hand moved last
        self.followed: WebSocket | None = None
        # of each tab how much room it has for a picture, as far as it has told
        self._tabs: dict[asyncio.Queue[dict[str, Any]], tuple[int, int]] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        session.listeners.append(self._heard)

    def _heard(self, event: dict[str, Any]) -> None:
        """Pass on what happens, from whichever thread, to all tabs."""
        kind = event["type"]
        if kind == "changed":
            event = {"type": kind, "revision": self.session.revision}
        elif kind == "picture":
            event = {"type": kind, **picture_of(self.screen)}
        elif kind == "solve":
            event = {"type": kind, **solve_of(self.solver)}
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._post, event)

    def _post(self, event: dict[str, Any]) -> None:
        for tab in self._tabs:
            tab.put_nowait(event)

    async def socket(self, socket: WebSocket) -> None:
        """Tell a tab what happens for as long as it is open."""
        self._loop = asyncio.get_running_loop()
        await socket.accept()
        tab: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._tabs[tab] = (0, 0)
        if self.greeting:
            tab.put_nowait({"type": "message", "kind": "info", "text": self.greeting})
            self.greeting = ""
        sender = asyncio.create_task(_send(socket, tab))
        try:
            while True:
                width, height = json.loads(await socket.receive_text())["room"]
                self._tabs[tab] = (int(width), int(height))
                # the largest page has the say
                await run_in_threadpool(self.screen.make_room, max(self._tabs.values()))
        except (WebSocketDisconnect, ValueError, KeyError, TypeError):
            pass
        finally:
            del self._tabs[tab]
            sender.cancel()

    def state(self) -> dict[str, Any]:
        """Return what the page is made of."""
        return state_of(self.screen, self.solver)


async def _send(socket: WebSocket, tab: asyncio.Queue[dict[str, Any]]) -> None:
    while True:
        await socket.send_text(json.dumps(await tab.get()))
