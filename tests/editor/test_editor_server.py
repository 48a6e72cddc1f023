"""The editor's server as the page talks to it, without a browser."""

import json
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="the extra ui is not installed")
pytest.importorskip("uvicorn", reason="the extra ui is not installed")

from flarewright.cli.app import run
from flarewright.editor.desk import Desk
from flarewright.editor.guard import Guard
from flarewright.editor.server import _GET, _POST, SOCKETS, make_app
from flarewright.editor.session import begin
from flarewright.io.lens_file import read_lens

CORPUS = Path(__file__).parents[1]


@pytest.fixture
def desk(screen_size):
    import uvicorn

    session, _ = begin(None)
    desk = Desk(session)
    server = uvicorn.Server(uvicorn.Config(make_app(desk), port=0, log_level="warning", lifespan="off", **SOCKETS))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.005)
    desk.address = f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    desk.screen.start()
    assert desk.screen.wait(60.0)
    yield desk
    server.should_exit = True
    thread.join(5.0)


def ask(desk, path, body=None, headers=None):
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    request = urllib.request.Request(desk.address + path, data, headers or {})
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def told(desk, path, body=None):
    code, data = ask(desk, path, body)
    return code, json.loads(data)


def test_the_page_and_every_question_it_asks(desk):
    assert b"<canvas" in ask(desk, "/")[1]
    assert ask(desk, "/static/app.js")[0] == 200
    state = told(desk, "/api/state")[1]
    assert state["lens"]["facts"]["efl"] == pytest.approx(99.2358, abs=1e-3)
    assert state["picture"]["grade"] == "final"
    asked = {
        "/api/picture", "/api/moving?light=0&x=3&y=1", "/api/target", "/api/target?light=0&x=3&y=1",
        "/api/outline?ghost=8-6", "/api/coating?row=0", "/api/map?ghost=8-6", "/api/thumbnail/lens/tessar-brendel",
        "/api/thumbnail/look/low-sun", "/api/export/png",
    }  # fmt: skip
    kinds = {b"\xff\xd8": "jpeg", b"\x89P": "png", b"<s": "svg"}
    # so far from the axis what the sensor mirrors ends on rims
    for path, missing in (
        ("/api/section", False),
        ("/api/section?ghost=8-6", False),
        ("/api/section?ghost=sensor-4", True),
    ):
        code, drawn = told(desk, path)
        assert (code, drawn["svg"][:4], bool(drawn["told"])) == (200, "<svg", missing)
    for path in sorted(asked):
        code, data = ask(desk, path)
        assert (code, data[:2] in kinds) == (200, True), path
    assert told(desk, "/api/pick?u=0.5&v=0.5")[1]["ghosts"]
    assert told(desk, "/api/places")[1]["places"]
    assert "N-BK7" in str(told(desk, "/api/glasses?q=n-bk")[1])
    library = told(desk, "/api/library")[1]
    assert len(library["lenses"]) >= 12
    assert len(library["looks"]) >= 12
    assert b'name = "Flare"' in ask(desk, "/api/export/look")[1]
    assert told(desk, "/api/ghosts")[1]["ghosts"][0]["share"] == 1.0
    # a hand that has let go is shown no target any more
    assert ask(desk, "/api/target?at=0&revision=-1") == (204, b"")
    spoken = {path.split("?")[0] for path in asked} | {"/api/state", "/api/pick", "/api/places", "/api/glasses"}
    spoken |= {"/api/library", "/api/ghosts", "/api/command", "/api/section", "/api/mask"}
    assert told(desk, "/api/mask") == (400, {"error": "the iris has no mask; load or draw one"})
    missing = {path for path in _GET if "{" not in path} - spoken
    assert not missing


