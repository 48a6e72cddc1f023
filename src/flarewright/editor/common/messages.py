"""Names of fields on the page, and one-sentence messages for rejected values."""

from __future__ import annotations

import re

from ...sentences import INVALID, validation_sentences

# names of fields on the page; other fields are named by their own words, without units
SPOKEN = {
    "n_d": "index n_d", "v_d": "Abbe number V_d", "semi_diameter": "semi-diameter", "thickness": "gap",
    "exposure_stops": "exposure", "plate_stops": "exposure of the plate", "dust_per_mm2": "dust per mm²",
    "scratches_per_cm2": "scratches per cm²", "scratch_um": "scratch width", "scratch_mm": "scratch length",
    "f_number": "f-number", "sensor_reflectance": "reflectance of the sensor",
    "gain.ghosts": "gain of the ghosts", "gain.starburst": "gain of the starburst", "gain.scatter": "gain of the haze",
    "size_px": "size of the picture", "sensor_mm": "size of the sensor", "at_s": "time",
    "field_deg": "angle of the light",
}  # fmt: skip
UNITS = ("mm", "um", "nm", "deg", "px", "s", "k", "stops")
BOUNDS = {"greater than or equal to": "at least", "less than or equal to": "at most", "greater than": "more than"}
_INDEX = re.compile(r"\[\d+\]")
_REPORTED = re.compile(r"([\w.\[\]]+)( should be |: )(.*)", re.DOTALL)


def sentence(error: Exception) -> str:
    """Return one sentence for an error that rejected an edit."""
    if isinstance(error, INVALID):
        return "; ".join(_said(message) for message in validation_sentences(error))
    return " ".join(str(error).split())


def _said(message: str) -> str:
    """Reword a validation message such as "dust_per_mm2 should be greater than or equal to 0"."""
    found = _REPORTED.fullmatch(message)
    if found is None:
        return message
    field, joint, what = spoken(_INDEX.sub("", found[1])), found[2].replace("should", "must"), found[3]
    for code, bound in BOUNDS.items():
        what = what.replace(code, bound)
    return f"{field}{joint}{what}"


def spoken(field: str) -> str:
    """Return the page's name of a field: "dust per mm²" for "dirt.dust_per_mm2"."""
    if field in SPOKEN:
        return SPOKEN[field]
    parts = [part for part in field.split(".") if not part.isdigit()] or [field]
    return SPOKEN.get(parts[-1]) or " ".join(part for part in parts[-1].split("_") if part not in UNITS) or field
