"""Reference quality: Monte Carlo through the whole lens, all orders of reflection, with the error of every pixel.

Light is traced from the source through the front. At each surface it reflects or refracts with probability R
(Chaumond 2007), and then meets the neighbouring surface in its direction of travel. This code shares with the ray
bundles only intersection and refraction, so it can test them. It stops at a target error and can be resumed later.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from math import ceil, inf
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import OutputError, ProjectError
from ...io.render_state.reference_state import write_reference_state
from ...model import Layer, Quality
from ...model.project.reference_state import ReferenceState
from ...typing import Floats, Progress
from ..scattering.scatter_pass import chosen_scatter, scatter_of
from ..scene.opening import make_opening
from ..scene.resolve import ResolvedProject
from ..scene.shot import Shot
from ..scene.shots import make_shots
from .batches import GHOSTS, HEROES, Sums, batches_in_order, run_batch
from .energy_ledger import Ledger, ledger_of
from .ray_generation import ReferenceRays, reference_rays, relative_spread

# points per batch, squared
SIDE = 128
# least number of batches for an error estimate
LEAST_BATCHES = 16
# largest part of an area light
WIDEST_PART_DEG = 60.0
# memory limit for concurrent batches, bytes
MEMORY_BYTES = 1.5e9
# least time between two writes of the state; it is longer if writing would take more than a tenth of the time
SAVE_EVERY_S = 20.0

ORDER_2, ORDER_4, SCATTER = "ghosts", "ghosts.order4+", "scatter"
VARIANCE = ".variance"


@dataclass(frozen=True)
class ReferenceRun:
    """Start and end of one run of a reference render; the samples do not depend on it.

    Attributes
    ----------
    resume : ReferenceState or None
        State to resume.
    state_file : Path or None
        File for the state: written at intervals, at the end, and when the run is interrupted.
    time_limit_s : float or None
        Stop after this time even if the target error is not reached.
    """

    resume: ReferenceState | None = None
    state_file: Path | None = None
    time_limit_s: float | None = None


@dataclass(frozen=True)
class ReferencePass:
    """Result of a reference render.

    Attributes
    ----------
    layers : tuple of Layer
        "ghosts" (two reflections) and "ghosts.order4+" (more); "scatter" if surfaces scatter.
    variances : tuple of Layer
        The variance of their pixels, named with the suffix ".variance".
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


def spectral_shots(settled: ResolvedProject, mask: Floats | None) -> tuple[Shot, ...]:
    """Prepare all lights of a project at the wavelengths that reference quality samples.

    Parameters
    ----------
    settled : ResolvedProject
    mask : ndarray or None
        As in `make_opening`.

    Returns
    -------
    tuple of Shot
        With `quality.bridge`, at most 5 nm apart over all visible light; without it, exactly the wavelengths of final
        quality.
    """
    project = settled.project
    quality = project.quality
    if all(holdout is None for holdout in (project.holdout, *(light.holdout for light in project.lights))):
        # random directions need no parts, but holdouts are evaluated per part
        quality = quality.replace(source_step_deg=WIDEST_PART_DEG)
    fine = replace(settled, project=project.replace(quality=quality))
    return make_shots(fine, make_opening(fine, mask), sampled=quality.bridge)


