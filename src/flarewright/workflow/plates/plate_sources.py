"""The sources of all frames of a plate: searched once for a whole shot, kept in a file beside its frames.

Which sources count depends on the frames before and after. So every process and every chunk of a shot uses the sources
of the whole list of frames, and finds the same ones.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256
from pathlib import Path

import numpy as np

from ..._version import __version__
from ...errors import ProjectError
from ...io.files.atomic_write import delete_written
from ...io.files.text_file import digest_of
from ...io.images.plate_picture import PlatePicture
from ...jobs.frame_list import FramePattern, frames_text
from ...jobs.processes import Executor, shares, work_off
from ...plates.detection import LUMINANCE, Sources, find_sources, log_average_luminance
from ...plates.joining import joined
from ...plates.lights import PlateTracks, plate_tracks
from ...plates.measured_plate import measured_pixels
from ...plates.settings import PlateSettings
from ...plates.tracking import SourceTrackSettings, Tracks, follow, steady
from ...typing import Floats, Report
from .kept_sources import read_sources, write_sources
from .plate_files import is_picture, plate_digest, plate_matte, plate_name, plate_picture

# frames whose mean sets a threshold in stops
_MEAN_FRAMES = 24
# part of the clipping value that a threshold in stops stays below
_BELOW_WHITE = 0.9
# frames for which a further process pays
_FRAMES_A_PROCESS = 6
# values of all tracks in all frames
_MOST_VALUES = 2e8
# seconds between two writes of the partial result
_SAVE_S = 10.0
_FIND = "flarewright.workflow.plates.plate_sources:sources_of_frame"


@dataclass(frozen=True)
class PlateShot:
    """What a shot knows about its plate.

    Attributes
    ----------
    settings : PlateSettings
    threshold : float
        Luminance above which pixels belong to sources.
    size_px : tuple of int
    pixel_aspect : float
    fps : Fraction or None
        As the plate states it.
    lights : PlateTracks
    found : tuple of int
        Number of sources in each frame.
    remarks : tuple of str
    clipped : bool
        Whether the plate clips a source: it is brighter than the plate shows.
    """

    settings: PlateSettings
    threshold: float
    size_px: tuple[int, int]
    pixel_aspect: float
    fps: Fraction | None
    lights: PlateTracks
    found: tuple[int, ...]
    remarks: tuple[str, ...]
    clipped: bool = False


@dataclass(frozen=True)
class _Search:
    """What the search in each frame shares."""

    settings: PlateSettings
    threshold: float
    size_px: tuple[int, int]


def sources_of_frame(search: _Search, frame: int, threads: int | None = None) -> tuple[Floats, int]:
    """Find the sources of one frame.

    Parameters
    ----------
    search : _Search
    frame : int
    threads : int, optional
        Not used: the search has one thread.

    Returns
    -------
    table : ndarray, shape (N, 10)
        `Sources.table`.
    frame : int

    Raises
    ------
    FlarewrightError
        The plate or its matte cannot be read or has another size, or the plate has too many sources.
    """
    del threads
    plate = plate_picture(search.settings, frame)
    if plate.size_px != search.size_px:
        raise ProjectError(
            f"{plate_name(search.settings, frame)} has {plate.size_px[0]}x{plate.size_px[1]} pixels, the "
            f"first frame {search.size_px[0]}x{search.size_px[1]}; give frames of one size"
        )
    found = find_sources(
        measured_pixels(plate, search.settings.highlights),
        search.threshold,
        matte=plate_matte(search.settings, frame, search.size_px),
        least_px=search.settings.least_px,
    )
    return found.table, frame


def sources_file(output: str, kind: str = "sources") -> Path:
    """Return the file beside the frames of a shot that keeps the sources of its plate.

    A list of the lights alone has another `kind`: it deletes its file, and must not delete a shot's.

    Examples
    --------
    >>> sources_file("out/flare.####.exr").as_posix(), sources_file("flare.exr").as_posix()
    ('out/flare.sources.npz', 'flare.sources.npz')
    """
    path = Path(output)
    return path.with_name(f"{FramePattern(path.name).stem}.{kind}.npz")


def plate_shot(
    settings: PlateSettings,
    frames: Sequence[int],
    *,
    kept: Path | None = None,
    processes: int = 1,
    report: Callable[[int, int, int], None] | None = None,
    executor: Executor | None = None,
    announce: Report = lambda _: None,
) -> PlateShot:
    """Find and follow the sources of a plate.

    Parameters
    ----------
    settings : PlateSettings
    frames : sequence of int
        All frames of the shot, ascending.
    kept : Path, optional
        File with the sources of finished frames; a repeated call searches only those whose plate has changed.
    processes : int
    report : callable, optional
        Called with the frame, the number of searched frames and the number of all.
    executor : Executor, optional
        Searches instead of processes of this machine.
    announce : callable, optional
        Called with a sentence if the file `kept` is damaged.

    Raises
    ------
    FlarewrightError
        The plates cannot be read, differ in size, or have no source at all, or `kept` is a file of another program.
    """
    first = plate_picture(settings, frames[0])
    still = is_picture(settings)
    threshold, remarks = _threshold(settings, frames[:1] if still else frames, first)
    search = _Search(settings, threshold, first.size_px)
    # one picture for all frames is searched once
    searched = _searched(search, frames[:1] if still else frames, kept, processes, report, executor, announce)
    found = [Sources.from_table(searched[frames[0] if still else frame]) for frame in frames]
    if not any(len(each) for each in found) and kept is not None:
        # an error leaves no file
        delete_written(kept)
    _check_number(found, settings, threshold, still=still)
    dark = [frame for frame, each in zip(frames, found, strict=True) if not len(each)]
    if dark:
        remarks.append(f"no source in frame{'s'[: len(dark) > 1]} {frames_text(dark)[:80]}")
    # a still needs no memory of what came before
    tracks = follow(
        frames[:1] if still else frames,
        found[:1] if still else found,
        first.size_px[0],
        SourceTrackSettings(longest_gap=settings.fade),
    )
    tracks = steady(tracks, threshold, settings.knee_stops, 0 if still else settings.fade)
    limited, joined_sources, groups = joined(tracks, settings.most_lights)
    if joined_sources:
        remarks.append(_joined_words(tracks, limited, joined_sources, groups))
    remarks += _unused(settings, first, still=still)
    clips_at = None
    if first.white is not None:
        clips_at = _BELOW_WHITE * (settings.highlights or first.white)
    lights = plate_tracks(
        limited, first.size_px, point_px=settings.point_px, gain=settings.gain, known=settings.source,
        white=settings.white, clips_at=clips_at, joined=groups,
    )  # fmt: skip
    return PlateShot(
        settings, threshold, first.size_px, first.pixel_aspect, first.fps, lights, tuple(len(each) for each in found),
        (*first.remarks, *remarks), clips_at is not None and bool((tracks.peak >= clips_at).any()),
    )  # fmt: skip


def _check_number(found: Sequence[Sources], settings: PlateSettings, threshold: float, *, still: bool) -> None:
    """Raise an error for a plate without a source, or with too many to follow."""
    number = sum(map(len, found))
    if not number:
        raise ProjectError(
            f"the plate has no source above {threshold:.3g}; lower --threshold or --stops"
            + (", or check the matte" if settings.matte else "")
        )
    # a track has nine values a frame; noise starts new tracks in every frame
    if 9.0 * number * len(found) > _MOST_VALUES and not still:
        raise ProjectError(
            f"the plate has {number} sources in {len(found)} frames, too many to follow; raise the "
            "threshold, or leave small ones out (--least-pixels 4)"
        )


def _joined_words(tracks: Tracks, limited: Tracks, joined_sources: int, groups: int) -> str:
    """Return the remark on sources that are joined to lights of many."""
    share = 1.0 - (limited.light[: len(limited) - groups] @ LUMINANCE).sum() / (tracks.light @ LUMINANCE).sum()
    return (
        f"{joined_sources} of {len(tracks)} sources, with {share:.1%} of the light, are joined to {groups} "
        f"light{'s'[: groups > 1]} with ghosts only; --most-lights allows more"
    )


def _unused(settings: PlateSettings, first: PlatePicture, *, still: bool) -> list[str]:
    """Return remarks on settings without effect on this plate."""
    remarks = []
    if still and settings.fade != PlateSettings.fade:
        remarks.append("--fade has no effect on a single plate, whose lights do not change")
    if settings.highlights is not None and first.white is None:
        remarks.append("--highlights has no effect on a plate of floating-point numbers, which does not clip")
    return remarks


def _threshold(settings: PlateSettings, frames: Sequence[int], first: PlatePicture) -> tuple[float, list[str]]:
    """Return the threshold of all frames, and a remark on it."""
    if settings.threshold is not None:
        return settings.threshold, []
    step = max(1, -(-len(frames) // _MEAN_FRAMES))
    pictures = [first, *(plate_picture(settings, frame) for frame in frames[step::step])]
    # a render is cropped to what it shows, and black around it would lower the mean
    shown = [measured_pixels(plate, settings.highlights)[plate.window] for plate in pictures]
    mean = float(np.mean([log_average_luminance(pixels) for pixels in shown]))
    if mean <= 0.0:
        raise ProjectError("the plate is black, so a threshold in stops above its mean is none; give --threshold")
    found = mean * 2.0**settings.stops
    words = f"sources are brighter than {found:.3g}, {settings.stops:g} stops above the plate's mean of {mean:.3g}"
    if first.white is not None and found > _BELOW_WHITE * (settings.highlights or first.white):
        found = _BELOW_WHITE * (settings.highlights or first.white)
        words = (
            f"sources are brighter than {found:.3g}, near the plate's white: {settings.stops:g} stops above its "
            f"mean of {mean:.3g} would lie beyond it"
        )
    return found, [f"{words}; --threshold sets another value"]


def _searched(
    search: _Search,
    frames: Sequence[int],
    kept: Path | None,
    processes: int,
    report: Callable[[int, int, int], None] | None,
    executor: Executor | None,
    announce: Report,
) -> dict[int, Floats]:
    """Return the sources of each frame, those in the file `kept` or new ones."""
    made_of = {frame: _made_of(search, frame) for frame in frames}
    known = {} if kept is None else read_sources(kept, announce)
    found = {frame: known[digest] for frame, digest in made_of.items() if digest in known}
    todo = [frame for frame in frames if frame not in found]
    # a process starts in the time of some frames
    number, each = shares(len(todo), min(processes, max(1, len(todo) // _FRAMES_A_PROCESS)))
    saved = time.monotonic()
    try:
        for one in work_off(_FIND, search, todo, processes=number, threads=each, what="frame", executor=executor):
            table, frame = one.result
            found[frame] = table
            if report is not None:
                report(frame, len(found), len(frames))
            if kept is not None and time.monotonic() - saved > _SAVE_S:
                write_sources(kept, {made_of[frame]: table for frame, table in found.items()})
                saved = time.monotonic()
    finally:
        # also after Ctrl-C
        if kept is not None and todo and found:
            write_sources(kept, {made_of[frame]: found[frame] for frame in frames if frame in found})
    return found


def _made_of(search: _Search, frame: int) -> str:
    """Return a digest of what determines the sources of a frame."""
    settings = search.settings
    # what the values of a pixel depend on; the rest is applied to the sources
    how = {"highlights": settings.highlights, "layer": settings.layer, "least_px": settings.least_px}
    how["transfer"] = settings.transfer
    plate = plate_digest(settings, frame)
    matte = None if settings.matte is None else digest_of(FramePattern(settings.matte).path(frame))
    parts = (__version__, repr(sorted(how.items())), repr(search.threshold), repr(search.size_px), plate, matte)
    return sha256(repr(parts).encode()).hexdigest()
