"""The lens at more than the traced wavelengths, for ghosts whose throughput changes fast between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ...model import Coating, Lens
from ...model.project.light import Lines, Spectrum
from ...optics.colour.spectrum import band_contents, hats
from ...optics.lens.paraxial import FirstOrder, gap_indices_at
from ...optics.rays.pack import PackedLens, SensorMirror, pack_lens
from ...optics.rays.path_reflectance import CURVE_NM, BandCurves, CoatingCurves, band_curves
from ...typing import Floats, Indices

# dense where films reflect most and glass disperses most
FINE_NM = np.array([
    365.0, 375.0, 385.0, 395.0, 405.0, 415.0, 427.5, 442.5, 460.0, 480.0, 500.0, 520.0, 540.0, 560.0, 580.0, 602.5,
    630.0, 660.0, 690.0, 720.0, 755.0, 800.0,
])  # fmt: skip
# of these, the two at which drafts compare the flux of all ghosts, towards the ends, where films reflect most (about
# half of the light below 450 nm lies below the first); and what steep ghosts need besides, where films' reflectance
# changes most
BEYOND, STEEP = [2, 19], [5, 17, 20]
# drafts compare the flux also where this part of X + Y + Z lies beyond, at either end of the light, if that is not near
# `BEYOND`: a spline overshoots between unequal gaps
END_PART, FAR_NM = 2e-4, 25.0
# of such a light, where drafts compute the flux of steep ghosts
INNER_PART = 0.05
# of a light of few lines, how many besides the traced wavelengths drafts compute at most; closer lines count as one
MOST_BEYOND, CLOSE_NM = 9, 2.5


@dataclass(frozen=True, eq=False)
class Between:
    """A lens that can be packed at many wavelengths.

    Attributes
    ----------
    lens : Lens
    order : FirstOrder
    coatings : tuple of Coating or None
        One per row.
    sensor : SensorMirror or None
    curves : CoatingCurves or None
    spectrum : Spectrum
        Of the light.
    """

    lens: Lens
    order: FirstOrder
    coatings: tuple[Coating | None, ...]
    sensor: SensorMirror | None
    curves: CoatingCurves | None
    spectrum: Spectrum

    @cached_property
    def lines_nm(self) -> Floats | None:
        """The lines of a light that has no more of them than `FINE_NM`; None for any other light."""
        if not isinstance(self.spectrum, Lines):
            return None
        nm = np.unique([wave for wave, power in self.spectrum.lines if power > 0.0])
        return nm if len(nm) <= len(FINE_NM) else None

    @cached_property
    def fine_nm(self) -> Floats:
        """Wavelengths that show how the throughput of a path changes: `FINE_NM`, or all that a few lines have."""
        return FINE_NM if self.lines_nm is None else self.lines_nm

    def beyond(self, traced_nm: Floats) -> Indices:
        """Return which of them drafts compute for all ghosts besides those traced.

        Those are `BEYOND` and the ones at the ends of the light, or the lines farthest from all others.
        """
        if self.lines_nm is None:
            return np.union1d(BEYOND, self._ends)
        far = np.abs(self.lines_nm[:, None] - traced_nm).min(axis=1)
        chosen: list[int] = []
        while len(chosen) < MOST_BEYOND and far.max() > CLOSE_NM:
            chosen.append(int(far.argmax()))
            far = np.minimum(far, np.abs(self.lines_nm - self.lines_nm[chosen[-1]]))
        return np.array(sorted(chosen), dtype=np.intp)

    @cached_property
    def steep(self) -> Indices:
        """Which of them drafts compute for steep ghosts besides those of `beyond`."""
        return np.union1d(STEEP, self._beside(INNER_PART)) if len(self._ends) > 0 else np.array(STEEP)

    @cached_property
    def _ends(self) -> Indices:
        """Which of them lie at the ends of a light that does not end near `BEYOND`."""
        return self._beside(END_PART)

    def _beside(self, part: float) -> Indices:
        """Return which of them lie where this part of X + Y + Z is beyond, at either end, unless near `BEYOND`."""
        ((wave, share),) = band_contents(self.spectrum, self.fine_nm[[0]])
        ends = np.interp([part, 1.0 - part], np.cumsum(share), wave)
        near = np.abs(self.fine_nm - ends[:, None]).argmin(axis=1)
        away: Indices = near[np.abs(self.fine_nm[near, None] - self.fine_nm[BEYOND]).min(axis=1) > FAR_NM]
        return away

    @cached_property
    def nearest(self) -> Indices:
        """The nearest of them to each of `CURVE_NM`."""
        nearest: Indices = np.abs(self.fine_nm - CURVE_NM[:, None]).argmin(axis=1)
        return nearest

    @cached_property
    def spread(self) -> Floats:
        """Matrix from values at `fine_nm` to `CURVE_NM`, shape (M, L): linear, or those of the nearest line."""
        if self.lines_nm is None:
            return hats(CURVE_NM, FINE_NM)
        # the light of a line is spread over the four nearest wavelengths of the curve
        return np.eye(len(self.lines_nm))[:, self.nearest]

    def packed_at(self, wavelengths_nm: Floats) -> tuple[PackedLens, BandCurves | None]:
        """Pack the lens at some wavelengths, with the means over their bands."""
        bands = None if self.curves is None else band_curves(self.curves, self.spectrum, tuple(wavelengths_nm.tolist()))
        packed = pack_lens(
            self.lens, self.order, self.coatings, wavelengths_nm, sensor=self.sensor,
            in_bands=None if bands is None else bands.tables[:, : len(self.lens.rows)],
        )  # fmt: skip
        return packed, bands

    @cached_property
    def finer(self) -> tuple[PackedLens, BandCurves | None]:
        """The lens at `fine_nm`, and the bands of these wavelengths."""
        return self.packed_at(self.fine_nm)

    @cached_property
    def curve_indices(self) -> Floats:
        """Indices of the gaps at `CURVE_NM`, shape (L, K + 1).

        Lines between those at `fine_nm` would move the begin of total reflection by 0.1 nm, and a ghost's light by 2 %.
        """
        indices = gap_indices_at(self.lens, CURVE_NM)
        return indices if self.sensor is None else np.column_stack([indices, np.ones(len(CURVE_NM))])


# all frames of a sequence share one
@lru_cache(maxsize=4)
def lens_between(
    lens: Lens,
    order: FirstOrder,
    coatings: tuple[Coating | None, ...],
    sensor: SensorMirror | None,
    curves: CoatingCurves | None,
    spectrum: Spectrum,
) -> Between:
    """Return a cached `Between` for a lens."""
    return Between(lens, order, coatings, sensor, curves, spectrum)
