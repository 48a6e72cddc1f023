"""Benchmarks of tracing, rasterization, whole frames, start-up and memory.

    python -m benchmarks [--json FILE] [--repeat N] [--only PART ...] [--baseline FILE]

Every number is the median of repeated runs. Machines differ, so each kernel also has a ratio to a yardstick measured in
the same run: a copy of memory for the raster, a plain scalar tracer for the trace. The benchmarks are not part of the
test suite and have no time limits.
"""

from __future__ import annotations

import argparse
import compileall
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from math import sqrt
from pathlib import Path
from typing import Any

import numba
import numpy as np

import flarewright
from benchmarks.cluster import cluster
from benchmarks.dataset import pairs
from benchmarks.design import design
from benchmarks.lights import area, lights, surfaces
from benchmarks.passes import passes
from benchmarks.scaling import peak_mb, scaling
from benchmarks.shots import shots
from benchmarks.small import RATIOS, elsewhere, small, surely_lost
from benchmarks.suite import SIZES, suite
from benchmarks.yardstick import RAY_SURFACES, trace_plainly
from flarewright.kernels.raster.polygons import blank_plane, fill_polygon
from flarewright.model import (
    Art,
    Bare,
    Camera,
    Everywhere,
    Imperfection,
    Iris,
    Lens,
    Light,
    Output,
    Plate,
    Project,
    Quality,
    Rule,
    Scatter,
)
from flarewright.optics.lens.paraxial import first_order
from flarewright.optics.lens.paths import direct_path, ghost_paths
from flarewright.optics.rays.bundle import trace_points
from flarewright.optics.rays.pack import pack_lens
from flarewright.optics.rays.pupil_region import find_region, front_box
from flarewright.render.reference.batches import HEROES, ray_source, run_batch
from flarewright.render.reference.estimator import spectral_shots
from flarewright.render.render import render
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import build, load_lens, resolve_project
from flarewright.render.scene.shots import make_shots

PARTS = (
    "yardsticks", "trace", "raster", "frame", "passes", "art", "built", "lights", "area", "surfaces", "scatter",
    "ringing", "reference", "design", "residual", "startup", "memory", "small", "dataset", "cluster", "shots",
    "scaling", "suite",
)  # fmt: skip

LIGHT = (10.0, 5.0)
"""Field angles of the frames' light, degrees."""

Rows = list[dict[str, Any]]


LONGEST = 6.0
"""Time limit per number, seconds; at least three runs are always made."""


def median_seconds(work: Callable[[], Any], repeat: int, least: float = 0.0) -> float:
    """Time a function, after one warm-up call, up to `repeat` times; calls shorter than `least` run in batches."""
    work()
    started = time.perf_counter()
    work()
    once = time.perf_counter() - started
    batch = max(1, int(least / max(once, 1e-9)))
    times = [] if batch > 1 else [once]
    while len(times) < repeat and (len(times) < 3 or time.perf_counter() - started < LONGEST):
        start = time.perf_counter()
        for _ in range(batch):
            work()
        times.append((time.perf_counter() - start) / batch)
    return statistics.median(times)


def row(part: str, name: str, value: float, unit: str, ratio: float | None = None, against: str = "") -> dict[str, Any]:
    return {"part": part, "name": name, "value": value, "unit": unit, "ratio": ratio, "against": against}


# --- yardsticks


def yardsticks(repeat: int) -> tuple[Rows, float, float]:
    """Return the rows, bytes copied per second, and scalar ray-surfaces per second, both on one core."""
    source = np.ones(8_000_000)
    target = np.empty_like(source)
    seconds = median_seconds(lambda: np.copyto(target, source), repeat, 0.2)
    bandwidth = 2.0 * source.nbytes / seconds
    scalar = RAY_SURFACES / median_seconds(trace_plainly, repeat, 0.2)
    rows = [
        row("yardsticks", "copy of memory", bandwidth / 1e9, "GB/s"),
        row("yardsticks", "plain scalar tracer, one core", scalar / 1e6, "M ray-surfaces/s"),
    ]
    return rows, bandwidth, scalar


