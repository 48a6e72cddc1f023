"""`flarewright shot`: draw the frames of a moving flare on all cores."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ...errors import ProjectError
from ..common import first_run_bar, one_of, print_json, print_remark, print_remarks, progress_bar
from ..option_record import with_options
from ..progress_lines import ProgressLines, print_line
from .command import keep_inputs, project_of_options
from .film_command import check_film_look, film_data, film_line, film_words
from .options.record import RenderOptions
from .options.shot import ShotOptions

if TYPE_CHECKING:
    from ...model import Project
    from ...plates.settings import PlateSettings
    from ...workflow.plates.plate_sources import PlateShot
    from ...workflow.shot import ShotResult
    from ...workflow.shot_frame import FrameResult

EPILOG = (
    "Examples:\n\nflarewright shot --project drive.toml -o flare.####.exr\n\n"
    "flarewright shot --project drive.toml --frames 1001-1240 --start 1001 --fps 25 --shutter 180 -o flare.%04d.exr\n\n"
    "flarewright shot --project drive.toml --chunk 2/5 -o flare.####.exr\n\n"
    "flarewright shot --project drive.toml --cluster tcp://10.0.0.1:8786 -o flare.####.exr\n\n"
    "flarewright shot plate.####.exr --lens canon-28-80 --fstop 4 -o flare.####.exr --over comp.####.exr\n\n"
    "flarewright shot drive.mp4 --lens canon-28-80 -o flare.####.exr --over comp.####.exr --movie comp.mp4"
)


@with_options(ShotOptions)
def shot(options: ShotOptions) -> None:
    """Draw the frames of a moving flare, or the flare of the lights in a plate, one EXR each.

    Finished frames are kept: the same command resumes, and a changed project draws only the frames that it changes.
    On a terminal a bar shows the progress; elsewhere stderr gets one line of JSON for each frame.
    """
    from ...io.project.project_file import read_project
    from ...workflow.shot import shot as draw
    from .plate_flags import plate_settings

    parts: Parts = "multi" if options.parts is None else one_of("--parts", options.parts, ("multi", "single"))
    _check_movie(options)
    if options.project is not None:
        options = replace(options, base=read_project(options.project))
    plate = plate_settings(options.plate, options, None if options.base is None else options.base.plate)
    project, remarks = _project(options, plate)
    _keep_inputs(options, project, plate)
    started = time.monotonic()
    with _progress() as (report, searched, encoded):
        result = draw(
            project, options.output, frames=options.frames, shutter_deg=options.shutter, subframes=options.subframes,
            parts=parts, cropped=options.cropped, radiance=options.radiance, plate=plate, over=options.over,
            movie=options.movie, movie_view=options.view,  # type: ignore[arg-type]
            movie_exposure=options.exposure, chunk=options.chunk, processes=options.processes,
            threads=options.threads, cluster=options.cluster, prepare=_compile, report=report, searched=searched,
            encoded=encoded, announce=print_remark,
        )  # fmt: skip
    seconds = time.monotonic() - started
    remarks = [*remarks, *result.remarks]
    print_remarks(remarks)
    if options.as_json:
        print_json({**_data(result, project, seconds), "remarks": remarks})
    else:
        _print(result, seconds)


def _data(result: ShotResult, project: Project, seconds: float) -> dict[str, Any]:
    """Return what became of a shot as JSON data."""
    drawn = sum(frame.drawn for frame in result.frames)
    return {
        "frames": [
            {"frame": frame.frame, "file": frame.file, "drawn": frame.drawn, "subframes": frame.subframes}
            for frame in result.frames
        ],
        "drawn": drawn, "kept": len(result.frames) - drawn, "processes": result.processes,
        "seconds": round(seconds, 3), "fps": project.timeline.fps, "start": project.timeline.start,
        **({} if result.plate is None else {"plate": _plate_data(result.plate)}),
        **({} if result.movie is None else {"movie": film_data(result.movie)}),
    }  # fmt: skip


def _print(result: ShotResult, seconds: float) -> None:
    from ...sentences import count

    drawn = sum(frame.drawn for frame in result.frames)
    kept = len(result.frames) - drawn
    words = [f"wrote {count(drawn, 'frame')} in {seconds:.1f} s"] if drawn else []
    words += [f"kept {count(kept, 'frame')} that the same settings made"] if kept else []
    print_remarks([", ".join(words) or "no frame was to be drawn"])
    if result.movie is not None:
        print_remarks([film_words(result.movie)])


def _check_movie(options: ShotOptions) -> None:
    """Check the flags of the film."""
    for flag, value in (("--view", options.view), ("--exposure", options.exposure)):
        if value is not None and options.movie is None:
            raise ProjectError(f"{flag} is for the film, and none is made; add --movie FILM.mp4, or omit {flag}")
    check_film_look(options.view, options.exposure)


def _project(options: ShotOptions, plate: PlateSettings | None) -> tuple[Project, list[str]]:
    """Return the project of the options, with their timeline, and remarks."""
    found: list[str] = []
    if plate is not None:
        options, found = _over_plate(options, plate)
    names = {each.name for each in fields(RenderOptions)} & {each.name for each in fields(ShotOptions)}
    # a render's shutter exposes its PNG, whose view is not that of a film
    same = {name: getattr(options, name) for name in names - {"output", "shutter", "view", "exposure"}}
    timeline = {key: value for key, value in (("fps", options.fps), ("start", options.start)) if value is not None}
    _, project, remarks = project_of_options(RenderOptions(**same, output=Path(options.output)), None, timeline)
    if plate is not None:
        found += _other_rate(options, plate, project)
    return project, [*found, *remarks]


def _other_rate(options: ShotOptions, plate: PlateSettings, project: Project) -> list[str]:
    """Return a remark if a project file has another rate than the plate."""
    from ...workflow.keyframes import frame_rate
    from ...workflow.plates.plate_files import first_picture
    from ...workflow.shot import parsed_frames

    if options.project is None or options.fps is not None:
        return []
    own = first_picture(replace(plate, first=project.timeline.start), parsed_frames(options.frames)).fps
    if own is None or frame_rate(float(own)) == frame_rate(project.timeline.fps):
        return []
    return [
        f"the plate has {float(own):.6g} frames per second and the project {project.timeline.fps:.6g}; --fps "
        f"{float(own):.6g} takes those of the plate"
    ]


def _over_plate(options: ShotOptions, plate: PlateSettings) -> tuple[ShotOptions, list[str]]:
    """Return the options with what a plate states: its size and its rate; and remarks."""
    from ...workflow.plates.plate_files import first_picture
    from ...workflow.shot import parsed_frames

    first = first_picture(replace(plate, first=options.start or 1), parsed_frames(options.frames))
    width, height = first.size_px
    _check_frame(options, first.size_px)
    remarks = []
    placed = options.light or options.light_px or options.sun or options.track
    if not placed and options.project is None:
        for flag in ("intensity", "spectrum", "distance", "light_diameter", "light_size", "light_polygon"):
            if getattr(options, flag):
                words = "--plate-gain changes the lights of the plate"
                raise ProjectError(f"--{flag.replace('_', '-')} is for a --light, and none is given; {words}")
        # dark, and left out beside the plate's lights; its size keeps photographic defaults from giving it one
        options = replace(options, light=["0,0"], intensity=[0.0], light_diameter=[0.0])
    if options.size is None and options.project is None:
        options = replace(options, size=f"{width}x{height}")
    if options.fps is None and options.project is None and first.fps is not None:
        options = replace(options, fps=float(first.fps))
    # most plates of anamorphic lenses state square pixels
    stated = options.squeeze is not None or first.pixel_aspect != 1.0
    if stated and not options.desqueeze and abs(first.pixel_aspect / _squeeze(options) - 1.0) > 0.01:
        remarks.append(
            f"the plate states pixels {first.pixel_aspect:g} times as wide as high; --squeeze {first.pixel_aspect:g} "
            "gives the flare such pixels"
        )
    return options, remarks


def _squeeze(options: ShotOptions) -> float:
    """Return the squeeze of the options, or of their lens."""
    from ...io.files.file_kind import is_ghost_model_file
    from ...render.scene.resolve import open_lens

    if options.squeeze is not None:
        return options.squeeze
    if options.lens is None or is_ghost_model_file(options.lens):
        return 1.0
    return open_lens(options.lens).lens.squeeze or 1.0


def _check_frame(options: ShotOptions, size_px: tuple[int, int]) -> None:
    """Raise an error for a frame that is not the plate's: its lights are placed in the whole picture."""
    if options.overscan is not None:
        raise ProjectError("--overscan draws more than the plate shows, so its lights would be shifted; omit it")
    if options.crop is not None:
        width, height = size_px
        if options.crop != f"{width}x{height}":
            raise ProjectError(
                f"--crop {options.crop!r}: the cropped picture must be the plate, {width}x{height} pixels; give --crop "
                f"{width}x{height} with the --size of the whole picture, or omit it"
            )
        if options.size is None and options.project is None:
            raise ProjectError(f"--crop {options.crop!r} is all of the plate; add the --size of the whole picture")


