"""`flarewright sources`: show which lights are found in a plate, before a shot is drawn with them."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import ProjectError
from ..common import one_bar, print_json, print_remark, print_remarks
from ..option_record import with_options
from .options.plate import PlateOptions
from .plate_flags import plate_settings

if TYPE_CHECKING:
    from ...plates.settings import PlateSettings
    from ...workflow.plates.plate_sources import PlateShot

EPILOG = (
    "Examples:\n\nflarewright sources photo.exr --marked marked.png\n\n"
    "flarewright sources plate.####.exr --frames 1001-1024 --threshold 8 --csv lights.csv\n\n"
    "flarewright sources drive.mp4 --marked marked.####.png"
)

# lines of the table on the terminal, and frames that are listed
_MOST_LINES = 20


@dataclass(frozen=True, kw_only=True)
class SourcesInput:
    """The plate and its frames."""

    plate: Annotated[
        str, typer.Argument(metavar="PLATE", help="A picture, plate.####.exr (EXR, TIFF, PNG, JPEG), or a film.")
    ]
    frames: Annotated[
        str | None, typer.Option(metavar="A-BxS", help="1001-1240, 1001-1240x2 or 1,5,9-12 (default: all files).")
    ] = None
    marked: Annotated[
        str | None, typer.Option(metavar="NAME.####.png", help="Write the plate with an outline for each light.")
    ] = None
    table: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write a line for each light and frame.")
    ] = None
    as_json: Annotated[bool, typer.Option("--json", help="Print all lights as one JSON object.")] = False


@dataclass(frozen=True, kw_only=True)
class SourcesOptions(PlateOptions, SourcesInput):
    """The options as given; the last base comes first on the help page."""


@with_options(SourcesOptions)
def sources(options: SourcesOptions) -> None:
    """Find the lights in a plate, and list or mark them.

    Places and sizes are in pixels from the top left corner, brightness is the sum of plate values.
    """
    from ...io.files.atomic_write import delete_written
    from ...plates.marked import light_rows
    from ...workflow.plates.plate_files import plate_frames
    from ...workflow.plates.plate_sources import plate_shot
    from ...workflow.shot import parsed_frames

    settings = plate_settings(options.plate, options)
    assert settings is not None
    frames = plate_frames(settings, parsed_frames(options.frames))
    marked = _marked_pattern(options.marked, settings, frames)
    _check_table(options.table)
    kept = _kept(options)
    with one_bar("finding lights") as progress:

        def report(frame: int, done: int, of: int) -> None:
            if progress is not None:
                progress(done / of, f"frame {frame}")

        found = plate_shot(settings, frames, kept=kept, report=report, announce=print_remark)
    rows = [{"frame": frame, **row} for frame in frames for row in light_rows(found.lights, frame)]
    if marked is not None:
        _write_marked(marked, found, settings, frames)
    if options.table is not None:
        _write_table(options.table, rows)
    if kept is not None:
        delete_written(kept)
    print_remarks(found.remarks)
    if options.as_json:
        print_json(
            {
                "plate": options.plate,
                "size_px": list(found.size_px),
                "threshold": found.threshold,
                "frames": list(frames),
                "sources": list(found.found),
                "lights": rows,
                "remarks": list(found.remarks),
            }
        )
    else:
        _print_table(rows, frames)


def _marked_pattern(text: str | None, settings: PlateSettings, frames: tuple[int, ...]) -> Any:
    """Return the checked file name of the marked pictures."""
    from ...jobs.frame_list import FramePattern

    if text is None:
        return None
    pattern = FramePattern(text)
    pattern.check(frames)
    if Path(text).suffix.lower() != ".png":
        raise ProjectError(f"--marked {text!r} must be named *.png")
    if not Path(text).parent.is_dir():
        raise ProjectError(f"--marked: the folder {Path(text).parent} does not exist; create it first")
    inputs = {
        FramePattern(name).path(frame).resolve()
        for name in (settings.files, settings.matte)
        if name is not None
        for frame in frames
    }
    if any(pattern.path(frame).resolve() in inputs for frame in frames):
        raise ProjectError(f"--marked {text} would replace a frame of the plate; choose another name")
    return pattern


def _kept(options: SourcesOptions) -> Path | None:
    """Return the file for partial work, beside the output or in the state folder; None if that cannot be written."""
    from ...workflow.kept_work.unnamed_work import unnamed_file
    from ...workflow.plates.plate_sources import sources_file

    output = options.table or options.marked
    if output is not None:
        return sources_file(str(output), "lights")
    file = unnamed_file(f"sources {replace(options, as_json=False)!r}")
    return file if os.access(file.parent, os.W_OK) else None


def _check_table(path: Path | None) -> None:
    if path is not None and path.suffix.lower() != ".csv":
        raise ProjectError(f"--csv {path} must be named *.csv")
    if path is not None and not path.parent.is_dir():
        raise ProjectError(f"--csv: the folder {path.parent} does not exist; create it first")


def _write_marked(pattern: Any, found: PlateShot, settings: PlateSettings, frames: tuple[int, ...]) -> None:
    """Write a marked picture of each frame."""
    import numpy as np

    from ...io.images.png import write_png
    from ...plates.marked import marked_plate
    from ...plates.measured_plate import converted
    from ...render.image.display import srgb_oetf
    from ...workflow.plates.plate_files import plate_picture

    for frame in frames:
        linear = converted(plate_picture(settings, frame), "rec709")
        codes = np.rint(255.0 * srgb_oetf(np.clip(linear, 0.0, 1.0))).astype(np.uint8)
        write_png(pattern.path(frame), marked_plate(codes, found.lights, frame), {})


def _write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write the lights as CSV, atomically."""
    from ...io.files.atomic_write import write_atomically

    def write(temporary: Path) -> None:
        with temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)

    write_atomically(path, write)


def _print_table(rows: list[dict[str, Any]], frames: tuple[int, ...]) -> None:
    """Print the brightest lights of the first frame, and how many there are in all."""
    from rich.console import Console
    from rich.table import Table

    first = [row for row in rows if row["frame"] == rows[0]["frame"]]
    table = Table(
        title=f"{len(first)} light{'s'[: len(first) != 1]} in frame {rows[0]['frame']}, of {len(frames)} frames"
    )
    for name in ("light", "kind", "x", "y", "width", "height", "red:green:blue", "share"):
        table.add_column(name, justify="left" if name == "kind" else "right")
    for row in first[:_MOST_LINES]:
        table.add_row(
            str(row["light"]), str(row["kind"]), *(f"{row[name]:.1f}" for name in ("x", "y", "width", "height")),
            ":".join(f"{row[name] / max(row[each] for each in 'rgb'):.2f}" for name in "rgb"), f"{row['share']:.1%}",
        )  # fmt: skip
    Console(stderr=True, markup=False, highlight=False).print(table)
    if len(first) > _MOST_LINES:
        print_remarks([f"and {len(first) - _MOST_LINES} fainter lights; --csv FILE lists all"])
