"""Helpers of several commands: option values, output checks, remarks, JSON, progress bars."""

from __future__ import annotations

import json
import math
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import FlarewrightError, OutputError, ProjectError
from ..workflow.kept_work.checkpoints import kept_until_done
from ..workflow.kept_work.unnamed_work import unnamed_file

if TYPE_CHECKING:
    from rich.console import Console

    from ..io.lens.formats.codev import FirstColumn
    from ..io.lens.own.record import LensRecord
    from ..optics.lens_import.patent_repair import Apertures
    from ..typing import Progress, Report

Word = TypeVar("Word", bound=str)

FIRST_COLUMN_HELP = "Read the first column of .seq files without RDM as radii or curvatures."
APERTURES_HELP = "Read the last column of .lens tables as diameters or semi-diameters (default: by the f-number)."


def pair(text: str, flag: str, example: str, separator: str = ",") -> tuple[float, float]:
    """Return the two numbers of a text like "10,5" or "36x24".

    Parameters
    ----------
    text : str
    flag, example : str
        For the error message.
    separator : str

    Raises
    ------
    ProjectError
        When it is not two finite numbers.
    """
    parts = text.lower().replace("×", "x").split(separator)
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) != 2 or not all(math.isfinite(number) for number in numbers):
        raise ProjectError(f"{flag} {text!r} is not two numbers; write {flag} {example}")
    return numbers[0], numbers[1]


def field_angles(text: str) -> tuple[float, float]:
    """Return the field angles of `--light X,Y` in degrees."""
    angles = pair(text, "--light", "10,5 (degrees right and up)")
    if max(abs(angle) for angle in angles) >= 90.0:
        raise ProjectError(f"--light {text!r} is behind the camera; field angles lie between -90 and 90 degrees")
    return angles


def picture_size(text: str, flag: str = "--size") -> tuple[int, int]:
    """Return the width and height of `--size WxH`, or of another flag, in pixels.

    Raises
    ------
    ProjectError
        When they are not whole numbers from 1 to 65536.
    """
    width, height = pair(text, flag, "1280x720", "x")
    if not (width.is_integer() and height.is_integer() and 1 <= width <= 65536 and 1 <= height <= 65536):
        raise ProjectError(f"{flag} {text!r} is not two whole numbers of pixels up to 65536; write {flag} 1280x720")
    return int(width), int(height)


def print_remarks(remarks: Iterable[str]) -> None:
    """Print remarks to stderr, one a line."""
    for remark in remarks:
        print_remark(remark)


def print_remark(remark: str) -> None:
    """Print a remark to stderr."""
    print(f"flarewright: {remark}", file=sys.stderr)


def one_of(flag: str, text: str, known: tuple[Word, ...]) -> Word:
    """Return the value of an option that takes one of a few words.

    Raises
    ------
    ProjectError
        When it is another one.
    """
    for word in known:
        if word == text:
            return word
    raise ProjectError(f"{flag} {text!r} is unknown; choose {' or '.join(known)}")


def aperture_reading(text: str | None) -> Apertures:
    """Return the reading of the last column of a `.lens` table that `--apertures` chooses."""
    return "auto" if text is None else one_of("--apertures", text, ("diameters", "semi-diameters"))


def first_column_reading(text: str | None) -> FirstColumn | None:
    """Return the reading of the first column of a `.seq` file that `--first-column` chooses."""
    if text is None:
        return None
    column: FirstColumn = one_of("--first-column", text, ("radii", "curvatures"))
    return column


def print_json(data: dict[str, Any]) -> None:
    """Print one JSON object to stdout; numbers that JSON cannot hold become null."""
    print(json.dumps(_finite(data), indent=2, allow_nan=False))


def error_data(file: str | Path, error: FlarewrightError) -> dict[str, Any]:
    """Return the JSON of `--json` for a file that cannot be used."""
    return {"file": str(file), "usable": False, "reason": str(error), "problems": list(error.problems) or [str(error)]}


@contextmanager
def errors_as_json(file: Path, wanted: bool) -> Iterator[None]:
    """Print the error of a rejected file as one JSON object if wanted, and raise it again."""
    try:
        yield
    except FlarewrightError as error:
        if wanted:
            print_json(error_data(file, error))
        raise


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def check_place(path: Path, suffix: str | tuple[str, ...]) -> None:
    """Raise an error before the work if an output cannot be written.

    Parameters
    ----------
    path : path
    suffix : str or tuple of str
        Allowed suffixes of the name.

    Raises
    ------
    OutputError
        When the name is empty or has another suffix, its folder does not exist, or it is a folder itself.
    """
    from ..io.files.atomic_write import check_replaceable

    allowed = (suffix,) if isinstance(suffix, str) else suffix
    if path == Path():
        raise OutputError(
            f"the name of the output is empty or '.', which is a folder; write for example flare{allowed[0]}"
        )
    if path.is_dir():
        raise OutputError(
            f"cannot write {path}: it is a folder; give a file name, for example {path / 'flare'}{allowed[0]}"
        )
    if path.suffix == "" and path.name.lower() in allowed:
        raise OutputError(
            f"the output {str(path)!r} is an ending without a name; write {path.with_name('flare' + path.name)}"
        )
    if path.suffix.lower() not in allowed:
        raise OutputError(f"the output {str(path)!r} must be named *{' or *'.join(allowed)}")
    check_replaceable(path)
    if path.parent.exists() and not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: {path.parent} is a file, not a folder; choose another place")
    if not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: the folder {path.parent} does not exist; create it first")


def check_rate(fps: float | None) -> None:
    """Raise ProjectError for a number of `--fps` that is no frame rate."""
    if fps is not None and not 0.01 <= fps <= 1000.0:
        raise ProjectError(f"--fps {fps:g} is no frame rate: give a number from 0.01 to 1000, such as 24 or 23.976")


