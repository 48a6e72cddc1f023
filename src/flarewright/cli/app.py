"""Run a command line: errors and exit codes. Commands import their modules when they run, so that help is instant."""

from __future__ import annotations

import errno
import gc
import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from mmap import mmap
from typing import Any

import typer

from ..errors import FlarewrightError
from ..jobs.one_heap import share_one_heap
from ..kernels.jit.warmup_processes import head_start
from .command_tree import BARE_GROUPS, command_tree
from .common import end_as_interrupted, end_at_once, was_interrupted

# messages of older releases of Typer on option values
_TYPES = {"is not a valid float": "is no number", "is not a valid integer": "is no whole number"}
# what the loader of libraries and the interpreter report if there is no memory for a library or for a thread's stack
_NO_MEMORY = ("failed to map segment", "cannot allocate memory", "can't start new thread")
# memory that a process can always have unless it is at its limit
_SPARE_BYTES = 64_000_000
# largest number of errors of a file that are listed
_REPORTED = 20


def main() -> None:
    """Run the program with the arguments of the process, and exit."""
    # imported objects live until the end, so exclude them from garbage collection
    gc.set_threshold(100_000)
    share_one_heap()
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr = _lossy(sys.stderr)
    end_as_interrupted()
    try:
        code = run(sys.argv[1:])
    finally:
        end_at_once()
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : sequence of str
        Without the program's name.

    Returns
    -------
    int
        Exit code: 0 success, 2 an error with one sentence on stderr, 130 interrupted.
    """
    _open_closed_streams()
    _check_threads()
    for stream in (sys.stdout, sys.stderr):
        # A terminal without UTF-8 shows a question mark instead of failing.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    words = list(arguments)
    if not words or (len(words) == 1 and words[0] in BARE_GROUPS):
        if not words:
            _show_gallery()
        words.append("--help")
    try:
        with head_start(_rings(words)) if _traces(words) else nullcontext():
            code = _call(words)
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        # The reader of the output has exited (`| head`); the interpreter's last flush must not fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _open_closed_streams() -> None:
    """Discard the output of streams that the caller has closed (`2>&-`): Python has no object for them."""
    for number, name in ((1, "stdout"), (2, "stderr")):
        if getattr(sys, name) is None:
            with suppress(OSError):
                # occupies the number, or the next file that is opened would receive what libraries print
                if (null := os.open(os.devnull, os.O_WRONLY)) != number:
                    os.dup2(null, number)
                    os.close(null)
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - stays open


class _LossyFile(io.FileIO):
    """A file that drops what the system does not accept."""

    def write(self, data: Any, /) -> int:
        """Write bytes, or drop them."""
        try:
            return super().write(data)
        except OSError:
            return len(data)


def _lossy(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    """Return a stream of remarks to the same file: a log on a full disk, or a closed pipe, ends no job of hours."""
    raw = _LossyFile(stream.fileno(), "w", closefd=False)
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding=stream.encoding, errors="replace", line_buffering=True)


def _check_threads() -> None:
    """Remove a number of threads that Numba cannot read, with one sentence instead of a warning with its source."""
    text = os.environ.get("NUMBA_NUM_THREADS")
    if text is not None and not (text.strip().isdecimal() and int(text) > 0):
        del os.environ["NUMBA_NUM_THREADS"]
        print(f"flarewright: NUMBA_NUM_THREADS is {text[:120]!r}, no whole number above 0: ignored", file=sys.stderr)


def _show_gallery() -> None:
    """Write the gallery of shipped pictures and print its address; do nothing if it cannot be written."""
    from ..io.files.state_folder import state_folder
    from . import gallery

    with suppress(FlarewrightError, OSError):
        page = gallery.shipped_gallery(state_folder() / "gallery")
        print(f"flarewright: pictures of every lens and look: {page.as_uri()}", file=sys.stderr)


def _traces(words: Sequence[str]) -> bool:
    """Return whether a command traces rays on all cores."""
    return words[0] in ("render", "ghosts") and not {"-h", "--help", "--threads"} & set(words)


def _rings(words: Sequence[str]) -> bool:
    """Return whether a command certainly draws rings in ghosts: a final render, stopped down by blades."""
    flags = {word.split("=")[0] for word in words}
    others = {"--quality", "--ringing", "--iris-image", "--project"}
    return words[0] == "render" and "--fstop" in flags and not others & flags


def _call(words: list[str]) -> int:
    """Convert every expected end of a command to an exit code, with one sentence on stderr."""
    try:
        with _hiding_interrupts():
            code: Any = command_tree(words)(args=words, prog_name="flarewright", standalone_mode=False)
    except FlarewrightError as error:
        return _fail(str(error), getattr(error, "problems", ()))
    except KeyboardInterrupt:
        code = 130
    except typer.Abort as error:
        # Typer turns an EOFError of any call into this; no command asks questions, so it is a bug
        if isinstance(error.__cause__, EOFError):
            raise error.__cause__ from None
        code = 130
    except MemoryError:
        return _fail(_no_memory(words))
    except BrokenPipeError:
        raise
    except OSError as error:
        if _lacks_memory(error):
            return _fail(_no_memory(words))
        return _fail(_system_sentence(error))
    except SystemExit as end:
        # Typer's own answer to a broken pipe.
        if end.code == 1:
            raise BrokenPipeError from end
        raise
    except Exception as error:
        # Usage errors come from Typer's copy of click or from click itself, by version; both have a message.
        if hasattr(error, "format_message"):
            # an error of ours cuts long input
            return _fail(str(FlarewrightError(_usage(error))))
        if isinstance(error, ImportError | RuntimeError) and _lacks_memory(error):
            return _fail(_no_memory(words))
        # the interpreter's own word for a call from C that failed without a reason
        if isinstance(error, SystemError) and _memory_is_used_up():
            return _fail(_no_memory(words))
        if not was_interrupted():
            raise
        code = 130
    if code == 130:
        print(f"flarewright: interrupted; nothing was left half-written{_resuming(words)}", file=sys.stderr)
    return code if isinstance(code, int) else 0


def _system_sentence(error: OSError) -> str:
    """Return the sentence on what the system refuses; a full disk without the name of a file is that of stdout."""
    reason = (error.strerror or str(error)).lower()
    if error.filename is None and error.errno == errno.ENOSPC:
        return f"cannot write the output: {reason}; free some space, or write it elsewhere"
    return f"{str(error.filename)[:200]}: {reason}" if error.filename else reason


@contextmanager
def _hiding_interrupts() -> Iterator[None]:
    """Print no Ctrl-C that a call from C swallows because Python cannot raise it: `was_interrupted` knows of it."""
    hook = sys.unraisablehook

    def report(one: sys.UnraisableHookArgs) -> None:
        if one.exc_type is not KeyboardInterrupt:
            hook(one)

    sys.unraisablehook = report
    try:
        yield
    finally:
        sys.unraisablehook = hook


def _resuming(words: Sequence[str]) -> str:
    """Return the end of the sentence on an interruption: how the command resumes."""
    from ..workflow.long_jobs import SAME, job_of

    job = job_of(words)
    return "" if job is None or job.resume != SAME else ", and the same command resumes"


def _lacks_memory(error: BaseException | None) -> bool:
    """Return whether an error, or what caused it, is a lack of memory: llvmlite reports a missing file instead."""
    while error is not None:
        if any(sign in str(error).lower() for sign in _NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def _memory_is_used_up() -> bool:
    """Return whether the system gives this process no more memory than what the start of a command needs."""
    try:
        # not from what the process has freed
        mmap(-1, _SPARE_BYTES).close()
    except (MemoryError, OSError):
        return True
    return False


def _no_memory(words: Sequence[str]) -> str:
    return f"there is not enough memory for this; {_memory_advice(words)}"


def _memory_advice(words: Sequence[str]) -> str:
    """Return advice on how to use less memory."""
    match list(words[:2]):
        case ["measure", "replay"]:
            return "choose a smaller --size, or leave --ghosts out"
        case ["measure", "run" | "merge"]:
            return "choose a larger --block, which makes smaller frames"
        case ["measure", _]:
            return "merge again with a larger --block, which makes smaller frames"
        case ["dataset", *_]:
            return "choose fewer --processes, or a smaller size_px in the specification"
        case ["shot", *_]:
            return "choose fewer --processes or a smaller --size"
        case ["render", *_]:
            return "choose a smaller --size or fewer layers (--brightest 20)"
    return "close other programs, or choose a smaller picture"


def _usage(error: Any) -> str:
    message = " ".join(str(error.format_message()).split()).rstrip(".")
    message = message[:1].lower() + message[1:]
    cause = error.__cause__
    if hasattr(cause, "errors"):
        # newer releases of Typer validate values with pydantic
        from ..sentences import validation_sentences

        message = f"{message.partition(': ')[0]}: {validation_sentences(cause)[0]}"
    for theirs, ours in _TYPES.items():
        message = message.replace(theirs, ours)
    context = getattr(error, "ctx", None)
    option = str(getattr(error, "option_name", "")).removeprefix("--")
    for one in context.command.params if context else ():
        if option and one.param_type_name == "argument" and option == one.name:
            message = f"{one.metavar or one.name.upper()} is written without --{option}"
    return f"{message}; see {context.command_path if context else 'flarewright'} --help"


def _fail(message: str, problems: Sequence[str] = ()) -> int:
    print(f"flarewright: error: {' '.join(message.split())}", file=sys.stderr)
    if len(problems) > 1:
        for problem in problems[:_REPORTED]:
            print(f"  - {problem}", file=sys.stderr)
        if len(problems) > _REPORTED:
            print(f"  - and {len(problems) - _REPORTED} more", file=sys.stderr)
    return 2
