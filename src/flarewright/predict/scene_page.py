"""HTML report of a scene: ranking, flare over time, choice of cameras, plan view, and renders of the worst moments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..io.images.html_page import html_page
from ..model.project.scene import Lamp
from ..render.image.display import view
from ..render.plots.chart import COLOURS, Series, chart, number
from ..render.plots.svg import FAINT, INK, Box, Chart, Line, Mark, Text
from ..typing import Floats
from .occurrence_page import shown_together
from .plan import Plan, Ranked
from .scene_data import found_words, time_words, unknown_share
from .search import BestPosition
from .switching import Shot
from .tracks import lamp_places
from .worst import Worst

# largest number of lines in a chart, and of rows in the ranking
LINES, ROWS = 8, 40
# a picture with fewer values (second number) of at least this brightness, of 255, is left out as dark
DARKEST_SHOWN, FEWEST_SHOWN = 6, 60
# colour of tried positions whose flare is unknown
_UNKNOWN = "#c3ccd4"


def scene_page(
    plan: Plan, ranked: Sequence[Ranked], shots: Sequence[Shot], found: BestPosition | None, worst: Sequence[Worst]
) -> str:
    """Return the report of a plan.

    Returns
    -------
    str
        HTML.
    """
    span = time_words(plan, 0)
    if len(plan.times_s) > 1:
        span = f"{span} to {time_words(plan, len(plan.times_s) - 1)}, {len(plan.times_s)} times"
        if plan.dates is not None:
            span = f"{plan.dates[0]:%Y-%m-%d} {span}"
    better = "" if found is None else f"{found_words(plan, found)}."
    return html_page(
        "scene", title=f"Flare plan: {plan.scene.name}", plan=plan, span=span, ranking=_ranking(plan, ranked),
        over_time=_over_time(plan) if len(plan.times_s) > 1 else (), shots=_shots(plan, shots) if shots else None,
        map=_map(plan, found), found=found, better=better[:1].upper() + better[1:],
        worst=_worst(plan, worst) if worst else None,
    )  # fmt: skip


def _ranking(plan: Plan, ranked: Sequence[Ranked]) -> dict[str, Any]:
    scene = plan.scene
    with_contrast = scene.luminance_cd_m2 is not None
    moving = len(plan.times_s) > 1
    head = ["camera", "light", "mean veil, cd/m²" if moving else "veil, cd/m²"]
    head += ["worst, cd/m²", "at"] if moving else []
    head += ["degrees off axis"]
    doubted = any(one.known_share < 1.0 for one in ranked)
    head += ["remaining contrast"] if with_contrast else []
    head += ["time under 90 %"] if with_contrast and moving else []
    head += ["brightest spot, stops from clipping"]
    head += ["known in"] if doubted else []
    rows = []
    for one in ranked[:ROWS]:
        row = [scene.cameras[one.camera].name, scene.lights[one.light].name]
        if one.worst is None:
            row += ["not known", *["-"] * (len(head) - 4), "0% of the times"]
        else:
            row += [_cell(one.mean_veil_cd_m2, number)]
            row += [_cell(one.worst_veil_cd_m2, number), time_words(plan, one.worst)] if moving else []
            row += [_cell(one.worst_constellation_deg, "{:.1f}".format)]
            row += [_cell(one.contrast_left, "{:.1%}".format)] if with_contrast else []
            row += [_cell(one.seen_share, "{:.0%}".format)] if with_contrast and moving else []
            row += [_cell(one.brightest_stops, "{:+.1f}".format)]
            row += [f"{one.known_share:.0%} of the times"] if doubted else []
        rows.append(row)
    return {"head": head, "rows": rows, "doubted": doubted, "left": max(len(ranked) - ROWS, 0)}


def _cell(value: float | None, words: Callable[[float], str]) -> str:
    return "-" if value is None else words(value)


def _over_time(plan: Plan) -> list[Chart]:
    hours, ticks, label = _time_axis(plan)
    cameras = plan.scene.cameras
    veils = [
        Series(camera.name, hours, plan.veil(c), COLOURS[c % len(COLOURS)]) for c, camera in enumerate(cameras[:LINES])
    ]
    drawn = [
        chart(
            "veil of all lights", veils, x_label=label, y_label="cd/m²", logarithmic=True, size=(700, 300),
            x_ticks=ticks,
        )
    ]  # fmt: skip
    if plan.scene.luminance_cd_m2 is not None:
        left = [Series(one.label, hours, plan.contrast_left(np.asarray(one.y)), one.colour) for one in veils]  # type: ignore[arg-type]
        drawn.append(chart("remaining contrast, K_real / K_ideal", left, x_label=label, size=(700, 300), x_ticks=ticks))
    angles: list[Series] = []
    for c, camera in enumerate(cameras[:LINES]):
        for k, light in enumerate(plan.scene.lights):
            if len(angles) < LINES:
                seen = plan.pairs[c][k].sighting
                lit = np.where(seen.illuminance_lx > 0.0, seen.constellation_deg, np.nan)
                name = f"{light.name} in {camera.name}"
                angles.append(Series(name, hours, lit, COLOURS[len(angles) % len(COLOURS)]))
    drawn.append(chart("constellation, degrees off axis", angles, x_label=label, size=(700, 300), x_ticks=ticks))
    return drawn


def _time_axis(plan: Plan) -> tuple[Floats, list[tuple[float, str]] | None, str]:
    """Return positions along the time axis, ticks and label: the clock time if the scene has one."""
    if plan.dates is None:
        return plan.times_s, None, "seconds"
    chosen = range(0, len(plan.dates), -(-len(plan.dates) // 9))
    long = plan.times_s[-1] > 2.0 * 86400.0
    form = "%d.%m. %H:%M" if long else "%H:%M" if plan.times_s[-1] > 600.0 else "%H:%M:%S"
    return plan.times_s, [(float(plan.times_s[k]), plan.dates[k].strftime(form)) for k in chosen], "time"


def _shots(plan: Plan, shots: Sequence[Shot]) -> dict[str, Any]:
    width, left = 700, 130.0
    cameras = plan.scene.cameras
    height = 40 + 22 * len(cameras)
    span = max(float(plan.times_s[-1]), 1e-9)
    across = (width - left - 14.0) / span
    marks: list[Mark] = []
    for c, camera in enumerate(cameras):
        y = 12.0 + 22.0 * c
        marks += [Text(left - 8.0, y + 12.0, camera.name[:20], 11.0, INK, "end")]
        marks += [Line([(left, y + 8.0), (width - 14.0, y + 8.0)], "#e3e8ed")]
    for shot in shots:
        start, end = float(plan.times_s[shot.first]), float(plan.times_s[shot.until])
        y = 12.0 + 22.0 * shot.camera
        colour = COLOURS[shot.camera % len(COLOURS)]
        marks.append(Box(left + start * across, y, max((end - start) * across, 2.0), 16.0, colour))
    _, ticks, _ = _time_axis(plan)
    for at, words in ticks or [(float(t), f"{t:.4g} s") for t in np.linspace(0.0, span, 7)]:
        marks.append(Text(left + at * across, height - 8.0, words, 10.0, FAINT, "middle"))
    rows = [(cameras[shot.camera].name, time_words(plan, shot.first), time_words(plan, shot.until)) for shot in shots]
    doubted = any(np.isnan(plan.veil(c)).any() for c in range(len(cameras)))
    return {
        "chart": Chart(width, height, "Which camera when", tuple(marks)),
        "head": ("camera", "from", "to", *["flare not known in"] * doubted),
        "rows": [
            (*row, *[f"{unknown_share(plan, shot):.0%} of the times"] * doubted)
            for row, shot in zip(rows, shots, strict=True)
        ],
        "doubted": doubted,
    }


def _map(plan: Plan, found: BestPosition | None) -> Chart:
    """Draw the plan from above: cameras with their views, lamps, directions of distant lights, tried positions."""
    size, edge = 560.0, 40.0
    spots = [track.position_m[:, :2] for track in plan.tracks] + [track.aim_m[:, :2] for track in plan.tracks]
    lamps = {
        k: lamp_places(light, plan.times_s) for k, light in enumerate(plan.scene.lights) if isinstance(light, Lamp)
    }
    spots += [places[:, :2] for places in lamps.values()]
    if found is not None:
        spots.append(plan.tracks[found.camera].position_m[0, :2] + found.offsets_m[:, :2])
    whole = np.concatenate(spots)
    low, high = whole.min(axis=0), whole.max(axis=0)
    scale = (size - 2.0 * edge) / max(float((high - low).max()), 1e-6)
    middle = 0.5 * (low + high)

    def place(spot: Floats) -> tuple[float, float]:
        x, y = (spot[:2] - middle) * scale
        return 0.5 * size + float(x), 0.5 * size - float(y)

    marks: list[Mark] = []
    if found is not None:
        marks += _tried(plan, found, place)
    for c, (camera, track) in enumerate(zip(plan.scene.cameras, plan.tracks, strict=True)):
        colour = COLOURS[c % len(COLOURS)]
        if len(plan.times_s) > 1:
            marks.append(Line([place(spot) for spot in track.position_m], colour, 1.0))
        at = place(track.position_m[0])
        marks += [Line([at, place(track.aim_m[0])], "#cdd6dd", 1.0), Box(at[0] - 4.0, at[1] - 4.0, 8.0, 8.0, colour)]
        marks.append(Text(at[0] + 7.0, at[1] + 4.0, camera.name, 11.0, colour))
    for k, light in enumerate(plan.scene.lights):
        if isinstance(light, Lamp):
            x, y = place(lamps[k][0])
            if np.ptp(lamps[k], axis=0).any():
                marks.append(Line([place(spot) for spot in lamps[k]], "#b06d10", 1.0))
            marks += [
                Line([(x - 4.0, y), (x + 4.0, y)], "#b06d10", 2.5),
                Line([(x, y - 4.0), (x, y + 4.0)], "#b06d10", 2.5),
            ]
            marks.append(Text(x + 7.0, y - 4.0, light.name, 11.0, "#b06d10"))
        else:
            marks += _far(plan, k, light.name, size)
    bar = 10.0 ** np.floor(np.log10(0.4 * size / scale))
    marks += [
        Line([(14.0, size - 14.0), (14.0 + bar * scale, size - 14.0)], INK, 2.0),
        Text(14.0, size - 20.0, f"{bar:g} m", 10.0),
    ]
    return Chart(int(size), int(size), "Plan from above", tuple(marks))


def _far(plan: Plan, k: int, name: str, size: float) -> list[Mark]:
    """Draw the direction of a distant light at the edge of the plan, as an arc over time."""
    track, seen = plan.tracks[0], plan.pairs[0][k].sighting
    angle, roll = np.radians(seen.constellation_deg), np.radians(seen.roll_deg)
    local = np.stack([np.sin(angle) * np.cos(roll), np.sin(angle) * np.sin(roll), np.cos(angle)], axis=-1)
    world = np.einsum("tji,tj->ti", track.axes, local)
    flat = np.hypot(world[:, 0], world[:, 1])
    lit = (seen.illuminance_lx > 0.0) & (flat > 1e-6)
    if not lit.any():
        return []
    reach = 0.5 * size - 16.0
    ends = [
        (0.5 * size + reach * float(x / f), 0.5 * size - reach * float(y / f))
        for (x, y, _), f in zip(world[lit], flat[lit], strict=True)
    ]
    marks: list[Mark] = [Line(ends, "#e0a11e", 3.0)] if len(ends) > 1 else []
    x, y = ends[0]
    marks += [Box(x - 4.0, y - 4.0, 8.0, 8.0, "#e0a11e")]
    marks.append(
        Text(min(max(x, 40.0), size - 40.0), y + (16.0 if y < 0.5 * size else -9.0), name, 11.0, "#b06d10", "middle")
    )
    return marks


def _tried(plan: Plan, found: BestPosition, place: Callable[[Floats], tuple[float, float]]) -> list[Mark]:
    marks: list[Mark] = []
    start = plan.tracks[found.camera].position_m[0]
    finite = found.veils_cd_m2[np.isfinite(found.veils_cd_m2)]
    low, high = float(finite.min(initial=np.inf)), float(finite.max(initial=-np.inf))
    for offset, veil in zip(found.offsets_m[1:], found.veils_cd_m2[1:], strict=True):
        if np.isinf(veil):
            continue
        part = (float(veil) - low) / (high - low) if high > low else 0.0
        colour = _UNKNOWN if np.isnan(veil) else f"#{round(70 + 150 * part):02x}{round(170 - 110 * part):02x}60"
        x, y = place(start + offset)
        marks.append(Box(x - 2.0, y - 2.0, 4.0, 4.0, colour))
    if found.better:
        x, y = place(start + found.offsets_m[found.best])
        marks += [
            Line([(x - 5, y - 5), (x + 5, y - 5), (x + 5, y + 5), (x - 5, y + 5), (x - 5, y - 5)], "#1d7a4b", 2.0)
        ]
    return marks


def _worst(plan: Plan, worst: Sequence[Worst]) -> dict[str, Any]:
    scene = plan.scene
    pictures = [one.picture for one in worst]
    if scene.luminance_cd_m2 is not None:
        # the brightest luminance of the scene is white
        stops = -float(np.log2(scene.luminance_cd_m2[1]))
        shown = [view(picture, stops) for picture in pictures]
        how = f"at the scene's exposure: white is {number(scene.luminance_cd_m2[1])} cd/m²"
    else:
        shown, stops = shown_together(pictures)
        how = "all at one exposure"
    images = []
    rows = []
    for found, pixels in zip(worst, shown, strict=True):
        one, mean = found.ranked, found.veil_cd_m2
        camera, light = scene.cameras[one.camera].name, scene.lights[one.light].name
        assert one.worst is not None
        assert one.worst_veil_cd_m2 is not None
        words = f"{light} in {camera}, {time_words(plan, one.worst)}, {one.worst_constellation_deg:.1f} degrees"
        if np.count_nonzero(pixels >= DARKEST_SHOWN) >= FEWEST_SHOWN:
            images.append((pixels, words))
        ratio = one.worst_veil_cd_m2 / mean if mean > 0.0 else float("nan")
        washed = "-" if found.washed is None else f"{found.washed:.0%}"
        rows.append((camera, light, number(one.worst_veil_cd_m2), number(mean), number(ratio), washed))
    return {"pictures": images, "how": how, "rows": rows}
