"""Whole patterns of a band of white light, of which the program transforms only parts."""

from __future__ import annotations

import numpy as np

from flarewright.optics.diffraction import fresnel


def band_intensity(grid: fresnel.FresnelGrid, areas, shares) -> np.ndarray:
    """Return the pattern of `fresnel.band_pattern` over the whole grid, shape (Ny, Nx)."""
    real, imaginary, _ = fresnel._wave(grid, areas, shares)
    return fresnel._light(grid, real, imaginary)
