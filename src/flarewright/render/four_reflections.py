"""Which four-reflection ghosts are worth drawing: found by random rays, because there are too many paths to try.

A lens of 27 surfaces has some hundred thousand four-reflection paths, nearly all of them faint. Random rays through the
whole lens meet each in proportion to the light that it brings into the picture. A bound on products of R would keep
most of them, for what makes a path faint is above all that its light misses the sensor.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from math import ceil

import numpy as np

from ..kernels.montecarlo import IN_PICTURE
from ..model import Iris, Lens, Light, Lines
from ..optics.bundle import incidence
from ..optics.iris import blade_edges
from ..optics.pack import PackedLens, facing
from ..optics.paths import LightPath, four_path
from .montecarlo import Batch, batches_in_order, ray_source, run_batch
from .opening import Opening
from .shot import Shot

# a batch has so many points squared; from the first ones it is told how many are needed
SIDE, PILOT = 24, 4
# a path at the limit is met by so many rays on average: its estimate errs by a seventh or so
HITS = 50
# all that seem to carry this part of the limit go on to the pre-pass, which knows no chance and has the last word
MARGIN = 0.5
# what is left out is told by a part of that number
TELLING = 4
# never more batches than this, some million points
MOST_BATCHES = 2048
# how many rays of four reflections a light may note in a batch before a batch is done again with more room
ROOM = 200_000
# third and fourth reflections to follow while a ray crosses the lens once; none beyond
FOLLOWED = (4.0, 0.0)


@dataclass(frozen=True)
class FourReflections:
    """What was found of four-reflection paths.

    Attributes
    ----------
    paths : tuple of LightPath
        Those that may be above the limit, brightest first.
    flux : mapping of str to float
        Every path that was met by a second lot of rays, which had no say in `paths`: flux in the picture over that of
        all two-reflection paths. Paths that chance made too bright are chosen more often, so the rays that chose them
        cannot judge them.
    short : bool
        The limit is so low that paths near it may have been missed.
    """

    paths: tuple[LightPath, ...]
    flux: Mapping[str, float]
    short: bool

    @property
    def share(self) -> float:
        """All four-reflection flux in the picture over that of two reflections."""
        return sum(self.flux.values())

    def left_out(self, drawn: Collection[str]) -> tuple[int, float]:
        """Tell how many paths that were met are not drawn, and which part of `share` they carry.

        Parameters
        ----------
        drawn : collection of str
            Names.

        Returns
        -------
        number : int
        part : float
        """
        dark = [flux for name, flux in self.flux.items() if name not in drawn]
        return len(dark), sum(dark) / self.share if self.share > 0.0 else 0.0


def find_fours(
    lens: Lens, shots: Sequence[Shot], limit: float, seed: int, *, which: str = "all", threads: int | None = None
) -> FourReflections:
    """Look for the four-reflection paths that carry light in the picture.

    Parameters
    ----------
    lens : Lens
    shots : sequence of Shot
    limit : float
        Least flux, as part of all two-reflection flux in the picture.
    seed : int
    which : {"all", "same-side"}
        Of the stop, as in `ghost_paths`.
    threads : int, optional
        None: all cores; what is found does not depend on it.

    Returns
    -------
    FourReflections
    """
    sources = [ray_source(shot, seed, side=SIDE, light=k, followed=FOLLOWED) for k, shot in enumerate(shots)]
    choose, tell = _Tally(), _Tally()
    at_once = min(threads or os.cpu_count() or 1, PILOT)
    results = batches_in_order(lambda k: run_batch(sources, k, picture=False, fours=ROOM), 0, at_once)
    with closing(results):
        for result in islice(results, PILOT):
            choose.add(result)
        wanted = choose.batches_for(limit)
        batches = min(wanted, MOST_BATCHES)
        for result in islice(results, batches - PILOT):
            choose.add(result)
        for result in islice(results, max(PILOT, batches // TELLING)):
            tell.add(result)
    rows = len(shots[0].packed.curvature)
    bright = [key for key, flux in choose.flux.items() if flux > MARGIN * limit * choose.two]
    bright.sort(key=lambda key: (-choose.flux[key], key))
    paths = [path for key in bright if _is_wanted(path := four_path(lens, *_rows(key, rows)), lens.stop_row, which)]
    met = {key: four_path(lens, *_rows(key, rows)) for key in tell.flux}
    flux = {
        path.name: tell.flux[key] / tell.two
        for key, path in met.items()
        if tell.two > 0.0 and _is_wanted(path, lens.stop_row, which)
    }
    return FourReflections(tuple(paths), flux, wanted > MOST_BATCHES)


def find_fours_everywhere(
    lens: Lens,
    packed: PackedLens,
    field_deg: tuple[float, float],
    limit: float,
    *,
    distance: float | None = None,
    which: str = "all",
    threads: int | None = None,
) -> FourReflections:
    """Look for the four-reflection paths that carry light to a sensor plane without bounds, through a round stop.

    Parameters
    ----------
    lens : Lens
    packed : PackedLens
        At one wavelength, not yet turned to the light.
    field_deg : tuple of float
        (X, Y) of the light.
    limit : float
        Least flux, as part of all two-reflection flux.
    distance : float, optional
        How far in front of the first vertex the light stands, mm; None: distant.
    which, threads
        As in `find_fours`.

    Returns
    -------
    FourReflections
    """
    seen, semi = incidence(field_deg, distance, packed.first_order.entrance_pupil_z), packed.stop_semi
    blades = blade_edges(Iris(), semi)
    line = Light(
        field_deg=field_deg, distance=distance, spectrum=Lines(lines=((float(packed.wavelengths_nm[0]), 1.0),))
    )
    opening = Opening(blades, blades, semi, semi, None, 1.0)
    # one pixel of a thousand kilometres
    plane = np.array([0.5, 0.5, 1e-9, 1e-9])
    shot = Shot(line, seen, facing(packed, seen.axes, seen.nearness), opening, plane, (1, 1), "rec709")
    return find_fours(lens, [shot], limit, 0, which=which, threads=threads)


class _Tally:
    """What batches of rays brought into the picture."""

    def __init__(self) -> None:
        self.batches, self.two = 0, 0.0
        self.flux: dict[int, float] = {}
        self._sums = np.zeros(2)

    def add(self, result: Batch) -> None:
        """Add a batch."""
        keys, weights = result["fours"][:, 0].astype(np.int64), result["fours"][:, 1]
        names, place = np.unique(keys, return_inverse=True)
        sums = np.bincount(place, weights=weights, minlength=len(names))
        for key, value in zip(names.tolist(), sums.tolist(), strict=True):
            self.flux[key] = self.flux.get(key, 0.0) + value
        self.batches += 1
        self.two += float(result["figures"][IN_PICTURE + 1])
        self._sums += weights.sum(), (weights**2).sum()

    def batches_for(self, limit: float) -> int:
        """Tell how many batches meet a path at the limit by `HITS` rays."""
        flux, squares = self._sums
        if flux <= 0.0 or self.two <= 0.0:
            return self.batches
        # what a ray carries, as it counts for the variance of a sum of rays
        ray = squares / flux
        return max(self.batches, ceil(min(HITS * ray * self.batches / (limit * self.two), 1e9)))


def _is_wanted(path: LightPath, stop_row: int, which: str) -> bool:
    """Tell whether a path belongs to those of one side of the stop, or all are wanted."""
    return which == "all" or len({row < stop_row for row in path.mirrors}) == 1


def _rows(key: int, count: int) -> tuple[int, int, int, int]:
    """Take the four rows out of one number."""
    key, m = divmod(key, count)
    key, k = divmod(key, count)
    j, i = divmod(key, count)
    return j, i, k, m
