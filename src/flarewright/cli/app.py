"""The command tree `flarewright COMMAND`. Commands import their modules when they run, so that help is instant."""

from __future__ import annotations

import errno
import gc
import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from mmap import mmap
from typing import Annotated, Any

import typer

from .. import __version__
from ..errors import FlarewrightError
from ..kernels.jit.warmup_processes import head_start
from . import dataset, edit, gallery, looks, warm_up
from .common import end_as_interrupted, end_at_once, was_interrupted
from .design import benchmark as design_benchmark
from .design import colors as design_colors
from .design import edit as design_edit
from .design import identify as design_identify
from .design import scratch as design_scratch
from .design import solve as design_solve
from .design import target as design_target
from .lens import cameras, coating_list, coating_plot, lenses
from .lens import check as lens_check
from .lens import convert as lens_convert
from .lens import schema as lens_schema
from .lens import show as lens_show
from .library import add as library_add
from .library import listing as library_list
from .library import remove as library_remove
from .library import search as library_search
from .library import show as library_show
from .library import thumbnails as library_thumbnails
from .measure import explain as measure_explain
from .measure import replay as measure_replay
from .measure import report as measure_report
from .measure import run as measure_run
from .measure import stages as measure_stages
from .option_words import name_values
from .predict import command as predict
from .project import check as project_check
from .project import init as project_init
from .project import scene_check, scene_init, scene_schema
from .project import schema as project_schema
from .render import command as render
from .render import film_command as film
from .render import ghosts_command as ghosts
from .render import nuke_command as nuke
from .render import shot_command as shot
from .render import sources_command as sources

# messages of older releases of Typer on option values
_TYPES = {"is not a valid float": "is no number", "is not a valid integer": "is no whole number"}
# what the loader of libraries and the interpreter report if there is no memory for a library or for a thread's stack
_NO_MEMORY = ("failed to map segment", "cannot allocate memory", "can't start new thread")
# memory that a process can always have unless it is at its limit
_SPARE_BYTES = 64_000_000
# largest number of errors of a file that are listed
_REPORTED = 20

