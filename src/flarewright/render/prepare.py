"""Load a lens by name or path and settle everything that a render or an analysis needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import hypot
from pathlib import Path

from pydantic import ValidationError

from ..errors import GlassError, LensError, ProjectError, naming
from ..io.height_image import read_heights
from ..io.lens_file import read_lens
from ..io.library import is_shipped, lens_path
from ..io.media import attach
from ..io.media import complete as complete_media
from ..io.media import remarks as media_remarks
from ..io.sentences import summary, validation_sentences
from ..model import AsLens, CoatingChoice, Imperfection, Iris, Lens, Medium, Plate, Project, Surface
from ..model.raw_lens import LensReading, RawLens, RawSequence
from ..optics.imperfection import imperfect
from ..optics.pack import SensorMirror, resolve_coatings
from ..optics.paraxial import FirstOrder
from ..optics.paraxial import first_order as _first_order
from ..optics.plates import with_cover_glass, with_filter
from ..optics.repair import RIM_CUT, Apertures, axial_opening, repair
from ..optics.semi_diameters import complete
from ..optics.sequence import lens_of_sequence
from ..optics.zoom import at_position, positioned


def load_lens(name_or_path: str | Path, *, remarks: list[str] | None = None, apertures: Apertures = "auto") -> Lens:
    """Load a shipped lens or a lens file, repaired and complete.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped lens' name (`flarewright lenses`), a TOML lens file, a `.lens` or a `.zmx` file.
    remarks : list of str, optional
        Every repair, estimate and assumption is appended to it, a sentence each.
    apertures : {"auto", "diameters", "semi-diameters"}
        What the last column of a `.lens` table holds; "auto" decides by the stop (`optics.repair.repair`).

    Returns
    -------
    Lens
        All semi-diameters known.

    Raises
    ------
    LensError
        When there is no such lens, or it is no camera lens; the message says why. When `apertures` is told of a file
        of another kind.
    GlassError
        For a glass that no catalogue knows.
    """
    path = lens_path(str(name_or_path))
    # a person's file may change while a program runs, a shipped one does not
    lens, told = _shipped_lens(path) if is_shipped(path) and apertures == "auto" else _read_complete(path, apertures)
    if remarks is not None:
        remarks.extend(told)
    return lens


@lru_cache(maxsize=64)
def _shipped_lens(path: Path) -> tuple[Lens, tuple[str, ...]]:
    # tests judge the prescriptions that ship, and their notes tell it: a first command need not compile for that
    return _read_complete(path, judged=True)


def _read_complete(path: Path, apertures: Apertures = "auto", judged: bool = False) -> tuple[Lens, tuple[str, ...]]:
    """Read a lens file and fill in what it leaves out; also returns what there is to tell."""
    reading = read_lens(path)
    try:
        with naming(path):
            return _completed(reading, apertures, judged)
    except ValidationError as error:
        # a combination of values that no check foresaw
        problems = validation_sentences(error)
        raise LensError(summary(str(path), problems), tuple(problems)) from None


def _completed(
    reading: LensReading | RawLens | RawSequence, apertures: Apertures, judged: bool
) -> tuple[Lens, tuple[str, ...]]:
    """Judge what was read, and fill in what it leaves out."""
    if apertures != "auto" and not isinstance(reading, RawLens):
        raise LensError(f"only the columns of a .lens table may be read as {apertures}; leave --apertures out")
    table = isinstance(reading, RawLens)
    # what other programs wrote needs optics to be judged, so it is repaired here
    if isinstance(reading, RawLens):
        reading = repair(reading, apertures)
    elif isinstance(reading, RawSequence):
        reading = lens_of_sequence(reading)
    lens, found = reading
    told = list(found)
    return complete_lens(lens, remarks=told, judged=judged or table), tuple(told)


def complete_lens(lens: Lens, *, remarks: list[str] | None = None, judged: bool = False) -> Lens:
    """Fill in what a prescription leaves out and check that it makes an image.

    Parameters
    ----------
    lens : Lens
    remarks : list of str, optional
        Estimates are told here.
    judged : bool
        Whether it has been told already how far off the stated focal length is and what rims cut, as the repair of a
        `.lens` table does.

    Returns
    -------
    Lens

    Raises
    ------
    LensError
        When the lens makes no image by itself.
    """
    known, found = complete_media(_with_heights(lens))
    if remarks is not None:
        remarks.extend(found)
    order = first_order(known)
    full = _complete_everywhere(known)
    surfaces = sum(isinstance(row, Surface) for row in full.rows)
    estimated = [str(k) for k, row in enumerate(known.rows) if isinstance(row, Surface) and row.semi_diameter is None]
    if remarks is not None:
        if estimated:
            which = (
                "all rows" if len(estimated) == surfaces else f"row{'s'[: len(estimated) > 1]} {', '.join(estimated)}"
            )
            remarks.append(f"semi-diameters of {which} estimated from f/{lens.f_number:g} and the field of view")
        stated = lens.stated_focal_length
        if stated is not None and not judged and abs(order.efl / stated - 1.0) > 0.02:
            remarks.append(f"the focal length is {order.efl:.2f} mm, the file says {stated:g} mm")
        if not judged:
            _tell_opening(full, order, remarks)
        for position in full.positions:
            if position.focal_length is None or position.focus_distance is not None:
                # a patent's focal lengths are those at infinity
                continue
            efl = first_order(at_position(full, position)).efl
            if abs(efl / position.focal_length - 1.0) > 0.02:
                told = f"the focal length is {efl:.2f} mm, the file says {position.focal_length:g} mm"
                remarks.append(f"position {position.name!r}: {told}")
    return full


def _tell_opening(lens: Lens, order: FirstOrder, remarks: list[str]) -> None:
    """Tell when a lens is slower than its f-number says."""
    opening, row = axial_opening(lens, order)
    # it comes in steps as large as this
    if opening > 1.0 - RIM_CUT - 1e-9:
        return
    passes = f"f/{lens.f_number / opening:.2f}" if opening > 0.0 else "nothing"
    remarks.append(f"row {row} cuts the beam on the axis: the lens passes {passes}, not f/{lens.f_number:g}")


def _complete_everywhere(lens: Lens) -> Lens:
    """Estimate missing semi-diameters so that they pass the light of every position."""
    full = complete(lens)
    rows = list(full.rows)
    for position in lens.positions if full != lens else ():
        for k, row in enumerate(complete(at_position(lens, position)).rows):
            mine = rows[k]
            if isinstance(row, Surface) and isinstance(mine, Surface) and row.semi_diameter_estimated:
                assert row.semi_diameter is not None
                assert mine.semi_diameter is not None
                if row.semi_diameter > mine.semi_diameter:
                    rows[k] = mine.replace(semi_diameter=row.semi_diameter)
    found: Lens = full.replace(rows=tuple(rows)) if lens.positions else full
    return found


def _with_heights(lens: Lens) -> Lens:
    """Read the images of figure errors."""
    rows = []
    for row in lens.rows:
        figure = row.figure if isinstance(row, Surface) else None
        if figure is not None and figure.image is not None and figure.heights is None:
            rows.append(row.replace(figure=figure.replace(heights=read_heights(figure.image))))
        else:
            rows.append(row)
    found: Lens = lens if all(a is b for a, b in zip(rows, lens.rows, strict=True)) else lens.replace(rows=tuple(rows))
    return found


def as_lens(lens: Lens | str | Path, *, remarks: list[str] | None = None) -> Lens:
    """Take a lens in whatever form a person has it.

    Parameters
    ----------
    lens : Lens or str or Path
        A prescription, or what `load_lens` takes.
    remarks : list of str, optional
        Repairs and estimates are told here.

    Returns
    -------
    Lens
        Complete.
    """
    return complete_lens(lens, remarks=remarks) if isinstance(lens, Lens) else load_lens(lens, remarks=remarks)


def first_order(
    lens: Lens,
    f_number: float | None = None,
    *,
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
) -> FirstOrder:
    """Compute focal length, pupils, stop and sensor position of a lens.

    Parameters
    ----------
    lens : Lens
    f_number : float, optional
        None: wide open.
    sensor_distance, focus_distance : float, optional
        Override the lens file's, mm.

    Returns
    -------
    FirstOrder

    Raises
    ------
    LensError
        When the lens makes no image by itself.
    ProjectError
        When the f-number is faster than the lens.
    """
    if f_number is not None and f_number < lens.f_number * (1.0 - 1e-6):
        raise ProjectError(
            f"f/{f_number:g} is faster than {lens.name} opens (f/{lens.f_number:g}); "
            f"choose f/{lens.f_number:g} or a larger number"
        )
    return _first_order(lens, f_number, sensor_distance=sensor_distance, focus_distance=focus_distance)


@dataclass(frozen=True)
class Built:
    """A lens with everything that stands around it, ready to be packed.

    Attributes
    ----------
    lens : Lens
        Zoomed and focused, its filter and cover glass among its rows, one sample of it where imperfection is asked for.
    coating : CoatingChoice
        What its rows carry.
    sensor_distance, focus_distance : float or None
        What is left of the wishes for them, to be given to `first_order`.
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
    """Put a complete lens together with its zoom, filter, cover glass and imperfection.

    Parameters
    ----------
    lens : Lens
    coating : CoatingChoice, optional
        Of the lens' own rows; plates have theirs. None: as the lens file says.
    zoom : str or float, optional
        A position's name or a focal length, mm.
    filter_plate, cover_glass : Plate, optional
    imperfection : Imperfection, optional
    sensor_distance, focus_distance : float, optional
        Override the lens file's, mm, measured from the lens' own last and first vertex.

    Returns
    -------
    Built

    Raises
    ------
    FlarewrightError
        When one of them does not fit the lens.
    """
    remarks: list[str] = []
    choice: CoatingChoice = AsLens() if coating is None else coating
    lens = positioned(lens, zoom, focus_distance)
    if filter_plate is not None or cover_glass is not None:
        # rows get their coatings before they get other numbers
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
        lens = complete(lens)
    return Built(imperfect(lens, imperfection), choice, sensor_distance, focus_distance, tuple(remarks))


