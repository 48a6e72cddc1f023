"""Write the report of a measurement: one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from pathlib import Path

import numpy as np

from ...errors import FlarewrightError
from ...io.files.atomic_write import write_text_atomically
from ...io.files.text_file import read_json
from ...io.images.html_page import html_page
from ...model.measurement.capture import MergedRun
from ...model.measurement.ghost_model import GhostModel
from ...model.measurement.ghost_tracks import Tracks
from ...render.plots.chart import COLOURS, Series, chart, number, with_deviation
from ...render.plots.svg import Chart
from ...sentences import count
from ...typing import Floats
from ..core.sampling import evenly_spaced
from .curves import curves_section
from .frames import frames_section, outlines_section, place_of, replays_section
from .ghosts import ghosts_section, paths_of
from .overview import overview_picture
from .tracks import tracks_section

# number of frames shown
_FRAMES = 6
# a model is of another camera when its axis differs by more than this part of the width, or its focal length by more
# than this factor
_OFF_AXIS, _OTHER_FOCAL = 0.03, 1.1
# within this angle of the axis the direction to the light is undefined
_NEAR_DEG = 1.0


def write_report(
    folder: Path,
    run: MergedRun,
    model: GhostModel | None,
    path: Path,
    tracks: Tracks | None = None,
    remarks: Sequence[str] = (),
) -> None:
    """Write the report of a measurement.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    run : MergedRun
    model : GhostModel or None
        Model of the run for which `strange` is None; None: no model yet.
    path : Path
        HTML file to write.
    tracks : Tracks, optional
        Tracks of the model's ghosts.
    remarks : sequence of str
        Remarks about parts that are left out.

    Raises
    ------
    FlarewrightError
        When there are no frames, a frame cannot be read, or its size differs from the run's.
    OutputError
        When the file cannot be written.
    """
    if not run.frames:
        raise FlarewrightError(f"{folder} holds a run without frames: merge again with flarewright measure merge")
    seen = sum(frame.light_found for frame in run.frames)
    lead = (
        f"{count(len(run.frames), 'frame')} of {run.size_px[0]} x {run.size_px[1]} pixels, the light seen in {seen}; "
        + ("ghosts not searched yet" if model is None else count(len(model.ghosts), "ghost"))
    )
    chosen = evenly_spaced(run.frames, _FRAMES)
    sections = []
    colours: dict[str, str] = {}
    if model is None:
        sections.append(frames_section(folder, run, chosen))
    else:
        paths = paths_of(model)
        colours = paths.colours()
        sections.append(outlines_section(folder, run, chosen, model, colours))
        sections += [replays_section(folder, run, chosen, model), ghosts_section(paths, model, colours)]
        sections.append(curves_section(model, colours))
    if tracks is not None and tracks.ghosts:
        sections.append(tracks_section(tracks, colours))
    pixels, stops = overview_picture(folder, run)
    caption = (
        f"maximum of all frames, {stops:+.1f} stops; red: the light where it was seen, violet: where it is predicted, "
        "blue: the axis, green: mirror lines"
    )
    text = html_page(
        "measured/page", title="Measured flare", lead=lead, left_out=remarks, captures=_captures(folder, run),
        run_remarks=[remark.replace("+-", "±") for remark in run.remarks], overview=(pixels, caption),
        geometry=_geometry(run), sections=sections,
    )  # fmt: skip

    write_text_atomically(path, text)


def strange(run: MergedRun, model: GhostModel) -> str | None:
    """Return the reason why a model does not belong to the frames of a run, or None.

    Returns
    -------
    str or None
        The end of a sentence; None when model and run agree.
    """
    (width, height), (wide, high) = model.size_px, run.size_px
    if model.size_px != run.size_px:
        return f"it was measured in pictures of {width} x {height} pixels, and the frames have {wide} x {high}"
    away = hypot(model.axis_px[0] - run.axis_px[0], model.axis_px[1] - run.axis_px[1])
    if away > _OFF_AXIS * wide or not 1.0 / _OTHER_FOCAL < model.focal_px / run.px_per_rad < _OTHER_FOCAL:
        return (
            f"its axis is at {model.axis_px[0]:.1f}, {model.axis_px[1]:.1f} and its focal length {model.focal_px:.1f} "
            f"pixels, those of the frames are {run.axis_px[0]:.1f}, {run.axis_px[1]:.1f} and {run.px_per_rad:.1f}"
        )
    if not any(place_of(info, model) for info in run.frames):
        low, high_deg = model.constellation_deg
        return f"it was measured from {low:.1f} to {high_deg:.1f} degrees, where there are no frames"
    return None


def _captures(folder: Path, run: MergedRun) -> list[tuple[str, str]]:
    camera, (x, y), (dx, dy) = run.camera, run.axis_px, run.axis_error_px
    return [
        ("exposures of a frame", ", ".join(f"{value:.4g} s" for value in run.frames[0].exposures_s)),
        ("measured over nominal exposure", _ratios(folder, run)),
        ("drift of the light, frame by frame", _drift(run)),
        ("luminance and solid angle of the light", _light(run)),
        ("ISO, f-number", f"{run.reference_iso:g}, {_known(run.reference_f_number)}"),
        ("black and white level", f"{_known(camera.black_level)}, {_known(camera.white_level)}"),
        ("electrons per unit", _with_error(camera.electrons_per_unit, camera.electrons_per_unit_error)),
        ("read noise, electrons", _with_error(camera.read_noise, camera.read_noise_error)),
        ("optical axis, pixels", f"{x:.2f} ± {dx:.2f}, {y:.2f} ± {dy:.2f}"),
        ("focal length, pixels", f"{run.px_per_rad:.1f}"),
        ("clipped in every exposure, at most", f"{max(frame.clipped_share for frame in run.frames):.2%}"),
    ]


def _ratios(folder: Path, run: MergedRun) -> str:
    """Format the ratio of measured to nominal exposure as merging recorded it; the longest exposure has 1."""
    noted: dict[float, list[float]] = {}
    for info in run.frames:
        try:
            ratios = read_json((folder / info.file).with_suffix(".json"), "the note of a frame")["ratios"]
            for seconds, ratio in zip(info.exposures_s, ratios, strict=True):
                noted.setdefault(seconds, []).append(float(ratio["value"]))
        except (ValueError, KeyError, TypeError):
            # FileError is a ValueError
            continue
    parts = [
        f"{seconds:.4g} s: {_with_error(float(np.mean(found)), float(np.std(found)) or None)}"
        for seconds, found in sorted(noted.items())
    ]
    return ", ".join(parts) or "unknown"


def _drift(run: MergedRun) -> str:
    gains = [info.gain for info in run.frames]
    if all(gain == 1.0 for gain in gains):
        return "none is corrected"
    error = max(info.gain_error for info in run.frames)
    return f"{min(gains):.4f} to {max(gains):.4f}, each ± {error:.2g} at most"


def _light(run: MergedRun) -> str:
    luminance, angle = run.camera.luminance_cd_m2, run.camera.solid_angle_sr
    if luminance is None or angle is None:
        return "unknown"
    return f"{number(luminance)} cd/m², {number(angle)} sr: {number(luminance * angle)} lx"


def _known(value: float | None) -> str:
    return "unknown" if value is None else number(value)


def _with_error(value: float | None, error: float | None) -> str:
    if value is None or error is None:
        return _known(value)
    return with_deviation(value, error)


def _geometry(run: MergedRun) -> list[Chart]:
    angle = np.array([frame.nominal_deg for frame in run.frames])
    seen = np.array([frame.light_found for frame in run.frames])
    corrected = np.array([frame.constellation_deg - frame.nominal_deg for frame in run.frames])
    horizon = np.array([frame.horizon_deg for frame in run.frames])
    horizon[np.abs(angle) < _NEAR_DEG] = np.nan
    away = np.array([hypot(f.light_px[0] - f.axis_px[0], f.light_px[1] - f.axis_px[1]) for f in run.frames])

    def both(values: Floats) -> list[Series]:
        return [
            Series("light seen", angle, np.where(seen, values, np.nan), COLOURS[1], 0.0),
            Series("predicted", angle, np.where(seen, np.nan, values), COLOURS[0], 0.0),
        ]

    charts = [
        chart(
            "Measured angle less nominal angle",
            both(corrected),
            x_label="nominal constellation, degrees",
            y_label="degrees",
        ),
        chart("Tilt of the mirror line", both(horizon), x_label="nominal constellation, degrees", y_label="degrees"),
        chart("Light's distance from the axis", both(away), x_label="nominal constellation, degrees", y_label="pixels"),
    ]
    if any(frame.gain != 1.0 for frame in run.frames):
        gain = [Series("", angle, [100.0 * (frame.gain - 1.0) for frame in run.frames], COLOURS[0], 0.0)]
        charts.append(
            chart("Light relative to its neighbours", gain, x_label="nominal constellation, degrees", y_label="%")
        )
    return charts
