"""How the cost of a picture grows with ghosts, wavelengths, pixels, lights and threads, with fitted exponents.

    python -m benchmarks --only scaling

All frames are the Canon 28-80's at f/8 with three wavelengths, 1280x720, ghosts alone, one thread and one light, but
for what the curve varies. Sizes up to 8K run in a process each, for its peak memory.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import log
from typing import Any

import numpy as np

from benchmarks.lights import random_lights
from flarewright.model import Bare, Camera, Everywhere, Light, Output, Project, Quality
from flarewright.optics.lens.paths import ghost_paths
from flarewright.render.render import render
from flarewright.render.scene.resolve import load_lens

Row = Callable[..., dict[str, Any]]

PIXELS = ((320, 180), (640, 360), (1280, 720), (1920, 1080), (3840, 2160))
LARGE = ((1920, 1080), (3840, 2160), (7680, 4320))
WAVELENGTHS = (3, 7, 15, 31)
LIGHTS = (1, 4, 16, 64)
LENSES = ("heliar-tronnier", "takumar-50-f1.4", "canon-28-80", "canon-70-200")
"""Lenses of few to many surfaces."""

TURNS = 3


@dataclass(frozen=True)
class Point:
    """One point of a curve: what varies, and the seconds that it takes."""

    at: float
    wall_s: float
    cpu_s: float


def frame(lens: str = "canon-28-80", size: tuple[int, int] = (1280, 720), wavelengths: int = 3) -> Project:
    """Return the frame that the curves vary."""
    return Project(
        lens=lens,
        f_number=8.0,
        coating=Everywhere(coating=Bare()),
        lights=(Light(field_deg=(10.0, 5.0)),),
        camera=Camera(size_px=size),
        quality=Quality(wavelengths=wavelengths, paths="same-side", ringing="off"),
        output=Output(layers="passes", starburst=False),
    )


def exponent(points: Sequence[Point], *, wall: bool = False) -> float:
    """Return the exponent p of a fit of seconds = c * at^p, by least squares of the logarithms."""
    x = [log(point.at) for point in points]
    y = [log(point.wall_s if wall else point.cpu_s) for point in points]
    return float(np.polyfit(x, y, 1)[0])


def _timed(work: Callable[[], Any], at: float) -> Point:
    work()
    wall, cpu = [], []
    for _ in range(TURNS):
        started, used = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - started)
        cpu.append(time.process_time() - used)
    return Point(at, statistics.median(wall), statistics.median(cpu))


def peak_mb(code: str) -> float:
    """Return the peak resident memory of a process that runs some Python code, MB."""
    code += "\nimport resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    # kilobytes on Linux, bytes on macOS
    return int(done.stdout.split()[-1]) / (1e6 if sys.platform == "darwin" else 1e3)


def _photographed(size: tuple[int, int]) -> str:
    """Return code that draws one frame with all defaults."""
    return (
        "from benchmarks.scaling import frame; from flarewright.render.render import render\n"
        "from flarewright.render.scene.photographic_defaults import as_photographed\n"
        f"render(as_photographed(frame(size={size}, wavelengths=7), frozenset({{'f_number'}}))[0])"
    )


def scaling(row: Row, threads: int) -> list[dict[str, Any]]:
    """Time every curve.

    Parameters
    ----------
    row : callable
        Makes a row of the report.
    threads : int
        Largest number of threads.
    """
    plain = frame()
    curves: dict[str, list[Point]] = {}
    curves["pixels"] = [_timed(partial(render, frame(size=size), threads=1), size[0] * size[1]) for size in PIXELS]
    curves["wavelengths"] = [_timed(partial(render, frame(wavelengths=n), threads=1), n) for n in WAVELENGTHS]
    curves["lights"] = [_timed(partial(render, plain.replace(lights=random_lights(n)), threads=1), n) for n in LIGHTS]
    curves["ghosts"] = [
        _timed(partial(render, frame(lens), threads=1), len(ghost_paths(load_lens(lens), "same-side")))
        for lens in LENSES
    ]
    curves["threads"] = [_timed(partial(render, plain, threads=n), n) for n in range(1, threads + 1)]
    found = []
    for name, points in curves.items():
        for point in points:
            label = f"{point.at:,.0f} {name}"
            found.append(row("scaling", label, 1e3 * point.wall_s, "ms"))
            found.append(row("scaling", f"{label}, CPU", 1e3 * point.cpu_s, "ms"))
        if len(points) > 1:
            found.append(row("scaling", f"exponent of {name}", exponent(points, wall=name == "threads"), ""))
    for size in LARGE:
        found.append(row("scaling", f"peak memory, {size[0]}x{size[1]}, defaults", peak_mb(_photographed(size)), "MB"))
    return found