# --- kernels


def _canon(f_number: float = 2.8) -> tuple[Lens, Any, Any]:
    lens = load_lens("canon-28-80")
    project = Project(lens=lens, f_number=f_number, iris=Iris(blades=6), lights=(Light(field_deg=LIGHT),))
    settled = resolve_project(project)
    return lens, settled, make_shots(settled, make_opening(settled, None))[0]


def trace(repeat: int, scalar: float) -> Rows:
    """Trace the whole front of the Canon 28-80 along its 171 paths, 4096 rays each."""
    lens, _, shot = _canon()
    packed, tilt = shot.packed, shot.incidence.tilt
    x0, x1, y0, y1 = front_box(packed, tilt)
    px, py = (g.ravel() for g in np.meshgrid(np.linspace(x0, x1, 64), np.linspace(y0, y1, 64)))
    points = np.stack([px, py], axis=1)
    paths = ghost_paths(lens, "same-side")
    steps = len(points) * sum(len(path.rows) for path in paths)

    def one(path: Any) -> None:
        trace_points(packed, 0, path, tilt, points)

    found = []
    for threads in sorted({1, os.cpu_count() or 1}):
        with ThreadPoolExecutor(threads) as pool:
            rate = steps / median_seconds(lambda pool=pool: list(pool.map(one, paths)), repeat, 0.2)  # type: ignore[misc]
        found.append(
            row("trace", f"171 paths, {threads} thread(s)", rate / 1e6, "M ray-surfaces/s", rate / scalar, "scalar")
        )

    def prepass() -> None:
        for path in paths:
            find_region(packed, path, tilt, shot.opening.radius, shot.view_radius)

    found.append(row("trace", "pre-pass of 171 paths, 1 thread", 1e3 * median_seconds(prepass, repeat), "ms"))
    return found


def raster(repeat: int, bandwidth: float) -> Rows:
    """Draw triangles of several sizes; a fragment is a pixel of one triangle, with three floats read and written."""
    rng = np.random.default_rng(1)
    found = []
    plane = blank_plane(1280, 720)
    rgb = np.array([0.3, 0.6, 0.1])
    for side, count in ((4.0, 20_000), (30.0, 4000), (300.0, 100)):
        middles = rng.uniform([side, side], [1280 - side, 720 - side], (count, 2))
        turn = rng.uniform(0.0, 2.0 * np.pi, count)[:, None] + 2.0 * np.pi / 3.0 * np.arange(3)
        radius = side / sqrt(3.0)
        corners = middles[:, None] + radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        fragments = count * 0.25 * sqrt(3.0) * side**2

        rate = fragments / median_seconds(lambda c=corners: _draw(c, rgb, plane), repeat, 0.2)  # type: ignore[misc]
        found.append(
            row("raster", f"triangles of {side:g} px", rate / 1e6, "M fragments/s", 24.0 * rate / bandwidth, "copy")
        )
    return found


@numba.njit
def _draw(corners, rgb, plane):
    """Draw triangles without a Python call for each."""
    for k in range(corners.shape[0]):
        fill_polygon(corners[k], 3, 1.0, 1e-4, 1e-4, 0.0, 2.0, rgb, plane)


# --- frames


def canon_frame(
    f_number: float, iris: Iris, *, bridge: bool, size: tuple[int, int] = (1280, 720), ringing: str = "off"
) -> Project:
    """Return the workload "Canon": 171 ghosts, 3 wavelengths, no starburst, rings by choice."""
    return Project(
        lens="canon-28-80",
        f_number=f_number,
        iris=iris,
        lights=(Light(field_deg=LIGHT),),
        camera=Camera(size_px=size),
        quality=Quality(wavelengths=3, paths="same-side", bridge=bridge, ringing=ringing),
        output=Output(layers="passes", starburst=False),
    )


