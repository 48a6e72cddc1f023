"""The side of the axis on which a light was photographed."""

from __future__ import annotations

from ...model.measurement.ghost_model import GhostModel


def measured_side(model: GhostModel, constellation_deg: float, roll_deg: float = 0.0) -> tuple[float, float]:
    """Return the same place of a light as a constellation that the model holds, if it holds one.

    Parameters
    ----------
    model : GhostModel
    constellation_deg, roll_deg : float
        Where the light stands, degrees.

    Returns
    -------
    constellation_deg, roll_deg : float
        Unchanged, or of the other sign and half a turn away, where the light stands as well.

    Examples
    --------
    >>> from flarewright.model.measurement.ghost_model import GhostModel
    >>> left = GhostModel(size_px=(64, 36), axis_px=(32, 18), focal_px=90, largest_deg=15, constellation_deg=(-15, 2))
    >>> measured_side(left, 10.0, 30.0), measured_side(left, 1.0, 30.0)
    ((-10.0, 210.0), (1.0, 30.0))
    """
    low, high = model.constellation_deg
    if not low <= constellation_deg <= high and low <= -constellation_deg <= high:
        return -constellation_deg, roll_deg + 180.0
    return constellation_deg, roll_deg
