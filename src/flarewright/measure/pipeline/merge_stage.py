"""Merge stage (first of a measurement): merge photographs to HDR frames and solve the camera geometry.

Each frame is written as soon as it is merged, with a JSON note of its photographs and settings. A resumed run keeps the
frames whose photographs and settings are unchanged.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import asdict, dataclass, replace
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FlarewrightError, OutputError
from ...io.files.atomic_write import write_text_atomically
from ...io.files.text_file import digest_of
from ...io.images.photo import open_photo
from ...io.measurement.merged import read_frame, read_note, read_run, remove_index, write_frame, write_run
from ...model.measurement.capture import OF_LIGHT, CameraNoise, Capture, FrameInfo, Matrix3, MergedFrame, MergedRun
from ...sentences import count
from ...typing import Progress, Report
from ..core.sampling import evenly_spaced
from ..merging.calibrate import CameraCalibration, calibrate
from ..merging.camera_geometry import Geometry, SightingInput, believable, solve_geometry
from ..merging.exposure_check import refuse_contradiction
from ..merging.exposure_drift import with_drift_gains
from ..merging.hdr_merge import exposure_ratios, merge_exposures, refuse_damage, without_idle_digits
from ..merging.level_horizon import UPRIGHT, make_upright
from ..merging.light_position import LightSighting, find_light
from ..merging.optical_axis import axis_beside_path, reduced_frame
from ..merging.second_light import refuse_second_light
from ..merging.settings import GeometrySettings, LightSettings, MergeSettings

FRAMES = "frames"
# increase when the same photographs give other pixels or another light position
_VERSION = 4

# memory per pixel during a merge (50 megapixels of RAW took 1.5 GB), and the limit for all concurrent merges, bytes
_PIXEL_BYTES, _WORKING_BYTES = 124, 4e9


@dataclass(frozen=True)
class _Merged:
    """A merged frame on disk whose geometry is not known yet."""

    file: str
    group: tuple[Capture, ...]
    sighting: LightSighting
    clipped_share: float


@dataclass(frozen=True)
class MergePlan:
    """What all frames of a run share; with a frame's number it determines the frame.

    Attributes
    ----------
    groups : tuple of tuple of Capture
        Exposures of each frame.
    folder, output : Path
        Of the photographs and of the run.
    known : CameraCalibration
    balance : tuple of float
    common : str
        Digest of what all frames share.
    settings : MergeSettings
    """

    groups: tuple[tuple[Capture, ...], ...]
    folder: Path
    output: Path
    known: CameraCalibration
    balance: tuple[float, float, float]
    common: str
    settings: MergeSettings


@dataclass(frozen=True)
class FrameOutcome:
    """A frame that is merged or kept.

    Attributes
    ----------
    number : int
    merged : _Merged
    lines : tuple of str
        Lines for the user.
    """

    number: int
    merged: _Merged
    lines: tuple[str, ...]


Spread = Callable[[MergePlan, Sequence[int], int], Generator[FrameOutcome, None, None]]
"""Calls `merge_frame` for the numbers of frames, on at most a number of workers, and yields the outcomes."""


def merge_captures(
    captures: Sequence[Capture], folder: Path, output: Path, *, camera: CameraNoise | None = None,
    settings: MergeSettings = MergeSettings(), threads: int | None = None, progress: Progress | None = None,
    remarks: Sequence[str] = (),
    report: Report = lambda _: None, spread: Spread | None = None,
) -> MergedRun:  # fmt: skip
    """Merge all constellations, locate the light and the optical axis, and write the run.

    Parameters
    ----------
    captures : sequence of Capture
    folder : Path
        Folder of the photographs.
    output : Path
        Folder of the run; it is created if missing. Up-to-date frames in it are kept.
    camera : CameraNoise, optional
        Known values of the camera.
    settings : MergeSettings
    threads : int, optional
        All cores when None; the pixels do not depend on it.
    progress : callable, optional
        Called with the finished part (0 to 1) and a description.
    remarks : sequence of str
        Of the list of captures; the run keeps them.
    report : callable
        Called with a sentence for each frame of an earlier run that is damaged; it is merged again.
    spread : callable, optional
        Merges the frames elsewhere, such as on a cluster (`workflow.measure_merge`). None: on threads.

    Raises
    ------
    FlarewrightError
        When photographs cannot be read, differ in size, are saturated everywhere, contradict the list, or show no
        light or two lights; when `output` holds a run of other photographs.
    OutputError
        When the folder cannot be written or has too little space.
    """
    advance = progress or (lambda _part, _words: None)
    advance(0.0, "reading the photographs")
    known = calibrate(captures, folder, camera or CameraNoise(), settings.block, settings)
    groups = exposure_groups(captures)
    balance = _balance(settings, known, folder / groups[0][0].file)
    _refuse_other_run(output, folder, captures, known.size_px)
    output = _folder(output, len(groups), known.size_px)
    merged = _merge_all(groups, folder, output, known, balance, threads, advance, settings, report, spread)
    found = believable([one.sighting for one in merged], settings.geometry)
    advance(0.95, "axis")
    geometry = _geometry(merged, found, output, known, settings.geometry)
    refuse_second_light([one.sighting for one in merged], geometry, settings.light)
    run = with_drift_gains(output, _run(merged, geometry, known, balance, remarks), settings.drift)
    if settings.upright:
        run = make_upright(output, run, lambda part, words: advance(0.96 + 0.04 * part, words))
    write_run(output, run)
    _drop_stale(output, len(groups))
    advance(1.0, "merged")
    return run


def _balance(settings: MergeSettings, known: CameraCalibration, photograph: Path) -> tuple[float, float, float]:
    if isinstance(settings.white_balance, tuple):
        return settings.white_balance
    if settings.white_balance == "none":
        return 1.0, 1.0, 1.0
    if known.white_balance is None:
        raise FlarewrightError(
            f"{photograph} holds no white balance of its camera: give three factors, --white-balance 2,1,1.5"
        )
    return known.white_balance


def exposure_groups(captures: Sequence[Capture]) -> list[tuple[Capture, ...]]:
    """Return the exposures of each frame, in the order of roll and constellation angle."""
    groups: dict[tuple[float, float], list[Capture]] = {}
    for one in captures:
        if one.kind == "light":
            groups.setdefault((one.roll_deg, one.constellation_deg or 0.0), []).append(one)
    return [tuple(groups[key]) for key in sorted(groups)]


def _folder(output: Path, frames: int, size_px: tuple[int, int]) -> Path:
    """Create the run's folder and check that the frames fit on the disk."""
    if output.exists() and not output.is_dir():
        raise OutputError(f"{output} is a file; give a folder for the run")
    try:
        (output / FRAMES).mkdir(parents=True, exist_ok=True)
        free = shutil.disk_usage(output).free
    except OSError as error:
        raise OutputError(f"cannot make the folder {output}: {(error.strerror or str(error)).lower()}") from None
    missing = frames - len(list((output / FRAMES).glob("frame-*.exr")))
    needed = max(missing, 0) * size_px[0] * size_px[1] * 6 * 4
    if needed > free:
        raise OutputError(
            f"{output} has {free / 1e9:.2g} GB left, and {count(missing, 'frame')} may need {needed / 1e9:.2g} GB: "
            "free some space, choose another folder, or average pixels with --block 2"
        )
    return output


