"""The web server of the editor: the page, its pictures, and what it asks for."""

from __future__ import annotations

import asyncio
import errno
import json
import tempfile
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from functools import partial, wraps
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from ..errors import FlarewrightError, ProjectError
from ..io.thumbnails import thumbnail
from ..model import Project
from . import drawings, files, viewing
from .desk import Desk
from .edit_path import go_to
from .edit_shot import move_light
from .guard import Application, Guard
from .hand import Moved
from .imports import take_in
from .pictures import in_short
from .screen import packed, shown_pixels
from .snapshot import ghosts_of

STATIC = Path(__file__).parent / "static"
MOST_SECONDS = 3600.0
# pictures are packed already
SOCKETS: dict[str, Any] = {"ws": "websockets-sansio", "ws_per_message_deflate": False}

Answer = Callable[[Request], Awaitable[Response]]
Work = Callable[[Desk, Request, Any], Any]


def told(work: Work) -> Callable[[Desk], Answer]:
    """Make an answer of a function of request and body: what it returns as JSON, its mistake as one sentence."""

    def bind(desk: Desk) -> Answer:
        @wraps(work)
        async def answer(request: Request) -> Response:
            try:
                raw = await request.body() if request.method == "POST" else b""
                if request.url.path == "/api/import":
                    body: Any = raw
                else:
                    body = json.loads(raw) if raw else {}
                result = await run_in_threadpool(work, desk, request, body)
            except FlarewrightError as error:
                told = in_short(str(error), desk.session.project, desk.session.file)
                return JSONResponse({"error": told}, status_code=400)
            except (ValueError, KeyError, TypeError) as error:
                return JSONResponse({"error": f"the editor did not understand the page: {error}"}, status_code=400)
            if isinstance(result, Response):
                return result
            return JSONResponse(result if result is not None else {})

        return answer

    return bind


def _state(desk: Desk, _request: Request, _body: Any) -> Any:
    return desk.state()


def _do(desk: Desk, _request: Request, body: Any) -> Any:
    table = body.get("table")
    group = str(body.get("group", ""))
    became = desk.session.do(
        str(body["name"]), dict(body.get("values", {})), group, None if table is None else str(table)
    )
    return desk.state() | {"became": became}


def _view(desk: Desk, _request: Request, body: Any) -> Any:
    desk.session.set_view(dict(body))
    return desk.state()


def _undo(desk: Desk, _request: Request, _body: Any) -> Any:
    desk.session.undo()
    return desk.state()


def _redo(desk: Desk, _request: Request, _body: Any) -> Any:
    desk.session.redo()
    return desk.state()


def _expose(desk: Desk, _request: Request, _body: Any) -> Any:
    desk.screen.expose()
    return desk.state()


def _rest(desk: Desk, _request: Request, _body: Any) -> Any:
    desk.screen.rest()


def _picture(desk: Desk, _request: Request, _body: Any) -> Any:
    sent = _jpeg(packed(desk.screen))
    sent.background = BackgroundTask(desk.screen.fetched.set)
    return sent


def _move(desk: Desk, asked: Mapping[str, Any]) -> tuple[Callable[[Project], Project], int]:
    """Return what a hand does, with a light or along the path, and the revision that it sees."""
    revision = int(asked.get("revision", desk.session.revision))
    if "at" in asked:
        return partial(go_to, at_s=float(asked["at"])), revision
    return partial(move_light, light=int(asked["light"]), x=float(asked["x"]), y=float(asked["y"])), revision


def _moved(desk: Desk, asked: Mapping[str, Any]) -> Moved | None:
    """Draw the project with a light elsewhere, or at a time of its path."""
    return desk.hand.picture(*_move(desk, asked))


def _moving(desk: Desk, request: Request, _body: Any) -> Any:
    found = _moved(desk, request.query_params)
    return Response(status_code=204) if found is None else _jpeg(found.jpeg)


async def _follow(desk: Desk, socket: WebSocket) -> None:
    """Answer the questions of a hand as they come: a line of JSON, then the picture.

    A socket costs browser and server less a picture than requests do. A hand that vanishes with its page has let go
    without a word: then the project's own picture comes back, unless the hand of another page has moved since.
    """
    await socket.accept()
    tasks: set[asyncio.Task[None]] = set()

    async def answer(asked: dict[str, Any]) -> None:
        head: dict[str, Any] = {"number": asked.get("number")}
        picture = b""
        desk.followed = socket
        try:
            found = await run_in_threadpool(_moved, desk, asked)
            if found is not None:
                picture = found.jpeg
                head |= {"seconds": round(found.seconds, 4), "lights": [one.field_deg for one in found.project.lights]}
        except FlarewrightError as error:
            head["error"] = in_short(str(error), desk.session.project, desk.session.file)
        except (ValueError, KeyError, TypeError) as error:
            head["error"] = f"the editor did not understand the page: {error}"
        # the tab may be gone by now
        with suppress(RuntimeError, WebSocketDisconnect):
            await socket.send_bytes(json.dumps(head).encode() + b"\n" + picture)

    try:
        while True:
            task = asyncio.create_task(answer(dict(json.loads(await socket.receive_text()))))
            tasks.add(task)
            task.add_done_callback(tasks.discard)
    except (WebSocketDisconnect, ValueError):
        pass
    finally:
        # what is still being drawn would end the picture that rests
        await asyncio.gather(*tasks, return_exceptions=True)
        if desk.followed is socket:
            desk.followed = None
            await run_in_threadpool(desk.screen.rest)


