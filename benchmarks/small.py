"""Small works of every part, as ratios to the yardstick, compared with the ratios that the repository keeps.

    python -m benchmarks --only small [--worst 1.5]
    python -m benchmarks.small
    python -m benchmarks.small --middle

The second command measures the ratios and keeps them; the third keeps the geometric middle of the kept ones and of
this machine's, because works that wait for memory cost up to 1.4 times as much on some machines, beside the others.

The works run in turns with the yardstick, and the least processor time of each counts, so that other load on the
machine matters little. Processors differ in what they do well: the ratios of one machine are those of another times a
common factor, the median over all works. A work has lost speed if it exceeds that factor by much; all of them have if
the factor itself is large.

A process may be unlucky for its whole life, with the places of its memory for instance. So a loss is measured again, in
new processes, and counts if every one of them shows it.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.yardstick import trace_plainly
from flarewright import ghosts
from flarewright.model import Bare, Camera, Everywhere, Iris, Light, Output, Project, Quality, Scatter, Standard
from flarewright.optics.lens.paths import ghost_paths
from flarewright.optics.rays.bundle import trace_points
from flarewright.optics.rays.pupil_region import find_region, front_box
from flarewright.render.image.display import view
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

Row = Callable[..., dict[str, Any]]

RATIOS = Path(__file__).with_name("ratios.json")
"""The ratios that are kept."""

LEAST_TURNS = 5
"""Least number of runs of each work."""

QUICK_S = 0.1
"""Works below this many seconds are run once more before each measurement."""

PROCESSES = 4
"""Number of processes that must all show a loss."""

MACHINES_DIFFER = 3.0
"""Common factor of all works up to which machines may differ."""


def works() -> dict[str, Callable[[], Any]]:
    """Return the works by name; each takes some 10 to 200 ms of one core."""
    base = Project(
        lens="heliar-tronnier",
        f_number=8.0,
        iris=Iris(blades=6),
        coating=Everywhere(coating=Bare()),
        lights=(Light(field_deg=(10.0, 5.0)),),
        camera=Camera(size_px=(240, 135)),
        quality=Quality(wavelengths=3, ringing="off"),
        output=Output(layers="passes", starburst=False),
    )
    quality, burst = base.quality, base.output.replace(starburst=True)
    canon, takumar = base.replace(lens="canon-28-80"), base.replace(lens="takumar-50-f1.4", f_number=None)
    projects = {
        "Heliar, ghosts": base,
        "Heliar, traced wavelengths alone": base.replace(quality=quality.replace(bridge=False)),
        "Heliar, rings": base.replace(quality=quality.replace(ringing="collins")),
        "Heliar, early multicoat": base.replace(coating=Everywhere(coating=Standard(name="early-multicoat"))),
        "Heliar, the sun's disc": base.replace(lights=(Light(field_deg=(10.0, 5.0), diameter_deg=0.53),)),
        "Heliar, starburst": base.replace(output=burst),
        "Heliar, starburst of rounded blades": base.replace(output=burst, iris=Iris(blades=6, rounding=0.4)),
        "Heliar, draft with scatter": base.replace(
            quality=quality.replace(mode="draft"), scatter=Scatter(model="harvey-shack")
        ),
        "Canon, ghosts": canon,
        "Canon, draft": canon.replace(quality=quality.replace(mode="draft")),
        "Canon, draft of early multicoat": canon.replace(
            quality=quality.replace(mode="draft"), coating=Everywhere(coating=Standard(name="early-multicoat"))
        ),
        "Takumar wide open, ghosts": takumar.replace(iris=Iris()),
    }
    found: dict[str, Callable[[], Any]] = {
        name: partial(render, project, threads=1) for name, project in projects.items()
    }
    lens = load_lens("canon-28-80")
    settled = resolve_project(canon)
    shot = make_shots(settled, make_opening(settled, None))[0]
    tilt, radius, seen = shot.incidence.tilt, shot.opening.radius, shot.view_radius
    x0, x1, y0, y1 = front_box(shot.packed, tilt)
    points = np.stack([g.ravel() for g in np.meshgrid(np.linspace(x0, x1, 32), np.linspace(y0, y1, 32))], axis=1)
    paths = ghost_paths(lens, "same-side")
    found["Canon, 1,024 rays along 171 paths"] = lambda: [
        trace_points(shot.packed, 0, path, tilt, points) for path in paths
    ]
    found["Canon, search of 171 pupils"] = lambda: [
        find_region(shot.packed, path, tilt, radius, seen) for path in paths
    ]
    picture = render(base.replace(output=burst), threads=1)
    found["codes of a PNG"] = lambda: view(picture.layers[0].pixels)
    found["table of the Heliar's ghosts"] = lambda: ghosts("heliar-tronnier", (8.0, 0.0), f_number=8.0, threads=1)
    return found


def ratios(turns: int) -> dict[str, tuple[float, float]]:
    """Return for each work its least processor time, seconds, and that in units of the yardstick's."""
    every: dict[str, Callable[[], Any]] = {"": trace_plainly, **works()}
    quick = set()
    for name, work in every.items():
        work()
        started = time.process_time()
        work()
        if time.process_time() - started < QUICK_S:
            quick.add(name)
    least = dict.fromkeys(every, float("inf"))
    for _ in range(max(turns, LEAST_TURNS)):
        for name, work in every.items():
            # the work before it has taken the processor's caches; how much that costs differs between machines
            if name in quick:
                work()
            started = time.process_time()
            work()
            least[name] = min(least[name], time.process_time() - started)
    one = least.pop("")
    return {name: (seconds, seconds / one) for name, seconds in least.items()}


