"""All options of `flarewright shot`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from .art import ArtOptions
from .camera import CameraOptions
from .layers import PANEL, LayerOptions
from .lens import LensOptions
from .light import LightOptions
from .place import PlaceOptions
from .plate import CompOptions, PlateFile, PlateOptions
from .quality import QualityOptions
from .starburst import StarburstOptions

FRAMES = "Frames"
MOVIE = "Film"
WORK = "Processes"


@dataclass(frozen=True, kw_only=True)
class ShotInputs:
    """What is drawn, and which frames of it. None or empty: not given."""

    project: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A project file; flags override its settings.")
    ] = None
    lens: Annotated[
        str | None, typer.Option(metavar="LENS", help="A shipped lens, a lens file, or a measured flare (.json).")
    ] = None
    look: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="One of `flarewright looks`; flags override it.")
    ] = None
    frames: Annotated[
        str | None,
        typer.Option(
            metavar="A-BxS", help="1001-1240, 1001-1240x2 or 1,5,9-12 (default: to the last key).",
            rich_help_panel=FRAMES,
        ),
    ] = None  # fmt: skip
    fps: Annotated[
        float | None, typer.Option(help="Frames per second (default: the project's, 24).", rich_help_panel=FRAMES)
    ] = None
    start: Annotated[
        int | None, typer.Option(help="Number of the frame at 0 s (default: the project's, 1).", rich_help_panel=FRAMES)
    ] = None
    shutter: Annotated[
        float,
        typer.Option(
            metavar="DEGREES", help="Motion blur: 180 is open for half a frame (default: 0, none).",
            rich_help_panel=FRAMES,
        ),
    ] = 0.0  # fmt: skip
    subframes: Annotated[
        int | None,
        typer.Option(help="Moments averaged in a frame (default: one per pixel of motion).", rich_help_panel=FRAMES),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ShotFiles:
    """Where the frames are written."""

    output: Annotated[
        str,
        typer.Option(
            "-o", "--output", metavar="NAME.####.exr", help="EXR files: ####, %04d or $F4 is the frame.",
            rich_help_panel=PANEL,
        ),
    ]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class MovieOptions:
    """The film. None: not given."""

    movie: Annotated[
        Path | None,
        typer.Option(
            metavar="FILM.mp4|FILM.mov", help="Also make a film of the comp, or of the flare: H.264 or ProRes.",
            rich_help_panel=MOVIE,
        ),
    ] = None  # fmt: skip
    view: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Of the film: filmic (default for a flare), srgb, rec709 (as a film plate), aces.",
            rich_help_panel=MOVIE,
        ),
    ] = None  # fmt: skip
    exposure: Annotated[
        float | None,
        typer.Option(
            metavar="STOPS", help="Of the film (default: automatic and the same for all frames; 0 for a comp).",
            rich_help_panel=MOVIE,
        ),
    ] = None  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ShotOutput(MovieOptions, LayerOptions, ShotFiles):
    """What is written, and by how many processes. None or empty: not given."""

    parts: Annotated[
        str | None,
        typer.Option(
            help="multi: a part of the file per layer (default); single: one part with all.", rich_help_panel=PANEL
        ),
    ] = None
    cropped: Annotated[
        bool, typer.Option("--cropped", help="Write single ghosts in small data windows.", rich_help_panel=PANEL)
    ] = False
    radiance: Annotated[
        bool,
        typer.Option(
            "--radiance",
            help="Write radiances of the scene, which add to a rendered picture as they are (default: irradiances).",
            rich_help_panel=PANEL,
        ),
    ] = False
    processes: Annotated[
        int | None, typer.Option(min=1, help="Number of processes (default: one per core).", rich_help_panel=WORK)
    ] = None
    chunk: Annotated[
        str | None,
        typer.Option(metavar="I/N", help="Draw part I of N of the frames, for render farms.", rich_help_panel=WORK),
    ] = None
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="WHERE", help="Draw on a Dask cluster: local:N, tcp://HOST:PORT or slurm:FILE.",
            rich_help_panel=WORK,
        ),
    ] = None  # fmt: skip
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as one JSON object.", rich_help_panel=WORK)
    ] = False


@dataclass(frozen=True, kw_only=True)
class ShotOptions(
    QualityOptions,
    CameraOptions,
    ArtOptions,
    StarburstOptions,
    LensOptions,
    PlaceOptions,
    LightOptions,
    CompOptions,
    PlateOptions,
    ShotOutput,
    ShotInputs,
    PlateFile,
):
    """The options as given; the last base comes first on the help page."""

    base: Any = None
    """The `Project` of the file."""
