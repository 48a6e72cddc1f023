"""Track the ghosts of a model from constellation to constellation, forward and backward.

The fit predicts every ghost at every constellation from one set of parameters. Tracking measures the brightness, shift
and size of all ghosts of a frame at once, independently for each frame. This shows where a ghost appears and
disappears. `measure.compression.prune` turns the deviations from the prediction into curves.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Literal

import numpy as np

from ...model.measurement.ghost_tracks import GhostTrack, Life, State, Step, Tracks, Turn, Turning
from ...typing import Mask, Progress
from ..core.checkpoint import Journal
from ..core.parallel import done_by
from ..core.pose_curves import Pose
from ..core.views import View
from .frame_fit import Measured, Shapes, measure_some
from .settings import TrackingSettings

# for each ghost, its latest constellations and poses
_History = list[list[tuple[float, Pose]]]


def follow(
    names: Sequence[str], ghosts: Sequence[Shapes], views: Sequence[View], *,
    spans: Sequence[tuple[float, float]] = (), threads: int | None = None,
    progress: Progress = lambda _part, _words: None, journal: Journal | None = None,
    settings: TrackingSettings = TrackingSettings(),
) -> Tracks:  # fmt: skip
    """Track all ghosts over all views.

    Parameters
    ----------
    names : sequence of str
    ghosts : sequence of tuple of Shape
        Red, green, blue.
    views : sequence of View
        In order of rising constellation, with halo and star subtracted.
    spans : sequence of tuple of float
        First and last constellation at which the fit shows each ghost; empty: unknown. A path that lights only away
        from the axis is a ghost on each side, both of one shape: a frame of the other side is not measured.
    threads : int, optional
        None: two, one per direction; the tracks do not depend on it.
    progress : callable
        Receives the finished fraction and a text.
    journal : Journal, optional
        Resumes an interrupted run; the result does not depend on it.
    settings : TrackingSettings

    Notes
    -----
    A line through the last few frames that show a ghost predicts its pose in the next, as in Walch 2017, section 7.3.
    Two passes run with rising and falling constellation; each frame keeps the pass with the lower cost. The prediction
    only provides start values: the of_ghost values are measured in the frame.
    """
    order = list(range(len(views)))
    if not ghosts:
        return Tracks(ghosts=())
    radii = np.array([abs(float(shapes[1].numbers[10])) for shapes in ghosts])
    steps = journal or Journal()
    up: dict[int, Measured] = {}
    down: dict[int, Measured] = {}
    both: list[_History] = [[[] for _ in ghosts], [[] for _ in ghosts]]

    def measure(k: int, past: _History) -> Measured:
        view = views[k]
        some = [g for g in range(len(ghosts)) if not spans or not _is_beyond_axis(spans[g], view.constellation_deg)]
        poses = [_predicted(one, view.constellation_deg, settings) for one in past]
        return measure_some(ghosts, some, poses, view, settings=settings.frame)

    with ThreadPoolExecutor(min(threads or 2, 2)) as pool:
        for done, places in enumerate(zip(order, order[::-1], strict=True)):
            found = steps.step(partial(done_by, pool, measure, places, both))
            for k, here, past, results in zip(places, found, both, (up, down), strict=True):
                results[k] = here
                for g, pose in enumerate(here.poses):
                    if _state(here, g, radii[g], settings) == "seen" and np.isfinite(here.error[g]).all():
                        past[g] = [*past[g], (views[k].constellation_deg, pose)][-settings.history :]
            progress((done + 1) / len(views), f"{views[places[0]].constellation_deg:.1f} degrees")
    measured = [down[k] if down[k].cost < up[k].cost else up[k] for k in order]
    angles = np.array([view.constellation_deg for view in views])
    tracks = []
    for g, name in enumerate(names):
        of_ghost = tuple(
            _step(one, g, float(angle), radii[g], settings) for one, angle in zip(measured, angles, strict=True)
        )
        tracks.append(GhostTrack(name=name, lives=lives(of_ghost, settings), steps=of_ghost))
    return Tracks(ghosts=tuple(tracks))


def _is_beyond_axis(span_deg: tuple[float, float], constellation_deg: float) -> bool:
    """Return whether a constellation lies on the other side of the axis than a whole range."""
    low, high = span_deg
    return low >= 0.0 > constellation_deg or high <= 0.0 < constellation_deg


def _predicted(past: Sequence[tuple[float, Pose]], constellation_deg: float, settings: TrackingSettings) -> Pose:
    """Extrapolate a pose by a straight line through the latest ones; without any, return the pose of the model."""
    if not past:
        return Pose()
    brightness = float(np.clip(past[-1][1].brightness, *settings.predicted_brightness))
    if len(past) < 3:
        return Pose(brightness, past[-1][1].along_px, past[-1][1].size)
    at = np.array([angle for angle, _ in past])
    values = np.array([(pose.along_px, pose.size) for _, pose in past])
    line = np.polynomial.polynomial.polyfit(at - at[-1], values, 1)
    # extrapolate no farther than the range of the latest poses
    reach = min(abs(constellation_deg - at[-1]), abs(at[-1] - at[0]))
    along, size = line[0] + line[1] * np.sign(constellation_deg - at[-1]) * reach
    return Pose(brightness, float(along), float(np.clip(size, *settings.predicted_size)))


def _state(measured: Measured, ghost: int, radius: float, settings: TrackingSettings) -> State:
    pose, error = measured.poses[ghost], measured.error[ghost, 0]
    if measured.inside[ghost] < settings.least_inside:
        return "outside"
    if not error < settings.vague:
        return "hidden"
    astray = (
        abs(pose.along_px) > settings.most_shift * radius + 2.0
        or not 1.0 / settings.most_size_factor < pose.size < settings.most_size_factor
        or pose.brightness > settings.most_brightness
    )
    if pose.brightness > settings.there and pose.brightness > settings.sure * error and not astray:
        return "seen"
    return "hidden" if astray else "faint"


def _step(measured: Measured, ghost: int, constellation_deg: float, radius: float, settings: TrackingSettings) -> Step:
    pose, error, state = measured.poses[ghost], measured.error[ghost], _state(measured, ghost, radius, settings)
    known = np.isfinite(error) & (measured.inside[ghost] > 0.0)
    placed = known & (state == "seen")
    return Step(
        constellation_deg=constellation_deg, state=state, inside=float(measured.inside[ghost]),
        brightness=pose.brightness if known[0] else None, brightness_error=float(error[0]) if known[0] else None,
        along_px=pose.along_px if placed[1] else None, along_error_px=float(error[1]) if placed[1] else None,
        size=pose.size if placed[2] else None, size_error=float(error[2]) if placed[2] else None,
        crossing=float(measured.crossing[ghost]) if known[0] else 1.0,
    )  # fmt: skip


def lives(steps: Sequence[Step], settings: TrackingSettings = TrackingSettings()) -> tuple[Life, ...]:
    """Find the births and deaths of a ghost in its measurements.

    Parameters
    ----------
    steps : sequence of Step
        In order of rising constellation.
    settings : TrackingSettings

    Returns
    -------
    tuple of Life
        In order of rising constellation. A life continues across frames that are undecided (hidden or outside). A
        single frame, seen or faint, that differs from its neighbours neither begins nor ends a life.
    """
    there = _shown_mask(steps)
    seen = np.flatnonzero(there)
    if not seen.size:
        return ()
    faint = [k for k, step in enumerate(steps) if step.state == "faint" and not there[k]]
    runs: list[tuple[int, int]] = []
    first = last = int(seen[0])
    for k in map(int, seen[1:]):
        if any(last < gap < k for gap in faint):
            runs.append((first, last))
            first = k
        last = k
    runs.append((first, last))
    return tuple(Life(birth=_turn(steps, a, -1, settings), death=_turn(steps, b, 1, settings)) for a, b in runs)


def _shown_mask(steps: Sequence[Step]) -> Mask:
    """Return the mask of frames that show a ghost; a single frame between two equal neighbours takes their state."""
    decided = [k for k, step in enumerate(steps) if step.state in ("seen", "faint")]
    out = np.array([step.state == "seen" for step in steps])
    for before, k, after in zip(decided, decided[1:], decided[2:], strict=False):
        if steps[before].state == steps[after].state != steps[k].state:
            out[k] = steps[before].state == "seen"
    return out


def _turn(steps: Sequence[Step], at: int, way: Literal[-1, 1], settings: TrackingSettings) -> Turn:
    """Return where and why a life begins (way -1) or ends (way 1) beyond its outermost seen frame."""
    here, beyond = steps[at].constellation_deg, at + way
    if not 0 <= beyond < len(steps):
        return Turn(constellation_deg=here, error_deg=0.0, how="range")
    after = steps[beyond]
    how: Turning = "fade"
    if after.state == "outside":
        how = "frame"
    elif after.state == "hidden":
        how = "frame" if _leaving(steps, at, way, settings) else "hidden"
    part = 0.5
    a, b = steps[at].brightness, after.brightness
    if how == "fade" and a is not None and b is not None and a > b:
        # interpolate to half of the predicted brightness
        part = float(np.clip((a - 0.5) / (a - b), 0.0, 1.0))
    step_deg = after.constellation_deg - here
    return Turn(constellation_deg=here + part * step_deg, error_deg=0.5 * abs(step_deg), how=how)


def _leaving(steps: Sequence[Step], at: int, way: int, settings: TrackingSettings) -> bool:
    """Return whether a ghost leaves the frame beyond a view."""
    rest = [step.inside for step in (steps[at::-1] if way < 0 else steps[at:])]
    return rest[-1] < settings.least_inside or (len(rest) > 1 and rest[1] < 0.5 * max(rest[0], 1e-9))
