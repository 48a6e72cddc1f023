"""The report of a measurement: one HTML file that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, log10
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..io.atomic import write_atomically
from ..io.merged import read_frame
from ..model.capture import FrameInfo, MergedFrame, MergedRun
from ..model.ghost_model import GhostModel
from ..model.ghost_tracks import Tracks
from ..render.chart import COLOURS, Series, chart, number
from ..render.page import figures, image, page, paragraph, remark_list, section, table
from .overview import overview_picture
from .replay import replay
from .report_tracks import tracks_section

Floats = NDArray[np.float64]

# pictures of frames, their width, and decades of light from black to white
_FRAMES, _WIDTH, _DECADES = 6, 320, 4.0
# where replay and frame are compared: farther than this from the light, as Walch 2017 leaves out the star
_AROUND_LIGHT_PX = 40.0
# constellations at which every ghost is drawn by itself, and how wide
_TRACK_STEPS, _TRACK_WIDTH = 32, 240
# nearer the axis the direction to the light says nothing
_NEAR_DEG = 1.0


@dataclass(frozen=True)
class _Compared:
    """A frame beside its replay."""

    frame: MergedFrame
    replayed: Floats
    off_db: float


def write_report(
    folder: Path, run: MergedRun, model: GhostModel | None, path: Path, tracks: Tracks | None = None
) -> None:
    """Write the report.

    Parameters
    ----------
    folder : Path
        Of the run.
    run : MergedRun
    model : GhostModel or None
        What was learned from the run; None: nothing yet.
    path : Path
        The HTML file.
    tracks : Tracks, optional
        Of the model's ghosts.

    Raises
    ------
    FlarewrightError
        When frames cannot be read.
    OutputError
        When the file cannot be written.
    """
    seen = sum(frame.light_found for frame in run.frames)
    lead = f"{len(run.frames)} frames of {run.size_px[0]} x {run.size_px[1]} pixels, the light seen in {seen}; " + (
        "no ghosts were looked for yet" if model is None else f"{len(model.ghosts)} ghosts"
    )
    chosen = [run.frames[k] for k in _spread(len(run.frames), _FRAMES)]
    sections = [_captures(folder, run), _geometry(run)]
    if model is None:
        frames = [_picture_of(read_frame(folder, info)) for info in chosen]
        sections.append(section("Frames", paragraph(_TONE_WORDS), *frames))
    else:
        sections += [_replays(folder, chosen, model), _ghosts(model)]
    if tracks is not None and tracks.ghosts:
        sections.append(tracks_section(tracks))
    text = page("Measured flare", lead, sections)

    def write(temporary: Path) -> None:
        temporary.write_text(text, "utf-8")

    write_atomically(path, write)


_TONE_WORDS = f"Logarithmic, {_DECADES:g} decades from black to white; what every exposure clipped is white."


def _spread(count: int, most: int) -> list[int]:
    return [int(k) for k in np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))]


def _captures(folder: Path, run: MergedRun) -> str:
    camera, (x, y), (dx, dy) = run.camera, run.axis_px, run.axis_error_px
    rows = [
        ("exposures of a frame", ", ".join(f"{value:.4g} s" for value in run.frames[0].exposures_s)),
        ("ISO, f-number", f"{run.reference_iso:g}, {_known(run.reference_f_number)}"),
        ("black and white level", f"{_known(camera.black_level)}, {_known(camera.white_level)}"),
        ("electrons per unit", _with_error(camera.electrons_per_unit, camera.electrons_per_unit_error)),
        ("read noise, electrons", _with_error(camera.read_noise, camera.read_noise_error)),
        ("optical axis, pixels", f"{x:.2f} ± {dx:.2f}, {y:.2f} ± {dy:.2f}"),
        ("focal length, pixels", f"{run.px_per_rad:.1f}"),
        ("clipped in every exposure, at most", f"{max(frame.clipped_share for frame in run.frames):.2%}"),
    ]
    picture = image(overview_picture(folder, run), "all frames laid over each other; red: the light where it was seen, "
                    "violet: where it must be, blue: the axis, green: mirror lines", 640)  # fmt: skip
    return section("Captures", table(("", ""), rows), remark_list(run.remarks), picture)


def _known(value: float | None) -> str:
    return "not told" if value is None else number(value)


def _with_error(value: float | None, error: float | None) -> str:
    if value is None or error is None:
        return _known(value)
    return f"{value:.{max(0, 1 - int(np.floor(log10(max(error, 1e-9)))))}f} ± {error:.2g}"


def _geometry(run: MergedRun) -> str:
    angle = np.array([frame.nominal_deg for frame in run.frames])
    seen = np.array([frame.light_found for frame in run.frames])
    corrected = np.array([frame.constellation_deg - frame.nominal_deg for frame in run.frames])
    horizon = np.array([frame.horizon_deg for frame in run.frames])
    horizon[np.abs(angle) < _NEAR_DEG] = np.nan
    away = np.array([hypot(f.light_px[0] - f.axis_px[0], f.light_px[1] - f.axis_px[1]) for f in run.frames])

    def both(values: Floats) -> list[Series]:
        return [
            Series("light seen", angle, np.where(seen, values, np.nan), COLOURS[0], 0.0),
            Series("foretold", angle, np.where(seen, np.nan, values), COLOURS[4], 0.0),
        ]

    charts = [
        chart(
            "Angle found, less the angle told",
            both(corrected),
            x_label="constellation told, degrees",
            y_label="degrees",
        ),
        chart("Tilt of the mirror line", both(horizon), x_label="constellation told, degrees", y_label="degrees"),
        chart("Light's distance from the axis", both(away), x_label="constellation told, degrees", y_label="pixels"),
    ]
    return section("Geometry", figures(*charts))


def _small(pixels: NDArray[np.floating]) -> Floats:
    """Return a picture averaged to about the width of the report's."""
    block = max(1, pixels.shape[1] // _WIDTH)
    height, width = pixels.shape[0] // block, pixels.shape[1] // block
    part = pixels[: height * block, : width * block].astype(np.float64)
    return np.asarray(part.reshape(height, block, width, block, 3).mean(axis=(1, 3)))


def _toned(light: Floats, dark: float) -> NDArray[np.uint8]:
    level = np.log10(np.maximum(light, dark) / dark) / _DECADES
    return np.asarray(np.clip(level * 255.0, 0.0, 255.0).astype(np.uint8))


def _dark(light: Floats) -> float:
    return max(0.5 * float(np.percentile(light, 2)), 1e-12)


def _picture_of(frame: MergedFrame) -> str:
    light = _small(frame.radiance)
    return image(_toned(light, _dark(light)), f"{frame.constellation_deg:.2f} degrees")


def _replays(folder: Path, chosen: Sequence[FrameInfo], model: GhostModel) -> str:
    inside = [info for info in chosen if _place(info, model) is not None]
    compared = [_compare(read_frame(folder, info), model) for info in inside]
    rows = []
    for one in compared:
        light, drawn = _small(one.frame.radiance), _small(one.replayed)
        dark = _dark(light)
        widest = max(float(np.percentile(np.abs(drawn), 99)), 1e-12)
        left = np.clip(0.5 + 0.5 * (light - drawn) / widest, 0.0, 1.0)
        rows.append(
            image(_toned(light, dark), f"{one.frame.constellation_deg:.2f} degrees, measured")
            + image(_toned(drawn, dark), f"replayed, {one.off_db:.1f} dB")
            + image((left * 255.0).astype(np.uint8), "measured less replayed; grey: alike")
        )
    words = (
        f"{_TONE_WORDS} Decibels: squares of the measured light over squares of the difference, farther than "
        f"{_AROUND_LIGHT_PX:g} pixels from the light. Noise is part of the difference."
    )
    return section("Replay", paragraph(words), *(f"<div>{row}</div>" for row in rows))


def _place(info: FrameInfo, model: GhostModel) -> tuple[float, float] | None:
    """Return constellation and roll of a frame as a model knows them; None: it does not.

    Of a model of one side a frame of the other is its own side turned by half a turn.
    """
    low, high = model.constellation_deg
    if low <= info.constellation_deg <= high:
        return info.constellation_deg, info.roll_deg
    return (-info.constellation_deg, info.roll_deg + 180.0) if low <= -info.constellation_deg <= high else None


def _compare(frame: MergedFrame, model: GhostModel) -> _Compared:
    constellation, roll = _place(frame.info, model) or (frame.constellation_deg, frame.roll_deg)
    height, width = frame.radiance.shape[:2]
    layers = replay(model, constellation, roll_deg=roll, size_px=(width, height))
    drawn = layers[0].pixels.astype(np.float64) + np.array(model.background)
    x, y = np.arange(width) + 0.5 - frame.light_px[0], (np.arange(height) + 0.5 - frame.light_px[1])[:, None]
    counted = frame.valid & (np.hypot(x, y) > _AROUND_LIGHT_PX)[..., None]
    squares = float(np.square(frame.radiance[counted], dtype=np.float64).sum())
    off = float(np.square((frame.radiance - drawn)[counted]).sum())
    return _Compared(frame, drawn, 10.0 * log10(max(squares, 1e-300) / max(off, 1e-300)))


def _ghosts(model: GhostModel) -> str:
    """Draw where each ghost goes and how bright it is."""
    low, high = model.constellation_deg
    steps = np.linspace(low, high, _TRACK_STEPS)
    size = _TRACK_WIDTH, max(1, round(_TRACK_WIDTH * model.size_px[1] / model.size_px[0]))
    scale = model.size_px[0] / size[0]
    names = [ghost.name for ghost in model.ghosts]
    places = np.full((len(names), steps.size), np.nan)
    flux = np.full((len(names), steps.size), np.nan)
    for k, angle in enumerate(steps):
        layers = replay(model, float(angle), size_px=size, single=True)
        drawn = {layer.name.removeprefix("ghost."): layer for layer in layers if layer.name.startswith("ghost.")}
        for row, name in enumerate(names):
            if name in drawn:
                light = drawn[name].pixels.mean(axis=2, dtype=np.float64).sum(axis=0)
                total = float(light.sum())
                if total > 0.0:
                    left = drawn[name].window[0]
                    places[row, k] = (left + float(light @ (np.arange(light.size) + 0.5)) / total) * scale
                    flux[row, k] = total * scale**2
    places -= model.axis_px[0]
    order = [int(k) for k in np.argsort(-np.nan_to_num(flux).max(axis=1, initial=0.0))]
    lines = [Series("", steps, places[k], COLOURS[k % len(COLOURS)]) for k in order]
    lights = [Series("", steps, flux[k], COLOURS[k % len(COLOURS)]) for k in order]
    charts = [
        chart("Where the ghosts' light is", lines, x_label="constellation, degrees", y_label="pixels from the axis"),
        chart("How much light they hold", lights, x_label="constellation, degrees", y_label="radiance x pixels",
              logarithmic=True),
    ]  # fmt: skip
    rows = [_row(names[k], steps, places[k], flux[k]) for k in order]
    head = ("ghost", "in the picture, degrees", "from", "to, pixels from the axis", "most light")
    words = "Light inside the picture only: a ghost that the border cuts is drawn by what is left of it."
    return section("Ghosts", paragraph(words), figures(*charts), table(head, rows), remark_list(model.remarks))


def _row(name: str, steps: Floats, place: Floats, flux: Floats) -> tuple[str, ...]:
    there = np.isfinite(flux)
    if not there.any():
        return name, "never", "", "", ""
    at = steps[there]
    return (name, f"{at[0]:.1f} to {at[-1]:.1f}", f"{place[there][0]:.0f}", f"{place[there][-1]:.0f}",
            number(float(np.nanmax(flux))))  # fmt: skip
