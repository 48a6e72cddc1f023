"""Design from scratch: random ghost targets along a line, with no lens to start from (Van Acoleyen 2025, 5.7)."""

from __future__ import annotations

import numpy as np

from ...model import Camera, Light, Project
from ...model.project.design import Bounds, Design, GhostTarget
from ...typing import Floats
from .grey_picture import DIAGONAL, GAIN, HALF_FRAME, SIDE, disc_picture, light_of_ghosts
from .objective import Objective


def random_ghost_targets(count: int, seed: int) -> tuple[GhostTarget, ...]:
    """Draw random ghosts along the line: places up to 18 mm from the middle, radii of 0.5 to 8 mm, mostly small."""
    random = np.random.default_rng([seed, count])
    places = random.uniform(-18.0, 18.0, count)
    radii = np.exp(random.uniform(np.log(0.5), np.log(8.0), count)) * random.choice([-1.0, 1.0], count)
    return tuple(
        GhostTarget(place_mm=round(float(p), 3), radius_mm=round(float(r), 3))
        for p, r in zip(places, radii, strict=True)
    )


def scratch_project(
    ghost_targets: tuple[GhostTarget, ...],
    field_deg: tuple[float, float],
    *,
    surfaces: int | None = None,
    stop_diameter: float | None = None,
    signed: bool = True,
) -> Project:
    """Return a project whose targets are new ghosts only.

    Parameters
    ----------
    ghost_targets : tuple of GhostTarget
        Each with place and radius.
    field_deg : tuple of float
        Of the light source.
    surfaces : int, optional
        Number of surfaces without the stop; None: the fewest by equation 5.5 of the thesis.
    stop_diameter : float, optional
        mm; None: free.
    signed : bool
        False: the result is judged by its picture, so radii have no sign.

    Returns
    -------
    Project
        Its lens is a placeholder.
    """
    bounds = Bounds() if stop_diameter is None else Bounds(stop_diameter=(stop_diameter, stop_diameter))
    design = Design(
        own_ghosts=False, ghost_targets=ghost_targets, surfaces=surfaces, bounds=bounds, signed=signed,
        judge="ghosts" if signed else "picture",
    )  # fmt: skip
    light = Light(field_deg=field_deg)
    camera = Camera(size_px=(640, 640), sensor_mm=(2.0 * HALF_FRAME, 2.0 * HALF_FRAME))
    return Project(lens="heliar-tronnier", lights=(light,), design=design, camera=camera)


def wanted_picture(aim: Objective, stop_diameter: float, *, ghosts: int, gain: float = GAIN) -> Floats:
    """Draw the target ghosts in the way that `grey_picture.grey_picture` draws the ghosts of a lens.

    Parameters
    ----------
    aim : Objective
        One light.
    stop_diameter : float
        Of the lens under comparison, mm.
    ghosts : int
        Number of ghosts of that lens; the thesis divides the light by it.
    gain : float

    Returns
    -------
    ndarray, shape (512, 512)
    """
    radii = aim.targets[:, 1]
    light = light_of_ghosts(ghosts, stop_diameter, gain) / np.abs(radii)
    shapes = np.full(len(radii), 6)
    return disc_picture(aim.targets[:, 0], radii, light[:, None], DIAGONAL, HALF_FRAME, SIDE, shapes)[..., 0]