def _keep_inputs(options: ShotOptions, project: Project, plate: PlateSettings | None) -> None:
    """Raise an error if a frame would replace an input file."""
    from ...jobs.frame_list import FramePattern
    from ...workflow.shot import parsed_frames, shot_frames

    frames = shot_frames(project, parsed_frames(options.frames), plate)[0]
    outputs = [FramePattern(name).path(frame) for name in (options.output, options.over) if name for frame in frames]
    keep_inputs(project, options.project, [*outputs, *([] if options.movie is None else [options.movie])])


def _plate_data(plate: PlateShot) -> dict[str, Any]:
    """Return what the search in a plate found, as JSON data."""
    return {
        "threshold": plate.threshold,
        "size_px": list(plate.size_px),
        "sources": list(plate.found),
        "lights": len(plate.lights.tracks),
        "area_lights": int(plate.lights.extended.sum()),
    }


def _compile(project: Project, threads: int) -> None:
    """Compile the kernels of a frame, once for all processes."""
    from ...measure.replay.measured_project import is_measured
    from ...render.warmup import compile_for_render

    if not is_measured(project):
        compile_for_render(project, threads, print_remark, first_run_bar)


Parts = Literal["multi", "single"]
_Report = Callable[["FrameResult", int, int], None]
_Searched = Callable[[int, int, int], None]


@contextmanager
def _progress() -> Iterator[tuple[_Report, _Searched, _Searched]]:
    """Show a bar on a terminal; elsewhere print one JSON object per frame to stderr."""
    if sys.stderr.isatty():
        with progress_bar() as begin:
            bars: dict[str, Any] = {}

            def show(what: str, done: int, of: int, words: str) -> None:
                if what not in bars:
                    bars[what] = begin(what)
                bars[what](done / of, words)

            yield (
                lambda result, done, of: show("shot", done, of, f"frame {result.frame}, {done} of {of}"),
                lambda frame, done, of: show("finding lights", done, of, f"frame {frame}, {done} of {of}"),
                lambda frame, done, of: show("film", done, of, f"frame {frame}, {done} of {of}"),
            )
        return
    lines = ProgressLines()

    def search_line(frame: int, done: int, of: int) -> None:
        print_line({"frame": frame, "state": "searched", "done": done, "of": of})
        if done == of:
            # the estimate is that of the drawing
            lines.restart()

    yield (
        lambda result, done, of: lines.finished(
            {"frame": result.frame, "file": result.file}, drawn=result.drawn, done=done, of=of
        ),
        search_line,
        film_line,
    )
