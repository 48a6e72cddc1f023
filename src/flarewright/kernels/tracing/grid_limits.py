"""The limits of the adaptive grid, one argument of its kernels."""

from __future__ import annotations

from typing import NamedTuple


class GridLimits(NamedTuple):
    """How far the adaptive grid is refined.

    Attributes
    ----------
    rim_level : int
        Least number of halvings of cells that the rim crosses.
    max_level : int
        Largest number of halvings of a cell.
    tolerance : float
        Largest error of interpolated positions, pixels.
    flux_tolerance : float
        Largest error of the bundle's flux by the interpolation of the rim, as a part of the flux.
    fringe_tolerance : float
        Above 0 the iris does not cut: light fades in fringes between its two circles. The value is the largest error of
        the fringes' places, pixels.
    faint_radius : float
        Light that crosses the stop farther out than this, mm, is too faint for refinement.
    scale : float
        Pixels per mm on the sensor.
    view_radius : float
        Radius around the axis that the picture covers, mm; inf for all.
    slivers : int
        1: slivers of light pass beside rays that end, search them; 0: there are none.
    inner_bend : float
        Away from the rim, largest error of positions over the size of the cell; the error in area is twice that, and
        more would show as triangles.
    area_ratio : float
        Largest ratio of the areas of a cell's triangles on the sensor, less 1: the spread of its density.
    weight_bend : float
        Light is interpolated linearly between nodes: largest departure from that, as a part of the light of its
        wavelength, or of the mean over all wavelengths where that is more.
    fold_px, area_px : float
        Cells whose image is smaller, pixels, may fold, and may have any ratio of areas.
    """

    rim_level: int
    max_level: int
    tolerance: float
    flux_tolerance: float
    fringe_tolerance: float
    faint_radius: float
    scale: float
    view_radius: float
    slivers: int
    inner_bend: float
    area_ratio: float
    weight_bend: float
    fold_px: float
    area_px: float
