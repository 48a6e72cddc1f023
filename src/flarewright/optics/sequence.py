"""Make a lens of a sequential ray-trace file, or tell why it is none.

Such a file is right where a table typed from a patent may be wrong, so little is repaired: idle planes go, the stop
gets a row of its own, and the f-number follows from whatever sets the opening.
"""

from __future__ import annotations

from math import atan, degrees

from ..errors import LensError
from ..model import Lens, Row, Stop, Surface
from ..model.raw_lens import LensReading, RawSequence, SequenceRow
from .paraxial import FirstOrder, first_order

# what is worth telling: distance of the stated image from the focus, mm
IMAGE_OFF = 1.0
# the opening at which a lens is looked at before its f-number is known
TRIAL = 8.0


def lens_of_sequence(raw: RawSequence) -> LensReading:
    """Make a lens of what a sequential file says.

    Parameters
    ----------
    raw : RawSequence

    Returns
    -------
    LensReading
        The lens and a remark for everything that was changed, assumed or left out.

    Raises
    ------
    LensError
        It is no camera lens by itself.
    """
    remarks: list[str] = []
    kept, front = _without_idle(raw, remarks)
    rows = _with_stop(raw, kept, remarks)
    draft = Lens(name=raw.name, source=f"from {raw.file}", f_number=TRIAL, rows=tuple(rows))
    order = _order(raw, draft)
    f_number = _f_number(raw, order, remarks)
    if not 0.3 < f_number <= 256.0:
        raise LensError(f"{raw.file}: its opening would be f/{f_number:.3g}, which no lens has: set FNUM")
    _tell_image(kept[-1], order, remarks)
    rows = _within_spheres(rows, remarks)
    _tell_rims(kept, remarks)
    distance = None if raw.focus_distance is None else raw.focus_distance + front
    if distance is not None:
        remarks.append(f"the object stands {distance:g} mm in front of the lens; it is focused there")
    lens = draft.replace(rows=tuple(rows), f_number=f_number, field_deg=_field_deg(raw, order), focus_distance=distance)
    remarks += raw.remarks
    notes = [f"Imported from {raw.file}.", raw.notes, *remarks]
    return LensReading(lens.replace(notes="\n".join(note for note in notes if note)), tuple(remarks))


def _without_idle(raw: RawSequence, remarks: list[str]) -> tuple[list[SequenceRow], float]:
    """Drop surfaces with the same medium on both sides; also return how far the first one stood in front."""
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
        remarks.append(f"{which}: the same medium on both sides, so nothing is refracted or reflected; left out")
    return kept, front


def _with_stop(raw: RawSequence, kept: list[SequenceRow], remarks: list[str]) -> list[Row]:
    """Give the stop a row of its own, for here it refracts nothing."""
    if not any(row.surface.medium is not None for row in kept):
        raise LensError(f"{raw.file}: no surface has glass behind it, so nothing bends the light")
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
            # what it is shaped like does nothing
            rows.append(Stop(thickness=surface.thickness))
        elif before is None:
            rows += [Stop(), surface]
            remarks.append(f"surface {row.number} is the stop and refracts: the stop stands in front of it")
        elif behind is None:
            rows += [surface.replace(thickness=0.0), Stop(thickness=surface.thickness)]
            remarks.append(f"surface {row.number} is the stop and refracts: the stop stands behind it")
        else:
            raise LensError(f"{raw.file}: surface {row.number}: the stop stands inside glass: move it into an air gap")
        before = behind
    return rows


def _order(raw: RawSequence, draft: Lens) -> FirstOrder:
    try:
        return first_order(draft)
    except LensError as error:
        raise LensError(f"{raw.file}: {str(error).removeprefix(f'{draft.name}: ')}") from None


def _f_number(raw: RawSequence, order: FirstOrder, remarks: list[str]) -> float:
    if raw.f_number is not None:
        return raw.f_number
    if raw.entrance_pupil_diameter is not None:
        return order.efl / raw.entrance_pupil_diameter
    if raw.stop_semi_diameter is None:
        raise LensError(f"{raw.file}: nothing tells its opening: set FNUM, ENPD or the stop's semi-diameter")
    found = TRIAL * order.stop_semi_diameter / raw.stop_semi_diameter
    remarks.append(f"the stop's semi-diameter of {raw.stop_semi_diameter:g} mm gives f/{found:.2f}")
    return found


def _field_deg(raw: RawSequence, order: FirstOrder) -> float | None:
    if raw.image_height is not None:
        return degrees(atan(raw.image_height / order.efl))
    return raw.field_deg


def _tell_image(last: SequenceRow, order: FirstOrder, remarks: list[str]) -> None:
    gap = last.surface.thickness
    if abs(gap - order.bfl) > IMAGE_OFF:
        remarks.append(
            f"the file's image lies {gap:.2f} mm behind the last surface, {gap - order.bfl:+.2f} mm from the paraxial "
            f"focus ({order.bfl:.2f}); the sensor is placed at the focus"
        )


def _within_spheres(rows: list[Row], remarks: list[str]) -> list[Row]:
    """Leave out rims that lie beyond their own surface, to be estimated."""
    kept: list[Row] = []
    for k, row in enumerate(rows):
        if isinstance(row, Surface) and row.semi_diameter is not None and row.semi_diameter > row.equator:
            remarks.append(
                f"row {k}: a rim of {row.semi_diameter:g} mm does not fit a surface that ends {row.equator:g} mm from "
                "the axis; it will be estimated"
            )
            kept.append(row.replace(semi_diameter=None))
        else:
            kept.append(row)
    return kept


def _tell_rims(kept: list[SequenceRow], remarks: list[str]) -> None:
    rows = [str(row.number) for row in kept if row.automatic_rim and not row.stop and row.surface.semi_diameter]
    if rows:
        remarks.append(
            f"the rims of surface{'s'[: len(rows) > 1]} {', '.join(rows)} just pass the file's own fields: chosen by "
            "the program that wrote it, they are not the maker's"
        )
