"""The report of a measurement: one HTML file that needs nothing but itself."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import hypot
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FlarewrightError
from ..io.atomic import write_atomically
from ..io.sentences import count
from ..model.capture import MergedRun
from ..model.ghost_model import GhostModel
from ..model.ghost_tracks import Tracks
from ..render.chart import COLOURS, Series, chart, number, with_deviation
from ..render.page import figures, image, page, remark_list, section, table
from .evenly import evenly
from .overview import overview_picture
from .report_curves import curves_section
from .report_frames import frames_section, outlines_section, place_of, replays_section
from .report_ghosts import ghosts_section, paths_of
from .report_tracks import tracks_section

Floats = NDArray[np.float64]

# frames that are shown
_FRAMES = 6
# a model whose axis lies farther from that of the frames, parts of the width, or whose focal length differs by a larger
# factor, is of another camera
_OFF_AXIS, _OTHER_FOCAL = 0.03, 1.1
# nearer the axis the direction to the light says nothing
_NEAR_DEG = 1.0


def write_report(
    folder: Path,
    run: MergedRun,
    model: GhostModel | None,
    path: Path,
    tracks: Tracks | None = None,
    remarks: Sequence[str] = (),
) -> None:
    """Write the report.

    Parameters
    ----------
    folder : Path
        Of the run.
    run : MergedRun
    model : GhostModel or None
        What was learned from the run, one to which `strange` has no objection; None: nothing yet.
    path : Path
        The HTML file.
    tracks : Tracks, optional
        Of the model's ghosts.
    remarks : sequence of str
        About what is left out.

    Raises
    ------
    FlarewrightError
        When there are no frames, or they cannot be read or are of another size than the run.
    OutputError
        When the file cannot be written.
    """
    if not run.frames:
        raise FlarewrightError(f"{folder} holds a run without frames: merge again with flarewright measure merge")
    seen = sum(frame.light_found for frame in run.frames)
    lead = (
        f"{count(len(run.frames), 'frame')} of {run.size_px[0]} x {run.size_px[1]} pixels, the light seen in {seen}; "
        + ("no ghosts were looked for yet" if model is None else count(len(model.ghosts), "ghost"))
    )
    chosen = evenly(run.frames, _FRAMES)
    sections = [remark_list(remarks), _captures(folder, run), _geometry(run)]
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
    text = page("Measured flare", lead, sections)

    def write(temporary: Path) -> None:
        temporary.write_text(text, "utf-8")

    write_atomically(path, write)


def strange(run: MergedRun, model: GhostModel) -> str | None:
    """Say why a model does not belong to the frames of a run.

    Parameters
    ----------
    run : MergedRun
    model : GhostModel

    Returns
    -------
    str or None
        The end of a sentence; None: nothing speaks against it.
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


def _captures(folder: Path, run: MergedRun) -> str:
    camera, (x, y), (dx, dy) = run.camera, run.axis_px, run.axis_error_px
    rows = [
        ("exposures of a frame", ", ".join(f"{value:.4g} s" for value in run.frames[0].exposures_s)),
        ("their light over what they say", _ratios(folder, run)),
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
    pixels, stops = overview_picture(folder, run)
    picture = image(pixels, f"all frames laid over each other, {stops:+.1f} stops; red: the light where it was seen, "
                    "violet: where it must be, blue: the axis, green: mirror lines", 640)  # fmt: skip
    remarks = [remark.replace("+-", "±") for remark in run.remarks]
    return section("Captures", table(("", ""), rows), remark_list(remarks), picture)


def _ratios(folder: Path, run: MergedRun) -> str:
    """Tell by how much each exposure is brighter than its time promises, the longest's being 1, as merging noted it."""
    noted: dict[float, list[float]] = {}
    for info in run.frames:
        try:
            ratios = json.loads((folder / info.file).with_suffix(".json").read_text("utf-8"))["ratios"]
            for seconds, ratio in zip(info.exposures_s, ratios, strict=True):
                noted.setdefault(seconds, []).append(float(ratio["value"]))
        except (OSError, ValueError, KeyError, TypeError):
            continue
    told = [
        f"{seconds:.4g} s: {_with_error(float(np.mean(found)), float(np.std(found)) or None)}"
        for seconds, found in sorted(noted.items())
    ]
    return ", ".join(told) or "not told"


def _drift(run: MergedRun) -> str:
    gains = [info.gain for info in run.frames]
    if all(gain == 1.0 for gain in gains):
        return "none is taken out"
    error = max(info.gain_error for info in run.frames)
    return f"{min(gains):.4f} to {max(gains):.4f}, each ± {error:.2g} at most"


def _light(run: MergedRun) -> str:
    luminance, angle = run.camera.luminance_cd_m2, run.camera.solid_angle_sr
    if luminance is None or angle is None:
        return "not told"
    return f"{number(luminance)} cd/m², {number(angle)} sr: {number(luminance * angle)} lx"


def _known(value: float | None) -> str:
    return "not told" if value is None else number(value)


def _with_error(value: float | None, error: float | None) -> str:
    if value is None or error is None:
        return _known(value)
    return with_deviation(value, error)


def _geometry(run: MergedRun) -> str:
    angle = np.array([frame.nominal_deg for frame in run.frames])
    seen = np.array([frame.light_found for frame in run.frames])
    corrected = np.array([frame.constellation_deg - frame.nominal_deg for frame in run.frames])
    horizon = np.array([frame.horizon_deg for frame in run.frames])
    horizon[np.abs(angle) < _NEAR_DEG] = np.nan
    away = np.array([hypot(f.light_px[0] - f.axis_px[0], f.light_px[1] - f.axis_px[1]) for f in run.frames])

    def both(values: Floats) -> list[Series]:
        return [
            Series("light seen", angle, np.where(seen, values, np.nan), COLOURS[1], 0.0),
            Series("foretold", angle, np.where(seen, np.nan, values), COLOURS[0], 0.0),
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
    if any(frame.gain != 1.0 for frame in run.frames):
        gain = [Series("", angle, [100.0 * (frame.gain - 1.0) for frame in run.frames], COLOURS[0], 0.0)]
        charts.append(
            chart("Light less what neighbours foretell", gain, x_label="constellation told, degrees", y_label="%")
        )
    return section("Geometry", figures(*charts))
