"""Validate and repair an imported prescription: a remark for every repair, an error for anything but a camera lens.

The checks address known faults of a large public collection of `.lens` tables: apertures given as diameters, missing
stops, wrong focal lengths and image planes, inverted coating marks, dropped aspheric terms, and converters and mirror
lenses among the lenses.
"""

from __future__ import annotations

import re
from math import isfinite, sqrt
from typing import Literal

import numpy as np

from ...errors import LensError
from ...model import Coating, Lens, QuarterWave, Row, Stop, Surface
from ...model.lens.prescription import NO_GLASS
from ...model.lens.raw_lens import LensReading, RawLens, RawRow
from ...typing import Floats
from ..lens.dispersion import D_LINE_NM
from ..lens.paraxial import FirstOrder, first_order, path_matrices
from ..lens.paths import direct_path
from ..rays.single_rays import trace_polylines
from .sequential_import import order_of

Apertures = Literal["auto", "diameters", "semi-diameters"]

# centre wavelength of coatings that are only marked: the middle of the visible range
COATED_NM = 550.0
# thresholds for remarks, parts of the focal length: its error, and the distance of the stated image from the focus,
# which a focal length wrong by that part would cause
FOCAL_LENGTH_OFF = IMAGE_OFF = 0.02
# tolerance of the f-number from the stop column (headers round to one decimal)
STOP_OFF = 0.15
# largest rms radius of the axial image at best focus of photographic lenses with spherical surfaces (Biotar f/1.4:
# 0.027 mm, Tessar 100 mm f/4.5: 0.021 mm), part of the entrance pupil's diameter
AXIAL_BLUR = 1.3e-3
# largest thickness of the resin layer of a moulded asphere, mm (the process sets it, whatever the lens' size), and the
# indices of such resins
RESIN = 0.3
RESIN_INDEX = (1.48, 1.57)
# fraction of the axial beam's radius that a rim can cut without a remark
RIM_CUT = 0.02
# a focal length above this multiple of the length of the glass means an afocal system
AFOCAL = 200.0
# tolerance of the f-number in a file's name (names round)
NAME_OFF = 0.06
# an f-number in a file's name: F2.8, f-2.8, f_2.8, f2,8; for a zoom the first
_IN_NAME = re.compile(r"(?<![A-Za-z0-9])[Ff][-_]?(\d{1,2}(?:[.,]\d+)?)(?!\d|[.,]\d|mm)")


def repair(raw: RawLens, apertures: Apertures = "auto") -> LensReading:
    """Make a lens of a raw table.

    Parameters
    ----------
    raw : RawLens
    apertures : {"auto", "diameters", "semi-diameters"}
        Meaning of the aperture column; "auto" takes the reading for which the stop gives the stated f-number.

    Returns
    -------
    LensReading
        The lens and a remark for every repair, assumption and contradiction.

    Raises
    ------
    LensError
        When the table is no complete camera lens, or is damaged beyond repair.
    """
    _check_camera_lens(raw)
    remarks: list[str] = []
    rows = _without_idle_rows(raw, remarks)
    name = _full_name(raw, remarks)
    draft = _draft(raw, rows, name)
    order = order_of(raw.file, draft)
    per_mm, order, draft = _read_apertures(raw, rows, draft, order, apertures, remarks)
    faults = _contradictions(raw, rows, order, remarks)
    if faults > 1 or (faults and abs(_stop_ratio(rows, order) * 2.0 * per_mm - 1.0) > STOP_OFF):
        remarks.append(
            "the table contradicts itself in more than one way, so a radius or gap is probably wrong: "
            "its ghosts differ from the real lens; compare with the patent"
        )
    finished = _finish(rows, draft, per_mm, remarks)
    _remark_aspheres(raw, rows, finished, order, remarks)
    _remark_rims(raw, rows, finished, order, remarks)
    remarks += raw.remarks
    return LensReading(finished.replace(notes="\n".join((f"Imported from {raw.file}.", *remarks))), tuple(remarks))


