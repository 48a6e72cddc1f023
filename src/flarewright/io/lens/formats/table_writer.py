"""Write a lens as a table: CSV for spreadsheets, or the `.lens` text table that several flare tools share.

`tables.read_csv_table` and `dotlens.read_dotlens` read them back. A table holds neither coatings nor positions.
"""

from __future__ import annotations

import csv
import io

from ....errors import LensError
from ....model import Lens, Stop, Surface
from ..lens_writer import shortest_radius


def csv_text(lens: Lens, sensor_distance: float, stop_semi_diameter: float) -> str:
    """Return a lens as a CSV table with a header.

    Parameters
    ----------
    lens : Lens
        All semi-diameters known.
    sensor_distance : float
        Last vertex to sensor, mm.
    stop_semi_diameter : float
        mm.

    Returns
    -------
    str
        Numbers have all their digits.

    Raises
    ------
    LensError
        A surface has different curvatures in its meridians, or odd aspheric terms.
    """
    _refuse_toroids(lens, ".csv")
    for k, row in enumerate(lens.rows):
        if isinstance(row, Surface) and any(row.odd_asphere):
            raise LensError(
                f"row {k} has odd aspheric terms, which a .csv file cannot hold; write a .zmx or .toml file"
            )
    terms = max((len(row.asphere) for row in lens.rows if isinstance(row, Surface)), default=0)
    conic = any(isinstance(row, Surface) and row.conic for row in lens.rows)
    text = io.StringIO()
    stated = {"name": " ".join(lens.name.split()), "f_number": lens.f_number, "field_deg": lens.field_deg}
    for key, value in stated.items():
        if value is not None:
            text.write(f"# {key} = {value}\n")
    writer = csv.writer(text, lineterminator="\n")
    shape = (*(("conic",) if conic else ()), *(f"A{2 * k + 4}" for k in range(terms)))
    writer.writerow(("radius", "thickness", "glass", "n_d", "v_d", "semi_diameter", *shape))
    for k, row in enumerate(lens.rows):
        gap = row.thickness if k < len(lens.rows) - 1 else sensor_distance
        if isinstance(row, Stop):
            writer.writerow(("stop", gap, "", "", "", stop_semi_diameter, *("" for _ in shape)))
            continue
        medium = row.medium
        glass = ("", "", "") if medium is None else (medium.glass or "", medium.n_d, medium.v_d or "")
        asphere = [*row.asphere, *[0.0] * (terms - len(row.asphere))]
        writer.writerow(
            (_radius(row.curvature), gap, *glass, row.semi_diameter, *((row.conic,) if conic else ()), *asphere)
        )
    return text.getvalue()


def dotlens_text(lens: Lens, focal_length: float, sensor_distance: float, stop_semi_diameter: float) -> str:
    """Return a lens as a `.lens` table.

    Parameters
    ----------
    lens : Lens
        All semi-diameters known.
    focal_length : float
        mm.
    sensor_distance, stop_semi_diameter : float
        As in `csv_text`.

    Returns
    -------
    str
        Apertures are diameters; coatings become a number of layers.

    Raises
    ------
    LensError
        A surface is no sphere.
    """
    _refuse_toroids(lens, ".lens")
    for k, row in enumerate(lens.rows):
        if isinstance(row, Surface) and (row.conic or row.terms):
            raise LensError(f"row {k} is no sphere, and .lens tables hold spheres only; write a .zmx or .toml file")
    name = " ".join(lens.name.replace("#", " ").split())
    glass = sum(isinstance(row, Surface) and row.medium is not None for row in lens.rows)
    lines = [
        f"# {name}", f"# {len(lens.rows)} surfaces, {glass} glass elements, f/{lens.f_number!r}", "", f"name: {name}",
        f"focal_length: {focal_length!r}", "", "# radius  thickness  n_d  V_d  aperture  coating layers", "surfaces:",
    ]  # fmt: skip
    for k, row in enumerate(lens.rows):
        gap = row.thickness if k < len(lens.rows) - 1 else sensor_distance
        if isinstance(row, Stop):
            lines.append(f"  stop  {gap!r}  1.0  0.0  {2.0 * stop_semi_diameter!r}  0")
            continue
        n_d, v_d = (1.0, 0.0) if row.medium is None else (row.medium.n_d, row.medium.v_d or 0.0)
        semi = row.semi_diameter or 0.0
        layers = 0 if row.coating is None else len(getattr(row.coating, "layers", ())) or 1
        lines.append(f"  {_radius(row.curvature, '0')}  {gap!r}  {n_d!r}  {v_d!r}  {2.0 * semi!r}  {layers}")
    return "\n".join(lines) + "\n"


def _radius(curvature: float, flat: str = "flat") -> str:
    if curvature == 0.0:
        return flat
    radius = shortest_radius(curvature)
    return repr(1.0 / curvature if radius is None else radius)


def _refuse_toroids(lens: Lens, kind: str) -> None:
    for k, row in enumerate(lens.rows):
        if isinstance(row, Surface) and row.toroidal:
            raise LensError(
                f"row {k} has different curvatures in its meridians, which a {kind} file cannot hold; write a .zmx or "
                ".toml file"
            )