def test_deeds_undo_and_what_is_refused(desk):
    code, state = told(desk, "/api/do", {"name": "move_light", "values": {"light": 0, "x": 2.0, "y": 1.0}})
    assert (code, state["lights"][0]["field_deg"], state["undo"]) == (200, [2.0, 1.0], "Move the light")
    assert told(desk, "/api/undo", {})[1]["lights"][0]["field_deg"] == [8.0, 4.4]
    assert told(desk, "/api/redo", {})[1]["lights"][0]["field_deg"] == [2.0, 1.0]
    for path, body in (
        ("/api/do", {"name": "set_cell", "values": {"row": 0, "column": "glass", "text": "XYZ"}}),
        ("/api/do", {"name": "fly"}),
        ("/api/do", {}),
        ("/api/view", {"look": "sepia"}),
        ("/api/open", {"text": "no-such-lens"}),
        ("/api/save", {"text": "/no/such/folder/x.toml"}),
        ("/api/import?name=notes.pdf", b"%PDF"),
        ("/api/import?name=bad.toml", b"[[["),
        ("/api/import?name=bad.lens", b"\x00\x01 nothing"),
        ("/api/import?name=bad.png", b"no picture"),
    ):
        code, answer = told(desk, path, body)
        assert code == 400, path
        assert answer["error"]
        assert "Traceback" not in answer["error"]
    assert told(desk, "/api/moving?light=7&x=1&y=1")[0] == 400
    assert told(desk, "/api/coating?row=5")[0] == 400
    assert ask(desk, "/api/thumbnail/lens/..%2f..%2fsecret")[0] in (400, 404)
    assert told(desk, "/api/thumbnail/lens/secret")[0] == 400
    assert told(desk, "/api/export/zip")[0] == 400


def test_import_export_and_the_command(desk, tmp_path):
    lens = Path(str(read_lens.__globals__["__file__"])).parents[1] / "lenses" / "tessar-brendel.toml"
    code, state = told(desk, "/api/import?name=tessar.toml", lens.read_bytes())
    assert (code, "Tessar" in state["lens"]["name"]) == (200, True)
    assert told(desk, "/api/command")[0] == 400
    saved = tmp_path / "my shot.toml"
    assert told(desk, "/api/save", {"text": str(saved)})[0] == 200
    assert told(desk, "/api/command")[1]["text"].startswith("flarewright render --project '")
    assert run(["project", "check", str(saved)]) == 0
    exported = ask(desk, "/api/export/lens")[1]
    path = tmp_path / "x.toml"
    path.write_bytes(exported)
    again = read_lens(path).lens
    assert [row.thickness for row in again.rows] == [row.thickness for row in read_lens(lens).lens.rows]
    project = ask(desk, "/api/export/project")[1]
    told(desk, "/api/open", {"text": "heliar-tronnier"})
    assert told(desk, "/api/import?name=shot.toml", project)[1]["lens"]["name"] == state["lens"]["name"]
    assert desk.screen.wait(60.0)
    table = ask(desk, "/api/export/csv")[1].decode().splitlines()
    assert table[0].startswith("ghost,flux_mm2")
    assert len(table) == 1 + len(desk.screen.seen.ghosts)


def test_a_background_that_is_gone_is_told(desk, tmp_path):
    told(desk, "/api/view", {"plate": str(tmp_path / "gone.png")})
    code, answer = told(desk, "/api/picture")
    assert (code, "is gone" in answer["error"]) == (400, True)
    told(desk, "/api/view", {"plate": None})
    assert ask(desk, "/api/picture")[0] == 200


