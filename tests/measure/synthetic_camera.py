"""Simulated camera: it photographs a light source through a rendered lens while it turns.

The simulation includes jitter of the turntable, wobble and tilt of the camera, drift of the light, haze of the lens,
photon and read noise, 14-bit digitisation and clipping. It also writes the noise-free truth. The result depends only on
`Setup` with its seed. The folder FLAREWRIGHT_SYNTHETIC_CACHE, if set, caches results.

    from synthetic_camera import Setup, make
    made = make(Setup(lens="tessar-brendel", angles_deg=(0, 2, 4)), folder)   # captures.csv, truth.json, *.npy

As a script: `python tests/measure/synthetic_camera.py FOLDER --lens NAME --angles 0,30,0.3`.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from math import cos, degrees, hypot, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import flarewright as fw
from flarewright.model.measurement.capture import FrameInfo, MergedFrame
from flarewright.optics.colour.rgb import xyz_to_rgb_matrix
from flarewright.render.scene.direct_image import direct_image
from flarewright.render.scene.opening import make_opening
from flarewright.render.scene.resolve import resolve_project
from flarewright.render.scene.shots import make_shots

Floats = NDArray[np.float64]
Pixels = NDArray[np.float32]

VERSION = 3
"""Increase this number when the same `Setup` gives other pixels, which invalidates old caches."""

# minimum light of a direct image, over that of the brightest one, to define the position of the light
_SHOWN = 0.1
# the sensor's red, green and blue from X, Y, Z: all weights are at least 0, so that no count is negative
_FROM_XYZ = np.array([[0.9, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.1, 0.85]])
_FROM_REC709 = _FROM_XYZ @ np.linalg.inv(xyz_to_rgb_matrix("rec709"))


@dataclass(frozen=True)
class Setup:
    """Camera, light and turntable.

    The angles of the turntable are those listed with the captures; the true ones differ by jitter. Lengths on the
    sensor are in pixels. `bright` is the level of the brightest ghosts (99.5th percentile) in the longest exposure, as
    a fraction of full scale.
    """

    lens: str = "speed-panchro-50"
    angles_deg: tuple[float, ...] = tuple(0.3 * k for k in range(100))
    size_px: tuple[int, int] = (720, 480)
    sensor_width_mm: float = 36.0
    f_number: float | None = None
    blades: int | None = None
    coating: str | None = "single-1950s"  # a value of the option --coating
    zoom: float | None = None
    quality: str = "draft"
    wavelengths: int = 3
    tolerance_px: float = 0.25  # of the renderer's grid of rays
    roll_deg: float = 0.0
    exposures_s: tuple[float, ...] = (1 / 512, 1 / 32, 2.0)
    iso: float = 100.0
    bright: float = 0.5
    light_diameter_deg: float = 0.2
    haze: float = 0.05  # close to the light, over full scale of the longest exposure
    veil: float = 0.01
    haze_radius_px: float = 60.0
    black: float = 512.0
    white: float = 16383.0
    electrons_per_unit: float = 3.0
    read_noise: float = 4.0
    jitter_deg: float = 0.02
    tilt_deg: float = 0.4
    wander_deg: float = 0.05
    pitch_deg: float = 0.1
    pitch_wander_deg: float = 0.02
    drift: float = 0.02
    axis_offset_px: tuple[int, int] = (3, -2)
    paths: tuple[str, ...] = ()  # ghost paths to render, such as "7-3"; empty: all
    seed: int = 0

    @property
    def steady(self) -> Setup:
        """The same camera on a perfect turntable under a steady light, without haze."""
        still = replace(self, jitter_deg=0.0, tilt_deg=0.0, wander_deg=0.0, pitch_deg=0.0, pitch_wander_deg=0.0)
        return replace(still, drift=0.0, haze=0.0, veil=0.0)

    @property
    def axis_px(self) -> tuple[float, float]:
        """Position of the optical axis (x, y)."""
        return 0.5 * self.size_px[0] + self.axis_offset_px[0], 0.5 * self.size_px[1] + self.axis_offset_px[1]


@dataclass(frozen=True)
class Pose:
    """True position of the light at one step of the turntable, and its `brightness` at each exposure."""

    number: int
    nominal_deg: float
    field_deg: tuple[float, float]
    constellation_deg: float
    brightness: tuple[float, ...]


@dataclass(frozen=True)
class Truth:
    """Linear picture of a perfect camera, in the unit of `MergedFrame` (1 fills the sensor in a second).

    `light_px` follows the projection of the lens; `image_px` is the direct image of the light. The two can differ much
    where rims pass only the last rays.
    """

    total: Pixels
    ghosts: Pixels
    light_px: tuple[float, float]
    image_px: tuple[float, float]


@dataclass(frozen=True)
class GhostTruth:
    """One ghost of one constellation.

    `centre_px` is the centre of its outline, `outline_px` the outline in 64 directions from it. `flux` and `peak` are
    per channel. `at_edge`: the picture's border cuts it.
    """

    name: str
    centre_px: tuple[float, float]
    outline_px: Floats
    flux: tuple[float, float, float]
    peak: tuple[float, float, float]
    at_edge: bool


def poses(setup: Setup) -> list[Pose]:
    """Return the poses of all steps, with jitter, tilt, wander and drift from the seed."""
    rng = np.random.default_rng([setup.seed, 1])
    count, shots = len(setup.angles_deg), len(setup.exposures_s)
    jitter = rng.normal(size=count) * setup.jitter_deg
    tilt = setup.tilt_deg + _walk(rng, count) * setup.wander_deg
    pitch = setup.pitch_deg + _walk(rng, count) * setup.pitch_wander_deg
    drift = 1.0 + setup.drift * _walk(rng, count * shots).reshape(count, shots)
    found = []
    for k, nominal in enumerate(setup.angles_deg):
        yaw = radians(nominal + jitter[k])
        lean, nod = radians(setup.roll_deg + tilt[k]), radians(pitch[k])
        # the light straight ahead, seen after the camera was turned by yaw, nodded, and rolled
        x, y, z = sin(yaw), -sin(nod) * cos(yaw), cos(nod) * cos(yaw)
        x, y = cos(lean) * x - sin(lean) * y, sin(lean) * x + cos(lean) * y
        field = (degrees(np.arctan2(x, z)), degrees(np.arctan2(y, z)))
        angle = degrees(np.arctan2(hypot(x, y), z)) * (1.0 if nominal >= 0.0 else -1.0)
        found.append(Pose(k, nominal, field, angle, tuple(float(value) for value in drift[k])))
    return found


def _walk(rng: np.random.Generator, count: int) -> Floats:
    """Return a slow random walk of unit spread."""
    steps = np.cumsum(rng.normal(size=count)) / np.sqrt(20.0)
    return np.asarray(np.tanh(steps - steps.mean()))


def project_of(setup: Setup, pose: Pose, layers: str) -> fw.Project:
    """Return a project with the light at its true position and a margin for the offset of the axis."""
    (width, height), (right, down) = setup.size_px, setup.axis_offset_px
    big = (width + 2 * abs(right), height + 2 * abs(down))
    pixel = setup.sensor_width_mm / width
    iris = {} if setup.blades is None else {"iris": fw.Iris(blades=setup.blades)}
    coating = {} if setup.coating is None else {"coating": _coating(setup.coating)}
    others = f"not {','.join(setup.paths)}"
    art = {"art": fw.Art(rules=(fw.Rule(select=others, enable=False),))} if setup.paths else {}
    return fw.Project(
        lens=setup.lens, f_number=setup.f_number, zoom=setup.zoom,
        lights=(fw.Light(field_deg=pose.field_deg, diameter_deg=setup.light_diameter_deg),),
        camera=fw.Camera(size_px=big, sensor_mm=(big[0] * pixel, big[1] * pixel)),
        quality=fw.Quality(
            mode=setup.quality, wavelengths=setup.wavelengths, tolerance_px=setup.tolerance_px, ringing="off"
        ),
        output=fw.Output(layers=layers, starburst=layers != "ghosts"), **iris, **coating, **art,
    )  # fmt: skip


def render_pose(setup: Setup, pose: Pose, *, layers: str = "passes") -> fw.Rendering:
    """Render one step of the turntable."""
    return fw.render(project_of(setup, pose, layers))


def _coating(text: str) -> Any:
    from flarewright.io.lens.coating_text import parse_coating_choice

    return parse_coating_choice(text)


def truth_of(setup: Setup, pose: Pose, scale: float) -> Truth:
    """Return the noise-free picture; `scale` is the unit of `MergedFrame` over the renderer's (`scale_of`)."""
    rendering = render_pose(setup, pose)
    layers = {layer.name: layer for layer in rendering.layers}
    ghosts = _seen(setup, layers["ghosts"]) * scale
    star = _blurred(_seen(setup, layers["starburst"]) * scale)
    light, image = light_places(setup, pose, rendering)
    total = ghosts + star + _haze(setup, light)
    return Truth(total.astype(np.float32), ghosts.astype(np.float32), light, image)


