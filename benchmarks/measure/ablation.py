"""Ablation of the residual between photographs: what each of its layers is worth in a replay.

    python -m benchmarks --only residual
    python -m benchmarks.measure --ablation [LENS ...]
    python -m benchmarks.measure --ablation LENS --layer spikes --width 720 --range 20 28 --count 27 --ghosts 20

A synthetic camera photographs each lens in pictures 240 pixels wide, at the even ones of 21 constellations half a
degree apart. Ghosts are found and fitted once. Then the residual is learned again without one layer at a time. Each
model replays the odd constellations, and a few others with the light in directions that no photograph showed. Baselines
need no model: both neighbouring photographs interpolated in place, and along their optical flow (`optical_flow`); for
other directions, the rotated photograph.

Every number is a peak signal-to-noise ratio against the noise-free truth outside 40 (of 720) pixels around the light:
in radiance, and in its logarithm, whose peak is the range of the truth's.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast
from unittest import mock

import numpy as np
from numpy.typing import NDArray
from synthetic_camera import Setup, ideal_frame, poses, scale_of, truth_of

from benchmarks.measure.judge import far_from
from benchmarks.measure.optical_flow import between
from benchmarks.measure.rolled import turned_photograph
from benchmarks.measure.shoot import run_of, setup_of
from flarewright.io.measurement.merged import write_frame
from flarewright.measure.core.views import View, views_of
from flarewright.measure.pipeline.find_stage import find_ghosts
from flarewright.measure.pipeline.fit_stage import fit_ghosts
from flarewright.measure.replay import model_image
from flarewright.measure.residual.learn import with_residual
from flarewright.model.measurement.capture import FrameInfo, MergedFrame
from flarewright.model.measurement.ghost_model import GhostModel
from flarewright.model.measurement.residual_motion import packed_moves
from flarewright.model.measurement.sprite import Sprite, encode_pictures
from flarewright.typing import Floats, Pixels, Report

LENSES = ("speed-panchro-50", "flektogon-35", "takumar-50-f1.4")
SCORES = ("between, linear", "between, log", "rolled, linear", "rolled, log")
# directions of the light that no photograph showed, and where, part of the constellations
ROLLS_DEG, AT = (40.0, 160.0), (0.3, 0.7)
_LEARN, _REPLAY = "flarewright.measure.residual", "flarewright.measure.replay"


@dataclass(frozen=True)
class Series:
    """How a lens is photographed, and how many of its ghosts are searched."""

    width: int = 240
    # number of constellations, and the first and the last
    count: int = 21
    range_deg: tuple[float, float] = (4.0, 14.0)
    # a fit of all ghosts would take minutes
    most_ghosts: int = 12


def _at_rest(model: GhostModel, _threads: int | None = None, block: int = 4) -> GhostModel:
    """Return a model whose residual has no measured motion."""

    def still(one: Sprite) -> Sprite:
        if one.follows != "ghosts" or len(one.constellation_deg) < 3:
            return one
        shape = len(one.constellation_deg) - 1, 2, -(-one.rows // block), -(-one.columns // block)
        return cast(Sprite, one.replace(moves=packed_moves(block, np.zeros((*shape, 3)), np.zeros(shape))))

    return cast(GhostModel, model.replace(sprites=tuple(map(still, model.sprites))))


def _empty(*_: object) -> Sprite:
    """Return a sprite about the axis without light."""
    unit, cells = encode_pictures(np.zeros((1, 1, 1, 3), np.float32), 1.0)
    return Sprite(
        follows="axis", grain_px=1.0, corner_px=(0.0, 0.0), constellation_deg=(0.0,), rows=1, columns=1, unit=unit,
        cells=cells,
    )  # fmt: skip


def _unsmoothed(costs: Pixels, _around: object, _step: float, _leap: float, sums: Pixels) -> None:
    sums[:] = costs


LAYERS: dict[str, dict[str, Callable[..., Any]]] = {
    "sprites with the light": {f"{_LEARN}.learn.light_sprites": lambda *_: ()},
    "sprite about the axis": {f"{_LEARN}.learn.axis_sprite": _empty},
    "spikes": {f"{_LEARN}.learn.spike_sprites": lambda *_: ()},
    "motion warp": {f"{_LEARN}.learn.with_moves": _at_rest},
    "its agreement": {f"{_LEARN}.motion_fit.agree": _unsmoothed},
    "clamping": {f"{_LEARN}.learn.with_reaches": lambda model, *_: model},
    "its filled holes": {f"{_REPLAY}.clamping._closed": lambda pixels, _: pixels},
    "fine detail": {f"{_LEARN}.learn.with_detail": lambda model, *_: model},
}  # fmt: skip
"""What to replace in the program to leave out each layer of the residual."""


@dataclass(frozen=True)
class Held:
    """A view that no photograph showed: where the light is, the true picture, and the model-free replays by name."""

    constellation_deg: float
    roll_deg: float
    total: Pixels
    counts: NDArray[np.bool_]
    rolled: bool
    free: dict[str, Pixels]


@dataclass(frozen=True)
class Case:
    """A lens with its photographs, the model of its ghosts without a residual, and what a replay must show."""

    views: tuple[View, ...]
    model: GhostModel
    held: tuple[Held, ...]
    floor: float


def setup_between(lens: str, series: Series = Series()) -> Setup:
    """Return a camera behind an iris of eight blades, its captures a degree apart unless the series says otherwise."""
    angles = tuple(np.round(np.linspace(*series.range_deg, series.count), 6).tolist())
    return replace(setup_of(lens, series.width, series.count), angles_deg=angles, blades=8)


def case_of(setup: Setup, folder: Path, tell: Report, most_ghosts: int = Series.most_ghosts) -> Case:
    """Photograph a lens, find and fit its ghosts."""
    scale = scale_of(setup)
    frames: list[MergedFrame] = []
    odd: list[tuple[Any, Any, float]] = []
    (folder / "frames").mkdir(parents=True)
    for pose in poses(setup):
        truth = truth_of(setup, pose, scale)
        frame = ideal_frame(setup, truth, pose)
        if pose.number % 2:
            odd.append((frame.info, truth, False))
            continue
        info = cast(FrameInfo, frame.info.replace(file=f"frames/{pose.number:03d}.exr"))
        frames.append(replace(frame, info=info))
        write_frame(folder, frames[-1])
    angles = tuple(setup.angles_deg[int(part * len(setup.angles_deg))] for part in AT)
    for roll in ROLLS_DEG:
        still = replace(setup.steady, haze=setup.haze, veil=setup.veil, angles_deg=angles, roll_deg=roll)
        for pose in poses(still):
            truth = truth_of(still, pose, scale)
            odd.append((ideal_frame(still, truth, pose).info, truth, True))
    tell(f"{setup.lens}: photographed")
    run = run_of(setup, tuple(frame.info for frame in frames))
    model = fit_ghosts(folder, run, find_ghosts(folder, run, max_ghosts=most_ghosts), extra_searches=0, residual=False)
    tell(f"{setup.lens}: {len(model.ghosts)} ghosts fitted")
    known = np.concatenate([frame.variance[np.isfinite(frame.variance)] for frame in frames])
    floor = float(np.sqrt(np.median(known)))
    held = tuple(_held(info, truth, rolled, frames, floor) for info, truth, rolled in odd)
    return Case(views_of(frames), model, held, floor)


def _held(info: FrameInfo, truth: Any, rolled: bool, frames: Sequence[MergedFrame], floor: float) -> Held:
    size = truth.total.shape[1], truth.total.shape[0]
    counts = far_from(truth.light_px, size) & far_from(truth.image_px, size)
    constellation = info.constellation_deg
    if rolled:
        nearest = min(frames, key=lambda frame: abs(frame.info.constellation_deg - constellation))
        free = {"rotated photograph": turned_photograph(nearest, info.roll_deg)[0]}
    else:
        one = max((f for f in frames if f.info.nominal_deg < info.nominal_deg), key=lambda f: f.info.nominal_deg)
        other = min(
            (f for f in frames if f.info.nominal_deg > info.nominal_deg), key=lambda f: f.info.nominal_deg, default=one
        )
        counts = counts & np.isfinite(one.variance).all(axis=2) & np.isfinite(other.variance).all(axis=2)
        free = _interpolations(one, other, constellation, floor)
    return Held(constellation, info.roll_deg, truth.total, counts, rolled, free)


def _interpolations(one: MergedFrame, other: MergedFrame, constellation_deg: float, floor: float) -> dict[str, Pixels]:
    """Return what both photographs give without a model."""
    if one is other:
        return {}
    angles = one.info.constellation_deg, other.info.constellation_deg
    part = float(np.clip((constellation_deg - angles[0]) / (angles[1] - angles[0]), 0.0, 1.0))
    pair = [frame.radiance.astype(np.float64) for frame in (one, other)]
    logs = tuple(_log(each[..., 1], floor) for each in pair)
    return {
        "interpolation": ((1.0 - part) * pair[0] + part * pair[1]).astype(np.float32),
        "optical flow": between(*pair, cast(tuple[Floats, Floats], logs), part).astype(np.float32),
    }


def _log(light: Floats | Pixels, floor: float) -> Floats:
    return np.asarray(np.log(np.maximum(light, 0.0) + floor), dtype=np.float64)


def scores(case: Case, replay: Callable[[Held], Pixels | None]) -> dict[str, float]:
    """Return peak signal-to-noise ratios, dB, of the held-out views: between photographs, and rolled."""
    found = {}
    for kind in (False, True):
        views = [(held, picture) for held in case.held if held.rolled == kind and (picture := replay(held)) is not None]
        if not views:
            continue
        for name in ("linear", "log"):
            of = partial(_log, floor=case.floor) if name == "log" else np.asarray
            errors, true = zip(*(
                ((of(picture) - of(held.total))[held.counts], of(held.total)[held.counts]) for held, picture in views
            ), strict=True)  # fmt: skip
            square = float(np.mean(np.concatenate(errors).astype(np.float64) ** 2))
            lights = np.concatenate(true)
            peak = float(lights.max()) if name == "linear" else float(np.ptp(lights))
            found[f"{'rolled' if kind else 'between'}, {name}"] = float(10.0 * np.log10(peak**2 / square))
    return found


def ablate(case: Case, tell: Report, layers: Sequence[str] = tuple(LAYERS)) -> dict[str, dict[str, float]]:
    """Return the scores of a case by row of the table, without each of these layers in turn."""

    def of(model: GhostModel) -> Callable[[Held], Pixels]:
        model_image._photographed.cache_clear()
        return lambda held: model_image.replay_model(model, held.constellation_deg, roll_deg=held.roll_deg)[0].pixels

    rows = {}
    for name in ("interpolation", "optical flow", "rotated photograph"):
        rows[name] = scores(case, lambda held, name=name: held.free.get(name))  # type: ignore[misc]
    rows["no residual"] = scores(case, of(case.model))
    for name, parts in {"all layers": {}, **{f"without {layer}": LAYERS[layer] for layer in layers}}.items():
        start = time.process_time()
        with ExitStack() as stack:
            for target, other in parts.items():
                stack.enter_context(mock.patch(target, other))
            rows[name] = scores(case, of(with_residual(case.model, case.views)))
        tell(f"  {name}: {time.process_time() - start:.0f} CPU s")
    return rows


def ablation(
    tell: Report, lenses: Sequence[str] = LENSES, series: Series = Series(), layers: Sequence[str] = tuple(LAYERS)
) -> list[dict[str, Any]]:
    """Return the scores of lenses, by row of the table."""
    rows: list[dict[str, Any]] = []
    for lens in lenses:
        with tempfile.TemporaryDirectory() as made:
            case = case_of(setup_between(lens, series), Path(made) / "run", tell, series.most_ghosts)
        rows.append({"lens": Path(lens).stem, "PSNR, dB": ablate(case, tell, layers)})
    return rows


def ablation_rows(row: Callable[..., dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the means over all lenses, for the table of `benchmarks.run`; print the table of all lenses."""
    rows = ablation(lambda _: None)
    print(table(rows))
    return [
        row("residual", f"{name}, {score}", float(np.mean([each["PSNR, dB"][name][score] for each in rows])), "dB")
        for name, found in rows[0]["PSNR, dB"].items() for score in found
    ]  # fmt: skip


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the scores as a table: one row a replay, one column a lens, then the mean and its loss to all layers."""
    lines = []
    for score in SCORES:
        lines.append(f"{score:32}" + "".join(f"{row['lens'][:12]:>14}" for row in rows) + f"{'mean':>8}{'loss':>8}")
        whole = np.mean([row["PSNR, dB"]["all layers"][score] for row in rows])
        for name, values in rows[0]["PSNR, dB"].items():
            if score in values:
                each = [row["PSNR, dB"][name][score] for row in rows]
                lines.append(
                    f"{name:32}" + "".join(f"{one:14.2f}" for one in each)
                    + f"{np.mean(each):8.2f}{whole - np.mean(each):8.2f}"
                )  # fmt: skip
    return "\n".join(lines)
