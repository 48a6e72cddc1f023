"""Journal of the expensive steps of a job. A stopped run resumes from it, with the result of an uninterrupted run.

A stage passes each expensive step to the journal. The journal returns the recorded result of an earlier run, exact to
the last bit, or runs the step and writes its result to the file at once. A stage repeats its cheap work. Each line has
a checksum; reading ends at the first line that is cut or damaged.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TextIO, TypeVar, cast

import numpy as np

from ..._version import __version__
from ...errors import FileError, OutputError
from ...io.files.atomic_write import write_text_atomically
from ...io.files.door import outside
from ...model.base import Frozen
from ...model.measurement.ghost_model import Blades
from ...model.measurement.sprite import Sprite
from ...sentences import count
from ...typing import Report

Result = TypeVar("Result")

# length of a line's checksum, with a space
_SUM = 9
# types of results beside numbers, strings, lists and arrays: each module registers its own
_RECORDS: dict[str, type[Any]] = {}
_MODELS: dict[str, type[Frozen]] = {one.__name__: one for one in (Blades, Sprite)}


def recorded(record: type[Result]) -> type[Result]:
    """Register a dataclass that the result of a step may contain; a class decorator.

    On opening, a journal drops the steps that hold unregistered records. Import the modules of a stage first.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @recorded
    ... @dataclass(frozen=True)
    ... class Circle:
    ...     radius: float
    """
    _RECORDS[record.__name__] = record
    return record


class Journal:
    """Steps of one stage, in order.

    Parameters
    ----------
    known : list
        Steps that an earlier run recorded.
    file : text file or None
        File that new steps are appended to; None: new steps are not recorded.
    """

    def __init__(self, known: list[Any] | None = None, file: TextIO | None = None) -> None:
        self._known = known or []
        self._at = 0
        self._written = 0
        self._file = file
        self.unfinished = False
        """Set it to keep the file of a job that was asked to end early."""

    def step(self, make: Callable[[], Result], cut: Callable[[], bool] = lambda: False) -> Result:
        """Return the result of the next step: the recorded one, or that of `make`.

        Parameters
        ----------
        make : callable
            Runs the step; its result consists of numbers, strings, None, lists, arrays and registered records.
        cut : callable, optional
            Called after the step; True if it ended before its time, so that its result is not recorded.

        Raises
        ------
        OutputError
            When the result cannot be written.
        """
        if self._at < len(self._known):
            self._at += 1
            return cast(Result, _decoded(self._known[self._at - 1]))
        result = make()
        if self._file is not None and not cut():
            try:
                self._file.write(_line(_encoded(result)))
                self._file.flush()
            except OSError as error:
                raise _write_error(self._file.name, error) from None
            self._written += 1
        return result

    @property
    def remembered(self) -> int:
        """Number of steps that an earlier run recorded."""
        return len(self._known)

    @property
    def empty(self) -> bool:
        """Whether the journal holds no step."""
        return not self._known and self._written == 0


def _write_error(name: str | Path, error: OSError) -> OutputError:
    reason = (error.strerror or str(error)).lower()
    return OutputError(f"cannot write {name}: {reason}; check the free space and rerun: finished steps are kept")


@contextmanager
def journal(path: Path, digest: str, report: Report = lambda _: None) -> Iterator[Journal]:
    """Open the journal of a stage. Success removes the file; an interrupted stage keeps it with its steps.

    Parameters
    ----------
    path : Path
    digest : str
        Digest of all inputs of the stage; a journal with another digest is discarded.
    report : callable, optional
        Called with a sentence when a journal is discarded, or a damaged part of it.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    head = {"journal": 13, "version": __version__, "digest": digest}
    known = _read(path, head, report)
    text = "".join(_line(one) for one in (head, *known))

    # rewrite the file without a last line that an interruption cut short
    write_text_atomically(path, text)
    try:
        file = path.open("a", encoding="utf-8")
    except OSError as error:
        raise _write_error(path, error) from None
    steps = Journal(known, file)
    ended = False
    try:
        yield steps
        ended = True
    finally:
        # after a write to a full disk failed, close tries again; its error would hide the first one
        with suppress(OSError):
            file.close()
        if (ended and not steps.unfinished) or steps.empty:
            path.unlink(missing_ok=True)


def _read(path: Path, head: dict[str, Any], report: Report) -> list[Any]:
    """Return the steps of a journal with this head, up to the first that is cut or damaged."""
    if not path.exists():
        return []
    try:
        with outside(path, "a journal") as file:
            lines = file.read().decode("utf-8").replace("\r\n", "\n").splitlines(keepends=True)
    except FileError:
        lines = []
    found = _whole(lines)
    if not found:
        report(f"{path} is damaged; its steps are repeated")
    elif found[0] != head:
        report(f"{path} belongs to other settings; its steps are repeated")
        return []
    elif len(found) < len(lines):
        report(f"{path} is damaged after {count(len(found) - 1, 'step')}; later ones are repeated")
    return found[1:]


def _whole(lines: Sequence[str]) -> list[Any]:
    """Decode lines up to the first that is cut or damaged."""
    found: list[Any] = []
    for line in lines:
        text = line[_SUM:].removesuffix("\n")
        if line != f"{_checksum(text)} {text}\n":
            break
        try:
            one = json.loads(text)
            # the first line is the header
            if found:
                _decoded(one)
        except (ValueError, KeyError, TypeError):
            break
        found.append(one)
    return found


def _line(value: Any) -> str:
    text = json.dumps(value)
    return f"{_checksum(text)} {text}\n"


def _checksum(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x}"


def _encoded(value: Any) -> Any:
    """Convert a result to JSON that restores every number to the last bit."""
    if is_dataclass(value) and type(value).__name__ in _RECORDS:
        return {"is": type(value).__name__, **{one.name: _encoded(getattr(value, one.name)) for one in fields(value)}}
    if type(value).__name__ in _MODELS:
        return {"is": type(value).__name__, "reported": value.model_dump(mode="json")}
    if isinstance(value, np.ndarray):
        data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
        return {"array": data, "type": value.dtype.str, "shape": list(value.shape)}
    if isinstance(value, tuple):
        return {"tuple": [_encoded(one) for one in value]}
    if isinstance(value, list):
        return [_encoded(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a journal cannot hold a {type(value).__name__}; register its class with `recorded`")


def _decoded(value: Any) -> Any:
    if isinstance(value, list):
        return [_decoded(one) for one in value]
    if not isinstance(value, dict):
        return value
    if "tuple" in value:
        return tuple(_decoded(one) for one in value["tuple"])
    if "array" in value:
        array = np.frombuffer(base64.b64decode(value["array"]), np.dtype(value["type"]))
        return array.reshape(value["shape"]).copy()
    if "reported" in value:
        return _MODELS[value["is"]].model_validate(value["reported"])
    record = _RECORDS[value["is"]]
    return record(**{name: _decoded(one) for name, one in value.items() if name != "is"})
