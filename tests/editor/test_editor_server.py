"""The editor's server, by its requests, without a browser."""

import json
import struct
import threading
import time
import urllib.error
import urllib.request
from dataclasses import replace
from pathlib import Path
from socket import SO_LINGER, SOL_SOCKET

import pytest

pytest.importorskip("starlette", reason="the extra ui is not installed")
pytest.importorskip("uvicorn", reason="the extra ui is not installed")

from flarewright.cli.app import run
from flarewright.editor.commands.lens import prescription
from flarewright.editor.server.access import Access
from flarewright.editor.server.app import _GET, _POST, SERVER, make_app
from flarewright.editor.server.workspace import Workspace
from flarewright.editor.session.session import begin
from flarewright.io.lens.toml_lens import read_lens

CORPUS = Path(__file__).parents[1]


@pytest.fixture
def workspace(screen_size):
    import uvicorn

    session, _ = begin(None)
    workspace = Workspace(session)
    access = Access("a-secret-token")
    server = uvicorn.Server(uvicorn.Config(make_app(workspace, access), port=0, **SERVER))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.005)
    port = server.servers[0].sockets[0].getsockname()[1]
    workspace.address = f"http://127.0.0.1:{port}"
    workspace.cookie = {"Cookie": f"flarewright_token_{port}={access.secret}"}
    workspace.screen.start()
    assert workspace.screen.wait(60.0)
    yield workspace
    server.should_exit = True
    thread.join(5.0)


def ask(workspace, path, body=None, headers=None):
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    request = urllib.request.Request(workspace.address + path, data, workspace.cookie | (headers or {}))
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def reported(workspace, path, body=None):
    code, data = ask(workspace, path, body)
    return code, json.loads(data)


def test_the_page_and_every_question_it_asks(workspace):
    assert b"<canvas" in ask(workspace, "/")[1]
    assert ask(workspace, "/static/app.js")[0] == 200
    state = reported(workspace, "/api/state")[1]
    assert state["lens"]["facts"]["efl"] == pytest.approx(99.2358, abs=1e-3)
    assert state["picture"]["grade"] == "final"
    asked = {
        "/api/picture", "/api/target", "/api/target?light=0&x=3&y=1",
        "/api/outline?ghost=8-6", "/api/coating?row=0", "/api/map?ghost=8-6", "/api/thumbnail/lens/tessar-brendel",
        "/api/thumbnail/look/low-sun", "/api/export/png",
    }  # fmt: skip
    kinds = {b"\xff\xd8": "jpeg", b"\x89P": "png", b"<s": "svg"}
    # so far off the axis, light reflected by the sensor ends on rims
    for path, missing in (
        ("/api/section", False),
        ("/api/section?ghost=8-6", False),
        ("/api/section?ghost=sensor-4", True),
    ):
        code, drawn = reported(workspace, path)
        assert (code, drawn["svg"][:4], bool(drawn["reported"])) == (200, "<svg", missing)
    for path in sorted(asked):
        code, data = ask(workspace, path)
        assert (code, data[:2] in kinds) == (200, True), path
    assert reported(workspace, "/api/pick?u=0.5&v=0.5")[1]["ghosts"]
    assert reported(workspace, "/api/places")[1]["places"]
    assert "N-BK7" in str(reported(workspace, "/api/glasses?q=n-bk")[1])
    library = reported(workspace, "/api/library")[1]
    assert len(library["lenses"]) >= 12
    assert len(library["looks"]) >= 12
    assert b'name = "Flare"' in ask(workspace, "/api/export/look")[1]
    assert reported(workspace, "/api/ghosts")[1]["ghosts"][0]["share"] == 1.0
    # after the drag has ended, requests for its target are empty
    assert ask(workspace, "/api/target?at=0&revision=-1") == (204, b"")
    spoken = {path.split("?")[0] for path in asked} | {"/api/state", "/api/pick", "/api/places", "/api/glasses"}
    code, answer = reported(workspace, "/api/plate/lights")
    assert (code, "there is no plate" in answer["error"]) == (400, True)
    spoken |= {"/api/plate/lights", "/api/library", "/api/ghosts", "/api/command", "/api/section", "/api/mask"}
    assert reported(workspace, "/api/mask") == (400, {"error": "the iris has no mask; load or draw one"})
    missing = {path for path in _GET if "{" not in path} - spoken
    assert not missing


