"""Resolve the rules of art direction into overrides per path and per pass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import hypot
from typing import Any

import numpy as np

from ...errors import ProjectError
from ...model import Layer, Project
from ...model.project.art import SELECTOR, Rule
from ...optics.lens.paths import LightPath, ghost_paths, mirrors_of
from ...optics.lens.tolerances import ghost_offset
from ...optics.rays.bundle import incidence
from ...optics.rays.ghost_table import GhostQuery, GhostTable, bounding_edges, ghost_table, pack_for_query
from ...optics.rays.pack import PackedLens
from ...typing import Floats
from .resolve import ResolvedProject, distance_in_front

Ramp = tuple[tuple[float, float, float, float], ...]

# standard deviations after which a Gaussian is truncated
REACH = 4.0
# a light's intensity times this still fits float32
MOST_GAIN = 1e18
# largest blur relative to the picture's width: more would need planes of many times its size
WIDEST_BLUR = 0.125


@dataclass(frozen=True)
class Frame:
    """Position of a ghost without overrides: its centre and the radius of an equal uniform disc, upright, mm."""

    centre: tuple[float, float]
    radius: float


@dataclass(frozen=True)
class PathArt:
    """Overrides of one path; the default changes nothing.

    Attributes
    ----------
    enabled : bool
    rgb : tuple of float
        Gain and tint.
    ramps : tuple of Ramp
    offset : tuple of float
        Right and up, mm.
    scale : float
    blur : float
        Standard deviation, mm.
    """

    enabled: bool = True
    rgb: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ramps: tuple[Ramp, ...] = ()
    offset: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0
    blur: float = 0.0

    @property
    def framed(self) -> bool:
        """Whether the overrides need the ghost's centre."""
        return self.scale != 1.0 or bool(self.ramps)

    @property
    def alone(self) -> bool:
        """Whether the ghost needs a separate plane."""
        return self.blur > 0.0 or bool(self.ramps)

    @cached_property
    def visible_gain(self) -> float:
        """Largest factor on the ghost's brightness anywhere, for culling and level of detail."""
        gain = max(self.rgb)
        for ramp in self.ramps:
            gain *= max(max(stop[1:]) for stop in ramp)
        return gain

    def place(self, to_pixels: Floats, frame: Frame | None) -> Floats:
        """Return the map from sensor to pixels that moves and scales the ghost.

        Parameters
        ----------
        to_pixels : ndarray, shape (4,)
            Column and row of the axis, pixels per mm across and down.
        frame : Frame or None
            Required if `scale` is not 1.

        Returns
        -------
        ndarray, shape (4,)
        """
        if self.scale == 1.0 and self.offset == (0.0, 0.0):
            return to_pixels
        x, y = (0.0, 0.0) if frame is None else frame.centre
        right, up = x * (1.0 - self.scale) + self.offset[0], y * (1.0 - self.scale) + self.offset[1]
        column, row, across, down = to_pixels
        return np.array([column + right * across, row - up * down, across * self.scale, down * self.scale])

    def view_radius(self, radius: float, frame: Frame | None) -> float:
        """Return the distance from the axis within which light can enter a picture of this radius, mm."""
        reach = (radius + REACH * self.blur + hypot(*self.offset)) / self.scale
        return reach + (hypot(*frame.centre) * abs(1.0 - 1.0 / self.scale) if frame is not None else 0.0)

    def margin(self, to_pixels: Floats) -> tuple[int, int]:
        """Return the columns and rows around the picture from which a blur moves light into it."""
        if self.blur == 0.0:
            return 0, 0
        return int(np.ceil(REACH * self.blur * to_pixels[2])) + 4, int(np.ceil(REACH * self.blur * to_pixels[3])) + 4

    def text(self) -> str:
        """Return the overrides as text, for the layer's metadata."""
        words = []
        if self.rgb != (1.0, 1.0, 1.0):
            words.append("rgb gain " + ",".join(f"{value:g}" for value in self.rgb))
        if self.ramps:
            words.append("ramp " + " ".join(",".join(f"{v:g}" for v in stop) for ramp in self.ramps for stop in ramp))
        if self.offset != (0.0, 0.0):
            words.append(f"offset {self.offset[0]:g},{self.offset[1]:g} mm")
        if self.scale != 1.0:
            words.append(f"scale {self.scale:g}")
        if self.blur:
            words.append(f"blur {self.blur:g} mm")
        return "; ".join(words)


PLAIN = PathArt()


@dataclass(frozen=True)
class ResolvedArt:
    """A project's art direction for one lens.

    Attributes
    ----------
    paths : mapping of str to PathArt
        By path name, without unchanged paths.
    gain : mapping of str to float
        Gains other than 1, by the layer name of a pass.
    """

    paths: Mapping[str, PathArt] = field(default_factory=dict)
    gain: Mapping[str, float] = field(default_factory=dict)

    @property
    def physical(self) -> bool:
        """Whether nothing is changed."""
        return not self.paths and not self.gain


