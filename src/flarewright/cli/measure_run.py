"""`flarewright measure merge` and `run`: from photographs to merged frames, and on through the later stages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import FlarewrightError
from .common import print_json, progress_bar, tell
from .measure_stages import By, CorrectionsFile, Every, NoResidual

if TYPE_CHECKING:
    from ..measure.merge_run import MergeSettings
    from ..model.capture import CameraNoise, MergedRun

MERGE_EPILOG = (
    "Examples:\n\nflarewright measure merge captures.csv -o run\n\n"
    "flarewright measure merge photos/ --angles 0+0.2 --block 4 -o run"
)
RUN_EPILOG = "Example:\n\nflarewright measure run captures.csv -o run"

# in their order; later stages need the earlier ones
STAGES = ("merge", "find", "fit", "track", "compress")

Captures = Annotated[
    Path, typer.Argument(metavar="CAPTURES", help="captures.csv, or a folder of photographs with --angles.")
]
Output = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for everything that is made.")]
Camera = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="Black and white level, noise (JSON); camera.json beside the list if it is there."
    ),
]
Angles = Annotated[
    str | None, typer.Option(metavar="START+STEP", help="Degrees, for a list without constellation_deg.")
]
Block = Annotated[int, typer.Option(min=1, max=64, help="Average so many by so many pixels into one.")]
WhiteBalance = Annotated[
    str, typer.Option(metavar="none|camera|R,G,B", help="What red, green and blue are multiplied by.")
]
Upright = Annotated[
    bool, typer.Option("--upright", help="Turn frames so that the horizon's tilt is out of their pixels.")
]
Threads = Annotated[int | None, typer.Option(min=1, help="All cores when left out; the pixels do not depend on it.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def merge(
    captures: Captures,
    output: Output,
    camera: Camera = None,
    angles: Angles = None,
    block: Block = 1,
    white_balance: WhiteBalance = "none",
    upright: Upright = False,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Merge exposures in linear light, and find the light, the optical axis and the camera's noise.

    Goes on where an earlier run into the same folder was stopped.
    """
    run = _merge(captures, output, camera, angles, _settings(block, white_balance, upright), threads)
    tell(run.remarks)
    if as_json:
        print_json({"folder": str(output), "stages": ["merge"], "merge": summary(run)})
    else:
        print(words(run, output))


def run(
    captures: Captures,
    output: Output,
    stages: Annotated[str, typer.Option(help=f"Which, by commas, of {','.join(STAGES)}.")] = ",".join(STAGES),
    camera: Camera = None,
    angles: Angles = None,
    block: Block = 1,
    white_balance: WhiteBalance = "none",
    upright: Upright = False,
    every: Every = 1,
    corrections: CorrectionsFile = None,
    by: By = "joint",
    no_residual: NoResidual = False,
    threads: Threads = None,
    as_json: Json = False,
) -> None:
    """Run the stages of a measurement one after the other; what is finished already is kept."""
    chosen = chosen_stages(stages)
    _check_there(captures)
    if corrections is not None and "find" not in chosen:
        raise FlarewrightError("--corrections are for the stage find, which --stages leaves out: add it, or drop them")
    if no_residual and not {"fit", "compress"} & set(chosen):
        raise FlarewrightError(
            "--no-residual is for the stages fit and compress, which --stages leaves out: add one, or drop it"
        )
    _check_way(by, chosen)
    settings = _settings(block, white_balance, upright)
    facts: dict[str, Any] = {"folder": str(output), "stages": chosen}
    if "merge" in chosen:
        merged = _merge(captures, output, camera, angles, settings, threads)
        tell(merged.remarks)
        facts["merge"] = summary(merged)
        if not as_json:
            print(words(merged, output))
    later = [stage for stage in chosen if stage != "merge"]
    if later:
        from .measure_stages import run_stages

        facts.update(run_stages(output, later, every, corrections, threads, not as_json, by, not no_residual))
    if as_json:
        print_json(facts)


def chosen_stages(text: str) -> list[str]:
    """Return the stages of a text like "merge,find", in their own order.

    Raises
    ------
    FlarewrightError
        When one is unknown.
    """
    wanted = [word.strip() for word in text.split(",") if word.strip()]
    unknown = [word for word in wanted if word not in STAGES]
    if unknown or not wanted:
        raise FlarewrightError(f"--stages {text!r}: {(unknown[0] if unknown else text)!r} is no stage; choose from "
                               f"{', '.join(STAGES)}")  # fmt: skip
    return [stage for stage in STAGES if stage in wanted]


