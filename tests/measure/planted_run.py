"""Captures of ghosts with known parameters, from the ghost model and noise, without a lens or renderer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np

from flarewright.io.measurement.merged import write_frame, write_run
from flarewright.measure.core.parameter_vector import NUMBERS, field, frame
from flarewright.measure.core.parameters import Shape, rescaled
from flarewright.measure.core.views import View
from flarewright.measure.fitting.alternating_fit import to_model
from flarewright.measure.fitting.detected_ghost import DetectedGhost
from flarewright.measure.fitting.ghost_fit import render
from flarewright.model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from flarewright.model.measurement.ghost_model import GhostModel

SIZE = (240, 160)
LARGEST = 24.0
NOISE = 0.01
# constellations and pixels per radian of a merged run
ANGLES = np.linspace(2.0, LARGEST, 12)
FOCAL = 900.0


def shape(
    speed: float, size: float, level: float, *, bend: float = 0.0, rim: tuple[float, float] | None = None
) -> Shape:
    """Return a ghost of mean radiance `level` with small values of every first-order aberration."""
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

# the same in pictures of half the size, for tests of several stages
SMALL = (120, 80)
SMALL_GHOSTS = tuple(rescaled(one, 0.5) for one in GHOSTS)
SMALL_ANGLES = np.linspace(2.0, LARGEST, 4)


@cache
def _grain(seed: int, shape: tuple[int, ...]) -> tuple[Iterator[np.ndarray], list[np.ndarray]]:
    """Return a generator of unit noise and the list of pictures drawn so far."""
    rng = np.random.default_rng(seed)
    return (rng.standard_normal(shape) for _ in count()), []


def _noise(seed: int, number: int, shape: tuple[int, ...]) -> np.ndarray:
    """Return the noise of one picture, drawn once for all runs of a seed and a size."""
    fresh, drawn = _grain(seed, shape)
    while len(drawn) <= number:
        drawn.append(next(fresh))
    return drawn[number]


def views(ghosts=GHOSTS, *, angles=None, roll_deg=0.0, noise=NOISE, seed=0, size=SIZE) -> list[View]:
    """Return noisy views of ghosts with equal colours."""
    out: list[View] = []
    for angle in np.linspace(1.0, LARGEST, 24) if angles is None else angles:
        placed = frame((0.5 * size[0] + 2.3, 0.5 * size[1] - 1.6), roll_deg, angle, 1.0)
        blank = np.zeros((size[1], size[0], 3), np.float32)
        view = View(float(angle), abs(field(angle, LARGEST)), placed, (1e4, 0.0), blank, np.full_like(blank, noise**2))
        total = sum((render(ghost, view) for ghost in ghosts), np.zeros((size[1], size[0])))
        shown = total[..., None] + noise * _noise(seed, len(out), blank.shape)
        out.append(view.showing(shown.astype(np.float32)))
    return out


def write(
    folder: Path,
    ghosts: Sequence[Shape],
    *,
    angles=ANGLES,
    size=SIZE,
    focal=FOCAL,
    last_from=0,
    roll_deg=0.0,
    seed=0,
) -> MergedRun:
    """Write a merged run of planted ghosts; the last one appears at constellation number `last_from`."""
    (folder / "frames").mkdir(parents=True)
    born = views(ghosts, angles=angles, size=size, roll_deg=roll_deg, seed=seed)
    before = views(ghosts[:-1], angles=angles, size=size, roll_deg=roll_deg, seed=seed) if last_from else []
    infos = []
    for k, view in enumerate([*before[:last_from], *born[last_from:]]):
        x, y, cosine, sine, _ = (float(each) for each in view.frame)
        # the frame of a view points to its light
        along = focal * float(np.tan(np.radians(abs(angles[k]))))
        info = FrameInfo(
            file=f"frames/{k:03d}.exr", constellation_deg=float(angles[k]), nominal_deg=float(angles[k]),
            roll_deg=roll_deg, nominal_roll_deg=roll_deg, light_px=(x + along * cosine, y - along * sine),
            axis_px=(x, y),
        )  # fmt: skip
        write_frame(folder, MergedFrame(info, view.pixels, view.variance))
        infos.append(info)
    run = MergedRun(size_px=size, frames=tuple(infos), axis_px=(x, y), px_per_rad=focal)
    write_run(folder, run)
    return run


def write_small(folder: Path, ghosts: Sequence[Shape] = SMALL_GHOSTS[:1], **reported) -> MergedRun:
    """Write a merged run of few small pictures."""
    return write(folder, ghosts, **{"angles": SMALL_ANGLES, "size": SMALL, **reported})


def rough_model(run: MergedRun, ghosts: Sequence[Shape] = SMALL_GHOSTS[:1]) -> GhostModel:
    """Return the planted ghosts as a rough model, like an ideal result of the search."""
    angles = [frame.constellation_deg for frame in run.frames]
    found = [DetectedGhost((one, one, one), 0, len(angles) - 1) for one in ghosts]
    return GhostModel(
        size_px=run.size_px, axis_px=run.axis_px, focal_px=run.px_per_rad, largest_deg=max(map(abs, angles)),
        constellation_deg=(min(angles), max(angles)),
        ghosts=to_model(found, views((), angles=angles, size=run.size_px)),
    )  # fmt: skip
