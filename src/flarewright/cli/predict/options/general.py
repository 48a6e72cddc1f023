"""Options of `flarewright predict`: what is predicted and written."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ...shared_options import Json, Threads, output_option


@dataclass(frozen=True, kw_only=True)
class GeneralOptions:
    """What is predicted and written. None: not given."""

    subject: Annotated[
        str,
        typer.Argument(metavar="LENS|MODEL|SCENE", help="A lens, a measured flare (.json), or a scene file (.toml)."),
    ]
    output: Annotated[Path | None, output_option(metavar="REPORT.html", help="Write an HTML report.")] = None
    quality: Annotated[
        str | None,
        typer.Option(help="final (traced rays, default) or draft: matrices, fast but dark beyond the field of view."),
    ] = None
    glare: Annotated[bool, typer.Option("--glare", help="Also print the veiling glare index.")] = False
    cache: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.npz", help="Store rendered pictures, to resume after Ctrl-C or with a changed scene."
        ),
    ] = None
    threads: Threads = None
    processes: Annotated[
        int | None, typer.Option(min=1, help="Number of processes that draw pictures (default: 1).")
    ] = None
    cluster: Annotated[
        str | None,
        typer.Option(metavar="WHERE", help="Draw on a Dask cluster: local:N, tcp://HOST:PORT or slurm:FILE."),
    ] = None
    as_json: Json = False
