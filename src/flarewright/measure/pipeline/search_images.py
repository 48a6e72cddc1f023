"""Reduced frames with mixed colours, in which ghosts are searched."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from ...model.measurement.capture import MergedRun
from ...model.measurement.ghost_model import AberrationGhost, GhostModel, Reference, Star
from ...typing import Floats
from ..core.parameters import rescaled
from ..core.views import View, halved_view
from ..detection.channel_mix import mix_channels
from ..detection.settings import DetectionSettings
from ..fitting.detected_ghost import DetectedGhost
from ..glow.fit import fit_star, register
from ..glow.settings import GlowSettings
from ..glow.subtraction import WithoutGlow
from ..replay.light_law import light_law
from .settings import MeasureSettings


def star_of(views: Sequence[View], pool: ThreadPoolExecutor, settings: GlowSettings = GlowSettings()) -> Star | None:
    """Detect the star, the pattern around the light that is the same at every constellation; None if there is none."""
    return fit_star(
        register(views, [view.measured for view in views], pool=pool, settings=settings.halo), settings.star
    )


def search_views(views: Sequence[View], settings: DetectionSettings = DetectionSettings()) -> tuple[int, list[View]]:
    """Return the number of halvings to the search's resolution, and the halved images."""
    times = max(0, int(np.ceil(np.log2(views[0].size_px[0] / settings.width_px))))
    return times, [halved_view(view, times) for view in views]


def mixed_for_search(
    views: Sequence[View], subtracted: Sequence[View], share: Floats, pool: ThreadPoolExecutor,
    settings: MeasureSettings = MeasureSettings(),
) -> list[View]:  # fmt: skip
    """Return the images in which ghosts are searched, their colours mixed to one."""
    _, seen = search_views(mix_channels(views, subtracted, share, settings.glow.left_behind, pool), settings.detection)
    return seen


def scaled_ghost(ghost: DetectedGhost, factor: float) -> DetectedGhost:
    """Return a ghost in units of pixels that are smaller by a factor."""
    red, green, blue = (rescaled(shape, factor) for shape in ghost.shapes)
    return replace(ghost, shapes=(red, green, blue))


def model_of_run(
    run: MergedRun, ghosts: tuple[AberrationGhost, ...], dim: WithoutGlow, views: Sequence[View]
) -> GhostModel:
    """Build the model of a run from its ghosts, halo and star."""
    angles = [each.constellation_deg for each in run.frames]
    focal, distortion = light_law(views, run.px_per_rad)
    used = [view.constellation_deg for view in views]
    return GhostModel(
        size_px=run.size_px, axis_px=run.axis_px, focal_px=focal, distortion=distortion,
        largest_deg=max(abs(angle) for angle in angles), constellation_deg=(min(used), max(used)), ghosts=ghosts,
        sensor_width_mm=run.sensor_width_mm, halo=dim.halo, star=dim.star, reference=reference_of(run),
        to_rec709=run.to_rec709,
    )  # fmt: skip


def reference_of(run: MergedRun) -> Reference:
    """Return the units of a run's frames: before white balance, 1 saturates the sensor in one second."""
    camera = run.camera
    return Reference(
        iso=run.reference_iso, f_number=run.reference_f_number, exposure_s=1.0,
        luminance_cd_m2=camera.luminance_cd_m2, solid_angle_sr=camera.solid_angle_sr,
        # without a known white level 1 is the files' unit
        clipping=None if camera.white_level is None else run.white_balance,
    )  # fmt: skip
