"""What each ghost costs to draw, for `flarewright render --profile`: time by stage, rays, cells, drawings, pixels."""

from __future__ import annotations

import threading
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from time import thread_time
from typing import Any

import numpy as np

from ...kernels.tracing.adaptive_grid import REASONS
from ...kernels.tracing.sequential import ALIVE, X, Y
from ...optics.rays.bundle import Bundle
from ...typing import Floats

# in the order of the work. grid: trace and refine; colour: reflectances, and more wavelengths where they are steep;
# rings: patterns and their visibility; trace: the other wavelengths; between: number of drawings, and their rays;
# density: light per area at the nodes; draw: fill the picture
STAGES = ("grid", "colour", "rings", "trace", "between", "density", "draw")


@dataclass(frozen=True)
class GhostCost:
    """What one ghost costs, summed over all lights.

    Attributes
    ----------
    path : str
        Name of the path, as 7-3.
    seconds : dict of str to float
        Processor time of each of `STAGES`.
    rays : int
        Traced rays, over all wavelengths.
    cells : int
        Cells of the grid.
    drawings : int
        How often the ghost was drawn: once a wavelength, and between wavelengths where lateral colour is wide.
    triangles : int
        Triangles of all drawings.
    fragments : float
        Pixels that the triangles cover, counted at each drawing: the area of those whose middle lies in the picture,
        at the resolution in which the ghost was drawn.
    detail : int
        How often that resolution is halved.
    halved : dict of str to int
        Halved cells for each of `kernels.tracing.adaptive_grid.REASONS`.
    """

    path: str
    seconds: Mapping[str, float]
    rays: int
    cells: int
    drawings: int
    triangles: int
    fragments: float
    detail: int
    halved: Mapping[str, int]

    @property
    def total(self) -> float:
        """Processor time of all stages, seconds."""
        return sum(self.seconds.values())


@dataclass(frozen=True)
class RenderProfile:
    """What the ghosts of a picture cost.

    Attributes
    ----------
    search_s : float
        Processor time of the search for ghosts, seconds.
    ghosts : tuple of GhostCost
        The most expensive first.
    """

    search_s: float
    ghosts: tuple[GhostCost, ...]

    def as_data(self) -> dict[str, Any]:
        """Return the profile as JSON data."""
        return {"search_s": self.search_s, "ghosts": [asdict(cost) for cost in self.ghosts]}


@dataclass
class Watch:
    """Times the stages of one ghost in one thread, and counts its work."""

    path: str
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    rays: int = 0
    cells: int = 0
    drawings: int = 0
    triangles: int = 0
    fragments: float = 0.0
    detail: int = 0
    halved: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    _last: float = field(default_factory=thread_time)

    def lap(self, stage: str) -> None:
        """Add the time since the last lap to a stage."""
        now = thread_time()
        self.seconds[stage] += now - self._last
        self._last = now

    def built(self, bundle: Bundle, detail: int) -> None:
        """Count a grid."""
        self.lap("grid")
        self.rays += len(bundle.pupil) * len(bundle.traced)
        self.cells += _cells(bundle)
        self.detail = detail
        if bundle.halved is not None:
            for reason, count in zip(REASONS, bundle.halved, strict=True):
                self.halved[reason] += int(count)
        # counting is no part of the work
        self._last = thread_time()

    def traced(self, bundle: Bundle, wavelengths: int) -> None:
        """Count the rays of the wavelengths that the grid lacks."""
        self.lap("trace")
        self.rays += len(bundle.pupil) * max(wavelengths - len(bundle.traced), 0)

    def drew(self, bundle: Bundle, data: Floats, axes: Floats, to_pixels: Floats, size_px: tuple[int, int]) -> None:
        """Count a drawing."""
        self.lap("draw")
        self.drawings += 1
        self.triangles += len(bundle.triangles) * bundle.halves
        for half in range(bundle.halves):
            self.fragments += covered_px(bundle, data, axes, to_pixels, size_px, 1.0 - 2.0 * half)
        # counting is no part of the work
        self._last = thread_time()