def _check_camera_lens(raw: RawLens) -> None:
    """Raise LensError with the reason when the table is no camera lens."""
    rows = raw.rows
    stops = [k for k, row in enumerate(rows) if row.stop]
    if raw.stated_surfaces not in (None, len(rows)):
        raise LensError(
            f"{raw.file}: the header counts {raw.stated_surfaces} surfaces, the table has {len(rows)}: rows are missing"
        )
    if len(stops) > 1:
        lines = ", ".join(str(rows[k].line) for k in stops)
        raise LensError(f"{raw.file}: lines {lines} are all stops: a lens has one, remove the others")

    # between surfaces light runs backwards only after a mirror; next to the stop a negative gap only moves its plane
    for k, row in enumerate(rows[:-1]):
        if row.thickness < 0.0 and not row.stop and not rows[k + 1].stop:
            raise LensError(
                f"{raw.file}: light runs backwards behind line {row.line} (thickness {row.thickness:g}), "
                "as in a mirror lens: reflecting surfaces are not supported"
            )
    if len(rows) - len(stops) < 2 or _index_behind(rows) > 1.0:
        raise LensError(
            f"{raw.file}: the table has {len(rows)} row{'s' * (len(rows) != 1)} and ends "
            f"{'inside glass' if _index_behind(rows) > 1.0 else 'there'}: surfaces are missing, so it is no lens"
        )
    if all(row.medium is None for row in rows):
        raise LensError(f"{raw.file}: {NO_GLASS}")
    _check_positive_focal_length(raw)
    if not stops and raw.f_number is None:
        raise LensError(
            f"{raw.file}: it has neither a stop nor an f-number: an attachment (a close-up lens), "
            "no complete camera lens"
        )
    if not stops:
        raise LensError(
            f"{raw.file}: no row is the stop, and its position is unknown: add a row that begins with `stop`"
        )
    if stops[0] > 0 and _index_behind(rows[: stops[0]]) > 1.0:
        raise LensError(
            f"{raw.file}: line {rows[stops[0]].line}: the stop stands inside glass: move it into an air gap"
        )


def _check_positive_focal_length(raw: RawLens) -> None:
    """Raise LensError for systems without a positive focal length: tele-converters and afocal attachments."""
    surfaces: list[Surface] = []
    for row in raw.rows:
        if not row.stop:
            surfaces.append(_surface(row))
        elif surfaces:
            surfaces[-1] = surfaces[-1].replace(thickness=surfaces[-1].thickness + row.thickness)
    probe = Lens(name="probe", f_number=8.0, rows=(Stop(), *surfaces))
    _, system = path_matrices(probe, direct_path(probe), D_LINE_NM, sum(row.thickness for row in surfaces[:-1]))
    power = -system[1, 0]
    length = sum(abs(row.thickness) for row in surfaces[:-1])
    if abs(power) * AFOCAL * length < 1.0:
        raise LensError(
            f"{raw.file}: it is afocal (a conversion lens in front of another lens), no complete camera lens"
        )
    if power < 0.0:
        raise LensError(
            f"{raw.file}: its focal length is negative ({1.0 / power:.2f} mm): a tele-converter that works only "
            "behind another lens"
        )


def _without_idle_rows(raw: RawLens, remarks: list[str]) -> list[RawRow]:
    """Drop surfaces with the same medium on both sides; their gap is added to that of the row before."""
    kept: list[RawRow] = []
    before = (1.0, 0.0)
    for row in raw.rows:
        behind = before if row.stop else (row.n_d, row.v_d if row.n_d > 1.0 else 0.0)
        if row.stop or behind != before:
            kept.append(row)
        else:
            plane = row.n_d == 1.0 and row.curvature == 0.0
            what = "a plane in air" if plane else "a surface with the same medium on both sides"
            remarks.append(f"line {row.line}: {what} neither refracts nor reflects; dropped together with its rim")
            if kept:
                kept[-1] = kept[-1].replace(thickness=kept[-1].thickness + row.thickness)
        before = behind
    return kept


