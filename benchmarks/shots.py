"""Benchmark of shots: the sources of a plate, from one to two thousand, and the memory of long shots."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.scaling import peak_mb
from flarewright.model import Camera, Light, Project, Quality
from flarewright.plates.detection import find_sources
from flarewright.plates.field_map import field_map
from flarewright.plates.joining import joined
from flarewright.plates.lights import lights_at, plate_factor, plate_tracks
from flarewright.plates.settings import PlateSettings
from flarewright.plates.tracking import follow
from flarewright.render.render import render
from flarewright.render.scene.resolve import resolve_project
from flarewright.typing import Pixels

Row = Callable[..., dict[str, Any]]

PLATE_PX = (480, 270)
SOURCES = (1, 2000)
FRAMES = (100, 1000)
_SHOT = """
from pathlib import Path
from tempfile import TemporaryDirectory
from flarewright import Camera, Light, LightKey, Project, Quality, shot
path = (LightKey(at_s=0.0, field_deg=(-6.0, 3.0)), LightKey(at_s=60.0, field_deg=(6.0, 3.0)))
project = Project(
    lens="heliar-tronnier", f_number=8, lights=[Light(field_deg=(5.0, 5.0), keyframes=path)],
    camera=Camera(size_px=(160, 90)), quality=Quality(mode={mode!r}),
)
with TemporaryDirectory() as folder:
    shot(project, Path(folder) / "flare.####.exr", frames="1-{frames}", processes=1, threads=1)
"""


def shots(row: Row, repeat: int) -> list[dict[str, Any]]:
    """Return the CPU time of a frame by its number of sources, and the peak memory of shots by their length."""
    found = []
    for mode in ("draft", "final"):
        one, many = (_sources_seconds(mode, number, repeat) for number in SOURCES)
        name = f"Heliar {mode}, found and drawn"
        found.append(row("shots", f"{name}, one source", 1e3 * one, "ms CPU"))
        found.append(row("shots", f"{name}, {SOURCES[1]} sources", 1e3 * many, "ms CPU", many / one, "one source"))
        short, long = (peak_mb(_SHOT.format(mode=mode, frames=number)) for number in FRAMES)
        found.append(row("shots", f"peak memory, {mode}, {FRAMES[0]} frames", short, "MB"))
        name = f"peak memory, {mode}, {FRAMES[1]} frames"
        found.append(row("shots", name, long, "MB", long / short, f"{FRAMES[0]} frames"))
    return found


def sparse_plate(size_px: tuple[int, int], number: int) -> Pixels:
    """Return a dark picture with single bright pixels, of which no two touch, shape (height, width, 3)."""
    width, height = size_px
    rng, columns = np.random.default_rng(8), width // 3 - 1
    pixels = np.zeros((height, width, 3), np.float32)
    places = rng.permutation(columns * (height // 3 - 1))[:number]
    pixels[3 * (places // columns) + 1, 3 * (places % columns) + 1] = rng.uniform(2.0, 90.0, (number, 3))
    return pixels


def _sources_seconds(mode: str, number: int, repeat: int) -> float:
    """Return the median CPU time to find sources in a plate and to draw their flare on one thread."""
    project = Project(
        lens="heliar-tronnier", f_number=8.0, lights=[Light(field_deg=(0.0, 0.0))], camera=Camera(size_px=PLATE_PX),
        quality=Quality(mode=mode),
    )  # fmt: skip
    settled = resolve_project(project)
    directions = field_map(settled)
    factor = plate_factor(settled, directions)
    pixels = sparse_plate(PLATE_PX, number)
    seconds = []
    # the first picture loads kernels
    for _ in range(repeat + 1):
        started = time.process_time()
        limited, _, groups = joined(
            follow([1], [find_sources(pixels, 1.0)], PLATE_PX[0]), PlateSettings("a.exr").most_lights
        )
        lights, _ = lights_at(plate_tracks(limited, PLATE_PX, joined=groups), 1, directions, factor, PLATE_PX)
        render(project.replace(lights=lights), threads=1)
        seconds.append(time.process_time() - started)
    return float(np.median(seconds[1:]))
