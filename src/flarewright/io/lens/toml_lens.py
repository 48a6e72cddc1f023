"""Read lens files; `read_lens` accepts every format. Our own format is TOML with one row of the prescription per line.

    schema_version = 1
    name = "Heliar-Tronnier"
    source = "US 2,645,156"
    f_number = 3.5
    rows = [
      { radius = 30.81, thickness = 7.7, glass = "LAKN7", n_d = 1.652, v_d = 58.5, coating = "quarter-wave:550" },
      { radius = "flat", thickness = 2.0 },
      { stop = true, thickness = 3.0 },
    ]

A row without `glass` and `n_d` has air behind it. `lens_json_schema` documents every key.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import FileError, GlassError, LensError, ProjectError
from ...model import Coating, Iris, Lens, Row, Stop, Surface
from ...model.lens.prescription import NO_GLASS
from ...model.lens.raw_lens import LensReading, RawLens, RawSequence
from ...sentences import INVALID, count, shorten, summary, validation_sentences
from ..files.door import shown
from ..files.file_kind import OPTILAND_KEY, foreign_hint, lens_key, refuse_other_kind
from ..files.text_file import read_bytes, read_toml
from . import media
from .coating_text import coating_from
from .foreign_file import MOST_SURFACES
from .lens_fields import CURVATURE, RADIUS, ROW_NUMBERS, STOP_KEYS, SURFACE_KEYS, TOP_KEYS, TOP_NUMBERS, TOP_TEXTS
from .scatter_text import read_scatter
from .shape_fields import read_elements, read_positions, read_shape, unknown_keys

if TYPE_CHECKING:
    from .formats.codev import FirstColumn

# tolerance of a rim beyond the surface's equator, for rounded numbers
ROUNDED = 1e-6
# asphere terms that change the rim's height by more than this factor have wrong units
MOST_LIFTED = 1.0


def read_lens(path: str | Path, first_column: FirstColumn | None = None) -> LensReading | RawLens | RawSequence:
    """Read a lens file of any known kind.

    Parameters
    ----------
    path : str or Path
        `.toml` is our own format; `.lens` is a text table that several flare tools share; `.zmx` is a sequential file
        of Zemax, `.seq` one of CODE V, `.len` one of OSLO; `.dat` is a lens of pbrt, `.csv` a table, `.json` a lens of
        RealFlare or of Optiland.
    first_column : {"radii", "curvatures"}, optional
        Of a `.seq` file that does not state it.

    Returns
    -------
    LensReading or RawLens or RawSequence
        `optics.lens_import.patent_repair` makes a lens of a `.lens` file, `optics.lens_import.sequential_import` of a
        `RawSequence`.

    Raises
    ------
    LensError
        When the file cannot be read or is invalid; `problems` lists every error.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".seq":
        from .formats.codev import read_seq

        return read_seq(path, first_column)
    if (read := _foreign_reader(suffix, path)) is not None:
        return read(path)
    if suffix == ".toml" or Path(path).is_dir() or not Path(path).exists():
        return read_lens_toml(path)
    with suppress(FileError):
        if hint := foreign_hint(read_bytes(path, "a lens file").decode("utf-8", "replace")):
            raise LensError(f"{shown(path)} {hint}")
    if suffix == ".json":
        raise LensError(
            f"{path} is JSON, not a lens file: a measured flare has no prescription; flarewright render, "
            "predict and edit accept it, and so does render_measured in Python"
        )
    raise LensError(
        f"{path} is of an unknown kind: Flarewright reads .toml (its own), .lens, .zmx, .seq, .len, .dat, .csv and "
        "the .json files of RealFlare and Optiland"
    )


def _foreign_reader(suffix: str, path: str | Path) -> Callable[[str | Path], RawLens | RawSequence] | None:
    """Return the reader of another program's lens file; each is imported only when it reads one."""
    match suffix:
        case ".lens":
            from .formats.dotlens import read_dotlens

            return read_dotlens
        case ".zmx":
            from .zemax.reader import read_zmx

            return read_zmx
        case ".len":
            from .formats.oslo import read_len

            return read_len
        case ".dat" | ".csv":
            from .formats.tables import read_csv_table, read_dat

            return read_dat if suffix == ".dat" else read_csv_table
        case ".json" if key := lens_key(path):
            from .formats.optiland import read_optiland
            from .formats.realflare import read_realflare

            return read_optiland if key == OPTILAND_KEY else read_realflare
    return None


