"""The energy ledger: where the light that entered the lens ends."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from math import sqrt
from typing import Any

from ...kernels.montecarlo.forward import AT_BARREL, AT_STOP, BESIDE, ENTERED, IN_PICTURE, LOST, RETURNED
from ...kernels.montecarlo.scattered_rays import STRAY_BESIDE, STRAY_ENDED, STRAY_IN_PICTURE
from ...optics.scattering.brdf import ScatterTables
from ..scene.shot import Shot
from .batches import BALANCE, STRAY, Sums, batches_in_order, ray_source, run_batch

# random rays of a ledger without a picture: number of batches, and points per batch squared
BATCHES, SIDE = 16, 64

_ENDS = (
    ("absorbed at the stop", "stop", AT_STOP),
    ("absorbed at the barrel", "barrel", AT_BARREL),
    ("back out of the front", "returned", RETURNED),
    ("lost", "lost", LOST),
    ("direct, in the picture", "direct.in_picture", IN_PICTURE),
    ("direct, beside it", "direct.beside", BESIDE),
    ("two reflections, in the picture", "ghosts.order2.in_picture", IN_PICTURE + 1),
    ("two reflections, beside it", "ghosts.order2.beside", BESIDE + 1),
    ("four reflections, in the picture", "ghosts.order4.in_picture", IN_PICTURE + 2),
    ("four reflections, beside it", "ghosts.order4.beside", BESIDE + 2),
    ("six or more, in the picture", "ghosts.order6+.in_picture", IN_PICTURE + 3),
    ("six or more, beside it", "ghosts.order6+.beside", BESIDE + 3),
)
# additional ends if surfaces scatter
_STRAY_ENDS = (
    ("scattered, in the picture", "scatter.in_picture", STRAY + STRAY_IN_PICTURE),
    ("scattered, beside it", "scatter.beside", STRAY + STRAY_BESIDE),
    ("scattered, then absorbed or reflected", "scatter.ended", STRAY + STRAY_ENDED),
)


@dataclass(frozen=True)
class LedgerLine:
    """One end of the light.

    Attributes
    ----------
    words : str
        Label for the user.
    name : str
        Key in JSON.
    share : float
        Part of the light that entered.
    standard_error : float
        Of the share.
    """

    words: str
    name: str
    share: float
    standard_error: float


@dataclass(frozen=True)
class Ledger:
    """The shares of all ends of the light that entered.

    Attributes
    ----------
    entered_mm2 : float
        Luminous flux through the clear aperture of the first surface, all lights; mm^2 per unit irradiance.
    lines : tuple of LedgerLine
    total : LedgerLine
        Sum of all lines. It is 1 except for random choices at high orders of reflection.
    """

    entered_mm2: float
    lines: tuple[LedgerLine, ...]
    total: LedgerLine

    def as_data(self) -> dict[str, Any]:
        """Return the ledger as JSON data."""
        return {
            "entered_mm2": self.entered_mm2,
            "shares": {line.name: line.share for line in self.lines},
            "standard_errors": {line.name: line.standard_error for line in self.lines},
            "sum": self.total.share,
            "sum_standard_error": self.total.standard_error,
        }


def ledger_of(sums: Sums) -> Ledger:
    """Return the ledger of summed batches.

    Returns
    -------
    Ledger
        All zero if no light entered.
    """
    mean, variance = sums.mean("figures"), sums.variance("figures")
    entered = float(mean[ENTERED])
    scale = 1.0 / entered if entered > 0.0 else 0.0

    def line(words: str, name: str, k: int) -> LedgerLine:
        return LedgerLine(words, name, float(mean[k]) * scale, sqrt(float(variance[k])) * scale)

    balance = line("sum", "sum", BALANCE)
    total = LedgerLine("sum", "sum", (1.0 if entered > 0.0 else 0.0) + balance.share, balance.standard_error)
    ends = (*_ENDS, *_STRAY_ENDS) if len(mean) > STRAY else _ENDS
    return Ledger(entered, tuple(line(*end) for end in ends), total)


def trace_ledger(
    shots: Sequence[Shot], seed: int, *, scatter: Sequence[ScatterTables] | None = None, threads: int | None = None
) -> Ledger:
    """Compute the ledger of some lights with random rays, without a picture.

    Parameters
    ----------
    shots : sequence of Shot
    seed : int
    scatter : sequence of ScatterTables, optional
        One per shot; None: nothing scatters.
    threads : int, optional
        None: all cores. The result does not depend on it.
    """
    sources = [
        ray_source(shot, seed, side=SIDE, light=k, scatter=None if scatter is None else scatter[k])
        for k, shot in enumerate(shots)
    ]
    sums = Sums(0, {}, {})
    at_once = min(threads or os.cpu_count() or 1, BATCHES)
    with closing(batches_in_order(lambda k: run_batch(sources, k, picture=False), 0, at_once)) as results:
        for result in islice(results, BATCHES):
            sums.add(result)
    return ledger_of(sums)