def render_reference(
    settled: ResolvedProject,
    mask: Floats | None,
    run: ReferenceRun,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> ReferencePass:
    """Trace random rays until the target error is reached.

    Parameters
    ----------
    settled : ResolvedProject
    mask : ndarray, shape (A, B), or None
        Image of the iris.
    run : ReferenceRun
    threads : int, optional
        None: all cores. The pixels do not depend on it.
    progress : callable, optional
        Called with an estimate of the finished part, and the current error.

    Raises
    ------
    ProjectError
        The state to resume belongs to other settings.
    """
    quality = settled.project.quality
    if settled.project.camera.sensor_reflectance == 1.0:
        raise ProjectError(
            "reference quality traces light until it is absorbed, and a sensor with reflectance 1 absorbs nothing; "
            "choose a sensor_reflectance below 1"
        )
    shots = spectral_shots(settled, mask)
    tables = scatter_of(settled, shots)
    rays = reference_rays(shots, quality, SIDE, tables)
    prints = _fingerprints(settled, shots, rays)
    sums = _start(run.resume, prints)
    begin, saved, saving_s = time.monotonic(), time.monotonic(), 0.0

    unsaved: list[str] = []

    def save() -> None:
        if run.state_file is not None and sums.batches:
            state = ReferenceState(settled.project, prints, sums.batches, sums.sums, sums.squares)
            unsaved.clear()
            # a full disk costs the state, not the picture
            try:
                write_reference_state(run.state_file, state)
            except OutputError as error:
                unsaved.append(f"this render cannot be resumed: {error}")

    results = batches_in_order(
        lambda batch: run_batch(rays.sources, batch, picture=True, cameras=rays.cameras),
        sums.batches,
        _at_once(shots[0], threads),
    )
    # add sums in a separate thread, where Ctrl-C cannot interrupt an addition
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
    finished = _finish(sums, shots, quality, reason, kept, rays.from_camera)
    return replace(finished, remarks=(*finished.remarks, *unsaved))


def _at_once(shot: Shot, threads: int | None) -> int:
    """Return the number of concurrent batches: one per thread, limited by memory."""
    a_batch = 3 * 3 * 4 * shot.size_px[0] * shot.size_px[1]
    return max(1, min(threads or os.cpu_count() or 1, int(MEMORY_BYTES / a_batch)))


def _start(state: ReferenceState | None, prints: dict[str, str]) -> Sums:
    if state is None:
        return Sums(0, {}, {})
    other = [part for part, digest in prints.items() if state.fingerprints.get(part) != digest]
    if other:
        raise ProjectError(
            f"the state to resume belongs to another {' and '.join(other)}; give the settings that it was made with "
            "or restart without --resume"
        )
    return Sums(state.batches, state.sums, state.squares)


def _fingerprints(settled: ResolvedProject, shots: Sequence[Shot], rays: ReferenceRays) -> dict[str, str]:
    """Return digests of everything that determines the samples, by topic."""
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
        "light": [
            light.model_dump(mode="json", exclude={"holdout", "keyframes", "motion", "curves"})
            for light in project.lights
        ],
        # digest the result, not the files
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


def _relative_error(sums: Sums, of: str) -> float:
    """Return `relative_spread`: infinity until enough batches are finished, 0 if no ray met a ghost."""
    if sums.batches < LEAST_BATCHES:
        return inf
    spread = relative_spread(sums, of)
    return spread if spread < inf else 0.0


def _most_batches(quality: Quality) -> float:
    """Return the number of batches for `reference_samples`, at least two: one has no variance."""
    return inf if quality.reference_samples is None else max(2, ceil(quality.reference_samples / SIDE**2))


def _done(sums: Sums, quality: Quality, run: ReferenceRun, begin: float) -> str:
    """Return the reason to stop, or an empty string."""
    if _relative_error(sums, quality.reference_error_of) <= quality.reference_error:
        return "error"
    if sums.batches >= _most_batches(quality):
        return "samples"
    if run.time_limit_s is not None and sums.batches >= 2 and time.monotonic() - begin > run.time_limit_s:
        return "time"
    return ""


def _estimate(sums: Sums, quality: Quality, run: ReferenceRun, begin: float) -> tuple[float, str]:
    """Estimate the finished part from the condition that will end the run first."""
    error = _relative_error(sums, quality.reference_error_of)
    parts = [sums.batches / _most_batches(quality)]
    if error < inf:
        # the error falls with the square root of the number of rays
        parts.append((quality.reference_error / max(error, 1e-300)) ** 2)
    if run.time_limit_s is not None:
        parts.append((time.monotonic() - begin) / run.time_limit_s)
    words = f"error {error:.2%}" if error < inf else "first rays"
    return min(1.0, max(parts)), f"{words}, {sums.batches * SIDE**2 / 1e6:.2f} million points"


def _finish(
    sums: Sums, shots: Sequence[Shot], quality: Quality, reason: str, kept: float, from_camera: Sequence[int]
) -> ReferencePass:
    shot = shots[0]
    # rays carry the part that the sensor absorbs; the picture is the light that arrives at the sensor
    area = kept * shot.pixel_area
    mean, variance = sums.mean("planes") / area, sums.variance("planes") / area**2
    names = (ORDER_2, ORDER_4, SCATTER)[: len(mean)]
    ledger = ledger_of(sums)
    flux, high = float(sums.mean("figures")[GHOSTS]) / kept, _share_of_high_orders(ledger)
    errors = {of: _relative_error(sums, of) for of in ("total", "blocks")}
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
        if sums.batches >= LEAST_BATCHES
        else f"{facts['points']} points of the front were traced, too few for an error estimate",
        f"{high:.2%} of it comes from four or more reflections",
    ]
    if reason != "error" and errors[quality.reference_error_of] > quality.reference_error:
        limit = "the number of samples" if reason == "samples" else "the time"
        remarks.append(f"{limit} ended the render before the target error of {quality.reference_error:.2%}")
    if from_camera:
        words = ", ".join(str(number) for number in from_camera)
        remarks.append(f"the ghosts of area lights were traced from the sensor: lights {words}, counted from 0")
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
