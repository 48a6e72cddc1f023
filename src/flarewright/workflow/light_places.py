"""Lights whose places are given in pixels: single places, and tracks that become keyframes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ProjectError
from ..model import Light, LightCurve, LightKey, Project, Timeline
from ..model.project.animation import FIRST_FRAME, LAST_FRAME, LAST_S
from ..sentences import listed
from ..typing import Floats
from .keyframes import frame_rate, is_still, last_frame, light_at, project_at, still, time_of

if TYPE_CHECKING:
    from ..io.tracks.track import Track, TrackFile
    from ..render.scene.pixel_place import DirectImages
    from ..typing import Progress

# curves of a project that move the direct image of a light: all but the gains, which change only its brightness
_LENS_CURVES = frozenset({"zoom", "focus_distance", "f_number", "rotation_deg"})
# a light in a 3D scene is never farther from the axis than this, degrees
_FARTHEST_DEG = 89.9
# missing frames listed by their number
_LISTED = 5


class LightFinder:
    """Finds the field angles of lights at pixels of one project, which does not move.

    Parameters
    ----------
    project : Project
        Of a lens or of a measured flare.

    Notes
    -----
    A class for its cache: preparing the lens takes longer than a place.
    """

    def __init__(self, project: Project) -> None:
        from ..measure.replay.measured_project import is_measured
        from ..render.scene.resolve import resolve_project

        self._project = project
        self._settled = None if is_measured(project) else resolve_project(project)
        self._images: dict[tuple[object, ...], DirectImages] = {}

    def angles_at(
        self, light: Light, place_px: tuple[float, float], near_deg: tuple[float, float] | None = None
    ) -> tuple[float, float]:
        """Return the field angles of a light whose direct image lies at a place, degrees.

        Parameters
        ----------
        light : Light
            Its distance and spectrum count.
        place_px : tuple of float
            Column and row from the top left corner of the picture; the first pixel's centre is (0.5, 0.5).
        near_deg : tuple of float, optional
            Field angles of a place near by.

        Raises
        ------
        ProjectError
            The lens images no light there.
        """
        if self._settled is None:
            from ..measure.replay.light_place import measured_angles_at

            return measured_angles_at(self._project, place_px)
        from ..optics.colour.spectrum import traced_wavelengths
        from ..render.scene.pixel_place import direct_images, field_angles_at

        traced = tuple(traced_wavelengths(self._project.quality.wavelengths, light.spectrum).tolist())
        key = (light.distance, traced)
        if key not in self._images:
            self._images[key] = direct_images(self._settled, light)
        return field_angles_at(self._images[key], place_px, near_deg)


def lights_at_pixels(
    project: Project, places: Mapping[int, tuple[float, float]], counted_px: tuple[int, int] | None = None
) -> Project:
    """Move lights of a project to places in its picture.

    Parameters
    ----------
    project : Project
        Lens, zoom and focus have the values at which it rests.
    places : mapping of int to tuple of float
        Column and row by index of light, from the top left corner; the first pixel's centre is (0.5, 0.5).
    counted_px : tuple of int, optional
        Size of the picture in which the places count, about the same axis; None: the project's. With overscan the
        project's is larger.

    Raises
    ------
    ProjectError
        The lens images no light at a place.

    Examples
    --------
    >>> from flarewright import Camera, Light, Project
    >>> project = Project(lens="heliar-tronnier", lights=[Light(field_deg=(0, 0))], camera=Camera(size_px=(1920, 1080)))
    >>> lights_at_pixels(project, {0: (960.0, 540.0)}).lights[0].field_deg           # doctest: +SKIP
    (0.0, 0.0)
    """
    finder = LightFinder(project)
    lights = list(project.lights)
    for index, place in places.items():
        light = lights[index]
        lights[index] = light.replace(field_deg=finder.angles_at(light, _shifted(place, counted_px, project)))
    return project.replace(lights=tuple(lights))


def resting_tracks(project: Project, places: Mapping[int, tuple[float, float]]) -> list[tuple[int, Track]]:
    """Return tracks of lights that stay at their pixels while zoom, focus, f-number or iris move.

    Parameters
    ----------
    project : Project
        With its curves.
    places : mapping of int to tuple of float
        As of `lights_at_pixels`.

    Returns
    -------
    list of (int, Track)
        For `with_tracks`; empty if the lens does not move.
    """
    from ..io.tracks.track import Track

    if not any(curve.of in _LENS_CURVES for curve in project.curves):
        return []
    frames = np.arange(project.timeline.start, last_frame(project) + 1, dtype=np.float64)
    return [(index, Track("--light-px", frames, np.tile(place, (len(frames), 1)))) for index, place in places.items()]


def assigned(names: Sequence[str], wanted: Sequence[str | int | None], lights: Sequence[str]) -> tuple[int, ...]:
    """Return the index of the light that each track moves; from the number of lights on, a new light.

    Parameters
    ----------
    names : sequence of str
        Names of the tracks.
    wanted : sequence of (str or int or None)
        For each track an index or a name of a light, "new", or None: the light of the track's name, else the first
        light without a track, else a new one.
    lights : sequence of str
        Names of the lights.

    Returns
    -------
    tuple of int

    Raises
    ------
    ProjectError
        There is no such light, or two tracks move one.

    Examples
    --------
    >>> assigned(["Lamp", "track1", "track2"], [None, None, None], ["sun", "lamp"])
    (1, 0, 2)
    """
    known = [name.strip().lower() for name in lights]
    found: list[int | None] = []
    for name, want in zip(names, wanted, strict=True):
        if isinstance(want, int):
            if not 0 <= want < len(lights):
                known_ones = f"the lights are 0 to {len(lights) - 1}" if lights else "no light is given"
                raise ProjectError(f"--track: there is no light {want}: {known_ones}; give another index, or new")
            found.append(want)
        elif want is not None and want != "new":
            if known.count(want.lower()) != 1:
                many = "no light" if want.lower() not in known else "more than one light"
                raise ProjectError(f"--track: {many} has the name {want!r}; give its index, counted from 0, or new")
            found.append(known.index(want.lower()))
        elif want is None and known.count(name.strip().lower()) == 1:
            found.append(known.index(name.strip().lower()))
        else:
            found.append(None)
    taken = [index for index in found if index is not None]
    twice = next((index for index in taken if taken.count(index) > 1), None)
    if twice is not None:
        raise ProjectError(f"--track: two tracks move light {twice} (counted from 0); keep one, or give one to new")
    free = iter([index for index in range(len(lights)) if index not in taken])
    new = len(lights)
    for k, index in enumerate(found):
        if index is None:
            found[k] = next(free, None) if wanted[k] != "new" else None
            if found[k] is None:
                found[k], new = new, new + 1
    return tuple(index for index in found if index is not None)


def timeline_of_tracks(
    project: Project, files: Sequence[TrackFile], *, fps_given: bool = False, start_given: bool = False
) -> tuple[Project, list[str]]:
    """Return a project whose timeline begins with its tracks, and remarks.

    Parameters
    ----------
    project : Project
    files : sequence of TrackFile
    fps_given, start_given : bool
        Whether the caller has set them; they then stay, as do those of a project that moves or states a start.

    Returns
    -------
    project : Project
    remarks : list of str

    Raises
    ------
    ProjectError
        A track states frames per second or a first frame that no shot has.
    """
    timeline, remarks = project.timeline, []
    resting = is_still(project)
    rates = [file.fps for file in files if file.fps is not None]
    wrong = next((fps for fps in rates if not 0.01 <= fps <= 1000.0), None)
    if wrong is not None:
        raise ProjectError(f"the track states {wrong:g} frames per second; correct it, 0.01 to 1000 are possible")
    # 23.976 and 23.98 are one rate
    stated = {frame_rate(fps): fps for fps in rates}
    if len(stated) > 1:
        several = ", ".join(f"{fps:g}" for fps in sorted(stated.values()))
        remarks.append(
            f"the tracks have {several} frames per second and the shot {timeline.fps:g}: frames keep numbers"
        )
    if len(stated) == 1 and frame_rate(fps := rates[0]) != frame_rate(timeline.fps):
        if resting and not fps_given:
            timeline = timeline.replace(fps=fps)
            remarks.append(f"{fps:g} frames per second, as the track states; --fps sets another number")
        else:
            remarks.append(
                f"the track has {fps:g} frames per second and the shot {timeline.fps:g}: frames keep numbers"
            )
    first = int(np.floor(min(float(track.frames[0]) for file in files for track in file.tracks)))
    # a project that states its start keeps it
    if first != timeline.start and resting and not start_given and timeline.start == Timeline().start:
        if not FIRST_FRAME <= first <= LAST_FRAME:
            raise ProjectError(f"a track begins at frame {first}; frames are {FIRST_FRAME} to {LAST_FRAME}")
        timeline = timeline.replace(start=first)
        remarks.append(f"the shot begins with frame {first}, the first of its tracks; --start sets another one")
    return project.replace(timeline=timeline), remarks


def with_tracks(
    project: Project,
    moves: Sequence[tuple[int, Track]],
    *,
    counted_px: tuple[int, int] | None = None,
    keep: frozenset[str] = frozenset(),
    progress: Progress | None = None,
) -> tuple[Project, list[str]]:
    """Give lights of a project the paths of tracks, one keyframe a frame.

    Parameters
    ----------
    project : Project
        Its timeline gives the times of the frames; its curves move zoom and focus under the tracks.
    moves : sequence of (int, Track)
        Index of a light and its track.
    counted_px : tuple of int, optional
        Size of the picture in which tracks of unknown size count; None: the project's.
    keep : frozenset of str
        "intensity" or "rgb": the track's is not used.
    progress : callable, optional
        Called with the finished part and the name of the track.

    Returns
    -------
    project : Project
    remarks : list of str

    Raises
    ------
    ProjectError
        A frame lies before 0 s, or the lens images no light at a place of a track.

    Notes
    -----
    Each place is inverted through the traced direct image of that frame, so that the direct image is drawn there
    (`render.scene.pixel_place`). A light of a 3D scene beyond the field that the lens images keeps its direction.
    """
    remarks: list[str] = []
    lights = list(project.lights)
    moving = any(curve.of in _LENS_CURVES for curve in project.curves)
    finder: LightFinder | None = None
    done, total = 0, sum(len(track.frames) for _, track in moves)
    size = counted_px or project.camera.size_px
    last = max([last_frame(project), *(ceil(track.frames[-1]) for _, track in moves)])
    for index, track in moves:
        light, label = lights[index], f"track {track.name!r}"
        _check_times(track, project)
        remarks += [*_remarks_on(track, size, index), *_rests(track, project.timeline.start, last, moving)]
        keys: list[LightKey] = []
        beyond = 0
        for k, (frame, place) in enumerate(zip(track.frames, track.from_top_left(size), strict=True)):
            done += 1
            if track.hidden is not None and track.hidden[k]:
                continue
            at_s = time_of(float(frame), project.timeline)
            if finder is None or moving:
                finder = LightFinder(still(project_at(project, at_s)))
            near = keys[-1].field_deg if keys else None
            shown = _shifted((float(place[0]), float(place[1])), counted_px, project)
            try:
                angles = finder.angles_at(light_at(light, at_s), shown, near)
            except ProjectError as error:
                if track.directions is None:
                    raise ProjectError(f"{label}, frame {frame:g}: {error}") from None
                angles, beyond = _direction(track.directions[k]), beyond + 1
            keys.append(LightKey(at_s=at_s, field_deg=angles))
            if progress is not None:
                progress(done / total, track.name)
        if beyond:
            remarks.append(
                f"{label}: {beyond} frames lie beyond the field of the lens; there the light keeps its direction"
            )
        lights[index] = _moved(light, track, keys, project, keep)
    moved: Project = project.replace(lights=tuple(lights))
    return moved, remarks


def _moved(light: Light, track: Track, keys: list[LightKey], project: Project, keep: frozenset[str]) -> Light:
    """Return a light with the keys, the intensities and the colours of a track."""
    times = tuple(time_of(float(frame), project.timeline) for frame in track.frames)
    curves: dict[str, Any] = {curve.of: curve for curve in light.curves}
    levels: Floats | None = None if "intensity" in keep else track.intensity
    if track.hidden is not None:
        # a light behind the camera is dark whatever its intensity
        known = [light_at(light, at_s).intensity for at_s in times] if levels is None else levels
        levels = np.where(track.hidden, 0.0, known)
    if levels is not None:
        curves["intensity"] = LightCurve(of="intensity", at_s=times, values=tuple(levels.tolist()))
    if track.rgb is not None and "rgb" not in keep:
        curves.pop("temperature_k", None)
        curves["rgb"] = LightCurve(of="rgb", at_s=times, values=tuple(map(tuple, track.rgb.tolist())))
    changes: dict[str, Any] = {
        "field_deg": keys[0].field_deg, "keyframes": tuple(keys), "motion": "linear", "curves": tuple(curves.values()),
    }  # fmt: skip
    if track.diameter_deg > 0.0 and not light.extended:
        changes["diameter_deg"] = track.diameter_deg
    return light.replace(**changes)


def _check_times(track: Track, project: Project) -> None:
    """Raise an error for a frame before 0 s."""
    first, start = float(track.frames[0]), project.timeline.start
    if first < start:
        raise ProjectError(
            f"track {track.name!r} begins at frame {first:g}, before frame {start} at 0 s; give --start {first:.0f}, "
            f"or --track-offset {start - first:.0f} if its frames have other numbers"
        )
    last_s = time_of(float(track.frames[-1]), project.timeline)
    if last_s > LAST_S:
        raise ProjectError(
            f"track {track.name!r} ends at frame {track.frames[-1]:g}, {last_s:g} s after frame {start}; a shot has at "
            f"most {LAST_S:g} s, so check its frames"
        )


def _remarks_on(track: Track, size_px: tuple[int, int], index: int) -> list[str]:
    """Return remarks on what a track does: its light, its scale, its missing frames."""
    label = f"track {track.name!r}"
    first, last = track.frames[0], track.frames[-1]
    when = f"in frames {first:g} to {last:g}" if last > first else f"at frame {first:g}"
    found = [f"{label} moves light {index} (counted from 0) {when}"]
    own = track.size_px
    if own is not None and own != (1.0, 1.0) and own != tuple(size_px):
        words = f"{label}: places in {own[0]:g}x{own[1]:g} pixels are scaled to {size_px[0]}x{size_px[1]}"
        if abs(own[0] / own[1] / (size_px[0] / size_px[1]) - 1.0) > 0.01:
            words += ", whose proportions differ"
        found.append(words)
    steps = np.diff(track.frames)
    if len(steps) > 1 and steps[0] > 1.001 and np.ptp(steps) == 0.0:
        found.append(f"{label} has one frame in {steps[0]:g}: straight lines between them")
    elif (wide := np.flatnonzero(steps > 1.001)).size:
        gaps = [f"{track.frames[k] + 1:g}" + (f"-{track.frames[k + 1] - 1:g}" if steps[k] > 2.0 else "") for k in wide]
        found.append(f"{label} has no frames {listed(gaps, _LISTED, 'gaps')}: straight lines between their neighbours")
    return found


def _rests(track: Track, start: int, last: int, moving: bool) -> list[str]:
    """Return a remark on frames of the shot, `start` to `last`, before the track starts or after it ends."""
    outside = [f"before frame {track.frames[0]:g}"] if track.frames[0] > start else []
    outside += [f"after frame {track.frames[-1]:g}"] if track.frames[-1] < last else []
    if not outside:
        return []
    # a light that rests before a camera that rests keeps its angles, whatever the zoom
    pixel = " at its field angles, so its pixel moves with the lens" if moving else ""
    return [f"track {track.name!r}: {' and '.join(outside)} the light rests{pixel}"]


def _direction(slope: Floats) -> tuple[float, float]:
    """Return the field angles of a direction, within those that a light can have."""
    x, y = np.clip(np.degrees(np.arctan(slope)), -_FARTHEST_DEG, _FARTHEST_DEG)
    return float(x), float(y)


def _shifted(place: tuple[float, float], counted_px: tuple[int, int] | None, project: Project) -> tuple[float, float]:
    """Return a place in the project's picture, which has the same middle as the one in which it counts."""
    (width, height), (own_width, own_height) = project.camera.size_px, counted_px or project.camera.size_px
    return place[0] + 0.5 * (width - own_width), place[1] + 0.5 * (height - own_height)
