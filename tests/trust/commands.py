"""All commands of the program with the smallest arguments that let each one work."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_type_hints

import typer
from typer.models import ArgumentInfo, OptionInfo

from flarewright.cli.command_tree import command_tree
from flarewright.cli.option_words import types_within

SMALL = ("--threads", "1")

# FLARE.exr and the like are made by `prepared`
ARGUMENTS: dict[str, tuple[str, ...]] = {
    "render": ("tessar-brendel", "--light", "5,3", "--size", "32x18", "--quality", "draft", "-o", "out.exr", "--json"),
    "shot": (
        "--project",
        "shot.toml",
        "--frames",
        "1",
        "--quality",
        "draft",
        "--size",
        "32x18",
        "--processes",
        "1",
        "-o",
        "out.####.exr",
        "--json",
    ),
    "film": ("matte.####.png", "-o", "new.mp4", "--json"),
    "nuke-script": ("flare.exr", "-o", "flare.nk", "--json"),
    "dataset": ("pairs.toml", "-n", "1", "-o", "pairs", "--processes", "1", "--json"),
    "sources": ("flare.exr", "--json"),
    "ghosts": ("tessar-brendel", "--light", "5,3", "--json"),
    "predict": ("tessar-brendel", "--samples", "5", "--quality", "draft", "--json"),
    "lenses": (),
    "cameras": ("--json",),
    "gallery": ("-o", "gallery", "--size", "32x18"),
    "lens show": ("tessar-brendel", "--json"),
    "lens check": ("lens.toml", "--json"),
    "lens convert": ("lens.toml", "copy.toml"),
    "lens schema": (),
    "library add": ("lens.zip", "--json"),
    "library list": ("--json",),
    "library search": ("tessar", "--own", "--json"),
    "library show": ("mine", "--json"),
    "library remove": ("mine",),
    "library thumbnails": ("mine",),
    "looks save": ("warm.toml", "-o", "look.toml"),
    "coating list": (),
    "coating plot": ("quarter-wave:550", "-o", "coating.svg"),
    "project init": ("tessar-brendel", "-o", "new.toml"),
    "project check": ("shot.toml",),
    "project schema": (),
    "scene init": ("-o", "scene.toml"),
    "scene check": ("match.toml",),
    "scene schema": (),
    "design solve": ("shot.toml", "-o", "found", "--time", "0.2"),
    "design resume": ("searched", "--time", "0.2"),
    "design target": ("flare.exr", "--light", "5,3", "--focal", "50", "-o", "target.toml"),
    "design scratch": ("--light", "10,5", "--ghost", "4,1.5", "-o", "found", "--time", "0.2"),
    "design colors": ("shot.toml", "-o", "colored.toml", "--time", "0.2"),
    "design resize": ("heliar-tronnier", "--ghost", "2-1", "--height", "1.5", "-o", "resized.toml"),
    "design move-stop": ("tessar-brendel", "--row", "4", "-o", "moved.toml"),
    "design benchmark": ("heliar", "--seeds", "1", "--time", "0.2"),
    "design identify": ("tessar-brendel", "--light", "5,3", "--json"),
    "measure run": ("captures.csv", "-o", "run", "--camera", "camera.json"),
    "measure merge": ("captures.csv", "-o", "run", "--camera", "camera.json"),
    "measure find": ("merged",),
    "measure fit": ("merged",),
    "measure track": ("merged",),
    "measure compress": ("merged",),
    "measure explain": ("model.json", "-o", "lenses", "--time", "0.2"),
    "measure report": ("merged",),
    "measure replay": ("model.json", "--constellation", "8", "--size", "32x18", "-o", "out.exr", "--json"),
}
"""Arguments by command; a command that is missing here fails a test."""

# they start a server, or compile for a minute
LEFT_OUT = {"edit", "warm-up"}


def commands() -> Iterator[tuple[str, Any]]:
    """Yield the name and the function of each command."""
    yield from _below(command_tree(), ())


def _below(group: typer.Typer, path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    for command in group.registered_commands:
        yield " ".join((*path, command.name or "")), command.callback
    for each in group.registered_groups:
        if each.typer_instance is not None:
            yield from _below(each.typer_instance, (*path, each.name or ""))


def options(function: Any) -> Iterator[tuple[str, type, str]]:
    """Yield the flag, the type and the placeholder of each option with a value."""
    for name, hint in get_type_hints(function, include_extras=True).items():
        kinds = list(types_within(hint))
        kind = next((each for each in (bool, int, float, Path, str) if each in kinds), str)
        info = next((each for each in getattr(hint, "__metadata__", ()) if isinstance(each, OptionInfo)), None)
        argument = any(isinstance(each, ArgumentInfo) for each in getattr(hint, "__metadata__", ()))
        if name == "return" or kind is bool or argument:
            continue
        # in an annotation the first name of an option stands where its default would be
        named = (info.default, *(info.param_decls or ())) if info else ()
        flags = [flag for flag in named if isinstance(flag, str) and flag.startswith("--")]
        yield (
            flags[0].partition("/")[0] if flags else "--" + name.replace("_", "-"),
            kind,
            (info and info.metavar) or "",
        )
