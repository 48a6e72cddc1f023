"""Benchmark of the run time of a measurement: planted ghosts at all constellations, from merged frames to the model."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flarewright.io.measurement.merged import write_frame, write_run
from flarewright.measure.core.parameter_vector import NUMBERS, channel_of
from flarewright.measure.pipeline.compress_stage import compress_ghosts
from flarewright.measure.pipeline.find_stage import find_ghosts
from flarewright.measure.pipeline.fit_stage import fit_ghosts
from flarewright.measure.pipeline.track_stage import track_ghosts
from flarewright.measure.replay.model_image import draw
from flarewright.model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from flarewright.model.measurement.ghost_model import AberrationGhost, GhostModel

# picture size, pixels; focal length, pixels; largest constellation, degrees
SIZE, FOCAL_PX, LARGEST_DEG = (720, 480), 720.0, 29.7
AXIS_PX = (363.0, 238.0)
# standard deviation of a pixel in each colour; ghosts are 20 to 500 times as bright
NOISE = 0.002
_COLOURS = ("red", "green", "blue")
# relative size of a ghost in each colour (lateral colour)
_SPREAD = (1.01, 1.0, 0.985)


def planted(count: int, seed: int = 1) -> GhostModel:
    """Return a model of ghosts of radius 8 to 120 pixels, slightly aberrated, every second one cut by a rim."""
    rng = np.random.default_rng(seed)
    ghosts = []
    for k in range(count):
        size = float(np.exp(rng.uniform(np.log(8.0), np.log(120.0))))
        level = float(np.exp(rng.uniform(np.log(20.0), np.log(500.0)))) * NOISE
        numbers = np.zeros(NUMBERS)
        numbers[:4] = rng.uniform(-450.0, 450.0), 0.02 * size, -0.05 * size, 15.0 * rng.normal()
        numbers[10:14] = size, 0.05 * size * rng.normal(), 0.04 * size, -0.05 * size
        numbers[20:23] = level * size**2 * np.array([1.0, 0.2 * rng.normal(), 0.0])
        if k % 2:
            numbers[30:33] = rng.uniform(-0.9, 0.9), 0.0, 1.2
        channels = {}
        for colour, part in zip(_COLOURS, _SPREAD, strict=True):
            own = numbers.copy()
            own[10] *= part
            channels[colour] = channel_of(own, k % 2)
        ghosts.append(AberrationGhost(name=f"planted {k}", visible_deg=(0.0, LARGEST_DEG), **channels))
    return GhostModel(
        size_px=SIZE, axis_px=AXIS_PX, focal_px=FOCAL_PX, largest_deg=LARGEST_DEG,
        constellation_deg=(0.0, LARGEST_DEG), ghosts=tuple(ghosts),
    )  # fmt: skip


def write_planted(model: GhostModel, angles: NDArray[np.float64], folder: Path, seed: int = 2) -> MergedRun:
    """Write the merged frames of a model: its replay with noise."""
    rng = np.random.default_rng(seed)
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    frames = []
    for k, angle in enumerate(angles):
        light = (AXIS_PX[0] + FOCAL_PX * float(np.tan(np.radians(angle))), AXIS_PX[1])
        info = FrameInfo(
            file=f"frames/frame-{k:03d}.exr", constellation_deg=float(angle), nominal_deg=float(angle),
            light_px=light, axis_px=AXIS_PX,
        )  # fmt: skip
        shown = draw(model, float(angle), 0.0, SIZE)
        noisy = (shown + rng.normal(0.0, NOISE, shown.shape)).astype(np.float32)
        write_frame(folder, MergedFrame(info, noisy, np.full_like(noisy, NOISE**2)))
        frames.append(info)
    run = MergedRun(size_px=SIZE, frames=tuple(frames), axis_px=AXIS_PX, px_per_rad=FOCAL_PX)
    write_run(folder, run)
    return run


def planted_time(count: int, constellations: int, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure planted ghosts; return times, and the error halfway between the constellations used.

    Parameters
    ----------
    count : int
        Number of ghosts.
    constellations : int
        Number of constellations, all of them photographed.
    tell : callable
        Called with a line after each stage.
    """
    truth = planted(count)
    angles = np.linspace(0.0, LARGEST_DEG, constellations)
    walls, times = [time.perf_counter()], [time.process_time()]
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        run = write_planted(truth, angles, folder)

        def done(words: str) -> None:
            walls.append(time.perf_counter())
            times.append(time.process_time())
            tell(f"{walls[-1] - walls[-2]:7.1f} s ({times[-1] - times[-2]:7.1f} CPU s): {words}")

        done("planted")
        rough = find_ghosts(folder, run)
        done(f"found {len(rough.ghosts)}")
        model = fit_ghosts(folder, run, rough, residual=False)
        done(f"fitted {len(model.ghosts)}")
        tracks = track_ghosts(folder, run, model)
        done("tracked")
        model = compress_ghosts(folder, run, model, tracks)
        done("compressed")
    return {
        "planted": count, "found": len(model.ghosts), "constellations": constellations, "cores": os.cpu_count(),
        "wall s": walls[-1] - walls[1], "CPU s": times[-1] - times[1],
        "find, fit, track, compress, s": [round(end - start, 1) for start, end in pairwise(walls[1:])],
        **halfway(model, truth, angles),
    }  # fmt: skip


def halfway(model: GhostModel, truth: GhostModel, angles: NDArray[np.float64]) -> dict[str, float]:
    """Return the errors of a model and of interpolated images against the truth, between some constellations."""
    mine = between = whole = 0.0
    for first, second in pairwise(angles[:: max(1, len(angles) // 10)]):
        # the two constellations around the midpoint
        at = int(np.searchsorted(angles, 0.5 * (first + second)))
        angle = 0.5 * float(angles[at - 1] + angles[at])
        before, true, after = (draw(truth, float(one), 0.0, SIZE) for one in (angles[at - 1], angle, angles[at]))
        mine += float(((draw(model, angle, 0.0, SIZE) - true) ** 2).sum())
        between += float(((0.5 * (before + after) - true) ** 2).sum())
        whole += float((true**2).sum())
    return {
        "error": float(np.sqrt(mine / whole)), "interpolation's": float(np.sqrt(between / whole)),
        "gain dB": 10.0 * float(np.log10(between / mine)),
    }  # fmt: skip
