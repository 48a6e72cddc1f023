"""Options of `flarewright render`: what is written, and how the PNG shows it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from ...shared_options import output_path
from .layers import LayerOptions, option


@dataclass(frozen=True, kw_only=True)
class FileOption:
    """Where the picture is written."""

    output: Annotated[Path, option("-o", "--output", parser=output_path, metavar="OUT.exr", help="The EXR file.")]


@dataclass(frozen=True, kw_only=True)
class OutputOptions(LayerOptions, FileOption):
    """What is written, and how the PNG shows it. None or empty: not given."""

    full_windows: Annotated[bool, option("--full-windows", help="Write single ghosts at full size, for Blender.")] = (
        False
    )
    exposure: Annotated[float | None, option(help="Exposure of the PNG in stops (default: automatic).")] = None
    ev: Annotated[float | None, option(help="Exposure of the PNG as exposure value, log2(N^2 / t).")] = None
    shutter: Annotated[
        str | None, option(metavar="SECONDS", help="Exposure of the PNG as shutter time, for example 1/250.")
    ] = None
    iso: Annotated[float | None, option(help="ISO, with --ev or --shutter (default: 100).")] = None
    lux: Annotated[
        str | None,
        option(help="Illuminance of a light of intensity 1, with --ev or --shutter (default: sun, 100 000)."),
    ] = None
    view: Annotated[str | None, option(help="View of the PNG: filmic (default), srgb or aces.")] = None
    no_png: Annotated[bool, option("--no-png", help="Write no PNG beside the EXR.")] = False
    ledger: Annotated[bool, option("--ledger", help="Print where the light went.")] = False
    profile: Annotated[bool, option("--profile", help="Print what each ghost costs to draw.")] = False
    as_json: Annotated[bool, option("--json", help="Print a summary as one JSON object.")] = False