def _behind_filter(
    lens: Lens, plate: Plate, focus_distance: float | None, remarks: list[str]
) -> tuple[Lens, float | None]:
    """Put a filter in front; the plane in focus stays where it is, but is nearer to the new first vertex."""
    found = with_filter(lens, plate, _medium(plate, "filter", remarks))
    ahead = found.rows[0].thickness + found.rows[1].thickness
    remarks.append("the filter is rows 0 and 1; the lens' own rows begin at 2")
    for stated in (focus_distance, found.focus_distance):
        if stated is not None and stated <= ahead:
            raise ProjectError(f"the plane in focus, {stated:g} mm in front of {lens.name}, lies behind its filter")
    if found.focus_distance is not None:
        found = found.replace(focus_distance=found.focus_distance - ahead)
    return found, None if focus_distance is None else focus_distance - ahead


def _medium(plate: Plate, what: str, remarks: list[str]) -> Medium:
    """Find the glass of a plate."""
    glass = "N-BK7" if plate.glass is None and plate.n_d is None else plate.glass
    try:
        medium, finding = attach(glass, plate.n_d, plate.v_d)
    except GlassError as error:
        raise ProjectError(f"{what}: {error} (on the command line an index in the name's place, 1.52:2)") from None
    remarks.extend(media_remarks([(0, finding)], what))
    return medium