def _origin(folder: Path, captures: Iterable[Capture]) -> dict[str, Any]:
    """Return an identity of photographs: their folder, names, sizes and times."""
    stamps = [(one.file, (folder / one.file).stat()) for one in captures]
    return {"folder": _digest(str(folder.resolve())), "files": [[n, s.st_size, s.st_mtime_ns] for n, s in stamps]}


def _refuse_other_run(output: Path, folder: Path, captures: Sequence[Capture], size_px: tuple[int, int]) -> None:
    """Raise when the folder holds a run of other photographs, whose ghosts would be attributed to these ones.

    The list can gain or lose photographs, and photographs can be moved, or converted again in the same folder.
    """
    origins = [note["from"] for path in (output / FRAMES).glob("frame-*.json") if "from" in (note := read_note(path))]
    here = _origin(folder, captures)
    files = {tuple(one) for one in here["files"]}
    names = {name for name, *_ in files}
    for one in origins:
        known = {tuple(stamp) for stamp in one["files"]}
        if known & files or (one["folder"] == here["folder"] and names & {name for name, *_ in known}):
            return
    other = origins[0]["files"][0][0] if origins else _other_size(output, size_px)
    if other is not None:
        raise FlarewrightError(
            f"{output} holds the run of other photographs ({other}): choose another folder, or remove that one first"
        )


