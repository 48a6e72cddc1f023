"""Find ghosts that shrink and slow down as the light leaves the axis, low and bent ones among them.

The first surfaces of a wide lens, deep menisci, lay light of the whole picture down as a lune near its border that
hardly moves: neither its place nor its size is that of a circle that goes in proportion to the field. Divided by
1 + c w, w the square of the field, they nearly are (`kernels.measure_pupil`); a few values of c do for a search, for a
ghost is found where one of them fits, and fitted in all constellations.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from .find import SPOTS, USUAL, Candidate, Slopes, searched
from .numbers import Floats

# what place and size are divided by; how long along the light's line, part of the height, and how bent
_BELOW = (1.5, 4.0)
_FORMS = ((1.0, 0.0), (0.5, 0.0), (0.3, 0.2), (0.2, 0.15))
# part of the width: steps of the place over the field, its largest, and half heights, all at field `USUAL`
_STEP, _FARTHEST, _LEAST, _LARGEST, _SIZES = 0.004, 1.3, 0.012, 0.45, 40
# how many of a search's best are compared with each other
_BEST = 400
# two are one that are, in the middle of what both saw, nearer than this part of their sizes, and as large but for this
_NEAR, _AS_LARGE = 0.3, 0.4


def lunes(slopes: Slopes, width: int, *, most: int = 8, pool: ThreadPoolExecutor | None = None) -> list[Candidate]:
    """Return the best candidates, best first, none close to a better one.

    Parameters
    ----------
    slopes : Slopes
    width : int
        Of the full picture, pixels.
    most : int
    pool : executor, optional
    """
    found = [
        candidate
        for below in _BELOW
        for side in (1.0, -1.0)
        for candidate in _on_one_side(slopes, width, below, side, pool)
    ]
    best: list[Candidate] = []
    for candidate in sorted(found, key=lambda each: -each.score):
        if len(best) == most:
            break
        if not any(_same(candidate, other, slopes.sigmas) for other in best):
            best.append(candidate)
    return best


def lune_outline(flat: float, bent: float, side: float) -> Floats:
    """Return the border along which a search votes, shape (P, 4): an ellipse whose ends are bent to the axis.

    Parameters
    ----------
    flat : float
        How long it is along the light's line, part of its height.
    bent : float
        By how much its ends lie nearer to the axis than its middle, part of half its height.
    side : float
        1 towards the light, -1 beyond the axis.

    Returns
    -------
    ndarray, shape (P, 4)
        As `kernels.measure_hough.outline` fills it, along the light's line and downwards.
    """
    turn = 2.0 * np.pi * (np.arange(SPOTS) + 0.5) / SPOTS
    along, down = flat * np.cos(turn) - bent * np.sin(turn) ** 2, np.sin(turn)
    # of X^2 / flat^2 + y^2 = 1, with X = x + bent y^2
    normal = np.stack([np.cos(turn), flat * np.sin(turn) + 2.0 * bent * np.sin(turn) * np.cos(turn)])
    normal /= np.hypot(*normal)
    return np.stack([side * along, down, side * normal[0], normal[1]], axis=1)


def _on_one_side(
    slopes: Slopes, width: int, below: float, side: float, pool: ThreadPoolExecutor | None
) -> list[Candidate]:
    """Return the best candidates on one side of the axis, many of which are close to each other."""
    at_usual = 1.0 + below * USUAL**2
    frames = slopes.frames.copy()
    frames[:, 4] *= at_usual / (1.0 + below * slopes.sigmas**2)
    rims = np.stack([lune_outline(flat, bent, side) for flat, bent in _FORMS])
    speeds = side * width * np.arange(_STEP, _FARTHEST, _STEP)
    sizes = width * np.geomspace(_LEAST, _LARGEST, _SIZES)

    scores, runs = searched(replace(slopes, frames=frames), speeds, sizes, rims, turning=True, pool=pool)
    best = []
    for place in np.argsort(scores, axis=None)[::-1][:_BEST]:
        s, r = np.unravel_index(place, scores.shape)
        if scores[s, r] <= 0.0:
            break
        first, last, form = (int(each) for each in runs[s, r])
        flat, bent = _FORMS[form]
        size = float(sizes[r]) * at_usual
        seen = float(scores[s, r])
        lune = Candidate(float(speeds[s]) * at_usual, size, first, last, seen, below=below, flat=flat, bent=bent)
        best.append(lune)
    return best


def _same(a: Candidate, b: Candidate, sigmas: Floats) -> bool:
    """Tell whether two candidates are one in the middle of what both saw."""
    first, last = max(a.first, b.first), min(a.last, b.last)
    if first > last:
        return False
    sigma = float(sigmas[(first + last) // 2])
    sizes = [each.size(sigma) for each in (a, b)]
    near = _NEAR * 0.5 * sum(sizes) + 1.0
    return abs(a.place(sigma) - b.place(sigma)) < near and abs(sizes[0] - sizes[1]) < _AS_LARGE * max(sizes) + 1.0
