"""A lens at many wavelengths, for the few ghosts whose throughput is steep between the traced ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ..model import Coating, Lens
from ..model.light import Spectrum
from ..optics.coating_curves import BandCurves, CoatingCurves, band_curves
from ..optics.pack import PackedLens, SensorMirror, pack_lens
from ..optics.paraxial import FirstOrder

Floats = NDArray[np.float64]

# where ghosts are traced whose throughput is steep between few wavelengths: closely where films reflect most and
# glass disperses most
FINE_NM = np.array([
    365.0, 375.0, 385.0, 395.0, 405.0, 415.0, 427.5, 442.5, 460.0, 480.0, 500.0, 520.0, 540.0, 560.0, 580.0, 602.5,
    630.0, 660.0, 690.0, 720.0, 755.0,
])  # fmt: skip


@dataclass(frozen=True, eq=False)
class Between:
    """A lens at the many wavelengths that few ghosts need.

    Attributes
    ----------
    lens : Lens
    order : FirstOrder
    coatings : tuple of Coating or None
        One a row.
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

    def packed_at(self, wavelengths_nm: Floats) -> tuple[PackedLens, BandCurves | None]:
        """Pack the lens at some wavelengths, with the means of the bands that they stand for."""
        bands = None if self.curves is None else band_curves(self.curves, self.spectrum, tuple(wavelengths_nm.tolist()))
        packed = pack_lens(
            self.lens, self.order, self.coatings, wavelengths_nm, sensor=self.sensor,
            in_bands=None if bands is None else bands.tables[:, : len(self.lens.rows)],
        )  # fmt: skip
        return packed, bands

    @cached_property
    def finer(self) -> tuple[PackedLens, BandCurves | None]:
        """The lens at `FINE_NM`, and the bands of these."""
        return self.packed_at(FINE_NM)


# every frame of a sequence asks for the same
@lru_cache(maxsize=4)
def lens_between(
    lens: Lens,
    order: FirstOrder,
    coatings: tuple[Coating | None, ...],
    sensor: SensorMirror | None,
    curves: CoatingCurves | None,
    spectrum: Spectrum,
) -> Between:
    """Return a lens between the traced wavelengths, the same for the same lens."""
    return Between(lens, order, coatings, sensor, curves, spectrum)
