"""Evaluate a replay with the light in other directions than in its photographs.

Ghosts of a lens of revolution turn with the light, but the blades of its iris do not, and the picture has corners that
no photograph showed. The truth is rendered for these directions. The reference is the rotated photograph, which needs
no model.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from synthetic_camera import Setup, poses, scale_of, truth_of

from benchmarks.measure.judge import far_from
from flarewright.io.measurement.merged import read_frame
from flarewright.measure.replay.model_image import replay_model
from flarewright.measure.replay.sprites import samples
from flarewright.model.measurement.capture import MergedFrame, MergedRun
from flarewright.model.measurement.ghost_model import GhostModel

Pixels = NDArray[np.float32]

# indices of constellations (of a hundred), and directions of the light
AT, ROLLS_DEG = (20, 50, 80), (30.0, 90.0, 180.0)


def shoot_rolled(setup: Setup, folder: Path) -> None:
    """Write `rolled.npz`, the noise-free picture at a few constellations and rolls, unless it exists."""
    if (folder / "rolled.npz").is_file():
        return
    scale = scale_of(setup)
    angles = [setup.angles_deg[min(k, len(setup.angles_deg) - 1)] for k in AT]
    reported: list[tuple[float, float, float, float]] = []
    pictures = []
    for roll in ROLLS_DEG:
        still = replace(setup.steady, haze=setup.haze, veil=setup.veil, angles_deg=tuple(angles), roll_deg=roll)
        for pose in poses(still):
            truth = truth_of(still, pose, scale)
            reported.append((pose.constellation_deg, roll, *truth.light_px))
            pictures.append(truth.total)
    np.savez(folder / "rolled.npz", reported=np.array(reported), pictures=np.stack(pictures))


def judge_rolled(model: GhostModel, folder: Path, run_folder: Path, run: MergedRun) -> dict[str, Any]:
    """Return a replay's errors against a rotated photograph's, dB, inside the photographed area and beyond.

    Parameters
    ----------
    model, folder, run_folder, run
        As for `judge`.
    """
    with np.load(folder / "rolled.npz") as held:
        reported, pictures = held["reported"], held["pictures"]
    sums: dict[str, list[tuple[float, float]]] = {}
    rows = []
    for (constellation, roll, *light), true in zip(reported, pictures, strict=True):
        frame = read_frame(run_folder, min(run.frames, key=lambda info: abs(info.constellation_deg - constellation)))
        turned, shown = turned_photograph(frame, float(roll))
        mine = replay_model(model, float(constellation), roll_deg=float(roll))[0].pixels
        far = far_from((light[0], light[1]), run.size_px)
        floor = float(np.sqrt(np.median(frame.variance[np.isfinite(frame.variance)])))
        logs = [np.log(np.maximum(each, 0.0) + floor) for each in (mine, turned, true)]
        row: dict[str, Any] = {"constellation": float(constellation), "roll": float(roll)}
        for place, mask in (("shown", far & shown), ("beyond", far & ~shown)):
            if not mask.any():
                continue
            for name, (a, b, c) in {"linear": (mine, turned, true), "log": tuple(logs)}.items():
                errors = [float(((each - c)[mask].astype(np.float64) ** 2).sum()) for each in (a, b)]
                sums.setdefault(f"{place}, {name}", []).append((errors[0], errors[1]))
                row[f"{place}, {name}"] = round(float(10.0 * np.log10(errors[0] / errors[1])), 2)
            row[f"{place}, log rms"] = round(float(np.sqrt(((logs[0] - logs[2])[mask] ** 2).mean())), 3)
        rows.append(row)
    gains = {name: float(10.0 * np.log10(np.divide(*np.sum(pairs, axis=0)))) for name, pairs in sums.items()}
    return {"rolled, dB": gains, "rolled": rows}


def turned_photograph(frame: MergedFrame, roll_deg: float) -> tuple[Pixels, NDArray[np.bool_]]:
    """Rotate a photograph about the axis to another light direction; beyond its border the border is repeated."""
    height, width = frame.radiance.shape[:2]
    turn = np.radians(roll_deg - frame.info.roll_deg)
    y, x = np.mgrid[:height, :width] + 0.5
    dx, dy = x - frame.info.axis_px[0], y - frame.info.axis_px[1]
    column = np.cos(turn) * dx - np.sin(turn) * dy + frame.info.axis_px[0] - 0.5
    row = np.sin(turn) * dx + np.cos(turn) * dy + frame.info.axis_px[1] - 0.5
    shown = (column >= 0.0) & (column <= width - 1.0) & (row >= 0.0) & (row <= height - 1.0)
    column, row = np.clip(column, 0.0, width - 1.0), np.clip(row, 0.0, height - 1.0)
    known = np.where(np.isfinite(frame.variance), frame.radiance, 0.0).astype(np.float32)
    return samples(known, column.ravel(), row.ravel()).reshape(height, width, 3), shown
