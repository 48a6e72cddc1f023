"""Changes of the prescription: cells, general data, another lens."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from math import atan, degrees, isfinite, radians, tan
from typing import Any

import numpy as np

from ...errors import FlarewrightError, GlassError, LensError
from ...io.lens.coating_text import UNCOATED, coating_from, format_coating
from ...io.lens.media import attach
from ...measure.replay.measured_project import efl_mm, flare_of, is_measured
from ...model import (
    AsLens,
    Camera,
    CoatingChoice,
    Iris,
    Lens,
    Medium,
    PerRow,
    Preset,
    Project,
    ProjectCurve,
    Row,
    Stop,
    Surface,
)
from ...model.project.art import Art
from ...optics.lens.paraxial import FirstOrder, first_order
from ...optics.lens.zoom import named_position, positioned
from ...optics.rays.image_height import image_heights
from ...render.scene.photographic_defaults import as_photographed, plausible_preset
from ...render.scene.resolve import open_lens
from ...sentences import INVALID
from ...typing import Floats
from ..common.messages import sentence, spoken

COLUMNS = ("radius", "thickness", "glass", "n_d", "v_d", "semi_diameter", "coating")
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
    if column == "thickness" and row in _moving(lens, project):
        return project.replace(lens=_with_gap_of_position(lens, project, row, new.thickness))
    rows = (*lens.rows[:row], new, *lens.rows[row + 1 :])
    if column == "coating" and not isinstance(project.coating, AsLens):
        # the cell shows the row's effective coating, so that is what it changes
        return _recoated(project, lens, row, new)
    return project.replace(lens=lens.replace(rows=rows))


def _moving(lens: Lens, project: Project) -> set[int]:
    """Return the rows with gaps that the zoom or the focus of a project sets, instead of the rows."""
    for_focus = any(position.focus_distance is not None for position in lens.positions)
    if project.zoom is None and (project.camera.focus_distance is None or not for_focus):
        return set()
    return {row for position in lens.positions for row, _ in position.gaps}


def _with_gap_of_position(lens: Lens, project: Project, row: int, gap: float) -> Lens:
    """Return a lens with another gap in the position that a project uses."""
    chosen = None if project.zoom is None else named_position(lens, project.zoom)
    if chosen is None or project.camera.focus_distance is not None:
        raise LensError(
            f"row {row}: this gap lies between zoom or focus positions, which set it; choose a position without a "
            "focus distance on the panel Light first"
        )
    changed = chosen.replace(gaps=tuple((k, gap if k == row else old) for k, old in chosen.gaps))
    try:
        return lens.replace(positions=tuple(changed if each == chosen else each for each in lens.positions))
    except INVALID as error:
        raise LensError(f"row {row}: {sentence(error)}") from None


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
        # a value that no glass can have is refused before a dispersion is fitted to it
        Medium(n_d=old.medium.n_d, v_d=value)
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


def choose_lens(project: Project, lens: str | Lens) -> Project:
    """Change to another lens; settings of the old lens (coatings, overrides, zoom, targets, rows) are dropped.

    Lights keep their places in the picture. The f-number stays the same if the lens opens that far. The sensor is where
    the lens has it.
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
    scatter = project.scatter
    changed: Project = project.replace(
        lens=lens, f_number=stopped, iris=iris, coating=first_coating(known), lights=lights, art=Art(), zoom=None,
        design=None, camera=_camera_for(project, known),
        # its rows are other surfaces
        scatter=None if scatter is None else scatter.replace(rows=()),
        curves=tuple(_for_lens(curve, known) for curve in project.curves if curve.of != "zoom"),
    )  # fmt: skip
    # blades of a library lens are rounded and a little rough
    return as_photographed(changed, {"f_number", "coating", "lights"})[0]


def _camera_for(project: Project, lens: Lens) -> Camera:
    """Return the camera for another lens: the sensor is where the lens has it, an anamorphic picture is drawn wide."""
    camera = project.camera.replace(sensor_distance=None)
    if camera.squeeze is not None or camera.sensor_mm is not None:
        return camera
    try:
        squeezed = not is_measured(project) and open_lens(project.lens).lens.squeeze is not None
    except FlarewrightError:
        return camera
    # between two lenses of one kind the choice of the project stays
    return camera if squeezed == (lens.squeeze is not None) else camera.replace(desqueeze=lens.squeeze is not None)


def _for_lens(curve: ProjectCurve, lens: Lens) -> ProjectCurve:
    """Return a curve whose f-numbers a lens can open to; others unchanged."""
    if curve.of != "f_number":
        return curve
    values = (value for value in curve.values if isinstance(value, float))
    return curve.replace(values=tuple(max(value, lens.f_number) for value in values))


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
    """Change the lens' general data: name, f_number (wide open), field_deg, sensor_distance.

    A wider f-number of the project becomes that of the lens.
    """
    lens = own_lens(project).replace(**values)
    stopped = project.f_number
    if "f_number" in values and stopped is not None:
        stopped = max(stopped, lens.f_number)
    return project.replace(lens=lens, f_number=stopped)


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
    with suppress(FlarewrightError):
        # gaps as the picture has them
        lens = positioned(lens, project.zoom, project.camera.focus_distance)
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
