"""Start of the reference rays: at the lights, or for area lights at the sensor if that converges faster."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import inf, radians, sqrt, tan

import numpy as np

from ...model import Quality
from ...optics.pupil.polygon import points
from ...optics.scattering.brdf import ScatterTables
from ..scene.shot import Shot
from .batches import GHOSTS, RaySource, Sums, ray_source, run_batch, spectrum_of
from .camera_rays import CameraSource, camera_source

# offset of the random streams of camera rays, far from those of lights
CAMERA = 1 << 30
# trial: number of batches, and points per batch squared
TRIAL_BATCHES, TRIAL_SIDE = 8, 64
# narrower lights get too few camera rays for a trial, degrees
LEAST_DEG = 3.0
# for a light traced from the camera, the ledger uses this many times fewer points per axis from the light
LEDGER_PART = 4


@dataclass(frozen=True)
class ReferenceRays:
    """The rays of a batch.

    Attributes
    ----------
    sources : tuple of RaySource
        All lights; those traced from the camera serve the ledger only.
    cameras : tuple of CameraSource
    from_camera : tuple of int
        Indices of the lights traced from the camera.
    """

    sources: tuple[RaySource, ...]
    cameras: tuple[CameraSource, ...]
    from_camera: tuple[int, ...]


def reference_rays(
    shots: Sequence[Shot], quality: Quality, side: int, scatter: Sequence[ScatterTables] | None = None
) -> ReferenceRays:
    """Choose the start of the rays for every light, and prepare them.

    Parameters
    ----------
    shots : sequence of Shot
        All parts of all lights.
    quality : Quality
    side : int
        A batch has side x side points on the front, or in the picture.
    scatter : sequence of ScatterTables, optional
        One per shot; None: nothing scatters.
    """
    sources: list[RaySource] = []
    cameras: list[CameraSource] = []
    chosen = []
    for number, group in groupby(enumerate(shots), lambda item: item[1].number):
        parts = list(group)
        own = [shot for _, shot in parts]
        camera = _from_camera(own, quality)
        # scattered light is traced from the light in any case
        fewer = max(8, side // LEDGER_PART) if camera and scatter is None else side
        for k, shot in parts:
            table = None if scatter is None else scatter[k]
            sources.append(ray_source(shot, quality.seed, side=fewer, light=k, scatter=table, drawn=not camera))
        if camera:
            chosen.append(number)
            cameras.append(_camera(own, quality.seed, side, number))
    return ReferenceRays(tuple(sources), tuple(cameras), tuple(chosen))


def _camera(parts: Sequence[Shot], seed: int, side: int, number: int) -> CameraSource:
    samples, chances = spectrum_of(parts[0], 1.0, seed)
    return camera_source(parts, samples, chances, count=side * side, light=CAMERA + number)


def _from_camera(parts: Sequence[Shot], quality: Quality) -> bool:
    """Return whether to trace a light from the camera: by setting, else by a trial with other random numbers."""
    if parts[0].border is None or quality.reference_from == "light":
        return False
    if quality.reference_from == "camera":
        return True
    ends = np.concatenate(
        [points(s.border) + np.tan(np.radians(s.light.field_deg)) for s in parts if s.border is not None]
    )
    if float(np.ptp(ends, axis=0).max()) < tan(radians(LEAST_DEG)):
        return False
    seed = (quality.seed + 1) % 2**63
    lights = [ray_source(shot, seed, side=TRIAL_SIDE, light=k) for k, shot in enumerate(parts)]
    ledger = [ray_source(parts[0], seed, side=8, light=0, drawn=False)]
    camera = [_camera(parts, seed, TRIAL_SIDE, 0)]
    from_light, from_sensor = Sums(0, {}, {}), Sums(0, {}, {})
    for batch in range(TRIAL_BATCHES):
        from_light.add(run_batch(lights, batch, picture=True))
        from_sensor.add(run_batch(ledger, batch, picture=True, cameras=camera))
    errors = [relative_spread(sums, quality.reference_error_of) for sums in (from_light, from_sensor)]
    # compare errors at equal work, measured in points
    return errors[1] ** 2 < errors[0] ** 2 * len(parts)


def relative_spread(sums: Sums, of: str) -> float:
    """Return the relative standard error of the ghosts in the picture.

    Parameters
    ----------
    sums : Sums
    of : {"total", "blocks"}
        "total": of their whole flux. "blocks": mean standard error over mean flux of blocks of 16 x 16 pixels.

    Returns
    -------
    float
        Infinity if no ray met a ghost.
    """
    if of == "total":
        mean, error = float(sums.mean("figures")[GHOSTS]), sqrt(float(sums.variance("figures")[GHOSTS]))
    else:
        mean, error = float(sums.mean("blocks")[1].sum()), float(np.sqrt(sums.variance("blocks")[1]).sum())
    return error / mean if mean > 0.0 else inf