def heliar_frame(mode: str, *, starburst: bool, ringing: str = "off") -> Project:
    return Project(
        lens="heliar-tronnier",
        f_number=8.0,
        lights=(Light(field_deg=LIGHT),),
        quality=Quality(mode=mode, wavelengths=3 if mode == "draft" else 7, ringing=ringing),
        output=Output(layers="passes", starburst=starburst),
    )


def frame(repeat: int) -> Rows:
    """Time whole renders, including loading the lens, as the command line and the library run them."""
    found = []
    for label, f_number, iris in (("f/8, six blades", 8.0, Iris(blades=6)), ("wide open", 2.8, Iris())):
        for bridge, ringing in ((False, "off"), (True, "off"), (True, "collins")):
            project = canon_frame(f_number, iris, bridge=bridge, ringing=ringing)
            seconds = median_seconds(lambda project=project: render(project), repeat)  # type: ignore[misc]
            name = f"Canon 1280x720, {label}, bridge {'on' if bridge else 'off'}"
            name += "" if ringing == "off" else ", rings"
            found.append(row("frame", name, 1e3 * seconds, "ms"))
    for name, project in (
        ("Heliar draft 1280x720, ghosts", heliar_frame("draft", starburst=False)),
        ("Heliar draft 1280x720, with starburst", heliar_frame("draft", starburst=True)),
        ("Heliar final 1280x720, with starburst", heliar_frame("final", starburst=True)),
        ("Heliar final 1280x720, with starburst and rings", heliar_frame("final", starburst=True, ringing="collins")),
    ):
        seconds = median_seconds(lambda project=project: render(project), repeat)  # type: ignore[misc]
        found.append(row("frame", name, 1e3 * seconds, "ms"))
    lens = load_lens("heliar-tronnier")
    packing = median_seconds(
        lambda: (
            pack_lens(lens, first_order(lens), (None,) * len(lens.rows), np.array([450.0, 540.0, 610.0])),
            direct_path(lens),
        ),
        repeat,
    )
    found.append(row("frame", "of which packing the Heliar, 3 wavelengths", 1e3 * packing, "ms"))
    return found


def art(repeat: int) -> Rows:
    """Time the Heliar's frame with a rule that changes every ghost; the first row is the unchanged frame."""
    plain = heliar_frame("final", starburst=False)
    changes: dict[str, dict[str, Any]] = {
        "unchanged": {},
        "gain, tint and offset": {"gain": 2.0, "tint": (1.0, 0.5, 0.2), "offset_px": (5.0, 0.0)},
        "scale": {"scale": 1.5},
        "ramp": {"ramp": ((0.0, 1.0, 1.0, 1.0), (1.0, 1.0, 0.5, 0.2))},
        "blur of 3 pixels": {"blur_px": 3.0},
        "blur of 40 pixels": {"blur_px": 40.0},
    }
    found: Rows = []
    for name, change in changes.items():
        project = plain.replace(art=Art(rules=(Rule(select="all", **change),)))
        seconds = median_seconds(lambda project=project: render(project), repeat)  # type: ignore[misc]
        ratio = 1e3 * seconds / found[0]["value"] if found else None
        found.append(row("art", f"Heliar final 1280x720, {name}", 1e3 * seconds, "ms", ratio, "unchanged"))
    return found


