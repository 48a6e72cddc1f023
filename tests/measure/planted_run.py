"""Captures of ghosts that are known number by number: no lens, no renderer, only the primitive and noise."""

from __future__ import annotations

import numpy as np

from flarewright.measure.fit import render
from flarewright.measure.numbers import NUMBERS, field, frame
from flarewright.measure.shape import Shape
from flarewright.measure.views import View

SIZE = (240, 160)
LARGEST = 24.0
NOISE = 0.01


def shape(
    speed: float, size: float, level: float, *, bend: float = 0.0, rim: tuple[float, float] | None = None
) -> Shape:
    """Return a ghost of a mean radiance `level`, with a little of every first-order aberration."""
    numbers = np.zeros(NUMBERS)
    numbers[:4] = speed, 0.02 * size, -0.05 * size, bend
    numbers[10:14] = size, 0.05 * size, 0.04 * size, -0.05 * size
    numbers[20:23] = level * size**2, 0.2 * level * size**2, 0.0
    if rim is not None:
        numbers[30:33] = rim[0], 0.0, rim[1]
    return Shape(numbers, 0 if rim is None else 1)


GHOSTS = (
    shape(-110.0, 22.0, 1.0, bend=8.0),
    shape(55.0, 14.0, 0.6),
    shape(-40.0, 34.0, 0.25, rim=(0.9, 1.2)),
    shape(90.0, 7.0, 1.5, bend=-5.0),
)


def views(ghosts=GHOSTS, *, angles=None, roll_deg=0.0, noise=NOISE, seed=0, size=SIZE) -> list[View]:
    """Return noisy views of ghosts; all three colours alike."""
    rng = np.random.default_rng(seed)
    out = []
    for angle in np.linspace(1.0, LARGEST, 24) if angles is None else angles:
        placed = frame((0.5 * size[0] + 2.3, 0.5 * size[1] - 1.6), roll_deg, angle, 1.0)
        blank = np.zeros((size[1], size[0], 3), np.float32)
        view = View(float(angle), abs(field(angle, LARGEST)), placed, (1e4, 0.0), blank, np.full_like(blank, noise**2))
        total = sum((render(ghost, view) for ghost in ghosts), np.zeros((size[1], size[0])))
        out.append(view.showing((total[..., None] + rng.normal(0.0, noise, blank.shape)).astype(np.float32)))
    return out