def _other_size(output: Path, size_px: tuple[int, int]) -> str | None:
    """Return the size of a run without notes of its photographs, when it differs from `size_px`."""
    try:
        width, height = read_run(output).size_px
    except FlarewrightError:
        return None
    return None if (width, height) == size_px else f"{width}x{height} pixels"


def _drop_stale(output: Path, frames: int) -> None:
    """Remove frames of constellations that are not in the list any more."""
    for path in (*(output / FRAMES).glob("frame-*"), *(output / UPRIGHT).glob("frame-*")):
        number = path.stem.removeprefix("frame-")
        if path.suffix in (".exr", ".json") and number.isdecimal() and int(number) >= frames:
            path.unlink()


def _merge_all(
    groups: Sequence[tuple[Capture, ...]], folder: Path, output: Path, known: CameraCalibration,
    balance: tuple[float, float, float], threads: int | None, progress: Progress, settings: MergeSettings,
    report: Report, spread: Spread | None,
) -> list[_Merged]:  # fmt: skip
    # what follows the frames is not in their digest; white balance and block are in `balance` and `known`
    steering = MergeSettings(calibration=settings.calibration, exposures=settings.exposures, light=settings.light)
    common = _digest([
        _VERSION, known.camera.model_dump(exclude=OF_LIGHT), known.white, known.step, balance, known.size_px,
        known.block, _array_digest(known.black), _array_digest(known.response),
        *(() if steering == MergeSettings() else (repr(steering),)),
    ])  # fmt: skip
    plan = MergePlan(tuple(groups), folder, output, known, balance, common, settings)
    merged: dict[int, _Merged] = {}
    fitting = max(1, int(_WORKING_BYTES / (_PIXEL_BYTES * known.size_px[0] * known.size_px[1])))
    workers = min(threads or os.cpu_count() or 1, fitting)
    with closing((spread or _on_threads)(plan, range(len(groups)), workers)) as outcomes:
        for one in outcomes:
            for line in one.lines:
                report(line)
            merged[one.number] = one.merged
            progress(0.02 + 0.93 * len(merged) / len(groups), f"frame {len(merged)} of {len(groups)}")
    return [merged[k] for k in range(len(groups))]


