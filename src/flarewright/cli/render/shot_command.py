"""`flarewright shot`: draw the frames of a moving flare on all cores."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ...errors import ProjectError
from ..common import first_run_bar, print_json, print_remarks, progress_bar
from ..option_record import with_options
from .command import keep_inputs, project_of_options
from .options.record import RenderOptions
from .options.shot import ShotOptions

if TYPE_CHECKING:
    from ...jobs.frame_list import FramePattern
    from ...model import Project
    from ...workflow.shot_frame import FrameResult

EPILOG = (
    "Examples:\n\nflarewright shot --project drive.toml -o flare.####.exr\n\n"
    "flarewright shot --project drive.toml --frames 1001-1240 --start 1001 --fps 25 --shutter 180 -o flare.%04d.exr\n\n"
    "flarewright shot --project drive.toml --chunk 2/5 -o flare.####.exr"
)


@with_options(ShotOptions)
def shot(options: ShotOptions) -> None:
    """Draw the frames of a project whose light, lens or camera moves, one EXR each.

    Finished frames are kept: the same command resumes, and a changed project draws only the frames that it changes.
    On a terminal a bar shows the progress; elsewhere stderr gets one line of JSON for each frame.
    """
    from ...jobs.frame_list import FramePattern
    from ...workflow.shot import shot as draw

    parts = _parts(options.parts)
    project, remarks = _project(options)
    keep_inputs(project, options.project, _files(FramePattern(options.output), project, options.frames))
    started = time.monotonic()
    with _progress() as report:
        result = draw(
            project,
            options.output,
            frames=options.frames,
            shutter_deg=options.shutter,
            subframes=options.subframes,
            parts=parts,
            cropped=options.cropped,
            chunk=options.chunk,
            processes=options.processes,
            threads=options.threads,
            report=report,
            prepare=_compile,
        )
    remarks = [*remarks, *result.remarks]
    print_remarks(remarks)
    drawn = sum(frame.drawn for frame in result.frames)
    seconds = time.monotonic() - started
    if options.as_json:
        print_json(
            {
                "frames": [
                    {"frame": frame.frame, "file": frame.file, "drawn": frame.drawn, "subframes": frame.subframes}
                    for frame in result.frames
                ],
                "drawn": drawn,
                "kept": len(result.frames) - drawn,
                "processes": result.processes,
                "seconds": round(seconds, 3),
                "fps": project.timeline.fps,
                "start": project.timeline.start,
                "remarks": remarks,
            }
        )
    else:
        kept = len(result.frames) - drawn
        words = [f"wrote {drawn} frames in {seconds:.1f} s"] if drawn else []
        words += [f"kept {kept} frames that the same settings made"] if kept else []
        print_remarks([", ".join(words) or "no frame was to be drawn"])


def _parts(text: str | None) -> Literal["multi", "single"]:
    match text:
        case None | "multi":
            return "multi"
        case "single":
            return "single"
    raise ProjectError(f"--parts {text!r} is unknown; choose multi or single")


def _project(options: ShotOptions) -> tuple[Project, list[str]]:
    """Return the project of the options, with their timeline, and remarks."""
    names = {each.name for each in fields(RenderOptions)} & {each.name for each in fields(ShotOptions)}
    # a render's shutter exposes its PNG
    same = {name: getattr(options, name) for name in names - {"output", "shutter"}}
    timeline = {key: value for key, value in (("fps", options.fps), ("start", options.start)) if value is not None}
    _, project, remarks = project_of_options(RenderOptions(**same, output=Path(options.output)), None, timeline)
    return project, remarks


def _files(pattern: FramePattern, project: Project, frames: str | None) -> list[Path]:
    """Return the files of all frames."""
    from ...workflow.shot import shot_frames

    return [pattern.path(frame) for frame in shot_frames(project, frames)[0]]


def _compile(project: Project, threads: int) -> None:
    """Compile the kernels of a frame, once for all processes."""
    from ...measure.replay.measured_project import is_measured
    from ...render.warmup import compile_for_render

    if not is_measured(project):
        compile_for_render(project, threads, lambda sentence: print_remarks([sentence]), first_run_bar)


@contextmanager
def _progress() -> Iterator[Callable[[FrameResult, int, int], None]]:
    """Show a bar on a terminal; elsewhere print one JSON object per frame to stderr."""
    if sys.stderr.isatty():
        with progress_bar() as begin:
            bar = begin("shot")
            yield lambda result, done, of: bar(done / of, f"frame {result.frame}, {done} of {of}")
        return
    started = time.monotonic()
    # the first frame also waits for kernels and processes, and kept ones take no time: neither predicts the others
    first_s, later = 0.0, -1

    def line(result: FrameResult, done: int, of: int) -> None:
        nonlocal first_s, later
        seconds = time.monotonic() - started
        later += result.drawn
        first_s = seconds if later == 0 and result.drawn else first_s
        left_s = round((seconds - first_s) / later * (of - done), 3) if later > 0 else None
        state = "drawn" if result.drawn else "kept"
        data = {
            "frame": result.frame, "file": result.file, "state": state, "done": done, "of": of,
            "seconds": round(seconds, 3), "left_s": left_s,
        }  # fmt: skip
        print(json.dumps(data), file=sys.stderr, flush=True)

    yield line