def built(repeat: int) -> Rows:
    """Time the Heliar's frame with filters, mirrors and tolerances against the frame without, and setting a zoom."""
    plain = heliar_frame("final", starburst=False)
    glass = Plate(thickness=2.0, gap=1.0, glass="N-BK7")
    mirror = plain.camera.replace(cover_glass=glass, sensor_reflectance=0.05)
    changes: dict[str, dict[str, Any]] = {
        "as it is": {},
        "behind a filter": {"filter": glass},
        "before cover glass and mirror": {"camera": mirror},
        "one sample of it": {"imperfection": Imperfection(seed=1)},
        "ghosts moved by chance": {
            "imperfection": Imperfection(seed=1, decentre_um=0.0, tilt_arcmin=0.0, ghost_offset_mm=0.2)
        },
        "behind the anamorphic adapter": {"lens": "anamorphic-heliar-2x"},
    }
    found: Rows = []
    for name, change in changes.items():
        project = plain.replace(**change)
        seconds = median_seconds(lambda project=project: render(project), repeat)  # type: ignore[misc]
        ratio = 1e3 * seconds / found[0]["value"] if found else None
        found.append(row("built", f"Heliar final 1280x720, {name}", 1e3 * seconds, "ms", ratio, "as it is"))
    zoom = load_lens("canon-70-200")
    for name, ghost_target in (("a position", "wide"), ("between two", 110.0)):
        seconds = median_seconds(lambda ghost_target=ghost_target: build(zoom, zoom=ghost_target), repeat)  # type: ignore[misc]
        found.append(row("built", f"zoom of 33 surfaces set to {name}", 1e3 * seconds, "ms"))
    return found


def scatter(repeat: int) -> Rows:
    """Time drafts with and without the scatter layer, by scatter model."""
    found: Rows = []
    for name in ("heliar-tronnier", "canon-28-80"):
        plain = heliar_frame("draft", starburst=False).replace(lens=name)
        for model in ("none", "harvey-shack", "abg", "chaumond"):
            project = plain.replace(scatter=Scatter(model=model))
            seconds = median_seconds(lambda project=project: render(project), repeat)  # type: ignore[misc]
            found.append(row("scatter", f"{name} draft 1280x720, {model}", 1e3 * seconds, "ms"))
    return found


def ringing(repeat: int) -> Rows:
    """Time the Heliar's frame at f/16 with rings inside its ghosts; the first row has no rings."""
    plain = heliar_frame("final", starburst=False).replace(f_number=16.0, iris=Iris(blades=8))
    found: Rows = []
    for mode, diameter in (("off", 0.0), ("collins", 0.0), ("collins", 0.53), ("frft", 0.0)):
        lights = tuple(light.replace(diameter_deg=diameter) for light in plain.lights)
        project = plain.replace(quality=plain.quality.replace(ringing=mode), lights=lights)
        seconds = median_seconds(lambda project=project: render(project), repeat)  # type: ignore[misc]
        ratio = 1e3 * seconds / found[0]["value"] if found else None
        name = f"Heliar final 1280x720 f/16, {mode}" + (" of the sun" if diameter else "")
        found.append(row("ringing", name, 1e3 * seconds, "ms", ratio, "off"))
    return found


def reference(repeat: int) -> Rows:
    """Time random rays through the whole lens on one thread, with and without a picture, and four reflections."""
    found = []
    for name in ("heliar-tronnier", "canon-28-80"):
        project = Project(lens=name, lights=(Light(field_deg=LIGHT),), quality=Quality(mode="reference"))
        shots = spectral_shots(resolve_project(project), None)
        side = 64
        sources = [ray_source(shot, 0, side=side, light=k) for k, shot in enumerate(shots)]
        for picture in (False, True):
            seconds = median_seconds(
                lambda sources=sources, picture=picture: run_batch(sources, 0, picture=picture),  # type: ignore[misc]
                repeat,
            )
            label = f"{name}, {'1280x720' if picture else 'numbers only'}"
            found.append(row("reference", label, HEROES * side**2 / seconds / 1e3, "k rays/s"))
    bare = heliar_frame("final", starburst=False).replace(coating=Everywhere(coating=Bare()))
    alone = 0.0
    for orders in (2, 4):
        project = bare.replace(quality=bare.quality.replace(orders=orders))
        seconds = 1e3 * median_seconds(lambda project=project: render(project), repeat)  # type: ignore[misc]
        found.append(
            row("reference", f"bare Heliar final 1280x720, orders {orders}", seconds, "ms",
                seconds / alone if alone else None, "orders 2")
        )  # fmt: skip
        alone = seconds
    return found


