"""Report sections with frames: outlines of the ghosts over them, and replays with their differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log10
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ...io.images.html_page import html_page
from ...model.layer import Layer
from ...model.measurement.capture import FrameInfo, MergedFrame, MergedRun
from ...model.measurement.ghost_model import GhostModel
from ...render.image.display import auto_exposure, view
from ...render.plots.svg import Chart, EmbeddedImage, Mark, Text
from ...sentences import count
from ...typing import Floats, Indices, Mask
from ..core.binning import binned
from ..glow.subtraction import AROUND_LIGHT
from ..replay.model_image import replay_model
from .overview import frame_of, in_rec709

# approximate width of a frame's picture, alone and three in a row, pixels
_WIDE_PX, _WIDTH_PX = 480, 310
# frames under outlines are darkened by this many stops, for contrast
_DARKER_STOPS = 1.0
# level of a ghost's outline, part of its median light; pixels below this part of its peak do not count as lit
_OUTLINE_LEVEL, _LIT_LEVEL = 0.25, 0.02
# outlines of fewer pixels are too small to see and replaced by a ring of this radius
_LEAST_OUTLINE_PIXELS, _RING_PX = 60, 7.0
# least distance between names, pixels; standard deviations of noise that count as visible
_APART_PX, _VISIBLE_SIGMAS = 14.0, 4.0
_NAME_PX, _OTHER_COLOUR = 12.0, "#a9b4be"


def frames_section(folder: Path, run: MergedRun, chosen: Sequence[FrameInfo]) -> str:
    """Return the report's section that shows frames only, as HTML."""
    frames = [_Shown.of(frame_of(folder, run, info), run, _WIDTH_PX) for info in chosen]
    pictures = [(one.seen(one.light), f"{info.constellation_deg:.2f} degrees, {one.stops:+.1f} stops")
                for one, info in zip(frames, chosen, strict=True)]  # fmt: skip
    return html_page("measured/frames", pictures=pictures, width=_WIDTH_PX)


@dataclass(frozen=True)
class _Shown:
    """A frame, reduced for display.

    Attributes
    ----------
    light : ndarray, shape (H, W, 3)
    clipped : ndarray of bool, shape (H, W)
        Where every exposure was clipped in at least one pixel of the block.
    noise : float
        Median standard deviation of its pixels.
    block : int
        Side of the block of frame pixels that became one pixel.
    run : MergedRun
        Run of the frame, for the camera's colour matrix.
    stops : float
        Exposure at which the frame and its replay are shown.
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
        clipped = np.asarray(binned(~frame.valid, block).any(axis=2))
        light = binned(frame.radiance, block)
        return _Shown(light, clipped, noise, block, run, auto_exposure(in_rec709(light, run)))

    def seen(self, light: Floats, darker: float = 0.0) -> NDArray[np.uint8]:
        """Convert light to 8 bits at this frame's exposure less some stops; clipped pixels are white."""
        shown = view(in_rec709(light, self.run), self.stops - darker)
        shown[self.clipped] = 255
        return shown


def place_of(info: FrameInfo, model: GhostModel) -> tuple[float, float] | None:
    """Return the constellation and roll at which a model covers a frame, or None.

    A model of one side covers a frame of the other side by a half turn.
    """
    low, high = model.constellation_deg
    if low <= info.constellation_deg <= high:
        return info.constellation_deg, info.roll_deg
    return (-info.constellation_deg, info.roll_deg + 180.0) if low <= -info.constellation_deg <= high else None


def _placed(
    folder: Path, run: MergedRun, chosen: Sequence[FrameInfo], model: GhostModel
) -> Iterator[tuple[MergedFrame, tuple[float, float]]]:
    """Read the frames that a model covers, one at a time, each with its constellation and roll."""
    for info in chosen:
        place = place_of(info, model)
        if place is not None:
            yield frame_of(folder, run, info), place


def bare(model: GhostModel) -> GhostModel:
    """Return a model with its ghosts only."""
    return model.replace(sprites=(), halo=None, star=None)


