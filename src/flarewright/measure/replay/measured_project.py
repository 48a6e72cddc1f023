"""Render a project that uses a measured flare instead of a lens, to the layers that a render of a lens has.

The command line and the editor call `render_any`, which handles both kinds of projects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import ProjectError
from ...io.files.file_kind import is_ghost_model_file
from ...io.measurement.ghost_model_file import read_ghost_model
from ...model import D65, Camera, Layer, Light, Project
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.replay_camera import ReplayCamera
from ...optics.colour.rgb import luminance_weights, xyz_to_rgb_matrix
from ...optics.colour.spectrum import spectrum_xyz
from ...optics.lens.field_angles import constellation_and_roll
from ...optics.pupil.occlusion import hidden_part
from ...render.image.compose import beauty
from ...render.image.gamut import apply_gamut
from ...render.image.shown_layer import shown_layers
from ...render.remarks import BLACK, HIDDEN
from ...render.render import PIXEL_BYTES, Rendering, check_finite, render
from ...render.scene.art_rules import with_gain
from ...render.scene.holdout import read_plates
from ...render.scene.memory_check import check_memory, spare_bytes
from ...typing import Floats, Progress
from ..core.measured_side import measured_side
from ..core.parameter_vector import fit_in
from .art import Rgb, ghost_gains
from .model_image import draw, light_px, replay_model, within_reach
from .placement import brightness_gain

_LUMINANCE = luminance_weights("rec709")
# keys of a project, its camera and its lights that require a prescription
_OF_LENSES = ("iris", "coating", "dirt", "starburst", "zoom", "filter", "imperfection", "scatter")
_OF_CAMERAS = (
    "sensor_distance", "focus_distance", "cover_glass", "sensor_reflectance", "sensor_grating", "squeeze", "desqueeze",
)  # fmt: skip
_OF_LIGHTS = ("distance", "diameter_deg", "shape", "starburst")
# prefix of the layer of one ghost
_SINGLE = "ghost."
# the pass of art direction whose gain applies to each layer; the residual of ghosts belongs to the ghosts
_PASSES = {"ghosts": "ghosts", "residual": "ghosts", "starburst": "starburst", "halo": "scatter"}
# largest difference of the pixel aspect from square pixels
_OBLONG = 0.03
UNIT = "values are in the captures' unit: a light of intensity 1 is the one that was photographed"
OWN_COLOURS = "the model has no camera colour matrix: the captures' red, green and blue stand for linear Rec.709"
TINTED = "the effect of another spectrum on the lens' coatings is unknown: the flare is tinted by the light's colour"
LIGHT_ITSELF = "the light's own image is part of a measured halo and residual, so starburst = false leaves it there"


@dataclass(frozen=True)
class MeasuredFlare:
    """A ghost model, prepared for rendering.

    Attributes
    ----------
    name : str
    model : GhostModel
    bare : GhostModel
        The model without residual.
    """

    name: str
    model: GhostModel
    bare: GhostModel


@dataclass(frozen=True)
class _Seen:
    """A light in a measured flare: its position, its visible part, and the matrix that scales its flare."""

    light: Light
    constellation_deg: float
    roll_deg: float
    place_px: tuple[float, float]
    part: float
    colours: Floats
    # the light's true constellation where it was not photographed
    beyond_deg: float | None = None


def is_measured(project: Project) -> bool:
    """Return whether a project uses a measured flare instead of a lens."""
    return is_ghost_model_file(project.lens)


def flare_of(project: Project) -> MeasuredFlare:
    """Read the measured flare of a project; recently read files are cached.

    Parameters
    ----------
    project : Project
        Project for which `is_measured` is true.

    Raises
    ------
    FlarewrightError
        When the file is no ghost model.
    """
    path = str(project.lens)
    return _read(path, Path(path).stat().st_mtime_ns)


@lru_cache(maxsize=2)
def _read(path: str, changed_ns: int) -> MeasuredFlare:
    del changed_ns
    model = read_ghost_model(path)
    return MeasuredFlare(Path(path).name, model, model.replace(sprites=()))


def render_any(project: Project, *, progress: Progress | None = None) -> Rendering:
    """Render a project of a lens or of a measured flare, a light beyond the measured range at its limit.

    Parameters
    ----------
    project : Project
    progress
        As for `render.render.render`.

    Raises
    ------
    FlarewrightError
        When the project cannot be rendered.
    """
    if is_measured(project):
        return render_measured(project, progress=progress, limit=True)
    return render(project, progress=progress)


def render_measured(project: Project, *, progress: Progress | None = None, limit: bool = False) -> Rendering:
    """Render the measured flare of a project.

    Parameters
    ----------
    project : Project
        Draft quality and `quality.screen` leave out the residual, which takes most of the time.
    progress : callable, optional
        As for `render.render.render`.
    limit : bool
        Whether a light beyond the measured range is drawn at its limit, with a remark, instead of refused.

    Returns
    -------
    Rendering
        Layers "beauty", "ghosts", "starburst", "halo" and "residual" where the model has them, and single ghosts. In
        the captures' unit: a light of intensity 1 is the photographed one. The picture's width shows the captures'
        field.

    Raises
    ------
    FlarewrightError
        When the file is no ghost model, the project sets a value that requires a prescription, a light lies outside
        the measured range, or a rule selects an unknown ghost.

    Notes
    -----
    Walch 2017, section 8.2; a change of f-number changes the brightness by equation 8.3. A light's spectrum only tints
    the photographed flare: red, green and blue are multiplied by those of the light, where daylight D65 is (1, 1, 1).
    Tests: tests/measure/replay/test_measured_project.py.
    """
    _refuse_what_lenses_have(project)
    flare, size = flare_of(project), project.camera.size_px
    check_memory(prod(size) * PIXEL_BYTES * 6, spare_bytes())
    seen = tuple(_seen(project, flare, light, limit) for light in project.lights)
    gains = ghost_gains(
        project.art, [ghost.name for ghost in flare.model.ghosts], lambda kind: _ranked(flare, seen, size, kind),
        flare.name,
    )  # fmt: skip
    whole = project.quality.mode != "draft" and not project.quality.screen
    parts: dict[str, Layer] = {}
    singles: dict[str, Layer] = {}
    for k, one in enumerate(seen):
        if progress is not None:
            progress(k / len(seen), one.light.name)
        drawn = replay_model(
            flare.model if whole else flare.bare, one.constellation_deg, roll_deg=one.roll_deg, size_px=size,
            single=project.output.layers == "ghosts",
        )  # fmt: skip
        # skip the beauty
        for layer in drawn[1:]:
            _add(singles if layer.name.startswith(_SINGLE) else parts, _coloured(layer, one.colours))
    if gains:
        # `check_finite` reports an overflow below
        with np.errstate(over="ignore", invalid="ignore"):
            parts["ghosts"] = _ghosts_by_hand(flare, seen, gains, size)
    if not project.output.starburst:
        parts.pop("starburst", None)
    by_pass = {} if project.art.physical else project.art.gain
    changed = gains or not project.output.starburst or any(gain != 1.0 for gain in by_pass.values())
    with np.errstate(over="ignore", invalid="ignore"):
        parts = {name: with_gain(layer, by_pass.get(_PASSES[name], 1.0)) for name, layer in parts.items()}
        if changed:
            _keep_above_0(parts)
        passes = list(parts.values())
        others = [with_gain(layer, by_pass.get("ghosts", 1.0)) for layer in _brightest(project, flare, singles, gains)]
        passes, others = apply_gamut(project.output.gamut, passes), apply_gamut(project.output.gamut, others)
        total = beauty(passes, size)
    check_finite((total, *others))
    layers = (total,) if project.output.layers == "beauty" else (total, *passes, *others)
    summary = _summary(project, flare, seen, gains)
    return Rendering(project, shown_layers(layers, project), summary, _remarks(project, flare, seen, total))


def check_measured(project: Project, *, limit: bool = False) -> None:
    """Raise as `render_measured` when a project of a measured flare cannot be rendered, without rendering it."""
    _refuse_what_lenses_have(project)
    flare = flare_of(project)
    for light in project.lights:
        seen = _seen(project, flare, light, limit)
        within_reach(flare.model, seen.constellation_deg, seen.roll_deg)
    names = [ghost.name for ghost in flare.model.ghosts]
    ghost_gains(project.art, names, lambda _: names, flare.name)


def _refuse_what_lenses_have(project: Project) -> None:
    """Raise when a project sets values that have no effect on a measured flare."""
    name = Path(str(project.lens)).name
    plain = Project(lens=project.lens, lights=project.lights)
    asked = [key for key in _OF_LENSES if getattr(project, key) != getattr(plain, key)]
    asked += [f"camera.{key}" for key in _OF_CAMERAS if getattr(project.camera, key) != getattr(Camera(), key)]
    for k, light in enumerate(project.lights):
        bare = Light(field_deg=light.field_deg)
        asked += [f"lights[{k}].{key}" for key in _OF_LIGHTS if getattr(light, key) != getattr(bare, key)]
    if project.quality.mode == "reference":
        asked.append('quality.mode = "reference"')
    if project.quality.orders != plain.quality.orders:
        asked.append("quality.orders")
    if project.output.matte != "none":
        raise ProjectError(
            f"{name} is a measured flare, whose residual belongs to no ghost, so it has no matte: leave it out; "
            "--layers ghosts writes each ghost"
        )
    if abs(project.camera.pixel_aspect - 1.0) > _OBLONG:
        (width, height), (across, _) = project.camera.size_px, project.camera.sensor
        raise ProjectError(
            f"{name} was measured in square pixels: a picture of {width}x{height} is one of a sensor of {across:g}x"
            f"{across * height / width:.4g} mm; give that, or leave the sensor out"
        )
    if asked:
        raise ProjectError(
            f"{name} is a measured flare, which has no prescription and shows the light that was photographed: "
            f"{asked[0]} has no meaning there; leave it out"
        )


def _seen(project: Project, flare: MeasuredFlare, light: Light, limit: bool = False) -> _Seen:
    """Compute a light's position, its visible part, and the matrix that scales its flare."""
    model, size = flare.model, project.camera.size_px
    slopes = np.tan(np.radians(light.field_deg))
    angle, roll = (float(each) for each in constellation_and_roll(np.eye(3), np.array([*slopes, 1.0])))
    low, high = model.constellation_deg
    angle, roll = measured_side(model, angle, roll)
    beyond = None
    if limit and not low <= angle <= high:
        here, there = (float(np.clip(each, low, high)) for each in (angle, -angle))
        beyond = angle
        angle, roll = (here, roll) if abs(here - angle) <= abs(there + angle) else (there, roll + 180.0)
    zoom, top = fit_in(model, size)
    x, y = light_px(model, angle, roll)
    place = x * zoom, y * zoom + top
    part = 1.0
    for holdout, hidden in read_plates(project, light):
        sides = np.array(hidden.shape[::-1])
        beside = (np.array(place) - 0.5 * np.array(size)) / (np.array(size) * holdout.overscan)
        part *= 1.0 - hidden_part(hidden, sides * (0.5 + beside))
    gain = light.intensity * part
    if project.f_number is not None:
        gain *= brightness_gain(model.reference, ReplayCamera(f_number=project.f_number))
    return _Seen(light, angle, roll, place, part, gain * _colours(project, model, light), beyond)