def small(row: Row, repeat: int) -> list[dict[str, Any]]:
    """Time the small works."""
    return [
        row("small", name, 1e3 * seconds, "ms CPU", ratio, "yardstick")
        for name, (seconds, ratio) in ratios(repeat).items()
    ]


def lost(now: Mapping[str, float], kept: Mapping[str, float], worst: float) -> dict[str, str]:
    """Tell which works lost speed.

    Parameters
    ----------
    now, kept : mapping of str to float
        Ratio to the yardstick, by work; more is slower.
    worst : float
        Largest factor of a work's loss against the median of all.

    Returns
    -------
    dict of str to str
        A sentence for each work that lost more, for works without a kept ratio, and, under an empty name, for a loss of
        all works.
    """
    changes = {name: ratio / kept[name] for name, ratio in now.items() if name in kept}
    found = {name: f"{name}: no ratio is kept; run python -m benchmarks.small" for name in now if name not in kept}
    if not changes:
        return {**found, "": "no small work was measured"}
    common = statistics.median(changes.values())
    if common > MACHINES_DIFFER:
        found[""] = f"all works: {common:.2f} times the kept ratios; machines differ by {MACHINES_DIFFER:g} at most"
    for name, change in changes.items():
        if change > worst * common:
            found[name] = f"{name}: {change / common:.2f} times its kept ratio, beside the other works"
    return found


def surely_lost(
    now: Mapping[str, float], kept: Mapping[str, float], worst: float, again: Callable[[], Mapping[str, float]]
) -> list[str]:
    """Tell which works lost speed in each of `PROCESSES` processes.

    Parameters
    ----------
    now, kept, worst
        As for `lost`.
    again : callable
        Measures the ratios in a new process; called only while there are losses.

    Returns
    -------
    list of str
        The first process' sentences.
    """
    found = lost(now, kept, worst)
    for _ in range(PROCESSES - 1):
        if not found:
            break
        print("\n".join(found.values()), "measured again in a new process", sep="\n", flush=True)
        once_more = lost(again(), kept, worst)
        found = {name: sentence for name, sentence in found.items() if name in once_more}
    return list(found.values())


def middle(now: Mapping[str, float], kept: Mapping[str, float]) -> dict[str, float]:
    """Return the geometric middle of two machines' ratios, but for their common factor; works of one alone as they are.

    Parameters
    ----------
    now, kept : mapping of str to float
        Ratio to the yardstick, by work.
    """
    changes = {name: ratio / kept[name] for name, ratio in now.items() if name in kept}
    common = statistics.median(changes.values())
    return {name: kept[name] * sqrt(changes[name] / common) if name in kept else ratio for name, ratio in now.items()}


def elsewhere() -> dict[str, float]:
    """Return the ratios as a new process measures them."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.small", "--print"], check=True, stdout=subprocess.PIPE, text=True
    )
    found: dict[str, float] = json.loads(done.stdout)
    return found


def main() -> None:
    """Measure the ratios and keep them or their middle with the kept ones, or print them for `elsewhere`."""
    if sys.argv[1:] == ["--print"]:
        print(json.dumps({name: ratio for name, (_, ratio) in ratios(LEAST_TURNS).items()}))
        return
    now = {name: ratio for name, (_, ratio) in ratios(15).items()}
    if sys.argv[1:] == ["--middle"]:
        now = middle(now, json.loads(RATIOS.read_text(encoding="utf-8"))["ratios"])
    found = {name: float(f"{ratio:.3g}") for name, ratio in now.items()}
    RATIOS.write_text(json.dumps({"ratios": found}, indent=2) + "\n", encoding="utf-8")
    print(f"wrote {RATIOS}")


if __name__ == "__main__":
    main()
