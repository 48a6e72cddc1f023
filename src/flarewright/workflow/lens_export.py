"""Write a lens in the formats of other programs, with a remark on everything that a format cannot hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import LensError
from ..io.files.atomic_write import write_text_atomically
from ..io.lens.formats.optiland import optiland_text
from ..io.lens.formats.table_writer import csv_text, dotlens_text
from ..io.lens.lens_writer import write_lens
from ..io.lens.zemax.writer import LensState, zmx_text
from ..model import Iris, Lens, Surface
from ..optics.lens.dispersion import C_LINE_NM, D_LINE_NM, F_LINE_NM, refractive_index
from ..optics.lens.paraxial import first_order
from ..optics.lens.zoom import at_position


def export_lens(lens: Lens, path: Path) -> tuple[str, ...]:
    """Write a lens file in the format of the path's suffix.

    Parameters
    ----------
    lens : Lens
        Complete (`render.scene.resolve.open_lens`).
    path : Path
        With one of the suffixes `io.files.file_kind.WRITTEN_LENS_SUFFIXES`.

    Returns
    -------
    tuple of str
        What the format does not hold, one sentence each; our own format holds everything.

    Raises
    ------
    LensError
        The format cannot hold the shape of a surface.
    OutputError
        The file cannot be written; no partial file remains.
    """
    suffix = path.suffix.lower()
    if suffix == ".toml":
        write_lens(lens, path)
        return ()
    lens, chosen = _with_abbe_numbers(lens)
    remarks = [*chosen, *_left_out(lens, suffix)]
    try:
        text, found = _text(lens, suffix)
    except LensError as error:
        raise LensError(f"{lens.name}: {error}") from None
    write_text_atomically(path, text, newline="\n")
    return (*remarks, *found)


def _with_abbe_numbers(lens: Lens) -> tuple[Lens, tuple[str, ...]]:
    """Give media without V_d that of the dispersion that they have here; without it, glass would not disperse."""
    rows, chosen = list(lens.rows), []
    for k, row in enumerate(rows):
        if isinstance(row, Surface) and row.medium is not None and row.medium.v_d is None and row.medium.dispersion:
            n_f, n_d, n_c = refractive_index(row.medium, np.array([F_LINE_NM, D_LINE_NM, C_LINE_NM]))
            rows[k] = row.replace(medium=row.medium.replace(v_d=round(float((n_d - 1.0) / (n_f - n_c)), 3)))
            chosen.append(f"row {k} that of {row.medium.dispersion.glass}")
    if not chosen:
        return lens, ()
    return lens.replace(rows=tuple(rows)), (f"V_d is not known; written as used here: {', '.join(chosen)}",)


def _text(lens: Lens, suffix: str) -> tuple[str, tuple[str, ...]]:
    if suffix == ".zmx":
        settings = [at_position(lens, position) for position in lens.positions] or [lens]
        return zmx_text(lens.name, [_state(setting) for setting in settings])
    state = _state(lens)
    if suffix == ".csv":
        return csv_text(lens, state.sensor_distance, state.stop_semi_diameter), ()
    if suffix == ".json":
        return optiland_text(lens, state.sensor_distance, state.stop_semi_diameter), ()
    efl = first_order(lens).efl
    return dotlens_text(lens, efl, state.sensor_distance, state.stop_semi_diameter), ()


def _state(lens: Lens) -> LensState:
    order = first_order(lens)
    return LensState(lens, order.sensor_distance, order.stop_semi_diameter)


def _left_out(lens: Lens, suffix: str) -> list[str]:
    """Return remarks on the properties of a lens that files of other programs do not hold."""
    surfaces = [(k, row) for k, row in enumerate(lens.rows) if isinstance(row, Surface)]
    remarks: list[str] = []
    if suffix == ".lens":
        if any(row.coating is not None for _, row in surfaces):
            remarks.append(".lens files count the layers of a coating; its films are left out")
        if lens.field_deg is not None or lens.focus_distance is not None:
            remarks.append(".lens files have neither field nor focus distance; left out")
    elif any(row.coating is not None for _, row in surfaces):
        remarks.append(f"{suffix} files describe no coatings here; left out")
    if suffix in (".lens", ".json") and any(row.medium and row.medium.glass for _, row in surfaces):
        remarks.append("the names of glasses are left out; n_d and V_d are written")
    if lens.coating_presets:
        remarks.append("the coating presets are left out")
    if suffix == ".csv" and lens.focus_distance is not None:
        remarks.append("the focus distance is left out")
    if lens.positions:
        names = ", ".join(repr(position.name) for position in lens.positions)
        remarks.append(
            f"the positions {names} are configurations 1 to {len(lens.positions)}, the first is the active one"
            if suffix == ".zmx"
            else f"the positions {names} are left out; the file has the gaps of the rows"
        )
    displaced = [str(k) for k, row in surfaces if row.displaced] + ["an element" for e in lens.elements if e.displaced]
    if displaced:
        remarks.append(f"decentres and tilts are left out (row {', '.join(displaced)})")
    figured = [str(k) for k, row in surfaces if row.figure is not None]
    if figured:
        remarks.append(f"figure errors are left out (row {', '.join(figured)})")
    for what, present in (
        ("surface scatter is", lens.scatter is not None), ("the iris is", lens.iris != Iris()),
        ("the squeeze is", lens.squeeze is not None),
    ):  # fmt: skip
        if present:
            remarks.append(f"{what} left out")
    return remarks
