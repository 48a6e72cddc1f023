"""The part of a measurement's report about frames: which ghost is where in them, and what a replay misses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log10
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..io.sentences import count
from ..model.capture import FrameInfo, MergedFrame, MergedRun
from ..model.ghost_model import GhostModel
from ..model.layer import Layer
from ..render.display import auto_exposure, view
from ..render.figure import Figure, Mark, Picture, Text
from ..render.page import figures, image, paragraph, section
from .blocks import reduced
from .dimmed import AROUND_LIGHT
from .overview import frame_of, in_rec709
from .replay import replay

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# about as wide pictures of frames are, alone and three to a row
_WIDE, _WIDTH = 480, 310
# below lines a frame is so many stops darker than by itself, so that they stand out
_DARKER = 1.0
# a ghost's rim is where this part of its usual light is; what counts for that is brighter than so much of its brightest
_RIM, _LIT = 0.25, 0.02
# rims of fewer pixels are not seen; so wide a ring is
_LEAST, _RING_PX = 60, 7.0
# between names; and standard deviations of noise that are plainly seen
_APART_PX, _SEEN = 14.0, 4.0
_NAME_PX, _REST = 12.0, "#a9b4be"

_TONE_WORDS = (
    "Frames are shown as renders are: at an exposure found for each, bright light rolling off to white. What every "
    "exposure clipped is white."
)


def frames_section(folder: Path, run: MergedRun, chosen: Sequence[FrameInfo]) -> str:
    """Return a report's section that shows frames alone, as HTML."""
    frames = [_Shown.of(frame_of(folder, run, info), run, _WIDTH) for info in chosen]
    pictures = [image(one.seen(one.light), f"{info.constellation_deg:.2f} degrees, {one.stops:+.1f} stops", _WIDTH)
                for one, info in zip(frames, chosen, strict=True)]  # fmt: skip
    return section("Frames", paragraph(_TONE_WORDS), *pictures)


@dataclass(frozen=True)
class _Shown:
    """A frame in the size in which it is shown.

    Attributes
    ----------
    light : ndarray, shape (H, W, 3)
    clipped : ndarray of bool, shape (H, W)
        Where every exposure was clipped, somewhere in the pixel.
    noise : float
        Usual standard deviation of its pixels.
    block : int
        Pixels of the frame a side.
    run : MergedRun
        Knows the camera's colours.
    stops : float
        The exposure at which it is shown, and its replay with it.
    """

    light: Floats
    clipped: Mask
    noise: float
    block: int
    run: MergedRun
    stops: float

    @staticmethod
    def of(frame: MergedFrame, run: MergedRun, width: int) -> _Shown:
        """Reduce a frame to about this width, if it is wider."""
        block = max(1, round(frame.radiance.shape[1] / width))
        seen = frame.variance[frame.valid]
        noise = float(np.sqrt(np.median(seen))) / block if seen.size else 0.0
        clipped = np.asarray(reduced(~frame.valid, block).any(axis=2))
        light = reduced(frame.radiance, block)
        return _Shown(light, clipped, noise, block, run, auto_exposure(in_rec709(light, run)))

    def seen(self, light: Floats, darker: float = 0.0) -> NDArray[np.uint8]:
        """Return light as 8 bits at this frame's exposure or some stops below it, clipped places white."""
        shown = view(in_rec709(light, self.run), self.stops - darker)
        shown[self.clipped] = 255
        return shown


def place_of(info: FrameInfo, model: GhostModel) -> tuple[float, float] | None:
    """Return constellation and roll of a frame as a model knows them; None: it does not.

    Of a model of one side a frame of the other is its own side turned by half a turn.
    """
    low, high = model.constellation_deg
    if low <= info.constellation_deg <= high:
        return info.constellation_deg, info.roll_deg
    return (-info.constellation_deg, info.roll_deg + 180.0) if low <= -info.constellation_deg <= high else None


def _placed(
    folder: Path, run: MergedRun, chosen: Sequence[FrameInfo], model: GhostModel
) -> Iterator[tuple[MergedFrame, tuple[float, float]]]:
    """Read the frames that a model knows, one at a time, each with its place."""
    for info in chosen:
        place = place_of(info, model)
        if place is not None:
            yield frame_of(folder, run, info), place


def bare(model: GhostModel) -> GhostModel:
    """Return a model's ghosts without all that is beside them."""
    return cast(GhostModel, model.replace(sprites=(), halo=None, star=None))