def _colours(project: Project, model: GhostModel, light: Light) -> Floats:
    """Return the matrix from the captures' colours to those of the picture, including the light's tint."""
    rec709 = np.eye(3) if model.to_rec709 is None else np.array(model.to_rec709)
    # tabulated daylight misses the white point by about 1e-4; the ratio cancels that
    tint, daylight = (xyz_to_rgb_matrix("rec709") @ spectrum_xyz(each) for each in (light.spectrum, D65()))
    found = (tint / daylight)[:, None] * rec709
    if project.output.colorspace != "rec709":
        found = xyz_to_rgb_matrix(project.output.colorspace) @ np.linalg.inv(xyz_to_rgb_matrix("rec709")) @ found
    return np.asarray(found)


def _coloured(layer: Layer, colours: Floats) -> Layer:
    return replace(layer, pixels=np.asarray(layer.pixels @ colours.T.astype(np.float32)), about={})


def _add(layers: dict[str, Layer], layer: Layer) -> None:
    """Add a layer's light to the layer of the same name; the window grows to hold both."""
    other = layers.get(layer.name)
    if other is None:
        layers[layer.name] = layer
        return
    x, y = min(layer.window[0], other.window[0]), min(layer.window[1], other.window[1])
    right = max(one.window[0] + one.window[2] for one in (layer, other))
    bottom = max(one.window[1] + one.window[3] for one in (layer, other))
    pixels = np.zeros((bottom - y, right - x, 3), dtype=np.float32)
    for one in (other, layer):
        left, top, width, height = one.window
        pixels[top - y : top - y + height, left - x : left - x + width] += one.pixels
    layers[layer.name] = Layer(layer.name, pixels, (x, y, right - x, bottom - y))


