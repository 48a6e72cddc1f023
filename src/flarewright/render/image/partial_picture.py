"""Unfinished pictures of a long render in files, from which the same render resumes to the same pixels.

A picture is drawn as several canvases, each in a fixed order of steps by one thread. A file holds the planes of one
canvas and the number of its finished steps, so a resumed run adds the other steps to the same sums in the same order.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from threading import Event, Lock
from time import monotonic
from typing import Any, Protocol

import numpy as np
from pydantic import BaseModel

from ..._version import __version__
from ...errors import FileError, OutputError
from ...io.files.door import read_limit_bytes
from ...io.render_state.kept_arrays import Arrays, digest_in, read_arrays, write_arrays
from ...io.render_state.partial_planes import REMEDY, WHAT, read_planes, write_planes
from ...typing import Report
from .canvas import Canvas

CHECKPOINT_S = 10.0
"""Least time between two writes of a canvas, seconds; nothing is written before."""
WRITING = 0.1
"""Largest part of the time that is spent on writing."""
SUFFIX = ".partial"
"""Suffix of the folder, instead of that of the picture."""


class PartialPicture:
    """Folder with the finished part of a picture.

    Parameters
    ----------
    folder : Path
        Created at the first write.
    report : callable
        Called with sentences: on resuming, on damaged files, and when the part cannot be kept.
    """

    def __init__(self, folder: Path, report: Report) -> None:
        self.folder = folder
        self._report = report
        self._name = self._digest = ""
        self._begun, self._writing_s = monotonic(), 0.0
        self._lock = Lock()
        self._said: set[str] = set()
        # files of a killed write
        self._drop(".*.part.npz")

    def begin(self, name: str, *inputs: Any) -> None:
        """Begin the canvases of a pass; files of the pass with other inputs are deleted.

        Parameters
        ----------
        name : str
            Of the pass.
        *inputs
            All that determines the pixels: arrays, numbers, text, records and collections of them.
        """
        self._name, self._digest = name, digest_of(__version__, *inputs)
        for path in self.folder.glob(f"{name}-*.npz"):
            try:
                other = digest_in(path, WHAT, REMEDY) != self._digest
                reason = f"{path} belongs to other settings; it is drawn again"
            except FileError as error:
                other, reason = True, str(error)
            if other:
                path.unlink(missing_ok=True)
                self._say("other", reason)

    def load(self, name: str, canvas: Canvas) -> int:
        """Fill a blank canvas with the planes of an earlier run; return the number of steps that they hold."""
        path = self._file(name)
        if not path.exists():
            return 0
        try:
            steps, planes = read_planes(path)
        except FileError as error:
            self._say("damaged", str(error))
            return 0
        canvas.planes[:] = planes
        self._say("resuming", f"{self.folder}: resuming an interrupted run")
        return steps

    def store(self, name: str, steps: int, canvas: Canvas) -> bool:
        """Write a canvas; return False, after one sentence, if that is impossible."""
        size = sum(plane.nbytes for plane in canvas.planes if plane is not None)
        return self._store(size, lambda: write_planes(self._file(name), self._digest, steps, canvas.planes))

    def load_arrays(self, name: str) -> Arrays | None:
        """Return the arrays of an earlier run; None if there are none, or damaged ones."""
        path = self._file(name)
        if not path.exists():
            return None
        try:
            _, arrays = read_arrays(path, WHAT, REMEDY)
        except FileError as error:
            self._say("damaged", str(error))
            return None
        self._say("resuming", f"{self.folder}: resuming an interrupted run")
        return arrays

    def store_arrays(self, name: str, arrays: Arrays) -> bool:
        """Write arrays; return False, after one sentence, if that is impossible."""
        size = sum(array.nbytes for array in arrays.values())
        return self._store(size, lambda: write_arrays(self._file(name), self._digest, arrays))

    def _store(self, size: int, write: Callable[[], None]) -> bool:
        if "failed" in self._said:
            return False
        started = monotonic()
        try:
            if size > read_limit_bytes():
                raise OutputError(
                    f"{size / 1e6:.0f} MB are more than a later run would read (FLAREWRIGHT_READ_LIMIT_MB)"
                )
            self.folder.mkdir(exist_ok=True)
            write()
        except (OutputError, OSError) as error:
            self._say("failed", f"no checkpoint: {error}")
            return False
        with self._lock:
            self._writing_s += monotonic() - started
        return True

    def due(self, last_s: float | None = None) -> bool:
        """Return whether a canvas can be written.

        Parameters
        ----------
        last_s : float, optional
            When it started, or was written last (`time.monotonic`); None: it is complete.
        """
        now = monotonic()
        with self._lock:
            since = now - (self._begun if last_s is None else last_s)
            return since >= CHECKPOINT_S and self._writing_s <= WRITING * (now - self._begun)

    @property
    def size_bytes(self) -> int:
        """Size of the files; 0 if nothing was written."""
        return sum(path.stat().st_size for path in self.folder.glob("*.npz"))

    def remove(self) -> None:
        """Delete the files and their folder."""
        self._drop("*.npz")
        try:
            self.folder.rmdir()
        except OSError:
            # it never existed, or holds files of the user
            return

    def _say(self, kind: str, sentence: str) -> None:
        """Report the first sentence of a kind, whichever thread has it."""
        with self._lock:
            known = kind in self._said
            self._said.add(kind)
        if not known:
            self._report(sentence)

    def _drop(self, pattern: str) -> None:
        for path in self.folder.glob(pattern):
            path.unlink(missing_ok=True)

    def _file(self, name: str) -> Path:
        return self.folder / f"{self._name}-{name}.npz"


class Steps(Protocol):
    """Interface of the steps that draw one canvas."""

    def step(self, work: Callable[..., None], *, whole: bool = True) -> None:
        """Do the next step.

        Parameters
        ----------
        work : callable
            Takes `stop`, an event that asks it to end early, or None.
        whole : bool
            Whether a step in progress is short, so that a cancelled picture may wait for its end.
        """

    def end(self) -> None:
        """End the canvas."""


def steps_of(kept: PartialPicture | None, name: str, canvas: Canvas, cancelled: Event) -> Steps:
    """Return the steps of a canvas, which `kept` keeps if it is given; parameters as of `KeptSteps`."""
    return PlainSteps(cancelled) if kept is None else KeptSteps(kept, name, canvas, cancelled)


class PlainSteps:
    """Steps of a canvas that is not kept.

    Parameters
    ----------
    cancelled : Event
        Ends a step early.
    """

    def __init__(self, cancelled: Event) -> None:
        self._cancelled = cancelled

    def step(self, work: Callable[..., None], *, whole: bool = True) -> None:
        """Do the next step, unless the picture is cancelled."""
        del whole
        if not self._cancelled.is_set():
            work(stop=self._cancelled)

    def end(self) -> None:
        """End the canvas; nothing is kept."""


class KeptSteps:
    """Steps of a canvas that a partial picture keeps.

    Parameters
    ----------
    kept : PartialPicture
    name : str
        Of the canvas, unique within its inputs.
    canvas : Canvas
        Blank; filled with the steps of an earlier run.
    cancelled : Event
        Skips all further steps. A short step in progress ends first, so that the canvas holds whole steps.
    """

    def __init__(self, kept: PartialPicture, name: str, canvas: Canvas, cancelled: Event) -> None:
        self._kept, self._name, self._canvas, self._cancelled = kept, name, canvas, cancelled
        self._known = self._stored = self._done = kept.load(name, canvas)
        self._at, self._last_s, self._torn = 0, monotonic(), False

    def step(self, work: Callable[..., None], *, whole: bool = True) -> None:
        """Do the next step, unless an earlier run did it or the picture is cancelled; keep the canvas at intervals."""
        self._at += 1
        if self._at <= self._known or self._cancelled.is_set():
            return
        work(stop=None if whole else self._cancelled)
        if not whole and self._cancelled.is_set():
            self._torn = True
            return
        self._done = self._at
        if self._kept.due(self._last_s):
            self._store()

    def end(self) -> None:
        """Keep the canvas if the picture is cancelled, or if the picture takes long."""
        if self._done > self._stored and not self._torn and (self._cancelled.is_set() or self._kept.due()):
            self._store()

    def _store(self) -> None:
        if self._kept.store(self._name, self._done, self._canvas):
            self._stored = self._done
        self._last_s = monotonic()


def digest_of(*values: Any) -> str:
    """Return a digest of values: arrays, numbers, text, records, models and collections of them.

    Returns
    -------
    str
        32 hexadecimal digits, equal for equal values.

    Raises
    ------
    TypeError
        A value is of another type.
    """
    digest = hashlib.blake2b(digest_size=16)
    known: dict[int, bytes] = {}
    _feed(digest, values, known)
    return digest.hexdigest()


def _feed(digest: Any, value: Any, known: dict[int, bytes]) -> None:
    """Add a value with its type; large values shared by several records are read once, `known` by their identity."""
    digest.update(type(value).__name__.encode())
    if value is None or isinstance(value, bool | int | float | str | bytes | np.generic):
        digest.update(repr(value).encode() + b";")
        return
    if isinstance(value, Mapping):
        parts: Sequence[Any] = [part for pair in value.items() for part in pair]
    elif isinstance(value, tuple | list):
        parts = value
    elif is_dataclass(value):
        # fields that are ignored in comparisons are caches
        parts = [getattr(value, one.name) for one in fields(value) if one.compare]
    elif isinstance(value, np.ndarray | BaseModel):
        if id(value) not in known:
            known[id(value)] = hashlib.blake2b(_bytes(value)).digest()
        digest.update(known[id(value)])
        return
    else:
        raise TypeError(f"a {type(value).__name__} has no digest")
    digest.update(f"{len(parts)}[".encode())
    for part in parts:
        _feed(digest, part, known)


def _bytes(value: Any) -> bytes:
    if isinstance(value, BaseModel):
        return value.model_dump_json().encode()
    data: bytes = value.tobytes()
    return f"{value.dtype.str}{value.shape}".encode() + data
