"""Compare a ghost model with the noise-free truth, at constellations that the fit did not use."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from benchmarks.measure.shoot import read_ghosts, read_poses, read_truth
from benchmarks.measure.truth import TrueGhost, footprint
from flarewright.io.measurement.merged import read_frame
from flarewright.measure.glow.laws import offsets
from flarewright.measure.replay.model_image import draw, replay_model
from flarewright.model.measurement.capture import MergedFrame, MergedRun
from flarewright.model.measurement.ghost_model import GhostModel

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# radius around the light that is left out, part of the picture's width
AROUND_LIGHT = 40.0 / 720.0
SEEN, SHARP = 3.0, 5.0
# least common part of the union of two footprints that belong to one ghost
SAME = 0.5
# a fragment: least part of it inside the true ghost, and largest ratio of their brightness there
INSIDE, AS_BRIGHT = 0.7, 2.5
# least common part of the union of two paths' footprints, wherever both are visible, that no camera can separate
COINCIDE = 0.9
CLASSES = ("clean", "fold", "cut", "at the edge", "outshone")


@dataclass(frozen=True)
class FoundGhost:
    """A ghost of a model at one constellation: its footprint in the whole picture, and its brightness."""

    name: str
    mask: Mask
    level: float


@dataclass
class Tally:
    """Counts over all constellations, by class of the true ghost.

    `found` counts ghosts of a model, with fragments merged, that belong to a true ghost of a class; `good` those of
    them whose footprint matches; `strange` those of no true ghost. `apart` and `met_apart` count true ghosts, with
    coinciding paths as one. `near` counts true ghosts that share their footprint with any found ghost, which can belong
    to another one; no target uses it.
    """

    true: dict[str, int] = field(default_factory=lambda: dict.fromkeys(CLASSES, 0))
    met: dict[str, int] = field(default_factory=lambda: dict.fromkeys(CLASSES, 0))
    near: dict[str, int] = field(default_factory=lambda: dict.fromkeys(CLASSES, 0))
    found: dict[str, int] = field(default_factory=lambda: dict.fromkeys(CLASSES, 0))
    good: dict[str, int] = field(default_factory=lambda: dict.fromkeys(CLASSES, 0))
    strange: int = 0
    pieces: int = 0
    apart: int = 0
    met_apart: int = 0
    centres: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in CLASSES})
    squares: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    ssim: list[tuple[float, float]] = field(default_factory=list)

    def add_squares(self, name: str, model: float, interpolated: float) -> None:
        self.squares.setdefault(name, []).append((model, interpolated))


def class_of(ghost: TrueGhost) -> str:
    """Return the class of a ghost: its worst difficulty."""
    if ghost.fold:
        return "fold"
    if ghost.cut:
        return "cut"
    if ghost.at_edge:
        return "at the edge"
    return "outshone" if ghost.crossing else "clean"


def judge(model: GhostModel, folder: Path, run_folder: Path, run: MergedRun) -> dict[str, Any]:
    """Compute the scores of a model.

    Parameters
    ----------
    model : GhostModel
        Fitted at the even constellations.
    folder : Path
        Folder filled by `shoot`.
    run_folder, run
        Merged even constellations, the input of the interpolation.

    Returns
    -------
    dict
    """
    tally = Tally()
    infos = sorted(run.frames, key=lambda info: info.nominal_deg)
    frames: dict[str, MergedFrame] = {}
    twins = coinciding(folder)
    for pose in read_poses(folder):
        if not pose["number"] % 2:
            continue
        total, sigma = read_truth(folder, pose["number"])
        around = [info for info in infos if abs(info.nominal_deg - pose["nominal_deg"]) < 0.31 * 3]
        below = [info for info in around if info.nominal_deg < pose["nominal_deg"]]
        above = [info for info in around if info.nominal_deg > pose["nominal_deg"]]
        far = far_from(pose["light_px"], run.size_px) & far_from(pose["image_px"], run.size_px)
        picture = replay_model(model, pose["constellation_deg"], roll_deg=pose["roll_deg"])[0].pixels
        if below and above:
            pair = [frames.setdefault(info.file, read_frame(run_folder, info)) for info in (below[-1], above[0])]
            frames = {one.info.file: one for one in pair}
            _judge_picture(picture, total, sigma, pair, pose, far, tally)
        ghosts = read_ghosts(folder, pose["number"])
        if ghosts is not None:
            _judge_ghosts(ghosts, found_ghosts(model, pose, sigma, far), far, twins, tally)
    return summary(tally)


def far_from(place_px: tuple[float, float], size_px: tuple[int, int]) -> Mask:
    """Return which pixels are far enough from a place to count."""
    return np.asarray(np.hypot(*offsets(tuple(place_px), size_px, 1.0)) > AROUND_LIGHT * size_px[0])


def _judge_picture(
    picture: NDArray[np.float32], total: NDArray[np.float32], sigma: NDArray[np.float32],
    pair: list[MergedFrame], pose: dict[str, Any], far: Mask, tally: Tally,
) -> None:  # fmt: skip
    one, other = pair
    a, b = one.info.constellation_deg, other.info.constellation_deg
    part = float(np.clip((pose["constellation_deg"] - a) / (b - a), 0.0, 1.0))
    between = (1.0 - part) * one.radiance + part * other.radiance
    known = (np.isfinite(one.variance) & np.isfinite(other.variance)).all(axis=2) & far
    floor = float(np.median(sigma[known]))
    logs = [np.log(np.maximum(each, 0.0) + floor) for each in (picture, between, total)]
    for name, (mine, theirs, true) in {"linear": (picture, between, total), "log": tuple(logs)}.items():
        errors = [float(((each - true)[known].astype(np.float64) ** 2).sum()) for each in (mine, theirs)]
        tally.add_squares(name, errors[0], errors[1])
    reach = float(np.ptp(logs[2][known]))
    green = [each[..., 1].astype(np.float64) for each in logs]
    tally.ssim.append(tuple(_ssim(each, green[2], known, reach) for each in green[:2]))  # type: ignore[arg-type]


def _ssim(a: Floats, b: Floats, known: Mask, reach: float, side: int = 7) -> float:
    """Return the mean structural similarity over squares of `side` pixels that are known (Wang et al. 2004)."""

    def mean(image: Floats) -> Floats:
        sums = np.pad(image, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
        return (sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]) / side**2

    c1, c2 = (0.01 * reach) ** 2, (0.03 * reach) ** 2
    ma, mb = mean(a), mean(b)
    va, vb, ab = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    values = (2.0 * ma * mb + c1) * (2.0 * ab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
    return float(values[mean(known.astype(np.float64)) > 0.999].mean())


def found_ghosts(model: GhostModel, pose: dict[str, Any], sigma: NDArray[np.float32], far: Mask) -> list[FoundGhost]:
    """Return the ghosts of a model at a constellation that are above the noise and away from the light."""
    found = []
    size = sigma.shape[1], sigma.shape[0]
    # `replace` validates the copy, and large sprites take long
    bare = model.replace(sprites=())
    for ghost in model.ghosts:
        if not ghost.visible_deg[0] <= pose["constellation_deg"] <= ghost.visible_deg[1]:
            continue
        alone = cast(GhostModel, bare.replace(ghosts=(ghost,)))
        green = draw(alone, pose["constellation_deg"], pose["roll_deg"], size)[..., 1]
        seen = footprint(green)
        if seen is None:
            continue
        (left, top, width, height), inside, level = seen
        mask = np.zeros(sigma.shape, bool)
        mask[top : top + height, left : left + width] = inside
        if (mask & far).sum() > 0.5 * mask.sum() and level > SEEN * float(np.median(sigma[mask])):
            found.append(FoundGhost(ghost.name, mask, level))
    return found


def coinciding(folder: Path) -> dict[str, str]:
    """Return for every path that coincides with a brighter path the name of that path."""
    least: dict[tuple[str, str], float] = {}
    for pose in read_poses(folder):
        ghosts = [ghost for ghost in read_ghosts(folder, pose["number"]) or [] if ghost.snr >= SEEN]
        for k, one in enumerate(ghosts):
            for other in ghosts[:k]:
                pair = one.name, other.name
                if least.get(pair, 1.0) >= COINCIDE or least.get(pair[::-1], 1.0) >= COINCIDE:
                    least[pair] = min(least.get(pair, 1.0), _shared(one, other))
    found: dict[str, str] = {}
    for (fainter, brighter), shared in least.items():
        if min(shared, least.get((brighter, fainter), 1.0)) >= COINCIDE and brighter not in found:
            found.setdefault(fainter, brighter)
    return found


def _shared(a: TrueGhost, b: TrueGhost) -> float:
    """Return the common part of the union of two footprints."""
    left, top = max(a.window[0], b.window[0]), max(a.window[1], b.window[1])
    right = min(a.window[0] + a.window[2], b.window[0] + b.window[2])
    bottom = min(a.window[1] + a.window[3], b.window[1] + b.window[3])
    if right <= left or bottom <= top:
        return 0.0
    parts = [
        one.mask[top - one.window[1] : bottom - one.window[1], left - one.window[0] : right - one.window[0]]
        for one in (a, b)
    ]
    both = np.count_nonzero(parts[0] & parts[1])
    return both / (np.count_nonzero(a.mask) + np.count_nonzero(b.mask) - both)


def _judge_ghosts(
    ghosts: list[TrueGhost], found: list[FoundGhost], far: Mask, twins: dict[str, str], tally: Tally
) -> None:
    masks = [_whole(ghost, far.shape) for ghost in ghosts]
    seen = [
        ghost.snr >= SEEN and bool((mask & far).sum() > 0.5 * mask.sum())
        for ghost, mask in zip(ghosts, masks, strict=True)
    ]
    # match whole ghosts first, best pairs first; unmatched ones can be fragments
    overlaps = np.array([[_overlap(mask, one.mask) for one in found] for mask in masks]).reshape(len(masks), len(found))
    groups: dict[int, list[int]] = {}
    free = set(range(len(found)))
    for place in np.argsort(-overlaps, axis=None):
        t, f = (int(each) for each in np.unravel_index(place, overlaps.shape))
        if overlaps[t, f] >= SAME and t not in groups and f in free:
            groups[t] = [f]
            free.discard(f)
    for f in sorted(free):
        of = _fragment_of(found[f], ghosts, masks)
        if of is not None:
            groups.setdefault(of, []).append(f)
            free.discard(f)
    one_of: dict[str, bool] = {}
    for t, ghost in enumerate(ghosts):
        name = class_of(ghost)
        parts = groups.get(t, [])
        merged = np.logical_or.reduce([found[f].mask for f in parts]) if parts else None
        same = merged is not None and _overlap(masks[t], merged) >= SAME
        tally.pieces += len(parts)
        if parts:
            tally.found[name] += 1
            tally.good[name] += same
        if seen[t]:
            tally.true[name] += 1
            tally.met[name] += same
            tally.near[name] += same or bool((overlaps[t] >= SAME).any())
            shared = twins.get(ghost.name, ghost.name)
            one_of[shared] = one_of.get(shared, False) or same
        if same and seen[t] and ghost.snr >= SHARP and merged is not None:
            tally.centres[name].append(float(np.hypot(*np.subtract(_middle(masks[t]), _middle(merged)))))
    tally.strange += len(free)
    tally.pieces += len(free)
    tally.apart += len(one_of)
    tally.met_apart += sum(one_of.values())


def _whole(ghost: TrueGhost, shape: tuple[int, ...]) -> Mask:
    mask = np.zeros(shape, bool)
    left, top, width, height = ghost.window
    mask[top : top + height, left : left + width] = ghost.mask
    return mask


def _overlap(a: Mask, b: Mask) -> float:
    either = np.count_nonzero(a | b)
    return float(np.count_nonzero(a & b) / either) if either else 0.0


def _fragment_of(one: FoundGhost, ghosts: list[TrueGhost], masks: list[Mask]) -> int | None:
    """Return the true ghost that contains a found one and has light of its brightness there, if any."""
    best, at = np.log(AS_BRIGHT), None
    small = one.mask[::2, ::2]
    for t, (ghost, mask) in enumerate(zip(ghosts, masks, strict=True)):
        if np.count_nonzero(one.mask & mask) < INSIDE * np.count_nonzero(one.mask):
            continue
        left, top, width, height = ghost.window
        rows, columns = np.arange(top, top + height, 2), np.arange(left, left + width, 2)
        inside = one.mask[np.ix_(rows, columns)]
        if not inside.any() or not small.any():
            continue
        light = ghost.level * float(np.median(ghost.light[inside].astype(np.float64)))
        off = abs(np.log(max(light, 1e-30) / one.level))
        if off < best:
            best, at = off, t
    return at


def _middle(mask: Mask) -> tuple[float, float]:
    """Return the centre of a footprint's bounding box."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return 0.5 * (columns[0] + columns[-1] + 1.0), 0.5 * (rows[0] + rows[-1] + 1.0)


