"""What a library knows of a lens: the record of an opened lens."""

from __future__ import annotations

from ...io.lens.library import library_names
from ...io.lens.own.facts import maker_of, patent_of
from ...io.lens.own.record import LONGEST_REMARKS, LensRecord
from ...model import Surface
from ...optics.lens.paraxial import first_order
from ...optics.lens.zoom import at_position
from ...render.scene.resolve import OpenedLens, open_lens

_LONGEST_TEXT = 600


def record_of_lens(opened: OpenedLens, name: str, file: str = "", digest: str = "") -> LensRecord:
    """Return what a library knows of a lens.

    Parameters
    ----------
    opened : OpenedLens
    name : str
    file : str
        The file that it was made of.
    digest : str
        Of that file's bytes.

    Raises
    ------
    LensError
        The lens forms no image.
    """
    lens = opened.lens
    efl = first_order(lens).efl
    lengths = [first_order(at_position(lens, position)).efl for position in lens.positions] or [efl]
    source, notes = _short(lens.source), _short(lens.notes)
    return LensRecord(
        name=name, title=_short(lens.name), source=source, notes=notes,
        maker=maker_of(lens.name, source, name, notes, file), patent=patent_of(source, lens.name, notes, name),
        efl_mm=efl, efl_range_mm=(min(lengths), max(lengths)), f_number=lens.f_number, field_deg=lens.field_deg,
        surfaces=sum(isinstance(row, Surface) for row in lens.rows), file=file, digest=digest,
        remarks=tuple(map(_short, opened.remarks[:LONGEST_REMARKS])),
    )  # fmt: skip


def _short(text: str) -> str:
    plain = " ".join(text.split())
    return plain if len(plain) <= _LONGEST_TEXT else f"{plain[: _LONGEST_TEXT - 4]} ..."


def shipped_records() -> tuple[LensRecord, ...]:
    """Return what is known of the shipped lenses."""
    return tuple(record_of_lens(open_lens(name), name) for name in library_names())
