"""Photographs of a light that moves across a small picture, without ghosts; quick to make."""

from functools import lru_cache
from pathlib import Path

import numpy as np
from camera_raw import write_dng
from synthetic_camera import Setup, expose

from flarewright.model.measurement.capture import CameraNoise

CAMERA = Setup(size_px=(96, 64), exposures_s=(1 / 256, 1 / 8), seed=4)
# and its levels and noise; without them a merge finds them first
KNOWN = CameraNoise(black_level=CAMERA.black, white_level=CAMERA.white, electrons_per_unit=3.0, read_noise=4.0)
HEAD = "file,constellation_deg,exposure_s,iso,f_number,kind\n"
ANGLES = tuple(float(k) for k in range(4))
# for tests of what the path of the light alone shows, and of several groups of frames
MANY = tuple(float(k) for k in range(6))


def light_px(angle: float) -> tuple[float, float]:
    """Return the position of the light on a slightly tilted path of 400 pixels per radian."""
    t = np.tan(np.radians(angle))
    return 40.3 + 400.0 * t, 31.6 - 4.0 * t


def star(*places: tuple[float, float], level: float = 0.05) -> np.ndarray:
    """Return the radiance of stars over a uniform veil."""
    x, y = np.arange(96) + 0.5, np.arange(64)[:, None] + 0.5
    light = np.full((64, 96), level)
    for place in places:
        r = np.hypot(x - place[0], y - place[1])
        light = light + 4000.0 * np.exp(-0.5 * (r / 1.2) ** 2) + 30.0 / (1.0 + (r / 2.0) ** 3)
    return (light[..., None] * np.array([0.8, 1.0, 0.6])).astype(np.float32)


@lru_cache(maxsize=200)
def photographed(scene: bytes, time: float, seed: tuple[int, ...]) -> np.ndarray:
    """Photograph a scene, once for all tests that use it."""
    return expose(CAMERA, np.frombuffer(scene, np.float32).reshape(64, 96, 3), time, 1.0, seed)


def shoot(folder: Path, scenes: dict[float, np.ndarray], times: tuple[float, ...] = CAMERA.exposures_s) -> Path:
    """Write captures.csv, camera.json and NPY photographs; return the list."""
    lines = []
    for k, (angle, scene) in enumerate(scenes.items()):
        for j, time in enumerate(times):
            np.save(folder / f"{k}-{j}.npy", photographed(scene.tobytes(), time, (k, j)))
            lines.append(f"{k}-{j}.npy,{angle:g},{time!r},100,8,light\n")
    (folder / "captures.csv").write_text(HEAD + "".join(lines))
    (folder / "camera.json").write_text(f'{{"black_level": {CAMERA.black}, "white_level": {CAMERA.white}}}')
    return folder / "captures.csv"


def shoot_raw(folder: Path, scene: np.ndarray, name: str, time: float, seed: int) -> None:
    """Write one DNG of twice the size: each photosite has one colour and independent noise."""
    fine = np.repeat(np.repeat(scene, 2, axis=0), 2, axis=1)
    numbers = expose(CAMERA, fine, time, 1.0, (seed, 9))
    mosaic = numbers[..., 1].copy()
    mosaic[::2, ::2], mosaic[1::2, 1::2] = numbers[::2, ::2, 0], numbers[1::2, 1::2, 2]
    write_dng(folder / name, mosaic, exposure=(1, round(1.0 / time)), iso=100)
