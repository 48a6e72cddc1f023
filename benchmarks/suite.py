"""Whole frames of ten lenses, wide open and stopped down, as ratios to the plain scalar tracer of the same run.

    python -m benchmarks --only suite [--lens FILE ...] [--size WxH ...] [--baseline FILE]

A row is one frame: wall clock and processor time of the median of some runs, all frames in turns, so that other load on
the machine affects all of them alike. Its ratio is the processor time in units of a million ray-surfaces of the plain
scalar tracer, so that machines compare.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import atan, degrees, hypot, radians, tan
from pathlib import Path
from typing import Any

from flarewright.model import Bare, Camera, Everywhere, Light, Output, Project, Quality
from flarewright.render.render import render
from flarewright.render.scene.photographic_defaults import as_photographed
from flarewright.render.scene.resolve import open_lens, resolve_project

Row = Callable[..., dict[str, Any]]

LENSES = (
    "canon-28-80", "takumar-50-f1.4", "angenieux-50-f1.1", "nikkor-85-f1.4", "nikon-28-75", "fisheye-nikkor-10.5",
    "heliar-tronnier", "flektogon-35", "biotar-50-f1.4", "speed-panchro-50",
)  # fmt: skip
SIZES = ((1280, 720), (1920, 1080))
STOPPED = 5.6
INSIDE, OUTSIDE = 0.5, 1.3
"""Place of the light, as a part of the half diagonal of the picture."""

TURNS = 5
"""Number of runs of each frame, after one that compiles and fills the caches of glass and coatings."""


@dataclass(frozen=True)
class Work:
    """How a frame is drawn.

    Attributes
    ----------
    name : str
    wavelengths : int
    ringing : str
    photographed : bool
        With the coatings, iris and disc of light of the defaults; else bare glass, a point and a round iris.
    """

    name: str
    wavelengths: int
    ringing: str
    photographed: bool = False


WORKS = (Work("3 wavelengths", 3, "off"), Work("with rings", 3, "collins"), Work("defaults", 7, "collins", True))


@dataclass(frozen=True)
class Frame:
    """One frame of the suite: lens, opening and place of the light; how it is drawn; and its project."""

    name: str
    work: Work
    project: Project

    @property
    def label(self) -> str:
        """Name of its rows."""
        lens, where = self.name.split(", ")
        return f"{lens}, {_by(self.project.camera.size_px)}, {self.work.name}, {where}"


def frames(lens: str, size: tuple[int, int]) -> list[Frame]:
    """Return the frames of a lens: wide open and stopped down, the light inside and outside the picture.

    Parameters
    ----------
    lens : str
        Name or file.
    size : tuple of int
        Pixels.

    Returns
    -------
    list of Frame
    """
    found = []
    opened = open_lens(lens).lens
    plain = Project(lens=lens, lights=(Light(field_deg=(5.0, 2.5)),), camera=Camera(size_px=size))
    order = resolve_project(plain).order
    width, height = plain.camera.sensor
    half_mm = 0.5 * (width**2 + height**2) ** 0.5
    widest = opened.f_number if opened.f_number is not None else order.f_number
    for work, (stop, f_number), (where, part) in product(
        WORKS,
        (("open", widest), (f"f/{STOPPED:g}", STOPPED)),
        (("light inside", INSIDE), ("light outside", OUTSIDE)),
    ):
        if stop != "open" and widest is not None and widest >= STOPPED:
            continue
        field = _field(part * half_mm / order.efl)
        project = plain.replace(
            lights=(Light(field_deg=field),),
            f_number=f_number,
            quality=Quality(wavelengths=work.wavelengths, ringing=work.ringing),
            output=Output(starburst=work.photographed),
        )
        if work.photographed:
            project, _ = as_photographed(project, frozenset({"f_number"}))
        else:
            project = project.replace(coating=Everywhere(coating=Bare()))
        # names such as takumar-50-f1.4 have no suffix
        name = Path(lens).stem if Path(lens).exists() else lens
        found.append(Frame(f"{name} {stop}, {where}", work, project))
    return found


def _by(size: tuple[int, int]) -> str:
    return f"{size[0]}x{size[1]}"


def _field(slope: float) -> tuple[float, float]:
    """Return field angles of a light at two to one, right and up, at most 60 degrees off the axis."""
    slope = min(slope, tan(radians(60.0)))
    across = slope / hypot(1.0, 0.5)
    return degrees(atan(across)), degrees(atan(0.5 * across))


def suite(
    row: Row, scalar: float, repeat: int = TURNS, lenses: Sequence[str] = (), sizes: Sequence[tuple[int, int]] = SIZES
) -> list[dict[str, Any]]:
    """Draw all frames in turns.

    Parameters
    ----------
    row : callable
        Makes a row of the report.
    scalar : float
        Ray-surfaces a second of the plain scalar tracer.
    repeat : int
    lenses : sequence of str
        Lens files beside `LENSES`.
    sizes : sequence of tuple of int

    Returns
    -------
    list of dict
        Wall clock and processor time of every frame, then the slowest frame against the median, by work and size.
    """
    drawn = [frame for size, lens in product(sizes, (*LENSES, *lenses)) for frame in frames(lens, size)]
    wall: list[list[float]] = [[] for _ in drawn]
    spent: list[list[float]] = [[] for _ in drawn]
    for turn in range(repeat + 1):
        for k, frame in enumerate(drawn):
            started, used = time.perf_counter(), time.process_time()
            render(frame.project, threads=os.cpu_count())
            if turn:
                wall[k].append(time.perf_counter() - started)
                spent[k].append(time.process_time() - used)
    found = []
    medians = [statistics.median(times) for times in spent]
    for frame, times, used in zip(drawn, wall, medians, strict=True):
        found.append(row("suite", frame.label, 1e3 * statistics.median(times), "ms"))
        found.append(row("suite", f"{frame.label}, CPU", 1e3 * used, "ms", used * scalar / 1e6, "M ray-surfaces"))
    for size, work in product(sizes, WORKS):
        alike = [
            (used, frame)
            for used, frame in zip(medians, drawn, strict=True)
            if frame.work == work and frame.project.camera.size_px == size
        ]
        worst, slowest = max(alike, key=lambda pair: pair[0])
        middle = statistics.median(used for used, _ in alike)
        name = f"slowest of {_by(size)}, {work.name}: {slowest.name}"
        found.append(row("suite", name, 1e3 * worst, "ms", worst / middle, "median"))
    return found