def _settings(block: int, white_balance: str, upright: bool) -> MergeSettings:
    from ..measure.merge_run import MergeSettings

    if white_balance in ("none", "camera"):
        return MergeSettings(block, "camera" if white_balance == "camera" else "none", upright)
    try:
        red, green, blue = (float(part) for part in white_balance.split(","))
    except ValueError:
        red = green = blue = 0.0
    if not all(0.0 < value < 1e3 for value in (red, green, blue)):
        raise FlarewrightError(
            f"--white-balance {white_balance!r} is neither none nor camera nor three numbers above 0"
        )
    return MergeSettings(block, (red, green, blue), upright)


def _merge(
    captures: Path, output: Path, camera: Path | None, angles: str | None, settings: MergeSettings, threads: int | None
) -> MergedRun:
    from ..io.captures import captures_folder, parse_rule, read_captures
    from ..measure.merge_run import check_same_run, merge_captures
    from ..measure.overview import write_overview

    _check_there(captures)
    rule = None if angles is None else parse_rule(angles)
    known = _camera(captures, camera)
    check_same_run(output)
    with progress_bar() as begin:
        begun = begin("merge")
        begun(0.0, "reading the list")
        listed = read_captures(captures, rule)
        merged = merge_captures(
            listed, captures_folder(captures), output, camera=known, settings=settings, threads=threads, progress=begun
        )
        write_overview(output, merged)
    return merged


def _check_way(by: str, chosen: Sequence[str]) -> None:
    """Refuse a way to fit that leads to no model, or to one that the chosen stages cannot go on with."""
    if by == "joint":
        return
    if "fit" not in chosen:
        raise FlarewrightError(f"--by {by} is for the stage fit, which --stages leaves out: add it, or drop --by")
    fitting = [stage for stage in chosen if stage not in ("track", "compress")]
    if fitting != list(chosen):
        raise FlarewrightError(
            f"--by {by} writes ghosts that have their numbers over the constellation already, so they are not tracked "
            f"or compressed: choose --stages {','.join(fitting)}"
        )


def _check_there(captures: Path) -> None:
    if not captures.exists():
        raise FlarewrightError(f"{captures} does not exist: check the path and the spelling")


def _camera(captures: Path, camera: Path | None) -> CameraNoise | None:
    from ..io.captures import captures_folder, read_camera

    if camera is None:
        beside = captures_folder(captures) / "camera.json"
        return read_camera(beside) if beside.is_file() else None
    return read_camera(camera)


def summary(run: MergedRun) -> dict[str, Any]:
    """Return the facts of a merged run for JSON."""
    seen = [frame for frame in run.frames if frame.light_found]
    off_axis = [frame for frame in seen if abs(frame.constellation_deg) > 1.0]
    return {
        "frames": len(run.frames),
        "light_found": len(seen),
        "size_px": list(run.size_px),
        "axis_px": list(run.axis_px),
        "axis_error_px": list(run.axis_error_px),
        "px_per_rad": run.px_per_rad,
        "horizon_deg": [frame.horizon_deg for frame in off_axis],
        "horizon_constellation_deg": [frame.constellation_deg for frame in off_axis],
        "largest_angle_correction_deg": max(abs(f.constellation_deg - f.nominal_deg) for f in run.frames),
        "clipped_share": max(frame.clipped_share for frame in run.frames),
        "camera": run.camera.model_dump(exclude={"schema_version"}),
        "remarks": list(run.remarks),
    }


def words(run: MergedRun, folder: Path) -> str:
    """Say in a few lines what merging found."""
    from ..io.sentences import count

    seen = sum(frame.light_found for frame in run.frames)
    (x, y), (dx, dy) = run.axis_px, run.axis_error_px
    return (
        f"{folder}: {count(len(run.frames), 'frame')} of {run.size_px[0]}x{run.size_px[1]} pixels, "
        f"the light seen in {seen}; "
        f"axis at ({x:.2f} +- {dx:.2f}, {y:.2f} +- {dy:.2f}), {run.px_per_rad:.1f} pixels per radian; "
        f"see {folder / 'merged.png'}"
    )
