"""The program `flarewright`: its command, and a running one that is read without waiting."""

import json
import os
import queue
import shlex
import shutil
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

from .errors import FlareError

_NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)


class Order(NamedTuple):
    """The values of a command `flarewright shot`."""

    lens: str
    scene: Path
    pattern: Path
    frames: tuple[int, int, int]
    start: int
    fps: float
    size_px: tuple[int, int]
    sensor_mm: tuple[float, float]
    f_number: float = 0.0
    quality: str = "final"
    shutter_deg: float = 0.0
    more: str = ""


def shot_command(program: Sequence[str], order: Order) -> list[str]:
    """Return the command that draws the flare of a scene.

    Raises
    ------
    FlareError
        The additional options have an open quotation mark.
    """
    first, last, step = order.frames
    try:
        more = shlex.split(order.more)
    except ValueError:
        raise FlareError(f"the options {order.more!r} have an open quotation mark; close it") from None
    command = [*program, "shot", "--lens", order.lens, "--track", str(order.scene), "--track-format", "blender"]
    command += ["--frames", f"{first}-{last}" + (f"x{step}" if step > 1 else ""), "--start", str(order.start)]
    command += ["--fps", f"{order.fps:.10g}", "--size", f"{order.size_px[0]}x{order.size_px[1]}"]
    command += ["--sensor", f"{order.sensor_mm[0]:.8g}x{order.sensor_mm[1]:.8g}", "--quality", order.quality]
    command += ["--fstop", f"{order.f_number:.6g}"] if order.f_number > 0.0 else []
    command += ["--shutter", f"{order.shutter_deg:.6g}"] if order.shutter_deg > 0.0 else []
    return [*command, "--radiance", "--json", *more, "-o", str(order.pattern)]


def find_program(text: str) -> list[str]:
    """Return the program as a command.

    Parameters
    ----------
    text : str
        A name on PATH, a file, or a command such as "python -m flarewright".

    Raises
    ------
    FlareError
        There is no such program.
    """
    for words in ([text], text.split()):
        found = shutil.which(words[0]) if words and words[0] else None
        if found is not None:
            return [found, *words[1:]]
    raise FlareError(
        f"the program {text!r} was not found; install it with 'pip install flarewright' and give its path in the "
        "preferences of this add-on"
    )


class Running:
    """A running program, read without waiting: its progress, its remarks and its end.

    Parameters
    ----------
    command : sequence of str

    Attributes
    ----------
    done, of : int
        Finished frames and all frames; 0 before the first.
    left_s : float or None
        Estimate of the time that is left.
    remarks : list of str
    code : int or None
        Exit code; None while the program runs.

    Raises
    ------
    FlareError
        The program cannot be started.
    """

    def __init__(self, command: Sequence[str]) -> None:
        # a separate group, so that the processes that draw end with it
        own = {"start_new_session": True} if os.name == "posix" else {"creationflags": _NEW_GROUP}
        try:
            self._process = subprocess.Popen(
                list(command), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                text=True, encoding="utf-8", errors="replace", **own,
            )  # fmt: skip
        except OSError as error:
            raise FlareError(f"cannot start {command[0]}: {error.strerror or error}") from None
        self.done, self.of = 0, 0
        self.left_s: float | None = None
        self.remarks: list[str] = []
        self.code: int | None = None
        self._output: list[str] = []
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._threads = [
            threading.Thread(target=self._read, args=(self._process.stderr, self._lines.put), daemon=True),
            threading.Thread(target=self._read, args=(self._process.stdout, self._output.append), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @staticmethod
    def _read(stream: Any, put: Callable[[str], Any]) -> None:
        for line in stream:
            put(line)

    def poll(self) -> bool:
        """Read what the program has printed, and return whether it has ended."""
        ended = self._process.poll() is not None
        if ended:
            for thread in self._threads:
                thread.join(5.0)
        while not self._lines.empty():
            self._take(self._lines.get())
        if ended:
            self.code = self._process.returncode
        return ended

    def _take(self, line: str) -> None:
        """Read a line: progress as JSON, or a sentence."""
        try:
            data = json.loads(line)
            self.done, self.of, self.left_s = int(data["done"]), int(data["of"]), data.get("left_s")
        except (ValueError, TypeError, KeyError):
            if line.strip():
                self.remarks.append(line.strip().removeprefix("flarewright: "))

    @property
    def words(self) -> str:
        """The progress in words."""
        if not self.of:
            return "Flarewright starts"
        left = "" if self.left_s is None or self.done == self.of else f", {ceil(self.left_s)} s left"
        return f"flare of {self.done} of {self.of} frames{left}"

    @property
    def error(self) -> str:
        """The sentence of a program that failed."""
        said = [line for line in self.remarks if line.startswith("error: ")]
        last = said[0].removeprefix("error: ") if said else (self.remarks or ["no message"])[-1]
        return f"Flarewright: {last}"

    def summary(self) -> dict[str, Any]:
        """Return the object that the program printed at its end; empty if it printed none."""
        try:
            found = json.loads("".join(self._output))
        except ValueError:
            return {}
        return found if isinstance(found, dict) else {}

    def cancel(self) -> None:
        """End the program and what it has started. Finished frames stay; the same command resumes."""
        if self._process.poll() is not None:
            return
        self._signal(signal.SIGINT if os.name == "posix" else getattr(signal, "CTRL_BREAK_EVENT", signal.SIGTERM))
        try:
            # a frame that is being written is finished; a program that ignores the signal is not waited for
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._signal(getattr(signal, "SIGKILL", signal.SIGTERM))
            self._process.wait(10.0)

    def _signal(self, number: int) -> None:
        with suppress(OSError):
            if os.name == "posix":
                os.killpg(self._process.pid, number)
            elif number == signal.SIGTERM:
                self._process.kill()
            else:
                self._process.send_signal(number)
