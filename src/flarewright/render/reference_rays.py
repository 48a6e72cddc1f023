"""Where the rays of the reference begin: at the lights, or for area lights at the sensor, if that tells more sooner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import inf, radians, sqrt, tan

import numpy as np

from ..model import Quality
from ..optics.border import points
from ..optics.scatter import ScatterTables
from .camera_rays import CameraSource, camera_source
from .montecarlo import GHOSTS, RaySource, Sums, ray_source, run_batch, spectrum_of
from .shot import Shot

# numbers of camera rays' random numbers begin here, far from those of lights
CAMERA = 1 << 30
# the trial: batches, and points of each squared
TRIAL, TRIAL_SIDE = 8, 64
# lights that are less wide have too few rays from the camera to be worth a trial, degrees
LEAST_DEG = 3.0
# what the ledger alone needs of a light met from the camera: one in so many points, squared
LEDGER_PART = 4

__all__ = ["ReferenceRays", "reference_rays", "relative_spread"]


@dataclass(frozen=True)
class ReferenceRays:
    """What a batch traces.

    Attributes
    ----------
    sources : tuple of RaySource
        Every light; those that the camera meets are for the ledger alone.
    cameras : tuple of CameraSource
    from_camera : tuple of int
        Numbers of the lights that the camera meets.
    """

    sources: tuple[RaySource, ...]
    cameras: tuple[CameraSource, ...]
    from_camera: tuple[int, ...]


def reference_rays(
    shots: Sequence[Shot], quality: Quality, side: int, scatter: Sequence[ScatterTables] | None = None
) -> ReferenceRays:
    """Decide for every light where its rays begin, and prepare them.

    Parameters
    ----------
    shots : sequence of Shot
        All parts of all lights.
    quality : Quality
    side : int
        A batch has side x side points of the front, or of the picture.
    scatter : sequence of ScatterTables, optional
        One a shot; None: nothing scatters.

    Returns
    -------
    ReferenceRays
    """
    sources: list[RaySource] = []
    cameras: list[CameraSource] = []
    chosen = []
    for number, group in groupby(enumerate(shots), lambda item: item[1].number):
        parts = list(group)
        own = [shot for _, shot in parts]
        camera = _from_camera(own, quality)
        # what scatters is met from the light in any case
        fewer = max(8, side // LEDGER_PART) if camera and scatter is None else side
        for k, shot in parts:
            table = None if scatter is None else scatter[k]
            sources.append(ray_source(shot, quality.seed, side=fewer, light=k, scatter=table, drawn=not camera))
        if camera:
            chosen.append(number)
            cameras.append(_camera(own, quality.seed, side, number))
    return ReferenceRays(tuple(sources), tuple(cameras), tuple(chosen))


def _camera(parts: Sequence[Shot], seed: int, side: int, number: int) -> CameraSource:
    spectrum = spectrum_of(parts[0], 1.0, seed)
    return camera_source(parts, spectrum, count=side * side, light=CAMERA + number)


def _from_camera(parts: Sequence[Shot], quality: Quality) -> bool:
    """Tell whether a light is met from the camera: as wished, else by a trial with other random numbers."""
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
    one, other = Sums(0, {}, {}), Sums(0, {}, {})
    for batch in range(TRIAL):
        one.add(run_batch(lights, batch, picture=True))
        other.add(run_batch(ledger, batch, picture=True, cameras=camera))
    errors = [relative_spread(sums, quality.reference_error_of) for sums in (one, other)]
    # work is as good as the number of points
    return errors[1] ** 2 < errors[0] ** 2 * len(parts)


def relative_spread(sums: Sums, of: str) -> float:
    """Relative standard error of the ghosts in the picture.

    Parameters
    ----------
    sums : Sums
    of : {"total", "blocks"}
        Of their whole flux, or of blocks of 16 x 16 pixels: mean standard error over mean flux of a block.

    Returns
    -------
    float
        Infinite when no ghost was met.
    """
    if of == "total":
        mean, error = float(sums.mean("figures")[GHOSTS]), sqrt(float(sums.variance("figures")[GHOSTS]))
    else:
        mean, error = float(sums.mean("blocks")[1].sum()), float(np.sqrt(sums.variance("blocks")[1]).sum())
    return error / mean if mean > 0.0 else inf
