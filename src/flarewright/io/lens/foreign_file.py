"""What the readers of other programs' lens files share: decoding, numbers, the largest field, errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import Any

from ...errors import FileError, LensError
from ...model import Surface
from ...model.lens.raw_lens import RawSequence, SequenceRow
from ...sentences import INVALID, summary, validation_sentences
from ..files.door import sentences_for
from ..files.text_file import read_bytes

MOST_SURFACES = 500
"""Largest number of surfaces: photographic lenses have up to sixty; longer files are not lenses."""
INFINITE = 1e9
"""A gap of this length or more, in the unit of the file, is infinite."""


@contextmanager
def lens_errors() -> Iterator[None]:
    """Raise the FileError of a file that cannot be read as a LensError, whose `problems` hold the sentence."""
    try:
        yield
    except FileError as error:
        raise LensError(str(error), (str(error),)) from error


@contextmanager
def lens_data(path: str | Path, what: str) -> Iterator[bytes]:
    """Give the bytes of a lens file; whatever is raised while they are read becomes a LensError of one sentence."""
    with lens_errors():
        data = read_bytes(path, what)
        with sentences_for(path, what):
            yield data


def whole(path: str | Path, raw: RawSequence | None, problems: list[str]) -> RawSequence:
    """Return what was read of a file; raise a LensError with all its problems if there are any."""
    if raw is None or problems:
        raise LensError(summary(str(path), problems), tuple(problems))
    return raw


def sequence_row(
    where: str, problems: list[str], before: int, *, number: int, stop: bool, automatic_rim: bool = False,
    **surface: Any,
) -> SequenceRow | None:  # fmt: skip
    """Return the row of a surface; None if there are more than `before` problems, with those of its values."""
    if surface["medium"] is not None and surface["thickness"] < 0.0:
        problems.append(f"{where}: glass cannot be {surface['thickness']:g} mm thick")
    if len(problems) > before:
        return None
    try:
        return SequenceRow(number=number, surface=Surface(**surface), stop=stop, automatic_rim=automatic_rim)
    except INVALID as error:
        problems += [f"{where}: {sentence}" for sentence in validation_sentences(error)]
        return None


def decoded(data: bytes) -> str:
    """Decode UTF-16 or UTF-8, else the Windows code page of old versions."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if b"\x00" in data[:64]:
        # without a byte order mark: in UTF-16, every other byte of Latin letters is 0
        return data.decode("utf-16-le" if data[1:2] == b"\x00" else "utf-16-be", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def number_of(word: str) -> float | None:
    """Return the finite number that a word states, or None."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def json_number(value: object) -> float | None:
    """Return a finite number of a JSON file; None for anything else, such as a whole number that no float can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
        return None
    return float(value)


def largest_field(x: Sequence[float | None], y: Sequence[float | None]) -> float:
    """Return the largest distance of the field points from the axis; 0 if there are none.

    Parameters
    ----------
    x, y : sequence of float or None
        Columns of a file, of any unit; a missing number is 0.
    """
    return max((math.hypot(a or 0.0, b or 0.0) for a, b in zip_longest(x, y)), default=0.0)