def ghosts_alone(
    ghosts: GhostModel, constellation_deg: float, roll_deg: float, size_px: tuple[int, int]
) -> dict[str, Layer]:
    """Draw each ghost of a bare model on a layer of its own, by its name; those outside the picture have none."""
    layers = replay(ghosts, constellation_deg, roll_deg=roll_deg, size_px=size_px, single=True)
    return {layer.name.removeprefix("ghost."): layer for layer in layers if layer.name.startswith("ghost.")}


# ---------------------------------------------------------------------------------------------------------------------
# which ghost is where


def outlines_section(
    folder: Path, run: MergedRun, chosen: Sequence[FrameInfo], model: GhostModel, colours: Mapping[str, str]
) -> str:
    """Return a report's section with the outline and name of each ghost over frames, as HTML.

    Parameters
    ----------
    folder : Path
    run : MergedRun
    chosen : sequence of FrameInfo
    model : GhostModel
    colours : mapping of str to str
        Of ghosts by name, as in the charts; the others are grey.
    """
    ghosts = bare(model)
    drawn = [_outlined(frame, run, ghosts, place, colours) for frame, place in _placed(folder, run, chosen, model)]
    words = (
        f"Rims are where a quarter of a ghost's usual light is. {_TONE_WORDS} Here all is {_DARKER:g} stop darker, for "
        "lines to stand out."
    )
    if len(colours) < len(model.ghosts):
        words += f" In colour are the {len(colours)} ghosts that the charts show."
    return section("Found ghosts over frames", paragraph(words), figures(*drawn)) if drawn else ""


def _outlined(
    frame: MergedFrame, run: MergedRun, ghosts: GhostModel, place: tuple[float, float], colours: Mapping[str, str]
) -> Figure:
    shown = _Shown.of(frame, run, _WIDE)
    seen = shown.seen(shown.light, _DARKER)
    width, height = _WIDE, round(_WIDE * seen.shape[0] / seen.shape[1])
    row, column = (
        ((np.arange(n) + 0.5) * m / n).astype(np.int64) for n, m in zip((height, width), seen.shape, strict=False)
    )
    pixels = seen[row][:, column]
    names: list[Mark] = []
    taken: list[tuple[float, float]] = []
    drawn = ghosts_alone(ghosts, *place, (width, height))
    # those with a colour over the others
    for name, layer in sorted(drawn.items(), key=lambda one: one[0] in colours):
        colour = _lighter(colours[name]) if name in colours else _REST
        y, x = _rim(layer, (height, width))
        pixels[y, x] = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
        at = _free_place(x, y, layer, taken, (width, height))
        taken.append(at)
        # a dark rim, for it may stand on light
        names += [Text(at[0] + i, at[1] + j, name, _NAME_PX, "#101418", "middle") for i in (-1, 1) for j in (-1, 1)]
        names.append(Text(*at, name, _NAME_PX, colour, "middle"))
    told = f"{frame.constellation_deg:.2f} degrees, {count(len(taken), 'ghost')} in the picture"
    words = Text(6.0, height + 15.0, told, 11.0)
    return Figure(width, height + 22, f"Ghosts at {frame.constellation_deg:.2f} degrees",
                  (Picture(0.0, 0.0, width, height, pixels), *names, words))  # fmt: skip


def _lighter(colour: str) -> str:
    """Return a colour for dark ground: as bright as its hue goes, with a little white."""
    parts = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(255 * (0.85 * part / max(parts) + 0.15)):02x}" for part in parts)


def usual_light(layer: Layer) -> float:
    """Return the median light of a ghost's lit pixels, mean of the colours."""
    light = layer.pixels.mean(axis=2, dtype=np.float64)
    return float(np.median(light[light > _LIT * light.max()]))