def _on_threads(plan: MergePlan, numbers: Sequence[int], workers: int) -> Generator[FrameOutcome, None, None]:
    with ThreadPoolExecutor(max_workers=workers) as pool:
        jobs = [pool.submit(merge_frame, plan, number) for number in numbers]
        try:
            for job in as_completed(jobs):
                yield job.result()
        except BaseException:
            # an interrupt or a damaged file: cancel the frames that have not started
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def merge_frame(plan: MergePlan, number: int, writing: AbstractContextManager[object] = nullcontext()) -> FrameOutcome:
    """Merge one constellation, or return the frame of an earlier run if it is up to date.

    Parameters
    ----------
    plan : MergePlan
    number : int
        Of the frame.
    writing : context manager
        Entered while files are written: a lock of a process that must not end meanwhile.

    Raises
    ------
    FlarewrightError
        As of `merge_captures`.
    """
    group, folder, output, known, settings = plan.groups[number], plan.folder, plan.output, plan.known, plan.settings
    file, lines = f"{FRAMES}/frame-{number:03d}.exr", list[str]()
    note = output / f"{FRAMES}/frame-{number:03d}.json"
    stamps = [(folder / one.file).stat() for one in group]
    digest = _digest([plan.common, [one.model_dump() for one in group], [(s.st_size, s.st_mtime_ns) for s in stamps]])
    kept = _kept_sighting(note, digest, output / file, lines.append)
    if kept is not None:
        return FrameOutcome(number, _Merged(file, group, kept, kept.clipped_share), tuple(lines))
    shots = [known.exposure(open_photo(folder / one.file, _white_of(known), known.block), one) for one in group]
    for one in shots:
        refuse_damage(one, settings=settings.exposures)
    refuse_contradiction(shots, settings=settings.exposures)
    ratios = exposure_ratios(shots, settings=settings.exposures)
    shots = [replace(one, seconds=one.seconds * ratio.value) for one, ratio in zip(shots, ratios, strict=True)]
    mean, variance = merge_exposures(shots, settings=settings.exposures)
    # unit: a radiance of 1 saturates the sensor in one second
    full = float(np.mean(shots[0].full)) if np.isfinite(known.white) else 1.0
    scale = np.asarray(plan.balance, np.float32) / np.float32(full)
    mean, variance = without_idle_digits(mean * scale, variance * scale**2)
    sighting = _with_given_light(find_light(mean, variance, settings.light), group, known, settings.light)
    info = FrameInfo(file=file, constellation_deg=group[0].constellation_deg or 0.0, nominal_deg=0.0,
                     light_px=sighting.position_px, axis_px=(0.0, 0.0))  # fmt: skip
    with writing:
        # the index of an earlier merge describes other pixels
        remove_index(output)
        write_frame(output, MergedFrame(info, mean, variance))
        facts = {
            "digest": digest, "sha256": digest_of(output / file), "sighting": asdict(sighting),
            "ratios": [asdict(one) for one in ratios], "from": _origin(folder, group),
        }  # fmt: skip
        write_text_atomically(note, json.dumps(facts) + "\n")
    return FrameOutcome(number, _Merged(file, group, sighting, sighting.clipped_share), tuple(lines))


def _with_given_light(
    sighting: LightSighting, group: Sequence[Capture], known: CameraCalibration, settings: LightSettings
) -> LightSighting:
    """Return the light position that the user gives for one of the captures, otherwise the detected one."""
    for one in group:
        if one.light_x_px is None or one.light_y_px is None:
            continue
        x, y = one.light_x_px / known.side, one.light_y_px / known.side
        width, height = known.size_px
        if not (0.0 <= x <= width and 0.0 <= y <= height):
            raise FlarewrightError(
                f"light_x_px, light_y_px of {one.file} is ({one.light_x_px:g}, {one.light_y_px:g}), outside of its "
                f"{width * known.side}x{height * known.side} pixels; leave them empty where the light is not in it"
            )
        return replace(
            sighting, position_px=(x, y), error_px=settings.given_light_error_px, at_border=False, rival_px=None,
            other_px=None, given=True,
        )  # fmt: skip
    return sighting


def _white_of(known: CameraCalibration) -> float | None:
    return known.white if np.isfinite(known.white) else None


def _digest(facts: Any) -> str:
    return hashlib.sha256(json.dumps(facts, sort_keys=True, default=str).encode()).hexdigest()


def _array_digest(array: np.ndarray[Any, Any] | None) -> str:
    return "" if array is None else hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()


def _kept_sighting(note: Path, digest: str, frame: Path, report: Report) -> LightSighting | None:
    """Return the sighting in a frame's note if the digest matches and the frame's file is whole."""
    try:
        data = read_note(note)
        if data["digest"] != digest:
            return None
        size = frame.stat().st_size
        # earlier releases noted the number of bytes
        whole = digest_of(frame) == data["sha256"] if "sha256" in data else data.get("bytes", size) == size
        if not whole:
            report(f"{frame} is damaged or was changed; it is merged again")
            return None
        facts = {"other_px": None, **data["sighting"]}
        places = {
            name: None if (pair := facts[name]) is None else (float(pair[0]), float(pair[1]))
            for name in ("position_px", "rival_px", "other_px")
        }
        return LightSighting(**{**facts, **places})
    except (OSError, ValueError, KeyError, TypeError, IndexError):
        return None


