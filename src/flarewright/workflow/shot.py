"""Draw a shot: a list of frames that do not depend on each other."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from ..errors import FlarewrightError, OutputError, ProjectError
from ..io.files.atomic_write import check_replaceable
from ..jobs.cluster.executor import open_cluster, workers_of
from ..jobs.frame_list import FramePattern, chunk_of, frames_text, parse_chunk, parse_frames
from ..jobs.processes import fitting, shares, work_off
from ..model import Project
from ..typing import Report
from .frame_files import check_holdout_frames, holdout_files, holdout_sequences
from .keyframes import is_still, last_frame, length_s, time_of

if TYPE_CHECKING:
    from ..jobs.cluster.executor import Cluster
    from ..plates.settings import PlateSettings
    from .films.assembly import FilmResult
    from .films.look import FilmView
    from .plates.plate_sources import PlateShot
    from .shot_frame import FrameResult, ShotPlan

_DRAW = "flarewright.workflow.shot_frame:draw_frame"
# remarks that are kept; each frame can have some
_MOST_REMARKS = 20
# memory of a process: that of a tiny picture, and some 20 layers per pixel while one is drawn and written
_PROCESS_BYTES, _PIXEL_BYTES = 300_000_000, 240
# memory of a pixel of a single ghost's layer, and the number of ghosts of a zoom: all are written if none are chosen
_LAYER_BYTES, _MOST_LAYERS = 24, 200


@dataclass(frozen=True)
class ShotResult:
    """What became of a shot.

    Attributes
    ----------
    frames : tuple of FrameResult
        In the order of their numbers.
    remarks : tuple of str
        About the shot and its frames, each once.
    processes : int
        Those that drew, or the workers of a cluster.
    plate : PlateShot or None
        The sources of the plate, if there is one.
    movie : FilmResult or None
    """

    frames: tuple[FrameResult, ...]
    remarks: tuple[str, ...]
    processes: int
    plate: PlateShot | None = None
    movie: FilmResult | None = None


def shot(
    project: Project,
    output: str | os.PathLike[str],
    *,
    frames: str | Sequence[int] | None = None,
    shutter_deg: float = 0.0,
    subframes: int | None = None,
    parts: Literal["multi", "single"] = "multi",
    cropped: bool = False,
    chunk: str | None = None,
    processes: int | None = None,
    threads: int | None = None,
    report: Callable[[FrameResult, int, int], None] | None = None,
    prepare: Callable[[Project, int], None] | None = None,
    plate: PlateSettings | None = None,
    over: str | os.PathLike[str] | None = None,
    searched: Callable[[int, int, int], None] | None = None,
    movie: str | os.PathLike[str] | None = None,
    movie_view: FilmView | None = None,
    movie_exposure: float | None = None,
    encoded: Callable[[int, int, int], None] | None = None,
    cluster: str | None = None,
    announce: Callable[[str], None] | None = None,
    radiance: bool = False,
) -> ShotResult:
    """Draw frames of a project whose values change over time, and write a file for each.

    Files that the same settings and version have made are kept, so that a repeated call resumes. The bytes of a file do
    not depend on the other frames, their order, the chunks, processes or threads.

    Parameters
    ----------
    project : Project
        With keyframes and curves; `Project.timeline` has the frames per second and the number of the frame at 0 s.
    output : path
        EXR files, with a place for the number of the frame: "flare.####.exr", "flare.%04d.exr" or "flare.$F4.exr".
    frames : str or sequence of int, optional
        "1001-1240", "1001-1240x2", "1,5,9-12", or numbers. None: from the frame at 0 s to the last key.
    shutter_deg : float
        Motion blur: 180 is open for half the time of a frame, around its moment; 0: none.
    subframes : int, optional
        Moments whose mean is a frame. None: as many as the flare moves pixels, 5 to 64.
    parts : {"multi", "single"}
        One part of the file for each layer, or one part with the channels of all.
    cropped : bool
        Single ghosts have their own data windows instead of the picture's.
    chunk : str, optional
        "2/5": draw only the second of five parts of the list.
    processes : int, optional
        None: one a core, as the memory allows.
    threads : int, optional
        Threads of all processes together; None: the cores.
    report : callable, optional
        Called after each frame with its result, the number of finished frames and the number of all.
    prepare : callable, optional
        Called once with the first frame's project and the number of threads, before processes start: the command line
        compiles kernels here.
    plate : PlateSettings, optional
        A picture, one a frame, or a film (its first frame is that at 0 s), whose bright sources are lights, in
        addition to those of the project. Dark ones are left out, and those that the editor has found in the project's
        plate. The layers then have the unit of the plate. `frames` of None: all frames of the plate.
    over : path, optional
        Also write the plate with its flare, one EXR file a frame, named as `output`. Without `plate` that of the
        project, whose lights must have been found in it.
    searched : callable, optional
        Called after the search for sources in each plate with the frame, the number of searched frames and that of all.
    movie : path, optional
        Also make a film, ".mp4" or ".mov", of the comps, or else of the flare; from the finished files.
    movie_view, movie_exposure
        `view` and `exposure_stops` of `films.assembly.assemble_film`.
    encoded : callable, optional
        Called after each frame of the film, as `searched`.
    cluster : str, optional
        Workers of a Dask cluster draw: "local:4", "tcp://HOST:PORT" or "slurm:FILE" (docs/many-machines.md). None:
        processes of this machine.
    announce : callable, optional
        Called with sentences about the cluster and a damaged file of sources as they arise.
    radiance : bool
        The layers have the values of a picture that shows the radiance of the scene, such as a rendered one, and add
        to it as they are: the irradiances of the sensor times 4 N^2 / (pi T).

    Raises
    ------
    FlarewrightError
        The frames, the file name or the project cannot be used, a file cannot be written, a process was lost, or there
        is no such cluster.
    MemoryError
        There is too little memory for a frame.

    Examples
    --------
    >>> from flarewright import Light, Project, shot
    >>> from flarewright.model import LightKey
    >>> path = (LightKey(at_s=0, field_deg=(-12, 4)), LightKey(at_s=1, field_deg=(12, 4)))
    >>> moving = Project(lens="heliar-tronnier", lights=[Light(field_deg=(0, 4), keyframes=path)])
    >>> shot(moving, "flare.####.exr", frames="1-25", shutter_deg=180)               # doctest: +SKIP
    """
    from ..render.image.ocio_space import check_file_space, has_film_primaries
    from .shot_frame import ShotPlan

    _check(shutter_deg, subframes, parts)
    if radiance and (plate is not None or project.lit_by_plate):
        raise ProjectError("layers over a plate have its unit already; omit --radiance")
    of_space = check_file_space(project)
    if movie is not None and not has_film_primaries(project):
        raise ProjectError(
            f"a film is made of frames in Rec.709 or ACEScg, and these are in {project.output.ocio_space}: omit the "
            "film, or that colour space"
        )
    processes = workers_of(cluster, processes, threads)
    if plate is not None:
        plate = replace(plate, first=project.timeline.start)
        from .plates.found_lights import without_found_lights

        # the lights of each frame replace those that the editor has found in one
        project = without_found_lights(project)
    pattern = FramePattern(os.fspath(output))
    numbers, remarks = shot_frames(project, frames, plate)
    remarks += of_space
    pattern.check(numbers)
    _check_output(pattern)
    comp = _comp_pattern(over, plate, project, numbers)
    if movie is not None:
        _check_movie(movie, FramePattern(comp or pattern.text), chunk, movie_view)
    written = [pattern.text, comp, "" if movie is None else os.fspath(movie)]
    _keep_sequences(project, plate, [FramePattern(name) for name in written if name], numbers)
    mine = numbers if chunk is None else chunk_of(numbers, *parse_chunk(chunk))
    if shutter_deg == 0.0 and subframes is not None and subframes > 1:
        remarks.append("sub-frames have no effect without an open shutter: give its angle, such as 180 degrees")
    with open_cluster(cluster, Path(pattern.text).parent, announce) as executor:
        found = None
        if plate is not None:
            found = _searched(project, plate, numbers, pattern, comp, processes, threads, searched, executor, announce)
        elif comp:
            found = _own_plate(project)
        if found is not None:
            remarks += found.remarks
        check_holdout_frames(project, mine)
        plan = ShotPlan(project, pattern.text, shutter_deg, subframes, parts, cropped, found, comp, radiance)
        if not mine:
            return ShotResult((), (*remarks, f"chunk {chunk} of {len(numbers)} frames is empty"), 0, found)
        _check_moments(plan, mine)
        done, number = _drawn(plan, mine, processes, threads, executor, report, prepare)
    film = None
    if movie is not None:
        from .films.assembly import assemble_film

        film = assemble_film(
            comp or pattern.text, movie, frames=numbers, fps=project.timeline.fps, view=movie_view,
            exposure_stops=movie_exposure, report=encoded,
        )  # fmt: skip
        remarks += film.remarks
    return ShotResult(tuple(done), (*remarks, *_remarks(done)), number, found, film)


def _drawn(
    plan: ShotPlan,
    frames: Sequence[int],
    processes: int | None,
    threads: int | None,
    executor: Cluster | None,
    report: Callable[[FrameResult, int, int], None] | None,
    prepare: Callable[[Project, int], None] | None,
) -> tuple[list[FrameResult], int]:
    """Draw frames; return their results in the order of their numbers, and the number of processes."""
    from .shot_frame import frame_project

    timeline = plan.project.timeline
    if processes is None:
        processes = fitting(_process_bytes(plan), threads)
    number, each = shares(len(frames), processes, threads)
    # other machines have their own compiled kernels
    if prepare is not None and (executor is None or executor.local):
        for frame in {frames[0], frames[len(frames) // 2], frames[-1]}:
            prepare(frame_project(plan, time_of(frame, timeline)), number * each)
    done: list[FrameResult] = []
    for one in work_off(_DRAW, plan, frames, processes=number, threads=each, what="frame", executor=executor):
        done.append(one.result)
        if report is not None:
            report(one.result, len(done), len(frames))
    done.sort(key=lambda result: result.frame)
    return done, number if executor is None else executor.workers


def _own_plate(project: Project) -> PlateShot:
    """Return the plate that the project names, checked for a comp."""
    from .plates.found_lights import backplate_shot
    from .plates.plate_frame import check_comp

    found = backplate_shot(project)
    check_comp(project, found.size_px)
    return found


def _comp_pattern(
    over: str | os.PathLike[str] | None, plate: PlateSettings | None, project: Project, frames: Sequence[int]
) -> str:
    """Return the checked file name of the comps; empty if none is wanted."""
    if over is None:
        return ""
    if plate is None and project.plate is None:
        raise ProjectError("a comp is laid over a plate, and there is none; give a plate, or omit --over")
    pattern = FramePattern(os.fspath(over))
    pattern.check(frames)
    _check_output(pattern)
    return pattern.text


def _check_movie(movie: str | os.PathLike[str], output: FramePattern, chunk: str | None, view: FilmView | None) -> None:
    """Raise an error before the work if the film cannot be made of the frames."""
    from .films.assembly import check_film
    from .films.look import FilmView

    check_film(movie)
    if view is not None and view not in get_args(FilmView):
        raise ProjectError(f"the view {view!r} is unknown; choose {', '.join(get_args(FilmView))}")
    if chunk is not None:
        raise ProjectError(
            f"a film needs all frames, and chunk {chunk} draws some; draw all chunks without a film, then: flarewright "
            f"film {output.text} -o {os.fspath(movie)}"
        )
    if not output.numbered:
        path = Path(output.text)
        raise ProjectError(f"a film is made of numbered frames; write {path.stem}.####{path.suffix} for {path}")


def _keep_sequences(
    project: Project, plate: PlateSettings | None, outputs: Sequence[FramePattern], frames: Sequence[int]
) -> None:
    """Raise an error if a frame would replace one that is read, or another one that is written."""
    read = {*holdout_files(project), *(() if plate is None else (plate.files, plate.matte))} - {None}
    if project.plate is not None:
        read.add(project.plate.image)
    known = {FramePattern(name).path(frame).resolve() for name in read for frame in frames}
    for pattern in outputs:
        written = {pattern.path(frame).resolve() for frame in frames}
        if written & known:
            taken = min(written & known)
            raise ProjectError(f"{pattern.text} would replace {taken.name}, which the shot reads or writes; rename it")
        known |= written


def _searched(
    project: Project,
    plate: PlateSettings,
    frames: Sequence[int],
    output: FramePattern,
    comp: str,
    processes: int | None,
    threads: int | None,
    report: Callable[[int, int, int], None] | None,
    executor: Cluster | None,
    announce: Report | None,
) -> PlateShot:
    """Find the sources of the plate in all frames of the shot, whichever of them this process draws."""
    from ..kernels.jit.warmup_processes import cores
    from .plates.plate_files import plate_picture
    from .plates.plate_frame import check_comp, check_plate
    from .plates.plate_sources import plate_shot, sources_file

    size_px = plate_picture(plate, frames[0]).size_px
    check_plate(project, size_px)
    if comp:
        check_comp(project, size_px)
    return plate_shot(
        plate,
        frames,
        kept=sources_file(output.text),
        processes=processes or threads or cores(),
        report=report,
        executor=executor,
        announce=announce or (lambda _: None),
    )


def shot_frames(
    project: Project, frames: str | Sequence[int] | None, plate: PlateSettings | None = None
) -> tuple[tuple[int, ...], list[str]]:
    """Return the numbers of a shot's frames, and remarks on them.

    Parameters
    ----------
    project : Project
    frames : str or sequence of int, optional
        As of `shot`.
    plate : PlateSettings, optional
        Its frames are the default, and must exist.

    Raises
    ------
    ProjectError
        There are none, or all of them lie outside the time in which the project moves.
    """
    if plate is None:
        wanted = parsed_frames(frames)
    else:
        from .plates.plate_files import plate_frames

        wanted = plate_frames(replace(plate, first=project.timeline.start), parsed_frames(frames))
    timeline, last = project.timeline, last_frame(project)
    if wanted is None:
        if is_still(project):
            raise ProjectError("nothing in the project moves, so it has no last frame; give the frames, such as 1-24")
        return tuple(range(timeline.start, last + 1)), []
    if is_still(project):
        alike = plate is None and len(wanted) > 1 and not holdout_sequences(project)
        return wanted, ["nothing in the project moves: all frames are alike"] if alike else []
    outside = [frame for frame in wanted if not timeline.start <= frame <= last]
    if len(outside) == len(wanted):
        raise ProjectError(
            f"frames {frames_text(wanted)[:80]} lie outside the project's {timeline.start}-{last} (frame "
            f"{timeline.start} is at 0 s, the last key at {length_s(project):g} s); give frames inside, or --start "
            f"{wanted[0]}, the number of the frame at 0 s"
        )
    if not outside:
        return wanted, []
    which = f"frames {frames_text(outside)[:80]} lie" if len(outside) > 1 else f"frame {outside[0]} lies"
    return wanted, [f"{which} outside the keys, {timeline.start}-{last}: everything rests there"]


def parsed_frames(frames: str | Sequence[int] | None) -> tuple[int, ...] | None:
    """Return the frames of a text or a list, ascending, each once; None for None.

    Raises
    ------
    ProjectError
        The text is no list of frames (`jobs.frame_list.parse_frames`), or there are none.
    """
    if frames is None:
        return None
    try:
        # NumPy's whole numbers, too
        numbers = parse_frames(frames) if isinstance(frames, str) else tuple(sorted({index(frame) for frame in frames}))
    except TypeError:
        raise ProjectError(
            f"frames are whole numbers, not {list(frames)!r:.80}; write for example range(1, 25)"
        ) from None
    if not numbers:
        raise ProjectError("the list of frames is empty; give at least one, such as 1-24")
    return numbers


def _remarks(done: Sequence[FrameResult]) -> list[str]:
    """Return the remarks on frames, each once, with the frames if they are not all that were drawn."""
    by: dict[str, list[int]] = {}
    for result in done:
        for line in result.remarks:
            by.setdefault(line, []).append(result.frame)
    drawn = sum(result.drawn for result in done)
    found = []
    for line, frames in by.items():
        which = f"frame{'s'[: len(frames) > 1]} {frames_text(frames)[:80]}: "
        found.append(line if len(frames) == drawn > 1 else which + line)
    more = len(found) - _MOST_REMARKS
    return [*found[:_MOST_REMARKS], f"and {more} more remarks on single frames"] if more > 0 else found


def _check(shutter_deg: float, subframes: int | None, parts: str) -> None:
    if not 0.0 <= shutter_deg <= 360.0:
        raise ProjectError(f"a shutter of {shutter_deg:g} degrees does not exist; give 0 to 360, 180 is usual")
    if subframes is not None and not 1 <= subframes <= 1000:
        raise ProjectError(f"{subframes} sub-frames are not possible; give 1 to 1000")
    if parts not in ("multi", "single"):
        raise ProjectError(f"parts {parts!r} is unknown; choose multi or single")


def _check_output(pattern: FramePattern) -> None:
    """Raise an error before the work if the files cannot be written."""
    path = Path(pattern.text)
    check_replaceable(path)
    if path.suffix.lower() != ".exr":
        raise OutputError(f"the output {pattern.text!r} must be named *.exr, such as flare.####.exr")
    if not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: the folder {path.parent} does not exist; create it first")


def _check_moments(plan: ShotPlan, frames: Sequence[int]) -> None:
    """Raise an error now for what cannot be used together at the first or last frame or at a key, or not be read."""
    from ..measure.replay.measured_project import is_measured
    from ..render.scene.resolve import resolve_project
    from .project_files import open_project_files
    from .shot_frame import frame_project

    project = plan.project
    first = time_of(frames[0], project.timeline)
    times = {first, time_of(frames[-1], project.timeline)}
    times |= {at_s for curve in project.curves for at_s in curve.at_s}
    for at_s in sorted(times):
        moment = frame_project(plan, at_s)
        try:
            if is_measured(moment):
                continue
            # the files of a drawn frame stand for those of all; frames of sequences are checked by their headers
            if at_s == first:
                open_project_files("the project", moment)
            else:
                resolve_project(moment)
        except FlarewrightError as error:
            raise type(error)(f"at {at_s:g} s: {error}" if at_s else str(error), error.problems) from None


def _process_bytes(plan: ShotPlan) -> int:
    """Return the memory that a process needs for a frame."""
    project = plan.project
    width, height = project.camera.size_px
    layers = 0
    if project.output.layers == "ghosts":
        # a blurred frame averages all ghosts before it chooses the brightest
        chosen = project.output.brightest if plan.shutter_deg == 0.0 else None
        layers = _MOST_LAYERS if chosen is None else chosen
    from ..render.image.ghost_ranking import RANK_BYTES

    # the ranks of a frame, those of a sub-frame's mean, and their layers
    ranks = 4 * project.output.matte_ranks if project.output.matte == "ghosts" else 0
    return _PROCESS_BYTES + width * height * (_PIXEL_BYTES + layers * _LAYER_BYTES + ranks * RANK_BYTES)
