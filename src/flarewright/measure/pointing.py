"""What a person tells the search for ghosts, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import FlarewrightError
from ..model.capture import MergedRun
from ..model.corrections import Corrections, Pointed
from ..model.ghost_model import AberrationGhost
from .find import Candidate
from .found import Found
from .views import View

# of a candidate that is tried before all others
_FIRST = 1e9


def candidate(pointed: Pointed, views: Sequence[View], run: MergedRun, *, looked: int, factor: float) -> Candidate:
    """Turn a ghost that a person pointed at, in one frame, into a candidate.

    Parameters
    ----------
    pointed : Pointed
    views : sequence of View
        By rising constellation, as large as the frames.
    run : MergedRun
    looked : int
        Views in which candidates are looked for.
    factor : float
        By which the pixels of these are larger.

    Returns
    -------
    Candidate
        Tried before all others.

    Raises
    ------
    FlarewrightError
        When there is no such frame or place, or it tells no speed.
    """
    angles = np.array([view.constellation_deg for view in views])
    at = int(np.argmin(np.abs(angles - pointed.constellation_deg)))
    steps = np.diff(angles)
    if abs(angles[at] - pointed.constellation_deg) > float(steps.max(initial=0.0)):
        raise FlarewrightError(
            f"corrections: no frame shows {pointed.constellation_deg:g} degrees; these go from {angles[0]:g} to "
            f"{angles[-1]:g}"
        )
    if not views[at].sigma > 0.0:
        raise FlarewrightError(
            "corrections: a ghost pointed at with the light on the axis tells no speed; point at it elsewhere"
        )
    if max(run.size_px) < pointed.radius_px:
        raise FlarewrightError(
            f"corrections: a ghost of radius {pointed.radius_px:g} pixels is larger than the picture"
        )
    if not all(0.0 <= place <= size for place, size in zip(pointed.centre_px, run.size_px, strict=True)):
        raise FlarewrightError(
            f"corrections: {_place(pointed)} is not in the picture of {run.size_px[0]} x {run.size_px[1]} pixels"
        )
    x, y, cosine, sine, _ = views[at].frame
    along = (pointed.centre_px[0] - x) * cosine - (pointed.centre_px[1] - y) * sine
    return Candidate(float(along / views[at].sigma) / factor, pointed.radius_px / factor, 0, looked - 1, _FIRST)


def tell_pointed(
    corrections: Corrections, pointed: Sequence[Candidate], found: Sequence[Found], tell: Callable[[str], None]
) -> None:
    """Tell which ghosts that a person pointed at were found, by which name.

    Parameters
    ----------
    corrections : Corrections
    pointed : sequence of Candidate
        What `candidate` made of `corrections.add`.
    found : sequence of Found
        In the same pixels.
    tell : callable
    """
    speeds = np.array([ghost.shapes[1].numbers[0] for ghost in found])
    for asked, one in zip(corrections.add, pointed, strict=True):
        away = np.abs(speeds - one.speed)
        if len(found) and away.min() < one.radius:
            tell(f"the ghost pointed at {_place(asked)} is ghost {int(away.argmin()) + 1}")
        else:
            tell(f"nothing that goes with the light over all constellations was found {_place(asked)}: left out")


def kept(
    corrections: Corrections, ghosts: Sequence[AberrationGhost], tell: Callable[[str], None]
) -> tuple[AberrationGhost, ...]:
    """Leave out the ghosts that a person does not want, and tell of names that there are none of.

    Parameters
    ----------
    corrections : Corrections
    ghosts : sequence of AberrationGhost
    tell : callable

    Returns
    -------
    tuple of AberrationGhost
    """
    names = [ghost.name for ghost in ghosts]
    for name in corrections.remove:
        if name not in names:
            tell(f"corrections: there is no ghost {name!r} to remove; found were {', '.join(names) or 'none'}")
    return tuple(ghost for ghost in ghosts if ghost.name not in corrections.remove)


def _place(pointed: Pointed) -> str:
    x, y = pointed.centre_px
    return f"at ({x:g}, {y:g}) px, {pointed.constellation_deg:g} degrees"