def test_a_hand_is_followed_through_a_socket(desk):
    from websockets.sync.client import connect

    def ask_for(socket, **values):
        socket.send(json.dumps(values))
        head, _, picture = socket.recv().partition(b"\n")
        return json.loads(head), picture

    revision = desk.session.revision
    address = desk.address.replace("http", "ws") + "/ws/moving"
    with connect(address) as socket:
        head, picture = ask_for(socket, number=1, light=0, x="3", y="1", revision=revision)
        assert (head["number"], head["lights"], picture[:2]) == (1, [[3.0, 1.0]], b"\xff\xd8")
        # the light has no path: it stays
        head, picture = ask_for(socket, number=2, at="2.5", revision=revision)
        assert (head["lights"], picture[:2]) == ([[8.0, 4.4]], b"\xff\xd8")
        head, picture = ask_for(socket, number=3, light=0, x="3", y="1", revision=revision - 1)
        assert (head, picture) == ({"number": 3}, b"")
        head, picture = ask_for(socket, number=4, light=7, x="3", y="1", revision=revision)
        assert ("there is no light 7" in head["error"], picture) == (True, b"")
        assert "did not understand" in ask_for(socket, number=5, light="first", x="3", y="1")[0]["error"]
    with pytest.raises(Exception, match=r"403|1008|rejected"), connect(address, origin="http://evil.example"):
        pass


def test_a_hand_that_vanishes_has_let_go(desk):
    from websockets.sync.client import connect

    def current():
        return told(desk, "/api/state")[1]["picture"]["current"]

    def rests(wanted):
        end = time.monotonic() + 60.0
        while current() != wanted and time.monotonic() < end:
            time.sleep(0.05)
        return current() == wanted

    address = desk.address.replace("http", "ws") + "/ws/moving"
    moved = json.dumps({"number": 1, "light": 0, "x": "3", "y": "1", "revision": desk.session.revision})
    with connect(address) as socket:
        socket.send(moved)
        socket.recv()
        # held still, it is drawn as if it had let go
        assert rests(False)
        assert desk.screen.wait(60.0)
    assert rests(True)
    # the hand of another page is not disturbed
    with connect(address) as other:
        with connect(address) as socket:
            socket.send(moved)
            socket.recv()
            other.send(moved)
            other.recv()
        assert rests(False)
        assert desk.screen.wait(60.0)
        assert not current()
    assert rests(True)


def test_strangers_are_kept_out(desk):
    assert ask(desk, "/api/state", headers={"Host": "evil.example"})[0] == 403
    assert ask(desk, "/api/undo", {}, {"Origin": "http://evil.example"})[0] == 403
    assert ask(desk, "/api/state", headers={"Host": "localhost:1"})[0] == 200

    def scope(query=b"", **headers):
        pairs = [(key.encode(), value.encode()) for key, value in {"host": "box:1", **headers}.items()]
        return {"type": "http", "headers": pairs, "query_string": query}

    guard = Guard(lambda *_: None, "a-secret-token")
    assert not guard._welcome(scope())
    assert not guard._welcome(scope(b"token=wrong"))
    assert guard._welcome(scope(b"token=a-secret-token"))
    assert guard._welcome(scope(cookie="x=1; flarewright_token_1=a-secret-token"))
    # another editor's, on another port of the same machine
    assert not guard._welcome(scope(cookie="flarewright_token_2=a-secret-token"))
    assert not guard._welcome(scope(b"token=a-secret-token", origin="http://other:1"))


@pytest.mark.parametrize("token", ["a-secret-token", "Grüße; und=mehr, & so"])
def test_a_token_that_came_with_the_address_is_remembered(token):
    """Whatever signs it has: the page's own scripts are asked for with the cookie alone."""
    import asyncio
    from urllib.parse import quote

    sent = []

    async def page(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message):
        sent.append(message)

    def scope(query="", **headers):
        pairs = [(key.encode(), value.encode()) for key, value in {"host": "box:8640", **headers}.items()]
        return {"type": "http", "headers": pairs, "query_string": query.encode()}

    guard = Guard(page, token)
    asyncio.run(guard(scope(f"token={quote(token, safe='')}"), None, send))
    cookie = dict(sent[-1]["headers"])[b"set-cookie"].decode("ascii")
    asyncio.run(guard(scope(cookie=cookie.partition(";")[0]), None, send))
    assert [message["status"] for message in sent if message["type"] == "http.response.start"] == [200, 200]
    asyncio.run(guard(scope(cookie=cookie.partition(";")[0] + "x"), None, send))
    assert sent[-2]["status"] == 403


