"""Changes of the prescription: cells, rows, the stop, another lens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan, degrees, isfinite, radians, tan
from typing import Any

import numpy as np

from ...errors import FlarewrightError, GlassError, LensError
from ...io.lens.coating_text import UNCOATED, coating_from, format_coating
from ...io.lens.media import attach
from ...measure.replay.measured_project import efl_mm, flare_of, is_measured
from ...model import AsLens, CoatingChoice, Iris, Lens, PerRow, Position, Preset, Project, Row, Stop, Surface
from ...model.project.art import Art
from ...optics.lens.paraxial import FirstOrder, first_order
from ...optics.lens.surface_shape import sag
from ...optics.lens.zoom import gaps_without_row
from ...optics.rays.image_height import image_heights
from ...render.scene.photographic_defaults import as_photographed, plausible_preset
from ...render.scene.resolve import open_lens
from ...sentences import INVALID
from ...typing import Floats
from ..common.messages import sentence, spoken

COLUMNS = ("radius", "thickness", "glass", "n_d", "v_d", "semi_diameter", "coating")
MOST_ROWS = 200
DISTORTION_STEP_DEG, DISTORTION_TO_DEG = 2.0, 80.0


def own_lens(project: Project) -> Lens:
    """Return the project's lens as a prescription; estimated values stay unset, so that they follow changes."""
    # a lens that forms no image cannot be completed, but it can be edited
    lens = open_lens(project.lens).lens if isinstance(project.lens, str) else project.lens
    rows = tuple(
        row.replace(semi_diameter=None, semi_diameter_estimated=False)
        if isinstance(row, Surface) and row.semi_diameter_estimated
        else row
        for row in lens.rows
    )
    return lens.replace(rows=rows)


def set_cell(project: Project, row: int, column: str, text: str) -> Project:
    """Write text into a cell of the prescription.

    Parameters
    ----------
    project : Project
    row : int
    column : str
        One of `COLUMNS`.
    text : str
        As typed by the user: "flat", "52.3", "N-BK7", "air", "quarter-wave:550"; empty: unknown, or none.

    Raises
    ------
    FlarewrightError
        When the text cannot be read, or the result is no lens.
    """
    lens = own_lens(project)
    if not 0 <= row < len(lens.rows) or column not in COLUMNS:
        raise LensError(f"there is no cell {column!r} in row {row}")
    old, words = lens.rows[row], text.strip()
    if isinstance(old, Stop):
        if column != "thickness":
            raise LensError(f"row {row} is the stop: it has a thickness only, its opening follows from the f-number")
        new: Row = old.replace(thickness=_number(words, row, column))
    else:
        try:
            new = _changed(old, row, column, words)
        except INVALID as error:
            raise LensError(f"row {row}: {sentence(error)}") from None
    rows = (*lens.rows[:row], new, *lens.rows[row + 1 :])
    if column == "coating" and not isinstance(project.coating, AsLens):
        # the cell shows the row's effective coating, so that is what it changes
        return _recoated(project, lens, row, new)
    return project.replace(lens=lens.replace(rows=rows))


def _recoated(project: Project, lens: Lens, row: int, new: Row) -> Project:
    from ...optics.rays.pack import resolve_coatings

    coats = list(resolve_coatings(lens, project.coating))
    coats[row] = new.coating if isinstance(new, Surface) else None
    return project.replace(coating=PerRow(coatings=tuple(coats)))


def _changed(old: Surface, row: int, column: str, words: str) -> Surface:
    if column == "radius":
        return old.replace(curvature=_curvature(words, row))
    if column == "thickness":
        return old.replace(thickness=_number(words, row, column))
    if column == "semi_diameter":
        return old.replace(semi_diameter=None if not words else _number(words, row, column))
    if column == "coating":
        return old.replace(coating=coating_from(words))
    return old.replace(medium=_medium(old, row, column, words))


