"""All options of `flarewright shot`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from ...shared_options import output_name
from .art import ArtOptions
from .camera import CameraOptions
from .layers import LayerOptions
from .layers import option as output_option
from .lens import LensOptions
from .light import LightOptions
from .place import PlaceOptions
from .plate import CompOptions, PlateFile, PlateOptions
from .quality import QualityOptions
from .starburst import StarburstOptions

frame_option = partial(typer.Option, rich_help_panel="Frames")
film_option = partial(typer.Option, rich_help_panel="Film")
work_option = partial(typer.Option, rich_help_panel="Processes")


@dataclass(frozen=True, kw_only=True)
class ShotInputs:
    """What is drawn, and which frames of it. None or empty: not given."""

    project: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A project file, or an EXR with its project; flags override its settings."),
    ] = None
    lens: Annotated[
        str | None, typer.Option(metavar="LENS", help="A shipped lens, a lens file, or a measured flare (.json).")
    ] = None
    look: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="One of `flarewright looks`; flags override it.")
    ] = None
    frames: Annotated[
        str | None, frame_option(metavar="A-BxS", help="1001-1240, 1001-1240x2 or 1,5,9-12 (default: to the last key).")
    ] = None
    fps: Annotated[float | None, frame_option(help="Frames per second (default: the project's, 24).")] = None
    start: Annotated[int | None, frame_option(help="Number of the frame at 0 s (default: the project's, 1).")] = None
    shutter: Annotated[
        float, frame_option(metavar="DEGREES", help="Motion blur: 180 is open for half a frame (default: 0, none).")
    ] = 0.0
    subframes: Annotated[
        int | None, frame_option(help="Moments averaged in a frame (default: one per pixel of motion).")
    ] = None


@dataclass(frozen=True, kw_only=True)
class ShotFiles:
    """Where the frames are written."""

    output: Annotated[
        str,
        output_option(
            "-o",
            "--output",
            parser=output_name,
            metavar="NAME.####.exr",
            help="EXR files: ####, %04d or $F4 is the frame.",
        ),
    ]


@dataclass(frozen=True, kw_only=True)
class MovieOptions:
    """The film. None: not given."""

    movie: Annotated[
        Path | None,
        film_option(
            metavar="FILM.mp4|FILM.mov", help="Also make a film of the comp, or of the flare: H.264 or ProRes."
        ),
    ] = None
    view: Annotated[
        str | None,
        film_option(
            metavar="NAME", help="Of the film: filmic (default for a flare), srgb, rec709 (as a film plate), aces."
        ),
    ] = None
    exposure: Annotated[
        float | None,
        film_option(
            metavar="STOPS", help="Of the film (default: automatic and the same for all frames; 0 for a comp)."
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ShotOutput(MovieOptions, LayerOptions, ShotFiles):
    """What is written, and by how many processes. None or empty: not given."""

    parts: Annotated[
        str | None, output_option(help="multi: a part of the file per layer (default); single: one part with all.")
    ] = None
    cropped: Annotated[bool, output_option("--cropped", help="Write single ghosts in small data windows.")] = False
    radiance: Annotated[
        bool,
        output_option(
            "--radiance",
            help="Write radiances of the scene, which add to a rendered picture as they are (default: irradiances).",
        ),
    ] = False
    processes: Annotated[int | None, work_option(min=1, help="Number of processes (default: one per core).")] = None
    chunk: Annotated[
        str | None, work_option(metavar="I/N", help="Draw part I of N of the frames, for render farms.")
    ] = None
    cluster: Annotated[
        str | None, work_option(metavar="WHERE", help="Draw on a Dask cluster: local:N, tcp://HOST:PORT or slurm:FILE.")
    ] = None
    as_json: Annotated[bool, work_option("--json", help="Print a summary as one JSON object.")] = False


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
