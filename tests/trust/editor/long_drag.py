"""Drag a light in a running editor, as a page does, and watch the editor's memory.

`python -m tests.trust.editor.long_drag --minutes 15 [LENS]` prints the memory of the editor every minute and exits with
1 if it grew. The editor is a separate process; the drag goes through its socket, with a new light position as soon as
the last picture has come, and a pause every few seconds in which the final picture is traced.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median

import flarewright

# first minutes, in which caches fill; then the median memory of the last half may exceed that of the first by this, MB,
# as buffers of final pictures of some 100 MB come and go
SETTLING_S, GROWTH_MB = 300.0, 60.0
# drag and pause in turns, seconds
DRAG_S, PAUSE_S = 5.0, 2.0
PATIENCE_S = 120.0


@contextmanager
def running_editor(folder: Path, *words: str) -> Iterator[tuple[int, str, str]]:
    """Run `flarewright edit` in a folder; yield its process number, address and cookie."""
    environment = {
        **os.environ, "PYTHONPATH": str(Path(flarewright.__file__).parents[1]), "PYTHONUNBUFFERED": "1",
        "FLAREWRIGHT_STATE": str(folder / "state"),
    }  # fmt: skip
    process = subprocess.Popen(
        [sys.executable, "-m", "flarewright", "edit", *words, "--port", "0", "--no-browser"], cwd=folder,
        env=environment, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    try:
        assert process.stderr is not None
        line = next(found for found in process.stderr if "the editor is at" in found)
        printed = re.search(r"http://\S+", line)
        assert printed is not None
        with urllib.request.urlopen(printed[0], timeout=PATIENCE_S) as page:
            cookie = page.headers["set-cookie"].partition(";")[0]
        yield process.pid, printed[0].partition("/?")[0], cookie
    finally:
        process.kill()
        process.communicate()


def memory_mb(number: int) -> float:
    """Return the resident memory of a process."""
    text = Path(f"/proc/{number}/status").read_text("ascii")
    found = re.search(r"VmRSS:\s+(\d+) kB", text)
    assert found is not None
    return int(found[1]) / 1024.0


def drag(minutes: float, lens: str, report: Callable[[str], None]) -> tuple[list[float], int]:
    """Drag a light for some minutes.

    Parameters
    ----------
    minutes : float
    lens : str
    report : callable
        Gets a line each minute.

    Returns
    -------
    list of float
        Memory of the editor after settling and after each minute, MB.
    int
        Number of pictures.
    """
    from websockets.sync.client import connect

    with tempfile.TemporaryDirectory(prefix="trust-") as text, running_editor(Path(text), lens) as (number, address, c):
        headers = {"Cookie": c}
        with (
            connect(f"{address.replace('http', 'ws')}/ws", additional_headers=headers) as tab,
            connect(f"{address.replace('http', 'ws')}/ws/moving", additional_headers=headers, max_size=None) as moving,
        ):
            tab.send(json.dumps({"room": [1280, 720]}))
            seen, pictures, start = [], 0, time.monotonic()
            turn, minute = start, start + SETTLING_S
            while time.monotonic() < start + SETTLING_S + 60.0 * minutes:
                pictures += _step(moving, time.monotonic() - start, pictures)
                now = time.monotonic()
                if now > turn + DRAG_S:
                    time.sleep(PAUSE_S)
                    _put_down(address, headers, now - start)
                    turn = time.monotonic()
                if now > minute:
                    seen.append(memory_mb(number))
                    report(f"{(now - start) / 60.0:5.1f} min  {pictures:6} pictures  {seen[-1]:7.1f} MB")
                    minute += 60.0
                _drain(tab)
            seen.append(memory_mb(number))
    return seen, pictures


def _place(at_s: float) -> tuple[float, float]:
    return 12.0 * math.cos(0.7 * at_s), 7.0 * math.sin(1.1 * at_s)


def _step(moving: object, at_s: float, number: int) -> int:
    """Ask for a picture and wait for it; return whether it came."""
    x, y = _place(at_s)
    moving.send(json.dumps({"number": number, "light": 0, "x": str(x), "y": str(y)}))  # type: ignore[attr-defined]
    head, _, picture = moving.recv(timeout=PATIENCE_S).partition(b"\n")  # type: ignore[attr-defined]
    assert "error" not in json.loads(head), head
    return bool(picture)


def _put_down(address: str, headers: dict[str, str], at_s: float) -> None:
    """Write the light's position into the project, as a page does at the end of a drag."""
    x, y = _place(at_s)
    body = json.dumps({"name": "move_light", "values": {"light": 0, "x": x, "y": y}}).encode()
    request = urllib.request.Request(f"{address}/api/do", body, headers | {"Origin": address})
    with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
        answer.read()


def _drain(tab: object) -> None:
    """Read the events of the tab, as a page does."""
    try:
        while True:
            tab.recv(timeout=0.0)  # type: ignore[attr-defined]
    except TimeoutError:
        return


def main() -> int:
    """Drag, and print whether the memory grew."""
    parser = argparse.ArgumentParser(prog="python -m tests.trust.editor.long_drag", description=__doc__)
    parser.add_argument("lens", nargs="?", default="heliar-tronnier")
    parser.add_argument("--minutes", type=float, default=15.0)
    given = parser.parse_args()
    seen, pictures = drag(given.minutes, given.lens, lambda line: print(line, flush=True))
    first, last = median(seen[: len(seen) // 2]), median(seen[len(seen) // 2 :])
    grown = last - first
    print(f"{pictures} pictures; memory {first:.1f} MB in the first half, {last:.1f} MB in the last, {grown:+.1f} MB")
    return int(grown > GROWTH_MB)


if __name__ == "__main__":
    sys.exit(main())
