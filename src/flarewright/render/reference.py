"""Reference quality: Monte Carlo through the whole lens, all orders of reflection, with the error of every pixel.

Light is traced from the source through the front. At each surface it reflects or refracts by R (Chaumond 2007), and
what leaves a surface meets the neighbour in its direction of travel. It shares with the ray bundles only the formulas
for hitting and bending, so it can judge them. It stops at a wanted error, and it can go on later.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from math import ceil, inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..io.reference_state import write_state
from ..model import Layer, Quality
from ..model.reference_state import ReferenceState
from .ledger import Ledger, ledger_of
from .montecarlo import GHOSTS, HEROES, Sums, batches_in_order, run_batch
from .opening import make_opening
from .prepare import Settled
from .reference_rays import ReferenceRays, reference_rays, relative_spread
from .scatter import chosen_scatter, scatter_of
from .shot import Shot
from .shots import make_shots

Floats = NDArray[np.float64]
Progress = Callable[[float, str], None]

# a batch has so many points squared
SIDE = 128
# from how few batches an error can be told
FEWEST = 16
# parts of area lights
WIDEST_PART_DEG = 60.0
# batches in work at once take no more memory than this, bytes
MOST_MEMORY = 1.5e9
# a state is written when this much time has gone by, and never so often that writing takes a tenth of the time
SAVE_EVERY_S = 20.0

ORDER_2, ORDER_4, SCATTER = "ghosts", "ghosts.order4+", "scatter"
VARIANCE = ".variance"


@dataclass(frozen=True)
class ReferenceRun:
    """How one run of a reference render begins and ends; the samples do not depend on it.

    Attributes
    ----------
    resume : ReferenceState or None
        Where to go on.
    state_file : Path or None
        Where the state is written now and then, at the end, and when the run is interrupted.
    time_limit_s : float or None
        Stop after so many seconds, error reached or not.
    """

    resume: ReferenceState | None = None
    state_file: Path | None = None
    time_limit_s: float | None = None


@dataclass(frozen=True)
class ReferencePass:
    """What a reference render made.

    Attributes
    ----------
    layers : tuple of Layer
        "ghosts" (two reflections) and "ghosts.order4+" (more); "scatter" where surfaces scatter.
    variances : tuple of Layer
        The variance of their pixels, same names with ".variance".
    ledger : Ledger
    facts : dict
        For the summary.
    remarks : tuple of str
    """

    layers: tuple[Layer, ...]
    variances: tuple[Layer, ...]
    ledger: Ledger
    facts: dict[str, Any]
    remarks: tuple[str, ...]


def spectral_shots(settled: Settled, mask: Floats | None) -> tuple[Shot, ...]:
    """Prepare every light of a project at the wavelengths that the reference samples.

    Parameters
    ----------
    settled : Settled
    mask : ndarray or None
        As in `make_opening`.

    Returns
    -------
    tuple of Shot
        With `quality.bridge` 5 nm apart or finer over all visible light; without it the wavelengths that final quality
        traces, and no others.
    """
    project = settled.project
    quality = project.quality
    if all(holdout is None for holdout in (project.holdout, *(light.holdout for light in project.lights))):
        # random directions need no parts; only what is hidden is told part by part
        quality = quality.replace(source_step_deg=WIDEST_PART_DEG)
    fine = replace(settled, project=project.replace(quality=quality))
    return make_shots(fine, make_opening(fine, mask), sampled=quality.bridge)


def render_reference(
    settled: Settled,
    mask: Floats | None,
    run: ReferenceRun,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> ReferencePass:
    """Trace random rays until the wanted error is reached.

    Parameters
    ----------
    settled : Settled
    mask : ndarray, shape (A, B), or None
        The iris as an image.
    run : ReferenceRun
    threads : int, optional
        None: all cores. The pixels do not depend on it.
    progress : callable, optional
        Called with an estimate of the finished part, and the error so far.

    Returns
    -------
    ReferencePass

    Raises
    ------
    ProjectError
        When the state to go on from belongs to other settings.
    """
    quality = settled.project.quality
    if settled.project.camera.sensor_reflectance == 1.0:
        raise ProjectError(
            "reference quality follows light until something keeps it, and a sensor that reflects all light keeps "
            "none; choose a sensor_reflectance below 1"
        )
    shots = spectral_shots(settled, mask)
    tables = scatter_of(settled, shots)
    rays = reference_rays(shots, quality, SIDE, tables)
    prints = _fingerprints(settled, shots, rays)
    sums = _start(run.resume, prints)
    begin, saved, saving_s = time.monotonic(), time.monotonic(), 0.0

    def save() -> None:
        if run.state_file is not None and sums.batches:
            project = settled.project
            write_state(run.state_file, ReferenceState(project, prints, sums.batches, sums.sums, sums.squares))

    results = batches_in_order(
        lambda batch: run_batch(rays.sources, batch, picture=True, cameras=rays.cameras),
        sums.batches,
        _at_once(shots[0], threads),
    )
    # sums are added in a thread of their own, where Ctrl-C cannot leave them half-added
    with ThreadPoolExecutor(1) as adder:
        try:
            with closing(results):
                while not (reason := _done(sums, quality, run, begin)):
                    adder.submit(sums.add, next(results)).result()
                    if progress is not None:
                        progress(*_estimate(sums, quality, run, begin))
                    now = time.monotonic()
                    if now - saved > max(SAVE_EVERY_S, 10.0 * saving_s):
                        save()
                        saved, saving_s = time.monotonic(), time.monotonic() - now
        finally:
            adder.shutdown(wait=True)
            save()
    kept = 1.0 - settled.project.camera.sensor_reflectance
    return _finish(sums, shots, quality, reason, kept, rays.from_camera)


def _at_once(shot: Shot, threads: int | None) -> int:
    """How many batches to trace side by side: one a thread, as long as their pictures find room."""
    a_batch = 3 * 3 * 4 * shot.size_px[0] * shot.size_px[1]
    return max(1, min(threads or os.cpu_count() or 1, int(MOST_MEMORY / a_batch)))


def _start(state: ReferenceState | None, prints: dict[str, str]) -> Sums:
    if state is None:
        return Sums(0, {}, {})
    other = [part for part, digest in prints.items() if state.fingerprints.get(part) != digest]
    if other:
        raise ProjectError(
            f"the state to resume belongs to another {' and '.join(other)}; give the settings that it was made with "
            "or begin anew without --resume"
        )
    return Sums(state.batches, state.sums, state.squares)


def _fingerprints(settled: Settled, shots: Sequence[Shot], rays: ReferenceRays) -> dict[str, str]:
    """Digest each part of what decides the samples."""
    project, quality = settled.project, settled.project.quality
    packed, opening = shots[0].packed, shots[0].opening
    scatter = chosen_scatter(settled)
    hidden = any(holdout is not None for holdout in (project.holdout, *(light.holdout for light in project.lights)))
    parts: dict[str, Any] = {
        "lens": settled.lens.model_dump(mode="json"),
        "f-number": settled.order.stop_semi_diameter,
        "distance of the sensor": packed.sensor_z,
        "iris": [settled.iris.model_dump(mode="json", exclude={"mask"}), _digest(opening.mask)],
        "coating": project.coating.model_dump(mode="json"),
        "light": [light.model_dump(mode="json", exclude={"holdout", "keyframes"}) for light in project.lights],
        # whatever files say it
        "holdout": [[shot.light.field_deg, shot.share, _digest(shot.border)] for shot in shots] if hidden else None,
        "picture": [project.camera.size_px, project.camera.sensor, project.output.colorspace],
        "sensor reflectance": project.camera.sensor_reflectance,
        "scatter": None if scatter is None else scatter.model_dump(mode="json"),
        "spectral sampling": [*packed.wavelengths_nm.tolist(), HEROES],
        "seed": [quality.seed, SIDE],
        "choice of lights met from the camera": rays.from_camera,
    }
    return {name: hashlib.sha256(json.dumps(value).encode()).hexdigest() for name, value in parts.items()}


def _digest(array: Floats | None) -> str | None:
    return None if array is None else hashlib.sha256(array.tobytes()).hexdigest()


def relative_error(sums: Sums, of: str) -> float:
    """Relative standard error of the ghosts in the picture.

    Parameters
    ----------
    sums : Sums
    of : {"total", "blocks"}
        Of their whole flux, or of blocks of 16 x 16 pixels: mean standard error over mean flux of a block.

    Returns
    -------
    float
        Infinity while too few batches are finished to tell it; 0 when no ghost was met.
    """
    if sums.batches < FEWEST:
        return inf
    spread = relative_spread(sums, of)
    return spread if spread < inf else 0.0


def _most_batches(quality: Quality) -> float:
    """Return how many batches `reference_samples` allows, two at the least: one alone has no variance."""
    return inf if quality.reference_samples is None else max(2, ceil(quality.reference_samples / SIDE**2))


def _done(sums: Sums, quality: Quality, run: ReferenceRun, begin: float) -> str:
    """Return why to stop, or nothing."""
    if relative_error(sums, quality.reference_error_of) <= quality.reference_error:
        return "error"
    if sums.batches >= _most_batches(quality):
        return "samples"
    if run.time_limit_s is not None and sums.batches >= 2 and time.monotonic() - begin > run.time_limit_s:
        return "time"
    return ""


def _estimate(sums: Sums, quality: Quality, run: ReferenceRun, begin: float) -> tuple[float, str]:
    """Estimate the finished part from whatever will end the run first."""
    error = relative_error(sums, quality.reference_error_of)
    parts = [sums.batches / _most_batches(quality)]
    if error < inf:
        # the error falls with the root of the number of rays
        parts.append((quality.reference_error / max(error, 1e-300)) ** 2)
    if run.time_limit_s is not None:
        parts.append((time.monotonic() - begin) / run.time_limit_s)
    told = f"error {error:.2%}" if error < inf else "first rays"
    return min(1.0, max(parts)), f"{told}, {sums.batches * SIDE**2 / 1e6:.2f} million points"


def _finish(
    sums: Sums, shots: Sequence[Shot], quality: Quality, reason: str, kept: float, from_camera: Sequence[int]
) -> ReferencePass:
    shot = shots[0]
    # a ray ends in the sensor with what the sensor keeps of it; the picture is what falls on the sensor
    area = kept / float(shot.to_pixels[2] * shot.to_pixels[3])
    mean, variance = sums.mean("planes") / area, sums.variance("planes") / area**2
    names = (ORDER_2, ORDER_4, SCATTER)[: len(mean)]
    ledger = ledger_of(sums)
    flux, high = float(sums.mean("figures")[GHOSTS]) / kept, _share_of_high_orders(ledger)
    errors = {of: relative_error(sums, of) for of in ("total", "blocks")}
    facts = {
        "batches": sums.batches,
        "points": sums.batches * SIDE**2,
        "rays_per_point": int(min(HEROES, len(shot.packed.wavelengths_nm))),
        "wavelengths_nm": [float(w) for w in shot.packed.wavelengths_nm],
        "seed": quality.seed,
        "stopped_by": reason,
        "lights_from_camera": list(from_camera),
        "ghost_flux_mm2": flux,
        "relative_standard_error": errors["total"],
        "relative_standard_error_of_blocks": errors["blocks"],
        "share_of_four_and_more_reflections": high,
    }
    remarks = [
        f"{facts['points']} points of the front were traced; the ghosts' flux in the picture is known to "
        f"{errors['total']:.2%}, that of 16 x 16 blocks to {errors['blocks']:.2%}"
        if sums.batches >= FEWEST
        else f"{facts['points']} points of the front were traced, too few to tell an error",
        f"{high:.2%} of it comes by four or more reflections",
    ]
    if reason != "error" and errors[quality.reference_error_of] > quality.reference_error:
        limit = "the number of samples" if reason == "samples" else "the time"
        remarks.append(f"{limit} ended the render before the wanted error of {quality.reference_error:.2%}")
    if from_camera:
        told = ", ".join(str(number) for number in from_camera)
        remarks.append(f"the ghosts of area lights were met from the sensor: lights {told}, counted from 0")
    if flux == 0.0:
        remarks.append("no ray met a ghost in the picture")
    return ReferencePass(
        tuple(_layer(name, mean[k]) for k, name in enumerate(names)),
        tuple(_layer(name + VARIANCE, variance[k]) for k, name in enumerate(names)),
        ledger,
        facts,
        tuple(remarks),
    )


def _share_of_high_orders(ledger: Ledger) -> float:
    shares = {line.name: line.share for line in ledger.lines}
    high = shares["ghosts.order4.in_picture"] + shares["ghosts.order6+.in_picture"]
    every = shares["ghosts.order2.in_picture"] + high
    return high / every if every > 0.0 else 0.0


def _layer(name: str, plane: Floats) -> Layer:
    _, height, width = plane.shape
    return Layer(name, np.moveaxis(plane, 0, -1).astype(np.float32), (0, 0, width, height))
