"""F-number of a designed lens for a given stop diameter."""

from __future__ import annotations

from ...errors import LensError
from ...model import Lens
from ...model.lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER
from ...optics.lens.paraxial import first_order


def opened_to(lens: Lens, stop_diameter: float) -> Lens:
    """Return a lens with the f-number that gives its stop a diameter.

    Parameters
    ----------
    lens : Lens
        With all media known.
    stop_diameter : float
        mm.

    Raises
    ------
    LensError
        When the lens forms no image, or a lens file cannot hold the f-number.
    """
    # at f/1 the stop has this semi-diameter
    at_one = first_order(lens.replace(f_number=1.0)).stop_semi_diameter
    f_number = 2.0 * at_one / stop_diameter
    if not LEAST_F_NUMBER < f_number <= LARGEST_F_NUMBER:
        raise LensError(
            f"{lens.name}: a stop of {stop_diameter:.4g} mm makes this lens f/{f_number:.4g}, and f-numbers go from "
            f"{LEAST_F_NUMBER:g} to {LARGEST_F_NUMBER:g}; change less, or open the stop"
        )
    return lens.replace(f_number=f_number)
