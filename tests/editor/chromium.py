"""A real editor process and a real browser, for tests and for the pictures of the documentation."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from sample import few_ghosts

FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--no-pings"]
SRC = Path(__file__).parents[2] / "src"


def chromium():
    """Return the path of Chromium, or of a compatible browser; None if there is none."""
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class Editor:
    """`flarewright edit` as a separate process, with a sample that renders fast, or that of a user."""

    def __init__(self, state, *words, port=0, own_sample=False):
        self.state, self.words, self.port, self.own_sample = state, words, port, own_sample
        self.start()

    def start(self):
        # use the tests' kernel cache, which is compiled already
        environment = {**os.environ, "FLAREWRIGHT_STATE": str(self.state), "PYTHONUNBUFFERED": "1"}
        # let the editor compile with helper processes, as for a user (tests/conftest.py disables them)
        environment.pop("FLAREWRIGHT_HELPER", None)
        if "site-packages" not in str(__import__("flarewright").__file__):
            environment["PYTHONPATH"] = os.pathsep.join([str(SRC), environment.get("PYTHONPATH", "")]).rstrip(
                os.pathsep
            )
        code = "from flarewright.cli.app import main; main()"
        if not self.own_sample:
            code = (
                "from flarewright.editor.session import session; from flarewright.model import Project; "
                f"session.sample_project = lambda: Project.model_validate_json({few_ghosts().model_dump_json()!r}); "
            ) + code
        self.process = subprocess.Popen(
            [
                sys.executable, "-c", code, "edit", "--no-browser", "--port", str(self.port),
                "--root", str(Path(self.state).parent), *self.words,
            ],
            stderr=subprocess.PIPE, text=True, env=environment,
        )  # fmt: skip
        line = self.process.stderr.readline()
        found = re.search(r"(http://\S+)", line)
        assert found, line + self.process.stderr.read()
        self.address = found[1]
        self.port = int(re.search(r":(\d+)/", self.address)[1])

    def kill(self):
        """Kill the process, as a power cut would."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stderr.close()

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(10.0)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        if not self.process.stderr.closed:
            self.process.stderr.close()


# a hang is not a slow computer: the first page waits for kernels to be compiled
PATIENCE_MS = 180_000


@contextmanager
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        found = play.chromium.launch(executable_path=chromium(), args=FLAGS, timeout=PATIENCE_MS)
        yield found
        found.close()


class Tab:
    """A page with the editor, and frequent user actions."""

    def __init__(self, page, editor):
        self.page, self.editor = page, editor
        page.set_default_timeout(PATIENCE_MS)
        self.said, self.asked = [], []
        page.on("console", lambda message: message.type == "error" and self.said.append(message.text))
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", lambda request: self.asked.append(request.url))
        self.open()

    def open(self):
        self.page.goto(self.editor.address)
        self.rest()

    def js(self, expression):
        return self.page.evaluate(expression)

    def until(self, expression, timeout_s=PATIENCE_MS / 1000.0):
        # the page's Content-Security-Policy forbids scripts from text, so the browser cannot wait for one by itself
        end = time.monotonic() + timeout_s
        while not self.js(f"Promise.resolve({expression}).then(Boolean)"):
            assert time.monotonic() < end, f"{expression}; the page said {self.said} and has {self.summary()}"
            self.page.wait_for_timeout(15)

    def summary(self):
        """Return what the page shows besides the picture, for the message of a failed wait."""
        words = "['panel', 'toasts'].map((id) => document.getElementById(id)?.innerText)"
        return self.js(f"JSON.stringify([window.flarewright?.state?.finding, {words}])")

    def rest(self):
        """Wait until the final picture is shown and the ghosts are measured."""
        self.until("window.flarewright?.state && window.flarewright.view.image")
        # pending requests have reached the page
        self.page.wait_for_timeout(60)
        self.until(
            "(() => { const a = flarewright, p = a.state.picture; return !a.under.way && (p.problem || (p.current &&"
            "['final', 'working'].includes(p.grade) && a.view.shownNumber === p.number && a.ghosts.fresh)); })()"
        )

    def state(self):
        return self.js("JSON.parse(JSON.stringify(flarewright.state))")

    def tab(self, name):
        self.page.click(f"[data-tab={name}]")

    def save_as(self, path, keys="Control+s"):
        """Save the project in a new file, by the dialog that `keys` open."""
        self.page.keyboard.press(keys)
        self.page.fill("dialog input[name=path]", str(path))
        self.page.keyboard.press("Enter")
        # the state arrives before the dialog closes, and an open dialog takes all keys
        self.until("flarewright.state.clean && !document.querySelector('dialog')")

    def light(self):
        """Return the place of the light's handle on the page."""
        x, y = self.js("flarewright.view.lightPage(0)")
        box = self.page.locator("#view").bounding_box()
        return box["x"] + x, box["y"] + y

    def frame(self):
        box, frame = self.page.locator("#view").bounding_box(), self.js("flarewright.view.frame()")
        return box["x"] + frame["x"], box["y"] + frame["y"], frame["w"], frame["h"]

    def at(self, u, v):
        x, y, w, h = self.frame()
        return x + u * w, y + v * h

    def drag(self, start, end, steps=12, hold_ms=12):
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        for k in range(1, steps + 1):
            mouse.move(*(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
            self.page.wait_for_timeout(hold_ms)
        mouse.up()

    def shown(self, image="flarewright.view.image"):
        """Return the pixels on the page, or of another of its pictures: shape (H, W, 3)."""
        import base64
        import io

        import numpy as np
        from PIL import Image

        data = self.js(
            f"(() => {{ const i = {image}, c = new OffscreenCanvas(i.width, i.height);"
            "c.getContext('2d').drawImage(i, 0, 0); return c.convertToBlob({type: 'image/png'}).then(b => new Promise("
            "done => { const r = new FileReader(); r.onload = () => done(r.result.split(',')[1]);"
            "r.readAsDataURL(b); })); })()"
        )
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))


def download(tab, entry, path):
    """Export a file through the menu."""
    tab.page.click("#export")
    with tab.page.expect_download(timeout=PATIENCE_MS) as waiting:
        tab.page.click(f"[role=menuitem]:has-text('{entry}')")
    waiting.value.save_as(path)
    return path


def drop(tab, name, data):
    """Drop a file on the page, as a file manager does."""
    tab.page.evaluate(
        "([name, bytes]) => { const box = new DataTransfer();"
        "box.items.add(new File([new Uint8Array(bytes)], name));"
        "document.body.dispatchEvent(new DragEvent('drop', {dataTransfer: box, bubbles: true, cancelable: true})); }",
        [name, list(data)],
    )
