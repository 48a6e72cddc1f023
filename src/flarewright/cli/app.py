"""The command line: `flarewright COMMAND`. Commands import what they need when they run, so that help is instant."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from typing import Annotated, Any

import typer

from .. import __version__
from ..errors import FlarewrightError
from ..kernels.helpers import head_start
from . import (
    coating_list,
    coating_plot,
    design_benchmark,
    design_colors,
    design_edit,
    design_identify,
    design_scratch,
    design_solve,
    design_target,
    edit,
    gallery,
    ghosts,
    lens_check,
    lens_convert,
    lens_schema,
    lens_show,
    lenses,
    looks,
    measure_explain,
    measure_replay,
    measure_report,
    measure_run,
    measure_stages,
    predict,
    project_check,
    project_init,
    project_schema,
    render,
    scene_check,
    scene_init,
    scene_schema,
    warm_up,
)
from .option_words import name_values

# what older releases of Typer say of a value
_TYPES = {"is not a valid float": "is no number", "is not a valid integer": "is no whole number"}
# of a file's mistakes so many are listed
_TOLD = 20

app = typer.Typer(
    name="flarewright",
    help="Lens flare as physics: choose a lens, say where the light is, get a layered linear picture.",
    epilog="Begin with: flarewright lenses\n\nThen: flarewright render takumar-50-f1.4 --light -9,5 -o flare.exr",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
lens_app = typer.Typer(help="Look at, check and convert lens files.")
looks_app = typer.Typer(help="Looks: coatings, iris, dirt and colours together, for any lens and light.")
coating_app = typer.Typer(help="Look at coatings: the standard ones, and what any coating reflects.")
project_app = typer.Typer(help="Project files: everything a render needs, in one TOML file.")
scene_app = typer.Typer(help="Scene files: cameras and lights in space, for `flarewright predict`.")
design_app = typer.Typer(help="Search a lens for the flare you want.")
measure_app = typer.Typer(help="Measure a real camera's flare and replay it.")

app.command("render", epilog=render.EPILOG)(render.render)
app.command("ghosts", epilog=ghosts.EPILOG)(ghosts.ghosts)
app.command("predict", epilog=predict.EPILOG)(predict.predict)
app.command("lenses", epilog=lenses.EPILOG)(lenses.lenses)
app.command("gallery", epilog=gallery.EPILOG)(gallery.gallery)
app.command("edit", epilog=edit.EPILOG)(edit.edit)
app.command("warm-up", epilog=warm_up.EPILOG)(warm_up.warm_up)
app.add_typer(lens_app, name="lens")
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
measure_app.command("merge", epilog=measure_run.MERGE_EPILOG)(measure_run.merge)
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
        bool, typer.Option("--version", metavar="", callback=_version, is_eager=True, help="Tell it and end.")
    ] = False,
) -> None:
    del version  # The callback has told it.


def main() -> None:
    """Run the program with the arguments of the process, and end it."""
    # what imports make lives until the end: looking through it for garbage again and again finds none
    gc.set_threshold(100_000)
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """Run one command.

    Parameters
    ----------
    arguments : sequence of str
        Without the program's name.

    Returns
    -------
    int
        Exit code: 0 done, 2 a mistake that was told in one sentence on stderr, 130 interrupted.
    """
    for stream in (sys.stdout, sys.stderr):
        # A terminal without UTF-8 shows a question mark; it is no reason to fail.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    words = list(arguments)
    if words in ([], ["lens"], ["coating"], ["project"], ["scene"], ["design"], ["measure"]):
        if not words:
            _show_gallery()
        words.append("--help")
    try:
        with head_start(_rings(words)) if _traces(words) else nullcontext():
            code = _call(words)
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        # Whoever read our output went away (`| head`); the interpreter's last flush must not complain again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _show_gallery() -> None:
    """Lay out the pictures that ship, and say where; without a place for them the help says enough."""
    from ..io.state_folder import state_folder

    with suppress(FlarewrightError, OSError):
        page = gallery.shipped_gallery(state_folder() / "gallery")
        print(f"flarewright: pictures of every lens and look: {page.as_uri()}", file=sys.stderr)


def _traces(words: Sequence[str]) -> bool:
    """Tell whether a command is one that traces rays, on as many cores as there are."""
    return words[0] in ("render", "ghosts") and not {"-h", "--help", "--threads"} & set(words)


def _rings(words: Sequence[str]) -> bool:
    """Tell whether a command surely draws rings in ghosts: a render of final quality, stopped down by blades."""
    flags = {word.split("=")[0] for word in words}
    others = {"--quality", "--ringing", "--iris-image", "--project"}
    return words[0] == "render" and "--fstop" in flags and not others & flags


def _call(words: list[str]) -> int:
    """Turn every expected end of a command into an exit code, with its one sentence."""
    swallowed: list[object] = []
    try:
        with _keeping_interrupts(swallowed):
            code: Any = app(args=words, prog_name="flarewright", standalone_mode=False)
    except FlarewrightError as error:
        return _fail(str(error), getattr(error, "problems", ()))
    except (KeyboardInterrupt, typer.Abort):
        code = 130
    except MemoryError:
        return _fail(f"there is not enough memory for this; {_smaller(words)}")
    except BrokenPipeError:
        raise
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _fail(f"{where}{error.strerror or error}")
    except SystemExit as end:
        # Typer's own answer to a broken pipe.
        if end.code == 1:
            raise BrokenPipeError from end
        raise
    except Exception as error:
        # Usage errors come from Typer's copy of click or from click itself, by version; both can tell their message.
        if hasattr(error, "format_message"):
            return _fail(_usage(error))
        if not swallowed:
            raise
        code = 130
    if code == 130:
        more = ", and the same command goes on where it was" if _goes_on(words) else ""
        print(f"flarewright: interrupted; nothing was left half-written{more}", file=sys.stderr)
    return code if isinstance(code, int) else 0


@contextmanager
def _keeping_interrupts(swallowed: list[object]) -> Iterator[None]:
    """Note every Ctrl-C that ends in a call from C, where none goes on: a kernel that compiled is then left undone."""
    hook = sys.unraisablehook

    def note(one: sys.UnraisableHookArgs) -> None:
        if one.exc_type is KeyboardInterrupt:
            swallowed.append(one.exc_type)
        else:
            hook(one)

    sys.unraisablehook = note
    try:
        yield
    finally:
        sys.unraisablehook = hook


def _goes_on(words: Sequence[str]) -> bool:
    """Tell whether a command that was stopped goes on where it was when it is given again."""
    match list(words[:2]):
        case ["measure", "run" | "merge" | "find" | "fit" | "track" | "compress"]:
            return True
        case ["predict", *_]:
            flags = {word.split("=")[0] for word in words}
            # what was drawn is kept beside the page until all is drawn; veiling glare comes after that
            return "--cache" in flags or (bool({"-o", "--output"} & flags) and "--glare" not in flags)
    return False


def _smaller(words: Sequence[str]) -> str:
    """Say what takes less memory."""
    match list(words[:2]):
        case ["measure", "replay"]:
            return "choose a smaller --size, or leave --ghosts out"
        case ["measure", "run" | "merge"]:
            return "choose a larger --block, which makes smaller frames"
        case ["measure", _]:
            return "merge again with a larger --block, which makes smaller frames"
        case ["render", *_]:
            return "choose a smaller --size or fewer layers (--brightest 20)"
    return "close other programs, or choose a smaller picture"


def _usage(error: Any) -> str:
    message = " ".join(str(error.format_message()).split()).rstrip(".")
    message = message[:1].lower() + message[1:]
    cause = error.__cause__
    if hasattr(cause, "errors"):
        # newer releases of Typer check values as records of files are checked
        from ..io.sentences import validation_sentences

        message = f"{message.partition(': ')[0]}: {validation_sentences(cause)[0]}"
    for theirs, ours in _TYPES.items():
        message = message.replace(theirs, ours)
    context = getattr(error, "ctx", None)
    return f"{message}; see {context.command_path if context else 'flarewright'} --help"


def _fail(message: str, problems: Sequence[str] = ()) -> int:
    print(f"flarewright: error: {' '.join(message.split())}", file=sys.stderr)
    if len(problems) > 1:
        for problem in problems[:_TOLD]:
            print(f"  - {problem}", file=sys.stderr)
        if len(problems) > _TOLD:
            print(f"  - and {len(problems) - _TOLD} more", file=sys.stderr)
    return 2