# --- commands


def _run(arguments: list[str], cache: str | None = None) -> float:
    environment = dict(os.environ)
    # an installed program keeps its byte code
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    if cache is not None:
        environment["NUMBA_CACHE_DIR"] = cache
    start = time.perf_counter()
    subprocess.run(arguments, check=True, env=environment, capture_output=True)
    return time.perf_counter() - start


def startup(repeat: int) -> Rows:
    """Time commands with nothing compiled and with everything compiled (wall time)."""
    python = sys.executable
    command = [python, "-m", "flarewright"] if _has_main() else [str(Path(python).parent / "flarewright")]
    found = []
    compileall.compile_dir(Path(flarewright.__file__).parent, quiet=1)
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "flare.exr")
        for quality in ("draft", "final"):
            work = [*command, "render", "heliar-tronnier", "--light", "10,5", "--quality", quality, "-o", out]
            cold = []
            for k in range(2):
                cache = str(Path(folder) / f"{quality}{k}")
                cold.append(_run(work, cache))
            found.append(row("startup", f"cold command, {quality}", statistics.median(cold), "s"))
            if quality == "final":
                alone = _run([*work, "--threads", "1"], str(Path(folder) / "alone"))
                found.append(row("startup", "cold command, final, in one process", alone, "s"))
            cache = str(Path(folder) / f"{quality}0")
            warm = statistics.median(_run(work, cache) for _ in range(repeat))
            found.append(row("startup", f"warm command, {quality}", warm, "s"))
        lenses = statistics.median(_run([*command, "lenses"]) for _ in range(repeat))
        found.append(row("startup", "flarewright lenses", lenses, "s"))
        empty = statistics.median(_run([python, "-c", "pass"]) for _ in range(repeat))
        package = statistics.median(_run([python, "-c", "import flarewright"]) for _ in range(repeat))
        found.append(row("startup", "import flarewright", package - empty, "s"))
    return found


def residual() -> Rows:
    """Measure what each layer of the residual of measured flare is worth in a replay."""
    # it needs the synthetic camera of the tests
    from benchmarks.measure.ablation import ablation_rows

    return ablation_rows(row)


def _has_main() -> bool:
    return (Path(flarewright.__file__).parent / "__main__.py").exists()


MEMORY = """
import sys
sys.path.insert(0, {root!r})
from benchmarks.run import canon_frame, heliar_frame
from flarewright.model import Camera, Iris
from flarewright.render.render import render
if {which!r} == "canon":
    project = canon_frame(8.0, Iris(blades=6), bridge=True, size=(1920, 1080))
else:
    project = heliar_frame("final", starburst=True).replace(camera=Camera(size_px=(1920, 1080)))
render(project)
"""


def memory() -> Rows:
    """Measure the peak resident memory of a process that renders one frame at 1920x1080."""
    found = []
    root = str(Path(__file__).parents[1])
    for which in ("canon", "heliar"):
        code = MEMORY.format(root=root, which=which)
        found.append(row("memory", f"peak, {which} final 1920x1080", peak_mb(code), "MB"))
    return found


def facts() -> dict[str, Any]:
    return {
        "flarewright": flarewright.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }


def show(rows: Rows) -> None:
    """Print a table of the results."""
    width = max(len(r["name"]) for r in rows)
    part = ""
    for r in rows:
        if r["part"] != part:
            part = r["part"]
            print(f"\n{part}")
        ratio = f"  {r['ratio']:6.2f} x {r['against']}" if r["ratio"] is not None else ""
        before = r.get("before")
        change = "" if not before else f"  {_compared(r) / before:5.2f} of before"
        print(f"  {r['name']:<{width}}  {r['value']:10.4g} {r['unit']}{ratio}{change}")


def _compared(r: dict[str, Any]) -> float:
    """Return the number of a row that machines can compare: its ratio, or its value where it has none."""
    return float(r["ratio"] or r["value"])


