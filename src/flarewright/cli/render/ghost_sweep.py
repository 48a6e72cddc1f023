"""`flarewright ghosts --sweep`: the axes of a sweep, and its tables."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from ...errors import ProjectError
from ..common import chosen_fstop, console

if TYPE_CHECKING:
    from ...workflow.ghost_sweep import SurfaceGain, SweepPoint

# more combinations are a misprint of a step
MOST_POINTS = 1000
AXES = ("field", "wavelength", "fstop")
_SLACK = 1e-9


@dataclass(frozen=True)
class SweepAxes:
    """Values of each axis; None: not swept.

    Attributes
    ----------
    field : tuple of float or None
        Degrees from the axis.
    wavelength : tuple of float or None
        nm.
    fstop : tuple of float or None
    """

    field: tuple[float, ...] | None = None
    wavelength: tuple[float, ...] | None = None
    fstop: tuple[float, ...] | None = None


def sweep_axes(texts: Sequence[str]) -> SweepAxes:
    """Read the axes of a sweep.

    Parameters
    ----------
    texts : sequence of str
        Each `AXIS=START:STOP:STEP` or `AXIS=VALUE,VALUE,...` with field, wavelength or fstop.

    Raises
    ------
    ProjectError
        An axis is unknown or given twice, has no numbers or too many, or a number is out of range.
    """
    found: dict[str, tuple[float, ...]] = {}
    for text in texts:
        name, sign, values = text.partition("=")
        name = name.strip().lower()
        if name not in AXES or not sign:
            raise ProjectError(
                f"--sweep {text!r} is no axis; write field=0:30:5, wavelength=450,550,650 or fstop=2.8,8"
            )
        if name in found:
            raise ProjectError(f"--sweep {name} is given twice; keep one")
        found[name] = _values(name, values)
    if math.prod(map(len, found.values())) > MOST_POINTS:
        raise ProjectError(f"--sweep has more than {MOST_POINTS} combinations; choose larger steps")
    for field in found.get("field", ()):
        if not 0.0 <= field < 90.0:
            raise ProjectError(f"--sweep field={field:g} must lie between 0 and 90 degrees")
    for wavelength_nm in found.get("wavelength", ()):
        if not 380.0 <= wavelength_nm <= 780.0:
            raise ProjectError(f"--sweep wavelength={wavelength_nm:g} is not visible light; choose 380 to 780 nm")
    for f_number in found.get("fstop", ()):
        chosen_fstop(f_number)
    return SweepAxes(**found)


def _values(name: str, text: str) -> tuple[float, ...]:
    refusal = ProjectError(f"--sweep {name}={text} is no list; write START:STOP:STEP or numbers with commas between")
    try:
        numbers = [float(word) for word in text.replace(":", ",").split(",")]
    except ValueError:
        raise refusal from None
    if not all(map(math.isfinite, numbers)):
        raise refusal
    if ":" not in text:
        return tuple(dict.fromkeys(numbers))
    if text.count(":") != 2 or "," in text:
        raise refusal
    start, stop, step = numbers
    if step <= 0.0 or stop < start:
        raise ProjectError(f"--sweep {name}={text}: the step must be above 0 and the stop not below the start")
    if (stop - start) / step > MOST_POINTS:
        raise ProjectError(f"--sweep has more than {MOST_POINTS} combinations; choose larger steps")
    return tuple(start + k * step for k in range(int((stop - start) / step + _SLACK) + 1))


def sweep_data(points: Sequence[SweepPoint], gains: Sequence[SurfaceGain]) -> dict[str, Any]:
    """Return a sweep as the JSON that `--json` prints."""
    return {
        "points": [
            {
                "field_deg": list(point.field_deg),
                "wavelength_nm": point.wavelength_nm,
                "f_number": point.f_number,
                "direct_throughput_mm2": point.table.direct.throughput_mm2,
                "ghosts_throughput_mm2": point.throughput_mm2,
            }
            for point in points
        ],
        "surfaces": [asdict(gain) for gain in gains],
    }


def sweep_csv(points: Sequence[SweepPoint]) -> str:
    """Return every ghost of every point as comma-separated values."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ("field_x_deg", "field_y_deg", "wavelength_nm", "f_number", "path", "throughput_mm2", "peak_irradiance")
    )
    for point in points:
        where = (*point.field_deg, point.wavelength_nm, point.f_number)
        for row in (point.table.direct, *point.table.ghosts):
            writer.writerow((*where, row.name, row.throughput_mm2, row.peak_irradiance))
    return text.getvalue()


def print_sweep(name: str, points: Sequence[SweepPoint], gains: Sequence[SurfaceGain]) -> None:
    """Print the ghosts of every point, and the ranked surfaces."""
    from rich.table import Table

    out = Table(
        title=f"{name} · ghosts over {len(points)} points", caption="Peak: over the direct image's flux, 1/mm²."
    )
    for column in ("field degrees", "nm", "f/", "ghosts mm²", "of direct", "brightest", "its peak"):
        out.add_column(column, justify="right", no_wrap=True)
    for point in points:
        compared = [row for row in point.table.ghosts if row.peak_irradiance > 0.0]
        peak = max(compared, key=lambda row: row.peak_irradiance, default=None)
        direct = point.table.direct.throughput_mm2
        out.add_row(
            f"{point.field_deg[0]:z.3g}, {point.field_deg[1]:z.3g}", f"{point.wavelength_nm:g}",
            f"{point.f_number:g}", f"{point.throughput_mm2:.4g}",
            f"{point.throughput_mm2 / direct:.2e}" if direct > 0.0 else "-",
            "-" if peak is None else peak.name, "-" if peak is None else f"{peak.peak_irradiance:.3g}",
        )  # fmt: skip
    console().print(out)
    ranked = Table(
        title="Surfaces by what a coating without reflection there removes",
        caption="A ghost counts at each of its surfaces, so the parts add up to more than 100 %.",
    )
    for column in ("row", "of ghost light", "at most", "brightest", "its peak"):
        ranked.add_column(column, justify="right", no_wrap=True)
    for gain in gains:
        ranked.add_row(
            str(gain.row), f"{gain.part:.1%}", f"{gain.largest_part:.1%}", gain.brightest or "-",
            "-" if gain.brightest is None else f"{gain.peak_irradiance:.3g}",
        )  # fmt: skip
    console().print(ranked)
