"""The facts of a rendered picture as JSON data: lens, picture, and where each light lies."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from math import pi
from typing import Any

import numpy as np

from ..kernels.tracing.sequential import REFRACT
from ..model import Project
from ..optics.lens.paths import direct_path
from .scene.art_rules import ResolvedArt
from .scene.direct_image import DirectImage, pattern_stretch
from .scene.resolve import ResolvedProject
from .scene.shot import Shot


def summary_of(
    settled: ResolvedProject, shots: Sequence[Shot], images: Sequence[DirectImage], art: ResolvedArt
) -> dict[str, Any]:
    """Return the facts of the lens, the picture and each light, whose direct image is given."""
    order, project = settled.order, settled.project
    return {
        "lens": settled.lens.name,
        "efl_mm": order.efl,
        "bfl_mm": order.bfl,
        **({} if order.efl_x is None else {"efl_x_mm": order.efl_x}),
        "f_number": order.f_number,
        "entrance_pupil_diameter_mm": order.entrance_pupil_diameter,
        "sensor_distance_mm": order.sensor_distance,
        "size_px": list(project.camera.size_px),
        "sensor_mm": list(project.camera.sensor),
        "quality": project.quality.mode,
        "physical": art.physical,
        "wavelengths_nm": [float(w) for w in shots[0].packed.wavelengths_nm],
        "scene_irradiance_per_radiance": _scene_scale(settled, shots[0]),
        "lights": [
            _light_summary(project, number, list(of_one))
            for number, of_one in groupby(zip(shots, images, strict=True), lambda pair: pair[0].number)
        ],
    }


def _scene_scale(settled: ResolvedProject, shot: Shot) -> float:
    """Irradiance at the sensor's centre per radiance of an extended scene: pi T (r / d)^2 of the exit pupil.

    Dividing layers by it gives the unit of the plate (docs/physics.md, "Radiometry"). Focused at infinity, r / d is
    1 / (2 N); it shrinks as the sensor moves away for a near focus plane. Cylinders behind the stop make the exit pupil
    an ellipse.
    """
    packed = shot.packed
    # rays along the axis meet every surface at normal incidence, the last entry of its table
    path, middle = direct_path(settled.lens), (len(packed.wavelengths_nm) - 1) // 2
    passed = 1.0 - packed.reflectance[middle, path.rows[path.actions == REFRACT], -1]
    # a mask spans a square; the round opening is pi / 4 of it
    opened = shot.opening.mean_transmittance * (1.0 if shot.opening.mask is None else 4.0 / pi)
    cone = (0.5 / shot.working_f_number) ** 2 / pattern_stretch(settled.lens, shot)
    return float(pi * passed.prod() * opened * cone)


def _light_summary(project: Project, number: int, parts: list[tuple[Shot, DirectImage]]) -> dict[str, Any]:
    """Return image position and brightness of a light; for an area light the mean over its parts."""
    light = project.lights[number]
    hidden = project.holdout is not None or light.holdout is not None
    throughput = np.sum([shot.share * image.throughput_mm2 for shot, image in parts], axis=0)
    weights = np.array([shot.share * float(image.throughput_mm2.sum()) for shot, image in parts])
    weights = weights / weights.sum() if weights.any() else np.full(len(parts), 1.0 / len(parts))
    position = weights @ np.array([image.position_mm for _, image in parts])
    return {
        "name": light.name,
        "field_deg": list(light.field_deg),
        **({} if light.distance is None else {"distance_mm": light.distance}),
        **({"parts": len(parts)} if light.extended else {}),
        **({"visible": sum(shot.share for shot, _ in parts)} if hidden else {}),
        "direct_position_mm": [float(position[0]), float(position[1])],
        "direct_throughput_mm2": [float(flux) for flux in throughput],
        "transmittance": float(weights @ [image.transmittance for _, image in parts]),
    }