def _target(desk: Desk, request: Request, _body: Any) -> Any:
    asked = request.query_params
    if not asked.keys() & {"light", "at"}:
        return _jpeg(viewing.target_jpeg(desk.screen))
    found = desk.hand.target(*_move(desk, asked), held="held" in asked)
    return Response(status_code=204) if found is None else _jpeg(found)


def _pick(desk: Desk, request: Request, _body: Any) -> Any:
    asked = request.query_params
    return {"ghosts": list(viewing.picked(desk.screen, float(asked["u"]), float(asked["v"])))}


def _outline(desk: Desk, request: Request, _body: Any) -> Any:
    return Response(
        viewing.outline_png(desk.screen, request.query_params["ghost"]), media_type="image/png", headers=_FRESH
    )


def _ghosts(desk: Desk, _request: Request, _body: Any) -> Any:
    return ghosts_of(desk.screen)


def _section(desk: Desk, request: Request, _body: Any) -> Any:
    drawn = drawings.section(desk.session.project, request.query_params.get("ghost"))
    return {"svg": drawn.svg, "told": drawn.told}


def _coating(desk: Desk, request: Request, _body: Any) -> Any:
    svg = drawings.coating_svg(desk.session.project, int(request.query_params["row"]))
    return Response(svg, media_type="image/svg+xml", headers=_FRESH)


def _colour_map(desk: Desk, request: Request, _body: Any) -> Any:
    data = drawings.colour_map(desk.session.project, request.query_params["ghost"])
    return Response(data, media_type="image/png", headers=_FRESH)


def _mask(desk: Desk, _request: Request, _body: Any) -> Any:
    return Response(drawings.mask_png(desk.session.project), media_type="image/png", headers=_FRESH)


def _places(desk: Desk, _request: Request, _body: Any) -> Any:
    return {"places": drawings.places(desk.session.project)}


def _library(_desk: Desk, _request: Request, _body: Any) -> Any:
    return {"lenses": list(drawings.library()), "looks": list(drawings.looks())}


def _thumbnail(_desk: Desk, request: Request, _body: Any) -> Any:
    return _jpeg(thumbnail(request.path_params["kind"], request.path_params["name"]))


def _glasses(_desk: Desk, request: Request, _body: Any) -> Any:
    from ..io.glass_catalogue import all_names

    words = request.query_params.get("q", "").lower().replace(" ", "")
    names = [name for name in all_names() if words in name.lower().replace(" ", "")]

    def far(name: str) -> tuple[bool, bool, str]:
        # a glass that begins so comes first, with or without its maker's name or the N of new glasses
        glass = name.lower().split(" ", 1)[-1]
        forms = (glass, glass.removeprefix("n-"), name.lower().replace(" ", ""))
        return glass != words, not any(form.startswith(words) for form in forms), name

    names.sort(key=far)
    return {"glasses": names[:40]}


def _import(desk: Desk, request: Request, body: Any) -> Any:
    asked = request.query_params
    light = int(asked["light"]) if asked.get("light") else None
    remarks = take_in(desk.session, asked["name"], body, asked.get("as", ""), light)
    return desk.state() | {"told": list(remarks)}


def _open(desk: Desk, _request: Request, body: Any) -> Any:
    desk.session.open(str(body["text"]))
    return desk.state()


def _save(desk: Desk, _request: Request, body: Any) -> Any:
    path = desk.session.save(str(body["text"]))
    return desk.state() | {"told": f"Saved {path}"}


def _command(desk: Desk, _request: Request, _body: Any) -> Any:
    if desk.session.file is None or not desk.session.clean:
        raise ProjectError("save the project first: the command renders the file")
    return {"text": files.command_line(desk.session.file, desk.session.project)}


def _export(desk: Desk, request: Request, _body: Any) -> Any:
    kind, project = request.path_params["kind"], desk.session.project
    if kind not in files.SUFFIXES:
        raise ProjectError(f"there is no export {kind!r}; known are {', '.join(files.SUFFIXES)}")
    stem = Path(desk.session.file).stem if desk.session.file else "flare"
    name = {"Content-Disposition": f'attachment; filename="{_plain(stem)}{files.SUFFIXES[kind]}"'}
    if kind == "exr":
        folder = tempfile.mkdtemp(prefix="flarewright-")
        path = Path(folder) / "flare.exr"
        tell = desk.session.tell
        files.export_picture(project, path, lambda part, what: tell({"type": "export", "part": part, "what": what}))
        return FileResponse(path, headers=name, media_type="image/x-exr", background=BackgroundTask(_remove, path))
    if kind == "png":
        from .shown import png

        return Response(png(shown_pixels(desk.screen)), media_type="image/png", headers=name)
    if kind == "csv" and desk.screen.seen is None:
        raise ProjectError("the ghosts are still being measured; try again in a moment")
    from ..io.project_file import project_text

    if kind == "lens":
        text = files.lens_text(project)
    elif kind == "project":
        text = project_text(project)
    elif kind == "look":
        text = files.look_of_project(project, stem)
    else:
        assert desk.screen.seen is not None
        text = files.ghost_csv(desk.screen.seen)
    return Response(text, media_type="text/plain; charset=utf-8", headers=name)