def test_the_command_line_keeps_to_itself(capsys):
    for words in (["--host", "0.0.0.0"], ["--host", "0.0.0.0", "--token", "short"], ["no-such-lens"]):
        assert run(["edit", "--no-browser", *words]) == 2
        said = capsys.readouterr().err
        assert said.startswith("flarewright: error: ")
        assert said.count("\n") == 1


def test_a_taken_port_is_told(capsys):
    import socket

    with socket.socket() as place:
        place.bind(("127.0.0.1", 0))
        place.listen()
        assert run(["edit", "--no-browser", "--port", str(place.getsockname()[1])]) == 2
    assert "another --port" in " ".join(capsys.readouterr().err.split())


def test_nothing_is_searched_where_nothing_is_wished(desk):
    for path, said in (("/api/solve", "nothing is wished for yet"), ("/api/colors", "no colour is wished for yet")):
        code, answer = told(desk, path, {})
        assert (code, answer["error"].startswith(said)) == (400, True)
        assert "choose a ghost" in answer["error"]
    assert not desk.solver.progress.running


def test_an_address_that_can_be_opened_is_told(monkeypatch, capsys):
    """0.0.0.0 is where a server listens, and nowhere that a browser can go."""
    from flarewright.cli import edit
    from flarewright.editor import server

    monkeypatch.setattr(server, "serve", lambda desk, host, port, token, ready: ready(8123))
    for known, elsewhere in (("198.51.100.7", "198.51.100.7"), (None, "box")):
        monkeypatch.setattr(edit, "_own_address", lambda beyond, known=known: known)
        monkeypatch.setattr("socket.gethostname", lambda: "box")
        assert run(["edit", "--no-browser", "--host", "0.0.0.0", "--token", "eight & more"]) == 0
        here, there = capsys.readouterr().err.splitlines()
        assert here.split()[5] == "http://127.0.0.1:8123/?token=eight%20%26%20more"
        assert there.split()[-1] == f"http://{elsewhere}:8123/?token=eight%20%26%20more"
    assert run(["edit", "--no-browser", "--port", "0"]) == 0
    assert "http://127.0.0.1:8123/  (" in capsys.readouterr().err
    assert edit.hosts("::")[0] == "::1"


def test_posts_are_spoken_for():
    assert {"/api/do", "/api/undo", "/api/redo", "/api/import", "/api/solve", "/api/accept"} <= set(_POST)


def test_an_address_of_another_machine_is_told(capsys):
    words = ["edit", "--no-browser", "--port", "0", "--host", "203.0.113.9", "--token", "long enough"]
    assert run(words) == 2
    assert "check --host" in " ".join(capsys.readouterr().err.split())


def test_without_the_extra_it_says_so(capsys, monkeypatch):
    from flarewright.cli import edit

    monkeypatch.setattr(edit, "find_spec", lambda name: None if name == "websockets" else name)
    assert run(["edit", "--no-browser"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert said == "flarewright: error: the editor needs the extra ui (websockets): pip install 'flarewright[ui]'"


def test_a_place_that_cannot_be_written_is_told(desk, tmp_path):
    (tmp_path / "file").write_text("no folder")
    for place in (tmp_path / "file" / "shot.toml", tmp_path / "no folder" / "shot.toml", tmp_path / "file"):
        code, answer = told(desk, "/api/save", {"text": str(place)})
        if place.name == "file":
            # the ending is added
            assert (code, Path(tmp_path / "file.toml").is_file()) == (200, True)
        else:
            assert (code, answer["error"].count("\n")) == (400, 0)
            assert answer["error"].startswith("cannot write")
    assert desk.session.file == str((tmp_path / "file.toml").resolve())
