"""A hostile page in Chromium, which sends the editor's cookie along where it may: nothing is read, nothing changes."""

from __future__ import annotations

import atexit
import http.server
import json
import os
import random
import shutil
import socketserver
import tempfile
import threading
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

from flarewright.editor.server.app import _GET, _POST

from ..verdict import Verdict
from .live_editor import live_editor

KIND = "hostile page"
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--no-pings")
PATIENCE_MS = 60_000
# what a page can do with an address; a promise whose value is text that it read, or a refusal
WAYS = {
    "image": "loaded('img', { src: at })",
    "script": "loaded('script', { src: at })",
    "module": "loaded('script', { src: at, type: 'module' })",
    "style": "loaded('link', { rel: 'stylesheet', href: at })",
    "object": "loaded('object', { data: at })",
    "video": "loaded('video', { src: at, autoplay: true })",
    "read": "fetch(at, { credentials: 'include' }).then((answer) => answer.text())",
    "opaque": "fetch(at, { mode: 'no-cors', credentials: 'include' }).then((answer) => answer.text())"
    ".then((text) => text || Promise.reject('opaque'))",
    "post": "fetch(at, { method: 'POST', credentials: 'include', headers: { 'Content-Type': 'application/json' },"
    " body }).then((answer) => answer.text())",
    "simple": "fetch(at, { method: 'POST', mode: 'no-cors', credentials: 'include', body })"
    ".then((answer) => answer.text()).then((text) => text || Promise.reject('opaque'))",
    "beacon": "Promise.reject(navigator.sendBeacon(at, body))",
    "events": "new Promise((done, failed) => { const one = new EventSource(at, { withCredentials: true });"
    " one.onopen = () => done('open'); one.onerror = () => { one.close(); failed('error'); }; })",
    "socket": "new Promise((done, failed) => { const one = new WebSocket(at.replace('http', 'ws'));"
    " one.onopen = () => done('open'); one.onerror = () => failed('error'); })",
    "frame": "new Promise((done, failed) => { const one = document.createElement('iframe'); one.src = at;"
    " one.onload = () => { try { done(one.contentDocument.body.innerText); } catch (error) { failed(error); } };"
    " document.body.append(one); })",
    "form": "new Promise((done, failed) => { const form = Object.assign(document.createElement('form'), {"
    " method: 'post', action: at, enctype: 'text/plain', target: 'target' }); const field ="
    " Object.assign(document.createElement('input'), { name: body.slice(0, -1) + ', \"a\": \"', value: '\"}' });"
    " form.append(field); document.body.append(form); form.submit();"
    " failed('sent'); })",
}
PAGE = """<!doctype html><title>hostile</title><body><iframe name="target"></iframe><script>
const seen = {}, body = BODY;
const loaded = (tag, attributes) => new Promise((done, failed) => {
  const one = Object.assign(document.createElement(tag), attributes);
  one.onload = one.onloadeddata = () => done('loaded'); one.onerror = () => failed('error');
  document.body.append(one); });
const late = () => new Promise((_, failed) => setTimeout(() => failed('late'), 5000));
window.done = Promise.all(WAYS.map(([name, at, act]) => Promise.race([act(at), late()]).then(
  (what) => { seen[name] = `${what}`.slice(0, 200); }, () => {}))).then(() => seen);
</script>"""


def run(seed: int) -> Verdict:
    """Open a random hostile page beside the editor's own page.

    Parameters
    ----------
    seed : int

    Returns
    -------
    Verdict
        A page may learn nothing but that requests fail, and the editor's state stays.
    """
    if (found := _browser()) is None:
        return Verdict(KIND, f"seed {seed}", True, "skipped: it needs Chromium and the extra e2e")
    context, port, pages = found
    chance, editor = random.Random(f"page {seed}"), live_editor()
    ways = [(way, chance.choice([*_GET, *_POST, "/", "/static/app.js", "/ws", "/ws/moving"])) for way in WAYS]
    ways = chance.sample(ways, 8)
    host = chance.choice(("127.0.0.1", "localhost"))
    body = {"name": "move_light", "values": {"light": 0, "x": chance.uniform(-5.0, 5.0), "y": 1.0}, "text": "x.toml"}
    acts = ", ".join(
        f"[{json.dumps(f'{w} {p}')}, {json.dumps(editor.address + p)}, (at) => {WAYS[w]}]" for w, p in ways
    )
    pages["/"] = PAGE.replace("BODY", json.dumps(json.dumps(body))).replace("WAYS", f"[{acts}]")
    subject = f"seed {seed}: {host}, {', '.join(f'{w} {p}' for w, p in ways)}"
    with editor.heard():
        before = json.loads(editor.ask("/api/state")[1])
        page = context.new_page()
        try:
            page.set_default_timeout(PATIENCE_MS)
            page.goto(f"http://{host}:{port}/")
            seen = page.evaluate("window.done")
        finally:
            page.close()
        after = json.loads(editor.ask("/api/state")[1])
        changed = [key for key in ("revision", "lights", "steps", "file", "undo") if before[key] != after[key]]
        remark = editor.fault() or (f"changed: {', '.join(changed)}" if changed else "")
    if seen:
        remark = f"the page got {seen}"[:400]
    return Verdict(KIND, subject, not remark, remark)


@cache
def _browser() -> tuple[Any, int, dict[str, str]] | None:
    """Return a browser with the editor's cookie, and port and pages of a hostile website; None without a browser."""
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    if program is None:
        return None
    pages: dict[str, str] = {}

    class Website(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            page = pages.get(self.path)
            # the browser may have left the page
            with suppress(ConnectionError):
                self.send_response(200 if page else 404)
                self.send_header("content-type", "text/html")
                self.end_headers()
                self.wfile.write((page or "").encode())

        def log_message(self, *_: Any) -> None:
            pass

    stack = ExitStack()
    atexit.register(stack.close)
    server = stack.enter_context(socketserver.ThreadingTCPServer(("127.0.0.1", 0), Website))
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    stack.callback(server.shutdown)
    # a browser reserves more address space than the rig leaves to a worker
    folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="trust-"))
    wrapper = Path(folder) / "browser"
    wrapper.write_text(f'#!/bin/sh\nulimit -S -v unlimited\nexec {program} "$@"\n')
    os.chmod(wrapper, 0o755)
    play = stack.enter_context(sync_playwright())
    context = play.chromium.launch(executable_path=str(wrapper), args=list(FLAGS), timeout=PATIENCE_MS).new_context()
    page = context.new_page()
    page.goto(f"{live_editor().address}/?token={quote('token of the rig')}", timeout=PATIENCE_MS)
    page.close()
    assert any(cookie["name"].startswith("flarewright_token") for cookie in context.cookies())
    return context, server.server_address[1], pages
