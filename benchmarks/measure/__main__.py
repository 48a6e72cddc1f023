"""Benchmark of the measurement, as a table.

    python -m benchmarks.measure LENS ... [--width 720] [--merge real|ideal] [--keep FOLDER] [--json FILE]
    python -m benchmarks.measure LENS ... --isolated [--width 360]
    python -m benchmarks.measure [LENS ...] --ablation
    python -m benchmarks.measure --speed
    python -m benchmarks.measure --planted 25 [--count 100]

A synthetic camera (`tests/measure/synthetic_camera.py`) photographs each lens at the even ones of 100 constellations.
The stages find, fit, track and compress use only these, as `flarewright measure run` does. The model is compared with
the noise-free truth at the odd constellations, outside 40 (of 720) pixels around the light, and at three of them with
the light in other directions, where a rotated photograph is the reference (`rolled`).
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.measure.ablation import LAYERS, LENSES, Series, ablation, table
from benchmarks.measure.isolated import isolated, summary
from benchmarks.measure.judge import judge
from benchmarks.measure.planted import planted_time
from benchmarks.measure.rolled import judge_rolled, shoot_rolled
from benchmarks.measure.shoot import setup_of, shoot
from benchmarks.measure.speed import replay_speed
from flarewright.io.measurement.captures import read_camera, read_captures
from flarewright.io.measurement.ghost_model_file import write_ghost_model
from flarewright.io.measurement.merged import read_run
from flarewright.measure.pipeline.compress_stage import compress_ghosts
from flarewright.measure.pipeline.find_stage import find_ghosts
from flarewright.measure.pipeline.fit_stage import fit_ghosts
from flarewright.measure.pipeline.merge_stage import merge_captures
from flarewright.measure.pipeline.track_stage import track_ghosts


def prove(lens: str, folder: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Photograph one lens, run all stages and return the scores."""
    setup = setup_of(lens, given.width, given.count, given.f_number)
    shoot(setup, folder)
    shoot_rolled(setup, folder)
    run_folder = folder / given.merge
    start, cpu = time.perf_counter(), time.process_time()

    def tell(text: str) -> None:
        print(f"{lens} {time.process_time() - cpu:7.1f} CPU s: {text}", flush=True)

    if given.merge == "real":
        captures = read_captures(folder / "captures.csv")
        merge_captures(captures, folder, run_folder, camera=read_camera(folder / "camera.json"))
        tell("merged")
    run = read_run(run_folder)
    merged = time.process_time()
    rough = find_ghosts(run_folder, run, report=tell)
    found = time.process_time()
    model = fit_ghosts(run_folder, run, rough, residual=False, report=tell)
    fitted = time.process_time()
    write_ghost_model(folder / f"model-{given.merge}.json", model)
    tell("fitted")
    tracks = track_ghosts(run_folder, run, model)
    tracked = time.process_time()
    model = compress_ghosts(run_folder, run, model, tracks)
    compressed = time.process_time()
    wall = time.perf_counter() - start
    write_ghost_model(folder / f"compact-{given.merge}.json", model)
    tell("compressed")
    scores = judge(model, folder, run_folder, run)
    times = {
        "merge": merged - cpu, "find": found - merged, "fit": fitted - found, "track": tracked - fitted,
        "compress": compressed - tracked, "wall": wall,
    }  # fmt: skip
    facts = {"lens": lens, "merge": given.merge, "ghosts": len(model.ghosts), "CPU s": times}
    return {**facts, **scores, **judge_rolled(model, folder, run_folder, run)}


def main() -> None:
    """Compute the scores of lenses and print them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.measure", description=__doc__)
    parser.add_argument("lens", nargs="*")
    parser.add_argument("--speed", action="store_true", help="measure how fast a model replays")
    parser.add_argument("--planted", type=int, metavar="GHOSTS", help="time this number of ghosts, all angles used")
    parser.add_argument("--isolated", action="store_true", help="measure single ghosts and compare with Walch's method")
    parser.add_argument("--ablation", action="store_true", help="measure what each layer of the residual is worth")
    parser.add_argument("--width", type=int, help="of the pictures, pixels (default: 720; --ablation: 240)")
    parser.add_argument("--count", type=int, help="number of constellations, even and odd (default: 100, or 21)")
    parser.add_argument("--range", type=float, nargs=2, help="--ablation: first and last constellation (default: 4 14)")
    parser.add_argument("--ghosts", type=int, help="--ablation: number of ghosts to search (default: 12)")
    parser.add_argument("--layer", choices=tuple(LAYERS), action="append", help="--ablation: this layer alone")
    parser.add_argument("--f-number", type=float, default=5.6)
    parser.add_argument("--merge", choices=("real", "ideal"), default="real")
    parser.add_argument("--keep", type=Path, help="folder for photographs and models, reused by later runs")
    parser.add_argument("--json", type=Path, help="write the scores to this file")
    given = parser.parse_args()
    series = Series(
        given.width or Series.width, given.count or Series.count, tuple(given.range or Series.range_deg),
        given.ghosts or Series.most_ghosts,
    )  # fmt: skip
    given.width, given.count = given.width or 720, given.count or 100
    rows = [replay_speed()] if given.speed else []
    if given.planted:
        rows.append(planted_time(given.planted, given.count, lambda text: print(text, flush=True)))
    for row in rows:
        print(json.dumps(row), flush=True)
    if given.ablation:
        rows += ablation(
            lambda text: print(text, flush=True), given.lens or LENSES, series, given.layer or tuple(LAYERS)
        )
        print(table(rows))
    elif given.isolated:
        alone: list[dict[str, Any]] = []
        for lens in given.lens:
            alone += isolated(lens, given.width, given.count, given.f_number, lambda text: print(text, flush=True))
        rows += [*alone, summary(alone)]
        print(json.dumps(rows[-1]), flush=True)
    with tempfile.TemporaryDirectory() as made:
        for lens in () if given.isolated or given.ablation else given.lens:
            folder = (given.keep or Path(made)) / f"{Path(lens).stem}-{given.width}-{given.f_number:g}"
            rows.append(prove(lens, folder, given))
            print(json.dumps(rows[-1], indent=1), flush=True)
    if given.json is not None:
        given.json.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
