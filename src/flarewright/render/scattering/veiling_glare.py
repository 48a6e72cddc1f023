"""The veiling glare index: light on the image of a black patch in a bright surround."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import atan, cos, degrees, log, pi, radians, sin, tan

import numpy as np

from ...model import Iris, Lens, Light, Lines, Project
from ...optics.lens.paths import direct_path, ghost_paths
from ...optics.rays.bundle import incidence
from ...optics.rays.pack import facing
from ...optics.scattering.brdf import ScatterTables
from ...optics.scattering.veiling_glare import from_surround
from ...typing import Progress
from ..scene.opening import make_opening
from ..scene.resolve import resolve_project
from ..scene.shot import Shot
from ..scene.shots import make_shots
from .scatter_pass import gather, scatter_of

# width of the patch's image relative to the image circle; the circle in mm (36 x 24 mm) if the lens gives no field
PATCH, IMAGE_CIRCLE = 0.1, 43.27
# Gauss nodes in the logarithm of the field angle within the patch and beyond it; azimuths of a lens without rotational
# symmetry
INNER_NODES, OUTER_NODES, AZIMUTHS = 12, 28, 6
LEAST_RAD, MOST_DEG = 1e-5, 88.0
# rays from the centre of the sensor
RAYS = 24


@dataclass(frozen=True)
class VeilingGlare:
    """Light on the image of a black patch relative to that on the image of white, at the picture's centre.

    Attributes
    ----------
    index : float
        The sum of the parts.
    ghosts, scatter, blur : float
        Light of two reflections; light scattered once; direct light that aberrations move onto the patch.
    patch_deg : float
        Diameter of the black patch.
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


def veiling_glare(
    project: Project,
    wavelength_nm: float,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    step: Callable[[Callable[[], float]], float] = lambda make: make(),
) -> VeilingGlare:
    """Compute the veiling glare index of a project's lens.

    Parameters
    ----------
    project : Project
        Its lens with plates, f-number, coating and scatter count; its lights and iris blades do not.
    wavelength_nm : float
    threads : int, optional
        None: all cores. The result does not depend on it.
    progress : callable, optional
        Called with the finished part (0 to 1) and the name of the step.
    step : callable, optional
        Takes what computes the scattered light of the next direction, and returns that light; it can return the result
        of an interrupted run instead.

    Raises
    ------
    FlarewrightError
        As in `resolve_project`.

    Notes
    -----
    Follows the idea of ISO 9358, extended source integral method: a black patch in a uniform surround that fills the
    hemisphere in front of the lens, up to 88 degrees to each side for scatter. Light from a surround of radiance 1 is
    integrated over the rays that reach the centre of the sensor. Reflections at barrel and blades, four reflections and
    scatter at the sensor are ignored, and the patch is a tenth of the image circle; so this is not a measurement to the
    standard.
    """
    light = Light(field_deg=(0.0, 0.0), spectrum=Lines(lines=((wavelength_nm, 1.0),)))
    settled = resolve_project(project.replace(lights=(light,), iris=Iris()))
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

            def light_from(low: float, high: float, nodes: int, done: int) -> float:
                at, weights = np.polynomial.legendre.leggauss(nodes)
                span = log(high / low)
                angles = low * np.exp(0.5 * span * (at + 1.0))
                seen = []
                for k, angle in enumerate(angles.tolist()):
                    if progress is not None:
                        progress((done + k) / (INNER_NODES + OUTER_NODES), "scattered light")
                    seen.append(step(partial(_scattered_from, lens, shot, tables[0], angle, pool)))
                rings = 2.0 * pi * np.sin(angles) * np.cos(angles) * angles
                return float((0.5 * span * weights * rings * np.array(seen)).sum())

            edge = atan(patch)
            within = light_from(LEAST_RAD, edge, INNER_NODES, 0)
            beyond = light_from(edge, radians(MOST_DEG), OUTER_NODES, INNER_NODES)
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
    """Return the scattered irradiance at the sensor's centre from a distant light, per irradiance on the front."""
    turns = 1 if shot.packed.symmetric else AZIMUTHS
    found = []
    for turn in range(turns):
        azimuth = 2.0 * pi * turn / turns
        slope = tan(angle)
        seen = incidence((degrees(atan(slope * cos(azimuth))), degrees(atan(slope * sin(azimuth)))))
        there = replace(shot, incidence=seen, packed=facing(shot.packed, seen.axes))
        found.append(gather(lens, there, tables, [0], np.zeros((1, 2)), pool, rays=RAYS)[0, 0])
    return float(np.mean(found))
