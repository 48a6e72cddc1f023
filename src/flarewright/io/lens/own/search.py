"""Which lenses match words and ranges of numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ....errors import ProjectError
from ....sentences import shorten
from .record import LensRecord

Range = tuple[float, float]

# a single number matches values that differ by this part: a 50 mm lens has 48.9 or 51.6 mm
_ABOUT = 0.04


@dataclass(frozen=True)
class Query:
    """What a lens has to match; empty texts and None match every lens.

    Attributes
    ----------
    words : tuple of str
        Each is contained in name, title, maker, patent, source, notes, file, f-number or focal length.
    maker, patent : str
        Part of the maker's name; part of the patent's number without points and spaces.
    focal_mm, f_number, field_deg, surfaces : tuple of float or None
        Smallest and largest value. A zoom matches if one of its focal lengths does.
    """

    words: tuple[str, ...] = ()
    maker: str = ""
    patent: str = ""
    focal_mm: Range | None = None
    f_number: Range | None = None
    field_deg: Range | None = None
    surfaces: Range | None = None


def matching(records: Iterable[LensRecord], query: Query) -> list[LensRecord]:
    """Return the records that match, in their order.

    Examples
    --------
    >>> lenses = [LensRecord("planar", "Planar 50", efl_mm=51.6, efl_range_mm=(51.6, 51.6), f_number=1.4)]
    >>> [one.name for one in matching(lenses, Query(words=("planar",), focal_mm=parse_range("50", "--focal")))]
    ['planar']
    """
    return [record for record in records if _matches(record, query)]


def _matches(record: LensRecord, query: Query) -> bool:
    low, high = record.efl_range_mm
    return (
        all(word.lower() in record.words for word in query.words)
        and query.maker.lower() in record.maker.lower()
        and _plain(query.patent) in _plain(record.patent)
        and (query.focal_mm is None or (low <= query.focal_mm[1] and high >= query.focal_mm[0]))
        and _within(record.f_number, query.f_number)
        and _within(record.field_deg, query.field_deg)
        and _within(record.surfaces, query.surfaces)
    )


def _within(value: float | None, limits: Range | None) -> bool:
    return limits is None or (value is not None and limits[0] <= value <= limits[1])


def _plain(text: str) -> str:
    return "".join(letter for letter in text.lower() if letter.isalnum())


def parse_range(text: str, flag: str) -> Range:
    """Read a number or a range.

    Parameters
    ----------
    text : str
        `50` (within 4 %), `35-85`, `-35` (up to), `85-` (from).
    flag : str
        For the error message.

    Returns
    -------
    tuple of float

    Raises
    ------
    ProjectError
        It is neither.
    """
    low, dash, high = text.strip().partition("-")
    try:
        ends = (float(low) if low else 0.0, float(high) if high else math.inf)
        if not text.strip() or text.strip() == "-" or math.isnan(sum(ends)) or ends[0] < 0.0 or ends[1] < ends[0]:
            raise ValueError
    except ValueError:
        raise ProjectError(f"{flag} {shorten(text)} is no range; write {flag} 50, 35-85, -35 or 85-") from None
    return ends if dash else (ends[0] * (1.0 - _ABOUT), ends[0] * (1.0 + _ABOUT))
