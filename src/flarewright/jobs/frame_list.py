"""The words for frames: ranges such as 1001-1240x2, names such as flare.####.exr, chunks such as 2/5."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from ..errors import ProjectError

T = TypeVar("T")

MOST_FRAMES = 1_000_000
"""Largest number of frames in one list."""

_RANGE = re.compile(r"\s*(-?\d{1,9})(?:\s*-\s*(-?\d{1,9})(?:\s*x\s*(\d{1,9}))?)?\s*")
# ####, %04d, $F4; a width of 0 is none
_FIELD = re.compile(r"(?P<hashes>#+)|%(?:0(?P<percent>\d{1,2}))?d|\$F(?P<houdini>\d?)")


def parse_frames(text: str) -> tuple[int, ...]:
    """Return the frames of a text, ascending, each once.

    Parameters
    ----------
    text : str
        Numbers and ranges between commas: "1001-1240", "1001-1240x2" (every second one), "1,5,9-12".

    Returns
    -------
    tuple of int

    Raises
    ------
    ProjectError
        The text is no such list, a range falls, or there are more than `MOST_FRAMES`.

    Examples
    --------
    >>> parse_frames("1-7x3,5")
    (1, 4, 5, 7)
    """
    found: set[int] = set()
    for part in text.split(","):
        match = _RANGE.fullmatch(part)
        if not match:
            raise ProjectError(
                f"frames {text[:120]!r}: {part.strip()[:60]!r} is neither a frame nor a range; write for example "
                "1001-1240, 1001-1240x2 or 1,5,9-12"
            )
        first = int(match[1])
        last, step = int(match[2] or first), int(match[3] or 1)
        if last < first:
            raise ProjectError(f"frames {part.strip()!r} run backwards; write {last}-{first}")
        if step < 1:
            raise ProjectError(f"frames {part.strip()!r}: the step is 0; write {first}-{last}x1 or a larger step")
        if len(found) + (last - first) // step >= MOST_FRAMES:
            raise ProjectError(f"frames {text[:120]!r} are more than {MOST_FRAMES}; give fewer at a time")
        found.update(range(first, last + 1, step))
    return tuple(sorted(found))


def frames_text(frames: Sequence[int]) -> str:
    """Return ascending frames as a short text: runs of neighbours become ranges."""
    runs: list[list[int]] = []
    for frame in frames:
        if runs and frame == runs[-1][1] + 1:
            runs[-1][1] = frame
        else:
            runs.append([frame, frame])
    return ",".join(str(first) if first == last else f"{first}-{last}" for first, last in runs)


@dataclass(frozen=True)
class FramePattern:
    """A file name with a place for the number of the frame.

    Attributes
    ----------
    text : str
        With `####` (as many digits as signs), `%04d` or `%d`, or `$F4` or `$F`; or a plain name, for one frame.
    """

    text: str

    def __post_init__(self) -> None:
        path = Path(self.text)
        fields = len(_FIELD.findall(path.name))
        if _FIELD.search(str(path.parent)):
            raise ProjectError(f"{self.text!r}: the number of the frame belongs into the file's name, not its folder")
        if fields > 1:
            raise ProjectError(
                f"{self.text!r} has {fields} places for the number of the frame; keep one, such as flare.####.exr"
            )

    @property
    def numbered(self) -> bool:
        """Whether the name has a place for the number."""
        return _FIELD.search(Path(self.text).name) is not None

    def path(self, frame: int) -> Path:
        """Return the file of a frame.

        Examples
        --------
        >>> str(FramePattern("flare.####.exr").path(7)), str(FramePattern("a_$F2.exr").path(101))
        ('flare.0007.exr', 'a_101.exr')
        """
        width = self.digits
        path = Path(self.text)
        return path.with_name(_FIELD.sub(f"{frame:0{width}d}" if width else str(frame), path.name))

    @property
    def digits(self) -> int:
        """Least number of digits of the frame's number; 0 if it has as many as it needs."""
        field = _FIELD.search(Path(self.text).name)
        if field is None:
            return 0
        return len(field["hashes"] or "") or int(field["percent"] or field["houdini"] or 0)

    def rewritten(self, place: str) -> str:
        """Return the name with another way to write the place of the number.

        Examples
        --------
        >>> FramePattern("out/flare.$F4.exr").rewritten("####")
        'out/flare.####.exr'
        """
        path = Path(self.text)
        return str(path.with_name(_FIELD.sub(place, path.name)))

    @property
    def stem(self) -> str:
        """Name without the number, its separator and the suffix.

        Examples
        --------
        >>> FramePattern("out/flare.####.exr").stem, FramePattern("a_$F2.exr").stem
        ('flare', 'a')
        """
        stem = Path(_FIELD.sub("", Path(self.text).name)).stem
        return stem.rstrip("._-") or "frames"

    def on_disk(self) -> tuple[int, ...]:
        """Return the numbers of the frames whose files exist, ascending; none for a plain name.

        Raises
        ------
        ProjectError
            The folder cannot be read.
        """
        path = Path(self.text)
        field = _FIELD.search(path.name)
        if field is None:
            return ()
        before, after = path.name[: field.start()], path.name[field.end() :]
        name = re.compile(f"{re.escape(before)}(-?[0-9]{{1,9}}){re.escape(after)}")
        try:
            matches = [name.fullmatch(each) for each in os.listdir(path.parent)]
        except OSError as error:
            raise ProjectError(
                f"{self.text}: the folder {path.parent} cannot be read ({(error.strerror or str(error)).lower()})"
            ) from None
        there = {match[0]: int(match[1]) for match in matches if match}
        # other files can have as many digits
        return tuple(sorted({number for number in there.values() if self.path(number).name in there}))

    def found(self) -> tuple[int, ...]:
        """Return the frames as `on_disk` does; raises ProjectError if there is none."""
        there = self.on_disk()
        if not there:
            raise ProjectError(
                f"no file is named {self.text}; check the folder, and the number of digits (#### or %04d)"
            )
        return there

    def check(self, frames: Sequence[int]) -> None:
        """Raise ProjectError if several frames would go to one file."""
        if len(frames) > 1 and not self.numbered:
            path = Path(self.text)
            raise ProjectError(
                f"all {len(frames)} frames would go to {self.text}; write {path.stem}.####{path.suffix} (or %04d, $F4)"
            )


def parse_chunk(text: str) -> tuple[int, int]:
    """Return (i, n) of "i/n": chunk i of n, counted from 1.

    Raises
    ------
    ProjectError
        It is no chunk.

    Examples
    --------
    >>> parse_chunk("2/5")
    (2, 5)
    """
    match = re.fullmatch(r"\s*(\d{1,7})\s*/\s*(\d{1,7})\s*", text)
    if not match:
        raise ProjectError(f"chunk {text[:60]!r} is not two whole numbers; write for example 2/5, the second of five")
    which, of = int(match[1]), int(match[2])
    if not 1 <= which <= of:
        raise ProjectError(f"chunk {text.strip()} does not exist: the chunks of {of} are 1/{of} to {of}/{of}")
    return which, of


def chunk_of(items: Sequence[T], which: int, of: int) -> Sequence[T]:
    """Return one of several parts of a list that differ by at most one in length; together they are the list."""
    return items[len(items) * (which - 1) // of : len(items) * which // of]