def _medium(old: Surface, row: int, column: str, words: str) -> Any:
    """Return the medium behind a row after its glass, index or Abbe number changed."""
    if words.lower() in ("", "air", "1", "1.0", UNCOATED):
        if column == "v_d" and old.medium is not None:
            return attach(None, old.medium.n_d, None)[0]
        return None
    try:
        if column == "glass":
            return attach(words, None, None)[0]
        value = _number(words, row, column)
        if column == "n_d":
            # another index is another glass, so drop the name
            return attach(None, value, old.medium.v_d if old.medium is not None else None)[0]
        if old.medium is None:
            raise GlassError(f"row {row}: air has no V_d; write a glass or its n_d first")
        return attach(None, old.medium.n_d, value)[0]
    except GlassError as error:
        raise LensError(f"row {row}: {str(error).removeprefix(f'row {row}: ')}") from None


def _number(words: str, row: int, column: str) -> float:
    like = {"n_d": "like 1.5168", "v_d": "like 64.2"}.get(column, "in mm, like 12.5")
    try:
        value = float(words.replace(",", "."))
    except ValueError:
        raise LensError(f"row {row}: {spoken(column)} {words!r} is no number; write it {like}") from None
    if not isfinite(value):
        raise LensError(f"row {row}: {spoken(column)} {words!r} is no finite number; write it {like}")
    return value


def _curvature(words: str, row: int) -> float:
    if words.lower() in ("flat", "inf", "infinity", "plane", "∞", ""):
        return 0.0
    radius = _number(words, row, "radius")
    if abs(radius) < 1e-3:
        raise LensError(f'row {row}: radius {words} is smaller than a micrometre; a plane surface is "flat"')
    return 1.0 / radius


def add_row(project: Project, row: int) -> Project:
    """Insert a plane surface in air behind a row, at 1 mm distance where there is room."""
    lens = own_lens(project)
    if len(lens.rows) >= MOST_ROWS:
        raise LensError(f"a lens has at most {MOST_ROWS} rows here")
    old = lens.rows[row]
    gap = 0.5 * old.thickness if row + 1 < len(lens.rows) else 1.0
    medium = old.medium if isinstance(old, Surface) else None
    semi = old.semi_diameter if isinstance(old, Surface) else None
    front = old.replace(thickness=old.thickness - gap) if row + 1 < len(lens.rows) else old.replace(thickness=gap)
    new = Surface(thickness=gap, medium=medium, semi_diameter=semi)
    added = _renumbered(project, lens, (*lens.rows[:row], front, new, *lens.rows[row + 1 :]), _behind(row + 1))
    return _with_halved_gap(added, row)


def _with_halved_gap(project: Project, row: int) -> Project:
    """Give both halves of a divided gap half of it at every position that moves it."""
    lens = project.lens
    assert isinstance(lens, Lens), "rows are added to a lens of the project"
    halved = []
    for position in lens.positions:
        gaps = dict(position.gaps)
        if row in gaps:
            gaps |= {row: 0.5 * gaps[row], row + 1: 0.5 * gaps[row]}
        halved.append(_with_gaps(position, gaps))
    return _with_positions(project, tuple(halved))


def duplicate_row(project: Project, row: int) -> Project:
    """Insert a copy of a row behind it."""
    lens = own_lens(project)
    if not isinstance(lens.rows[row], Surface):
        raise LensError(f"row {row} is the stop, and a lens has one")
    return _renumbered(project, lens, (*lens.rows[: row + 1], *lens.rows[row:]), _behind(row + 1))


def remove_row(project: Project, row: int) -> Project:
    """Remove a row; the gap in front of it absorbs its thickness, and the glass in front extends to the next row."""
    lens = own_lens(project)
    gone = lens.rows[row]
    if isinstance(gone, Stop):
        raise LensError(f"row {row} is the stop, which every lens has; make another row the stop first")
    rows = list(lens.rows)
    if row > 0:
        rows[row - 1] = rows[row - 1].replace(thickness=rows[row - 1].thickness + gone.thickness)
    del rows[row]
    last = rows[-1]
    if row == len(rows) and isinstance(last, Surface):
        rows[-1] = last.replace(medium=None)
    positions = tuple(_with_gaps(position, gaps_without_row(lens, position, row)) for position in lens.positions)
    still = lens.replace(positions=())
    shorter = _renumbered(project, still, tuple(rows), lambda k: None if k == row else k - (k > row))
    return _with_positions(shorter, positions)