app = typer.Typer(
    name="flarewright",
    help="Physical lens flare: choose a lens and a light, get a layered linear picture.",
    epilog="Start with: flarewright lenses\n\nThen: flarewright render takumar-50-f1.4 --light -9,5 -o flare.exr",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
lens_app = typer.Typer(help="Show, check and convert lens files.")
library_app = typer.Typer(help="Your own library of lenses: add files, search, use them by name.")
looks_app = typer.Typer(help="Looks: coatings, iris, dirt and colours together, for any lens and light.")
coating_app = typer.Typer(help="List standard coatings, and plot the reflectance of any coating.")
project_app = typer.Typer(help="Project files: everything a render needs, in one TOML file.")
scene_app = typer.Typer(help="Scene files: cameras and lights in space, for `flarewright predict`.")
design_app = typer.Typer(help="Search lenses for a target flare.")
measure_app = typer.Typer(help="Measure a real camera's flare and replay it.")

app.command("render", epilog=render.EPILOG)(render.render)
app.command("shot", epilog=shot.EPILOG)(shot.shot)
app.command("film", epilog=film.EPILOG)(film.film)
app.command("nuke-script", epilog=nuke.EPILOG)(nuke.nuke_script)
app.command("dataset", epilog=dataset.EPILOG)(dataset.dataset)
app.command("sources", epilog=sources.EPILOG)(sources.sources)
app.command("ghosts", epilog=ghosts.EPILOG)(ghosts.ghosts)
app.command("predict", epilog=predict.EPILOG)(predict.predict)
app.command("lenses", epilog=lenses.EPILOG)(lenses.lenses)
app.command("cameras", epilog=cameras.EPILOG)(cameras.cameras)
app.command("gallery", epilog=gallery.EPILOG)(gallery.gallery)
app.command("edit", epilog=edit.EPILOG)(edit.edit)
app.command("warm-up", epilog=warm_up.EPILOG)(warm_up.warm_up)
app.add_typer(lens_app, name="lens")
app.add_typer(library_app, name="library")
app.add_typer(looks_app, name="looks")
looks_app.callback(invoke_without_command=True, epilog=looks.EPILOG)(looks.looks)
looks_app.command("save", epilog=looks.SAVE_EPILOG)(looks.save)
app.add_typer(coating_app, name="coating")
app.add_typer(project_app, name="project")
app.add_typer(scene_app, name="scene")
app.add_typer(design_app, name="design")
app.add_typer(measure_app, name="measure")
lens_app.command("show", epilog=lens_show.EPILOG)(lens_show.show)
lens_app.command("check", epilog=lens_check.EPILOG)(lens_check.check)
lens_app.command("convert", epilog=lens_convert.EPILOG)(lens_convert.convert)
lens_app.command("schema")(lens_schema.schema)
library_app.command("add", epilog=library_add.EPILOG)(library_add.add)
library_app.command("list", epilog=library_list.EPILOG)(library_list.listing)
library_app.command("search", epilog=library_search.EPILOG)(library_search.search)
library_app.command("show", epilog=library_show.EPILOG)(library_show.show)
library_app.command("remove", epilog=library_remove.EPILOG)(library_remove.remove)
library_app.command("thumbnails", epilog=library_thumbnails.EPILOG)(library_thumbnails.thumbnails)
coating_app.command("list", epilog=coating_list.EPILOG)(coating_list.listing)
coating_app.command("plot", epilog=coating_plot.EPILOG)(coating_plot.plot)
project_app.command("init", epilog=project_init.EPILOG)(project_init.init)
project_app.command("check")(project_check.check)
project_app.command("schema")(project_schema.schema)
scene_app.command("init", epilog=scene_init.EPILOG)(scene_init.init)
scene_app.command("check")(scene_check.check)
scene_app.command("schema")(scene_schema.schema)

design_app.command("solve", epilog=design_solve.EPILOG)(design_solve.solve)
design_app.command("resume")(design_solve.resume)
design_app.command("target", epilog=design_target.EPILOG)(design_target.target)
design_app.command("scratch", epilog=design_scratch.EPILOG)(design_scratch.scratch)
design_app.command("colors", epilog=design_colors.EPILOG)(design_colors.colors)
design_app.command("resize")(design_edit.resize)
design_app.command("move-stop")(design_edit.move_stop)
design_app.command("benchmark", epilog=design_benchmark.EPILOG)(design_benchmark.benchmark)
design_app.command("identify", epilog=design_identify.EPILOG)(design_identify.identify)
measure_app.command("run", epilog=measure_run.RUN_EPILOG)(measure_run.run)
measure_app.command("merge", epilog=measure_run.MERGE_EPILOG)(measure_run.merge_command)
measure_app.command("find", epilog=measure_stages.FIND_EPILOG)(measure_stages.find)
measure_app.command("fit", epilog=measure_stages.FIT_EPILOG)(measure_stages.fit)
measure_app.command("track", epilog=measure_stages.TRACK_EPILOG)(measure_stages.track)
measure_app.command("compress", epilog=measure_stages.COMPRESS_EPILOG)(measure_stages.compress)
measure_app.command("explain", epilog=measure_explain.EPILOG)(measure_explain.explain)
measure_app.command("report", epilog=measure_report.EPILOG)(measure_report.report)
measure_app.command("replay", epilog=measure_replay.EPILOG)(measure_replay.replay)
name_values(app)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"flarewright {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", metavar="", callback=_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    del version  # The callback has printed it.


def main() -> None:
    """Run the program with the arguments of the process, and exit."""
    # imported objects live until the end, so exclude them from garbage collection
    gc.set_threshold(100_000)
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
    if words in ([], ["lens"], ["library"], ["coating"], ["project"], ["scene"], ["design"], ["measure"]):
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
            code: Any = app(args=words, prog_name="flarewright", standalone_mode=False)
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
