"""Render the worst moments of a plan, to show them and to check the prediction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..typing import Pixels, Progress
from .contrast import washed_share
from .flare import luminance
from .pictures import Memory, Spread, draw_all, in_colour
from .plan import FlareMaker, Plan, Ranked, near_or_far

# largest number of pairs of camera and light
PICTURES = 6


@dataclass(frozen=True)
class Worst:
    """A light in a camera at its worst time.

    Attributes
    ----------
    ranked : Ranked
    picture : ndarray, shape (H, W, 3)
        The flare as luminance of the scene, cd/m^2.
    veil_cd_m2 : float
        Mean of the picture.
    washed : float or None
        Part of the picture with less than nine tenths of the scene's contrast; None without a scene.
    """

    ranked: Ranked
    picture: Pixels
    veil_cd_m2: float
    washed: float | None


def render_worst(
    plan: Plan,
    ranked: Sequence[Ranked],
    maker: FlareMaker,
    progress: Progress,
    memory: Memory | None = None,
    spread: Spread | None = None,
) -> list[Worst]:
    """Render the worst times of the first pairs of a ranking.

    Parameters
    ----------
    plan : Plan
    ranked : sequence of Ranked
    maker : callable
        Maps (camera, light, diameter_deg, distance_m) to a flare for viewing, over the camera's frame.
    progress : callable
    memory : dict, optional
        Pictures drawn before; new ones are added.
    spread : callable, optional
        Draws pictures by other processes.
    """
    scene = plan.scene
    known: Memory = {} if memory is None else memory
    chosen = [(one, one.worst) for one in ranked if one.worst is not None and one.worst_veil_cd_m2][:PICTURES]
    requests, factors = [], []
    for one, worst in chosen:
        seen = plan.pairs[one.camera][one.light].sighting
        flare, _ = near_or_far(maker, scene.cameras[one.camera], scene.lights[one.light], seen)
        factors.append(float(seen.illuminance_lx[worst]) / flare.scene_scale)
        at = float(seen.constellation_deg[worst]), float(seen.roll_deg[worst])
        requests.append(in_colour(flare, known, *at))
    out = []
    for (one, _), drawn, factor in zip(chosen, draw_all(requests, spread, progress), factors, strict=True):
        picture = (drawn * factor).astype(np.float32)
        bright = luminance(picture)
        washed = None
        if scene.luminance_cd_m2 is not None:
            low, high = scene.luminance_cd_m2
            washed = washed_share(bright, np.ones_like(bright), high, low)
        out.append(Worst(one, picture, float(bright.mean()), washed))
    return out