def summary(tally: Tally) -> dict[str, Any]:
    """Return the scores of a tally."""

    def spread(values: list[float]) -> list[float] | None:
        return [len(values), float(np.median(values)), float(np.percentile(values, 90))] if values else None

    def gain(pairs: list[tuple[float, float]]) -> float:
        model, between = np.sum(pairs, axis=0)
        return float(10.0 * np.log10(between / model))

    true, met = sum(tally.true.values()), sum(tally.met.values())
    found, good = sum(tally.found.values()) + tally.strange, sum(tally.good.values())
    unfolded = [value for name in CLASSES if name != "fold" for value in tally.centres[name]]
    return {
        "recall, clean": tally.met["clean"] / max(tally.true["clean"], 1),
        "recall, all": met / max(true, 1),
        "recall, all, coinciding paths as one": tally.met_apart / max(tally.apart, 1),
        "precision": good / max(found, 1),
        "true": true, "true, coinciding paths as one": tally.apart, "found": found, "pieces": tally.pieces,
        "found, of no true ghost": tally.strange,
        "recall, all, one found for several": sum(tally.near.values()) / max(true, 1),
        "met of true, one found for several": {name: (tally.near[name], tally.true[name]) for name in CLASSES},
        "met of true": {name: (tally.met[name], tally.true[name]) for name in CLASSES},
        "good of found": {name: (tally.good[name], tally.found[name]) for name in CLASSES},
        "centre px, no fold": spread(unfolded),
        "centre px": {name: spread(tally.centres[name]) for name in CLASSES},
        "gain dB": {name: gain(pairs) for name, pairs in tally.squares.items()},
        "gain dB, median angle": {
            name: float(np.median([10.0 * np.log10(b / m) for m, b in pairs])) for name, pairs in tally.squares.items()
        },
        "ssim": float(np.mean([one for one, _ in tally.ssim])),
        "ssim of interpolation": float(np.mean([other for _, other in tally.ssim])),
    }  # fmt: skip
