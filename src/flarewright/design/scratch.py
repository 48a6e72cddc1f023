"""From scratch: ghosts along a line, and no lens to begin with (Van Acoleyen 2025, section 5.7)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model import Camera, Light, Project
from ..model.design import Bounds, Design, GhostWish
from .objective import Objective
from .picture import DIAGONAL, GAIN, HALF_FRAME, SIDE, disc_picture, light_of_ghosts


def random_wishes(count: int, seed: int) -> tuple[GhostWish, ...]:
    """Scatter ghosts along the line: places up to 18 mm from the middle, radii of 0.5 to 8 mm, small ones more often.

    Parameters
    ----------
    count, seed : int

    Returns
    -------
    tuple of GhostWish
    """
    random = np.random.default_rng([seed, count])
    places = random.uniform(-18.0, 18.0, count)
    radii = np.exp(random.uniform(np.log(0.5), np.log(8.0), count)) * random.choice([-1.0, 1.0], count)
    return tuple(
        GhostWish(place_mm=round(float(p), 3), radius_mm=round(float(r), 3)) for p, r in zip(places, radii, strict=True)
    )


def scratch_project(
    wishes: tuple[GhostWish, ...],
    field_deg: tuple[float, float],
    *,
    surfaces: int | None = None,
    stop_diameter: float | None = None,
    signed: bool = True,
) -> Project:
    """Make a project that wants new ghosts only.

    Parameters
    ----------
    wishes : tuple of GhostWish
        With place and radius.
    field_deg : tuple of float
        Of the light.
    surfaces : int, optional
        Without the stop; None: as few as equation 5.5 of the thesis asks for.
    stop_diameter : float, optional
        mm; None: free.
    signed : bool
        False: the picture counts in the end.

    Returns
    -------
    Project
        The lens in it stands for its place only.
    """
    bounds = Bounds() if stop_diameter is None else Bounds(stop_diameter=(stop_diameter, stop_diameter))
    design = Design(
        own_ghosts=False, wishes=wishes, surfaces=surfaces, bounds=bounds, signed=signed,
        judge="ghosts" if signed else "picture",
    )  # fmt: skip
    light = Light(field_deg=field_deg)
    camera = Camera(size_px=(640, 640), sensor_mm=(2.0 * HALF_FRAME, 2.0 * HALF_FRAME))
    return Project(lens="heliar-tronnier", lights=(light,), design=design, camera=camera)


def wanted_picture(aim: Objective, stop_diameter: float, *, ghosts: int, gain: float = GAIN) -> NDArray[np.float64]:
    """Draw the wanted ghosts as `picture.grey_picture` draws those of a lens.

    Parameters
    ----------
    aim : Objective
        One light.
    stop_diameter : float
        Of the lens it is compared with, mm.
    ghosts : int
        By which the thesis divides the light: those of that lens.
    gain : float

    Returns
    -------
    ndarray, shape (512, 512)
    """
    radii = aim.targets[:, 1]
    light = light_of_ghosts(ghosts, stop_diameter, gain) / np.abs(radii)
    shapes = np.full(len(radii), 6)
    return disc_picture(aim.targets[:, 0], radii, light[:, None], DIAGONAL, HALF_FRAME, SIDE, shapes)[..., 0]
