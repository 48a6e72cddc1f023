"""An editor in a thread of this process, and its clients, for fuzzers."""

import atexit
import contextlib
import io
import json
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from functools import cache
from pathlib import Path

import uvicorn

from flarewright.editor.preview import render_picture
from flarewright.editor.server.access import Access
from flarewright.editor.server.app import SERVER, make_app
from flarewright.editor.server.workspace import Workspace
from flarewright.editor.session.autosave import Saved
from flarewright.editor.session.autosave_lock import AutosaveWriter
from flarewright.editor.session.history import started
from flarewright.editor.session.reach import reach_of
from flarewright.editor.session.session import Session
from flarewright.editor.session.view_settings import View
from flarewright.model import Camera, Iris, Light, Output, Project, Quality

# an answer that takes longer is a hang
PATIENCE_S = 20.0


class Errors(io.TextIOBase):
    """Standard error that also keeps what the threads of the editor print."""

    def __init__(self, stream):
        self.stream, self.seen = stream, []

    def write(self, text):
        self.seen.append(text)
        return self.stream.write(text)

    def flush(self):
        self.stream.flush()


class LiveEditor:
    """A running editor with a small project and one folder for its files.

    Attributes
    ----------
    address : str
    headers : dict of str to str
        With the cookie of its page.
    folder : Path
    """

    def __init__(self):
        self._kept = tempfile.TemporaryDirectory(prefix="flarewright-trust-", ignore_cleanup_errors=True)
        self.folder = Path(self._kept.name) / "root"
        self.folder.mkdir()
        project = Project(
            lens="heliar-tronnier", f_number=16.0, iris=Iris(blades=6), lights=(Light(field_deg=(8.0, 4.4)),),
            camera=Camera(size_px=(96, 54)), output=Output(starburst=False),
            quality=Quality(wavelengths=3, ringing="off"),
        )  # fmt: skip
        # small pictures: what is tried here are requests
        render_picture.WIDEST, render_picture.HIGHEST = 96, 54
        writer = AutosaveWriter(self.folder.parent / "autosave.json")
        session = Session(Saved(started(project, file=None), View(), None, clean=False), writer)
        session.reach = reach_of([self.folder], session.history)
        self.workspace = Workspace(session)
        access = Access("token of the rig")
        self.server = uvicorn.Server(uvicorn.Config(make_app(self.workspace, access), port=0, **SERVER))
        self.errors = Errors(sys.stderr)
        atexit.register(self.workspace.close)
        threading.Thread(target=self.server.run, daemon=True).start()
        while not self.server.started:
            time.sleep(0.005)
        port = self.server.servers[0].sockets[0].getsockname()[1]
        self.address = f"http://127.0.0.1:{port}"
        self.headers = {"Cookie": f"flarewright_token_{port}={access.secret}", "Origin": self.address}

    def ask(self, path, body=None, headers=None):
        """Send one request; return status and body."""
        request = urllib.request.Request(self.address + path, body, self.headers | (headers or {}))
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
                return answer.status, answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.read()
        except urllib.error.URLError as error:
            raise error.reason if isinstance(error.reason, OSError) else error from None

    def fault(self):
        """Return what is wrong with the editor now; empty: it answers, and no thread has printed a traceback."""
        try:
            status, body = self.ask("/api/state")
        except OSError as error:
            return f"no answer to /api/state: {error}"
        if status != 200 or "revision" not in json.loads(body):
            return f"/api/state answers {status}: {body[:120]!r}"
        printed = "".join(self.errors.seen)
        self.errors.seen.clear()
        return f"traceback: {printed[-400:]}" if "Traceback" in printed else ""

    @contextlib.contextmanager
    def heard(self):
        """Keep what is printed to standard error meanwhile."""
        with contextlib.redirect_stderr(self.errors):
            yield


@cache
def live_editor():
    """Return the editor of this process; it ends with the process."""
    return LiveEditor()