def test_commands_undo_and_rejections(workspace):
    code, state = reported(workspace, "/api/do", {"name": "move_light", "values": {"light": 0, "x": 2.0, "y": 1.0}})
    assert (code, state["lights"][0]["field_deg"], state["undo"]) == (200, [2.0, 1.0], "Move the light")
    assert reported(workspace, "/api/undo", {})[1]["lights"][0]["field_deg"] == [8.0, 4.4]
    assert reported(workspace, "/api/redo", {})[1]["lights"][0]["field_deg"] == [2.0, 1.0]
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
        code, answer = reported(workspace, path, body)
        assert code == 400, path
        assert answer["error"]
        assert "Traceback" not in answer["error"]
    assert reported(workspace, "/api/target?light=7&x=1&y=1")[0] == 400
    assert reported(workspace, "/api/coating?row=5")[0] == 400
    assert ask(workspace, "/api/thumbnail/lens/..%2f..%2fsecret")[0] in (400, 404)
    assert reported(workspace, "/api/thumbnail/lens/secret")[0] == 400
    assert reported(workspace, "/api/export/zip")[0] == 400


def test_a_change_during_an_answer_is_newer_than_the_answer(workspace, monkeypatch):
    """A state of before a change used to carry the number of after it, and stayed on the page."""
    before = reported(workspace, "/api/state")[1]
    session = workspace.session

    def slowly(project):
        if session.revision == before["revision"]:
            session.do("move_light", {"light": 0, "x": 2.0, "y": 1.0})
        return prescription(project)

    monkeypatch.setattr("flarewright.editor.server.page_state.prescription", slowly)
    meanwhile = reported(workspace, "/api/state")[1]
    assert meanwhile["lights"] == before["lights"]
    assert meanwhile["revision"] == before["revision"]
    after = reported(workspace, "/api/state")[1]
    assert after["lights"][0]["field_deg"] == [2.0, 1.0]
    assert after["revision"] > before["revision"]


def test_import_export_and_the_command(workspace, tmp_path):
    lens = Path(str(read_lens.__globals__["__file__"])).parents[2] / "lenses" / "tessar-brendel.toml"
    code, state = reported(workspace, "/api/import?name=tessar.toml", lens.read_bytes())
    assert (code, "Tessar" in state["lens"]["name"]) == (200, True)
    assert reported(workspace, "/api/command")[0] == 400
    saved = tmp_path / "my shot.toml"
    assert reported(workspace, "/api/save", {"text": str(saved)})[0] == 200
    assert reported(workspace, "/api/command")[1]["text"].startswith("flarewright render --project '")
    assert run(["project", "check", str(saved)]) == 0
    exported = ask(workspace, "/api/export/lens")[1]
    path = tmp_path / "x.toml"
    path.write_bytes(exported)
    again = read_lens(path).lens
    assert [row.thickness for row in again.rows] == [row.thickness for row in read_lens(lens).lens.rows]
    project = ask(workspace, "/api/export/project")[1]
    reported(workspace, "/api/open", {"text": "heliar-tronnier"})
    assert reported(workspace, "/api/import?name=shot.toml", project)[1]["lens"]["name"] == state["lens"]["name"]
    assert workspace.screen.wait(60.0)
    table = ask(workspace, "/api/export/csv")[1].decode().splitlines()
    assert table[0].startswith("ghost,flux_mm2")
    assert len(table) == 1 + len(workspace.screen.seen.ghosts)
    # the table of another lens is not that of this one
    seen = workspace.screen.seen
    workspace.screen.seen = replace(seen, project=seen.project.replace(lens="takumar-50-f1.4"))
    code, answer = reported(workspace, "/api/export/csv")
    assert (code, "still being measured" in answer["error"]) == (400, True)


def test_a_missing_background_is_reported(workspace, tmp_path):
    set_plate = {"name": "set_plate", "values": {"values": {"image": str(tmp_path / "gone.png")}}}
    assert reported(workspace, "/api/do", set_plate)[0] == 200
    code, answer = reported(workspace, "/api/picture")
    assert code == 400
    assert answer["error"].startswith("the plate gone.png does not exist in ")
    reported(workspace, "/api/do", {"name": "remove_plate"})
    assert ask(workspace, "/api/picture")[0] == 200


def test_a_drag_is_followed_through_a_socket(workspace):
    from websockets.sync.client import connect

    def ask_for(socket, **values):
        socket.send(json.dumps(values))
        head, _, picture = socket.recv().partition(b"\n")
        return json.loads(head), picture

    revision = workspace.session.revision
    address = workspace.address.replace("http", "ws") + "/ws/moving"
    with connect(address, additional_headers=workspace.cookie) as socket:
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
    with (
        pytest.raises(Exception, match=r"403|1008|rejected"),
        connect(address, origin="http://evil.example", additional_headers=workspace.cookie),
    ):
        pass


def test_a_client_that_floods_and_leaves_is_not_written_to(workspace, caplog):
    """Writing to a lost connection makes asyncio print a warning for each message."""
    from websockets.sync.client import connect

    address = workspace.address.replace("http", "ws") + "/ws/moving"
    moved = json.dumps({"number": 1, "light": 0, "x": "3", "y": "1", "revision": workspace.session.revision})
    for _ in range(3):
        socket = connect(address, additional_headers=workspace.cookie).__enter__()
        for _ in range(1000):
            socket.send(moved)
        # no closing handshake: a page that vanishes
        socket.socket.setsockopt(SOL_SOCKET, SO_LINGER, struct.pack("ii", 1, 0))
        socket.socket.close()
    end = time.monotonic() + 60.0
    while workspace.following and time.monotonic() < end:
        time.sleep(0.02)
    assert workspace.following == 0
    assert "socket.send() raised exception" not in caplog.text