@dataclass(frozen=True)
class Settled:
    """A project with its lens built and its opening computed.

    Attributes
    ----------
    project : Project
    lens : Lens
        As it is traced: with filter and cover glass, zoomed, one sample of it.
    coating : CoatingChoice
        Of that lens.
    iris : Iris
    order : FirstOrder
        Of the lens as designed.
    remarks : tuple of str
    """

    project: Project
    lens: Lens
    coating: CoatingChoice
    iris: Iris
    order: FirstOrder
    remarks: tuple[str, ...]

    @property
    def sensor(self) -> SensorMirror | None:
        """The sensor as a mirror, if it is one."""
        camera = self.project.camera
        if camera.sensor_reflectance == 0.0:
            return None
        return SensorMirror(camera.sensor_reflectance, 0.5 * hypot(*camera.sensor))


def settle(project: Project) -> Settled:
    """Load the lens of a project, build what it asks for, and compute its opening and focus.

    Parameters
    ----------
    project : Project

    Returns
    -------
    Settled

    Raises
    ------
    FlarewrightError
        As `load_lens`, `build` and `first_order`.
    """
    remarks: list[str] = []
    lens = as_lens(project.lens, remarks=remarks)
    camera = project.camera
    if camera.squeeze is None and lens.squeeze is not None:
        camera = camera.replace(squeeze=lens.squeeze)
        project = project.replace(camera=camera)
    if camera.desqueeze and camera.squeeze is None:
        remarks.append(f"{lens.name} squeezes nothing, so desqueeze changes nothing; state a squeeze if it does")
    built = build(
        lens, project.coating, zoom=project.zoom, filter_plate=project.filter, cover_glass=camera.cover_glass,
        imperfection=project.imperfection, sensor_distance=camera.sensor_distance,
        focus_distance=camera.focus_distance,
    )  # fmt: skip
    lens = built.lens
    order = first_order(
        lens, project.f_number, sensor_distance=built.sensor_distance, focus_distance=built.focus_distance
    )
    if order.sensor_distance > 1e5:
        raise LensError(
            f"{lens.name}: the sensor would stand {order.sensor_distance / 1000:.0f} m behind the lens; check the focus"
        )
    iris = project.iris if project.iris is not None else lens.iris
    return Settled(project, lens, built.coating, iris, order, (*remarks, *built.remarks))
