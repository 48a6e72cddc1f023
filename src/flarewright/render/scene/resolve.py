"""Load a lens by name or path, and resolve everything that a render or an analysis needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import hypot, inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import GlassError, LensError, ProjectError, naming
from ...io.images.height_image import read_heights
from ...io.lens.library import in_library, lens_path
from ...io.lens.media import attach
from ...io.lens.media import complete_medium as complete_media
from ...io.lens.media import remarks as media_remarks
from ...io.lens.toml_lens import read_lens
from ...model import AsLens, CoatingChoice, Imperfection, Iris, Lens, Medium, Plate, Project, Surface
from ...model.lens.raw_lens import LensReading, RawLens, RawSequence
from ...optics.lens.paraxial import FirstOrder, first_order
from ...optics.lens.plane_plates import filter_length, with_cover_glass, with_filter
from ...optics.lens.tolerances import imperfect
from ...optics.lens.zoom import at_position, positioned
from ...optics.lens_import.patent_repair import RIM_CUT, Apertures, axial_opening, repair
from ...optics.lens_import.semi_diameters import with_semi_diameters
from ...optics.lens_import.sequential_import import lens_of_sequence
from ...optics.rays.bundle import least_distance
from ...optics.rays.pack import PackedLens, SensorMirror, resolve_coatings
from ...sentences import INVALID, summary, validation_sentences

if TYPE_CHECKING:
    from ...io.lens.formats.codev import FirstColumn


@dataclass(frozen=True)
class OpenedLens:
    """A lens ready for use: read, repaired and completed.

    Attributes
    ----------
    lens : Lens
        With the dispersion of every medium, the heights of every figure error and all semi-diameters. Rows whose
        semi-diameter is an estimate have `semi_diameter_estimated`.
    path : Path or None
        Its file; None for a prescription in memory.
    stated : Lens
        As read and repaired, before the estimates.
    repairs : tuple of str
        What the reader noticed, repaired or assumed, a sentence each.
    checked : bool
        Whether focal length and axial beam were checked and reported before, as by `repair`.
    """

    lens: Lens
    path: Path | None
    stated: Lens
    repairs: tuple[str, ...]
    checked: bool

    # on request: the axial beam is traced, which many callers do not need
    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """Every repair, estimate, assumption and contradiction, a sentence each."""
        return (*self.repairs, *_assumed(self.stated, self.lens, self.checked))


def open_lens(
    lens: Lens | str | Path, *, apertures: Apertures = "auto", first_column: FirstColumn | None = None
) -> OpenedLens:  # fmt: skip
    """Read, repair and complete a lens.

    Parameters
    ----------
    lens : Lens or str or Path
        A prescription, the name of a shipped lens (`flarewright lenses`), or a lens file of any kind that `read_lens`
        reads.
    apertures : {"auto", "diameters", "semi-diameters"}
        What the last column of a `.lens` table holds; "auto" decides by the stop
        (`optics.lens_import.patent_repair.repair`).
    first_column : {"radii", "curvatures"}, optional
        The first number of a surface in a `.seq` file that does not state it.

    Raises
    ------
    LensError
        There is no such lens, or it forms no image by itself; the message says why. Or `apertures` is given for a file
        of another kind.
    GlassError
        A glass is in no catalogue.
    """
    if isinstance(lens, Lens):
        return _opened(LensReading(_with_heights(lens), ()))
    path = lens_path(str(lens))
    # cache the files of shipped lenses only: a user's file can change while a program runs
    return _shipped(path) if in_library(path) and apertures == "auto" else _read(path, apertures, first_column)


def load_lens(name_or_path: str | Path, *, remarks: list[str] | None = None, apertures: Apertures = "auto") -> Lens:
    """Return the lens of a name or file, repaired and completed: `open_lens` for Python users.

    Parameters
    ----------
    name_or_path : str or Path
    remarks : list of str, optional
        List to which the remarks are appended.
    apertures : {"auto", "diameters", "semi-diameters"}

    Raises
    ------
    LensError, GlassError
        As in `open_lens`.
    """
    opened = open_lens(name_or_path, apertures=apertures)
    if remarks is not None:
        remarks.extend(opened.remarks)
    return opened.lens


@lru_cache(maxsize=64)
def _shipped(path: Path) -> OpenedLens:
    # tests check the shipped prescriptions and their notes say so; skipping the checks here avoids compiling kernels
    return _read(path, checked=True)


def _read(
    path: Path, apertures: Apertures = "auto", first_column: FirstColumn | None = None, checked: bool = False
) -> OpenedLens:  # fmt: skip
    """Read, repair and complete a lens file."""
    if first_column is not None and path.suffix.lower() != ".seq":
        raise LensError(f"{path} is no .seq file, whose first column can be {first_column}; leave --first-column out")
    reading = read_lens(path, first_column)
    try:
        with naming(path):
            if apertures != "auto" and not isinstance(reading, RawLens):
                raise LensError(f"only the columns of a .lens table can be read as {apertures}; leave --apertures out")
            # repairs of other programs' files need optics, so they happen here and not in the reader
            if isinstance(reading, RawLens):
                reading, checked = repair(reading, apertures), True
            elif isinstance(reading, RawSequence):
                reading = lens_of_sequence(reading)
            opened = _opened(LensReading(_with_heights(reading.lens), reading.remarks), path, checked)
            # raises for a zoom position that forms no image
            _ = opened.remarks
            return opened
    except INVALID as error:
        # values whose combination no earlier check rejects
        problems = validation_sentences(error)
        raise LensError(summary(str(path), problems), tuple(problems)) from None


# cached: an editor opens the same lens for every picture
@lru_cache(maxsize=64)
def _opened(reading: LensReading, path: Path | None = None, checked: bool = False) -> OpenedLens:
    known, found = complete_media(reading.lens)
    return OpenedLens(complete_lens(known), path, known, (*reading.remarks, *found), checked)


def complete_lens(lens: Lens) -> Lens:
    """Add what a prescription lacks: dispersions, heights of figure errors and semi-diameters.

    Raises
    ------
    LensError
        The lens forms no image by itself.
    """
    known, _ = complete_media(_with_heights(lens))
    first_order(known)
    return _complete_everywhere(known)


def _assumed(lens: Lens, full: Lens, checked: bool) -> list[str]:
    """Return remarks on the estimates in a completed lens, and on what its file states differently."""
    remarks: list[str] = []
    order = first_order(lens)
    surfaces = sum(isinstance(row, Surface) for row in full.rows)
    estimated = [str(k) for k, row in enumerate(lens.rows) if isinstance(row, Surface) and row.semi_diameter is None]
    if estimated:
        which = "all rows" if len(estimated) == surfaces else f"row{'s'[: len(estimated) > 1]} {', '.join(estimated)}"
        remarks.append(f"semi-diameters of {which} estimated from f/{lens.f_number:g} and the field of view")
    stated = lens.stated_focal_length
    if stated is not None and not checked and abs(order.efl / stated - 1.0) > 0.02:
        remarks.append(f"the focal length is {order.efl:.2f} mm, the file says {stated:g} mm")
    if not checked:
        _report_opening(full, order, remarks)
    for position in full.positions:
        if position.focal_length is None or position.focus_distance is not None:
            # a patent gives focal lengths at infinity
            continue
        efl = first_order(at_position(full, position)).efl
        if abs(efl / position.focal_length - 1.0) > 0.02:
            difference = f"the focal length is {efl:.2f} mm, the file says {position.focal_length:g} mm"
            remarks.append(f"position {position.name!r}: {difference}")
    return remarks


def _report_opening(lens: Lens, order: FirstOrder, remarks: list[str]) -> None:
    """Append a remark if a lens is slower than its f-number."""
    opening, row = axial_opening(lens, order)
    # the value is quantized to steps of this size
    if opening > 1.0 - RIM_CUT - 1e-9:
        return
    passes = f"f/{lens.f_number / opening:.2f}" if opening > 0.0 else "nothing"
    remarks.append(f"row {row} cuts the beam on the axis: the lens passes {passes}, not f/{lens.f_number:g}")


def _complete_everywhere(lens: Lens) -> Lens:
    """Estimate missing semi-diameters large enough for the light of every position."""
    full = with_semi_diameters(lens)
    rows = list(full.rows)
    for position in lens.positions if full != lens else ():
        for k, row in enumerate(with_semi_diameters(at_position(lens, position)).rows):
            mine = rows[k]
            if isinstance(row, Surface) and isinstance(mine, Surface) and row.semi_diameter_estimated:
                assert row.semi_diameter is not None
                assert mine.semi_diameter is not None
                if row.semi_diameter > mine.semi_diameter:
                    rows[k] = mine.replace(semi_diameter=row.semi_diameter)
    return full.replace(rows=tuple(rows)) if lens.positions else full


def _with_heights(lens: Lens) -> Lens:
    """Read the height images of figure errors."""
    rows = []
    for row in lens.rows:
        figure = row.figure if isinstance(row, Surface) else None
        if figure is not None and figure.image is not None and figure.heights is None:
            rows.append(row.replace(figure=figure.replace(heights=read_heights(figure.image))))
        else:
            rows.append(row)
    return lens if all(a is b for a, b in zip(rows, lens.rows, strict=True)) else lens.replace(rows=tuple(rows))


def check_opens(lens: Lens, f_number: float | None) -> None:
    """Raise a ProjectError if an f-number is faster than the lens or is no number; None is wide open."""
    if f_number is None:
        return
    if f_number < lens.f_number * (1.0 - 1e-6):
        raise ProjectError(
            f"f/{f_number:g} is faster than {lens.name} opens (f/{lens.f_number:g}); "
            f"choose f/{lens.f_number:g} or a larger number"
        )
    if not isfinite(f_number):
        raise ProjectError(f"an f-number is finite, not {f_number:g}")


def check_distances(sensor_distance: float | None, focus_distance: float | None) -> None:
    """Raise a ProjectError if a stated distance of the sensor or the plane in focus is not above 0 and finite."""
    for distance, what in ((sensor_distance, "sensor"), (focus_distance, "plane in focus")):
        if distance is not None and not 0.0 < distance < inf:
            raise ProjectError(f"the distance of the {what} is finite and above 0 mm, not {distance:g}")


@dataclass(frozen=True)
class Built:
    """A lens with its plates, ready to be packed.

    Attributes
    ----------
    lens : Lens
        Zoomed and focused, with filter and cover glass among its rows; one sample within tolerances, if requested.
    coating : CoatingChoice
        Of its rows.
    sensor_distance, focus_distance : float or None
        Arguments for `first_order`; None where the rows already contain them.
    remarks : tuple of str
    """

    lens: Lens
    coating: CoatingChoice
    sensor_distance: float | None
    focus_distance: float | None
    remarks: tuple[str, ...] = ()


def build(
    lens: Lens,
    coating: CoatingChoice | None = None,
    *,
    zoom: str | float | None = None,
    filter_plate: Plate | None = None,
    cover_glass: Plate | None = None,
    imperfection: Imperfection | None = None,
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
) -> Built:
    """Assemble a complete lens with its zoom position, filter, cover glass and imperfection.

    Parameters
    ----------
    lens : Lens
    coating : CoatingChoice, optional
        For the rows of the lens; plates have their own. None: as in the lens file.
    zoom : str or float, optional
        Name of a zoom position, or a focal length in mm.
    filter_plate, cover_glass : Plate, optional
    imperfection : Imperfection, optional
    sensor_distance, focus_distance : float, optional
        Override the values of the lens file, mm, measured from the last and first vertex of the lens without plates.

    Raises
    ------
    FlarewrightError
        One of them does not fit the lens.
    """
    check_distances(sensor_distance, focus_distance)
    remarks: list[str] = []
    choice: CoatingChoice = AsLens() if coating is None else coating
    lens = positioned(lens, zoom, focus_distance)
    if filter_plate is not None or cover_glass is not None:
        # resolve coatings before the row numbers change
        coats = resolve_coatings(lens, choice)
        rows = [
            row.replace(coating=coat) if isinstance(row, Surface) else row
            for row, coat in zip(lens.rows, coats, strict=True)
        ]
        lens, choice = lens.replace(rows=tuple(rows)), AsLens()
    if cover_glass is not None:
        lens = with_cover_glass(
            lens, cover_glass, _medium(cover_glass, "cover glass", remarks),
            sensor_distance=sensor_distance, focus_distance=focus_distance,
        )  # fmt: skip
        sensor_distance = focus_distance = None
        last = len(lens.rows) - 1
        remarks.append(f"the cover glass is rows {last - 1} and {last}")
    if filter_plate is not None:
        lens, focus_distance = _behind_filter(lens, filter_plate, focus_distance, remarks)
    if filter_plate is not None or cover_glass is not None:
        lens = with_semi_diameters(lens)
    return Built(imperfect(lens, imperfection), choice, sensor_distance, focus_distance, tuple(remarks))


def _behind_filter(
    lens: Lens, plate: Plate, focus_distance: float | None, remarks: list[str]
) -> tuple[Lens, float | None]:
    """Add a filter in front; the focus plane stays in place, so its distance from the new first vertex shrinks."""
    found = with_filter(lens, plate, _medium(plate, "filter", remarks))
    ahead = filter_length(plate)
    remarks.append("the filter is rows 0 and 1; the lens' own rows begin at 2")
    for stated in (focus_distance, found.focus_distance):
        if stated is not None and stated <= ahead:
            raise ProjectError(f"the plane in focus, {stated:g} mm in front of {lens.name}, lies behind its filter")
    if found.focus_distance is not None:
        found = found.replace(focus_distance=found.focus_distance - ahead)
    return found, None if focus_distance is None else focus_distance - ahead


def _medium(plate: Plate, what: str, remarks: list[str]) -> Medium:
    """Return the glass of a plate."""
    glass = "N-BK7" if plate.glass is None and plate.n_d is None else plate.glass
    try:
        medium, finding = attach(glass, plate.n_d, plate.v_d)
    except GlassError as error:
        raise ProjectError(f"{what}: {error} (on the command line an index can replace the name: 1.52:2)") from None
    remarks.extend(media_remarks([(0, finding)], what))
    return medium


@dataclass(frozen=True)
class ResolvedProject:
    """A project with its lens built and its first-order data computed.

    Attributes
    ----------
    project : Project
    lens : Lens
        As traced: with filter and cover glass, zoomed, one sample within tolerances.
    coating : CoatingChoice
        Of this lens.
    iris : Iris
    order : FirstOrder
        Of the nominal lens.
    remarks : tuple of str
    opened : OpenedLens
        The lens of the project, before it was zoomed, focused and given plates.
    """

    project: Project
    lens: Lens
    coating: CoatingChoice
    iris: Iris
    order: FirstOrder
    remarks: tuple[str, ...]
    opened: OpenedLens

    @property
    def sensor(self) -> SensorMirror | None:
        """The sensor as a mirror, if it reflects."""
        camera = self.project.camera
        if camera.sensor_reflectance == 0.0:
            return None
        return SensorMirror(camera.sensor_reflectance, 0.5 * hypot(*camera.sensor))

    def light_distance(self, number: int) -> float | None:
        """Return the distance of a light from the first row, mm; None: infinite.

        The project states it from the first vertex of the lens itself, in front of which a filter may stand.

        Raises
        ------
        ProjectError
            When the light stands in or behind the filter.
        """
        stated, what = self.project.lights[number].distance, f"lights[{number}].distance"
        return None if stated is None else distance_from_front(stated, self.project.filter, what)


def distance_from_front(stated: float, plate: Plate | None, what: str) -> float:
    """Return the distance of a light from the front of a filter, mm; the stated one is from the lens behind it.

    Raises
    ------
    ProjectError
        When the light stands in or behind the filter; `what` is at fault.
    """
    ahead = filter_length(plate)
    if plate is not None and stated <= ahead:
        raise ProjectError(
            f"{what}: a light at {stated:g} mm stands in or behind the filter; give more than {ahead:g} mm"
        )
    return stated - ahead


def distance_in_front(settled: ResolvedProject, packed: PackedLens, number: int) -> float | None:
    """Return the distance of a light from the first row, mm; None: infinite.

    Raises
    ------
    ProjectError
        When the light stands in the lens, in its filter, or behind its entrance pupil.
    """
    distance = settled.light_distance(number)
    check_in_front(packed, distance, settled.lens.name, filter_length(settled.project.filter), f"lights[{number}].")
    return distance


def check_in_front(packed: PackedLens, distance: float | None, lens: str, ahead: float, where: str = "") -> None:
    """Raise an error for a light within a lens, at a distance from its first row or None; `ahead` of it is a filter.

    The message states distances from the lens, as they are given.
    """
    least = least_distance(packed)
    if distance is not None and not distance > least:
        raise ProjectError(
            f"{where}distance: a light at {distance + ahead:g} mm stands in the lens {lens} or behind its entrance "
            f"pupil; give more than {least + ahead:.4g} mm"
        )


def resolve_project(project: Project) -> ResolvedProject:
    """Load and build the lens of a project, and compute its stop and focus.

    Raises
    ------
    FlarewrightError
        As in `open_lens`, `build`, `check_opens` and `first_order`.
    """
    opened = open_lens(project.lens)
    lens, remarks = opened.lens, list(opened.remarks)
    camera = project.camera
    if camera.squeeze is None and lens.squeeze is not None:
        camera = camera.replace(squeeze=lens.squeeze)
        project = project.replace(camera=camera)
    if camera.desqueeze and camera.squeeze is None:
        remarks.append(f"{lens.name} has no squeeze, so desqueeze has no effect; set camera.squeeze for an anamorphic")
    built = build(
        lens, project.coating, zoom=project.zoom, filter_plate=project.filter, cover_glass=camera.cover_glass,
        imperfection=project.imperfection, sensor_distance=camera.sensor_distance,
        focus_distance=camera.focus_distance,
    )  # fmt: skip
    lens = built.lens
    check_opens(lens, project.f_number)
    order = first_order(
        lens, project.f_number, sensor_distance=built.sensor_distance, focus_distance=built.focus_distance
    )
    if order.sensor_distance > 1e5:
        raise LensError(
            f"{lens.name}: the sensor would stand {order.sensor_distance / 1000:.0f} m behind the lens; check the focus"
        )
    iris = project.iris if project.iris is not None else lens.iris
    return ResolvedProject(project, lens, built.coating, iris, order, (*remarks, *built.remarks), opened)