def move_stop(project: Project, row: int) -> Project:
    """Move the stop into the air in front of a row, or behind it where glass is in front; surfaces stay.

    Parameters
    ----------
    project : Project
    row : int
        A surface.

    Returns
    -------
    Project
        Sharpness, brightness and focus are unchanged; the ghosts are bounded elsewhere.

    Raises
    ------
    LensError
        When glass is on both sides, the stop is there already, or a zoom position has no room for it.

    Notes
    -----
    `design.finishing.lens_edits.move_stop` replaces a surface by the stop (Van Acoleyen 2025, section 5.3.3), which
    few lenses tolerate.
    """
    lens = own_lens(project)
    old, rows = lens.stop_row, lens.rows
    if not 0 <= row < len(rows) or row == old:
        raise LensError(f"row {row} is no surface; choose one between 0 and {len(rows) - 1} to put the stop next to")
    gaps = [k for k in (row, row + 1) if k < len(rows) and (k == 0 or getattr(rows[k - 1], "medium", None) is None)]
    free = [k for k in gaps if k not in (old, old + 1)]
    if not free:
        why = "the stop is there already" if gaps else "there is glass on both sides of it"
        raise LensError(f"the stop cannot go next to row {row}: {why}; choose a row beside another gap of air")
    # first remove it, so that its two gaps become one, then insert it in front of one of the remaining rows
    target = free[0] - (free[0] > old)
    left = list(rows)
    stop = left.pop(old)
    if old > 0:
        left[old - 1] = left[old - 1].replace(thickness=left[old - 1].thickness + stop.thickness)
    sensor = lens.sensor_distance
    if old == len(left) and sensor is not None:
        sensor += rows[old - 1].thickness
    behind = _room_behind_stop(left, target)
    if target:
        left[target - 1] = left[target - 1].replace(thickness=left[target - 1].thickness - behind)
    left.insert(target, stop.replace(thickness=behind))

    def place(k: int) -> int:
        reduced = k - (k > old)
        return target if k == old else reduced + (reduced >= target)

    positions = tuple(_with_stop_at(position, lens, target, behind) for position in lens.positions)
    still = lens.replace(positions=(), sensor_distance=sensor)
    moved = _renumbered(project, still, tuple(left), place)
    return _with_positions(moved, positions)


def _with_positions(project: Project, positions: tuple[Position, ...]) -> Project:
    """Give the project's own lens other positions; raises LensError if its rows do not fit them."""
    if not positions:
        return project
    assert isinstance(project.lens, Lens), "rows are changed of a lens of the project"
    try:
        return project.replace(lens=project.lens.replace(positions=positions))
    except ValueError as error:
        raise LensError(sentence(error)) from None


def _with_gaps(position: Position, gaps: dict[int, float]) -> Position:
    return position.replace(gaps=tuple(sorted(gaps.items())))


def _room_behind_stop(rows: list[Row], target: int) -> float:
    """Return the distance from the stop to the row behind it: the middle of the space between the rims."""
    front, back = rows[target - 1] if target else None, rows[target]
    semis = [each.semi_diameter for each in (front, back) if isinstance(each, Surface) and each.semi_diameter]
    rim = np.array([min(semis, default=0.0)])
    with np.errstate(invalid="ignore"):
        bulge, hollow = (
            0.0 if each is None else float(np.nan_to_num(sag(each, np.zeros(1), rim)[0])) for each in (front, back)
        )
    if front is None:
        return 1.0 + max(0.0, -hollow)
    near, far = max(0.0, bulge), front.thickness + min(0.0, hollow)
    return front.thickness - (0.5 * (near + far) if far > near else 0.5 * front.thickness)


def _with_stop_at(position: Position, lens: Lens, target: int, behind: float) -> Position:
    """Return the gaps of a zoom position for another place of the stop; the stop moves with the row behind it."""
    gaps = gaps_without_row(lens, position, lens.stop_row)
    if target - 1 in gaps:
        gaps[target - 1] -= behind
        if gaps[target - 1] < 0.0:
            raise LensError(
                f"the stop cannot go there: in zoom position {position.name!r} that gap is {-gaps[target - 1]:.2f} mm "
                "too narrow; choose a row beside another gap of air"
            )
    return _with_gaps(position, {k + (k >= target): gap for k, gap in gaps.items()})


