"""Find ghosts that shrink and slow down as the light moves off axis, including flat and crescent-shaped ones.

The first surfaces of a wide-angle lens are deep menisci. They reflect light into a crescent near the picture's border
that hardly moves: its position is not proportional to the field, and its size changes. A proportional position and a
constant size, both divided by 1 + c w with w the square of the field, describe it well
(`kernels.ghost_model.pupil_mesh`). A few values of c suffice for the search; the later fit refines c.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ...typing import Floats
from .rim_voting import USUAL, RimCandidate, Slopes, searched
from .settings import CrescentSettings, DetectionSettings, RimSettings


def crescents(
    slopes: Slopes, width: int, pool: ThreadPoolExecutor | None = None,
    settings: DetectionSettings = DetectionSettings(),
) -> list[RimCandidate]:  # fmt: skip
    """Return the best candidates, best first, without candidates close to a better one.

    Parameters
    ----------
    slopes : Slopes
    width : int
        Width of the full picture, pixels.
    pool : executor, optional
    settings : DetectionSettings
    """
    found = [
        candidate for below in settings.crescents.below for side in (1.0, -1.0)
        for candidate in _on_one_side(slopes, width, below, side, pool, settings)
    ]  # fmt: skip
    best: list[RimCandidate] = []
    for candidate in sorted(found, key=lambda each: -each.score):
        if len(best) == settings.crescents.most:
            break
        if not any(_same(candidate, other, slopes.sigmas, settings.crescents) for other in best):
            best.append(candidate)
    return best


def crescent_outline(flat: float, bent: float, side: float, settings: RimSettings = RimSettings()) -> Floats:
    """Return the outline for the voting: an ellipse with its ends bent towards the axis.

    Parameters
    ----------
    flat : float
        Length along the line through axis and light, over the height.
    bent : float
        Distance by which the ends lie nearer to the axis than the middle, over half the height.
    side : float
        1: on the side of the light; -1: on the opposite side of the axis.
    settings : RimSettings

    Returns
    -------
    ndarray, shape (P, 4)
        Points and normals in the format of `kernels.ghost_model.hough.rim_outline_points`, along the line and
        downwards.
    """
    turn = 2.0 * np.pi * (np.arange(settings.points) + 0.5) / settings.points
    along, down = flat * np.cos(turn) - bent * np.sin(turn) ** 2, np.sin(turn)
    # normal of X^2 / flat^2 + y^2 = 1, with X = x + bent y^2
    normal = np.stack([np.cos(turn), flat * np.sin(turn) + 2.0 * bent * np.sin(turn) * np.cos(turn)])
    normal /= np.hypot(*normal)
    return np.stack([side * along, down, side * normal[0], normal[1]], axis=1)


def _on_one_side(
    slopes: Slopes, width: int, below: float, side: float, pool: ThreadPoolExecutor | None, settings: DetectionSettings
) -> list[RimCandidate]:
    """Return the best candidates on one side of the axis, including near duplicates."""
    at_usual = 1.0 + below * USUAL**2
    frames = slopes.frames.copy()
    frames[:, 4] *= at_usual / (1.0 + below * slopes.sigmas**2)
    rims = np.stack([crescent_outline(flat, bent, side, settings.rims) for flat, bent in settings.crescents.forms])
    speeds = side * width * np.arange(settings.crescents.step, settings.crescents.most_speed, settings.crescents.step)
    sizes = width * np.geomspace(settings.crescents.least_size, settings.crescents.most_size, settings.crescents.sizes)

    scores, runs = searched(
        replace(slopes, frames=frames), speeds, sizes, rims, turning=True, pool=pool, settings=settings.rims
    )
    best = []
    for place in np.argsort(scores, axis=None)[::-1][: settings.crescents.compared]:
        s, r = np.unravel_index(place, scores.shape)
        if scores[s, r] <= 0.0:
            break
        first, last, form = (int(each) for each in runs[s, r])
        flat, bent = settings.crescents.forms[form]
        size = float(sizes[r]) * at_usual
        seen = float(scores[s, r])
        crescent = RimCandidate(float(speeds[s]) * at_usual, size, first, last, seen, below=below, flat=flat, bent=bent)
        best.append(crescent)
    return best


def _same(a: RimCandidate, b: RimCandidate, sigmas: Floats, settings: CrescentSettings) -> bool:
    """Return whether two candidates agree in the middle of their common views."""
    first, last = max(a.first, b.first), min(a.last, b.last)
    if first > last:
        return False
    sigma = float(sigmas[(first + last) // 2])
    sizes = [each.size(sigma) for each in (a, b)]
    near = settings.most_distance * 0.5 * sum(sizes) + 1.0
    return (
        abs(a.place(sigma) - b.place(sigma)) < near
        and abs(sizes[0] - sizes[1]) < settings.most_size_difference * max(sizes) + 1.0
    )
