"""A hostile website, a proxy and Ctrl-C, with a real editor and a real browser: `pytest -m browser`."""

import http.client
import http.server
import json
import os
import re
import shutil
import signal
import socket
import socketserver
import subprocess
import threading
import time
import urllib.request
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("playwright", reason="the extra e2e is not installed")
pytest.importorskip("starlette", reason="the extra ui is not installed")

from chromium import Editor, Tab, chromium, drop

from flarewright.editor.preview.display_image import png

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="no Chromium was found; on Debian: apt-get install chromium"),
]

HOSTILE = Path(__file__).with_name("hostile.html")


@contextmanager
def served(handler):
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), handler) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_hostile_page_changes_nothing_and_reads_nothing(tab, host):
    """Another port of this computer, to which the browser does send the cookie, and another site."""
    page = (
        HOSTILE.read_text("utf-8").replace("= EDITOR", "= " + json.dumps(tab.editor.address.partition("?")[0])).encode()
    )

    class Website(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, *_):
            pass

    before, shown = tab.state(), tab.shown()
    with served(Website) as port:
        other = tab.page.context.new_page()
        answers = {}
        other.on("response", lambda answer: answers.setdefault(answer.url.partition("?")[0], []).append(answer.status))
        other.goto(f"http://{host}:{port}/")
        seen = other.evaluate("window.done")
        assert len(seen) == 9
        for name, what in seen.items():
            assert what.startswith("refused"), (name, what)
        other.wait_for_load_state("networkidle")
        # the frames show an error of the browser or the sentence of the refusal, never the editor
        for frame in other.frames[1:]:
            text = frame.evaluate("document.body ? document.body.innerText : ''")
            assert "Flarewright" not in text
            assert frame.evaluate("!document.getElementById('view')")
        statuses = {status for each in answers.values() for status in each}
        assert statuses <= {200, 403}
        assert [url for url, each in answers.items() if 200 in each] == [f"http://{host}:{port}/"]
        other.close()
    after = tab.js("fetch('api/state').then((answer) => answer.json())")
    for key in ("revision", "lights", "steps", "file", "undo"):
        assert after[key] == before[key]
    np.testing.assert_array_equal(tab.shown(), shown)


def test_the_address_of_the_page_holds_no_token(tab):
    assert "token=" in tab.editor.address
    assert tab.js("location.href") == tab.editor.address.partition("?")[0]
    # scripts cannot read the cookie
    assert tab.js("document.cookie") == ""
    # without the cookie: another browser of the computer, or another account
    other = tab.page.context.browser.new_context()
    try:
        page = other.new_page()
        assert page.goto(tab.editor.address.partition("?")[0]).status == 403
        assert "needs its token" in page.inner_text("body")
    finally:
        other.close()


def free_port():
    with socket.socket() as place:
        place.bind(("127.0.0.1", 0))
        return place.getsockname()[1]


def proxy_to(port, prefix, keeps_prefix=False, own_host=False):
    """Return the handler of a proxy that passes on addresses under a prefix, sockets too, one request a connection."""

    class Proxy(socketserver.BaseRequestHandler):
        def handle(self):
            head = b""
            while b"\r\n\r\n" not in head:
                part = self.request.recv(65536)
                if not part:
                    return
                head += part
            head, _, rest = head.partition(b"\r\n\r\n")
            first, *lines = head.decode("latin-1").split("\r\n")
            method, path, version = first.split(" ")
            if not path.startswith(prefix):
                self.request.sendall(b"HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\nconnection: close\r\n\r\n")
                return
            path = path if keeps_prefix else path[len(prefix) :]
            if own_host:
                lines = [line for line in lines if not line.lower().startswith("host:")] + [f"Host: 127.0.0.1:{port}"]
            if not any(line.lower().startswith("upgrade:") for line in lines):
                lines = [line for line in lines if not line.lower().startswith("connection:")] + ["Connection: close"]
            with socket.create_connection(("127.0.0.1", port)) as server:
                server.sendall("\r\n".join([f"{method} {path} {version}", *lines]).encode("latin-1"))
                server.sendall(b"\r\n\r\n" + rest)
                back = threading.Thread(target=pump, args=(server, self.request), daemon=True)
                back.start()
                pump(self.request, server)
                back.join()

    return Proxy


def pump(source, target):
    with suppress(OSError):
        while data := source.recv(65536):
            target.sendall(data)
    with suppress(OSError):
        target.shutdown(socket.SHUT_WR)


