"""The socket of a drag: requests of one page, each answered by a line of JSON, then the picture."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from ...model import Project
from ..commands.light_path import go_to
from ..commands.shot import move_light
from .messages import CROWDED, object_of, why_failed
from .turns import Crowded
from .workspace import MOST_SOCKETS, TRY_AGAIN, Workspace, delivered, received

# pictures of a drag that one page has drawn at the same time; of further requests the newest waits
AT_ONCE = 2


def change_of(workspace: Workspace, asked: Mapping[str, Any]) -> tuple[Callable[[Project], Project], int]:
    """Return the change that a drag or playback requests, and the revision that it refers to."""
    revision = int(asked.get("revision", workspace.session.revision))
    if "at" in asked:
        return partial(go_to, at_s=float(asked["at"])), revision
    return partial(move_light, light=int(asked["light"]), x=float(asked["x"]), y=float(asked["y"])), revision


async def follow(workspace: Workspace, socket: WebSocket) -> None:
    """Answer requests of a drag.

    A socket costs less per picture than requests. Of requests that come faster than pictures the newest is drawn; the
    others get no picture. If the page closes during a drag, the drag ends: the project's own picture is restored,
    unless a drag of another page is newer.
    """
    await socket.accept()
    if workspace.following >= MOST_SOCKETS:
        await socket.close(TRY_AGAIN)
        return
    workspace.following += 1
    drag = _FollowedDrag(workspace, socket)
    try:
        await drag.serve()
    except WebSocketDisconnect:
        pass
    finally:
        workspace.following -= 1
        await drag.end()


class _FollowedDrag:
    """The requests of one page that are drawn, and the newest of those that wait."""

    def __init__(self, workspace: Workspace, socket: WebSocket) -> None:
        self._workspace, self._socket = workspace, socket
        self._tasks: set[asyncio.Task[None]] = set()
        self._waiting: dict[str, Any] | None = None

    async def serve(self) -> None:
        """Take requests until the page leaves."""
        while True:
            raw = await received(self._socket)
            try:
                asked = object_of(raw)
            except ValueError as error:
                await self._send({"number": None, "error": why_failed(error, self._workspace.session)})
                continue
            if len(self._tasks) < AT_ONCE:
                self._begin(asked)
                continue
            stale, self._waiting = self._waiting, asked
            if stale is not None:
                await self._send({"number": stale.get("number")})

    async def end(self) -> None:
        """Wait for the picture in progress, which would otherwise interrupt the final one, and restore that one."""
        self._waiting = None
        workspace = self._workspace
        with suppress(asyncio.CancelledError, Crowded):
            await asyncio.gather(*self._tasks, return_exceptions=True)
            if workspace.followed is self._socket:
                workspace.followed = None
                await workspace.changes.run(workspace.screen.rest)

    async def _send(self, head: dict[str, Any], picture: bytes = b"") -> None:
        # the tab may be closed by now
        await delivered(self._socket, json.dumps(head).encode() + b"\n" + picture)

    async def _answer(self, asked: dict[str, Any]) -> None:
        head: dict[str, Any] = {"number": asked.get("number")}
        picture = b""
        workspace = self._workspace
        workspace.followed = self._socket
        try:
            found = await workspace.drags.run(lambda: workspace.drag.picture(*change_of(workspace, asked)))
            if found is not None:
                picture = found.jpeg
                head |= {"seconds": round(found.seconds, 4), "lights": [one.field_deg for one in found.project.lights]}
        except Crowded:
            head["error"] = CROWDED
        except Exception as error:
            head["error"] = why_failed(error, workspace.session)
        await self._send(head, picture)

    def _begin(self, asked: dict[str, Any]) -> None:
        task = asyncio.create_task(self._answer(asked))
        self._tasks.add(task)
        task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if self._waiting is not None:
            asked, self._waiting = self._waiting, None
            self._begin(asked)
