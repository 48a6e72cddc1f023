"""Who may reach the editor, and what one client can take from it: by single requests, without a network."""

import asyncio
import json
import os
import sys
import threading
from functools import partial

import pytest

pytest.importorskip("starlette", reason="the extra ui is not installed")
pytest.importorskip("uvicorn", reason="the extra ui is not installed")

from starlette.routing import Mount, WebSocketRoute

from flarewright.cli.app import run
from flarewright.editor.server.access import HEADERS, Access, access_of
from flarewright.editor.server.app import _POST, IMPORT, MOST_BODY, make_app
from flarewright.editor.server.tokens import NAME, VARIABLE, token_of
from flarewright.editor.server.turns import Crowded, Turns
from flarewright.editor.server.uploads import MOST_BYTES
from flarewright.editor.server.workspace import MOST_UNREAD, Tab, Workspace
from flarewright.editor.session.session import begin
from flarewright.errors import ProjectError
from flarewright.io.files.state_folder import state_folder

TOKEN = "Grüße; und=mehr, & so"
ACCESS = Access(TOKEN)
COOKIE = {"cookie": f"x=1; flarewright_token_8640={ACCESS.secret}"}
OWN = {**COOKIE, "origin": "http://127.0.0.1:8640", "sec-fetch-site": "same-origin"}


@pytest.fixture
def workspace():
    found = Workspace(begin(None)[0])
    yield found
    found.close()


def asked(app, path, method="GET", headers=COOKIE, body=(), query=b"", kind="http"):
    """Send one request; return status, headers, body, and the number of bytes that were read."""
    sent, parts, read = [], [*body] or [b""], 0
    pairs = [(key.encode(), value.encode("latin-1")) for key, value in {"host": "127.0.0.1:8640", **headers}.items()]
    scope = {"type": kind, "method": method, "path": path, "root_path": "", "query_string": query, "headers": pairs}

    async def receive():
        nonlocal read
        if kind == "websocket":
            return {"type": "websocket.connect"} if not sent else {"type": "websocket.disconnect"}
        if not parts:
            # the client awaits the answer
            await asyncio.Event().wait()
        part = parts.pop(0)
        read += len(part)
        return {"type": "http.request", "body": part, "more_body": bool(parts)}

    async def send(message):
        sent.append(message)

    asyncio.run(asyncio.wait_for(app(scope, receive, send), 20.0))
    if kind == "websocket":
        return sent[0]["type"]
    head = {key.decode(): value.decode() for key, value in sent[0]["headers"]}
    return sent[0]["status"], head, b"".join(message.get("body", b"") for message in sent[1:]), read


def paths(app):
    """Return method and path of every route, one path for each that has a variable part."""
    for route in app.routes:
        if isinstance(route, WebSocketRoute):
            continue
        path = f"{route.path}/app.js" if isinstance(route, Mount) else route.path.replace("{kind}", "x")
        methods = {"GET"} if isinstance(route, Mount) else route.methods - {"HEAD"}
        yield from ((method, path.replace("{name}", "x").replace("{k}", "0")) for method in methods)


def test_without_the_token_nothing_is_answered(workspace):
    app = make_app(workspace, ACCESS)
    before = workspace.session.project
    found = list(paths(app))
    assert len(found) > 30
    other = Access("another token")
    for wrong in (
        {},
        {"cookie": "flarewright_token_8640="},
        {"cookie": f"flarewright_token_8640={other.secret}"},
        # the cookie of another editor, on another port of the same computer
        {"cookie": f"flarewright_token_8641={ACCESS.secret}"},
        {"cookie": f"flarewright_token_8640={TOKEN.encode().decode('latin-1')}"},
    ):
        for method, path in found:
            status, _, body, _ = asked(app, path, method, wrong)
            assert (status, b"needs its token" in body) == (403, True), (method, path, wrong)
        for path in ("/ws", "/ws/moving"):
            assert asked(app, path, headers=wrong, kind="websocket") != "websocket.accept"
    assert asked(app, "/", headers={}, query=b"token=wrong")[0] == 403
    # the token opens the page alone
    assert asked(app, "/api/state", headers={}, query=b"token=Gr%C3%BC%C3%9Fe%3B+und%3Dmehr%2C+%26+so")[0] == 403
    assert workspace.session.project == before


def test_the_token_of_the_address_is_remembered_in_a_cookie(workspace):
    app = make_app(workspace, ACCESS)
    address = ACCESS.address("127.0.0.1", 8640)
    status, head, body, _ = asked(app, "/", headers={}, query=address.partition("?")[2].encode())
    assert (status, b"<canvas" in body) == (200, True)
    cookie, *flags = head["set-cookie"].split("; ")
    assert flags == ["HttpOnly", "SameSite=Strict", "Path=/"]
    assert TOKEN not in head["set-cookie"]
    assert asked(app, "/api/state", headers={"cookie": cookie})[0] == 200
    assert asked(app, "/", headers={"cookie": cookie})[0] == 200
    assert "set-cookie" not in asked(app, "/", headers={"cookie": cookie})[1]
    assert asked(app, "/static/app.js", headers={"cookie": cookie})[0] == 200
    assert asked(app, "/api/state", headers={"cookie": f"{cookie}0"})[0] == 403
    assert asked(app, "/ws", headers={"cookie": cookie}, kind="websocket") == "websocket.accept"


