"""Benchmark of every pass of a picture, as a ratio to the same picture without it, on a small frame.

Each picture is drawn once to warm up. Then all pictures are drawn in turns, so that other load on the machine affects
all of them alike, and their medians are compared.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

from flarewright.model import (
    Art,
    Bare,
    Camera,
    Dirt,
    Everywhere,
    Imperfection,
    Iris,
    Light,
    Output,
    Plate,
    Project,
    Quality,
    Rule,
    Scatter,
    SensorGrating,
    Starburst,
)
from flarewright.render.reference.energy_ledger import trace_ledger
from flarewright.render.reference.estimator import spectral_shots
from flarewright.render.render import render
from flarewright.render.scene.resolve import resolve_project

Row = Callable[..., dict[str, Any]]

PLACE = (10.0, 5.0)
SLOW = 1.0
"""Time of a picture from which on it is drawn only once, seconds."""

POINTS = 16384
"""Number of points on the front that the reference picture traces."""


def plain() -> Project:
    """Return a project with the ghosts of the bare Heliar at f/8, six blades, and nothing else."""
    return Project(
        lens="heliar-tronnier",
        f_number=8.0,
        iris=Iris(blades=6),
        coating=Everywhere(coating=Bare()),
        lights=(Light(field_deg=PLACE),),
        camera=Camera(size_px=(480, 270)),
        quality=Quality(ringing="off"),
        output=Output(layers="passes", starburst=False),
    )


def variants() -> dict[str, Project]:
    """Return the plain picture, and the pictures with one pass each."""
    base = plain()
    glass = Plate(thickness=2.0, gap=1.0, glass="N-BK7")
    burst = base.replace(output=base.output.replace(starburst=True))
    mirror = base.camera.replace(cover_glass=glass, sensor_reflectance=0.05)
    quality = base.quality
    return {
        "ghosts alone": base,
        "starburst": burst,
        "starburst of rounded blades": burst.replace(iris=Iris(blades=6, rounding=0.4)),
        "starburst with dust": burst.replace(dirt=Dirt(dust_per_mm2=1.0)),
        "starburst of a cat's eye": burst.replace(starburst=Starburst(cats_eye=True)),
        "rings": base.replace(quality=quality.replace(ringing="collins")),
        "scatter, rough surfaces": base.replace(scatter=Scatter(model="harvey-shack")),
        "scatter, Chaumond": base.replace(scatter=Scatter(model="chaumond")),
        "the sun's disc": base.replace(lights=(Light(field_deg=PLACE, diameter_deg=0.53),)),
        "imperfection": base.replace(imperfection=Imperfection(seed=1)),
        "a filter": base.replace(filter=glass),
        "cover glass and a sensor that reflects": base.replace(camera=mirror),
        "its pixels as a grating": base.replace(
            camera=mirror.replace(sensor_grating=SensorGrating(period_um=6.0, orders=2))
        ),
        "four reflections": base.replace(quality=quality.replace(orders=4)),
        "a tint for each ghost": base.replace(art=Art(rules=(Rule(select="all", tint=(1.0, 0.5, 0.2)),))),
        "a layer for each ghost": base.replace(output=base.output.replace(layers="ghosts")),
        "draft": base.replace(quality=quality.replace(mode="draft", wavelengths=3)),
        "reference, 16,384 points": base.replace(
            quality=Quality(mode="reference", reference_samples=POINTS, reference_error=1e-6)
        ),
    }


def passes(repeat: int, row: Row) -> list[dict[str, Any]]:
    """Time each pass against the picture without it."""
    works: dict[str, Callable[[], Any]] = {
        name: (lambda project=project: render(project))  # type: ignore[misc]
        for name, project in variants().items()
    }
    shots = spectral_shots(resolve_project(plain()), None)
    works["the ledger"] = lambda: trace_ledger(shots, 0)
    for work in works.values():
        work()
    times: dict[str, list[float]] = {name: [] for name in works}
    for turn in range(repeat):
        for name, work in works.items():
            # one run is enough for slow pictures
            if turn == 0 or times[name][0] < SLOW:
                start = time.perf_counter()
                work()
                times[name].append(time.perf_counter() - start)
    one = statistics.median(times["ghosts alone"])
    found = []
    for name, taken in times.items():
        middle = statistics.median(taken)
        ratio = None if name == "ghosts alone" else middle / one
        found.append(row("passes", f"bare Heliar 480x270, {name}", 1e3 * middle, "ms", ratio, "ghosts alone"))
    return found
