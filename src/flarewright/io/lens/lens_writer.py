"""Write a lens as TOML: one row of the prescription per line, radii with the fewest digits that are exact."""

from __future__ import annotations

import json
from pathlib import Path

from ...model import Coating, Lens, Row, Stop
from ...model.lens.iris import Iris
from ..files.atomic_write import write_text_atomically
from .coating_text import UNCOATED, format_coating
from .lens_fields import TOP_NUMBERS, TOP_TEXTS
from .scatter_text import scatter_lines
from .shape_fields import POSITION_NUMBERS, shape_parts


def write_lens(lens: Lens, path: str | Path) -> None:
    """Write a lens file that `read_lens` reads back as the same lens.

    Raises
    ------
    OutputError
        When the file cannot be written; no partial file remains.
    """
    text = format_lens(lens)
    write_text_atomically(path, text, newline="\n")


def format_lens(lens: Lens) -> str:
    """Return the text of a lens file.

    Returns
    -------
    str
        TOML without dispersions: the reader derives them from glass, n_d and V_d.
    """
    lines = [f"schema_version = {lens.schema_version}"]
    lines += [f"{key} = {_text(getattr(lens, key))}" for key in TOP_TEXTS if getattr(lens, key) or key == "name"]
    lines += [f"{key} = {_number(getattr(lens, key))}" for key in TOP_NUMBERS if getattr(lens, key) is not None]
    lines += ["", "rows = [", *(f"  {{ {_row(row)} }}," for row in lens.rows), "]"]
    for element in lens.elements:
        lines += ["", "[[elements]]", f"rows = [{element.rows[0]}, {element.rows[1]}]"]
        lines += [f"{key} = [{', '.join(map(_number, getattr(element, key)))}]" for key in ("decentre", "tilt_deg")]
    for position in lens.positions:
        gaps = ", ".join(f"{row} = {_number(gap)}" for row, gap in position.gaps)
        lines += ["", "[[positions]]", f"name = {_quoted(position.name)}"]
        lines += [
            f"{key} = {_number(getattr(position, key))}"
            for key in POSITION_NUMBERS
            if getattr(position, key) is not None
        ]
        lines.append(f"gaps = {{ {gaps} }}")
    lines += scatter_lines(lens.scatter)
    if lens.iris != Iris():
        lines += ["", "[iris]", *(f"{key} = {_value(value)}" for key, value in lens.iris if value is not None)]
    if lens.coating_presets:
        lines += ["", "[coating_presets]"]
        lines += [f"{_quoted(name)} = [{', '.join(map(_coating, c))}]" for name, c in lens.coating_presets.items()]
    return "\n".join(lines) + "\n"


def _row(row: Row) -> str:
    if isinstance(row, Stop):
        return f"stop = true, thickness = {_number(row.thickness)}"
    parts = [_radius(row.curvature)]
    if row.conic:
        parts.append(f"conic = {_number(row.conic)}")
    parts += shape_parts(row, _number, _quoted, _radius)
    parts.append(f"thickness = {_number(row.thickness)}")
    if row.medium is not None:
        if row.medium.glass is not None:
            parts.append(f"glass = {_quoted(row.medium.glass)}")
        parts.append(f"n_d = {_number(row.medium.n_d)}")
        if row.medium.v_d is not None:
            parts.append(f"v_d = {_number(row.medium.v_d)}")
    if row.semi_diameter is not None:
        parts.append(f"semi_diameter = {_number(row.semi_diameter)}")
    if row.semi_diameter_estimated:
        parts.append("semi_diameter_estimated = true")
    if row.coating is not None:
        parts.append(f"coating = {_coating(row.coating)}")
    return ", ".join(parts)


def shortest_radius(curvature: float) -> float | None:
    """Return the radius with the fewest digits that gives exactly this curvature.

    Parameters
    ----------
    curvature : float
        1/mm.

    Returns
    -------
    float or None
        mm; None for a plane, and where no radius below 1e9 mm is exact.
    """
    if curvature == 0.0 or abs(curvature) <= 1e-9:
        return None
    texts = (f"{1.0 / curvature:.{digits}g}" for digits in range(1, 18))
    return next((float(text) for text in texts if 1.0 / float(text) == curvature), None)


def _radius(curvature: float, axis: str = "") -> str:
    """Return the shortest exact radius as TOML, or the curvature where there is none."""
    if curvature == 0.0:
        return f'radius{axis} = "flat"'
    radius = shortest_radius(curvature)
    return f"curvature{axis} = {_number(curvature)}" if radius is None else f"radius{axis} = {_number(radius)}"


def _coating(coating: Coating | None) -> str:
    return f'"{UNCOATED if coating is None else format_coating(coating)}"'


def _value(value: object) -> str:
    return _quoted(value) if isinstance(value, str) else _number(value)  # type: ignore[arg-type]


def _number(value: float) -> str:
    if isinstance(value, int):
        return str(value)
    # whole numbers without a point, small and large numbers with an exponent
    return str(int(value)) if value == int(value) and 0.0 < abs(value) < 1e6 else repr(value)


def _text(text: str) -> str:
    """Return a text as a TOML string; several lines stay several lines."""
    if "\n" not in text:
        return _quoted(text)
    inner = "\n".join(_quoted(line)[1:-1] for line in text.split("\n"))
    return f'"""\n{inner}"""'


def _quoted(text: str) -> str:
    # JSON's escapes are those of TOML except for DEL
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
