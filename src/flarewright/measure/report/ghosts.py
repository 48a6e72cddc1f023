"""Report section about the ghosts: the path of each over the constellation, and its light."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...io.images.html_page import html_page
from ...model.measurement.ghost_model import GhostModel
from ...render.plots.chart import COLOURS, Series, chart, number
from ...typing import Floats
from .frames import bare, ghosts_alone

# constellations at which each ghost is drawn alone, and the width of the drawing, pixels
_SAMPLES, _WIDTH_PX = 32, 240
# a ghost is in the picture while its light is at least this part of its maximum
_LEAST_LIGHT = 1e-3


@dataclass(frozen=True)
class Paths:
    """Paths of ghosts over the constellation, brightest ghost first.

    Attributes
    ----------
    names : tuple of str
    constellation_deg : ndarray, shape (T,)
    place_px : ndarray, shape (G, T)
        Centroid of the light inside the picture, measured from the axis, positive towards the light at positive
        constellations; NaN outside.
    light : ndarray, shape (G, T)
        Radiance times pixels, inside the picture; NaN outside.
    """

    names: tuple[str, ...]
    constellation_deg: Floats
    place_px: Floats
    light: Floats

    def colours(self) -> dict[str, str]:
        """Return a colour for each of the brightest ghosts, as many as are distinguishable."""
        return dict(zip(self.names, COLOURS, strict=False))


def paths_of(model: GhostModel) -> Paths:
    """Compute the path of each ghost from small drawings, positive constellations to the right of the axis."""
    low, high = model.constellation_deg
    steps = np.linspace(low, high, _SAMPLES)
    size = _WIDTH_PX, max(1, round(_WIDTH_PX * model.size_px[1] / model.size_px[0]))
    scale = model.size_px[0] / size[0]
    names = [ghost.name for ghost in model.ghosts]
    place = np.full((len(names), steps.size), np.nan)
    light = np.full((len(names), steps.size), np.nan)
    alone = bare(model)
    for k, angle in enumerate(steps):
        drawn = ghosts_alone(alone, float(angle), 0.0, size)
        for row, name in enumerate(names):
            if name in drawn:
                columns = drawn[name].pixels.mean(axis=2, dtype=np.float64).sum(axis=0)
                total = float(columns.sum())
                middle = drawn[name].window[0] + float(columns @ (np.arange(columns.size) + 0.5)) / total
                place[row, k], light[row, k] = middle * scale - model.axis_px[0], total * scale**2
    most = np.nan_to_num(light).max(axis=1, initial=0.0)
    gone = np.isfinite(light) & ~(light >= _LEAST_LIGHT * most[:, None])
    place[gone] = light[gone] = np.nan
    order = np.argsort(-most, kind="stable")
    return Paths(tuple(names[k] for k in order), steps, place[order], light[order])


def ghosts_section(paths: Paths, model: GhostModel, colours: Mapping[str, str]) -> str:
    """Return the report's section about ghosts, as HTML."""
    angles = paths.constellation_deg
    drawn = [(k, name) for k, name in enumerate(paths.names) if name in colours]
    place = [Series(name, angles, paths.place_px[k], colours[name]) for k, name in drawn]
    light = [Series(name, angles, paths.light[k], colours[name]) for k, name in drawn]
    charts = [
        chart("Where the ghosts' light is", place, x_label="constellation, degrees", y_label="pixels from the axis"),
        chart("How much light they hold", light, x_label="constellation, degrees", y_label="radiance x pixels",
              logarithmic=True),
    ]  # fmt: skip
    rows = [_row(name, angles, paths.place_px[k], paths.light[k]) for k, name in enumerate(paths.names)]
    return html_page("measured/ghosts", shown=len(drawn), charts=charts, rows=rows, sentences=model.remarks)


def _row(name: str, angles: Floats, place: Floats, light: Floats) -> tuple[str, ...]:
    there = np.isfinite(light)
    if not there.any():
        return name, "never", "", "", ""
    at = angles[there]
    return (name, f"{at[0]:.1f} to {at[-1]:.1f}", _whole(place[there][0]), _whole(place[there][-1]),
            number(float(np.nanmax(light))))  # fmt: skip


def _whole(value: float) -> str:
    # the integer format avoids "-0"
    return f"{round(value):d}"
