"""`flarewright ghosts`: the ghost analysis of a lens."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ProjectError
from .common import chosen_fstop, console, field_angles, first_run_bar, print_json, tell

if TYPE_CHECKING:
    from ..optics.ghosts import GhostRow, GhostTable
    from ..render.glare import VeilingGlare

EPILOG = (
    "Examples:\n\nflarewright ghosts heliar-tronnier --light 10,0\n\n"
    "flarewright ghosts my.toml --light 0,0 --coating quarter-wave:550 --fstop 8 --json"
)


def ghosts(
    lens: Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens (flarewright lenses) or a lens file.")],
    light: Annotated[
        list[str], typer.Option(metavar="X,Y", help="Field angles in degrees, right and up in the picture.")
    ],
    distance: Annotated[
        float | None, typer.Option(help="Light in front of the lens, mm; inf, or left out: distant.")
    ] = None,
    wavelength_nm: Annotated[float, typer.Option(help="One wavelength, 380 to 780.")] = 587.56,
    coating: Annotated[
        str,
        typer.Option(
            help="lens, none, quarter-wave:NM, preset:NAME, a name of `flarewright coating list`, stack:N:NM,... "
            "or a file."
        ),
    ] = "lens",
    fstop: Annotated[float | None, typer.Option(help="f-number; wide open when left out.")] = None,
    paths: Annotated[str, typer.Option(help="all, or same-side of the stop.")] = "all",
    focus: Annotated[
        float | None, typer.Option(help="Distance of the plane in focus, mm; infinity when left out.")
    ] = None,
    sensor_distance: Annotated[float | None, typer.Option(help="Last vertex to sensor, mm.")] = None,
    zoom: Annotated[
        str | None, typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.")
    ] = None,
    filter_plate: Annotated[
        str | None, typer.Option("--filter", metavar="GLASS:MM[:GAP]", help="A plane filter in front: N-BK7:2.")
    ] = None,
    cover_glass: Annotated[
        str | None, typer.Option(metavar="GLASS:MM[:GAP]", help="Plane glass in front of the sensor: N-BK7:2:0.5.")
    ] = None,
    sensor_reflectance: Annotated[float, typer.Option(help="Part of the light the sensor mirrors back, 0 to 1.")] = 0.0,
    imperfection: Annotated[
        str | None,
        typer.Option(metavar="SEED[:UM:ARCMIN[:NM]]", help="One sample of the lens within tolerances."),
    ] = None,
    orders: Annotated[int, typer.Option(help="2; 4 also lists ghosts of four reflections.")] = 2,
    order4_limit: Annotated[
        float, typer.Option(help="Of those, list what carries more than this part of the two-reflection light.")
    ] = 1e-4,
    glare: Annotated[bool, typer.Option("--glare", help="Also tell the veiling glare index.")] = False,
    scatter: Annotated[
        str | None, typer.Option(metavar="MODEL", help="For --glare: none, harvey-shack, abg, chaumond.")
    ] = None,
    surface_roughness: Annotated[
        float | None, typer.Option(help="For --glare: rms roughness of the surfaces, nm.")
    ] = None,
    cleanliness: Annotated[float | None, typer.Option(help="For --glare: dust, level of IEST-STD-CC1246.")] = None,
    brightest: Annotated[int | None, typer.Option(min=1, help="List only so many.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Tell for every two-reflection path, and on request for those of four, what it carries and where it lands.

    Rays are traced, not paraxial, to the unbounded sensor plane. The throughput is the flux on it when the light gives
    an irradiance of 1 on a plane facing it; the peak irradiance is relative to the direct image's flux.
    """
    from ..io.coating_text import parse_coating_choice
    from ..io.plate_text import parse_imperfection, parse_plate
    from .render_flags import check_focus, scatter_flags

    if len(light) > 1:
        raise ProjectError(f"--light is given {len(light)} times; ghosts are listed for one light, so keep one")
    angles = field_angles(light[0])
    if not (math.isfinite(wavelength_nm) and 380.0 <= wavelength_nm <= 780.0):
        raise ProjectError(f"--wavelength-nm {wavelength_nm:g} is not visible light; choose one between 380 and 780 nm")
    if paths not in ("all", "same-side"):
        raise ProjectError(f"--paths {paths!r} is unknown; choose all or same-side")
    if orders not in (2, 4):
        raise ProjectError(f"--orders {orders} is unknown; choose 2 or 4")
    if not 0.0 < order4_limit < 1.0:
        raise ProjectError(
            f"--order4-limit {order4_limit:g} is no part of the light; choose between 0 and 1, like 1e-4"
        )
    choice = parse_coating_choice(coating)
    f_number = chosen_fstop(fstop)

    in_front = None if filter_plate is None else parse_plate(filter_plate, "--filter")
    behind = None if cover_glass is None else parse_plate(cover_glass, "--cover-glass")
    sample = None if imperfection is None else parse_imperfection(imperfection)
    if not 0.0 <= sensor_reflectance <= 1.0:
        raise ProjectError(
            f"--sensor-reflectance {sensor_reflectance:g} is no part of the light; choose between 0 and 1"
        )

    said = scatter_flags(scatter, surface_roughness, cleanliness)
    if said is not None and not glare:
        raise ProjectError("--scatter, --surface-roughness and --cleanliness change the glare only; add --glare")

    from ..render.analysis import ghosts as analyse
    from ..render.first_run import compile_for_analysis
    from ..render.prepare import load_lens

    remarks: list[str] = []
    prescription = load_lens(lens, remarks=remarks)
    check_focus(prescription, focus, sensor_distance)
    distance = None if distance == math.inf else distance
    for name, value in (("--focus", focus), ("--sensor-distance", sensor_distance), ("--distance", distance)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise ProjectError(f"{name} {value:g} is no distance; give millimetres above 0")
    compile_for_analysis(first_run_bar)
    table = analyse(
        prescription,
        angles,
        f_number=f_number,
        coating=choice,
        wavelength_nm=wavelength_nm,
        paths=paths,
        sensor_distance=sensor_distance,
        focus_distance=focus,
        zoom=zoom,
        sensor_reflectance=sensor_reflectance,
        imperfection=sample,
        filter_plate=in_front,
        cover_glass=behind,
        orders=orders,
        order4_limit=order4_limit,
        distance=distance,
        remarks=remarks,
    )
    veil = None
    if glare:
        settings: dict[str, Any] = {
            "lens": prescription, "f_number": f_number, "coating": choice, "zoom": zoom, "filter": in_front,
            "imperfection": sample, "quality": {"paths": paths}, "scatter": said,
            "camera": {
                "cover_glass": behind, "sensor_reflectance": sensor_reflectance, "focus_distance": focus,
                "sensor_distance": sensor_distance,
            },
        }  # fmt: skip
        veil = _glare(settings, wavelength_nm)
    tell(dict.fromkeys(remarks))
    if as_json:
        print_json(as_data(table, brightest) | ({} if veil is None else {"veiling_glare": asdict(veil)}))
        return
    _print_table(table, prescription.name, angles, brightest)
    if veil is not None:
        console().print(
            f"veiling glare index {veil.index:.3%} at {veil.wavelength_nm:g} nm: ghosts {veil.ghosts:.3%}, scatter "
            f"{veil.scatter:.3%}, blur {veil.blur:.3%}; a black patch of {veil.patch_deg:.2f} degrees"
        )


def _glare(settings: dict[str, Any], wavelength_nm: float) -> VeilingGlare:
    """Compute the veiling glare index of what the flags say."""
    from pydantic import ValidationError

    from ..io.project_file import explain
    from ..model import Light, Project
    from ..render.glare import veiling_glare
    from .render_flags import in_flags

    fields = {**settings, "lights": (Light(field_deg=(0.0, 0.0)),)}
    try:
        project = Project.model_validate(fields)
    except ValidationError as error:
        raise ProjectError(in_flags(explain(error, fields)[0])) from None
    return veiling_glare(project, wavelength_nm)


def as_data(table: GhostTable, brightest: int | None = None) -> dict[str, Any]:
    """Return the analysis as the JSON that `--json` prints."""
    return {
        "efl_mm": table.efl,
        "bfl_mm": table.bfl,
        "f_number": table.f_number,
        "entrance_pupil_diameter_mm": table.entrance_pupil_diameter,
        "stop_semi_diameter_mm": table.stop_semi_diameter,
        "sensor_distance_mm": table.sensor_distance,
        "direct": {
            "throughput_mm2": table.direct.throughput_mm2,
            "centroid_mm": list(table.direct.centroid_mm),
            "rms_radius_mm": table.direct.rms_radius_mm,
        },
        "ghosts": [
            {
                "first_reflection": row.first_reflection,
                "second_reflection": row.second_reflection,
                **({"later_reflections": list(row.later_reflections)} if row.later_reflections else {}),
                "throughput_mm2": row.throughput_mm2,
                "centroid_mm": list(row.centroid_mm),
                "rms_radius_mm": row.rms_radius_mm,
                "peak_irradiance": row.peak_irradiance,
                "peak_patch_mm": row.peak_patch_mm,
                "bounded_by": row.bounded_by,
                "focus_distance_mm": row.focus_distance_mm,
            }
            for row in table.ghosts[:brightest]
        ],
    }


def _print_table(table: GhostTable, name: str, angles: tuple[float, float], brightest: int | None) -> None:
    from rich.table import Table

    out = Table(
        title=f"{name} · f/{table.f_number:g} · efl {table.efl:.2f} mm · light at {angles[0]:g}, {angles[1]:g} degrees",
        caption="Peak: brightest irradiance over the direct image's flux, 1/mm². Focus: mm behind the sensor.",
    )
    out.add_column("path", no_wrap=True)
    for column in ("throughput mm²", "of direct", "centroid mm", "rms radius mm", "peak 1/mm²"):
        out.add_column(column, justify="right", no_wrap=True)
    out.add_column("bounded by", no_wrap=True)
    out.add_column("focus mm", justify="right", no_wrap=True)
    direct = table.direct
    out.add_row("direct", *_cells(direct, direct), end_section=True)
    for row in table.ghosts[:brightest]:
        out.add_row(row.name, *_cells(row, direct))
    console().print(out)


def _cells(row: GhostRow, direct: GhostRow) -> tuple[str, ...]:
    if row.throughput_mm2 == 0.0:
        return ("0", "-", "-", "-", "-", row.bounded_by, "-")
    ghost = row.first_reflection is not None
    # light that no lens takes in directly may still make ghosts
    compared = ghost and direct.throughput_mm2 > 0.0
    return (
        f"{row.throughput_mm2:.4g}",
        f"{row.throughput_mm2 / direct.throughput_mm2:.2e}" if compared else "-" if ghost else "1",
        # z: a centroid on the axis has a sign of its own, and nobody wants to read -0.00
        f"{row.centroid_mm[0]:z.2f}, {row.centroid_mm[1]:z.2f}",
        f"{row.rms_radius_mm:.3g}",
        f"{row.peak_irradiance:.3g}" if compared else "-",
        row.bounded_by if ghost else "-",
        "-" if row.focus_distance_mm is None or not ghost else f"{row.focus_distance_mm:.1f}",
    )