def _before(now: dict[str, Any], rows: Rows) -> float | None:
    """Return the compared number of the same row of an earlier run."""
    same = [r for r in rows if (r["part"], r["name"], r["against"]) == (now["part"], now["name"], now["against"])]
    return next((_compared(r) for r in same), None)


def _size(text: str) -> tuple[int, int]:
    width, height = text.split("x")
    return int(width), int(height)


def main(arguments: list[str] | None = None) -> None:
    """Run the chosen parts, print the results, and write them as JSON if requested."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Flarewright's benchmarks.")
    parser.add_argument("--json", metavar="FILE", help="write the numbers to this file")
    parser.add_argument("--repeat", type=int, default=5, help="runs per number; the median is printed (default: 5)")
    parser.add_argument(
        "--only",
        nargs="+",
        choices=PARTS,
        default=PARTS[:-2],
        help="parts to run (default: all but the long scaling and suite)",
    )
    parser.add_argument("--lens", nargs="+", default=[], metavar="FILE", help="more lenses for the suite")
    parser.add_argument("--size", nargs="+", type=_size, default=SIZES, metavar="WxH", help="frames of the suite")
    parser.add_argument("--baseline", metavar="FILE", help="numbers of an earlier --json to print beside these")
    parser.add_argument(
        "--worst", type=float, metavar="FACTOR", help="end with 1 if one of the small works lost more than this factor"
    )
    given = parser.parse_args(arguments)
    machine = facts()
    print("  ".join(f"{key} {value}" for key, value in machine.items()))
    rows, bandwidth, scalar = yardsticks(given.repeat)
    parts: dict[str, Callable[[], Rows]] = {
        "yardsticks": list,
        "trace": lambda: trace(given.repeat, scalar),
        "raster": lambda: raster(given.repeat, bandwidth),
        "frame": lambda: frame(given.repeat),
        "passes": lambda: passes(given.repeat, row),
        "art": lambda: art(given.repeat),
        "built": lambda: built(given.repeat),
        "lights": lambda: lights(lambda work: median_seconds(work, given.repeat), row),
        "area": lambda: area(lambda work: median_seconds(work, given.repeat), row),
        "surfaces": lambda: surfaces(lambda work: median_seconds(work, given.repeat), row),
        "scatter": lambda: scatter(given.repeat),
        "ringing": lambda: ringing(given.repeat),
        "reference": lambda: reference(given.repeat),
        "design": lambda: design(lambda work: median_seconds(work, given.repeat, 0.2), row),
        "residual": residual,
        "startup": lambda: startup(given.repeat),
        "memory": memory,
        "small": lambda: small(row, given.repeat),
        "dataset": lambda: pairs(row),
        "cluster": lambda: cluster(row, os.cpu_count() or 1),
        "shots": lambda: shots(row, given.repeat),
        "scaling": lambda: scaling(row, os.cpu_count() or 1),
        "suite": lambda: suite(row, scalar, given.repeat, given.lens, given.size),
    }
    for part in PARTS:
        if part in given.only:
            rows += parts[part]()
    if given.baseline:
        before = json.loads(Path(given.baseline).read_text(encoding="utf-8"))["results"]
        rows = [{**r, "before": _before(r, before)} for r in rows]
    kept = json.loads(RATIOS.read_text(encoding="utf-8"))["ratios"] if RATIOS.exists() else {}
    rows = [{**r, "before": kept.get(r["name"])} if r["part"] == "small" else r for r in rows]
    show(rows)
    if given.json:
        Path(given.json).write_text(
            json.dumps({"machine": machine, "results": rows}, indent=2) + "\n", encoding="utf-8"
        )
    if given.worst is not None:
        now = {r["name"]: r["ratio"] for r in rows if r["part"] == "small"}
        losses = surely_lost(now, kept, given.worst, elsewhere)
        print("\n".join(losses) or f"no small work lost more than a factor of {given.worst:g}")
        sys.exit(1 if losses else 0)


if __name__ == "__main__":
    main()
