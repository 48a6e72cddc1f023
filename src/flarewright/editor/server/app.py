"""The web server of the editor: routes and request handlers."""

from __future__ import annotations

import asyncio
import errno
import logging
import signal
import sys
import tempfile
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.body_limit import RequestBodyLimitMiddleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles

from ...errors import ProjectError
from ...io.images.thumbnails import thumbnail
from ...io.lens.library import is_own
from ...workflow.own_library.thumbnails import read_thumbnail
from ..preview import diagrams, queries
from ..preview.ghost_picking import ghost_csv
from ..preview.viewport import packed_pixels, shown_pixels
from ..session import files
from ..session.plate_finder import outlined
from .access import Access, Guard, SafeHeaders
from .drag_socket import change_of, follow
from .messages import CROWDED, object_of, why_failed
from .page_state import ghost_rows
from .turns import Crowded
from .uploads import MOST_BYTES, take_in
from .workspace import Workspace

STATIC = Path(__file__).parents[1] / "static"
IMPORT = "/api/import"
MOST_SECONDS = 3600.0
# largest body of a request, except of a dropped file, and largest message of a socket, bytes
MOST_BODY, MOST_MESSAGE = 2**20, 2**16
# pictures are compressed already; answers in progress have a moment, in seconds, when the server ends
SERVER: dict[str, Any] = {
    "ws": "websockets-sansio", "ws_per_message_deflate": False, "ws_max_size": MOST_MESSAGE,
    "timeout_graceful_shutdown": 0.2, "log_level": "warning", "lifespan": "off", "proxy_headers": False,
}  # fmt: skip
ENDED = "the editor has ended"

Answer = Callable[[Request], Awaitable[Response]]
Work = Callable[[Workspace, Request, Any], Any]


class Left(Exception):  # noqa: N818 (not an error: no client awaits the result)
    """Raised inside a work whose client has left."""


def _handler(work: Work, workspace: Workspace) -> Answer:
    """Return the handler of a function of request and body: its result as JSON, its error as one sentence.

    The body is a JSON object, or the bytes of a file.
    """

    async def answer(request: Request) -> Response:
        post = request.method == "POST"
        try:
            raw = await request.body() if post else b""
            body: Any = raw if work is _import else object_of(raw)

            def asked(left: threading.Event) -> Any:
                request.state.left = left
                return work(workspace, request, body)

            turns = workspace.changes if post else workspace.questions
            result = await turns.run_for(asked, partial(_left, request))
        except HTTPException:
            raise
        except Crowded:
            return _error(CROWDED, 503)
        except (asyncio.CancelledError, Left):
            # the server ends, or the client has left
            return _error(ENDED, 503)
        except Exception as error:
            return _error(why_failed(error, workspace.session), 400)
        if isinstance(result, Response):
            return result
        return JSONResponse(result if result is not None else {})

    return answer


