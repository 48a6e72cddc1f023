"""A journal of a stage's dear steps, so that a stopped run goes on and ends as if it had not been stopped.

A stage asks the journal for each of its dear steps. The journal gives what an earlier run had found for that step,
number for number, or lets the step be done and writes it down at once. All else that a stage does is cheap and is done
again.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TextIO, TypeVar, cast

import numpy as np

from .. import __version__
from ..errors import OutputError
from ..io.atomic import write_atomically
from ..model.base import Frozen
from ..model.ghost_model import Blades
from ..model.sprite import Sprite
from .curves import Pose
from .find import Candidate
from .fit import Fit
from .found import Found
from .shape import Shape
from .together import Measured

Made = TypeVar("Made")

# what steps may be made of besides numbers, texts, lists and arrays
_RECORDS: dict[str, type[Any]] = {one.__name__: one for one in (Candidate, Shape, Fit, Found, Pose, Measured)}
_MODELS: dict[str, type[Frozen]] = {one.__name__: one for one in (Blades, Sprite)}


class Journal:
    """Steps of one stage, in their order.

    Parameters
    ----------
    known : list
        What an earlier run wrote down.
    file : text file or None
        Where new steps go; None: nowhere.
    """

    def __init__(self, known: list[Any] | None = None, file: TextIO | None = None) -> None:
        self._known = known or []
        self._at = 0
        self._written = 0
        self._file = file

    def step(self, make: Callable[[], Made]) -> Made:
        """Return a step's result, from the journal when it knows it.

        Parameters
        ----------
        make : callable
            Does the step; its result is made of numbers, texts, None, lists, arrays, and the records of the search.

        Raises
        ------
        OutputError
            When the result cannot be written.
        """
        if self._at < len(self._known):
            self._at += 1
            return cast(Made, _unpacked(self._known[self._at - 1]))
        made = make()
        if self._file is not None:
            try:
                self._file.write(json.dumps(_packed(made)) + "\n")
                self._file.flush()
            except OSError as error:
                raise _unwritten(self._file.name, error) from None
            self._written += 1
        return made

    @property
    def remembered(self) -> int:
        """How many steps an earlier run had done."""
        return len(self._known)

    @property
    def empty(self) -> bool:
        """Whether no step is known."""
        return not self._known and self._written == 0


def _unwritten(name: str | Path, error: OSError) -> OutputError:
    reason = (error.strerror or str(error)).lower()
    return OutputError(f"cannot write {name}: {reason}; check the free space, and begin again: what is done is kept")


@contextmanager
def journal(path: Path, digest: str) -> Iterator[Journal]:
    """Open the journal of a stage; removed when the stage ends well, kept with its steps when it is stopped.

    Parameters
    ----------
    path : Path
    digest : str
        Of all that the stage is made from; a journal of anything else is begun anew.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    head = {"journal": 10, "version": __version__, "digest": digest}
    known = _read(path, head)
    text = "".join(json.dumps(line) + "\n" for line in (head, *known))

    def write(temporary: Path) -> None:
        temporary.write_text(text, "utf-8")

    # written anew without the line that a stop may have cut
    write_atomically(path, write)
    try:
        file = path.open("a", encoding="utf-8")
    except OSError as error:
        raise _unwritten(path, error) from None
    steps = Journal(known, file)
    ended = False
    try:
        yield steps
        ended = True
    finally:
        # what a full disk did not take is tried once more here, and would hide what was said of it
        with suppress(OSError):
            file.close()
        if ended or steps.empty:
            path.unlink(missing_ok=True)


def _read(path: Path, head: dict[str, Any]) -> list[Any]:
    try:
        lines = path.read_text("utf-8").splitlines(keepends=True)
    except (OSError, UnicodeDecodeError):
        return []
    found: list[Any] = []
    for line in lines:
        if not line.endswith("\n"):
            break
        try:
            one = json.loads(line)
            # the first is no step
            if found:
                _unpacked(one)
        except (ValueError, KeyError, TypeError):
            break
        found.append(one)
    return found[1:] if found and found[0] == head else []


def _packed(value: Any) -> Any:
    """Turn a result into JSON that gives every number back to the last bit."""
    if is_dataclass(value) and type(value).__name__ in _RECORDS:
        return {"is": type(value).__name__, **{one.name: _packed(getattr(value, one.name)) for one in fields(value)}}
    if type(value).__name__ in _MODELS:
        return {"is": type(value).__name__, "told": value.model_dump(mode="json")}
    if isinstance(value, np.ndarray):
        data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
        return {"array": data, "type": value.dtype.str, "shape": list(value.shape)}
    if isinstance(value, tuple):
        return {"tuple": [_packed(one) for one in value]}
    if isinstance(value, list):
        return [_packed(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a step made a {type(value).__name__}, which a journal cannot hold")


def _unpacked(value: Any) -> Any:
    if isinstance(value, list):
        return [_unpacked(one) for one in value]
    if not isinstance(value, dict):
        return value
    if "tuple" in value:
        return tuple(_unpacked(one) for one in value["tuple"])
    if "array" in value:
        array = np.frombuffer(base64.b64decode(value["array"]), np.dtype(value["type"]))
        return array.reshape(value["shape"]).copy()
    if "told" in value:
        return _MODELS[value["is"]].model_validate(value["told"])
    record = _RECORDS[value["is"]]
    return record(**{name: _unpacked(one) for name, one in value.items() if name != "is"})
