"""Text forms of plates, imperfection and sensor grating for the command line."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from pydantic import ValidationError

from ...errors import ProjectError
from ...model import Imperfection, Plate, SensorGrating
from ...sentences import validation_sentences

_Model = TypeVar("_Model", Imperfection, SensorGrating)


def parse_plate(text: str, flag: str) -> Plate:
    """Return the plate of "GLASS:THICKNESS" or "GLASS:THICKNESS:GAP".

    Parameters
    ----------
    text : str
        GLASS is a catalogue name or an index, the other parts are mm: "N-BK7:2", "1.52:2:10".
    flag : str
        Name of the flag, for the message.

    Raises
    ------
    ProjectError
        When the text has another form or a number is out of range.
    """
    parts = [part.strip() for part in text.split(":")]
    try:
        glass, *numbers = parts
        sizes = [float(number) for number in numbers]
        if not (glass and 1 <= len(sizes) <= 2):
            raise ValueError
    except ValueError:
        raise ProjectError(
            f"{flag} {text!r} is no plate; write {flag} N-BK7:2 (glass or index, thickness in mm) or {flag} N-BK7:2:5 "
            "with the gap to the lens or sensor"
        ) from None
    try:
        index = float(glass)
    except ValueError:
        index = None
    medium = {"glass": glass} if index is None else {"n_d": index}
    gap = {"gap": sizes[1]} if len(sizes) == 2 else {}
    try:
        return Plate.model_validate({"thickness": sizes[0], **medium, **gap})
    except ValidationError as error:
        raise ProjectError(f"{flag} {text!r}: {validation_sentences(error)[0]}") from None


def parse_imperfection(text: str) -> Imperfection:
    """Return the imperfection of "SEED", "SEED:DECENTRE_UM:TILT_ARCMIN" or "SEED:DECENTRE_UM:TILT_ARCMIN:FIGURE_NM".

    Raises
    ------
    ProjectError
        When the text has another form or a number is out of range.
    """
    return _parsed(
        Imperfection, text, {"seed": int, "decentre_um": float, "tilt_arcmin": float, "figure_nm": float},
        f"--imperfection {text!r}",
        "is no sample; write --imperfection 7 (a seed) or --imperfection 7:10:1:30 with the tolerances in micrometres, "
        "minutes of arc and nanometres",
    )  # fmt: skip


def parse_grating(text: str) -> SensorGrating:
    """Return the grating of "PERIOD_UM", "PERIOD_UM:FILL" or "PERIOD_UM:FILL:ORDERS".

    Raises
    ------
    ProjectError
        When the text has another form or a number is out of range.
    """
    return _parsed(
        SensorGrating, text, {"period_um": float, "fill": float, "orders": int}, f"--sensor-grating {text!r}",
        "is no grating; write --sensor-grating 8 (its period in micrometres) or --sensor-grating 8:0.7:3 with the "
        "reflecting part of it and the number of orders",
    )  # fmt: skip


def _parsed(
    kind: type[_Model], text: str, fields: dict[str, Callable[[str], float]], where: str, remedy: str
) -> _Model:
    """Return the record of numbers between colons, of which the last may be left out."""
    parts = [part.strip() for part in text.split(":")]
    try:
        if len(parts) > len(fields):
            raise ValueError
        found = {name: read(part) for (name, read), part in zip(fields.items(), parts, strict=False)}
    except ValueError:
        raise ProjectError(f"{where} {remedy}") from None
    try:
        return kind.model_validate(found)
    except ValidationError as error:
        raise ProjectError(f"{where}: {validation_sentences(error)[0]}") from None