def _behind(first: int) -> Callable[[int], int]:
    return lambda k: k + (k >= first)


def _renumbered(project: Project, lens: Lens, rows: tuple[Row, ...], place: Callable[[int], int | None]) -> Project:
    """Give a lens new rows, and renumber everything that refers to rows."""
    try:
        presets = {name: _moved(list(c), place, len(rows)) for name, c in lens.coating_presets.items()}
        positions = tuple(
            p.replace(gaps=tuple((new, gap) for row, gap in p.gaps if (new := place(row)) is not None))
            for p in lens.positions
        )
        elements = tuple(
            e.replace(rows=ends) for e in lens.elements if None not in (ends := tuple(place(k) for k in e.rows))
        )
        changed = lens.replace(rows=rows, coating_presets=presets, positions=positions, elements=elements)
    except ValueError as error:
        raise LensError(sentence(error)) from None
    coating = project.coating
    if isinstance(coating, PerRow):
        coating = PerRow(coatings=_moved(list(coating.coatings), place, len(rows)))
    base: Project = project.replace(coating=coating, art=_without_names(project.art))
    return base.replace(lens=changed)


def _moved(entries: list[Any], place: Callable[[int], int | None], count: int) -> tuple[Any, ...]:
    out: list[Any] = [None] * count
    for k, entry in enumerate(entries):
        new = place(k)
        if new is not None:
            out[new] = entry
    return tuple(out)


def _without_names(art: Art) -> Art:
    """Remove rules that name rows, as the rows have new numbers."""
    plain = tuple(rule for rule in art.rules if not any(c.isdigit() for c in rule.select.partition(":")[0]))
    return art.replace(rules=tuple(rule for rule in plain if not rule.select.removeprefix("not ").startswith("row:")))


def choose_lens(project: Project, lens: str | Lens) -> Project:
    """Change to another lens; settings of the old lens (coatings, overrides, zoom, targets) are dropped.

    Lights keep their places in the picture. The f-number stays the same if the lens opens that far.
    """
    known = open_lens(lens).lens
    efl = first_order(known).efl
    try:
        old = _efl(project)
    except FlarewrightError:
        old = efl
    lights = tuple(
        light.replace(
            field_deg=_kept_angles(light.field_deg, old / efl),
            keyframes=tuple(k.replace(field_deg=_kept_angles(k.field_deg, old / efl)) for k in light.keyframes),
        )
        for light in project.lights
    )
    stopped = None if project.f_number is None else max(project.f_number, known.f_number)
    iris = known.iris if known.iris != Iris() else project.iris
    changed: Project = project.replace(
        lens=lens, f_number=stopped, iris=iris, coating=first_coating(known), lights=lights, art=Art(), zoom=None,
        design=None,
    )  # fmt: skip
    # blades of a library lens are rounded and a little rough
    return as_photographed(changed, {"f_number", "coating", "lights"})[0]


def _efl(project: Project) -> float:
    """Return the focal length of the lens or measured flare, mm."""
    if is_measured(project):
        return efl_mm(project, flare_of(project).model)
    return first_order(open_lens(project.lens).lens).efl


def first_coating(lens: Lens) -> CoatingChoice:
    """Return the coating preset for a new lens; if it has none, the coatings of its rows."""
    return Preset(name=plausible_preset(lens)) if lens.coating_presets else AsLens()


def _kept_angles(field_deg: tuple[float, float], zoom: float) -> tuple[float, ...]:
    return tuple(round(degrees(atan(tan(radians(angle)) * zoom)), 4) for angle in field_deg)


def set_lens_facts(project: Project, values: dict[str, Any]) -> Project:
    """Change the lens' general data: name, f_number (wide open), field_deg, sensor_distance."""
    return project.replace(lens=own_lens(project).replace(**values))


def table_of(project: Project) -> str:
    """Return a text that identifies the table of rows, to detect a command meant for an earlier lens."""
    lens = project.lens
    if isinstance(lens, str):
        try:
            lens = open_lens(lens).lens
        except FlarewrightError:
            return str(lens)
    return f"{lens.name}, {len(lens.rows)} rows, stop {lens.stop_row}"


