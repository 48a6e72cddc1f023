"""Make a lens of a sequential ray-trace file, or raise an error with the reason.

Such files are more reliable than tables typed from patents, so repairs are few: idle planes are dropped, the stop
becomes a separate row, and the f-number follows from the aperture specification.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import atan, degrees
from pathlib import Path

from ...errors import LensError
from ...model import Lens, Row, Stop, Surface
from ...model.lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER, NO_GLASS
from ...model.lens.raw_lens import LensReading, RawSequence, SequenceRow
from ...sentences import INVALID, validation_sentences
from ..lens.paraxial import FirstOrder, first_order
from .configurations import Setting, positions_of

# threshold for a remark: distance of the stated image from the focus, part of the focal length
IMAGE_OFF = 0.02
# f-number of the draft lens before the real one is known
TRIAL = 8.0
# what states the f-number in a file, by suffix
F_NUMBER_KEYS = {".zmx": "FNUM", ".seq": "FNO", ".len": "FNO", ".csv": "# f_number = ...", ".json": "its f-number"}


def lens_of_sequence(raw: RawSequence) -> LensReading:
    """Make a lens of a sequential file's contents.

    Returns
    -------
    LensReading
        The lens and a remark for every change, assumption and omission.

    Raises
    ------
    LensError
        When it is no complete camera lens.
    """
    remarks: list[str] = []
    kept, front = _without_idle(raw, remarks)
    rows = _with_stop(raw, kept, remarks)
    draft = Lens(name=raw.name, source=f"from {raw.file}", f_number=TRIAL, rows=tuple(rows))
    order = order_of(raw.file, draft)
    f_number = _f_number(raw, order, remarks)
    if not LEAST_F_NUMBER < f_number <= LARGEST_F_NUMBER:
        raise LensError(f"{raw.file}: its f-number would be f/{f_number:.3g}, out of range for a lens: {_way_out(raw)}")
    _remark_image(kept[-1], order, remarks)
    rows = _within_spheres(rows, remarks)
    _remark_rims(kept, remarks)
    distance = None if raw.focus_distance is None else raw.focus_distance + front
    if distance is not None:
        remarks.append(f"the object lies {distance:g} mm in front of the lens; it is focused there")
    lens = draft.replace(
        rows=tuple(rows), f_number=f_number, field_deg=_field_deg(raw, order), focus_distance=distance,
        stated_focal_length=raw.stated_focal_length,
    )  # fmt: skip
    positions, found = positions_of(lens, tuple(_settings(raw, remarks)))
    lens = lens.replace(positions=positions)
    remarks += found
    remarks += raw.remarks
    notes = [f"Imported from {raw.file}.", raw.notes, *remarks]
    return LensReading(lens.replace(notes="\n".join(note for note in notes if note)), tuple(remarks))


def _settings(raw: RawSequence, remarks: list[str]) -> Iterator[Setting]:
    """Return the lens at each configuration of the file; a remark names those that form no lens."""
    for one in raw.configurations:
        gaps = dict(one.gaps)
        try:
            moved = raw.replace(
                rows=tuple(
                    row.replace(surface=row.surface.replace(thickness=gaps[row.number])) if row.number in gaps else row
                    for row in raw.rows
                ),
                f_number=one.f_number, entrance_pupil_diameter=one.entrance_pupil_diameter,
                stop_semi_diameter=one.stop_semi_diameter, field_deg=one.field_deg, image_height=one.image_height,
            )  # fmt: skip
            kept, front = _without_idle(moved, [])
            distance = None if one.focus_distance is None else one.focus_distance + front
            rows = tuple(_with_stop(moved, kept, []))
            order = order_of(moved.file, Lens(name=raw.name, f_number=TRIAL, focus_distance=distance, rows=rows))
            yield Setting(
                number=one.number, rows=rows, efl=order.efl, f_number=_f_number(moved, order, []),
                field_deg=_field_deg(moved, order), focus_distance=distance,
            )  # fmt: skip
        except LensError as error:
            why = str(error).removeprefix(f"{raw.file}: ")
            remarks.append(f"configuration {one.number} is left out: {why}")
        except INVALID as error:
            remarks.append(f"configuration {one.number} is left out: {validation_sentences(error)[0]}")


def _without_idle(raw: RawSequence, remarks: list[str]) -> tuple[list[SequenceRow], float]:
    """Drop surfaces with the same medium on both sides; also return the distance from the first of them to the lens."""
    kept: list[SequenceRow] = []
    idle: list[str] = []
    front = 0.0
    before = None
    for row in raw.rows:
        behind = row.surface.medium
        if row.stop or behind != before:
            kept.append(row)
        else:
            idle.append(str(row.number))
            if kept:
                last = kept[-1].surface
                kept[-1] = kept[-1].replace(surface=last.replace(thickness=last.thickness + row.surface.thickness))
            else:
                front += row.surface.thickness
        before = behind
    if idle:
        which = f"surface{'s'[: len(idle) > 1]} {', '.join(idle)}"
        remarks.append(f"{which}: the same medium on both sides, so no refraction or reflection; dropped")
    return kept, front


def _with_stop(raw: RawSequence, kept: list[SequenceRow], remarks: list[str]) -> list[Row]:
    """Insert the stop as a separate row, because here it cannot refract."""
    if not any(row.surface.medium is not None for row in kept):
        raise LensError(f"{raw.file}: {NO_GLASS}")
    if kept[-1].surface.medium is not None:
        raise LensError(f"{raw.file}: surface {kept[-1].number}: the image lies inside glass, so it is no camera lens")
    if sum(row.stop for row in kept) != 1:
        raise LensError(f"{raw.file}: {sum(row.stop for row in kept)} surfaces are the stop; a lens has exactly one")
    rows: list[Row] = []
    before = None
    for row in kept:
        surface, behind = row.surface, row.surface.medium
        if not row.stop:
            rows.append(surface)
        elif before is None and behind is None:
            # the shape of an idle surface has no effect
            rows.append(Stop(thickness=surface.thickness))
        elif before is None:
            rows += [Stop(), surface]
            remarks.append(f"surface {row.number} is the stop and refracts: the stop is placed in front of it")
        elif behind is None:
            rows += [surface.replace(thickness=0.0), Stop(thickness=surface.thickness)]
            remarks.append(f"surface {row.number} is the stop and refracts: the stop is placed behind it")
        else:
            raise LensError(f"{raw.file}: surface {row.number}: the stop stands inside glass: move it into an air gap")
        before = behind
    return rows


def order_of(file: str, draft: Lens) -> FirstOrder:
    """Return the first-order data of a draft; its errors name the file."""
    try:
        return first_order(draft)
    except LensError as error:
        raise LensError(f"{file}: {str(error).removeprefix(f'{draft.name}: ')}") from None


def _way_out(raw: RawSequence) -> str:
    """Return the remedy for a file without a usable f-number, in the words of its format."""
    key = F_NUMBER_KEYS.get(Path(raw.file).suffix.lower())
    return "state the stop's diameter" if key is None else f"state {key} or the stop's semi-diameter"


def _f_number(raw: RawSequence, order: FirstOrder, remarks: list[str]) -> float:
    if raw.f_number is not None:
        return raw.f_number
    if raw.entrance_pupil_diameter is not None:
        return order.efl / raw.entrance_pupil_diameter
    if raw.stop_semi_diameter is None:
        raise LensError(f"{raw.file}: the aperture is not specified: {_way_out(raw)}")
    found = TRIAL * order.stop_semi_diameter / raw.stop_semi_diameter
    remarks.append(f"the stop's semi-diameter of {raw.stop_semi_diameter:g} mm gives f/{found:.2f}")
    return found


def _field_deg(raw: RawSequence, order: FirstOrder) -> float | None:
    if raw.image_height is not None:
        return degrees(atan(raw.image_height / order.efl))
    return raw.field_deg


def _remark_image(last: SequenceRow, order: FirstOrder, remarks: list[str]) -> None:
    gap = last.surface.thickness
    # readers write 0 for a gap that the file leaves open, and report it
    if gap != 0.0 and abs(gap - order.bfl) > IMAGE_OFF * order.efl:
        remarks.append(
            f"the file's image lies {gap:.2f} mm behind the last surface, {gap - order.bfl:+.2f} mm from the paraxial "
            f"focus ({order.bfl:.2f}); the sensor is placed at the focus"
        )


def _within_spheres(rows: list[Row], remarks: list[str]) -> list[Row]:
    """Remove semi-diameters beyond the equator of their surface; estimates replace them."""
    kept: list[Row] = []
    for k, row in enumerate(rows):
        if isinstance(row, Surface) and row.semi_diameter is not None and row.semi_diameter > row.equator:
            remarks.append(
                f"row {k}: a rim of {row.semi_diameter:g} mm does not fit a surface that ends {row.equator:g} mm from "
                "the axis; using an estimate"
            )
            kept.append(row.replace(semi_diameter=None))
        else:
            kept.append(row)
    return kept


def _remark_rims(kept: list[SequenceRow], remarks: list[str]) -> None:
    rows = [str(row.number) for row in kept if row.automatic_rim and not row.stop and row.surface.semi_diameter]
    if rows:
        remarks.append(
            f"the rims of surface{'s'[: len(rows) > 1]} {', '.join(rows)} just pass the file's own fields: the program "
            "that wrote the file chose them, not the maker"
        )
