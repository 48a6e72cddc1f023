"""The veiling glare index: how much light a black patch in a bright surround gets that should get none."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import atan, cos, degrees, log, pi, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from ..model import Iris, Lens, Light, Lines, Project
from ..optics.bundle import incidence
from ..optics.glare import from_surround
from ..optics.pack import facing
from ..optics.paths import direct_path, ghost_paths
from ..optics.scatter import ScatterTables
from .opening import make_opening
from .prepare import settle
from .scatter import gather, scatter_of
from .shot import Shot
from .shots import make_shots

Floats = NDArray[np.float64]

# the black patch's image is so much of the image circle wide, and that is that of 36 x 24 mm unless the lens says
PATCH, IMAGE_CIRCLE = 0.1, 43.27
# field angles from which scatter is gathered: of the patch and beyond it, evenly in the logarithm after Gauss, and
# azimuths for a lens that is not one of revolution
WITHIN, OUTSIDE, AZIMUTHS = 12, 28, 6
LEAST_RAD, MOST_DEG = 1e-5, 88.0
# rays from the middle of the sensor
RAYS = 24

__all__ = ["VeilingGlare", "veiling_glare"]


@dataclass(frozen=True)
class VeilingGlare:
    """Light on the image of a black patch over that on the image of white, in the middle of the picture.

    Attributes
    ----------
    index : float
        The sum of the parts.
    ghosts, scatter, blur : float
        Light by two reflections; light scattered once; direct light that aberrations bring from beyond the patch.
    patch_deg : float
        Across the black patch.
    white : float
        Irradiance per radiance of the surround without the patch.
    wavelength_nm : float
    """

    index: float
    ghosts: float
    scatter: float
    blur: float
    patch_deg: float
    white: float
    wavelength_nm: float


def veiling_glare(project: Project, wavelength_nm: float, *, threads: int | None = None) -> VeilingGlare:
    """Compute the veiling glare index of a project's lens.

    Parameters
    ----------
    project : Project
        Its lens with all that stands around it, its opening, coating and scatter count; its lights and iris' blades do
        not.
    wavelength_nm : float
    threads : int, optional
        None: all cores; the number does not depend on it.

    Returns
    -------
    VeilingGlare

    Raises
    ------
    FlarewrightError
        As `settle`.

    Notes
    -----
    The idea of ISO 9358, extended source integral method: a black patch in a uniform surround that fills the hemisphere
    in front of the lens, 88 degrees to each side for scatter. Light from the surround of radiance 1 is integrated over
    the rays that meet the middle of the sensor. Reflections at barrel and blades, four reflections, and a sensor that
    scatters are left out, and the patch is a tenth of the image circle; so it is no measurement after the standard.
    """
    light = Light(field_deg=(0.0, 0.0), spectrum=Lines(lines=((wavelength_nm, 1.0),)))
    settled = settle(project.replace(lights=(light,), iris=Iris()))
    shot = make_shots(settled, make_opening(settled, None))[0]
    lens, packed = settled.lens, shot.packed
    field = lens.field_deg
    circle = IMAGE_CIRCLE if field is None else 2.0 * settled.order.efl * tan(radians(field))
    patch = 0.5 * PATCH * circle / settled.order.efl
    direct = from_surround(lens, packed, [direct_path(lens)], patch, threads=threads)[0]
    paths = ghost_paths(lens, project.quality.paths, sensor=settled.sensor is not None)
    ghosts = from_surround(lens, packed, paths, patch, threads=threads).sum(axis=0)
    tables = scatter_of(settled, [shot])
    within = beyond = 0.0
    if tables is not None:
        direct = direct * float(tables[0].kept[0])
        with ThreadPoolExecutor(threads or os.cpu_count()) as pool:

            def light_from(low: float, high: float, nodes: int) -> float:
                at, weights = np.polynomial.legendre.leggauss(nodes)
                span = log(high / low)
                angles = low * np.exp(0.5 * span * (at + 1.0))
                seen = [_scattered_from(lens, shot, tables[0], float(angle), pool) for angle in angles]
                rings = 2.0 * pi * np.sin(angles) * np.cos(angles) * angles
                return float((0.5 * span * weights * rings * np.array(seen)).sum())

            edge = atan(patch)
            within = light_from(LEAST_RAD, edge, WITHIN)
            beyond = light_from(edge, radians(MOST_DEG), OUTSIDE)
    white = float(direct[0] + ghosts[0] + within + beyond)
    unit = 1.0 / white if white > 0.0 else 0.0
    return VeilingGlare(
        index=float(ghosts[1] + beyond + direct[1]) * unit,
        ghosts=float(ghosts[1]) * unit,
        scatter=beyond * unit,
        blur=float(direct[1]) * unit,
        patch_deg=2.0 * degrees(atan(patch)),
        white=white,
        wavelength_nm=float(packed.wavelengths_nm[0]),
    )


def _scattered_from(lens: Lens, shot: Shot, tables: ScatterTables, angle: float, pool: ThreadPoolExecutor) -> float:
    """Scattered light of a distant light on the middle of the sensor, per irradiance on the plane of the front."""
    turns = 1 if shot.packed.symmetric else AZIMUTHS
    found = []
    for turn in range(turns):
        azimuth = 2.0 * pi * turn / turns
        slope = tan(angle)
        seen = incidence((degrees(atan(slope * cos(azimuth))), degrees(atan(slope * sin(azimuth)))))
        there = replace(shot, incidence=seen, packed=facing(shot.packed, seen.axes))
        found.append(gather(lens, there, tables, [0], np.zeros((1, 2)), pool, rays=RAYS)[0, 0])
    return float(np.mean(found))