def read_lens_toml(path: str | Path) -> LensReading:
    """Read a lens file of our own format.

    Returns
    -------
    LensReading
        The lens, each medium with its dispersion, and remarks on substituted glasses.

    Raises
    ------
    LensError
        When the file cannot be read or is invalid; the message sums up, `problems` lists every error with its row.
    """
    try:
        table = read_toml(path, "a lens file")
        refuse_other_kind(path, table, "lens")
    except ValueError as error:
        raise LensError(str(error), (str(error),)) from None
    return lens_from_table(table, str(path), folder=Path(path).parent)


def lens_from_table(table: dict[str, Any], where: str, *, folder: Path | None = None) -> LensReading:
    """Return the lens of a parsed TOML table; error messages begin with `where` (the file).

    Parameters
    ----------
    table : dict
    where : str
    folder : path, optional
        Base folder of relative image paths; None: the working folder.

    Raises
    ------
    LensError
        When the table is invalid; the message sums up, `problems` lists every error with its row.
    """
    problems: list[str] = []
    fields = _top_level(table, folder, problems)
    findings: list[tuple[int, media.Finding]] = []
    rows = _rows(table.get("rows"), problems, findings, folder)
    elements = read_elements(table.get("elements", []), problems)
    positions = read_positions(table.get("positions", []), problems)
    scatter = read_scatter(table.get("scatter"), problems)
    presets = _presets(table.get("coating_presets", {}), len(rows), problems)
    lens: Lens | None = None
    if not problems:
        try:
            whole = tuple(row for row in rows if row is not None)
            lens = Lens(
                **fields, rows=whole, elements=elements, positions=positions, scatter=scatter, coating_presets=presets
            )
        except INVALID as error:
            problems += validation_sentences(error)
    if lens is None:
        raise LensError(summary(where, problems), tuple(problems))
    return LensReading(lens, media.remarks(findings))


def _top_level(table: dict[str, Any], folder: Path | None, problems: list[str]) -> dict[str, Any]:
    """Check everything except the rows and return the fields for Lens."""
    version = table.get("schema_version")
    if version is None:
        problems.append("schema_version is missing: begin the file with schema_version = 1")
    elif isinstance(version, bool) or version != 1:
        problems.append(f"schema_version is {shorten(version)}: this version of Flarewright reads 1")
    unknown_keys(table, TOP_KEYS, "", problems)
    fields: dict[str, Any] = {}
    for key in TOP_TEXTS:
        value = table.get(key, "")
        if not isinstance(value, str):
            problems.append(f"{key} is {shorten(value)}, a text in quotes was expected")
        elif key == "name" and not value.strip():
            problems.append('name is missing: add name = "..."')
        else:
            fields[key] = value
    if "f_number" not in table:
        problems.append("f_number is missing: it sets the size of the stop, add f_number = 2.8 for example")
    for key, field in TOP_NUMBERS.items():
        if key in table and (value := field.read(table[key], key, problems)) is not None:
            fields[key] = value
    iris = table.get("iris", {})
    if not isinstance(iris, dict):
        problems.append(f"iris is {shorten(iris)}, a table was expected: [iris] with blades = 5 for example")
    else:
        unknown_keys(iris, tuple(Iris.model_fields), "iris: ", problems)
        try:
            fields["iris"] = _iris(iris, folder)
        except INVALID as error:
            problems += [f"iris: {sentence}" for sentence in validation_sentences(error)]
    return fields


def _iris(table: dict[str, Any], folder: Path | None) -> Iris:
    iris = Iris.model_validate({k: v for k, v in table.items() if k in Iris.model_fields}, strict=True)
    if iris.mask is None:
        return iris
    return iris.replace(mask=str(((folder or Path()) / iris.mask).absolute()))


