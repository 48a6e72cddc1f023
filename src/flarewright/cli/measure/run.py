"""`flarewright measure merge` and `run`: from photographs to merged frames, and through the later stages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import FlarewrightError
from ...workflow.measure_provenance import STAGES as AFTER_MERGING
from ..common import print_json, print_remark, print_remarks, progress_bar
from ..shared_options import Json, output_option
from .stages import By, CorrectionsFile, Every, NoResidual

if TYPE_CHECKING:
    from ...measure.merging.settings import MergeSettings
    from ...model.measurement.capture import MergedRun

MERGE_EPILOG = (
    "Examples:\n\nflarewright measure merge captures.csv -o run\n\n"
    "flarewright measure merge photos/ --angles 0+0.2 --block 4 -o run"
)
RUN_EPILOG = "Example:\n\nflarewright measure run captures.csv -o run"

STAGES = ("merge", *AFTER_MERGING)

Captures = Annotated[
    Path, typer.Argument(metavar="CAPTURES", help="captures.csv, or a folder of photographs with --angles.")
]
Output = Annotated[Path, output_option(metavar="DIR", help="Folder for all results.")]
Camera = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="Black and white level, noise (JSON; default: camera.json beside the list, if present)."
    ),
]
Angles = Annotated[
    str | None,
    typer.Option(metavar="START+STEP", help="Constellations in degrees, for a list without constellation_deg."),
]
Block = Annotated[
    int, typer.Option(min=1, max=64, help="Side in pixels of the blocks that are averaged into one pixel.")
]
WhiteBalance = Annotated[str, typer.Option(metavar="none|camera|R,G,B", help="Factors on red, green and blue.")]
Upright = Annotated[bool, typer.Option("--upright", help="Rotate frames to remove the tilt of the horizon.")]
Threads = Annotated[
    int | None, typer.Option(min=1, help="Number of threads, without effect on the pixels (default: all cores).")
]
Cluster = Annotated[
    str | None, typer.Option(metavar="WHERE", help="Merge on a Dask cluster: local:N, tcp://HOST:PORT or slurm:FILE.")
]


def merge_command(
    captures: Captures,
    output: Output,
    camera: Camera = None,
    angles: Angles = None,
    block: Block = 1,
    white_balance: WhiteBalance = "none",
    upright: Upright = False,
    threads: Threads = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Merge exposures in linear light, and estimate the light's place, the optical axis and the camera's noise.

    Resumes an interrupted run into the same folder.
    """
    from ...jobs.cluster.executor import workers_of

    # later stages, which `run` has, use threads here
    workers_of(cluster, None, threads)
    run = _merge(captures, output, camera, angles, _settings(block, white_balance, upright), threads, cluster)
    print_remarks(run.remarks)
    if as_json:
        print_json({"folder": str(output), "stages": ["merge"], "merge": merge_summary(run)})
    else:
        print(words(run, output))


def run(
    captures: Captures,
    output: Output,
    stages: Annotated[str, typer.Option(help=f"Stages to run, separated by commas, of {','.join(STAGES)}.")] = ",".join(
        STAGES
    ),
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
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Run the stages of a measurement in order; finished stages are kept."""
    from ...io.measurement.ghost_model_file import read_corrections

    chosen = chosen_stages(stages)
    _check_there(captures)
    if corrections is not None and "find" not in chosen:
        raise FlarewrightError("--corrections are for the stage find, which --stages omits: add it, or drop them")
    if cluster is not None and "merge" not in chosen:
        raise FlarewrightError("--cluster is for the stage merge, which --stages omits: add it, or drop --cluster")
    if no_residual and not {"fit", "compress"} & set(chosen):
        raise FlarewrightError(
            "--no-residual is for the stages fit and compress, which --stages omits: add one, or drop it"
        )
    _check_way(by, chosen)
    if corrections is not None:
        # the stage would raise hours later
        read_corrections(corrections)
    settings = _settings(block, white_balance, upright)
    facts: dict[str, Any] = {"folder": str(output), "stages": chosen}
    if "merge" in chosen:
        spacing = 1 if chosen == ["merge"] else every
        merged = _merge(captures, output, camera, angles, settings, threads, cluster, spacing)
        print_remarks(merged.remarks)
        facts["merge"] = merge_summary(merged)
        if not as_json:
            print(words(merged, output))
    later = [stage for stage in chosen if stage != "merge"]
    if later:
        from .stages import run_and_print

        facts.update(run_and_print(output, later, every, corrections, threads, not as_json, by, not no_residual))
    if as_json:
        print_json(facts)


def chosen_stages(text: str) -> list[str]:
    """Return the stages of a text like "merge,find", in processing order.

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
    from ...measure.merging.settings import MergeSettings

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
    captures: Path,
    output: Path,
    camera: Path | None,
    angles: str | None,
    settings: MergeSettings,
    threads: int | None,
    cluster: str | None = None,
    every: int = 1,
) -> MergedRun:
    """Merge exposures; `every` n-th frame is what later stages use, which is checked first."""
    from ...io.measurement.captures import parse_rule
    from ...workflow.measure_merge import merge_photographs

    _check_there(captures)
    rule = None if angles is None else parse_rule(angles)
    with progress_bar() as begin:
        return merge_photographs(
            captures, output, rule=rule, camera=camera, settings=settings, every=every, threads=threads,
            cluster=cluster, progress=begin("merge"), report=print_remark,
        )  # fmt: skip


def _check_way(by: str, chosen: Sequence[str]) -> None:
    """Raise an error if a way to fit does not match the chosen stages."""
    if by == "joint":
        return
    if "fit" not in chosen:
        raise FlarewrightError(f"--by {by} is for the stage fit, which --stages omits: add it, or drop --by")
    fitting = [stage for stage in chosen if stage not in ("track", "compress")]
    if fitting != list(chosen):
        raise FlarewrightError(
            f"--by {by} writes ghosts with parameters over the constellation already, which cannot be tracked "
            f"or compressed: choose --stages {','.join(fitting)}"
        )


def _check_there(captures: Path) -> None:
    if not captures.exists():
        raise FlarewrightError(f"{captures} does not exist: check the path and the spelling")


def merge_summary(run: MergedRun) -> dict[str, Any]:
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
    """Return the result of merging in words."""
    from ...sentences import count

    seen = sum(frame.light_found for frame in run.frames)
    (x, y), (dx, dy) = run.axis_px, run.axis_error_px
    return (
        f"{folder}: {count(len(run.frames), 'frame')} of {run.size_px[0]}x{run.size_px[1]} pixels, "
        f"the light seen in {seen}; "
        f"axis at ({x:.2f} +- {dx:.2f}, {y:.2f} +- {dy:.2f}), {run.px_per_rad:.1f} pixels per radian; "
        f"see {folder / 'merged.png'}"
    )