def _ghosts_by_hand(
    flare: MeasuredFlare, seen: Sequence[_Seen], gains: dict[str, Rgb | None], size: tuple[int, int]
) -> Layer:
    """Draw the ghosts of all lights with their gains; ghosts of equal gain are drawn together."""
    alike: dict[Rgb, list[str]] = {}
    for ghost in flare.model.ghosts:
        gain = gains.get(ghost.name, (1.0, 1.0, 1.0))
        if gain is not None:
            alike.setdefault(gain, []).append(ghost.name)
    pixels = np.zeros((size[1], size[0], 3), dtype=np.float32)
    for gain, names in alike.items():
        some = flare.bare.replace(ghosts=[one for one in flare.bare.ghosts if one.name in names])
        for one in seen:
            light = draw(some, one.constellation_deg, one.roll_deg, size)
            pixels += (light @ (np.array(gain)[:, None] * one.colours).T).astype(np.float32)
    return Layer("ghosts", pixels, (0, 0, *size))


def _keep_above_0(parts: dict[str, Layer]) -> None:
    """Limit the residual so that the sum is not negative; it also corrects ghosts, star and halo that are not drawn."""
    rest = parts.get("residual")
    if rest is not None:
        others = sum(layer.pixels for name, layer in parts.items() if name != "residual")
        parts["residual"] = replace(rest, pixels=np.maximum(rest.pixels, -np.asarray(others)))


