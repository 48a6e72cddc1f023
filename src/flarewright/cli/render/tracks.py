"""`--track` and `--light-px`: lights whose places are given in pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import ProjectError
from ..common import first_run_bar, one_bar, one_of, pair, picture_size, print_remark

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...io.tracks.track import Origin, Track, TrackFile
    from ...model import Project
    from .options.record import RenderOptions


@dataclass(frozen=True, eq=False)
class GivenTrack:
    """A track of a file, and the light that the user wants it to move.

    Attributes
    ----------
    track : Track
    light : str or int or None
        Name or index of a light, "new", or None: by the track's name and order.
    file : TrackFile
    index : int
        Of the light that it moves (`with_lights`); one more than there are for a new light.
    """

    track: Track
    light: str | int | None
    file: TrackFile
    index: int = -1


def px_origin(text: str | None) -> Origin | None:
    """Return the corner of `--px-origin`."""
    if text is None:
        return None
    corner: Origin = one_of("--px-origin", text, ("top-left", "bottom-left"))
    return corner


def pixel_place(text: str) -> tuple[float, float]:
    """Return the pixels of a text X,Y or sun@X,Y."""
    x, y = pair(text.rpartition("@")[2], "--light-px", "640,360 (pixels)")
    if max(abs(x), abs(y)) > 1e7:
        raise ProjectError(f"--light-px {text!r} lies beyond every picture; write --light-px 640,360 (pixels)")
    return x, y


def from_top_left(text: str, origin: str | None, height_px: int) -> tuple[float, float]:
    """Return the pixels of a `--light-px` from the top left corner of a picture; `origin` is `--px-origin`."""
    x, y = pixel_place(text)
    return x, height_px - y if px_origin(origin) == "bottom-left" else y


def given_tracks(flags: RenderOptions, first_frame: int) -> tuple[GivenTrack, ...]:
    """Read the files of `--track`.

    Parameters
    ----------
    flags : RenderOptions
    first_frame : int
        Frame of the first line of a file without frames.

    Raises
    ------
    FlarewrightError
        A file has no tracks, or an option is none.
    """
    if not flags.track:
        for flag, value in (
            ("--track-format", flags.track_format), ("--track-size", flags.track_size),
            ("--track-offset", flags.track_offset),
        ):  # fmt: skip
            if value is not None:
                raise ProjectError(f"{flag} is for tracks: add --track FILE, or leave it out")
        return ()
    from ...io.tracks.read_tracks import read_tracks, track_format

    form = None if flags.track_format is None else track_format(flags.track_format)
    origin = px_origin(flags.px_origin)
    size = None if flags.track_size is None else picture_size(flags.track_size, "--track-size")
    offset = flags.track_offset or 0.0
    if not abs(offset) <= 1e7:
        raise ProjectError(f"--track-offset {offset:g} is no number of frames; give for example 1000")
    found = []
    for text in flags.track:
        light, path = _light_and_file(text)
        file = read_tracks(path, form, origin=origin, first_frame=first_frame)
        if light is not None and light != "new" and len(file.tracks) > 1:
            raise ProjectError(
                f"--track {text!r} has {len(file.tracks)} tracks for one light; export one, or omit {light}="
            )
        for track in file.tracks:
            # a size in parts of the picture is known for certain
            sized = track if size is None or track.size_px == (1.0, 1.0) else replace(track, size_px=size)
            found.append(GivenTrack(sized.shifted(offset), light, file))
    return tuple(found)


def _light_and_file(text: str) -> tuple[str | int | None, Path]:
    """Return the light and the file of a `--track`."""
    from ...io.files.door import expanded

    light, equals, path = text.partition("=")
    if not equals or expanded(text).exists() or "/" in light or "\\" in light:
        return None, Path(text)
    word = light.strip()
    if not word or not path.strip():
        raise ProjectError(f"--track {text!r} names no {'light' if path.strip() else 'file'}; write --track 0=sun.csv")
    return int(word) if word.isdecimal() and len(word) < 6 else word, Path(path)


def track_files(given: tuple[GivenTrack, ...]) -> tuple[TrackFile, ...]:
    """Return the files of tracks, each once."""
    return tuple({id(one.file): one.file for one in given}.values())


def with_given_tracks(
    project: Project,
    flags: RenderOptions,
    counted_px: tuple[int, int],
    *,
    fps_given: bool = False,
    start_given: bool = False,
) -> tuple[Project, list[str]]:
    """Return a project whose lights follow the tracks of the flags, and remarks."""
    from ...workflow.light_places import timeline_of_tracks, with_tracks

    given: tuple[GivenTrack, ...] = flags.tracked
    files = track_files(given)
    shifted = [replace(file, tracks=tuple(one.track for one in given if one.file is file)) for file in files]
    project, remarks = timeline_of_tracks(project, shifted, fps_given=fps_given, start_given=start_given)
    keep = {"intensity": bool(flags.intensity), "rgb": bool(flags.spectrum)}
    compile_places(project)
    with one_bar("tracks") as progress:
        project, found = with_tracks(
            project, tuple((one.index, one.track) for one in given), counted_px=counted_px,
            keep=frozenset(name for name, kept in keep.items() if kept), progress=progress,
        )  # fmt: skip
    lines = [line for file in files for line in file.remarks]
    return project, [*lines, *_without_effect(flags, files), *remarks, *found]


def _without_effect(flags: RenderOptions, files: Sequence[TrackFile]) -> list[str]:
    """Return remarks on options that the formats of the tracks leave without effect."""
    remarks = []
    formats = sorted({file.format for file in files})
    if flags.px_origin is not None and not flags.light_px and "csv" not in formats:
        remarks.append(f"--px-origin has no effect on tracks of {', '.join(formats)}, which have their own corner")
    if flags.track_size is not None and all(track.size_px == (1.0, 1.0) for file in files for track in file.tracks):
        remarks.append(
            f"--track-size has no effect on tracks of {', '.join(formats)}, which count in parts of the picture"
        )
    return remarks


def with_pixel_lights(
    project: Project, flags: RenderOptions, first: int, counted_px: tuple[int, int], *, over_time: bool = False
) -> tuple[Project, list[str]]:
    """Return a project whose lights of `--light-px` lie at their pixels, and remarks.

    Parameters
    ----------
    project : Project
    flags : RenderOptions
    first : int
        Index of the first of these lights.
    counted_px : tuple of int
        Size of the picture in which the pixels count.
    over_time : bool
        Whether the lights stay at their pixels while zoom and focus move.
    """
    from ...workflow.light_places import lights_at_pixels, resting_tracks, with_tracks

    places = {first + k: from_top_left(text, flags.px_origin, counted_px[1]) for k, text in enumerate(flags.light_px)}
    compile_places(project)
    if over_time and (tracks := resting_tracks(project, places)):
        return with_tracks(project, tracks, counted_px=counted_px)[0], []
    return lights_at_pixels(project, places, counted_px), []


def compile_places(project: Project) -> None:
    """Compile the kernels that place lights."""
    from ...measure.replay.measured_project import is_measured

    if not is_measured(project):
        from ...render.warmup import compile_for_render

        compile_for_render(project, None, print_remark, first_run_bar)


def with_lights(given: tuple[GivenTrack, ...], names: Sequence[str]) -> tuple[GivenTrack, ...]:
    """Return tracks with the index of the light that each moves.

    Parameters
    ----------
    given : tuple of GivenTrack
    names : sequence of str
        Names of the lights without the new ones of tracks.
    """
    from ...workflow.light_places import assigned

    moves = assigned([one.track.name for one in given], [one.light for one in given], names)
    return tuple(replace(one, index=index) for one, index in zip(given, moves, strict=True))


def with_new_lights(given: tuple[GivenTrack, ...], known: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the lights and a new one for each track that moves no known light; its place follows from the track."""
    new = {one.index: one.track for one in given if one.index >= len(known)}
    return [
        *known,
        *(
            {"field_deg": (0.0, 0.0), "name": track.name, "diameter_deg": track.diameter_deg}
            for _, track in sorted(new.items())
        ),
    ]
