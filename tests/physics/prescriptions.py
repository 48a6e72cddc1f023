"""Lenses typed separately for the tests, so that an error in a shipped lens file is detected.

Rows are (radius, thickness, n_d behind, semi-diameter); radius 0 is flat, "stop" the stop.
"""

from __future__ import annotations

from typing import Any

from oracle import OracleRow, System, focused, stopped

Table = list[tuple[Any, float, float, float]]

# Van Acoleyen table 2.1 (US 2,645,156). The table gives no diameters: these suit f/4.5 and 20 degrees.
HELIAR: Table = [
    (30.810, 7.700, 1.652, 14.0),
    (-89.350, 1.850, 1.603, 14.0),
    (580.380, 3.520, 1.0, 13.5),
    (-80.630, 1.850, 1.643, 11.5),
    (28.340, 4.180, 1.0, 10.5),
    ("stop", 3.000, 1.0, 0.0),
    (0.0, 1.850, 1.581, 11.0),
    (32.190, 7.270, 1.694, 11.5),
    (-52.990, 81.857, 1.0, 12.0),
]

# Walch figure 4.3 (US 2,854,889); indices of LAK9, LLF7, SF7 from the catalogue.
TESSAR: Table = [
    (42.970, 9.8, 1.69100, 19.2),
    (-115.33, 2.1, 1.54883, 19.2),
    (306.840, 4.16, 1.0, 19.2),
    ("stop", 4.0, 1.0, 0.0),
    (-59.060, 1.870, 1.63980, 17.3),
    (40.930, 10.640, 1.0, 17.3),
    (183.920, 7.050, 1.69100, 16.5),
    (-48.910, 79.831, 1.0, 16.5),
]

# Van Acoleyen table A.1 (US 5,576,890). The table gives no diameters: chosen for f/2.8 and 30 degrees, edges apart.
CANON: Table = [
    (684.66, 2.62, 1.805, 38.0),
    (-1055.76, 0.20, 1.0, 37.5),
    (149.76, 2.10, 1.713, 33.0),
    (53.30, 18.02, 1.0, 28.5),
    (-488.25, 2.00, 1.773, 24.0),
    (44.81, 0.53, 1.0, 22.5),
    (43.27, 3.50, 1.847, 22.5),
    (78.34, 40.13, 1.0, 22.0),
    (84.43, 1.20, 1.847, 15.5),
    (30.98, 7.20, 1.560, 15.5),
    (-1529.08, 0.15, 1.0, 15.5),
    (50.67, 6.00, 1.652, 15.5),
    (-110.42, 0.15, 1.0, 15.5),
    (40.57, 3.30, 1.652, 14.5),
    (71.98, 6.91, 1.0, 14.0),
    ("stop", 1.50, 1.0, 0.0),
    (-145.10, 3.00, 1.847, 11.5),
    (-34.13, 1.20, 1.603, 11.5),
    (112.83, 2.00, 1.0, 11.0),
    (-42.83, 1.40, 1.603, 11.0),
    (66.44, 13.17, 1.0, 11.5),
    (347.07, 5.00, 1.560, 15.0),
    (-26.27, 1.50, 1.805, 15.0),
    (-35.22, 0.15, 1.0, 16.0),
    (104.39, 5.00, 1.713, 16.5),
    (-51.25, 5.44, 1.0, 16.5),
    (-30.94, 1.35, 1.847, 16.0),
    (-84.63, 80.00, 1.0, 17.5),
]

# Zeiss Biotar 50/1.4 (US 1,786,916); diameters from the corpus file.
BIOTAR: Table = [
    (41.8, 5.375, 1.64238, 18.04),
    (160.5, 0.825, 1.0, 18.04),
    (22.4, 7.775, 1.62306, 16.09),
    (-575.0, 2.525, 1.57566, 16.09),
    (14.15, 5.72, 1.0, 11.285),
    ("stop", 3.73, 1.0, 0.0),
    (-19.25, 2.525, 1.6727, 11.255),
    (25.25, 10.61, 1.64238, 14.24),
    (-26.6, 0.485, 1.0, 14.24),
    (53.0, 6.95, 1.64238, 14.35),
    (-60.0, 32.66, 1.0, 14.35),
]