def _singles(flare: MeasuredFlare, one: _Seen, size: tuple[int, int]) -> list[Layer]:
    drawn = replay_model(flare.bare, one.constellation_deg, roll_deg=one.roll_deg, size_px=size, single=True)
    return [layer for layer in drawn if layer.name.startswith(_SINGLE)]


def _ranked(flare: MeasuredFlare, seen: Sequence[_Seen], size: tuple[int, int], kind: str) -> list[str]:
    """Return the names of ghosts sorted by their light in the picture or by their size, largest first."""
    found: dict[str, float] = {}
    for one in seen:
        for layer in _singles(flare, one, size):
            light = np.maximum(_coloured(layer, one.colours).pixels @ _LUMINANCE, 0.0)
            name, total = layer.name.removeprefix(_SINGLE), float(light.sum())
            if total <= 0.0:
                continue
            if kind == "brightest":
                found[name] = found.get(name, 0.0) + total
            else:
                found[name] = max(found.get(name, 0.0), _spread_px(light / total))
    return sorted(found, key=lambda name: -found[name])


def _spread_px(part: Floats) -> float:
    """Return the root mean square distance of light from its centroid, pixels; `part` sums to 1."""
    squares = 0.0
    for along in (part.sum(axis=0), part.sum(axis=1)):
        at = np.arange(along.size)
        squares += float(along @ (at - along @ at) ** 2)
    return float(np.sqrt(squares))


