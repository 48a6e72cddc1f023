"""Photograph a flare with a virtual camera, measure it, and replay it at an angle that was not photographed.

Usage: python measure_a_flare.py [FOLDER]
"""

import csv
import sys
import tempfile
from pathlib import Path

import numpy as np

import flarewright as fw
from flarewright.io.measurement.ghost_model_file import read_ghost_model
from flarewright.measure import replay_model
from flarewright.workflow import merge_photographs, run_stages

SIZE, SENSOR_MM = (120, 80), (36.0, 24.0)
ANGLES_DEG, LEFT_OUT_DEG = (2.0, 5.0, 8.0, 11.0, 14.0, 17.0, 20.0), 12.5
# the sensor clips at 1; noise is of a photograph
EXPOSURES_S, NOISE = (0.01, 1.0, 100.0), 1e-3


def flare(angle_deg: float) -> np.ndarray:
    """Return the light's image and its ghosts, per second, shape (rows, columns, 3)."""
    lens = fw.load_lens("tessar-brendel")
    project = fw.Project(
        lens=lens,
        f_number=5.6,
        lights=(fw.Light(field_deg=(angle_deg, 0.0), diameter_deg=0.5),),
        camera=fw.Camera(size_px=SIZE, sensor_mm=SENSOR_MM),
        output=fw.Output(starburst=False),
    )
    # a render leaves out the direct image: a disc, far brighter than its ghosts
    place = SIZE[0] / 2 + SIZE[0] / SENSOR_MM[0] * fw.paraxial(lens).efl * np.tan(np.radians(angle_deg))
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    disc = 90.0 * np.clip(1.8 - np.hypot(x - place, y - SIZE[1] / 2), 0.0, 1.0)
    return fw.render(project).layers[0].pixels + disc[..., None]


def photograph(folder: Path) -> Path:
    """Write the photographs and their list; return the list."""
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(1)
    with (folder / "captures.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(("file", "constellation_deg", "exposure_s", "iso", "f_number"))
        for angle in ANGLES_DEG:
            light = flare(angle)
            for number, exposure in enumerate(EXPOSURES_S):
                name = f"{angle:g}-{number}.npy"
                pixels = np.clip(exposure * light + random.normal(0.0, NOISE, light.shape), 0.0, 1.0)
                np.save(folder / name, pixels.astype(np.float32))
                rows.writerow((name, angle, exposure, 100, 5.6))
    return folder / "captures.csv"


def main(folder: Path) -> None:
    """Measure the flare and print how well its model replays."""
    captures = photograph(folder / "photographs")
    run = folder / "run"
    merge_photographs(captures, run)
    for result in run_stages(run, ("find", "fit"), residual=False):
        print(f"{result.stage}: {result.counts['ghosts']} ghosts in {result.file.name}")
    model = read_ghost_model(run / "model.json")
    replayed, true = replay_model(model, LEFT_OUT_DEG)[0].pixels, flare(LEFT_OUT_DEG)
    print(f"at {LEFT_OUT_DEG:g} degrees: mean {replayed.mean():.3g}, true {true.mean():.3g}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()) / "measure_a_flare")