def _remove(path: Path) -> None:
    """Remove an exported file when it is sent."""
    path.unlink(missing_ok=True)
    path.parent.rmdir()


def _plain(stem: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "_" for c in stem) or "flare"


def _seconds(body: Any) -> float:
    return min(max(float(body.get("seconds", 30.0)), 1.0), MOST_SECONDS)


def _solve(desk: Desk, _request: Request, body: Any) -> Any:
    desk.solver.start(_seconds(body))
    return desk.state()


def _colors(desk: Desk, _request: Request, body: Any) -> Any:
    desk.solver.start_colors(str(body.get("kind", "quarter-wave")), _seconds(body))
    return desk.state()


def _stop(desk: Desk, _request: Request, _body: Any) -> Any:
    desk.solver.stop()
    return desk.state()


def _accept(desk: Desk, _request: Request, body: Any) -> Any:
    told = desk.solver.accept(int(body["number"]))
    return desk.state() | {"told": told}


def _candidate(desk: Desk, request: Request, _body: Any) -> Any:
    found, k = desk.solver.fitting.found, int(request.path_params["k"])
    if not 0 <= k < len(found):
        raise ProjectError(f"there is no lens {k} among those found")
    return _jpeg(found[k].picture)


_FRESH = {"Cache-Control": "no-store"}


def _jpeg(data: bytes, more: dict[str, str] | None = None) -> Response:
    return Response(data, media_type="image/jpeg", headers=_FRESH | (more or {}))


_GET = {
    "/api/state": _state, "/api/picture": _picture, "/api/moving": _moving, "/api/target": _target,
    "/api/pick": _pick, "/api/outline": _outline, "/api/ghosts": _ghosts, "/api/section": _section,
    "/api/coating": _coating, "/api/map": _colour_map, "/api/mask": _mask,
    "/api/places": _places, "/api/library": _library,
    "/api/thumbnail/{kind}/{name}": _thumbnail, "/api/glasses": _glasses, "/api/command": _command,
    "/api/export/{kind}": _export, "/api/candidate/{k}": _candidate,
}  # fmt: skip
_POST = {
    "/api/do": _do, "/api/view": _view, "/api/undo": _undo, "/api/redo": _redo, "/api/expose": _expose,
    "/api/rest": _rest, "/api/import": _import, "/api/open": _open, "/api/save": _save, "/api/solve": _solve,
    "/api/colors": _colors, "/api/stop": _stop, "/api/accept": _accept,
}  # fmt: skip


async def _index(_request: Request) -> Response:
    return FileResponse(STATIC / "index.html", headers=_FRESH)


def make_app(desk: Desk, token: str | None = None) -> Application:
    """Return the ASGI application of a desk.

    Parameters
    ----------
    desk : Desk
    token : str, optional
        Needed wherever the editor is not on the loopback address.

    Returns
    -------
    callable
    """
    routes: list[Any] = [Route("/", _index)]
    routes += [Route(path, told(work)(desk), methods=["GET"]) for path, work in _GET.items()]
    routes += [Route(path, told(work)(desk), methods=["POST"]) for path, work in _POST.items()]
    routes += [WebSocketRoute("/ws", desk.socket), WebSocketRoute("/ws/moving", partial(_follow, desk))]
    routes += [Mount("/static", StaticFiles(directory=STATIC))]
    return Guard(Starlette(routes=routes), token)


def serve(desk: Desk, host: str, port: int, token: str | None, ready: Callable[[int], None]) -> None:
    """Serve until Ctrl-C.

    Parameters
    ----------
    desk : Desk
    host : str
    port : int
        0: any that is free.
    token : str or None
    ready : callable
        Called with the port once the page can be opened.

    Raises
    ------
    ProjectError
        When the port is taken.
    """
    import socket

    import uvicorn

    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as place:
        place.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            place.bind((host, port))
        except OSError as error:
            why = (error.strerror or str(error)).lower()
            taken = error.errno in (errno.EADDRINUSE, errno.EACCES)
            remedy = "choose another --port, or 0 for any that is free" if taken else "check --host"
            raise ProjectError(f"the editor cannot listen on {host}:{port} ({why}); {remedy}") from None
        # whoever comes now waits until the server is up
        place.listen(128)
        desk.screen.start()
        config = uvicorn.Config(make_app(desk, token), log_level="warning", lifespan="off", **SOCKETS)
        ready(place.getsockname()[1])
        uvicorn.Server(config).run([place])
    desk.session.keeper.close()
