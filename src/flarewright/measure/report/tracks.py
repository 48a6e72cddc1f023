"""Report section about tracks: births, deaths, and the values of each ghost in each frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...io.images.html_page import html_page
from ...model.measurement.ghost_tracks import GhostTrack, Step, Tracks, Turn
from ...render.plots.chart import Series, chart
from ...render.plots.svg import Chart

# factor by which other ghosts widen an error from which the table lists a crossing
_CROSSING = 1.5
_WORDS = {"range": "where the captures end", "fade": "fades", "frame": "at the frame's border", "hidden": "hidden"}


def tracks_section(tracks: Tracks, colours: Mapping[str, str]) -> str:
    """Return the report's section about tracks, as HTML.

    Parameters
    ----------
    tracks : Tracks
    colours : mapping of str to str
        Colour of each ghost in the charts, by name.
    """
    drawn = [track for track in tracks.ghosts if track.name in colours]
    charts = [
        _chart("Brightness relative to the fit", drawn, colours, lambda step: step.brightness, "factor"),
        _chart("Place, towards the light", drawn, colours, lambda step: step.along_px, "pixels from the fit"),
        _chart("Size relative to the fit", drawn, colours, lambda step: step.size, "factor"),
    ]
    return html_page("measured/tracks", charts=charts, rows=[row for track in tracks.ghosts for row in _rows(track)])


def _chart(
    title: str,
    tracks: list[GhostTrack],
    colours: Mapping[str, str],
    value: Callable[[Step], float | None],
    y_label: str,
) -> Chart:
    lines = []
    for track in tracks:
        at = [step.constellation_deg for step in track.steps]
        found = [value(step) if step.state == "seen" else None for step in track.steps]
        shown = np.array([np.nan if one is None else one for one in found])
        lines.append(Series(track.name, at, shown, colours[track.name]))
    return chart(title, lines, x_label="constellation, degrees", y_label=y_label)


def _rows(track: GhostTrack) -> list[tuple[str, ...]]:
    seen = sum(step.state == "seen" for step in track.steps)
    crossed = [step.constellation_deg for step in track.steps if step.state == "seen" and step.crossing > _CROSSING]
    where = f"{min(crossed):.1f} to {max(crossed):.1f}" if crossed else ""
    if not track.lives:
        return [(track.name, "never", "", "", "", "0", "")]
    return [
        (track.name, _degrees(life.birth), _WORDS[life.birth.how], _degrees(life.death), _WORDS[life.death.how],
         str(seen), where)
        for life in track.lives
    ]  # fmt: skip


def _degrees(turn: Turn) -> str:
    return f"{turn.constellation_deg:.2f} ± {turn.error_deg:.2g}" if turn.error_deg else f"{turn.constellation_deg:.2f}"
