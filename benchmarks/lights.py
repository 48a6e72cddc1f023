"""Benchmark of expensive lights and surfaces: a hundred lights, area lights, figure errors.

Each row has a ratio to the same picture with one distant point light, or of the lens as designed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from flarewright.model import Camera, Imperfection, Light, Output, Project, Quality, Rectangle
from flarewright.render.render import render

Row = Callable[..., dict[str, Any]]
Seconds = Callable[[Callable[[], Any]], float]

SIZE_PX = (640, 360)
"""A quarter of the pixels of the other frames, so that each part ends within a minute."""

COUNT = 100
REACH_DEG = (18.0, 10.0)
"""Largest field angles of the random lights; a third of the lights is in the Heliar's picture."""

SINGLES = 4
"""Number of lights that are rendered alone, to measure the cost of one."""


def random_lights(count: int, seed: int = 1) -> tuple[Light, ...]:
    """Return lights of one spectrum at random positions, with log-normal intensities (log standard deviation 1)."""
    rng = np.random.default_rng(seed)
    angles = rng.uniform([-side for side in REACH_DEG], REACH_DEG, (count, 2))
    powers = np.exp(rng.normal(size=count))
    return tuple(
        Light(field_deg=(float(x), float(y)), intensity=float(power))
        for (x, y), power in zip(angles, powers, strict=True)
    )


def _frame(mode: str, lights: tuple[Light, ...], *, starburst: bool = True, lens: str = "heliar-tronnier") -> Project:
    return Project(
        lens=lens,
        f_number=8.0,
        lights=lights,
        camera=Camera(size_px=SIZE_PX),
        quality=Quality(mode=mode, wavelengths=3 if mode == "draft" else 7, ringing="off"),
        output=Output(layers="passes", starburst=starburst),
    )


def lights(seconds: Seconds, row: Row) -> list[dict[str, Any]]:
    """Time a hundred lights against one, final and draft, with and without starbursts."""
    found = []
    many = random_lights(COUNT)
    for mode in ("final", "draft"):
        for starburst in (False, True):
            whole = _frame(mode, many, starburst=starburst)
            alone = [whole.replace(lights=(light,)) for light in many[:: COUNT // SINGLES]]
            one = float(np.mean([seconds(lambda project=project: render(project)) for project in alone]))  # type: ignore[misc]
            all_of_them = seconds(lambda whole=whole: render(whole))  # type: ignore[misc]
            name = f"Heliar {mode} 640x360, {'with starbursts' if starburst else 'ghosts'}"
            found.append(row("lights", f"{name}, one light", 1e3 * one, "ms"))
            found.append(
                row("lights", f"{name}, {COUNT} lights", 1e3 * all_of_them, "ms", all_of_them / one, "one light")
            )
    return found


def area(seconds: Seconds, row: Row) -> list[dict[str, Any]]:
    """Time area lights against a point."""
    found: list[dict[str, Any]] = []
    place = (7.0, 4.0)
    kinds = {
        "point": Light(field_deg=place),
        "sun": Light(field_deg=place, diameter_deg=0.53),
        "disc of 4 degrees": Light(field_deg=place, diameter_deg=4.0),
        "rectangle of 10 x 6 degrees": Light(field_deg=place, shape=Rectangle(size_deg=(10.0, 6.0))),
        "lamp at 500 mm": Light(field_deg=place, distance=500.0),
    }
    for mode in ("final", "draft"):
        one = 0.0
        for name, light in kinds.items():
            project = _frame(mode, (light,))
            taken = seconds(lambda project=project: render(project))  # type: ignore[misc]
            one = one or taken
            ratio = None if taken == one else taken / one
            found.append(row("area", f"Heliar {mode} 640x360, {name}", 1e3 * taken, "ms", ratio, "point"))
    return found


def surfaces(seconds: Seconds, row: Row) -> list[dict[str, Any]]:
    """Time a zoom with decentre, tilt and figure errors on every surface against the zoom as designed."""
    found: list[dict[str, Any]] = []
    plain = _frame("final", (Light(field_deg=(10.0, 5.0)),), starburst=False, lens="canon-28-80")
    samples = {
        "as designed": None,
        "decentred and tilted": Imperfection(seed=1),
        "figure errors of 100 nm too": Imperfection(seed=1, figure_nm=100.0),
    }
    for name, sample in samples.items():
        project = plain.replace(imperfection=sample)
        taken = seconds(lambda project=project: render(project))  # type: ignore[misc]
        ratio = taken / (1e-3 * found[0]["value"]) if found else None
        found.append(row("surfaces", f"Canon final 640x360, {name}", 1e3 * taken, "ms", ratio, "as designed"))
    return found