def test_a_lost_connection_ends_the_drag(workspace):
    from websockets.sync.client import connect

    def current():
        return reported(workspace, "/api/state")[1]["picture"]["current"]

    def rests(wanted):
        end = time.monotonic() + 60.0
        while current() != wanted and time.monotonic() < end:
            time.sleep(0.05)
        return current() == wanted

    address = workspace.address.replace("http", "ws") + "/ws/moving"
    moved = json.dumps({"number": 1, "light": 0, "x": "3", "y": "1", "revision": workspace.session.revision})
    with connect(address, additional_headers=workspace.cookie) as socket:
        socket.send(moved)
        socket.recv()
        # a paused drag is rendered as if it had ended
        assert rests(False)
        assert workspace.screen.wait(60.0)
    assert rests(True)
    # a drag of another page is not disturbed
    with connect(address, additional_headers=workspace.cookie) as other:
        with connect(address, additional_headers=workspace.cookie) as socket:
            socket.send(moved)
            socket.recv()
            other.send(moved)
            other.recv()
        assert rests(False)
        assert workspace.screen.wait(60.0)
        assert not current()
    assert rests(True)


def test_three_thousand_unanswered_requests_stop_nothing(workspace):
    from websockets.sync.client import connect

    address = workspace.address.replace("http", "ws") + "/ws/moving"
    with connect(address, additional_headers=workspace.cookie) as rude:
        for number in range(3000):
            rude.send(json.dumps({"number": number, "light": 0, "x": "3", "y": "1"}))
        # its page reads nothing, and others are served
        assert reported(workspace, "/api/do", {"name": "set_iris", "values": {"values": {"blades": 7}}})[0] == 200
        with connect(address, additional_headers=workspace.cookie) as polite:
            polite.send(json.dumps({"number": 1, "light": 0, "x": "3", "y": "1"}))
            assert polite.recv(timeout=60.0).partition(b"\n")[2][:2] == b"\xff\xd8"
        assert workspace.following <= 2
        # a few are drawn, and all others are answered without a picture
        heads = [json.loads(rude.recv(timeout=60.0).partition(b"\n")[0]) for _ in range(3000)]
    assert sorted(head["number"] for head in heads) == list(range(3000))
    assert sum("seconds" in head for head in heads) < 2900
    assert reported(workspace, "/api/state")[1]["iris"]["blades"] == 7


def test_a_taken_port_is_reported(capsys):
    import socket

    with socket.socket() as place:
        place.bind(("127.0.0.1", 0))
        place.listen()
        assert run(["edit", "--no-browser", "--port", str(place.getsockname()[1])]) == 2
    assert "another --port" in " ".join(capsys.readouterr().err.split())


def test_nothing_is_searched_without_targets(workspace):
    for path, said in (("/api/solve", "no targets yet"), ("/api/colors", "no target colours yet")):
        code, answer = reported(workspace, path, {})
        assert (code, answer["error"].startswith(said)) == (400, True)
        assert "choose a ghost" in answer["error"]
    assert not workspace.solver.progress.running


def test_posts_are_spoken_for():
    assert {"/api/do", "/api/undo", "/api/redo", "/api/import", "/api/solve", "/api/accept"} <= set(_POST)


def test_an_address_of_another_computer_is_reported(capsys):
    assert run(["edit", "--no-browser", "--port", "0", "--host", "203.0.113.9"]) == 2
    assert "check --host" in " ".join(capsys.readouterr().err.split())


def test_without_the_extra_it_says_so(capsys, monkeypatch):
    from flarewright.cli import edit

    monkeypatch.setattr(edit, "find_spec", lambda name: None if name == "websockets" else name)
    assert run(["edit", "--no-browser"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert said == "flarewright: error: the editor needs the extra ui (websockets): pip install 'flarewright[ui]'"


def test_an_unwritable_place_is_reported(workspace, tmp_path):
    (tmp_path / "file").write_text("no folder")
    for place in (tmp_path / "file" / "shot.toml", tmp_path / "no folder" / "shot.toml", tmp_path / "file"):
        code, answer = reported(workspace, "/api/save", {"text": str(place)})
        if place.name == "file":
            # the suffix is added
            assert (code, Path(tmp_path / "file.toml").is_file()) == (200, True)
        else:
            assert (code, answer["error"].count("\n")) == (400, 0)
            assert answer["error"].startswith("cannot write")
    assert workspace.session.file == str((tmp_path / "file.toml").resolve())
