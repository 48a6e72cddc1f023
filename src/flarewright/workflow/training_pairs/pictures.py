"""Draw the pictures of one item: background, flare, masks, and what a sensor makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...io.project.project_text import project_text
from ...model import Layer, Project
from ...model.project.dataset import DatasetSpec
from ...optics.lens.paraxial import focal_lengths
from ...render.image.compose import beauty
from ...render.render import Rendering
from ...render.render import render as render_project
from ...typing import Pixels
from .background import background_of, mean_luminance
from .draw import Drawn, brightened, draw_item, splits_of
from .masks import LightImage, ghost_mask, light_image, light_mask
from .sensor import Sensor, draw_sensor, exposed, noise_of

# exposure of = "mean": value of the background's mean luminance, white at 1 (a grey card)
_MIDDLE_GREY = 0.18


@dataclass(frozen=True)
class Pictures:
    """The pictures of an item, linear Rec.709 with white at 1, before the tone curve.

    Attributes
    ----------
    split : str
    linear : dict of str to ndarray, shape (height, width, 3), float32
        clean and flared as the sensor records them; ghosts, starburst, veil, and source, the part of the starburst on
        the light mask, as light alone.
    light_mask, ghost_mask : ndarray, shape (height, width), uint8
    sensor : Sensor
    record : dict
        All parameters as JSON data.
    """

    split: str
    linear: dict[str, Pixels]
    light_mask: NDArray[np.uint8]
    ghost_mask: NDArray[np.uint8]
    sensor: Sensor
    record: dict[str, Any]


def draw_pictures(spec: DatasetSpec, index: int, backgrounds: Sequence[str], threads: int | None = None) -> Pictures:
    """Draw an item.

    Parameters
    ----------
    spec : DatasetSpec
    index : int
    backgrounds : sequence of str
        From `background.list_backgrounds`.
    threads : int, optional
        None: all cores. The pixels do not depend on it.

    Raises
    ------
    FlarewrightError
        The item cannot be drawn.
    """
    drawn = draw_item(spec, index)
    background, about = background_of(spec, index, backgrounds)
    gain = 2.0**drawn.exposure_stops
    if spec.exposure.of == "mean":
        gain *= _MIDDLE_GREY / mean_luminance(background)
    background = background * np.float32(gain)
    project = brightened(drawn.project, mean_luminance(background))
    rendering = render_project(project, threads=threads)
    # irradiances over this are in the unit of the background (docs/physics.md, "Radiometry")
    scale = 1.0 / rendering.summary["scene_irradiance_per_radiance"]
    light = _light(rendering, spec.size_px, scale)
    images = _light_images(rendering, project)
    lights = light_mask(images, light["starburst"])
    source = np.where(lights[:, :, None] > 0, light["starburst"], np.float32(0.0))
    singles = [layer for layer in rendering.layers if layer.name.startswith("ghost.")]
    ghosts, listed = ghost_mask(singles, spec.size_px, scale, spec.masks.threshold)
    sensor = draw_sensor(spec, index)
    flared = background + light["starburst"]
    flared += light["ghosts"]
    if spec.scatter is not None:
        flared += light["veil"]
    clean = _clean(spec, background, source, images)
    linear = {
        "clean": exposed(clean, sensor, None if sensor.full_well_e is None else noise_of(spec, index, 1)),
        "flared": exposed(flared, sensor, None if sensor.full_well_e is None else noise_of(spec, index, 0)),
        **light,
        "source": source,
    }
    facts = _facts(spec, index, drawn, rendering, images)
    record = {
        **facts,
        "ghosts": listed,
        "background": about,
        "exposure": {"stops": drawn.exposure_stops, "gain": gain},
        "sensor": asdict(sensor),
        "scene_irradiance_per_radiance": 1.0 / scale,
        "project": project_text(rendering.project),
    }
    return Pictures(facts["split"], linear, lights, ghosts, sensor, record)


def _light(rendering: Rendering, size_px: tuple[int, int], scale: float) -> dict[str, Pixels]:
    """Return the passes as pictures in the unit of the background; the veil is black without scatter."""
    layers = {layer.name: layer for layer in rendering.layers}
    names = {"ghosts": "ghosts", "starburst": "starburst", "veil": "scatter"}
    return {part: _whole(layers.get(name), size_px, scale) for part, name in names.items()}


def _whole(layer: Layer | None, size_px: tuple[int, int], scale: float) -> Pixels:
    if layer is None:
        return np.zeros((size_px[1], size_px[0], 3), np.float32)
    whole = layer if layer.window == (0, 0, *size_px) else beauty([layer], size_px)
    return whole.pixels * np.float32(scale)


def _light_images(rendering: Rendering, project: Project) -> list[LightImage]:
    """Return the sharp images of the lights that shine."""
    summary, camera = rendering.summary, project.camera
    efl = focal_lengths(summary["efl_mm"], summary.get("efl_x_mm"))
    return [
        light_image(light, number, facts["direct_position_mm"], efl, camera.size_px, camera.sensor)
        for number, (light, facts) in enumerate(zip(project.lights, summary["lights"], strict=True), 1)
        if light.intensity > 0.0
    ]


def _clean(spec: DatasetSpec, background: Pixels, source: Pixels, images: Sequence[LightImage]) -> Pixels:
    """Return the picture without flare."""
    if spec.light_in_clean == "none":
        return background
    if spec.light_in_clean == "core":
        return background + source
    clean = background.copy()
    for image in images:
        window, cover = image.coverage(spec.size_px)
        part = cover[:, :, None]
        clean[window] = clean[window] * (1.0 - part) + part * image.radiance.astype(np.float32)
    return clean


def _facts(
    spec: DatasetSpec, index: int, drawn: Drawn, rendering: Rendering, images: Sequence[LightImage]
) -> dict[str, Any]:
    """Return the parameters of lens and lights as JSON data."""
    project, summary = rendering.project, rendering.summary
    by_number = {image.number: image for image in images}
    return {
        "index": index,
        "split": splits_of(spec)[str(project.lens)],
        "lens": project.lens,
        "coating": drawn.coating,
        "zoom_mm": project.zoom,
        "focal_length_mm": summary["efl_mm"],
        "f_number": summary["f_number"],
        "wide_open_instead": drawn.opened,
        "focus_distance_mm": project.camera.focus_distance,
        "sensor_mm": list(project.camera.sensor),
        "iris": None if project.iris is None else project.iris.model_dump(mode="json"),
        "dirt": project.dirt.model_dump(mode="json"),
        "scatter": None if project.scatter is None else project.scatter.model_dump(mode="json"),
        "lights": [
            {
                "id": number,
                "field_deg": list(light.field_deg),
                "place_px": [round(at, 3) for at in by_number[number].place_px],
                "radius_px": round(by_number[number].radius_px, 3),
                "in_frame": by_number[number].inside(spec.size_px),
                "intensity": light.intensity,
                "temperature_k": getattr(light.spectrum, "temperature_k", None),
                "diameter_deg": light.diameter_deg,
            }
            for number, light in enumerate(project.lights, 1)
            if number in by_number
        ],
    }