@pytest.mark.parametrize(
    "foreign",
    [
        # a picture, a script, a form and a frame of another site, or of another port of this computer
        {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors", "sec-fetch-dest": "image"},
        {"sec-fetch-site": "same-site", "sec-fetch-mode": "no-cors", "sec-fetch-dest": "script"},
        {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "iframe"},
        {"sec-fetch-site": "cross-site", "sec-fetch-mode": "cors", "sec-fetch-dest": "empty"},
        # browsers without Fetch Metadata
        {"origin": "http://evil.example"},
        {"origin": "http://127.0.0.1:8641"},
        {"origin": "null"},
        {"origin": "http://["},
    ],
)
def test_other_websites_are_refused_though_the_browser_sends_the_cookie(workspace, foreign):
    app = make_app(workspace, ACCESS)
    revision = workspace.session.revision
    for method, path in paths(app):
        assert asked(app, path, method, {**COOKIE, **foreign})[0] == 403, (method, path)
    for path in ("/ws", "/ws/moving"):
        assert asked(app, path, headers={**COOKIE, **foreign}, kind="websocket") != "websocket.accept"
    assert workspace.session.revision == revision


def test_a_link_opens_the_page_and_nothing_else(workspace):
    app = make_app(workspace, ACCESS)
    link = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    query = ACCESS.address("127.0.0.1", 8640).partition("?")[2].encode()
    assert asked(app, "/", headers=link, query=query)[0] == 200
    assert asked(app, "/api/state", headers={**COOKIE, **link})[0] == 403
    assert asked(app, "/api/undo", "POST", {**COOKIE, **link})[0] == 403


@pytest.mark.parametrize("host", ["[", "[::1", "evil.example", "127.0.0.1.evil.example", "a b", "", "é", "127.0.0.1:x"])
def test_a_strange_host_is_refused(workspace, host):
    for access in (ACCESS, Access(TOKEN, "0.0.0.0")):
        app = make_app(workspace, access)
        for path in ("/", "/api/state", "/static", "/nothing"):
            status, _, body, _ = asked(app, path, headers={**COOKIE, "host": host})
            assert 400 <= status < 500
            assert 10 < len(body.splitlines()[0]) < 200
    for good in ("localhost:8640", "127.0.0.1:8640", "[::1]:8640"):
        assert asked(make_app(workspace, ACCESS), "/api/state", headers={**COOKIE, "host": good})[0] == 200


def test_every_answer_forbids_frames_and_readers(workspace):
    app = make_app(workspace, ACCESS)
    for path, headers in (
        ("/", COOKIE),
        ("/", {}),
        ("/api/state", COOKIE),
        ("/none", COOKIE),
        ("/static/app.js", COOKIE),
    ):
        head = asked(app, path, headers=headers)[1]
        assert {key: head[key.lower()] for key in HEADERS} == HEADERS
    assert asked(app, "/", headers={"host": "evil.example"})[1]["x-content-type-options"] == "nosniff"
    assert "frame-ancestors 'none'" in HEADERS["Content-Security-Policy"]
    assert "unsafe" not in HEADERS["Content-Security-Policy"]


def test_only_posts_change_anything(workspace):
    app = make_app(workspace, ACCESS)
    revision = workspace.session.revision
    for path in _POST:
        status, _, body, _ = asked(app, path, headers=OWN)
        assert (status, json.loads(body)["error"]) == (405, "Method Not Allowed")
    assert workspace.session.revision == revision


DEEP = b'{"values":' * 5000 + b"1" + b"}" * 5000
BODIES = [
    b"[]", b"null", b"7", b'"words"', b"{", b"\xff\xfe", DEEP, b"[" * 100_000,
    b'{"name": "move_light", "values": {"light": 0, "x": NaN, "y": 0}}',
    b'{"name": "move_light", "values": {"light": 0, "x": 1e999, "y": 0}}',
    b'{"name": "move_light", "values": {"light": 0, "x": 1e308, "y": "' + b"9" * 5000 + b'"}}',
    b'{"name": ' + b'[[' * 12 + b"]]" * 12 + b"}",
]  # fmt: skip


@pytest.mark.parametrize("body", BODIES, ids=range(len(BODIES)))
def test_a_body_that_no_page_sends_gets_a_sentence(workspace, body, capsys):
    app = make_app(workspace, ACCESS)
    before = workspace.session.project
    for path in ("/api/do", "/api/view", "/api/open", "/api/save", "/api/solve", "/api/accept"):
        status, _, answer, _ = asked(app, path, "POST", OWN, [body])
        words = json.loads(answer)["error"]
        assert (status, words.count("\n")) == (400, 0), path
        assert 10 < len(words) < 250
    assert workspace.session.project == before
    assert capsys.readouterr().err == ""


def test_a_large_body_is_refused_before_it_is_read(workspace):
    app = make_app(workspace, ACCESS)
    huge = {**OWN, "content-length": str(600 * 2**20)}
    for path in ("/api/do", IMPORT):
        status, _, _, read = asked(app, path, "POST", huge, [b" " * 1000] * 3, query=b"name=a.toml")
        assert (status, read) == (413, 0)
    # without a stated length it ends where the limit is passed
    part = b" " * 2**18
    status, _, answer, read = asked(app, "/api/do", "POST", OWN, [part] * 40)
    assert (status, read) == (413, MOST_BODY + 2**18)
    assert "larger than the editor reads" in json.loads(answer)["error"]
    # a file may be larger, and is refused here for what it is
    status, _, answer, read = asked(app, IMPORT, "POST", OWN, [part] * 5, query=b"name=a.pdf")
    assert (status, read) == (400, 5 * 2**18)
    assert "cannot be opened here" in json.loads(answer)["error"]
    assert MOST_BYTES > MOST_BODY


@pytest.mark.parametrize(
    ("base_url", "path", "host", "printed"),
    [
        ("/user/me/proxy/8640/", "/user/me/proxy/8640", "127.0.0.1:8640", "http://127.0.0.1:8640/user/me/proxy/8640/"),
        ("https://hub.example/user/me/", "/user/me", "hub.example", "https://hub.example/user/me/"),
        ("http://hub.example:8000", "", "hub.example:8000", "http://hub.example:8000/"),
    ],
)
def test_a_proxy_may_put_a_path_before_all_addresses(workspace, base_url, path, host, printed):
    access = access_of(TOKEN, "127.0.0.1", base_url)
    app = make_app(workspace, access)
    address, _, query = access.address("127.0.0.1", 8640).partition("?")
    assert address == printed
    # with the prefix, or cut off by the proxy
    for prefix in {path, ""}:
        own = {"host": host, "origin": access.origin or f"http://{host}"}
        status, head, _, _ = asked(app, f"{prefix}/", headers=own, query=query.encode())
        assert status == 200
        cookie, *flags = head["set-cookie"].split("; ")
        assert f"Path={path}/" in flags
        assert ("Secure" in flags) == base_url.startswith("https:")
        own["cookie"] = cookie
        assert asked(app, f"{prefix}/api/state", headers=own)[0] == 200
        assert asked(app, f"{prefix}/static/app.js", headers=own)[0] == 200
        assert asked(app, f"{prefix}/ws", headers=own, kind="websocket") == "websocket.accept"
        assert asked(app, f"{prefix}/api/state", headers={**own, "origin": "http://evil.example"})[0] == 403
        assert asked(app, f"{prefix}/api/state", headers={**own, "cookie": ""})[0] == 403
    # a proxy that names its own host in the address of the server
    if access.origin:
        renamed = {"origin": access.origin, "cookie": f"flarewright_token_8640={access.secret}"}
        assert asked(app, "/api/undo", "POST", renamed)[0] == 200


def test_the_page_has_no_absolute_address(workspace):
    from flarewright.editor.server.app import STATIC

    for path in STATIC.iterdir():
        text = path.read_text("utf-8")
        for address in ('"/static', '"/api', "'/api", "`/api", "'/ws", "`/ws", "location.host"):
            assert address not in text, (path.name, address)


@pytest.mark.parametrize(
    "base_url", ["user", "ftp://a/", "http://", "http://[", "//host/", "/a?b", "/a#b", "/a b", "/a;b"]
)
def test_a_base_url_that_is_none_is_refused(base_url):
    with pytest.raises(ProjectError, match="is no address"):
        access_of(TOKEN, "127.0.0.1", base_url)


def test_a_token_is_random_and_kept_for_the_account(tmp_path, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    token = token_of(None)
    assert len(token) >= 32
    assert token_of(None) == token
    path = state_folder() / NAME
    if sys.platform != "win32":
        assert path.stat().st_mode & 0o077 == 0
        # others may have read it: it is replaced
        path.chmod(0o644)
        assert token_of(None) != token
        assert path.stat().st_mode & 0o077 == 0
        # a link could lead to a file that another account knows
        (tmp_path / "known").write_text("x" * 40)
        path.unlink()
        path.symlink_to(tmp_path / "known")
        assert token_of(None) != "x" * 40
        assert (tmp_path / "known").read_text() == "x" * 40
    for damaged in ("", "short", "\x00" * 50):
        path.write_text(damaged)
        os.chmod(path, 0o600)
        assert len(token_of(None)) >= 32 or damaged.startswith("\x00")
    monkeypatch.setenv(VARIABLE, "of the environment")
    assert token_of(None) == "of the environment"
    (tmp_path / "token").write_text("of the file\n")
    assert token_of(tmp_path / "token") == "of the file"
    for bad in (b"two\nlines", b"\xff\xfe", b"x" * 5000):
        (tmp_path / "token").write_bytes(bad)
        with pytest.raises(ProjectError, match="--token-file"):
            token_of(tmp_path / "token")
    with pytest.raises(ProjectError, match=r"--token-file: .*none does not exist: check the path"):
        token_of(tmp_path / "none")
    with pytest.raises(ProjectError, match=r"--token-file: .* is a folder"):
        token_of(tmp_path)


def test_a_token_is_no_option(tmp_path, capsys):
    (tmp_path / "short").write_text("short")
    for words, said in (
        (["--token", "a-secret-token"], "--token"),
        (["--token-file", str(tmp_path / "short")], "too short"),
        (["--token-file", str(tmp_path / "none")], "does not exist"),
        (["--base-url", "ftp://x"], "is no address"),
        # used to be accepted, and nothing in it could be opened
        (["--root", str(tmp_path / "nope")], "nope is no folder; give one that exists"),
    ):
        assert run(["edit", "--no-browser", *words]) == 2
        printed = capsys.readouterr().err
        assert printed.startswith("flarewright: error: ")
        assert said in " ".join(printed.split())


def test_an_address_that_can_be_opened_is_printed(monkeypatch, capsys):
    """0.0.0.0 is an address to listen on, not one that a browser can open."""
    from flarewright.editor.server import launch

    monkeypatch.setattr(launch, "serve", lambda workspace, access, port, ready: ready(8123))
    monkeypatch.setenv(VARIABLE, "eight & more")
    for known, elsewhere in (("198.51.100.7", "198.51.100.7"), (None, "box")):
        monkeypatch.setattr(launch, "_own_address", lambda beyond, known=known: known)
        monkeypatch.setattr("socket.gethostname", lambda: "box")
        assert run(["edit", "--no-browser", "--host", "0.0.0.0"]) == 0
        here, there, warning, *_ = capsys.readouterr().err.splitlines()
        assert here.split()[5] == "http://127.0.0.1:8123/?token=eight%20%26%20more"
        assert there.split()[-1] == f"http://{elsewhere}:8123/?token=eight%20%26%20more"
        assert "unencrypted" in warning
    monkeypatch.delenv(VARIABLE)
    assert run(["edit", "--no-browser", "--port", "0"]) == 0
    assert f"http://127.0.0.1:8123/?token={token_of(None)}  (" in capsys.readouterr().err
    assert launch.hosts("::")[0] == "::1"


def test_requests_wait_in_a_bounded_queue_and_leave_it_with_their_client():
    async def scene():
        turns, blocked, done = Turns(1, 3), threading.Event(), []
        gone, running = asyncio.Event(), threading.Event()

        def work(name, left):
            running.set()
            blocked.wait(20.0)
            done.append((name, left.is_set()))
            return name

        async def stays():
            await asyncio.Event().wait()

        async def leaves():
            await gone.wait()

        first = asyncio.ensure_future(turns.run_for(partial(work, "first"), leaves))
        second = asyncio.ensure_future(turns.run_for(partial(work, "second"), leaves))
        last = asyncio.ensure_future(turns.run_for(partial(work, "last"), stays))
        await asyncio.sleep(0)
        fourth = asyncio.ensure_future(turns.run_for(partial(work, "fourth"), leaves))
        while not running.is_set():
            await asyncio.sleep(0.001)
        with pytest.raises(Crowded):
            await turns.run(lambda: None)
        gone.set()
        # clients that left make room at once, though the first is not done
        assert [await second, await fourth] == [None, None]
        room = asyncio.ensure_future(turns.run(lambda: "room"))
        blocked.set()
        assert [await first, await last, await room] == ["first", "last", "room"]
        # the one that ran already learned that no client awaits it
        assert done == [("first", True), ("last", False)]

    asyncio.run(scene())


def test_a_tab_that_does_not_read_costs_no_memory():
    tab = Tab()
    for k in range(3000):
        tab.put({"type": "progress", "part": k})
        tab.put({"type": "changed", "revision": k})
        tab.put({"type": "message", "kind": "info", "text": f"words {k}"})
    assert tab.unread["progress"]["part"] == tab.unread["changed"]["revision"] == 2999
    assert len(tab.unread) == 2 + MOST_UNREAD
    assert list(tab.unread)[-1] == "message words 2999"