def _brightest(
    project: Project, flare: MeasuredFlare, singles: dict[str, Layer], gains: dict[str, Rgb | None]
) -> list[Layer]:
    """Return the requested layers of single ghosts with the rules' gains, brightest first."""
    (width, height), (across, down) = project.camera.size_px, sensor_of(project, flare.model)
    area = across * down / (width * height)
    kept = []
    for name, layer in singles.items():
        gain = gains.get(name.removeprefix(_SINGLE), (1.0, 1.0, 1.0))
        if gain is not None:
            pixels = np.asarray(layer.pixels * np.array(gain, dtype=np.float32))
            flux = float((pixels.astype(np.float64) @ _LUMINANCE).sum()) * area
            kept.append(replace(layer, pixels=pixels, about={"flux_mm2": flux}))
    kept.sort(key=lambda layer: -float(layer.about["flux_mm2"]))
    return kept[: project.output.brightest]


def _summary(
    project: Project, flare: MeasuredFlare, seen: Sequence[_Seen], gains: dict[str, Rgb | None]
) -> dict[str, Any]:
    model = flare.model
    (width, height), (across, down) = project.camera.size_px, sensor_of(project, model)
    muted = sum(gain is None for gain in gains.values())
    return {
        "lens": flare.name,
        "measured": True,
        "efl_mm": efl_mm(project, model),
        "f_number": opening_of(project, model),
        "size_px": [width, height],
        "sensor_mm": [across, down],
        "quality": "measured",
        "physical": project.art.physical or not (gains or project.art.gain),
        "lights": [
            {
                "name": one.light.name,
                "field_deg": list(one.light.field_deg),
                "constellation_deg": one.constellation_deg,
                "roll_deg": one.roll_deg,
                **({"visible": one.part} if one.part < 1.0 else {}),
                "direct_position_mm": [
                    (one.place_px[0] - 0.5 * width) * across / width, (0.5 * height - one.place_px[1]) * down / height,
                ],
            }
            for one in seen
        ],
        "ghosts": {"known": len(model.ghosts), "muted": muted},
    }  # fmt: skip


def opening_of(project: Project, model: GhostModel) -> float | None:
    """Return the f-number of a measured flare: the project's, else that of its captures, None when unknown."""
    return model.reference.f_number if project.f_number is None else project.f_number


def with_sensor(project: Project) -> Project:
    """Return the project of a measured flare with the sensor of its captures, where that is known and none is set."""
    model = flare_of(project).model
    if project.camera.sensor_mm is not None or model.sensor_width_mm is None:
        return project
    return project.replace(camera=project.camera.replace(sensor_mm=sensor_of(project, model)))


def efl_mm(project: Project, model: GhostModel) -> float:
    """Return the focal length of a measured flare, mm."""
    return model.focal_px * sensor_of(project, model)[0] / model.size_px[0]


def sensor_of(project: Project, model: GhostModel) -> tuple[float, float]:
    """Return width and height of the picture's sensor, mm: the project's, else the model's, else 36 mm wide."""
    (width, height), known = project.camera.size_px, model.sensor_width_mm
    if project.camera.sensor_mm is not None or known is None:
        return project.camera.sensor
    return known, known * height / width


def _remarks(project: Project, flare: MeasuredFlare, seen: Sequence[_Seen], total: Layer) -> tuple[str, ...]:
    remarks = [UNIT]
    remarks += [
        f"{one.light.name} stands {abs(one.beyond_deg):.4g} degrees off the axis, which was not photographed: it is "
        f"drawn at the limit, {abs(one.constellation_deg):.4g} degrees"
        for one in seen
        if one.beyond_deg is not None
    ]
    if flare.model.to_rec709 is None:
        remarks.append(OWN_COLOURS)
    if any(one.light.spectrum != D65() for one in seen):
        remarks.append(TINTED)
    if not project.output.starburst:
        remarks.append(LIGHT_ITSELF)
    if not total.pixels.any():
        remarks.append(BLACK if any(one.part > 0.0 for one in seen) else HIDDEN)
    return tuple(remarks)
