"""The merge stage: from a list of photographs to a folder of merged frames with their geometry.

Each frame is written as soon as it is merged, with a note of what it was made from beside it; a stopped run takes those
up again whose photographs and settings are the same.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from math import hypot
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..errors import FlarewrightError, OutputError
from ..io.atomic import write_atomically
from ..io.merged import read_frame, read_run, write_frame, write_run
from ..io.photo import open_photo
from ..io.sentences import count
from ..model.capture import OF_LIGHT, CameraNoise, Capture, FrameInfo, Matrix3, MergedFrame, MergedRun
from .calibrate import Calibration, calibrate
from .contradiction import refuse_contradiction
from .drift import without_drift
from .evenly import evenly
from .geometry import Geometry, Seen, believable, solve_geometry
from .light import Sighting, find_light
from .merge import exposure_ratios, merge, refuse_damage, without_idle_digits
from .second_light import refuse_second_light
from .symmetry import axis_beside_path, reduced
from .upright import UPRIGHT, make_upright

FRAMES = "frames"
# raise when the same photographs give other pixels, or another place of the light
_VERSION = 3
Progress = Callable[[float, str], None]

# a light that a person points at is taken to be right within this, pixels
_POINTED = 0.5
# bytes of a pixel while its frame is merged (50 megapixels of RAW took 1.5 GB), and of all frames at work together
_PIXEL_BYTES, _WORKING_BYTES = 124, 4e9

# frames compared for the mirror line, and the part of the width by which the light is off the axis in them
_MIRRORED, _OFF_AXIS = 12, (0.15, 0.08)


@dataclass(frozen=True)
class MergeSettings:
    """Choices of merging.

    Attributes
    ----------
    block : int
        Average so many by so many pixels into one.
    white_balance : {"none", "camera"} or tuple of float
        What red, green and blue are multiplied by: nothing, what the camera says, or these.
    upright : bool
        Whether frames are turned so that the horizon's tilt is out of their pixels.
    """

    block: int = 1
    white_balance: Literal["none", "camera"] | tuple[float, float, float] = "none"
    upright: bool = False


@dataclass(frozen=True)
class _Merged:
    """A frame on disk, before its geometry is known."""

    file: str
    group: tuple[Capture, ...]
    sighting: Sighting
    clipped_share: float


def merge_captures(
    captures: Sequence[Capture],
    folder: Path,
    output: Path,
    *,
    camera: CameraNoise | None = None,
    settings: MergeSettings | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> MergedRun:
    """Merge all constellations, find the light and the axis, and write everything.

    Parameters
    ----------
    captures : sequence of Capture
    folder : Path
        Where their files are.
    output : Path
        The run's folder; made when it is not there. Frames already in it that fit are kept.
    camera : CameraNoise, optional
        What is known of the camera.
    settings : MergeSettings, optional
    threads : int, optional
        All cores when None; the pixels do not depend on it.
    progress : callable, optional
        Called with the finished part (0 to 1) and what was finished.

    Returns
    -------
    MergedRun

    Raises
    ------
    FlarewrightError
        When photographs cannot be read, are of several sizes, saturated everywhere, or not what the list says, or show
        no light or two; when `output` holds the run of others.
    OutputError
        When the folder cannot be written or is too small.
    """
    chosen = settings or MergeSettings()
    tell = progress or (lambda _part, _words: None)
    tell(0.0, "looking at the photographs")
    known = calibrate(captures, folder, camera or CameraNoise(), chosen.block)
    groups = _groups(captures)
    balance = _balance(chosen, known, folder / groups[0][0].file)
    _refuse_other_run(output, folder, captures, known.size_px)
    output = _folder(output, len(groups), known.size_px)
    merged = _merge_all(groups, folder, output, known, balance, threads, tell)
    found = believable([one.sighting for one in merged])
    tell(0.95, "axis")
    geometry = _geometry(merged, found, output, known)
    refuse_second_light([one.sighting for one in merged], geometry)
    run = without_drift(output, _run(merged, geometry, known, balance))
    if chosen.upright:
        run = make_upright(output, run, lambda part, words: tell(0.96 + 0.04 * part, words))
    write_run(output, run)
    _drop_stale(output, len(groups))
    tell(1.0, "merged")
    return run


def _balance(settings: MergeSettings, known: Calibration, photograph: Path) -> tuple[float, float, float]:
    if isinstance(settings.white_balance, tuple):
        return settings.white_balance
    if settings.white_balance == "none":
        return 1.0, 1.0, 1.0
    if known.white_balance is None:
        raise FlarewrightError(
            f"{photograph} does not tell its camera's white balance: give three factors, --white-balance 2,1,1.5"
        )
    return known.white_balance


def _groups(captures: Sequence[Capture]) -> list[tuple[Capture, ...]]:
    """Return the exposures of each constellation, by roll and angle."""
    groups: dict[tuple[float, float], list[Capture]] = {}
    for one in captures:
        if one.kind == "light":
            groups.setdefault((one.roll_deg, one.constellation_deg or 0.0), []).append(one)
    return [tuple(groups[key]) for key in sorted(groups)]


def _folder(output: Path, frames: int, size_px: tuple[int, int]) -> Path:
    """Make the run's folder and see that the frames fit on the disk."""
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
    """Return what photographs are known by: their folder, names, sizes and times."""
    stamps = [(one.file, (folder / one.file).stat()) for one in captures]
    return {"folder": _digest(str(folder.resolve())), "files": [[n, s.st_size, s.st_mtime_ns] for n, s in stamps]}