# Leica Super-Angulon-R 21/4 (US 3,512,874), a retrofocus wide angle; diameters from the corpus file.
SUPER_ANGULON: Table = [
    (59.9151, 5.8128, 1.52736, 25.39),
    (186.3645, 0.0966, 1.0, 25.39),
    (29.0577, 2.1315, 1.62287, 17.205),
    (15.1242, 5.8128, 1.0, 12.9),
    (30.849, 1.743, 1.66104, 11.635),
    (10.1535, 5.3298, 1.0, 8.575),
    (0.0, 6.783, 1.62287, 8.3),
    (17.1192, 4.263, 1.5353, 8.3),
    (-57.7164, 0.1932, 1.0, 8.3),
    (23.5347, 3.8934, 1.61114, 5.425),
    (-72.7545, 5.6196, 1.5343, 5.425),
    (-21.1512, 1.6064, 1.0, 5.425),
    ("stop", 1.3, 1.0, 0.0),
    (-15.1725, 1.0668, 1.74618, 4.3),
    (45.4692, 0.6783, 1.0, 4.8),
    (-54.5391, 1.9383, 1.62287, 4.98),
    (-13.8453, 0.0966, 1.0, 6.45),
    (0.0, 1.9383, 1.59142, 6.68),
    (-20.5317, 36.5232, 1.0, 6.68),
]

# Cooke triplet 50 mm whose stop is a separate row.
TRIPLET: Table = [
    (22.01359, 3.25896, 1.62041, 9.5),
    (-435.76044, 6.00755, 1.0, 9.0),
    (-22.21328, 0.99997, 1.62004, 6.0),
    (20.29192, 0.5, 1.0, 6.0),
    ("stop", 4.25041, 1.0, 0.0),
    (79.68360, 2.95208, 1.62041, 8.0),
    (-18.39533, 42.20778, 1.0, 8.0),
]

FIVE: dict[str, tuple[Table, float]] = {
    "heliar": (HELIAR, 4.5),
    "tessar": (TESSAR, 2.8),
    "triplet": (TRIPLET, 5.0),
    "biotar": (BIOTAR, 1.4),
    "canon": (CANON, 2.8),
}
"""The five lenses of the comparison and their f-numbers; SUPER_ANGULON is an optional sixth."""

HELIAR_CENTERS_NM = (430.0, 370.0, 510.0, 600.0, 310.0, 460.0, 550.0, 580.0, 650.0)


def system(table: Table, f_number: float) -> System:
    """Return a table as the oracle's system, with the sensor at the paraxial focus."""
    rows, front = [], 1.0
    for radius, thickness, n, h in table:
        if radius == "stop":
            rows.append(OracleRow(0.0, thickness, front, 1.0, is_stop=True))
        else:
            rows.append(OracleRow(0.0 if radius == 0 else 1.0 / radius, thickness, n, h))
            front = n
    return focused(stopped(System(tuple(rows), 0.0), f_number))


def lens(table: Table, f_number: float, name: str = "typed", coatings: Any = None) -> Any:
    """Return a table as a `flarewright.model.Lens` whose glasses have no dispersion."""
    from flarewright.model import Dispersion, Lens, Medium, Stop, Surface

    rows: list[Any] = []
    for k, (radius, thickness, n, h) in enumerate(table):
        if radius == "stop":
            rows.append(Stop(thickness=thickness))
            continue
        flat = Dispersion(glass="Cauchy", formula="cauchy", coefficients=(n, 0.0), range_nm=(300.0, 1100.0))
        medium = None if n == 1.0 else Medium(n_d=n, dispersion=flat)
        coating = None if coatings is None else coatings[k]
        curvature = 0.0 if radius == 0 else 1.0 / radius
        rows.append(Surface(curvature=curvature, thickness=thickness, medium=medium, semi_diameter=h, coating=coating))
    return Lens(name=name, f_number=f_number, rows=tuple(rows))


def ghost_table_of(
    a_lens: Any, field_deg: Any, *, f_number: float | None = None, coating: Any = None, threads: int | None = None,
    **query: Any,
) -> Any:  # fmt: skip
    """Return the `ghost_table` of a lens with its own coatings, wide open, unless given; `query` as in `GhostQuery`."""
    from flarewright.model import AsLens
    from flarewright.optics.lens.paraxial import first_order
    from flarewright.optics.rays.ghost_table import GhostQuery, ghost_table, pack_for_query

    asked = GhostQuery(field_deg, **query)
    packed = pack_for_query(a_lens, first_order(a_lens, f_number), AsLens() if coating is None else coating, asked)
    return ghost_table(a_lens, packed, asked, threads=threads)
