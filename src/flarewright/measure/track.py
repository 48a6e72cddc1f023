"""Follow the ghosts of a model from constellation to constellation, forward and backward.

The fit holds one set of numbers for all constellations and so foretells every ghost everywhere. Here each frame says
for itself how bright each ghost is, how far beside its place and how much larger, all ghosts of the frame at once. So a
ghost's birth and death are seen, and what one set of numbers misses becomes a curve (`measure.compact`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..model.ghost_tracks import GhostTrack, Life, State, Step, Tracks, Turn, Turning
from .curves import Pose
from .journal import Journal
from .shared_out import done_by
from .together import Measured, Shapes, measure_together
from .views import View

# as bright as this, in parts of what is foretold, a ghost is there
THERE = 0.35
# and that must be so many standard errors
SURE = 4.0
# a brightness known worse than this tells nothing
VAGUE = 0.3
# so little of a ghost's box inside the frame is nothing
LEAST_INSIDE = 0.03
# measured places from which the next is foretold
_HISTORY = 5
# a ghost that is said to lie farther off than this part of its own size, to be larger or smaller or brighter by these
# factors, is another one
_LOST, _LARGER, _BRIGHTER = 0.5, 1.5, 3.0

# of each ghost, where it was seen of late, and how
_Past = list[list[tuple[float, Pose]]]


def follow(
    names: Sequence[str],
    ghosts: Sequence[Shapes],
    views: Sequence[View],
    *,
    threads: int | None = None,
    tell: Callable[[float, str], None] = lambda _part, _words: None,
    journal: Journal | None = None,
) -> Tracks:
    """Follow all ghosts over all views.

    Parameters
    ----------
    names : sequence of str
    ghosts : sequence of tuple of Shape
        Red, green, blue.
    views : sequence of View
        By rising constellation, halo and star taken off.
    threads : int, optional
        Both ways at once when None; the tracks do not depend on it.
    tell : callable
        Gets the finished part and words.
    journal : Journal, optional
        Of an earlier run that was stopped; the result is the same with and without.

    Returns
    -------
    Tracks

    Notes
    -----
    The place of the next frame is foretold by a line through the last few in which the ghost was seen, as in Walch
    2017, section 7.3, once with rising and once with falling constellation; of the two, every frame keeps the one that
    explains it better. What is foretold only says where to begin: told values are the frame's own.
    """
    order = list(range(len(views)))
    if not ghosts:
        return Tracks(ghosts=())
    radii = np.array([abs(float(shapes[1].numbers[10])) for shapes in ghosts])
    steps = journal or Journal()
    up: dict[int, Measured] = {}
    down: dict[int, Measured] = {}
    both: list[_Past] = [[[] for _ in ghosts], [[] for _ in ghosts]]

    def look(k: int, past: _Past) -> Measured:
        view = views[k]
        return measure_together(ghosts, [_foretold(one, view.constellation_deg) for one in past], view)

    with ThreadPoolExecutor(min(threads or 2, 2)) as pool:
        for done, places in enumerate(zip(order, order[::-1], strict=True)):
            found = steps.step(partial(done_by, pool, look, places, both))
            for k, here, past, ways in zip(places, found, both, (up, down), strict=True):
                ways[k] = here
                for g, pose in enumerate(here.poses):
                    if _state(here, g, radii[g]) == "seen" and np.isfinite(here.error[g]).all():
                        past[g] = [*past[g], (views[k].constellation_deg, pose)][-_HISTORY:]
            tell((done + 1) / len(views), f"{views[places[0]].constellation_deg:.1f} degrees")
    measured = [down[k] if down[k].cost < up[k].cost else up[k] for k in order]
    angles = np.array([view.constellation_deg for view in views])
    tracks = []
    for g, name in enumerate(names):
        told = tuple(_step(one, g, float(angle), radii[g]) for one, angle in zip(measured, angles, strict=True))
        tracks.append(GhostTrack(name=name, lives=lives(told), steps=told))
    return Tracks(ghosts=tuple(tracks))


def _foretold(past: Sequence[tuple[float, Pose]], constellation_deg: float) -> Pose:
    """Foretell a pose by a straight line through the last ones; as the model says when there are none."""
    if not past:
        return Pose()
    brightness = min(max(past[-1][1].brightness, 0.3), 2.0)
    if len(past) < 3:
        return Pose(brightness, past[-1][1].along_px, past[-1][1].size)
    at = np.array([angle for angle, _ in past])
    values = np.array([(pose.along_px, pose.size) for _, pose in past])
    line = np.polynomial.polynomial.polyfit(at - at[-1], values, 1)
    # not farther than the captures have shown it go at once
    reach = min(abs(constellation_deg - at[-1]), abs(at[-1] - at[0]))
    along, size = line[0] + line[1] * np.sign(constellation_deg - at[-1]) * reach
    return Pose(brightness, float(along), float(np.clip(size, 0.5, 1.8)))


def _state(measured: Measured, ghost: int, radius: float) -> State:
    pose, error = measured.poses[ghost], measured.error[ghost, 0]
    if measured.inside[ghost] < LEAST_INSIDE:
        return "outside"
    if not error < VAGUE:
        return "hidden"
    astray = (
        abs(pose.along_px) > _LOST * radius + 2.0
        or not 1.0 / _LARGER < pose.size < _LARGER
        or pose.brightness > _BRIGHTER
    )
    if pose.brightness > THERE and pose.brightness > SURE * error and not astray:
        return "seen"
    return "hidden" if astray else "faint"


def _step(measured: Measured, ghost: int, constellation_deg: float, radius: float) -> Step:
    pose, error, state = measured.poses[ghost], measured.error[ghost], _state(measured, ghost, radius)
    known = np.isfinite(error) & (measured.inside[ghost] > 0.0)
    placed = known & (state == "seen")
    return Step(
        constellation_deg=constellation_deg, state=state, inside=float(measured.inside[ghost]),
        brightness=pose.brightness if known[0] else None, brightness_error=float(error[0]) if known[0] else None,
        along_px=pose.along_px if placed[1] else None, along_error_px=float(error[1]) if placed[1] else None,
        size=pose.size if placed[2] else None, size_error=float(error[2]) if placed[2] else None,
        crossing=float(measured.crossing[ghost]) if known[0] else 1.0,
    )  # fmt: skip


def lives(steps: Sequence[Step]) -> tuple[Life, ...]:
    """Tell births and deaths from what each frame says.

    Parameters
    ----------
    steps : sequence of Step
        By rising constellation.

    Returns
    -------
    tuple of Life
        By rising constellation. Frames that cannot tell end no life when it goes on behind them, and a single frame
        that stands out of its neighbours, seen or faint, begins and ends none.
    """
    there = _steadied(steps)
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
    return tuple(Life(birth=_turn(steps, a, -1), death=_turn(steps, b, 1)) for a, b in runs)


def _steadied(steps: Sequence[Step]) -> NDArray[np.bool_]:
    """Return where a ghost is there: frames that stand alone among telling neighbours follow these."""
    telling = [k for k, step in enumerate(steps) if step.state in ("seen", "faint")]
    out = np.array([step.state == "seen" for step in steps])
    for before, k, after in zip(telling, telling[1:], telling[2:], strict=False):
        if steps[before].state == steps[after].state != steps[k].state:
            out[k] = steps[before].state == "seen"
    return out


def _turn(steps: Sequence[Step], at: int, way: Literal[-1, 1]) -> Turn:
    """Say where a life begins (way -1) or ends (1) beside its outermost seen frame, and why."""
    here, beyond = steps[at].constellation_deg, at + way
    if not 0 <= beyond < len(steps):
        return Turn(constellation_deg=here, error_deg=0.0, how="range")
    after = steps[beyond]
    how: Turning = "fade"
    if after.state == "outside":
        how = "frame"
    elif after.state == "hidden":
        how = "frame" if _leaving(steps, at, way) else "hidden"
    part = 0.5
    a, b = steps[at].brightness, after.brightness
    if how == "fade" and a is not None and b is not None and a > b:
        # where the line between both crosses half of what is foretold
        part = float(np.clip((a - 0.5) / (a - b), 0.0, 1.0))
    step_deg = after.constellation_deg - here
    return Turn(constellation_deg=here + part * step_deg, error_deg=0.5 * abs(step_deg), how=how)


def _leaving(steps: Sequence[Step], at: int, way: int) -> bool:
    """Tell whether ever less of a ghost is inside the frame."""
    rest = [step.inside for step in (steps[at::-1] if way < 0 else steps[at:])]
    return rest[-1] < LEAST_INSIDE or (len(rest) > 1 and rest[1] < 0.5 * max(rest[0], 1e-9))