def _full_name(raw: RawLens, remarks: list[str]) -> str:
    """Return the most complete of the name line, the header's title and the file name's parenthesis."""
    inner = re.search(r"\((.*)\)", raw.file)
    in_file = inner[1].lstrip("(").replace("_", " ") if inner else ""
    name = raw.name or raw.title or in_file or raw.file.removesuffix(".lens").replace("_", " ")
    for candidate in (raw.title, in_file):
        if len(_letters(candidate)) > len(_letters(name)) and _letters(candidate).startswith(_letters(name)):
            remarks.append(f"the name {name!r} is cut short; using {candidate!r}")
            name = candidate
    # the number before a parenthesis is measured, that inside belongs to the maker's name
    stated = _IN_NAME.search(raw.file.partition("(")[0]) or _IN_NAME.search(raw.file)
    if stated and raw.f_number:
        number = float(stated[1].replace(",", "."))
        if abs(number / raw.f_number - 1.0) > NAME_OFF:
            remarks.append(f"the file name says f/{number:g}, the header f/{raw.f_number:g}; using the header's")
    return name


def _letters(text: str) -> str:
    return re.sub(r"\W+", "", text).lower()


def _draft(raw: RawLens, rows: list[RawRow], name: str) -> Lens:
    """Return the lens without apertures, which suffices for first-order properties."""
    lens_rows: list[Row] = [Stop(thickness=row.thickness) if row.stop else _surface(row) for row in rows]
    patent = f"patent {raw.patent}; " if raw.patent else ""
    return Lens(
        name=name,
        source=f"{patent}from a .lens table",
        f_number=raw.f_number or 8.0,
        stated_focal_length=raw.focal_length if raw.focal_length and raw.focal_length > 0.0 else None,
        rows=tuple(lens_rows),
    )


def _surface(row: RawRow) -> Surface:
    return Surface(curvature=row.curvature, thickness=row.thickness, medium=row.medium)


def _index_behind(rows: tuple[RawRow, ...]) -> float:
    return next((row.n_d for row in reversed(rows) if not row.stop), 1.0)


def _stop_ratio(rows: list[RawRow], order: FirstOrder) -> float:
    """Return stop column over stop diameter at the f-number: 1 for diameters, 0.5 for semi-diameters, 0 unknown."""
    return next(row.aperture for row in rows if row.stop) / order.stop_semi_diameter / 2.0


def _read_apertures(
    raw: RawLens, rows: list[RawRow], draft: Lens, order: FirstOrder, apertures: Apertures, remarks: list[str]
) -> tuple[float, FirstOrder, Lens]:
    """Interpret the aperture column; return semi-diameter per column value, and the lens with its f-number."""
    ratio = _stop_ratio(rows, order)
    if raw.f_number is None:
        per_mm = 1.0 if apertures == "semi-diameters" else 0.5
        if ratio <= 0.0:
            raise LensError(
                f"{raw.file}: neither the header nor the stop's aperture gives the f-number: add f/... to the header"
            )
        number = draft.f_number / (2.0 * ratio * per_mm)
        draft = draft.replace(f_number=number)
        column = ratio * 2.0 * order.stop_semi_diameter
        remarks.append(f"no f-number is stated; the stop of {column:g} mm gives f/{number:.2f}")
        order = first_order(draft)
        read = "diameters, as in nearly all files of this kind" if apertures == "auto" else f"{apertures}, as requested"
        remarks.append(f"the aperture column is read as {read}")
        return per_mm, order, draft
    if apertures != "auto":
        remarks.append(f"the aperture column is read as {apertures}, as requested")
        return (0.5 if apertures == "diameters" else 1.0), order, draft
    if ratio <= 0.0:
        remarks.append("the stop has no aperture; the column is read as diameters, as in nearly all files of this kind")
        return 0.5, order, draft
    as_diameter, as_radius = raw.f_number / ratio, raw.f_number / (2.0 * ratio)
    diameters = abs(np.log(as_diameter / raw.f_number)) <= abs(np.log(as_radius / raw.f_number))
    kind, per_mm, best = ("diameters", 0.5, as_diameter) if diameters else ("semi-diameters", 1.0, as_radius)
    why = f"the stop then gives f/{best:.2f}, the header says f/{raw.f_number:g}"
    if abs(best / raw.f_number - 1.0) > STOP_OFF:
        why += ", so neither reading fits; using the header's f-number"
    remarks.append(f"the aperture column is read as {kind}: {why}")
    return per_mm, order, draft