@contextmanager
def nginx_to(port, prefix, folder):
    """Run nginx with the lines of docs/editor.md."""
    program = shutil.which("nginx", path=f"{os.environ['PATH']}:/usr/sbin")
    if program is None:
        pytest.skip("no nginx was found; on Debian: apt-get install nginx-light")
    page = (Path(__file__).parents[2] / "docs" / "editor.md").read_text("utf-8")
    lines = re.search(r"```\n(location .*?\n\})\n```", page, re.DOTALL)[1]
    lines = lines.replace("location /flare/", f"location {prefix}/").replace("127.0.0.1:8640", f"127.0.0.1:{port}")
    front, kinds = free_port(), ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    paths = " ".join(f"{kind}_temp_path {folder}/{kind};" for kind in kinds)
    # workers of root's nginx belong to another account, which may not write the temporary files of bodies
    user = "user root; " if os.geteuid() == 0 else ""
    (folder / "nginx.conf").write_text(
        f"{user}daemon off; pid {folder}/nginx.pid; error_log {folder}/errors; events {{}}\n"
        f"http {{ access_log off; {paths} server {{ listen 127.0.0.1:{front};\n{lines}\n}} }}\n"
    )
    process = subprocess.Popen([program, "-c", str(folder / "nginx.conf"), "-e", str(folder / "errors")])
    try:
        until = time.monotonic() + 20.0
        while time.monotonic() < until:
            with suppress(OSError), socket.create_connection(("127.0.0.1", front)):
                break
            time.sleep(0.05)
        yield front
    finally:
        process.terminate()
        process.wait(10.0)


# as jupyter-server-proxy and nginx do: the prefix is cut off, kept, or cut off and the host replaced
@pytest.mark.parametrize("flavour", ["cut", "kept", "renamed", "nginx"])
def test_the_editor_works_behind_a_proxy_with_a_path(chrome, tmp_path, flavour):
    port = free_port()
    prefix = f"/user/me/proxy/{port}"
    handler = proxy_to(port, prefix, keeps_prefix=flavour == "kept", own_host=flavour == "renamed")
    with nginx_to(port, prefix, tmp_path) if flavour == "nginx" else served(handler) as front:
        base = f"http://127.0.0.1:{front}{prefix}/"
        given = base if flavour in ("renamed", "nginx") else f"{prefix}/"
        editor = Editor(tmp_path / "state", "--base-url", given, port=port)
        try:
            editor.address = f"{base}?{editor.address.partition('?')[2]}"
            context = chrome.new_context(viewport={"width": 1280, "height": 720})
            tab = Tab(context.new_page(), editor)
            mouse = tab.page.mouse
            mouse.move(*tab.light())
            mouse.down()
            mouse.move(*tab.at(0.4, 0.3))
            tab.until("flarewright.view.stats.shown.length")
            mouse.up()
            tab.until("flarewright.state.steps.at === 1")
            tab.rest()
            tab.tab("library")
            tab.until("document.querySelector('.library img')?.naturalWidth > 0")
            # larger than a proxy lets through by default
            drop(tab, "sky.png", png(np.random.default_rng(1).integers(0, 256, (800, 800, 3), dtype=np.uint8)))
            tab.until("flarewright.state.plate")
            assert tab.said == []
            assert all(url.startswith((base, "blob:", "data:")) for url in tab.asked)
            # the cookie is not sent to other users of the proxy
            (cookie,) = context.cookies()
            assert (cookie["path"], cookie["sameSite"], cookie["httpOnly"]) == (f"{prefix}/", "Strict", True)
            context.close()
        finally:
            editor.end()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_editor_ends_within_two_seconds_whatever_runs(tmp_path, how):
    editor = Editor(tmp_path / "state", "canon-28-80", own_sample=True)
    try:
        address, _, _ = editor.address.partition("?")
        with urllib.request.urlopen(editor.address) as answer:
            headers = {"Cookie": answer.headers["set-cookie"].partition(";")[0], "Origin": address.rstrip("/")}

        def fetch(path, body=None):
            with urllib.request.urlopen(
                urllib.request.Request(address + path, body, headers), timeout=60
            ) as answer:  # fmt: skip
                return answer.read()

        def ask_and_be_cut_off(path):
            # the editor ends meanwhile: it refuses, breaks off within the answer, or answers with a picture
            with suppress(OSError, http.client.HTTPException):
                fetch(path)

        def do(command):
            return json.loads(fetch("api/do", command))

        assert do(b'{"name": "set_fields", "values": {"values": {"f_number": 8.0}}}')["revision"] >= 1
        changed = do(b'{"name": "move_light", "values": {"light": 0, "x": 1.5, "y": 1}}')
        assert changed["lights"][0]["field_deg"] == [1.5, 1.0]
        # each takes seconds to minutes
        asked = ["api/export/exr", "api/export/exr", "api/target", "api/outline?ghost=7-2"]
        threads = [threading.Thread(target=ask_and_be_cut_off, args=(path,), daemon=True) for path in asked]
        for thread in threads:
            thread.start()
        time.sleep(1.0)
        started = time.monotonic()
        editor.process.send_signal(how)
        editor.process.wait(20.0)
        took = time.monotonic() - started
        printed = editor.process.stderr.read()
        assert editor.process.returncode == 130
        # 0.8 s on an idle computer; tests share theirs
        assert took < 5.0, took
        assert "its session is saved" in printed
        assert "Traceback" not in printed
        # nothing of the session is lost
        (saved,) = (tmp_path / "state").glob("*.autosave.json")
        assert re.search(r'"field_deg": \[1\.5, 1\.0\]', saved.read_text())
    finally:
        editor.end()