def _rows(
    table: object, problems: list[str], findings: list[tuple[int, media.Finding]], folder: Path | None
) -> list[Row | None]:
    """Check each row, then the conditions between rows; an invalid row is None."""
    if table is None:
        problems.append("rows is missing: a lens is rows = [ { radius = ..., thickness = ... }, ... ]")
        return []
    if not isinstance(table, list):
        problems.append(f"rows is {shorten(table)}, a list of tables was expected")
        return []
    if len(table) > MOST_SURFACES:
        problems.append(f"rows has {len(table)} entries, a lens has at most {MOST_SURFACES}")
        return []
    rows: list[Row | None] = []
    for k, entry in enumerate(table):
        if not isinstance(entry, dict):
            problems.append(f"row {k}: is {shorten(entry)}, a table {{ radius = ..., thickness = ... }} was expected")
            rows.append(None)
        elif _is_stop(entry, k, problems):
            rows.append(_stop(entry, k, problems))
        else:
            rows.append(_surface(entry, k, problems, findings, folder))
    stops = [k for k, entry in enumerate(table) if isinstance(entry, dict) and entry.get("stop") is True]
    if not stops:
        problems.append("no row is the stop: add { stop = true, thickness = ... } where the iris sits")
    elif len(stops) > 1:
        problems.append(f"rows {', '.join(map(str, stops))} are all stops: a lens has one, remove the others")
    _check_rows_together(rows, problems)
    return rows


def _check_rows_together(rows: list[Row | None], problems: list[str]) -> None:
    """Check the conditions between rows."""
    if any(row is None for row in rows):
        return
    glassy = [isinstance(row, Surface) and row.medium is not None for row in rows]
    if not any(glassy):
        problems.append(f"{NO_GLASS}: give a row glass or n_d")
    elif glassy[-1]:
        problems.append(
            f"row {len(rows) - 1}: behind the last row must be air: remove its glass, or add the rear surface"
        )


def _is_stop(entry: dict[str, Any], k: int, problems: list[str]) -> bool:
    stop = entry.get("stop", False)
    if not isinstance(stop, bool):
        problems.append(f"row {k}: stop is {shorten(stop)}, true or false was expected")
    return bool(stop)


def _stop(entry: dict[str, Any], k: int, problems: list[str]) -> Stop | None:
    before = len(problems)
    for key in entry:
        if key in SURFACE_KEYS and key not in STOP_KEYS:
            why = "its opening follows from f_number" if key.startswith("semi_diameter") else "it refracts nothing"
            problems.append(f"row {k}: the stop has no {key}, {why}: remove it")
    unknown_keys(entry, (*STOP_KEYS, *SURFACE_KEYS), f"row {k}: ", problems)
    thickness = ROW_NUMBERS["thickness"].read(entry.get("thickness", 0.0), f"row {k}: thickness", problems)
    return Stop(thickness=thickness) if len(problems) == before and thickness is not None else None