def light_places(setup: Setup, pose: Pose, rendering: fw.Rendering) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the position of the light, and that of its direct image, if it has one."""
    reported = rendering.summary["lights"][0]
    _, _, most = _law(replace(setup.steady, roll_deg=0.0))
    passed = max(reported["direct_throughput_mm2"])
    image = _on_picture(setup, reported["direct_position_mm"])
    # the last rays that rims let pass land anywhere
    light = image if passed > _SHOWN * most else _on_picture(setup, dark_mm(setup, pose))
    return light, image if passed > 0.0 else light


def _on_picture(setup: Setup, place_mm: tuple[float, float]) -> tuple[float, float]:
    """Convert a position on the sensor, mm, to pixels of the picture."""
    per_mm = setup.size_px[0] / setup.sensor_width_mm
    return setup.axis_px[0] + place_mm[0] * per_mm, setup.axis_px[1] - place_mm[1] * per_mm


def dark_mm(setup: Setup, pose: Pose) -> tuple[float, float]:
    """Return the position of the light on the sensor, mm, extrapolated by the projection of the lens."""
    focal, bent, _ = _law(replace(setup.steady, roll_deg=0.0))
    x, y = (np.tan(np.radians(angle)) for angle in pose.field_deg)
    stretch = focal * (1.0 + bent * (x * x + y * y))
    return float(stretch * x), float(stretch * y)


@cache
def _law(setup: Setup) -> tuple[float, float, float]:
    """Return focal length (mm) and distortion from the visible direct images, and the largest throughput (mm2)."""
    seen, most = [], 0.0
    for pose in poses(setup):
        settled = resolve_project(project_of(setup, pose, "passes"))
        image = direct_image(settled.lens, make_shots(settled, make_opening(settled, None))[0])
        t = abs(float(np.tan(np.radians(pose.constellation_deg))))
        most = max(most, float(image.throughput_mm2.max()))
        if image.throughput_mm2.any() and t > 0.0:
            seen.append((t, t**3, hypot(*image.position_mm)))
    table = np.array(seen)
    focal, third = np.linalg.lstsq(table[:, :2], table[:, 2], rcond=None)[0]
    return float(focal), float(third / focal), most


def _seen(setup: Setup, layer: fw.Layer) -> Floats:
    """Crop a layer to the picture and convert it to the colours of the sensor."""
    (width, height), (right, down) = setup.size_px, setup.axis_offset_px
    big = np.zeros((height + 2 * abs(down), width + 2 * abs(right), 3))
    x, y, w, h = layer.window
    big[y : y + h, x : x + w] = np.maximum(layer.pixels @ _FROM_REC709.T, 0.0)
    top, left = abs(down) - down, abs(right) - right
    return big[top : top + height, left : left + width]


def _blurred(image: Floats) -> Floats:
    """Blur the direct image like a filter in front of the sensor, by a small kernel of unit sum."""
    kernel = np.exp(-0.5 * (np.arange(-3, 4) / 0.7) ** 2)
    return _along(_along(image, kernel / kernel.sum(), 0), kernel / kernel.sum(), 1)


def _along(image: Floats, kernel: Floats, axis: int) -> Floats:
    half = kernel.size // 2
    padded = np.pad(image, [(half, half) if k == axis else (0, 0) for k in range(3)])
    total = np.zeros_like(image)
    for k, weight in enumerate(kernel):
        total += weight * np.take(padded, np.arange(k, k + image.shape[axis]), axis)
    return total


def _haze(setup: Setup, light_px: tuple[float, float]) -> Floats:
    width, height = setup.size_px
    x, y = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
    far = ((x - light_px[0]) ** 2 + (y - light_px[1]) ** 2) / setup.haze_radius_px**2
    glow = (setup.veil + setup.haze / (1.0 + far)) / max(setup.exposures_s)
    return glow[..., None] * np.array([0.9, 1.0, 1.1])


def scale_of(setup: Setup) -> float:
    """Return the unit of `MergedFrame` over that of the renderer, from the ghosts at the middle angle."""
    middle = replace(setup.steady, angles_deg=(setup.angles_deg[len(setup.angles_deg) // 2],))
    layer = {layer.name: layer for layer in render_pose(middle, poses(middle)[0]).layers}["ghosts"]
    level = float(np.percentile(_seen(setup, layer)[..., 1], 99.5))
    return setup.bright / max(setup.exposures_s) / level


def expose(setup: Setup, radiance: Pixels, exposure_s: float, brightness: float, seed: tuple[int, ...]) -> NDArray[Any]:
    """Return the raw picture of an exposure, with photon noise, read noise, rounding and clipping."""
    rng = np.random.default_rng([setup.seed, 2, *seed])
    full = setup.white - setup.black
    units = radiance.astype(np.float64) * (exposure_s * brightness * full)
    # limit the electrons far above the clipping level
    electrons = rng.poisson(np.minimum(units, 4.0 * full) * setup.electrons_per_unit).astype(np.float64)
    electrons += rng.normal(size=electrons.shape) * setup.read_noise
    numbers = np.rint(setup.black + electrons / setup.electrons_per_unit)
    return np.clip(numbers, 0.0, setup.white).astype(np.uint16)


def ideal_frame(setup: Setup, truth: Truth, pose: Pose, *, seed: int = 0, noise: bool = True) -> MergedFrame:
    """Return the frame that a perfect merge of all exposures would give: truth plus noise of known variance."""
    full = setup.white - setup.black
    gain = setup.electrons_per_unit * full
    electrons = truth.total.astype(np.float64) * gain
    weight = np.zeros(electrons.shape)
    for exposure in setup.exposures_s:
        variance = electrons / exposure + (setup.read_noise / exposure) ** 2
        fits = truth.total * exposure < 1.0 - 4.0 * np.sqrt(variance) * exposure / gain
        weight += np.where(fits, 1.0 / variance, 0.0)
    with np.errstate(divide="ignore"):
        variance = 1.0 / weight / gain**2
    spread = np.where(np.isfinite(variance), np.sqrt(variance), 0.0)
    rng = np.random.default_rng([setup.seed, 3, seed, pose.number])
    noisy = truth.total + (spread * rng.normal(size=spread.shape) if noise else 0.0)
    x, y = truth.light_px[0] - setup.axis_px[0], truth.light_px[1] - setup.axis_px[1]
    sign = 1.0 if pose.nominal_deg >= 0.0 else -1.0
    roll = degrees(np.arctan2(-sign * y, sign * x)) if hypot(x, y) > 1.0 else setup.roll_deg
    info = FrameInfo(
        file=f"frame-{pose.number:03d}.exr", constellation_deg=pose.constellation_deg, nominal_deg=pose.nominal_deg,
        roll_deg=roll, nominal_roll_deg=setup.roll_deg, light_px=truth.light_px, axis_px=setup.axis_px,
        exposures_s=setup.exposures_s, iso=setup.iso,
    )  # fmt: skip
    return MergedFrame(info, noisy.astype(np.float32), variance.astype(np.float32))


def ghosts_of(setup: Setup, pose: Pose, scale: float) -> list[GhostTruth]:
    """Return the truth of every ghost in the picture, brightest first."""
    seen = (_ghost(name, image) for name, image in ghost_layers(setup, pose, scale))
    return sorted((one for one in seen if one is not None), key=lambda ghost: -ghost.flux[1])


def ghost_layers(setup: Setup, pose: Pose, scale: float) -> Iterator[tuple[str, Floats]]:
    """Yield the name and the picture of every path, noise-free, shape (H, W, 3)."""
    for layer in render_pose(setup, pose, layers="ghosts").layers:
        if layer.name.startswith("ghost."):
            yield layer.name.removeprefix("ghost."), _seen(setup, layer) * scale


def _ghost(name: str, image: Floats) -> GhostTruth | None:
    green = image[..., 1]
    lit = green[green > 0.0]
    if lit.size == 0:
        return None
    # half of the uniform level inside: noise-free edges are sharp, so the threshold hardly matters
    inside = green > 0.5 * float(np.median(lit))
    # only border pixels can be the farthest in any direction
    padded = np.pad(inside, 1)
    surrounded = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    rows, columns = np.nonzero(inside & ~surrounded)
    x, y = columns + 0.5, rows + 0.5
    middle = 0.5 * (x.min() + x.max()), 0.5 * (y.min() + y.max())
    angle = np.radians(np.arange(64) * (360.0 / 64))
    reach = (x - middle[0])[:, None] * np.cos(angle) + (y - middle[1])[:, None] * np.sin(angle)
    off = np.abs((y - middle[1])[:, None] * np.cos(angle) - (x - middle[0])[:, None] * np.sin(angle)) < 1.0
    far = np.where(off, reach, 0.0).max(axis=0)
    outline = np.stack([middle[0] + far * np.cos(angle), middle[1] + far * np.sin(angle)], axis=1)
    height, width = green.shape
    at_edge = bool(rows.min() == 0 or columns.min() == 0 or rows.max() == height - 1 or columns.max() == width - 1)
    flux, peak = image.sum(axis=(0, 1)), image.max(axis=(0, 1))
    return GhostTruth(name, middle, outline, tuple(map(float, flux)), tuple(map(float, peak)), at_edge)


def make(setup: Setup, folder: Path | None = None, *, ghosts: bool = False) -> Path:
    """Photograph all captures into a folder, or copy them from the cache.

    Returns the folder: captures.csv, camera.json, `capture-KKK-J.npy` (uint16), `truth-KKK.npy` and `ghosts-KKK.npy`
    (float32), and truth.json: for each pose true angle, light_px, and with `ghosts` every ghost's centre, outline and
    flux; also `scale`, axis_px and the setup.
    """
    cache = os.environ.get("FLAREWRIGHT_SYNTHETIC_CACHE")
    if cache is not None:
        key = hashlib.sha256(repr((VERSION, setup, ghosts)).encode()).hexdigest()[:16]
        kept = Path(cache) / f"{setup.lens}-{key}"
        if not (kept / "truth.json").is_file():
            kept.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=kept.parent) as fresh:
                _make(setup, Path(fresh), ghosts)
                shutil.rmtree(kept, ignore_errors=True)
                shutil.copytree(fresh, kept)
        if folder is None:
            return kept
        shutil.copytree(kept, folder, dirs_exist_ok=True)
        return folder
    assert folder is not None, "give a folder, or set FLAREWRIGHT_SYNTHETIC_CACHE"
    folder.mkdir(parents=True, exist_ok=True)
    _make(setup, folder, ghosts)
    return folder


def _make(setup: Setup, folder: Path, ghosts: bool) -> None:
    scale = scale_of(setup)
    lines = ["file,constellation_deg,exposure_s,iso,f_number,roll_deg"]
    table = []
    for pose in poses(setup):
        truth = truth_of(setup, pose, scale)
        np.save(folder / f"truth-{pose.number:03d}.npy", truth.total)
        np.save(folder / f"ghosts-{pose.number:03d}.npy", truth.ghosts)
        for j, exposure in enumerate(setup.exposures_s):
            name = f"capture-{pose.number:03d}-{j}.npy"
            np.save(folder / name, expose(setup, truth.total, exposure, pose.brightness[j], (pose.number, j)))
            lines.append(f"{name},{pose.nominal_deg:.6g},{exposure!r},{setup.iso:g},,{setup.roll_deg:g}")
        row: dict[str, Any] = {**asdict(pose), "light_px": truth.light_px}
        if ghosts:
            every = ghosts_of(setup, pose, scale)
            row["ghosts"] = [{**asdict(one), "outline_px": one.outline_px.tolist()} for one in every]
        table.append(row)
    (folder / "captures.csv").write_text("\n".join(lines) + "\n", "utf-8")
    camera = {"black_level": setup.black, "white_level": setup.white, "iso": setup.iso}
    (folder / "camera.json").write_text(json.dumps(camera) + "\n", "utf-8")
    data = {"scale": scale, "axis_px": setup.axis_px, "setup": asdict(setup), "poses": table}
    (folder / "truth.json").write_text(json.dumps(data) + "\n", "utf-8")


def main() -> None:
    """Make a folder of captures from the command line."""
    parser = argparse.ArgumentParser(description="Photograph a rendered lens with a synthetic camera.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--lens", default=Setup.lens)
    parser.add_argument("--angles", default="0,29.7,0.3", help="first, last, step in degrees")
    parser.add_argument("--quality", default="draft", choices=("draft", "final", "reference"))
    parser.add_argument("--width", type=int, default=720)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--ghosts", action="store_true", help="also the truth of every ghost")
    given = parser.parse_args()
    first, last, step = (float(text) for text in given.angles.split(","))
    angles = tuple(first + step * k for k in range(round((last - first) / step) + 1))
    size = (given.width, round(given.width * 2 / 3))
    setup = Setup(lens=given.lens, angles_deg=angles, size_px=size, quality=given.quality, seed=given.seed)
    print(make(setup, given.folder, ghosts=given.ghosts))


if __name__ == "__main__":
    main()