def _refuse_other_run(output: Path, folder: Path, captures: Sequence[Capture], size_px: tuple[int, int]) -> None:
    """Refuse a folder with the run of other photographs: ghosts that were found in those would pass for these ones'.

    A list may grow and shrink, photographs may move, and be converted anew where they are.
    """
    origins = [note["from"] for path in (output / FRAMES).glob("frame-*.json") if "from" in (note := _noted(path))]
    here = _origin(folder, captures)
    files = {tuple(one) for one in here["files"]}
    names = {name for name, *_ in files}
    for one in origins:
        known = {tuple(stamp) for stamp in one["files"]}
        if known & files or (one["folder"] == here["folder"] and names & {name for name, *_ in known}):
            return
    told = origins[0]["files"][0][0] if origins else _other_size(output, size_px)
    if told is not None:
        raise FlarewrightError(
            f"{output} holds the run of other photographs ({told}): choose another folder, or remove that one first"
        )


def _other_size(output: Path, size_px: tuple[int, int]) -> str | None:
    """Return the size of a run that notes no photographs, when it is another."""
    try:
        width, height = read_run(output).size_px
    except FlarewrightError:
        return None
    return None if (width, height) == size_px else f"{width}x{height} pixels"


def _drop_stale(output: Path, frames: int) -> None:
    """Remove frames of constellations that the list no longer has."""
    for path in (*(output / FRAMES).glob("frame-*"), *(output / UPRIGHT).glob("frame-*")):
        number = path.stem.removeprefix("frame-")
        if path.suffix in (".exr", ".json") and number.isdecimal() and int(number) >= frames:
            path.unlink()


def _merge_all(
    groups: Sequence[tuple[Capture, ...]], folder: Path, output: Path, known: Calibration,
    balance: tuple[float, float, float], threads: int | None, tell: Progress,
) -> list[_Merged]:  # fmt: skip
    common = _digest([
        _VERSION, known.camera.model_dump(exclude=OF_LIGHT), known.white, known.step, balance, known.size_px,
        known.block, _array_digest(known.black), _array_digest(known.response),
    ])  # fmt: skip
    merged: dict[int, _Merged] = {}
    fitting = max(1, int(_WORKING_BYTES / (_PIXEL_BYTES * known.size_px[0] * known.size_px[1])))
    with ThreadPoolExecutor(max_workers=min(threads or os.cpu_count() or 1, fitting)) as pool:
        jobs = {
            pool.submit(_frame, k, group, folder, output, known, balance, common): k for k, group in enumerate(groups)
        }
        try:
            for job in as_completed(jobs):
                merged[jobs[job]] = job.result()
                tell(0.02 + 0.93 * len(merged) / len(groups), f"frame {len(merged)} of {len(groups)}")
        except BaseException:
            # an interrupt or a broken file: what has not begun need not
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return [merged[k] for k in range(len(groups))]