def _contradictions(raw: RawLens, rows: list[RawRow], order: FirstOrder, remarks: list[str]) -> int:
    """Add remarks where header and last gap contradict the traced lens; return the number of contradictions."""
    found = 0
    if raw.focal_length and abs(order.efl / raw.focal_length - 1.0) > FOCAL_LENGTH_OFF:
        off = 100.0 * (order.efl / raw.focal_length - 1.0)
        remarks.append(f"the focal length is {order.efl:.2f} mm, not {raw.focal_length:g} as stated ({off:+.1f} %)")
        found += 1
    image = rows[-1].thickness
    if abs(image - order.bfl) > IMAGE_OFF * order.efl:
        remarks.append(
            f"the stated image plane ({image:.2f} mm behind the last row) is {image - order.bfl:+.2f} mm from the "
            f"paraxial focus ({order.bfl:.2f}); the sensor is placed at the focus"
        )
        found += 1
    return found


def _finish(rows: list[RawRow], draft: Lens, per_mm: float, remarks: list[str]) -> Lens:
    """Add rim and coating to every surface."""
    coatings = _coatings(rows, remarks)
    finished: list[Row] = []
    for row, drafted, coating in zip(rows, draft.rows, coatings, strict=True):
        if not isinstance(drafted, Surface):
            finished.append(drafted)
            continue
        semi: float | None = row.aperture * per_mm
        if not semi:
            remarks.append(f"line {row.line}: no aperture is given; using an estimate")
            semi = None
        elif semi > drafted.equator:
            remarks.append(
                f"line {row.line}: a rim of {semi:g} mm does not fit a radius of {1 / row.curvature:g}; "
                "using an estimate"
            )
            semi = None
        finished.append(drafted.replace(semi_diameter=semi, coating=coating))
    return Lens.model_validate({**dict(draft), "rows": tuple(finished)})


def _coatings(rows: list[RawRow], remarks: list[str]) -> list[Coating | None]:
    """Return coatings for the marked coating layers, unless the marks only repeat the index column."""
    surfaces = [row for row in rows if not row.stop]
    marked = [row.coating_layers > 0 for row in surfaces]
    none: list[Coating | None] = [None] * len(rows)
    if not any(marked):
        remarks.append("no surface is marked as coated; all are bare")
        return none
    if marked == [row.n_d > 1.0 for row in surfaces]:
        remarks.append(
            "coating marks dropped: they repeat the index column (every glass-to-air surface uncoated, "
            "every cemented one coated); all surfaces are bare until you choose a coating"
        )
        return none
    coatings: list[Coating | None] = []
    before = 1.0
    for row in rows:
        outer = not row.stop and (before == 1.0) != (row.n_d == 1.0)
        coatings.append(QuarterWave(center_wavelength_nm=COATED_NM) if outer and row.coating_layers else None)
        before = before if row.stop else row.n_d
    remarks.append(f"the file gives only the number of coating layers; using a quarter wave at {COATED_NM:g} nm")
    return coatings


def _remark_aspheres(raw: RawLens, rows: list[RawRow], lens: Lens, order: FirstOrder, remarks: list[str]) -> None:
    """Add a remark when the real lens has aspheres that the table, which has only spheres, lacks."""
    signs: list[str] = []
    if re.search(r"\basph", f"{lens.name} {raw.title} {raw.file}".replace("_", " "), re.IGNORECASE):
        signs.append("the name says aspherical")
    if resins := [str(row.line) for row in _resin_layers(rows)]:
        lines = f"line{'s' * (len(resins) > 1)} {', '.join(resins)}"
        signs.append(f"{lines}: a thin resin layer against air is a moulded asphere")
    blur = _axial_blur(lens, order)
    if not isfinite(blur):
        signs.append("with spheres alone, rays of the axial beam do not reach the sensor")
    elif blur > (largest := AXIAL_BLUR * order.entrance_pupil_diameter):
        signs.append(
            f"with spheres alone the axial spot wide open is {blur:.2g} mm rms at best focus, "
            f"a real lens stays below {largest:.2g}"
        )
    if signs:
        remarks.append(
            f"aspheric (or diffractive) terms were dropped from the table ({'; '.join(signs)}): "
            "every surface is traced as a sphere, so image and ghosts only approximate those of the real lens"
        )


