"""What several commands share: reading their short texts, telling things, printing JSON."""

from __future__ import annotations

import json
import math
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FlarewrightError, OutputError, ProjectError

if TYPE_CHECKING:
    from rich.console import Console

    from ..optics.repair import Apertures

APERTURES_HELP = "Read the last column of .lens tables as diameters or semi-diameters; left out: as the f-number says."


def pair(text: str, flag: str, example: str, separator: str = ",") -> tuple[float, float]:
    """Return the two numbers of a text like "10,5" or "36x24".

    Parameters
    ----------
    text : str
    flag, example : str
        For the message.
    separator : str

    Returns
    -------
    tuple of float

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


def picture_size(text: str) -> tuple[int, int]:
    """Return the width and height of `--size WxH` in pixels.

    Raises
    ------
    ProjectError
        When they are not whole numbers from 1 to 65536.
    """
    width, height = pair(text, "--size", "1280x720", "x")
    if not (width.is_integer() and height.is_integer() and 1 <= width <= 65536 and 1 <= height <= 65536):
        raise ProjectError(f"--size {text!r} is not two whole numbers of pixels up to 65536; write --size 1280x720")
    return int(width), int(height)


def tell(remarks: Iterable[str]) -> None:
    """Print remarks to stderr, one a line."""
    for remark in remarks:
        print(f"flarewright: {remark}", file=sys.stderr)


def aperture_reading(text: str | None) -> Apertures:
    """Return how `--apertures` has the last column of a `.lens` table read."""
    match text:
        case None:
            return "auto"
        case "diameters" | "semi-diameters":
            return text
    raise ProjectError(f"--apertures {text!r} is unknown; choose diameters or semi-diameters")


def print_json(data: dict[str, Any]) -> None:
    """Print one JSON object to stdout; numbers that JSON cannot hold become null."""
    print(json.dumps(_finite(data), indent=2, allow_nan=False))


def refusal(file: str | Path, error: FlarewrightError) -> dict[str, Any]:
    """Return what `--json` prints of a file that cannot be used."""
    return {"file": str(file), "usable": False, "reason": str(error), "problems": list(error.problems) or [str(error)]}


@contextmanager
def refused_as_json(file: Path, wanted: bool) -> Iterator[None]:
    """Print as one JSON object too why a file is refused, where that is wanted; the error goes on."""
    try:
        yield
    except FlarewrightError as error:
        if wanted:
            print_json(refusal(file, error))
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
    """Refuse an output that could not be written before the work is done, not after.

    Parameters
    ----------
    path : path
    suffix : str or tuple of str
        How the name may end.

    Raises
    ------
    OutputError
        When the name is empty or ends otherwise than in `suffix`, its folder does not exist, or it is a folder itself.
    """
    allowed = (suffix,) if isinstance(suffix, str) else suffix
    if path == Path():
        raise OutputError(f"the name of the output is empty or '.', which is a folder; write flare{allowed[0]}, say")
    if path.is_dir():
        raise OutputError(f"cannot write {path}: it is a folder; give a file name, {path / 'flare'}{allowed[0]} say")
    if path.suffix == "" and path.name.lower() in allowed:
        raise OutputError(
            f"the output {str(path)!r} is an ending without a name; write {path.with_name('flare' + path.name)}"
        )
    if path.suffix.lower() not in allowed:
        raise OutputError(f"the output {str(path)!r} must be named *{' or *'.join(allowed)}")
    if path.parent.exists() and not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: {path.parent} is a file and no folder; choose another place")
    if not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: the folder {path.parent} does not exist; create it first")


def check_free(path: Path, force: bool) -> None:
    """Refuse to replace a file that a person may have written, unless asked to.

    Parameters
    ----------
    path : path
    force : bool
        The command's --force.

    Raises
    ------
    OutputError
        When there is something of this name already.
    """
    if path.exists() and not force:
        raise OutputError(f"{path} exists already; choose another name, or replace it with --force")


def console() -> Console:
    """Return where tables go: the terminal's width, or 140 columns in a file or pipe."""
    from rich.console import Console

    return Console(markup=False, highlight=False, width=None if sys.stdout.isatty() else 140)


def chosen_fstop(f_number: float | None) -> float | None:
    """Return the f-number of `--fstop`, checked.

    Raises
    ------
    FlarewrightError
        When it is no possible f-number.
    """
    from ..model.lens import LARGEST_F_NUMBER, LEAST_F_NUMBER

    if f_number is not None and not LEAST_F_NUMBER < f_number <= LARGEST_F_NUMBER:
        raise FlarewrightError(
            f"--fstop {f_number:g} is no f-number of a lens; choose one between {LEAST_F_NUMBER:g} and "
            f"{LARGEST_F_NUMBER:g}"
        )
    return f_number


def write_text(output: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    from ..io.atomic import write_atomically

    def write(temporary: Path) -> None:
        temporary.write_text(text, "utf-8")

    write_atomically(output, write)


@contextmanager
def remembered(cache: Path | None, output: Path | None = None) -> Iterator[dict[str, Any]]:
    """Read pictures drawn before from a file, and keep them and new ones there, after an interruption too.

    Parameters
    ----------
    cache : path or None
        Where they stay. None: an interrupted run leaves them beside its output (NAME.partial.npz), where the next run
        finds them; it takes them away when it has ended.
    output : path or None
    """
    partial = None if output is None else output.with_suffix(".partial.npz")
    kept = cache or partial
    if kept is None:
        yield {}
        return
    from ..io.flare_cache import read_cache, write_cache

    memory = read_cache(kept) if kept.exists() else {}
    before = sum(map(len, memory.values()))
    if cache is None and before:
        tell([f"{kept}: goes on with {before} pictures that an interrupted run had drawn"])
    done = False
    try:
        yield memory
        done = True
    finally:
        if cache is None and done:
            kept.unlink(missing_ok=True)
        elif sum(map(len, memory.values())) > before:
            write_cache(kept, memory)


@contextmanager
def progress_bar() -> Iterator[Callable[[str], Callable[[float, str], None]]]:
    """Show work as bars with an estimate of the time left, where someone looks at it.

    Yields
    ------
    callable
        Begins the bar of a named part of the work, and returns what is called with the finished part (0 to 1) and what
        was finished.
    """
    if not sys.stderr.isatty():
        yield lambda _name: lambda _part, _words: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:

        def begin(name: str) -> Callable[[float, str], None]:
            task = bars.add_task(name, total=1.0)
            return lambda part, words: bars.update(task, completed=part, description=f"{name}: {words}")

        yield begin


@contextmanager
def first_run_bar() -> Iterator[Callable[[float, str], None] | None]:
    """Show a first run's compiling as a `progress_bar`; yields None off a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    with progress_bar() as begin:
        yield begin("first run")


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Turn Ctrl-C into a wish to end, which the search hears after its round."""
    asked: list[bool] = []

    def note(*_: Any) -> None:
        asked.append(True)

    try:
        before = signal.signal(signal.SIGINT, note)
    except ValueError:
        # not the main thread: nobody presses Ctrl-C here
        yield lambda: False
        return
    try:
        yield lambda: bool(asked)
    finally:
        signal.signal(signal.SIGINT, before)