def check_free(path: Path, force: bool) -> None:
    """Raise an error if an output would replace a file without --force.

    Parameters
    ----------
    path : path
    force : bool
        The command's --force.

    Raises
    ------
    OutputError
        When the file exists already.
    """
    if path.exists() and not force:
        raise OutputError(f"{path} exists already; choose another name, or replace it with --force")


def console() -> Console:
    """Return the console for tables: as wide as the terminal, or 140 columns in a file or pipe."""
    from rich.console import Console

    return Console(markup=False, highlight=False, width=None if sys.stdout.isatty() else 140)


@contextmanager
def search_status() -> Iterator[Report | None]:
    """Show a changing line about a search on a terminal; yield what changes it, None if not on a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.status import Status

    with Status("searching", console=Console(stderr=True)) as status:
        yield status.update


def focal_text(record: LensRecord) -> str:
    """Return the focal length of a lens, or the range of a zoom, in mm."""
    low, high = record.efl_range_mm
    return f"{low:.1f}-{high:.1f}" if high > 1.001 * low else f"{record.efl_mm:.1f}"


def chosen_fstop(f_number: float | None) -> float | None:
    """Return the f-number of `--fstop`, checked.

    Raises
    ------
    FlarewrightError
        When it is outside the range of f-numbers.
    """
    from ..model.lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER

    if f_number is not None and not LEAST_F_NUMBER < f_number <= LARGEST_F_NUMBER:
        raise FlarewrightError(
            f"--fstop {f_number:g} is no f-number of a lens; choose one between {LEAST_F_NUMBER:g} and "
            f"{LARGEST_F_NUMBER:g}"
        )
    return f_number


def write_text(output: Path, text: str) -> None:
    """Write a text file in UTF-8, atomically."""
    from ..io.files.atomic_write import write_text_atomically

    write_text_atomically(output, text)


@contextmanager
def remembered(cache: Path | None, output: Path | None = None, unnamed: str = "") -> Iterator[dict[str, Any]]:
    """Load pictures of earlier runs from a file, and store them with new ones every 10 s and at the end of the block.

    A cache that is damaged or cannot be written does not end the run.

    Parameters
    ----------
    cache : path or None
        File of the pictures. None: they are stored beside the output (NAME.partial.npz) for a run that resumes after
        an interruption; the end of the block deletes that file.
    output : path or None
        None: they are stored in the state folder.
    unnamed : str
        Identifies the command, so that the same one finds them there.
    """
    kept = cache or (unnamed_file(unnamed) if output is None else output.with_suffix(".partial.npz"))
    from ..io.render_state.flare_cache import read_cache, write_cache

    memory = read_cache(kept, print_remark) if kept.exists() else {}
    stored = sum(map(len, memory.values()))
    if cache is None and stored:
        print_remarks([f"{kept}: resuming with {stored} pictures of an interrupted run"])

    def store() -> None:
        nonlocal stored
        # the work adds pictures meanwhile
        drawn = {fingerprint: dict(pictures) for fingerprint, pictures in list(memory.items())}
        if (number := sum(map(len, drawn.values()))) > stored:
            write_cache(kept, drawn)
            stored = number

    with kept_until_done(kept, store, print_remark, "the pictures", lasting=cache is not None):
        yield memory


@contextmanager
def progress_bar() -> Iterator[Callable[[str], Progress]]:
    """Show progress as bars with an estimate of the remaining time, on a terminal.

    Yields
    ------
    callable
        Starts the bar of a named part of the work, and returns a function to call with the finished fraction (0 to 1)
        and a description.
    """
    if not sys.stderr.isatty():
        yield lambda _name: lambda _part, _words: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:

        def begin(name: str) -> Progress:
            task = bars.add_task(name, total=1.0)
            return lambda part, words: bars.update(task, completed=part, description=f"{name}: {words}")

        yield begin


@contextmanager
def one_bar(name: str) -> Iterator[Progress | None]:
    """Show one `progress_bar` with a name; yield None if not on a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    with progress_bar() as begin:
        yield begin(name)


first_run_bar = partial(one_bar, "first run")
"""Bar of the compilation of a first run."""


def ending_signals() -> list[signal.Signals]:
    """Return the signals that end a command as Ctrl-C does, without those that the caller ignores (`nohup`)."""
    known = (getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP"))
    return [one for one in known if one is not None and signal.getsignal(one) is not signal.SIG_IGN]


# signals that asked this process to end
_received: list[int] = []


def end_as_interrupted() -> None:
    """Make a closed terminal and a polite kill end this process as Ctrl-C does: partial work is kept."""
    for one in ending_signals():
        signal.signal(one, _interrupt)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    signal.default_int_handler(number, frame)


def was_interrupted() -> bool:
    """Return whether a signal has asked this process to end.

    A call from C may swallow the KeyboardInterrupt, so that a kernel is not compiled, or report it as an ImportError.
    """
    return bool(_received)


def end_at_once() -> None:
    """Let signals end this process without a word: its work is done, and Python would print where its exit was."""
    for one in ending_signals():
        signal.signal(one, signal.SIG_DFL)


@contextmanager
def stop_on_interrupt() -> Iterator[Callable[[], bool]]:
    """Convert Ctrl-C, SIGTERM and SIGHUP to a flag that a search checks after each round."""
    asked: list[bool] = []

    def note(*_: Any) -> None:
        asked.append(True)

    try:
        before = {one: signal.signal(one, note) for one in ending_signals()}
    except ValueError:
        # not the main thread, which receives no signals
        yield lambda: False
        return
    try:
        yield lambda: bool(asked)
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