def _resin_layers(rows: list[RawRow]) -> list[RawRow]:
    """Return thin layers on glass of plastic index, with air on one side."""
    low, high = RESIN_INDEX
    found = []
    for k, row in enumerate(rows[:-1]):
        front = 1.0 if k == 0 or rows[k - 1].stop else rows[k - 1].n_d
        against_air = (front == 1.0) != (rows[k + 1].n_d == 1.0)
        if not row.stop and low <= row.n_d <= high and row.thickness <= RESIN and against_air:
            found.append(row)
    return found


def _axial_blur(lens: Lens, order: FirstOrder) -> float:
    """Return the rms radius of the axial image at best focus, mm, wide open without rims; infinite if rays fail."""
    y = (np.arange(64, dtype=np.float64) + 0.5) / 64.0 * order.entrance_pupil_diameter / 2.0
    hits = trace_polylines(lens, None, np.zeros_like(y), y, 0.0, sensor_distance=order.bfl)
    at_sensor, leaving = hits[:, -1], hits[:, -2]
    if not np.all(np.isfinite(at_sensor)):
        return float("inf")
    slope = (at_sensor[:, 1] - leaving[:, 1]) / (at_sensor[:, 2] - leaving[:, 2])

    # rings of equal width carry flux in proportion to their radius; the best focus follows from a weighted line fit
    weight = y / y.sum()
    shift = -float((weight * at_sensor[:, 1] * slope).sum() / (weight * slope * slope).sum())
    return sqrt(float((weight * (at_sensor[:, 1] + shift * slope) ** 2).sum()))


def _axial_beam(lens: Lens, order: FirstOrder) -> tuple[Floats, Floats]:
    """Return heights in the entrance pupil, shape (50,), and the heights of their rays at each row."""
    y = np.linspace(0.02, 1.0, 50) * order.entrance_pupil_diameter / 2.0
    return y, trace_polylines(lens, None, np.zeros_like(y), y, 0.0, sensor_distance=order.bfl)


def axial_opening(lens: Lens, order: FirstOrder) -> tuple[float, int]:
    """Return the relative opening of a lens for the axial beam.

    Returns
    -------
    float
        Fraction of the nominal entrance pupil radius that passes, in steps of 1/50.
    int
        Row that blocks most of the beam, at its rim or beyond its surface; 0 when the whole beam passes.
    """
    y, hits = _axial_beam(lens, order)
    opening, where, through = 1.0, 0, np.ones(len(y), dtype=np.bool_)
    for k, row in enumerate(lens.rows):
        if isinstance(row, Surface):
            rim = np.inf if row.semi_diameter is None else row.semi_diameter * (1.0 + 1e-9)
            through &= np.abs(hits[:, 1 + k, 1]) <= rim
            free = 1.0 if through.all() else float(y[: int(np.argmin(through))].max(initial=0.0) / y[-1])
            if free < opening:
                opening, where = free, k
    return opening, where


def _remark_rims(raw: RawLens, rows: list[RawRow], lens: Lens, order: FirstOrder, remarks: list[str]) -> None:
    """Add a remark when a rim cuts the axial beam, so that the lens is slower than stated."""
    y, hits = _axial_beam(lens, order)
    tightest, where = 1.0, 0
    for k, row in enumerate(lens.rows):
        if not isinstance(row, Surface) or row.semi_diameter is None:
            continue
        # a ray that failed earlier has no height here; this rim did not cut it
        through = ~(np.abs(hits[:, 1 + k, 1]) > row.semi_diameter)
        free = float(y[through].max(initial=0.0) / y[-1]) if not through.all() else 1.0
        if free < tightest:
            tightest, where = free, rows[k].line
    if tightest <= 0.0:
        raise LensError(f"{raw.file}: line {where}: its aperture lets no light through: correct it")
    if tightest < 1.0 - RIM_CUT:
        remarks.append(
            f"line {where}: its rim cuts the axial beam: the lens passes f/{lens.f_number / tightest:.2f}, "
            f"not f/{lens.f_number:g}"
        )
