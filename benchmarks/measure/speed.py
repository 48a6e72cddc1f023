"""Benchmark of replay speed: a hundred planted ghosts of all sizes, in colour, on one core; and Walch's primitive."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from flarewright.kernels.ghost_model.pupil_mesh import SOFT
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of
from flarewright.measure.replay.ghost_arrays import Packed
from flarewright.measure.replay.model_image import draw_packed, pack
from flarewright.model.measurement.ghost_model import AberrationGhost, BezierGhost, GhostModel

SIZE = (960, 540)
_ANGLES = (4.0, 10.0, 18.0, 25.0)
# softness of borders, pixels; fitted ghosts have 0.5 to 3
_SOFT = (0.0, 1.0, 2.5)
_SHARP = "replay, ghosts a second and core"


def _radius(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(np.log(10.0), np.log(140.0))))


def planted(count: int = 100, seed: int = 0, soft_px: float = 0.0) -> GhostModel:
    """Return a model of ghosts of radius 10 to 140 pixels, slightly aberrated, with no, one or two rims."""
    rng = np.random.default_rng(seed)
    ghosts = []
    for k in range(count):
        numbers = np.zeros(NUMBERS)
        size = _radius(rng)
        numbers[:4] = rng.uniform(-500.0, 500.0), 0.05 * size, -0.05 * size, 20.0 * rng.normal()
        numbers[10:14] = size, 0.08 * size * rng.normal(), 0.05 * size, -0.05 * size
        numbers[20:23] = size**2 * np.array([1.0, 0.2 * rng.normal(), 0.05])
        numbers[30:36] = 0.8, 0.0, 1.2, -1.2, 0.0, 1.5
        discs = k % 3
        numbers[30 + 3 * discs :] = 0.0
        numbers[SOFT] = soft_px**2
        channel = channel_of(numbers, discs)
        ghosts.append(AberrationGhost(name=str(k), red=channel, green=channel, blue=channel, visible_deg=(0.0, 30.0)))
    return GhostModel(
        size_px=SIZE, axis_px=(480.0, 270.0), focal_px=900.0, largest_deg=28.0, constellation_deg=(0.0, 28.0),
        ghosts=tuple(ghosts),
    )  # fmt: skip


def curved(count: int = 100, seed: int = 0) -> GhostModel:
    """Return a model of equally many and large ghosts with Walch's primitive; their borders fade inwards."""
    rng = np.random.default_rng(seed)
    ghosts = []
    for k in range(count):
        size = _radius(rng)
        control = 0.55 * size
        place = float(rng.uniform(-250.0, 250.0))
        shape = [(place, place), (0.0,), (size,), (size,), (size,), *[(control,)] * 4]
        light = [(3.0,), (float(rng.uniform(0.2, 1.0)) * size,), (1.5,), (1.5,), *[(1.0,)] * 3, *[(0.4,)] * 3]
        ghosts.append(BezierGhost(name=str(k), numbers=(*shape, *light), visible_deg=(0.0, 30.0)))
    return planted(0).replace(ghosts=tuple(ghosts))


def replay_speed(repeat: int = 5) -> dict[str, Any]:
    """Return ghosts in colour per second of CPU time, by softness: median over constellations, best of some runs."""
    models = {f"softness {soft_px:g} px" if soft_px else _SHARP: planted(soft_px=soft_px) for soft_px in _SOFT}
    reported: dict[str, Any] = {}
    for name, model in (models | {"Walch's primitive": curved()}).items():
        packed = pack(model)
        rates = []
        for angle in _ANGLES:
            draw_packed(packed, model, angle, 10.0, SIZE, pool=None)
            best = float("inf")
            for _ in range(repeat):
                start = time.process_time()
                draw_packed(packed, model, angle, 10.0, SIZE, pool=None)
                best = min(best, time.process_time() - start)
            rates.append(len(model.ghosts) / best)
        reported |= {name: round(float(np.median(rates))), f"{name}, by angle": [round(x) for x in rates]}
        reported[f"{name}, frames a second on all cores"] = round(_frames(model, packed, repeat), 1)
    return reported


def _frames(model: GhostModel, packed: Packed, repeat: int) -> float:
    """Return the median number of frames of the whole model per second, with the pool's threads."""
    took = []
    for angle in _ANGLES * repeat:
        start = time.perf_counter()
        draw_packed(packed, model, angle, 10.0, SIZE)
        took.append(time.perf_counter() - start)
    return 1.0 / float(np.median(took))
