"""Art direction resolved: from a project's rules to what is changed about each path and each pass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..model import Layer, Project
from ..model.art import SELECTOR, Rule
from ..optics.ghosts import GhostTable, bounding_edges, ghost_table
from ..optics.imperfection import ghost_offset
from ..optics.paths import LightPath, ghost_paths
from .prepare import Settled

Floats = NDArray[np.float64]
Ramp = tuple[tuple[float, float, float, float], ...]

# a Gaussian is followed this many standard deviations
REACH = 4.0
# a light's intensity times this is still a number of 32 bits
MOST_GAIN = 1e18
# beyond this part of the picture's width a blur would need planes many times its size
WIDEST_BLUR = 0.125


@dataclass(frozen=True)
class Frame:
    """Where a ghost lies by itself: its centre and the radius of the even disc of its size, upright, mm."""

    centre: tuple[float, float]
    radius: float


@dataclass(frozen=True)
class PathArt:
    """What is changed about one path; the default changes nothing.

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
        """Whether the ghost's centre must be known."""
        return self.scale != 1.0 or bool(self.ramps)

    @property
    def alone(self) -> bool:
        """Whether the ghost needs a plane of its own."""
        return self.blur > 0.0 or bool(self.ramps)

    @cached_property
    def visible_gain(self) -> float:
        """How much brighter the ghost may become anywhere: what culling and level of detail go by."""
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
            Needed when `scale` is not 1.

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
        """Return how far from the axis light may land and yet come into a picture of this radius, mm."""
        reach = (radius + REACH * self.blur + hypot(*self.offset)) / self.scale
        return reach + (hypot(*frame.centre) * abs(1.0 - 1.0 / self.scale) if frame is not None else 0.0)

    def margin(self, to_pixels: Floats) -> tuple[int, int]:
        """Return the columns and rows around the picture from which a blur brings light in."""
        if self.blur == 0.0:
            return 0, 0
        return int(np.ceil(REACH * self.blur * to_pixels[2])) + 4, int(np.ceil(REACH * self.blur * to_pixels[3])) + 4

    def text(self) -> str:
        """Say what is changed, for the layer's metadata."""
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
        By path name; paths that nothing changes are left out.
    gain : mapping of str to float
        By layer name of a pass; those of 1 are left out.
    """

    paths: Mapping[str, PathArt] = field(default_factory=dict)
    gain: Mapping[str, float] = field(default_factory=dict)

    @property
    def physical(self) -> bool:
        """True when nothing is changed."""
        return not self.paths and not self.gain


def directed(project: Project) -> bool:
    """Tell whether a project changes ghosts by hand, or by chance without a cause."""
    art, sample = project.art, project.imperfection
    moved = sample is not None and sample.ghost_offset_mm > 0.0
    return not art.physical and bool(art.rules or art.gain or moved)


def resolve_art(settled: Settled, fours: tuple[LightPath, ...] | None = None) -> ResolvedArt:
    """Find out which ghosts the rules choose, and add up what they change; offsets by chance come first.

    Parameters
    ----------
    settled : Settled
    fours : tuple of LightPath, optional
        Ghosts of four reflections, which no rule counts among the largest or brightest. None: all of two are asked for.

    Returns
    -------
    ResolvedArt
        Empty when `art.physical` is set.

    Raises
    ------
    ProjectError
        When a rule names a path or row that the lens does not have, a blur is too wide, or gains are too much together.
    """
    art, project = settled.project.art, settled.project
    if not directed(project):
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


def graded(layer: Layer, gain: float) -> Layer:
    """Return a layer whose light is multiplied, and which says so."""
    if gain == 1.0:
        return layer
    about: dict[str, Any] = {**layer.about, "pass_gain": gain}
    if "flux_mm2" in about:
        about["flux_mm2"] *= gain
    return replace(layer, pixels=layer.pixels * np.float32(gain), about=about)


def _with(art: PathArt, rule: Rule, across: float, down: float) -> PathArt:
    """Add a rule to what is changed already."""
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
    """What selectors ask about; the costly analysis is made when one asks for it."""

    def __init__(self, settled: Settled, paths: tuple[LightPath, ...]) -> None:
        self.settled, self.paths = settled, paths
        self.names = [path.name for path in paths]

    @cached_property
    def tables(self) -> list[GhostTable]:
        """The ghost analysis for every light."""
        project, order = self.settled.project, self.settled.order
        return [
            ghost_table(
                self.settled.lens,
                light.field_deg,
                f_number=project.f_number,
                coating=self.settled.coating,
                paths=project.quality.paths,
                sensor_distance=order.sensor_distance,
                sensor=self.settled.sensor,
            )
            for light in project.lights
        ]

    def may_be(self, name: str) -> bool:
        """Tell whether a name that is not among the paths is one of another number of reflections."""
        quality, lens = self.settled.project.quality, self.settled.lens
        count = len(lens.rows)
        rows = [count if row == "sensor" else int(row) for row in name.split("-")]
        if ("sensor" in name and self.settled.sensor is None) or str(count) in name.split("-"):
            return False
        if len(rows) not in (2, 4) or quality.orders == 2 or max(rows) > count or lens.stop_row in rows:
            return False
        if quality.paths != "all" and len({row < lens.stop_row for row in rows}) > 1:
            return False
        return all((b < a) == (k % 2 == 0) and a != b for k, (a, b) in enumerate(pairwise(rows)))

    def ranked(self, measure: str) -> list[str]:
        """Names by throughput of all lights together, or by the largest rms radius; dark paths are left out."""
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
    def bounds(self) -> dict[str, str]:
        """Which edge bounds each path."""
        edges = bounding_edges(self.settled.lens, self.settled.order, self.paths)
        return dict(zip(self.names, edges, strict=True))


def _chosen(facts: _Facts, select: str, where: str) -> list[str]:
    """Return the names of the paths that a selector chooses."""
    match = SELECTOR.fullmatch(select)
    assert match is not None, "the model lets no other text through"
    lens = facts.settled.lens
    if match["names"]:
        chosen = set(match["names"].split(","))
        if single := sorted(name for name in chosen if "-" not in name):
            raise ProjectError(
                f"{where}: {single[0]} is no path of {lens.name}; name two rows like 7-3, or the paths of one, "
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
        chosen = {name for name, edge in facts.bounds.items() if edge == match["bounded"]}
    elif match["largest"] or match["brightest"]:
        kind = "largest" if match["largest"] else "brightest"
        chosen = set(facts.ranked(kind)[: int(match[kind])])
    else:
        chosen = set(facts.names)
    return [name for name in facts.names if (name in chosen) != bool(match["opposite"])]


def _pairs(rows: Sequence[object]) -> int:
    surfaces = len(rows) - 1
    return surfaces * (surfaces - 1) // 2


__all__ = ["PLAIN", "REACH", "Frame", "PathArt", "Ramp", "ResolvedArt", "directed", "graded", "resolve_art"]