def ghosts_alone(
    ghosts: GhostModel, constellation_deg: float, roll_deg: float, size_px: tuple[int, int]
) -> dict[str, Layer]:
    """Draw each ghost of a bare model on a separate layer, by name; ghosts outside the picture have no layer."""
    layers = replay_model(ghosts, constellation_deg, roll_deg=roll_deg, size_px=size_px, single=True)
    return {layer.name.removeprefix("ghost."): layer for layer in layers if layer.name.startswith("ghost.")}


# ---------------------------------------------------------------------------------------------------------------------
# outlines of ghosts


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
        Colour of ghosts by name, as in the charts; the others are grey.
    """
    ghosts = bare(model)
    drawn = [_outlined(frame, run, ghosts, place, colours) for frame, place in _placed(folder, run, chosen, model)]
    if not drawn:
        return ""
    return html_page(
        "measured/outlines", charts=drawn, darker_stops=_DARKER_STOPS, coloured=len(colours), ghosts=len(model.ghosts)
    )


def _outlined(
    frame: MergedFrame, run: MergedRun, ghosts: GhostModel, place: tuple[float, float], colours: Mapping[str, str]
) -> Chart:
    shown = _Shown.of(frame, run, _WIDE_PX)
    seen = shown.seen(shown.light, _DARKER_STOPS)
    width, height = _WIDE_PX, round(_WIDE_PX * seen.shape[0] / seen.shape[1])
    row, column = (
        ((np.arange(n) + 0.5) * m / n).astype(np.int64) for n, m in zip((height, width), seen.shape, strict=False)
    )
    pixels = seen[row][:, column]
    names: list[Mark] = []
    taken: list[tuple[float, float]] = []
    drawn = ghosts_alone(ghosts, *place, (width, height))
    # draw the coloured ones last
    for name, layer in sorted(drawn.items(), key=lambda one: one[0] in colours):
        colour = _lighter(colours[name]) if name in colours else _OTHER_COLOUR
        y, x = _outline(layer, (height, width))
        pixels[y, x] = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
        at = _free_place(x, y, layer, taken, (width, height))
        taken.append(at)
        # a dark outline keeps the name readable over light
        names += [Text(at[0] + i, at[1] + j, name, _NAME_PX, "#101418", "middle") for i in (-1, 1) for j in (-1, 1)]
        names.append(Text(*at, name, _NAME_PX, colour, "middle"))
    sentence = f"{frame.constellation_deg:.2f} degrees, {count(len(taken), 'ghost')} in the picture"
    words = Text(6.0, height + 15.0, sentence, 11.0)
    return Chart(width, height + 22, f"Ghosts at {frame.constellation_deg:.2f} degrees",
                  (EmbeddedImage(0.0, 0.0, width, height, pixels), *names, words))  # fmt: skip


def _lighter(colour: str) -> str:
    """Return a colour for a dark background: its hue at full brightness, mixed with a little white."""
    parts = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(255 * (0.85 * part / max(parts) + 0.15)):02x}" for part in parts)


def usual_light(layer: Layer) -> float:
    """Return the median light of a ghost's lit pixels, averaged over the colours."""
    light = layer.pixels.mean(axis=2, dtype=np.float64)
    return float(np.median(light[light > _LIT_LEVEL * light.max()]))


def _outline(layer: Layer, size: tuple[int, int]) -> tuple[Indices, Indices]:
    """Return rows and columns of a ghost's outline without the picture's border, or of a ring around a tiny ghost."""
    left, top, wide, high = layer.window
    lit = layer.pixels.mean(axis=2, dtype=np.float64) > _OUTLINE_LEVEL * usual_light(layer)
    if np.count_nonzero(lit) < _LEAST_OUTLINE_PIXELS:
        turn = np.linspace(0.0, 2.0 * np.pi, 60)
        rows, columns = (np.nonzero(lit)[k].mean() + 0.5 for k in (0, 1))
        y, x = top + rows + _RING_PX * np.sin(turn), left + columns + _RING_PX * np.cos(turn)
    else:
        whole = np.zeros(size, dtype=np.bool_)
        whole[top : top + high, left : left + wide] = lit
        y, x = np.nonzero(whole & ~ndimage.binary_erosion(whole, border_value=1))
    row, column = np.floor(y).astype(np.int64), np.floor(x).astype(np.int64)
    there = (row >= 0) & (column >= 0) & (row < size[0]) & (column < size[1])
    return row[there], column[there]


