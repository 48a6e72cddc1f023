"""The command tree: which function runs each command. A command line imports the modules of its first word only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Annotated

import typer

from .. import __version__
from .option_words import name_values


@dataclass(frozen=True)
class Command:
    """A command.

    Attributes
    ----------
    words : str
        Its name, after that of its group; the name of a group alone is the command that a group without another runs.
    module, function : str
        Where it is, below this package.
    epilog : str
        Name of the module's text below its help page; "" for none.
    """

    words: str
    module: str
    function: str
    epilog: str = "EPILOG"


GROUPS = {
    "lens": "Show, check and convert lens files.",
    "library": "Your own library of lenses: add files, search, use them by name.",
    "looks": "Looks: coatings, iris, dirt and colours together, for any lens and light.",
    "coating": "List standard coatings, and plot the reflectance of any coating.",
    "project": "Project files: everything a render needs, in one TOML file.",
    "scene": "Scene files: cameras and lights in space, for `flarewright predict`.",
    "design": "Search lenses for a target flare.",
    "measure": "Measure a real camera's flare and replay it.",
}
"""Names of groups and their help, in the order of the help page."""

COMMANDS = (
    Command("render", "render.command", "render"),
    Command("shot", "render.shot_command", "shot"),
    Command("film", "render.film_command", "film"),
    Command("nuke-script", "render.nuke_command", "nuke_script"),
    Command("dataset", "dataset", "dataset"),
    Command("sources", "render.sources_command", "sources"),
    Command("ghosts", "render.ghosts_command", "ghosts"),
    Command("predict", "predict.command", "predict"),
    Command("lenses", "lens.lenses", "lenses"),
    Command("cameras", "lens.cameras", "cameras"),
    Command("gallery", "gallery", "gallery"),
    Command("edit", "edit", "edit"),
    Command("warm-up", "warm_up", "warm_up"),
    Command("looks", "looks", "looks"),
    Command("looks save", "looks", "save", "SAVE_EPILOG"),
    Command("lens show", "lens.show", "show"),
    Command("lens check", "lens.check", "check"),
    Command("lens convert", "lens.convert", "convert"),
    Command("lens schema", "lens.schema", "schema", ""),
    Command("library add", "library.add", "add"),
    Command("library list", "library.listing", "listing"),
    Command("library search", "library.search", "search"),
    Command("library show", "library.show", "show"),
    Command("library remove", "library.remove", "remove"),
    Command("library thumbnails", "library.thumbnails", "thumbnails"),
    Command("coating list", "lens.coating_list", "listing"),
    Command("coating plot", "lens.coating_plot", "plot"),
    Command("project init", "project.init", "init"),
    Command("project check", "project.check", "check", ""),
    Command("project schema", "project.schema", "schema", ""),
    Command("scene init", "project.scene_init", "init"),
    Command("scene check", "project.scene_check", "check", ""),
    Command("scene schema", "project.scene_schema", "schema", ""),
    Command("design solve", "design.solve", "solve"),
    Command("design resume", "design.solve", "resume", ""),
    Command("design target", "design.target", "target"),
    Command("design scratch", "design.scratch", "scratch"),
    Command("design colors", "design.colors", "colors"),
    Command("design resize", "design.edit", "resize", ""),
    Command("design move-stop", "design.edit", "move_stop", ""),
    Command("design benchmark", "design.benchmark", "benchmark"),
    Command("design identify", "design.identify", "identify"),
    Command("measure run", "measure.run", "run", "RUN_EPILOG"),
    Command("measure merge", "measure.run", "merge_command", "MERGE_EPILOG"),
    Command("measure find", "measure.stages", "find", "FIND_EPILOG"),
    Command("measure fit", "measure.stages", "fit", "FIT_EPILOG"),
    Command("measure track", "measure.stages", "track", "TRACK_EPILOG"),
    Command("measure compress", "measure.stages", "compress", "COMPRESS_EPILOG"),
    Command("measure explain", "measure.explain", "explain"),
    Command("measure report", "measure.report", "report"),
    Command("measure replay", "measure.replay", "replay"),
)
"""All commands, in the order of the help pages."""

BARE_GROUPS = frozenset(GROUPS) - {command.words for command in COMMANDS}
"""Groups whose name alone runs no command."""


def command_tree(words: Sequence[str] = ()) -> typer.Typer:
    """Return the commands whose first word is that of a command line; all if there is none.

    Parameters
    ----------
    words : sequence of str
        A command line without the program's name.

    Returns
    -------
    Typer
    """
    app = typer.Typer(
        name="flarewright",
        help="Physical lens flare: choose a lens and a light, get a layered linear picture.",
        epilog="Start with: flarewright lenses\n\nThen: flarewright render takumar-50-f1.4 --light -9,5 -o flare.exr",
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_root)
    chosen = [command for command in COMMANDS if command.words.split()[:1] == list(words[:1])] or COMMANDS
    groups: dict[str, typer.Typer] = {}
    for command in chosen:
        module = import_module(f".{command.module}", __package__)
        run, epilog = getattr(module, command.function), getattr(module, command.epilog) if command.epilog else None
        first, *below = command.words.split()
        if first not in GROUPS:
            app.command(first, epilog=epilog)(run)
            continue
        group = groups.setdefault(first, typer.Typer(help=GROUPS[first]))
        if below:
            group.command(*below, epilog=epilog)(run)
        else:
            group.callback(invoke_without_command=True, epilog=epilog)(run)
    for name in GROUPS:
        if name in groups:
            app.add_typer(groups[name], name=name)
    name_values(app)
    return app


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"flarewright {__version__}")
        raise typer.Exit


def _root(
    version: Annotated[
        bool,
        typer.Option("--version", metavar="", callback=_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    del version  # The callback has printed it.
