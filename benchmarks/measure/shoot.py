"""Photograph a lens with the synthetic camera: captures at the even constellations, truth at the odd ones."""

from __future__ import annotations

import json
import pickle
from dataclasses import asdict, replace
from math import hypot
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from synthetic_camera import Setup, expose, ideal_frame, poses, scale_of, truth_of

from benchmarks.measure.truth import TrueGhost, true_ghosts
from flarewright.io.measurement.merged import write_frame, write_run
from flarewright.model.measurement.capture import CameraNoise, FrameInfo, MergedRun

# step between the odd constellations whose single ghosts are evaluated; the pictures are evaluated at all of them
EVERY = 2


def setup_of(lens: str, width: int = 720, count: int = 100, f_number: float | None = 5.6, seed: int = 5) -> Setup:
    """Return the benchmark's setup of a lens; 100 constellations have steps of 0.3 degrees."""
    angles = tuple(np.round(np.linspace(0.0, 29.7, count), 6).tolist())
    return Setup(
        lens=lens, quality="final", size_px=(width, width * 2 // 3), angles_deg=angles, f_number=f_number, seed=seed,
        axis_offset_px=(round(3 * width / 720), -round(2 * width / 720)), haze_radius_px=60.0 * width / 720,
    )  # fmt: skip


def shoot(setup: Setup, folder: Path) -> None:
    """Write `captures.csv` and photographs, `ideal/` (a run with a perfect merge), and the truth.

    Only even constellations are photographed. For each odd one, `truth-KKK.npz` holds the noise-free picture and its
    noise; for every second of them, `ghosts-KKK.pickle` holds the ghosts. Existing files are kept.
    """
    if (folder / "truth.json").is_file():
        return
    (folder / "ideal" / "frames").mkdir(parents=True, exist_ok=True)
    scale = scale_of(setup)
    lines = ["file,constellation_deg,exposure_s,iso,f_number,roll_deg"]
    frames = []
    rows: list[dict[str, Any]] = []
    for pose in poses(setup):
        truth = truth_of(setup, pose, scale)
        frame = ideal_frame(setup, truth, pose)
        places = {"light_px": truth.light_px, "image_px": truth.image_px}
        rows.append({**asdict(pose), **places, "roll_deg": frame.info.roll_deg})
        if pose.number % 2:
            sigma = np.sqrt(frame.variance[..., 1]).astype(np.float32)
            np.savez(folder / f"truth-{pose.number:03d}.npz", total=truth.total, sigma=sigma)
            if pose.number % (2 * EVERY) == 1:
                (folder / f"ghosts-{pose.number:03d}.pickle").write_bytes(
                    pickle.dumps(true_ghosts(setup, pose, scale, sigma))
                )
            continue
        info = cast(FrameInfo, frame.info.replace(file=f"frames/frame-{pose.number:03d}.exr"))
        write_frame(folder / "ideal", replace(frame, info=info))
        frames.append(info)
        for j, exposure in enumerate(setup.exposures_s):
            name = f"capture-{pose.number:03d}-{j}.npy"
            np.save(folder / name, expose(setup, truth.total, exposure, pose.brightness[j], (pose.number, j)))
            lines.append(f"{name},{pose.nominal_deg:.6g},{exposure!r},{setup.iso:g},,{setup.roll_deg:g}")
    write_run(folder / "ideal", run_of(setup, tuple(frames)))
    (folder / "captures.csv").write_text("\n".join(lines) + "\n", "utf-8")
    camera = {"black_level": setup.black, "white_level": setup.white, "iso": setup.iso}
    (folder / "camera.json").write_text(json.dumps(camera) + "\n", "utf-8")
    data = {"scale": scale, "axis_px": setup.axis_px, "setup": asdict(setup), "poses": rows}
    (folder / "truth.json").write_text(json.dumps(data) + "\n", "utf-8")


def run_of(setup: Setup, frames: tuple[FrameInfo, ...]) -> MergedRun:
    """Return the index of the perfect merge, with known axis and focal length."""
    off_axis = [info for info in frames if abs(info.constellation_deg) > 2.0]
    # distortion is small near the axis
    near = [info for info in off_axis if abs(info.constellation_deg) < 15.0]
    reach = []
    for info in near or off_axis:
        x, y = info.light_px[0] - info.axis_px[0], info.light_px[1] - info.axis_px[1]
        reach.append(hypot(x, y) / np.tan(np.radians(abs(info.constellation_deg))))
    return MergedRun(
        size_px=setup.size_px, frames=frames, axis_px=setup.axis_px, px_per_rad=float(np.median(reach)),
        camera=CameraNoise(
            black_level=setup.black, white_level=setup.white, electrons_per_unit=setup.electrons_per_unit,
            read_noise=setup.read_noise, iso=setup.iso,
        ),
        reference_iso=setup.iso,
    )  # fmt: skip


def read_poses(folder: Path) -> list[dict[str, Any]]:
    """Return the true values of each constellation."""
    return list(json.loads((folder / "truth.json").read_text("utf-8"))["poses"])


def read_truth(folder: Path, number: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the noise-free picture of an odd constellation, and the noise of green."""
    with np.load(folder / f"truth-{number:03d}.npz") as held:
        return held["total"], held["sigma"]


def read_ghosts(folder: Path, number: int) -> list[TrueGhost] | None:
    """Return the true ghosts of an odd constellation; None where they are not evaluated."""
    path = folder / f"ghosts-{number:03d}.pickle"
    # the pickle is safe to load: this program wrote it
    return pickle.loads(path.read_bytes()) if path.is_file() else None