@dataclass(frozen=True)
class Prescription:
    """The table of a lens, for the page.

    Attributes
    ----------
    rows : tuple of dict
        One per row: the text of every column, `stop`, and `notes`: column to sentence.
    facts : dict
        efl, bfl, f_number and others, mm; empty when the lens forms no image.
    problem : str
        Why it forms no image; empty otherwise.
    distortion : tuple of float
        Image height of a distant light divided by efl tan(angle), at multiples of `DISTORTION_STEP_DEG`, up to the
        largest angle with an image.
    """

    rows: tuple[dict[str, Any], ...]
    facts: dict[str, float]
    problem: str
    distortion: tuple[float, ...] = ()


def prescription(project: Project) -> Prescription:
    """Return the table of a project's lens with remarks on its cells."""
    from ...optics.rays.pack import resolve_coatings
    from ...render.scene.resolve import resolve_project
    from .lens_notes import notes

    problem, facts = "", {}
    distortion: tuple[float, ...] = ()
    try:
        settled = resolve_project(project)
        order = settled.order
        distortion = _distortion(settled.lens, order)
        facts = {
            "efl": order.efl, "bfl": order.bfl, "f_number": order.f_number, "sensor_distance": order.sensor_distance,
            "entrance_pupil": order.entrance_pupil_diameter, "stop": 2.0 * order.stop_semi_diameter,
        }  # fmt: skip
    except FlarewrightError as error:
        problem = str(error)
    try:
        lens = open_lens(project.lens).lens
    except FlarewrightError:
        if isinstance(project.lens, str):
            return Prescription((), {}, problem)
        lens = project.lens
    try:
        coats = resolve_coatings(lens, project.coating)
    except FlarewrightError:
        coats = tuple(None for _ in lens.rows)
    row_notes = notes(lens, facts.get("sensor_distance"))
    rows = tuple(_row(k, row, coats[k], row_notes.get(k, {})) for k, row in enumerate(lens.rows))
    return Prescription(rows, facts, problem, distortion)


@lru_cache(maxsize=8)
def _distortion(lens: Lens, order: FirstOrder) -> tuple[float, ...]:
    angles = distortion_angles()
    return distortion_of(image_heights(lens, order, angles), order.efl * np.tan(np.radians(angles)))


def distortion_angles() -> Floats:
    """Return the field angles of the distortion samples for the page, degrees."""
    return np.arange(DISTORTION_STEP_DEG, DISTORTION_TO_DEG + 0.5, DISTORTION_STEP_DEG)


def distortion_of(heights: Sequence[float] | Floats, ideals: Floats) -> tuple[float, ...]:
    """Return image heights divided by the heights without distortion, up to the largest angle of a drag.

    Parameters
    ----------
    heights, ideals : array_like, shape (N,)
        At increasing field angles; shorter where there is no image any more.
    """
    out: list[float] = []
    for height, nearer, ideal in zip(heights, (0.0, *heights), ideals, strict=False):
        # stop where heights decrease: the inverse, which a drag needs, would be ambiguous
        if not height > nearer:
            break
        out.append(round(float(height / ideal), 5))
    return tuple(out)


def _row(k: int, row: Row, coat: Any, row_notes: dict[str, str]) -> dict[str, Any]:
    if isinstance(row, Stop):
        return {"row": k, "stop": True, "thickness": _text(row.thickness), "notes": row_notes}
    medium = row.medium
    return {
        "row": k,
        "stop": False,
        "radius": "flat" if row.curvature == 0.0 else _text(1.0 / row.curvature),
        "thickness": _text(row.thickness),
        "glass": "" if medium is None else medium.glass or "",
        # show typed text as it is; a glass has the digits of its catalogue
        "n_d": "" if medium is None else f"{medium.n_d:.5g}" if medium.glass else _text(medium.n_d),
        "v_d": ""
        if medium is None or medium.v_d is None
        else f"{medium.v_d:.4g}"
        if medium.glass
        else _text(medium.v_d),
        "semi_diameter": "" if row.semi_diameter is None else _text(row.semi_diameter),
        "estimated": row.semi_diameter_estimated,
        "coating": "" if coat is None else format_coating(coat),
        "notes": row_notes,
    }


def _text(value: float) -> str:
    return f"{value:.6g}"