def _rim(layer: Layer, size: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of a ghost's border, or of a ring about a tiny one; the picture's edge is no border."""
    left, top, wide, high = layer.window
    lit = layer.pixels.mean(axis=2, dtype=np.float64) > _RIM * usual_light(layer)
    if np.count_nonzero(lit) < _LEAST:
        turn = np.linspace(0.0, 2.0 * np.pi, 60)
        rows, columns = (np.nonzero(lit)[k].mean() + 0.5 for k in (0, 1))
        y, x = top + rows + _RING_PX * np.sin(turn), left + columns + _RING_PX * np.cos(turn)
    else:
        whole = np.zeros((size[0] + 2, size[1] + 2), dtype=np.bool_)
        whole[1 + top : 1 + top + high, 1 + left : 1 + left + wide] = lit
        for edge, inner in ((0, 1), (-1, -2)):
            whole[edge], whole[:, edge] = whole[inner], whole[:, inner]
        inside = whole[:-2, 1:-1] & whole[2:, 1:-1] & whole[1:-1, :-2] & whole[1:-1, 2:]
        y, x = np.nonzero(whole[1:-1, 1:-1] & ~inside)
    y, x = np.floor(y).astype(np.int64), np.floor(x).astype(np.int64)
    there = (y >= 0) & (x >= 0) & (y < size[0]) & (x < size[1])
    return y[there], x[there]


def _free_place(
    x: NDArray[np.int64],
    y: NDArray[np.int64],
    layer: Layer,
    taken: Sequence[tuple[float, float]],
    size: tuple[int, int],
) -> tuple[float, float]:
    """Return where a ghost's name stands: just outside its rim, as far from other names as need be."""
    left, top, wide, high = layer.window
    middle = np.array([left + 0.5 * wide, top + 0.5 * high])
    rim = np.stack([x, y], axis=1) + 0.5 if x.size else middle[None]
    tried = []
    for turn in np.radians(np.arange(-90.0, 270.0, 15.0)):
        way = np.array([np.cos(turn), np.sin(turn)])
        # the rim's point in this direction
        out = rim[int(np.argmax((rim - middle) @ way))] + 9.0 * way
        spot = np.clip(out, (10.0, 14.0), (size[0] - 10.0, size[1] - 6.0))
        near = min((float(np.hypot(*(spot - other))) for other in taken), default=np.inf)
        # pushed in from the picture's edge it is no longer beside the rim
        tried.append((min(near, _APART_PX) - float(np.hypot(*(spot - out))), spot))
    best = max(tried, key=lambda one: one[0])[1]
    return float(best[0]), float(best[1]) + 4.0


# ---------------------------------------------------------------------------------------------------------------------
# what a replay misses


def replays_section(folder: Path, run: MergedRun, chosen: Sequence[FrameInfo], model: GhostModel) -> str:
    """Return a report's section with frames, their replays and the differences, as HTML."""
    ghosts = bare(model)
    rows = [_compared(frame, run, model, ghosts, place) for frame, place in _placed(folder, run, chosen, model)]
    words = (
        f"{_TONE_WORDS} A replay has its frame's exposure. "
        "Decibels: squares of the measured light over squares of the difference, farther than "
        f"{AROUND_LIGHT * run.size_px[0]:.3g} pixels (1/18 of the width) from the light. Noise is part of the "
        "difference. Differences are linear: middle grey is none, and nothing is told where every exposure was clipped."
    )
    return section("Replay", paragraph(words), *(f"<div>{row}</div>" for row in rows))


def _compared(
    frame: MergedFrame, run: MergedRun, model: GhostModel, ghosts: GhostModel, place: tuple[float, float]
) -> str:
    height, width = frame.radiance.shape[:2]
    layers = replay(model, place[0], roll_deg=place[1], size_px=(width, height))
    drawn = layers[0].pixels.astype(np.float64) + np.array(model.background)
    x, y = np.arange(width) + 0.5 - frame.light_px[0], (np.arange(height) + 0.5 - frame.light_px[1])[:, None]
    off = frame.radiance - drawn
    # as Walch 2017 leaves out the star
    counted = frame.valid & (np.hypot(x, y) > AROUND_LIGHT * width)[..., None]
    squares = float(np.square(frame.radiance[counted], dtype=np.float64).sum())
    off_db = 10.0 * log10(max(squares, 1e-300) / max(float(np.square(off[counted]).sum()), 1e-300))
    shown = _Shown.of(frame, run, _WIDTH)
    levels = [usual_light(layer) for layer in ghosts_alone(ghosts, *place, (width, height)).values()]
    scale, words = _scale(levels, shown)
    left = 0.5 + 0.5 * reduced(np.where(frame.valid, off, 0.0), shown.block) / scale
    return (
        image(shown.seen(shown.light), f"{frame.constellation_deg:.2f} degrees, measured, {shown.stops:+.1f} stops",
              _WIDTH)
        + image(shown.seen(reduced(drawn, shown.block)), f"replayed, {off_db:.1f} dB", _WIDTH)
        + image((np.clip(left, 0.0, 1.0) * 255.0).astype(np.uint8),
                f"measured less replayed, black to white: ± {scale:.2g}, {words}", _WIDTH)
    )  # fmt: skip


def _scale(levels: Sequence[float], shown: _Shown) -> tuple[float, str]:
    """Return the difference that is white, and what it is: a usual ghost that is missing is seen, and noise is not."""
    usual = float(np.median(levels)) if levels else 0.0
    if usual > _SEEN * shown.noise:
        return usual, "the usual light of a ghost here"
    if shown.noise > 0.0:
        return _SEEN * shown.noise, f"{_SEEN:g} standard deviations of the noise"
    return max(float(np.median(np.abs(shown.light))), 1e-12), "the frame's median"