def has_overrides(project: Project) -> bool:
    """Return whether a project changes ghosts by art rules or by random offsets."""
    art, sample = project.art, project.imperfection
    moved = sample is not None and sample.ghost_offset_mm > 0.0
    return not art.physical and bool(art.rules or art.gain or moved)


def resolve_art(settled: ResolvedProject, fours: tuple[LightPath, ...] | None = None) -> ResolvedArt:
    """Select the ghosts of every rule and combine the overrides; random offsets of the sample come first.

    Parameters
    ----------
    settled : ResolvedProject
    fours : tuple of LightPath, optional
        Ghosts of four reflections, which `largest` and `brightest` ignore. None: all two-reflection ghosts.

    Returns
    -------
    ResolvedArt
        Empty if `art.physical` is set.

    Raises
    ------
    ProjectError
        A rule names a path or row that the lens does not have, a blur is too wide, or the gains multiply to too much.
    """
    art, project = settled.project.art, settled.project
    if not has_overrides(project):
        return ResolvedArt()
    paths = ghost_paths(settled.lens, project.quality.paths, sensor=settled.sensor is not None)
    facts = _Facts(settled, paths if fours is None else fours)
    sample = project.imperfection
    found = dict.fromkeys(facts.names, PLAIN)
    if sample is not None:
        found = {path.name: replace(PLAIN, offset=ghost_offset(path, sample)) for path in facts.paths}
    across = project.camera.size_px[0] / project.camera.sensor[0]
    down = project.camera.size_px[1] / project.camera.sensor[1]
    for k, rule in enumerate(art.rules):
        for name in _chosen(facts, rule.select, f"art.rules[{k}], {rule.select!r}"):
            found[name] = _with(found[name], rule, across, down)
    widest = WIDEST_BLUR * project.camera.sensor[0]
    for name, changed in found.items():
        if changed.blur > widest:
            raise ProjectError(
                f"art.rules: ghost {name} is blurred by {changed.blur:g} mm, more than an eighth of the sensor's "
                f"width; keep the blur below {widest:g} mm ({widest * across:.0f} pixels)"
            )
        if (gain := changed.visible_gain * art.gain.get("ghosts", 1.0)) > MOST_GAIN:
            raise ProjectError(
                f"the gains, tints and ramps of ghost {name} and the pass gain multiply its light by {gain:.3g}; keep "
                f"their product below {MOST_GAIN:g}"
            )
    changes = {name: changed for name, changed in found.items() if changed != PLAIN}
    return ResolvedArt(changes, {name: gain for name, gain in art.gain.items() if gain != 1.0})


def with_gain(layer: Layer, gain: float) -> Layer:
    """Return a layer multiplied by a gain, which its metadata record."""
    if gain == 1.0:
        return layer
    about: dict[str, Any] = {**layer.about, "pass_gain": gain}
    if "flux_mm2" in about:
        about["flux_mm2"] *= gain
    return replace(layer, pixels=layer.pixels * np.float32(gain), about=about)


def _with(art: PathArt, rule: Rule, across: float, down: float) -> PathArt:
    """Combine a rule with previous overrides."""
    red, green, blue = (a * rule.gain * b for a, b in zip(art.rgb, rule.tint, strict=True))
    right, up = rule.offset_mm or (0.0, 0.0)
    if rule.offset_px is not None:
        right, up = rule.offset_px[0] / across, rule.offset_px[1] / down
    blur = rule.blur_px / across if rule.blur_px is not None else rule.blur_mm or 0.0
    return PathArt(
        enabled=art.enabled if rule.enable is None else rule.enable,
        rgb=(red, green, blue),
        ramps=(*art.ramps, rule.ramp) if rule.ramp else art.ramps,
        offset=(art.offset[0] + right, art.offset[1] + up),
        scale=art.scale * rule.scale,
        blur=hypot(art.blur, blur),
    )


