"""`Workspace`: a session with its screen and solver, and the browser tabs connected to it."""

from __future__ import annotations

import asyncio
import json
import shutil
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from ..design.search_job import DisplaySettings, Solver
from ..preview.drag import Drag
from ..preview.progressive_render import sharpen
from ..preview.viewport import Screen
from ..session.plate_finder import PlateFinder
from ..session.session import Session
from .messages import object_of
from .page_state import finding_of, picture_of, solve_of, state_of
from .thumbnails import ThumbnailMaker
from .turns import Crowded, Turns

# largest number of sockets of one kind: tabs, and drags
MOST_SOCKETS = 32
# largest number of messages that a tab has not read yet
MOST_UNREAD = 16
# sides of a page's frame, px
SIDES = (1, 16384)
# code of a socket that is refused for now
TRY_AGAIN = 1013


@dataclass(eq=False)
class Tab:
    """A tab of the browser: the size of its frame, and the newest event of each kind that it has not read.

    An event replaces an earlier one of its kind, so a tab that does not read costs no memory.
    """

    room: tuple[int, int] = (0, 0)
    unread: dict[str, dict[str, Any]] = field(default_factory=dict)
    news: asyncio.Event = field(default_factory=asyncio.Event)

    def put(self, event: dict[str, Any]) -> None:
        """Add an event; the oldest of too many messages is dropped."""
        kind = event["type"]
        key = f"{kind} {event['text']}" if kind == "message" else kind
        self.unread.pop(key, None)
        self.unread[key] = event
        messages = [known for known in self.unread if known.startswith("message ")]
        for known in messages[:-MOST_UNREAD]:
            del self.unread[known]
        self.news.set()


class Workspace:
    """A session with its screen and its solver, and the tabs connected to it."""

    def __init__(self, session: Session, greeting: str = "") -> None:
        self.session, self.greeting = session, greeting
        self.screen = Screen(session, sharpen)
        self.solver = Solver(session, lambda: DisplaySettings(session.view, self.screen.exposure_stops))
        self.finder = PlateFinder(session)
        self.drag = Drag(self.screen)
        self.screen.idle = self.drag.prepare
        # page of the latest drag, and the number of sockets of drags
        self.followed: WebSocket | None = None
        self.following = 0
        # threads for what pages ask, for changes, and for drags: none waits for the others
        self.questions, self.changes, self.drags = Turns(4, 64), Turns(8, 256), Turns(4, 128)
        self.thumbnails = ThumbnailMaker()
        # folders of exported files that are drawn or sent
        self.exports: set[Path] = set()
        self._tabs: set[Tab] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        session.listeners.append(self._on_event)

    def _on_event(self, event: dict[str, Any]) -> None:
        """Forward an event of any thread to all tabs."""
        kind = event["type"]
        if kind == "changed":
            event = {"type": kind, "revision": self.session.revision}
        elif kind == "picture":
            event = {"type": kind, **picture_of(self.screen)}
        elif kind == "solve":
            event = {"type": kind, **solve_of(self.solver)}
        elif kind == "finding":
            event = {"type": kind, **finding_of(self.finder)}
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._post, event)

    def _post(self, event: dict[str, Any]) -> None:
        for tab in self._tabs:
            tab.put(event)

    async def socket(self, socket: WebSocket) -> None:
        """Send events to a tab while it is open."""
        self._loop = asyncio.get_running_loop()
        await socket.accept()
        if len(self._tabs) >= MOST_SOCKETS:
            await socket.close(TRY_AGAIN)
            return
        tab = Tab()
        self._tabs.add(tab)
        if self.greeting:
            tab.put({"type": "message", "kind": "info", "text": self.greeting})
            self.greeting = ""
        sender = asyncio.create_task(_send(socket, tab))
        try:
            while True:
                width, height = object_of(await received(socket))["room"]
                tab.room = _side(width), _side(height)
                # the largest page decides
                room = max(each.room for each in self._tabs)
                await self.changes.run(partial(self.screen.make_room, room))
        except (WebSocketDisconnect, ValueError, KeyError, TypeError, Crowded):
            # a message that no page sends ends the connection; the page opens another
            pass
        finally:
            self._tabs.discard(tab)
            sender.cancel()

    def end_work(self) -> None:
        """Ask drawing, searching and exporting to end soon."""
        self.solver.close()
        self.screen.close()
        self.finder.close()
        self.thumbnails.close()
        for turns in (self.questions, self.changes, self.drags):
            turns.end()

    def close(self) -> None:
        """End all background work, and write the autosave."""
        self.end_work()
        self.session.writer.close()
        for folder in tuple(self.exports):
            self.drop_export(folder)

    def drop_export(self, folder: Path) -> None:
        """Delete an exported file after it is sent, or when no client awaits it."""
        shutil.rmtree(folder, ignore_errors=True)
        self.exports.discard(folder)

    def state(self) -> dict[str, Any]:
        """Return the state of the page."""
        return state_of(self.screen, self.solver) | {"finding": finding_of(self.finder)}


async def received(socket: WebSocket) -> str | bytes:
    """Return the next message of a socket.

    Raises
    ------
    WebSocketDisconnect
        When the client has left.
    """
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000))
    return message.get("text") or message.get("bytes") or b""


async def delivered(socket: WebSocket, data: str | bytes) -> bool:
    """Send a message to a socket; return whether the client is still there.

    asyncio reports a lost connection in a later turn of its loop, so each message waits for one: otherwise the messages
    of a flood would be written to a closed connection, each with a warning of asyncio.
    """
    try:
        await (socket.send_text(data) if isinstance(data, str) else socket.send_bytes(data))
    except (RuntimeError, WebSocketDisconnect):
        return False
    await asyncio.sleep(0)
    return True


def _side(value: Any) -> int:
    return int(min(max(float(value), SIDES[0]), SIDES[1]))


async def _send(socket: WebSocket, tab: Tab) -> None:
    while True:
        await tab.news.wait()
        tab.news.clear()
        while tab.unread:
            if not await delivered(socket, json.dumps(tab.unread.pop(next(iter(tab.unread))))):
                return