class _Idle(Watch):
    """A watch that neither times nor counts."""

    def lap(self, stage: str) -> None:
        pass

    def built(self, bundle: Bundle, detail: int) -> None:
        pass

    def traced(self, bundle: Bundle, wavelengths: int) -> None:
        pass

    def drew(self, bundle: Bundle, data: Floats, axes: Floats, to_pixels: Floats, size_px: tuple[int, int]) -> None:
        pass


IDLE: Watch = _Idle("")


class CostMeter:
    """Collects the watches of all threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._watches: list[Watch] = []
        self.search_s = 0.0

    def watch(self, path: str) -> Watch:
        """Return a new watch for a ghost of this path."""
        made = Watch(path)
        with self._lock:
            self._watches.append(made)
        return made

    def searched(self, seconds: float) -> None:
        """Add to the processor time of the search for ghosts."""
        with self._lock:
            self.search_s += seconds

    def costs(self) -> tuple[GhostCost, ...]:
        """Return the costs of all ghosts, the most expensive first."""
        together: dict[str, list[Watch]] = defaultdict(list)
        for watch in self._watches:
            together[watch.path].append(watch)
        found = [_cost(path, watches) for path, watches in together.items()]
        return tuple(sorted(found, key=lambda cost: (-cost.total, cost.path)))


def covered_px(
    bundle: Bundle, data: Floats, axes: Floats, to_pixels: Floats, size_px: tuple[int, int], mirror: float = 1.0
) -> float:
    """Return the area, pixels, of the triangles of a bundle whose middle lies in the picture.

    Parameters
    ----------
    bundle : Bundle
    data : ndarray, shape (N, >= 5)
        Its nodes at one wavelength.
    axes, to_pixels : ndarray
        As in `kernels.raster.bundle.draw_bundle`.
    size_px : tuple of int
    mirror : float
        1: the bundle; -1: its mirror image.
    """
    alive = (data[bundle.triangles, ALIVE] > 0.0).all(axis=1)
    x, y = mirror * data[bundle.triangles[alive], X], data[bundle.triangles[alive], Y]
    columns = to_pixels[0] - to_pixels[2] * (x * axes[0, 0] + y * axes[1, 0])
    rows = to_pixels[1] + to_pixels[3] * (x * axes[0, 1] + y * axes[1, 1])
    middle_x, middle_y = columns.mean(axis=1), rows.mean(axis=1)
    shown = (middle_x > 0.0) & (middle_x < size_px[0]) & (middle_y > 0.0) & (middle_y < size_px[1])
    across, down = columns - columns[:, :1], rows - rows[:, :1]
    area = 0.5 * np.abs(across[:, 1] * down[:, 2] - across[:, 2] * down[:, 1])
    return float(area[shown].sum())


def _cells(bundle: Bundle) -> int:
    """Return the number of cells: fans of triangles around a common node."""
    centres = bundle.triangles[:, 0]
    return int(np.count_nonzero(np.diff(centres)) + 1) if len(centres) else 0


def _cost(path: str, watches: Sequence[Watch]) -> GhostCost:
    """Add the watches of one path."""
    seconds: dict[str, float] = defaultdict(float)
    halved: Counter[str] = Counter()
    for watch in watches:
        halved.update(watch.halved)
        for stage, spent in watch.seconds.items():
            seconds[stage] += spent
    return GhostCost(
        path,
        dict(seconds),
        rays=sum(watch.rays for watch in watches),
        cells=sum(watch.cells for watch in watches),
        drawings=sum(watch.drawings for watch in watches),
        triangles=sum(watch.triangles for watch in watches),
        fragments=sum(watch.fragments for watch in watches),
        detail=max(watch.detail for watch in watches),
        halved=dict(halved),
    )