def _free_place(
    x: Indices, y: Indices, layer: Layer, taken: Sequence[tuple[float, float]], size: tuple[int, int]
) -> tuple[float, float]:
    """Return a position for a ghost's name: just outside its outline and away from other names."""
    left, top, wide, high = layer.window
    middle = np.array([left + 0.5 * wide, top + 0.5 * high])
    rim = np.stack([x, y], axis=1) + 0.5 if x.size else middle[None]
    tried = []
    for turn in np.radians(np.arange(-90.0, 270.0, 15.0)):
        way = np.array([np.cos(turn), np.sin(turn)])
        # the outline's farthest point in this direction
        out = rim[int(np.argmax((rim - middle) @ way))] + 9.0 * way
        spot = np.clip(out, (10.0, 14.0), (size[0] - 10.0, size[1] - 6.0))
        near = min((float(np.hypot(*(spot - other))) for other in taken), default=np.inf)
        # penalise positions that the picture's border moved away from the outline
        tried.append((min(near, _APART_PX) - float(np.hypot(*(spot - out))), spot))
    best = max(tried, key=lambda one: one[0])[1]
    return float(best[0]), float(best[1]) + 4.0


# ---------------------------------------------------------------------------------------------------------------------
# residuals of replays


def replays_section(folder: Path, run: MergedRun, chosen: Sequence[FrameInfo], model: GhostModel) -> str:
    """Return the report's section with frames, their replays and the differences, as HTML."""
    ghosts = bare(model)
    rows = [_compared(frame, run, model, ghosts, place) for frame, place in _placed(folder, run, chosen, model)]
    return html_page("measured/replays", rows=rows, width=_WIDTH_PX, around_light_px=AROUND_LIGHT * run.size_px[0])


def _compared(
    frame: MergedFrame, run: MergedRun, model: GhostModel, ghosts: GhostModel, place: tuple[float, float]
) -> list[tuple[NDArray[np.uint8], str]]:
    """Return a frame, its replay and their difference as pictures with captions."""
    height, width = frame.radiance.shape[:2]
    layers = replay_model(model, place[0], roll_deg=place[1], size_px=(width, height))
    drawn = layers[0].pixels.astype(np.float64) + np.array(model.background)
    x, y = np.arange(width) + 0.5 - frame.light_px[0], (np.arange(height) + 0.5 - frame.light_px[1])[:, None]
    off = frame.radiance - drawn
    # Walch 2017 leaves out the star as well
    counted = frame.valid & (np.hypot(x, y) > AROUND_LIGHT * width)[..., None]
    squares = float(np.square(frame.radiance[counted], dtype=np.float64).sum())
    off_db = 10.0 * log10(max(squares, 1e-300) / max(float(np.square(off[counted]).sum()), 1e-300))
    shown = _Shown.of(frame, run, _WIDTH_PX)
    levels = [usual_light(layer) for layer in ghosts_alone(ghosts, *place, (width, height)).values()]
    scale, words = _scale(levels, shown)
    left = 0.5 + 0.5 * binned(np.where(frame.valid, off, 0.0), shown.block) / scale
    return [
        (shown.seen(shown.light), f"{frame.constellation_deg:.2f} degrees, measured, {shown.stops:+.1f} stops"),
        (shown.seen(binned(drawn, shown.block)), f"replayed, {off_db:.1f} dB"),
        ((np.clip(left, 0.0, 1.0) * 255.0).astype(np.uint8),
         f"measured less replayed, black to white: ± {scale:.2g}, {words}"),
    ]  # fmt: skip


def _scale(levels: Sequence[float], shown: _Shown) -> tuple[float, str]:
    """Return the difference shown as white and its description, so that a missing ghost is visible and noise is not."""
    usual = float(np.median(levels)) if levels else 0.0
    if usual > _VISIBLE_SIGMAS * shown.noise:
        return usual, "the usual light of a ghost here"
    if shown.noise > 0.0:
        return _VISIBLE_SIGMAS * shown.noise, f"{_VISIBLE_SIGMAS:g} standard deviations of the noise"
    return max(float(np.median(np.abs(shown.light))), 1e-12), "the frame's median"