def _geometry(
    merged: Sequence[_Merged], found: Sequence[bool], output: Path, known: CameraCalibration, settings: GeometrySettings
) -> Geometry:
    seen = [
        SightingInput(one.group[0].constellation_deg or 0.0, one.group[0].roll_deg,
             one.sighting.position_px if visible else None, one.sighting.error_px)
        for one, visible in zip(merged, found, strict=True)
    ]  # fmt: skip
    visible = [one for one, there in zip(merged, found, strict=True) if there]

    def across(foot: tuple[float, float], normal: tuple[float, float]) -> tuple[float, float] | None:
        arms = [hypot(one.sighting.position_px[0] - foot[0], one.sighting.position_px[1] - foot[1]) for one in visible]
        far: list[_Merged] = []
        for least in settings.least_off_axis:
            if len(far) < 4:
                far = [one for one, arm in zip(visible, arms, strict=True) if arm > least * known.size_px[0]]
        frames = []
        for one in evenly_spaced(far, settings.mirror_frames):
            info = FrameInfo(file=one.file, constellation_deg=0.0, nominal_deg=0.0, light_px=one.sighting.position_px,
                             axis_px=foot)  # fmt: skip
            frame = read_frame(output, info)
            frames.append(reduced_frame(frame.radiance, frame.variance, one.sighting.position_px, settings))
        return axis_beside_path(frames, foot, normal, settings)

    focal, pitch = _first_known(capture.focal_mm for one in merged for capture in one.group), known.camera.pitch_um
    focal_px = focal * 1000.0 / (pitch * known.side) if focal is not None and pitch is not None else None
    return solve_geometry(seen, known.size_px, across, focal_px, settings)


def _run(
    merged: Sequence[_Merged], geometry: Geometry, known: CameraCalibration, balance: tuple[float, float, float],
    remarks: Sequence[str],
) -> MergedRun:  # fmt: skip
    frames, pitch = [], known.camera.pitch_um
    for one, placed in zip(merged, geometry.placed, strict=True):
        first = one.group[0]
        frames.append(
            FrameInfo(
                file=one.file, constellation_deg=placed.constellation_deg,
                nominal_deg=first.constellation_deg or 0.0, roll_deg=placed.roll_deg, nominal_roll_deg=first.roll_deg,
                light_px=placed.light_px, light_error_px=placed.light_error_px, light_found=placed.light_found,
                axis_px=geometry.axis_px, iso=first.iso,
                f_number=_first_known(capture.f_number for capture in one.group),
                exposures_s=tuple(capture.exposure_s for capture in one.group),
                focal_mm=_first_known(capture.focal_mm for capture in one.group), clipped_share=one.clipped_share,
            )
        )  # fmt: skip
    return MergedRun(
        size_px=known.size_px, frames=tuple(frames), axis_px=geometry.axis_px, axis_error_px=geometry.axis_error_px,
        px_per_rad=geometry.px_per_rad, camera=known.camera, reference_iso=known.camera.iso,
        sensor_width_mm=None if pitch is None else 1e-3 * pitch * known.side * known.size_px[0],
        reference_f_number=_first_known(capture.f_number for one in merged for capture in one.group),
        white_balance=balance,
        to_rec709=_to_rec709(known, balance), remarks=(*remarks, *known.remarks, *geometry.remarks),
    )  # fmt: skip


def _first_known(values: Iterable[float | None]) -> float | None:
    """Return the first value that is not None."""
    return next((value for value in values if value is not None), None)


def _to_rec709(known: CameraCalibration, balance: tuple[float, float, float]) -> Matrix3 | None:
    """Return the photographs' colour matrix for values multiplied by a white balance."""
    if known.to_rec709 is None:
        return None
    red, green, blue = ((row[0] / balance[0], row[1] / balance[1], row[2] / balance[2]) for row in known.to_rec709)
    return red, green, blue


def check_same_run(output: Path) -> None:
    """Raise when a folder holds something else than a run.

    Raises
    ------
    FlarewrightError
        When the folder is not empty and holds no run.
    """
    if output.is_dir() and any(output.iterdir()) and not (output / FRAMES).is_dir():
        raise FlarewrightError(f"{output} is not empty and holds no run; choose another folder")