async def _left(request: Request) -> None:
    """Return when the client of a request has left."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


def _error(words: str, status: int) -> Response:
    return JSONResponse({"error": words}, status_code=status)


async def _refused(_request: Request, error: Exception) -> Response:
    """Answer a request that has no handler, or is too large, by one sentence."""
    assert isinstance(error, HTTPException)
    words = (
        f"the request is larger than the editor reads, {MOST_BODY // 2**20} MB, or {MOST_BYTES // 2**20} MB for a file"
    )
    return _error(words if error.status_code == 413 else error.detail, error.status_code)


def _state(workspace: Workspace, _request: Request, _body: Any) -> Any:
    return workspace.state()


def _do(workspace: Workspace, _request: Request, body: Any) -> Any:
    table = body.get("table")
    group = str(body.get("group", ""))
    became = workspace.session.do(
        str(body["name"]), dict(body.get("values", {})), group, None if table is None else str(table)
    )
    return workspace.state() | {"became": became}


def _then_state(act: Callable[[Workspace, Any], object]) -> Work:
    """Return a handler that does something with the body and answers with the state."""

    def work(workspace: Workspace, _request: Request, body: Any) -> Any:
        act(workspace, body)
        return workspace.state()

    return work


def _rest(workspace: Workspace, _request: Request, _body: Any) -> Any:
    workspace.screen.rest()


def _picture(workspace: Workspace, _request: Request, _body: Any) -> Any:
    sent = _image(packed_pixels(workspace.screen))
    sent.background = BackgroundTask(workspace.screen.fetched.set)
    return sent


def _target(workspace: Workspace, request: Request, _body: Any) -> Any:
    asked = request.query_params
    if not asked.keys() & {"light", "at"}:
        return _image(queries.target_jpeg(workspace.screen))
    found = workspace.drag.target(*change_of(workspace, asked), held="held" in asked)
    return Response(status_code=204) if found is None else _image(found)


def _pick(workspace: Workspace, request: Request, _body: Any) -> Any:
    asked = request.query_params
    return {"ghosts": list(queries.picked(workspace.screen, float(asked["u"]), float(asked["v"])))}


def _outline(workspace: Workspace, request: Request, _body: Any) -> Any:
    return _image(queries.outline_png(workspace.screen, request.query_params["ghost"]), "png")


def _ghosts(workspace: Workspace, _request: Request, _body: Any) -> Any:
    return ghost_rows(workspace.screen)


def _section(workspace: Workspace, request: Request, _body: Any) -> Any:
    drawn = diagrams.cross_section_diagram(workspace.session.project, request.query_params.get("ghost"))
    return {"svg": drawn.svg, "reported": drawn.remark}


def _coating(workspace: Workspace, request: Request, _body: Any) -> Any:
    return _image(diagrams.coating_svg(workspace.session.project, int(request.query_params["row"])), "svg+xml")


def _colour_map(workspace: Workspace, request: Request, _body: Any) -> Any:
    return _image(diagrams.colour_map(workspace.session.project, request.query_params["ghost"]), "png")


def _mask(workspace: Workspace, _request: Request, _body: Any) -> Any:
    return _image(diagrams.mask_png(workspace.session.project), "png")


def _places(workspace: Workspace, _request: Request, _body: Any) -> Any:
    return {"places": diagrams.ghost_places(workspace.session.project)}


def _library(_workspace: Workspace, _request: Request, _body: Any) -> Any:
    return {"lenses": list(diagrams.library()), "looks": list(diagrams.looks())}


def _thumbnail(workspace: Workspace, request: Request, _body: Any) -> Any:
    kind, name = request.path_params["kind"], request.path_params["name"]
    if kind != "lens" or not is_own(name):
        return _image(thumbnail(kind, name))
    if (data := read_thumbnail(name)) is not None:
        return _image(data)
    # the page asks again
    workspace.thumbnails.ask(name)
    return Response(status_code=204, headers=_FRESH)


def _glasses(_workspace: Workspace, request: Request, _body: Any) -> Any:
    from ...io.lens.glass_catalogue import all_names

    words = request.query_params.get("q", "").lower().replace(" ", "")
    names = [name for name in all_names() if words in name.lower().replace(" ", "")]

    def far(name: str) -> tuple[bool, bool, str]:
        # glasses with a matching beginning come first, with or without the maker's name or the N of new glasses
        glass = name.lower().split(" ", 1)[-1]
        forms = (glass, glass.removeprefix("n-"), name.lower().replace(" ", ""))
        return glass != words, not any(form.startswith(words) for form in forms), name

    names.sort(key=far)
    return {"glasses": names[:40]}


def _import(workspace: Workspace, request: Request, body: Any) -> Any:
    asked = request.query_params
    light = int(asked["light"]) if asked.get("light") else None
    remarks = take_in(workspace.session, asked["name"], body, asked.get("as", ""), light)
    return workspace.state() | {"reported": list(remarks)}


def _save(workspace: Workspace, _request: Request, body: Any) -> Any:
    path = workspace.session.save(str(body["text"]))
    return workspace.state() | {"reported": f"Saved {path}"}


def _plate_lights(workspace: Workspace, request: Request, _body: Any) -> Any:
    def progress(_part: float, _what: str) -> None:
        if request.state.left.is_set():
            raise Left

    return outlined(workspace.session, progress)


def _command(workspace: Workspace, _request: Request, _body: Any) -> Any:
    if workspace.session.file is None or not workspace.session.clean:
        raise ProjectError("save the project first: the command renders the file")
    return {"text": files.command_line(workspace.session.file)}


def _export(workspace: Workspace, request: Request, _body: Any) -> Any:
    kind, project = request.path_params["kind"], workspace.session.project
    if kind not in files.SUFFIXES:
        raise ProjectError(f"there is no export {kind!r}; known are {', '.join(files.SUFFIXES)}")
    stem = Path(workspace.session.file).stem if workspace.session.file else "flare"
    name = {"Content-Disposition": f'attachment; filename="{_plain(stem)}{files.SUFFIXES[kind]}"'}
    if kind in ("exr", "comp"):
        folder = Path(tempfile.mkdtemp(prefix="flarewright-"))
        workspace.exports.add(folder)
        path = folder / "flare.exr"

        def progress(part: float, what: str) -> None:
            if request.state.left.is_set():
                raise Left
            workspace.session.tell({"type": "export", "part": part, "what": what})

        try:
            export = files.export_picture if kind == "exr" else files.export_comp
            export(project, path, progress)
        except BaseException:
            workspace.drop_export(folder)
            raise
        return FileResponse(
            path, headers=name, media_type="image/x-exr", background=BackgroundTask(workspace.drop_export, folder)
        )
    if kind == "png":
        from ..preview.display_image import png

        return Response(png(shown_pixels(workspace.screen)), media_type="image/png", headers=name)
    from ..preview.render_picture import pictured

    seen = workspace.screen.seen
    # those of the picture before a change belong to another project
    if kind == "csv" and (seen is None or pictured(seen.project) != pictured(project)):
        raise ProjectError("the ghosts are still being measured; try again in a moment")
    from ...io.project.project_text import project_text

    if kind == "lens":
        text = files.lens_text(project)
    elif kind == "project":
        text = project_text(project)
    elif kind == "look":
        text = files.look_of_project(project, stem)
    else:
        assert seen is not None
        text = ghost_csv(seen)
    return Response(text, media_type="text/plain; charset=utf-8", headers=name)


def _plain(stem: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "_" for c in stem) or "flare"


def _seconds(body: Any) -> float:
    return min(max(float(body.get("seconds", 30.0)), 1.0), MOST_SECONDS)


def _accept(workspace: Workspace, _request: Request, body: Any) -> Any:
    words = workspace.solver.accept(int(body["number"]))
    return workspace.state() | {"reported": words}


def _candidate(workspace: Workspace, request: Request, _body: Any) -> Any:
    found, k = workspace.solver.fitting.found, int(request.path_params["k"])
    if not 0 <= k < len(found):
        raise ProjectError(f"there is no lens {k} among those found")
    return _image(found[k].picture)


_FRESH = {"Cache-Control": "no-store"}


def _image(data: bytes | str, kind: str = "jpeg") -> Response:
    return Response(data, media_type=f"image/{kind}", headers=_FRESH)


_GET = {
    "/api/state": _state, "/api/picture": _picture, "/api/target": _target,
    "/api/pick": _pick, "/api/outline": _outline, "/api/ghosts": _ghosts, "/api/section": _section,
    "/api/coating": _coating, "/api/map": _colour_map, "/api/mask": _mask,
    "/api/places": _places, "/api/library": _library,
    "/api/thumbnail/{kind}/{name}": _thumbnail, "/api/glasses": _glasses, "/api/command": _command,
    "/api/export/{kind}": _export, "/api/plate/lights": _plate_lights, "/api/candidate/{k}": _candidate,
}  # fmt: skip
_POST = {
    "/api/do": _do, "/api/rest": _rest, "/api/import": _import, "/api/save": _save, "/api/accept": _accept,
    "/api/view": _then_state(lambda workspace, body: workspace.session.set_view(dict(body))),
    "/api/undo": _then_state(lambda workspace, _: workspace.session.undo()),
    "/api/redo": _then_state(lambda workspace, _: workspace.session.redo()),
    "/api/expose": _then_state(lambda workspace, _: workspace.screen.expose()),
    "/api/open": _then_state(lambda workspace, body: workspace.session.open(str(body["text"]))),
    "/api/solve": _then_state(lambda workspace, body: workspace.solver.start(_seconds(body))),
    "/api/colors": _then_state(
        lambda workspace, body: workspace.solver.start_colors(str(body.get("kind", "quarter-wave")), _seconds(body))
    ),
    "/api/stop": _then_state(lambda workspace, _: workspace.solver.stop()),
    "/api/plate/find": _then_state(lambda workspace, _: workspace.finder.start()),
    "/api/plate/stop": _then_state(lambda workspace, _: workspace.finder.stop()),
}  # fmt: skip


async def _index(_request: Request) -> Response:
    return FileResponse(STATIC / "index.html", headers=_FRESH)


def make_app(workspace: Workspace, access: Access) -> Starlette:
    """Return the ASGI application of a workspace."""
    file = [Middleware(RequestBodyLimitMiddleware, max_body_size=MOST_BYTES)]
    routes: list[Any] = [Route("/", _index)]
    routes += [Route(path, _handler(work, workspace), methods=["GET"]) for path, work in _GET.items()]
    routes += [
        Route(path, _handler(work, workspace), methods=["POST"], middleware=file if path == IMPORT else None)
        for path, work in _POST.items()
    ]
    routes += [WebSocketRoute("/ws", workspace.socket), WebSocketRoute("/ws/moving", partial(follow, workspace))]
    routes += [Mount("/static", StaticFiles(directory=STATIC))]
    return Starlette(
        routes=routes,
        middleware=[
            Middleware(SafeHeaders),
            Middleware(Guard, access=access),
            # a website cannot reach the editor through its own domain name, even with the cookie
            Middleware(TrustedHostMiddleware, allowed_hosts=access.hosts, www_redirect=False),
        ],
        exception_handlers={HTTPException: _refused},
        max_body_size=MOST_BODY,
    )


def serve(workspace: Workspace, access: Access, port: int, ready: Callable[[int], None]) -> bool:
    """Serve until Ctrl-C, or another request to end.

    Parameters
    ----------
    workspace : Workspace
    access : Access
    port : int
        0: any free port.
    ready : callable
        Called with the port when the page can be opened.

    Returns
    -------
    bool
        Whether a signal ended it. Pictures in progress may still occupy threads then.

    Raises
    ------
    ProjectError
        When the port is taken.
    """
    import socket

    import uvicorn

    host = access.host
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
        # connections wait from now on until the server runs
        place.listen(128)
        workspace.screen.start()

        class Server(uvicorn.Server):
            async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
                # first of all, so that drawing leaves the processor to the end
                workspace.end_work()
                await super().shutdown(sockets)

        server = Server(uvicorn.Config(make_app(workspace, access), **SERVER))
        with _ended_by_signals(server) as signals:
            ready(place.getsockname()[1])
            server.run([place])
            workspace.close()
    return bool(signals)


@contextmanager
def _ended_by_signals(server: Any) -> Iterator[list[int]]:
    """End the server at Ctrl-C, SIGTERM and a closed terminal; collect the signals.

    The server passes a signal on after its end, when the autosave is not written yet, so it must not end the process.
    """
    seen: list[int] = []

    def end(number: int, _frame: object) -> None:
        seen.append(number)
        server.should_exit = True

    if threading.current_thread() is not threading.main_thread():
        yield seen
        return
    known = [signal.SIGINT, signal.SIGTERM, *([] if sys.platform == "win32" else [signal.SIGHUP])]
    before = {number: signal.signal(number, end) for number in known}

    def is_running(_record: object) -> bool:
        # answers that the end cuts off are no faults
        return not server.should_exit

    log = logging.getLogger("uvicorn.error")
    log.addFilter(is_running)
    try:
        yield seen
    finally:
        log.removeFilter(is_running)
        for number, handler in before.items():
            signal.signal(number, handler)