class _Facts:
    """Properties of paths that selectors test; the ghost analysis runs only if needed."""

    def __init__(self, settled: ResolvedProject, paths: tuple[LightPath, ...]) -> None:
        self.settled, self.paths = settled, paths
        self.names = [path.name for path in paths]

    @cached_property
    def tables(self) -> list[GhostTable]:
        """The ghost analysis for every light."""
        settled, paths = self.settled, self.settled.project.quality.paths
        queries = [
            GhostQuery(light.field_deg, distance, paths=paths, sensor=settled.sensor)
            for light, distance in zip(settled.project.lights, self.distances, strict=True)
        ]
        return [ghost_table(settled.lens, self.packed, query) for query in queries]

    @cached_property
    def packed(self) -> PackedLens:
        """The lens at the one wavelength of the analysis."""
        settled = self.settled
        query = GhostQuery((0.0, 0.0), sensor=settled.sensor)
        return pack_for_query(settled.lens, settled.order, settled.coating, query)

    @cached_property
    def distances(self) -> list[float | None]:
        """The distance of each light from the first row, mm; None: infinite."""
        return [distance_in_front(self.settled, self.packed, k) for k in range(len(self.settled.project.lights))]

    def may_be(self, name: str) -> bool:
        """Return whether a name that is not among the paths belongs to another number of reflections."""
        quality, lens = self.settled.project.quality, self.settled.lens
        count = len(lens.rows)
        rows = mirrors_of(name, count)
        if ("sensor" in name and self.settled.sensor is None) or str(count) in name.split("-"):
            return False
        if len(rows) not in (2, 4) or quality.orders == 2 or max(rows) > count or lens.stop_row in rows:
            return False
        if quality.paths != "all" and len({row < lens.stop_row for row in rows}) > 1:
            return False
        return all((b < a) == (k % 2 == 0) and a != b for k, (a, b) in enumerate(pairwise(rows)))

    def ranked(self, measure: str) -> list[str]:
        """Return names sorted by total throughput of all lights, or by largest rms radius, without dark paths."""
        score: dict[str, float] = dict.fromkeys(self.names, 0.0)
        lit: set[str] = set()
        if any(path.later_reflections for path in self.paths):
            return []
        for table, light in zip(self.tables, self.settled.project.lights, strict=True):
            for row in table.ghosts:
                name = row.name
                if row.throughput_mm2 * light.intensity > 0.0:
                    lit.add(name)
                    flux = row.throughput_mm2 * light.intensity
                    score[name] = score[name] + flux if measure == "brightest" else max(score[name], row.rms_radius_mm)
        return sorted(lit, key=lambda name: (-score[name], self.names.index(name)))

    @cached_property
    def bounds(self) -> dict[str, set[str]]:
        """The edges that bound each path's ghosts; those of near lights may differ."""
        settled, found = self.settled, {name: set[str]() for name in self.names}
        seen = [
            incidence(light.field_deg, distance, settled.order.entrance_pupil_z)
            for light, distance in zip(settled.project.lights, self.distances, strict=True)
        ]
        for nearness in {light.nearness / light.tilt_cosine for light in seen}:
            edges = bounding_edges(settled.lens, settled.order, self.paths, nearness)
            for name, edge in zip(self.names, edges, strict=True):
                found[name].add(edge)
        return found


def _chosen(facts: _Facts, select: str, where: str) -> list[str]:
    """Return the names of the paths that a selector matches."""
    match = SELECTOR.fullmatch(select)
    assert match is not None, "the model rejects any other text"
    lens = facts.settled.lens
    if match["names"]:
        chosen = set(match["names"].split(","))
        if single := sorted(name for name in chosen if "-" not in name):
            raise ProjectError(
                f"{where}: {single[0]} is not a path of {lens.name}; name two rows like 7-3, or the paths of one, "
                f"row:{single[0]}"
            )
        if facts.settled.sensor is None and (dark := sorted(name for name in chosen if "sensor" in name)):
            raise ProjectError(
                f"{where}: there is no ghost {dark[0]} while the sensor reflects nothing; set "
                "camera.sensor_reflectance (--sensor-reflectance) above 0"
            )
        if unknown := sorted(name for name in chosen - set(facts.names) if not facts.may_be(name)):
            raise ProjectError(
                f"{where}: {lens.name} has no ghost {unknown[0]}; a path J-I reflects at row J, then at row I < J, "
                f"both between 0 and {len(lens.rows) - 1} and neither the stop (row {lens.stop_row})"
                + ("; only paths on one side of the stop are drawn" if len(facts.names) < _pairs(lens.rows) else "")
            )
    elif match["row"]:
        row = int(match["row"])
        if row >= len(lens.rows) or row == lens.stop_row:
            raise ProjectError(
                f"{where}: nothing reflects at row {row} of {lens.name}; its surfaces are rows 0 to "
                f"{len(lens.rows) - 1} without the stop (row {lens.stop_row})"
            )
        chosen = {path.name for path in facts.paths if row in path.mirrors}
    elif match["bounded"]:
        chosen = {name for name, edges in facts.bounds.items() if match["bounded"] in edges}
    elif match["largest"] or match["brightest"]:
        kind = "largest" if match["largest"] else "brightest"
        chosen = set(facts.ranked(kind)[: int(match[kind])])
    else:
        chosen = set(facts.names)
    return [name for name in facts.names if (name in chosen) != bool(match["opposite"])]


def _pairs(rows: Sequence[object]) -> int:
    surfaces = len(rows) - 1
    return surfaces * (surfaces - 1) // 2
