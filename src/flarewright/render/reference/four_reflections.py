"""Search for bright four-reflection paths with random rays, because there are too many paths to trace each.

A lens of 27 surfaces has some hundred thousand four-reflection paths, nearly all of them faint. Random rays through the
whole lens meet each path in proportion to the light that it brings into the picture. A bound on the product of R would
keep most paths, because most faint paths are faint because their light misses the sensor.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from ...kernels.montecarlo.forward import IN_PICTURE
from ...model import Iris, Lens, Light, Lines
from ...optics.lens.paths import LightPath, four_path
from ...optics.pupil.iris import blade_edges
from ...optics.rays.bundle import incidence
from ...optics.rays.ghost_table import GhostQuery
from ...optics.rays.pack import PackedLens, facing
from ...typing import Progress
from ..scene.opening import Opening
from ..scene.shot import Shot
from .batches import Batch, batches_in_order, ray_source, run_batch
from .search_sums import SearchSums

# points per batch, squared; the pilot batches determine how many batches are needed
SIDE, PILOT = 24, 4
# paths above this part of the limit are passed on to the deterministic pre-pass, which decides
MARGIN = 0.5
# the share of paths that are left out is estimated from the number of search batches divided by this
ESTIMATE_DIVISOR = 4
# largest number of batches, about a million points
MOST_BATCHES = 2048
# four-reflection rays per light that a batch can record before it is repeated with more room
ROOM = 200_000
# mean number of third and fourth reflections to follow per crossing of the lens; none beyond
FOLLOWED = (4.0, 0.0)


@dataclass(frozen=True)
class FourReflections:
    """Result of the search for four-reflection paths.

    Attributes
    ----------
    paths : tuple of LightPath
        Paths that can be above the limit, brightest first.
    flux : mapping of str to float
        Flux in the picture, relative to all two-reflection paths, of every path met by a second set of rays that is
        independent of `paths`. The first set is biased: it selects paths whose flux it overestimates.
    short : bool
        The limit is so low that paths near it can be missing.
    """

    paths: tuple[LightPath, ...]
    flux: Mapping[str, float]
    short: bool

    @property
    def share(self) -> float:
        """Four-reflection flux in the picture relative to that of two reflections."""
        return sum(self.flux.values())

    def left_out(self, drawn: Collection[str]) -> tuple[int, float]:
        """Return how many known paths are not drawn, and their part of `share`.

        Parameters
        ----------
        drawn : collection of str
            Names of the drawn paths.

        Returns
        -------
        number : int
        part : float
        """
        dark = [flux for name, flux in self.flux.items() if name not in drawn]
        return len(dark), sum(dark) / self.share if self.share > 0.0 else 0.0


def find_four_reflections(
    lens: Lens,
    shots: Sequence[Shot],
    limit: float,
    seed: int,
    *,
    which: str = "all",
    threads: int | None = None,
    progress: Progress | None = None,
    sums: SearchSums | None = None,
) -> FourReflections:
    """Search the four-reflection paths that bring light into the picture.

    Parameters
    ----------
    lens : Lens
    shots : sequence of Shot
    limit : float
        Least flux, relative to all two-reflection flux in the picture.
    seed : int
    which : {"all", "same-side"}
        Relative to the stop, as in `ghost_paths`.
    threads : int, optional
        None: all cores. The result does not depend on it.
    progress : callable, optional
        Called after each batch of rays with the finished fraction (0 to 1) and a description.
    sums : SearchSums, optional
        Of an interrupted search with the same arguments; the batches of this one are added to it.
    """
    sources = [ray_source(shot, seed, side=SIDE, light=k, followed=FOLLOWED) for k, shot in enumerate(shots)]
    sums = SearchSums() if sums is None else sums
    at_once = min(threads or os.cpu_count() or 1, PILOT)
    results = batches_in_order(lambda k: run_batch(sources, k, picture=False, fours=ROOM), sums.batches, at_once)
    with closing(results):
        while sums.batches < PILOT:
            _add(sums, next(results), choosing=True)
        if sums.wanted is None:
            sums.wanted = sums.search.batches_for(limit)
        batches = min(sums.wanted, MOST_BATCHES)
        every = batches + max(PILOT, batches // ESTIMATE_DIVISOR)
        while sums.batches < every:
            _add(sums, next(results), choosing=sums.batches < batches)
            if progress is not None:
                progress(sums.batches / every, "four reflections")
    search, estimate = sums.search, sums.estimate
    rows = len(shots[0].packed.curvature)
    bright = [key for key, flux in search.flux.items() if flux > MARGIN * limit * search.two]
    bright.sort(key=lambda key: (-search.flux[key], key))
    paths = [path for key in bright if _is_wanted(path := four_path(lens, *_rows(key, rows)), lens.stop_row, which)]
    met = {key: four_path(lens, *_rows(key, rows)) for key in estimate.flux}
    flux = {
        path.name: estimate.flux[key] / estimate.two
        for key, path in met.items()
        if estimate.two > 0.0 and _is_wanted(path, lens.stop_row, which)
    }
    return FourReflections(tuple(paths), flux, sums.wanted > MOST_BATCHES)


def find_four_reflections_unbounded(
    lens: Lens,
    packed: PackedLens,
    query: GhostQuery,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    sums: SearchSums | None = None,
) -> FourReflections:
    """Search the four-reflection paths that bring light to an unbounded sensor plane, through a round stop.

    Parameters
    ----------
    lens : Lens
    packed : PackedLens
        At one wavelength, not yet rotated to the light.
    query : GhostQuery
    threads : int, optional
    progress, sums
        As of `find_four_reflections`.
    """
    seen, semi = incidence(query.field_deg, query.distance, packed.first_order.entrance_pupil_z), packed.stop_semi
    blades = blade_edges(Iris(), semi)
    spectrum = Lines(lines=((query.wavelength_nm, 1.0),))
    line = Light(field_deg=query.field_deg, distance=query.distance, spectrum=spectrum)
    opening = Opening(blades, blades, semi, semi, None, 1.0)
    # one pixel with a side of 1000 km
    plane = np.array([0.5, 0.5, 1e-9, 1e-9])
    shot = Shot(line, seen, facing(packed, seen.axes, seen.nearness), opening, plane, (1, 1), "rec709")
    return find_four_reflections(
        lens, [shot], query.order4_limit, 0, which=query.paths, threads=threads, progress=progress, sums=sums
    )


def _add(sums: SearchSums, result: Batch, *, choosing: bool) -> None:
    """Add a batch of rays."""
    sums.add(result["fours"], float(result["figures"][IN_PICTURE + 1]), choosing=choosing)


def _is_wanted(path: LightPath, stop_row: int, which: str) -> bool:
    """Return whether a path matches `which`: all paths, or only paths on one side of the stop."""
    return which == "all" or len({row < stop_row for row in path.mirrors}) == 1


def _rows(key: int, count: int) -> tuple[int, int, int, int]:
    """Decode four rows from one number."""
    key, m = divmod(key, count)
    key, k = divmod(key, count)
    j, i = divmod(key, count)
    return j, i, k, m