def _frame(
    number: int, group: tuple[Capture, ...], folder: Path, output: Path, known: Calibration,
    balance: tuple[float, float, float], common: str,
) -> _Merged:  # fmt: skip
    """Merge one constellation, or take it up from an earlier run."""
    file = f"{FRAMES}/frame-{number:03d}.exr"
    note = output / f"{FRAMES}/frame-{number:03d}.json"
    stamps = [(folder / one.file).stat() for one in group]
    digest = _digest([common, [one.model_dump() for one in group], [(s.st_size, s.st_mtime_ns) for s in stamps]])
    kept = _kept(note, digest, output / file)
    if kept is not None:
        return _Merged(file, group, kept, kept.clipped_share)
    shots = [known.exposure(open_photo(folder / one.file, _white_of(known), known.block), one) for one in group]
    for one in shots:
        refuse_damage(one)
    refuse_contradiction(shots)
    ratios = exposure_ratios(shots)
    shots = [replace(one, seconds=one.seconds * ratio.value) for one, ratio in zip(shots, ratios, strict=True)]
    mean, variance = merge(shots)
    # 1 fills the sensor in a second
    full = float(np.mean(shots[0].full)) if np.isfinite(known.white) else 1.0
    scale = np.asarray(balance, np.float32) / np.float32(full)
    mean, variance = without_idle_digits(mean * scale, variance * scale**2)
    sighting = _pointed(find_light(mean, variance), group, known)
    info = FrameInfo(file=file, constellation_deg=group[0].constellation_deg or 0.0, nominal_deg=0.0,
                     light_px=sighting.position_px, axis_px=(0.0, 0.0))  # fmt: skip
    write_frame(output, MergedFrame(info, mean, variance))
    facts = {
        "digest": digest, "bytes": (output / file).stat().st_size, "sighting": asdict(sighting),
        "ratios": [asdict(one) for one in ratios], "from": _origin(folder, group),
    }  # fmt: skip
    write_atomically(note, lambda temporary: _write(temporary, json.dumps(facts) + "\n"))
    return _Merged(file, group, sighting, sighting.clipped_share)


def _pointed(sighting: Sighting, group: Sequence[Capture], known: Calibration) -> Sighting:
    """Return the light where a person says that it is, if one does."""
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
        return replace(sighting, position_px=(x, y), error_px=_POINTED, at_border=False, rival_px=None, other_px=None)
    return sighting


def _white_of(known: Calibration) -> float | None:
    return known.white if np.isfinite(known.white) else None


def _write(path: Path, text: str) -> None:
    path.write_text(text, "utf-8")


def _digest(facts: Any) -> str:
    return hashlib.sha256(json.dumps(facts, sort_keys=True, default=str).encode()).hexdigest()


def _array_digest(array: np.ndarray[Any, Any] | None) -> str:
    return "" if array is None else hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()


def _noted(note: Path) -> dict[str, Any]:
    """Return what was noted of a frame; nothing when that cannot be read."""
    try:
        data = json.loads(note.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}


def _kept(note: Path, digest: str, frame: Path) -> Sighting | None:
    """Return what an earlier run noted of a frame made from the same photographs in the same way, if it is whole."""
    try:
        data = _noted(note)
        size = frame.stat().st_size
        if data["digest"] != digest or data.get("bytes", size) != size:
            return None
        facts = {"other_px": None, **data["sighting"]}
        places = {
            name: None if (pair := facts[name]) is None else (float(pair[0]), float(pair[1]))
            for name in ("position_px", "rival_px", "other_px")
        }
        return Sighting(**{**facts, **places})
    except (OSError, ValueError, KeyError, TypeError, IndexError):
        return None