def _surface(
    entry: dict[str, Any], k: int, problems: list[str], findings: list[tuple[int, media.Finding]], folder: Path | None
) -> Surface | None:
    before = len(problems)
    unknown_keys(entry, ("stop", *SURFACE_KEYS), f"row {k}: ", problems)
    values: dict[str, Any] = {"curvature": _curvature(entry, k, problems)}
    numbers = {
        key: field.read(entry[key], f"row {k}: {key}", problems) for key, field in ROW_NUMBERS.items() if key in entry
    }
    estimated = entry.get("semi_diameter_estimated", False)
    if not isinstance(estimated, bool):
        problems.append(f"row {k}: semi_diameter_estimated is {shorten(estimated)}, true or false was expected")
    values |= {key: numbers[key] for key in ("conic", "thickness", "semi_diameter") if key in numbers}
    values["semi_diameter_estimated"] = estimated
    if "radius_x" in entry or "curvature_x" in entry:
        values["curvature_x"] = _curvature(entry, k, problems, "_x")
    values |= read_shape(entry, f"row {k}", folder, problems)
    if "coating" in entry:
        values["coating"] = _coating(entry["coating"], f"row {k}", problems)

    # the medium behind the row
    glass = entry.get("glass")
    if glass is not None and (not isinstance(glass, str) or not glass.strip()):
        problems.append(f'row {k}: glass is {shorten(glass)}, a catalogue name like "N-BK7" was expected')
    elif (glass is not None or "n_d" in entry or "v_d" in entry) and None not in numbers.values():
        try:
            values["medium"], finding = media.attach(glass, numbers.get("n_d"), numbers.get("v_d"))
            findings.append((k, finding))
        except GlassError as error:
            problems.append(f"row {k}: {error}")
    if (numbers.get("thickness") or 0.0) < 0.0 and ("n_d" in entry or glass is not None):
        problems.append(f"row {k}: thickness is {shorten(entry['thickness'])}: glass cannot be thinner than 0 mm")
    if len(problems) > before:
        return None
    surface = Surface(**values)
    semi = surface.semi_diameter
    if semi is not None and semi * (1.0 - ROUNDED) > surface.equator:
        problems.append(
            f"row {k}: a semi_diameter of {semi:g} mm does not fit the surface, which turns back "
            f"{surface.equator:g} mm from the axis: correct it, or remove it to get an estimate"
        )
        return None
    if semi is not None and surface.lifted > MOST_LIFTED * semi:
        problems.append(
            f"row {k}: the asphere's terms raise its rim by {surface.lifted:.3g} mm, more than its semi_diameter of "
            f"{semi:g} mm: check their units (A4 in 1/mm^3, A6 in 1/mm^5, ...)"
        )
        return None
    return surface


def _curvature(entry: dict[str, Any], k: int, problems: list[str], axis: str = "") -> float:
    radius, curvature = f"radius{axis}", f"curvature{axis}"
    if radius in entry and curvature in entry:
        problems.append(f"row {k}: {radius} and {curvature} are both given: keep one")
    elif curvature in entry:
        return CURVATURE.read(entry[curvature], f"row {k}: {curvature}", problems) or 0.0
    elif radius not in entry:
        problems.append(f'row {k}: radius is missing: give it in mm, or radius = "flat"')
    else:
        return _curvature_of(entry[radius], radius, k, problems)
    return 0.0


def _curvature_of(radius: object, key: str, k: int, problems: list[str]) -> float:
    if radius == "flat":
        return 0.0
    if isinstance(radius, str):
        problems.append(f'row {k}: {key} is {shorten(radius)}, a number in mm or "flat" was expected')
    elif radius in (0, float("inf"), float("-inf")) and not isinstance(radius, bool):
        problems.append(f'row {k}: {key} is {shorten(radius)}: for a plane surface write {key} = "flat"')
    elif (value := RADIUS.read(radius, f"row {k}: {key}", problems)) is not None:
        if abs(1.0 / value) <= CURVATURE.high:
            return 1.0 / value
        problems.append(f"row {k}: {key} is {shorten(radius)}: less than a micrometre is no lens surface")
    return 0.0


def _coating(value: object, where: str, problems: list[str]) -> Coating | None:
    try:
        return coating_from(value)
    except ProjectError as error:
        problems.append(f"{where}: {error}")
        return None


def _presets(table: object, row_count: int, problems: list[str]) -> dict[str, tuple[Coating | None, ...]]:
    if not isinstance(table, dict):
        problems.append(f'coating_presets is {shorten(table)}, a table was expected: NAME = ["none", ...]')
        return {}
    presets: dict[str, tuple[Coating | None, ...]] = {}
    for name, entries in table.items():
        where = f"coating preset {name!r}"
        if not isinstance(entries, list):
            problems.append(f"{where} is {shorten(entries)}, a list with one coating for each row was expected")
            continue
        if row_count and len(entries) != row_count:
            problems.append(
                f"{where} has {count(len(entries), 'entry', 'entries')}, the lens {count(row_count, 'row')}: "
                "give one each"
            )
        presets[name] = tuple(_coating(entry, f"{where}, row {k}", problems) for k, entry in enumerate(entries))
    return presets