def _geometry(merged: Sequence[_Merged], found: Sequence[bool], output: Path, known: Calibration) -> Geometry:
    seen = [
        Seen(one.group[0].constellation_deg or 0.0, one.group[0].roll_deg,
             one.sighting.position_px if visible else None, one.sighting.error_px)
        for one, visible in zip(merged, found, strict=True)
    ]  # fmt: skip
    visible = [one for one, there in zip(merged, found, strict=True) if there]

    def across(foot: tuple[float, float], normal: tuple[float, float]) -> tuple[float, float] | None:
        arms = [hypot(one.sighting.position_px[0] - foot[0], one.sighting.position_px[1] - foot[1]) for one in visible]
        far: list[_Merged] = []
        for least in _OFF_AXIS:
            if len(far) < 4:
                far = [one for one, arm in zip(visible, arms, strict=True) if arm > least * known.size_px[0]]
        frames = []
        for one in evenly(far, _MIRRORED):
            info = FrameInfo(file=one.file, constellation_deg=0.0, nominal_deg=0.0, light_px=one.sighting.position_px,
                             axis_px=foot)  # fmt: skip
            frame = read_frame(output, info)
            frames.append(reduced(frame.radiance, frame.variance, one.sighting.position_px))
        return axis_beside_path(frames, foot, normal)

    focal, pitch = _first(capture.focal_mm for one in merged for capture in one.group), known.camera.pitch_um
    focal_px = focal * 1000.0 / (pitch * known.side) if focal is not None and pitch is not None else None
    return solve_geometry(seen, known.size_px, across, focal_px)


def _run(
    merged: Sequence[_Merged], geometry: Geometry, known: Calibration, balance: tuple[float, float, float]
) -> MergedRun:
    frames = []
    for one, placed in zip(merged, geometry.placed, strict=True):
        first = one.group[0]
        frames.append(
            FrameInfo(
                file=one.file, constellation_deg=placed.constellation_deg,
                nominal_deg=first.constellation_deg or 0.0, roll_deg=placed.roll_deg, nominal_roll_deg=first.roll_deg,
                light_px=placed.light_px, light_error_px=placed.light_error_px, light_found=placed.light_found,
                axis_px=geometry.axis_px, iso=first.iso, f_number=_first(capture.f_number for capture in one.group),
                exposures_s=tuple(capture.exposure_s for capture in one.group),
                focal_mm=_first(capture.focal_mm for capture in one.group), clipped_share=one.clipped_share,
            )
        )  # fmt: skip
    return MergedRun(
        size_px=known.size_px, frames=tuple(frames), axis_px=geometry.axis_px, axis_error_px=geometry.axis_error_px,
        px_per_rad=geometry.px_per_rad, camera=known.camera, reference_iso=known.camera.iso,
        reference_f_number=_first(capture.f_number for one in merged for capture in one.group), white_balance=balance,
        to_rec709=_to_rec709(known, balance), remarks=(*known.remarks, *geometry.remarks),
    )  # fmt: skip


def _first(values: Iterable[float | None]) -> float | None:
    """Return the first that is known."""
    return next((value for value in values if value is not None), None)


def _to_rec709(known: Calibration, balance: tuple[float, float, float]) -> Matrix3 | None:
    """Return the photographs' matrix for numbers that were multiplied by a white balance."""
    if known.to_rec709 is None:
        return None
    red, green, blue = ((row[0] / balance[0], row[1] / balance[1], row[2] / balance[2]) for row in known.to_rec709)
    return red, green, blue


def check_same_run(output: Path) -> None:
    """Refuse a folder that holds something else than a run.

    Raises
    ------
    FlarewrightError
        When it is not empty and no run.
    """
    if output.is_dir() and any(output.iterdir()) and not (output / FRAMES).is_dir():
        raise FlarewrightError(f"{output} is not empty and holds no run; choose another folder")
