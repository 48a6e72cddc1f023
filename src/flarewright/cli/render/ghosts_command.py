"""`flarewright ghosts`: the ghost analysis of a lens."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import ProjectError
from ..common import (
    chosen_fstop,
    console,
    field_angles,
    first_run_bar,
    one_bar,
    pair,
    picture_size,
    print_json,
    print_remark,
    print_remarks,
)
from ..option_record import with_options
from ..shared_options import FNumber, Json, KnownLens, Zoom
from .kept_glare import kept_glare

if TYPE_CHECKING:
    from ...model import Lens, Project
    from ...optics.rays.ghost_table import GhostQuery, GhostRow, GhostTable
    from ...render.analysis_memory import AnalysisMemory
    from ...render.scene.resolve import ResolvedProject

EPILOG = (
    "Examples:\n\nflarewright ghosts heliar-tronnier --light 10,0\n\n"
    "flarewright ghosts my.toml --light 0,0 --coating quarter-wave:550 --fstop 8 --json\n\n"
    "flarewright ghosts heliar-tronnier --light 10,0 --sweep field=0:25:5 --sweep fstop=3.5,8"
)


@dataclass(frozen=True, kw_only=True)
class GhostsOptions:
    """The options of `flarewright ghosts` as given."""

    lens: KnownLens
    light: Annotated[
        list[str], typer.Option(metavar="X,Y", help="Field angles in degrees, right and up in the picture.")
    ] = field(default_factory=list)
    light_px: Annotated[
        list[str], typer.Option(metavar="X,Y", help="Instead: the pixel of its direct image in a picture of --size.")
    ] = field(default_factory=list)
    px_origin: Annotated[
        str | None,
        typer.Option(metavar="CORNER", help="Corner of --light-px: top-left (default) or bottom-left, as in Nuke."),
    ] = None
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="With --light-px: picture in pixels (default: 1280x720, or the camera's)."),
    ] = None
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="WxH|CAMERA", help="With --light-px: sensor in mm (default: 36 wide), or of `flarewright cameras`."
        ),
    ] = None
    distance: Annotated[
        float | None, typer.Option(help="Distance of the light in front of the lens, mm (default: inf).")
    ] = None
    wavelength_nm: Annotated[float, typer.Option(help="Wavelength, 380 to 780 nm (default: 587.56).")] = 587.56
    coating: Annotated[
        str,
        typer.Option(
            help="lens, none, quarter-wave:NM, preset:NAME, a name of `flarewright coating list`, stack:N:NM,... "
            "or a file."
        ),
    ] = "lens"
    fstop: FNumber = None
    paths: Annotated[str, typer.Option(help="Ghost paths: all, or same-side of the stop.")] = "all"
    focus: Annotated[float | None, typer.Option(help="Distance of the plane in focus, mm (default: infinity).")] = None
    sensor_distance: Annotated[float | None, typer.Option(help="Last vertex to sensor, mm.")] = None
    zoom: Zoom = None
    filter_plate: Annotated[
        str | None, typer.Option("--filter", metavar="GLASS:MM[:GAP]", help="Plane filter in front: N-BK7:2.")
    ] = None
    cover_glass: Annotated[
        str | None, typer.Option(metavar="GLASS:MM[:GAP]", help="Plane glass in front of the sensor: N-BK7:2:0.5.")
    ] = None
    sensor_reflectance: Annotated[float, typer.Option(help="Reflectance of the sensor, 0 to 1 (default: 0).")] = 0.0
    imperfection: Annotated[
        str | None, typer.Option(metavar="SEED[:UM:ARCMIN[:NM]]", help="Random sample of the lens within tolerances.")
    ] = None
    orders: Annotated[int, typer.Option(help="Reflections: 4 also lists ghosts of four (default: 2).")] = 2
    order4_limit: Annotated[
        float | None,
        typer.Option(help="List those of four above this fraction of the two-reflection light (default: 1e-4)."),
    ] = None
    glare: Annotated[bool, typer.Option("--glare", help="Also print the veiling glare index.")] = False
    scatter: Annotated[
        str | None, typer.Option(metavar="MODEL", help="For --glare: none, harvey-shack, abg, chaumond.")
    ] = None
    surface_roughness: Annotated[float | None, typer.Option(help="For --glare: rms roughness of the surfaces, nm.")] = (
        None
    )
    cleanliness: Annotated[float | None, typer.Option(help="For --glare: dust, level of IEST-STD-CC1246.")] = None
    brightest: Annotated[int | None, typer.Option(min=1, help="List only the brightest ones, up to this number.")] = (
        None
    )
    as_json: Json = False
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=VALUES",
            help="Repeat over field=0:30:5, wavelength=450,550,650 or fstop=2.8,8, and rank the surfaces by what a "
            "better coating gains.",
        ),
    ] = None
    as_csv: Annotated[bool, typer.Option("--csv", help="Print a table of comma-separated values.")] = False


@with_options(GhostsOptions)
def ghosts(options: GhostsOptions) -> None:
    """List flux and place of every two-reflection ghost path, and on request of those of four reflections.

    Rays are traced, not paraxial, to the unbounded sensor plane. The throughput is the flux on it for a light with an
    irradiance of 1 on a plane facing it; the peak irradiance is relative to the direct image's flux.
    """
    # the flags are checked before anything slow is imported
    project_with = _project_of(options)

    from ...optics.lens.plane_plates import filter_length
    from ...optics.rays.ghost_table import GhostQuery
    from ...optics.rays.pack import SensorMirror
    from ...render.analysis import find_ghosts
    from ...render.scene.resolve import open_lens, resolve_project
    from ...render.warmup import compile_for_analysis
    from .project_flags import check_focus

    opened = open_lens(options.lens)
    check_focus(opened.lens, options.focus, options.sensor_distance)
    project = project_with(opened.lens)
    settled = resolve_project(project)
    compile_for_analysis(settled.lens, first_run_bar)
    if options.light_px:
        project = _at_pixel(project, options)
    light, quality, reflectance = project.lights[0], project.quality, options.sensor_reflectance
    query = GhostQuery(
        light.field_deg, settled.light_distance(0), options.wavelength_nm, quality.paths,
        SensorMirror(reflectance) if reflectance > 0.0 else None, quality.orders, quality.order4_limit,
    )  # fmt: skip
    if options.sweep:
        print_remarks(dict.fromkeys((*opened.remarks, *settled.remarks)))
        _sweep(options, project, settled, query)
        return
    veil = None
    with _kept(options, settled, query) as memory:
        with one_bar("ghosts") as progress:
            table, found = find_ghosts(
                settled.lens, settled.order, settled.coating, query, ahead=filter_length(project.filter),
                progress=progress, memory=memory,
            )  # fmt: skip
        if options.glare:
            with one_bar("veiling glare") as progress:
                veil = kept_glare(project, options.wavelength_nm, progress=progress)
    print_remarks(dict.fromkeys((*opened.remarks, *settled.remarks, *found)))
    if options.as_csv:
        print(table_csv(table, options.brightest), end="")
        return
    if options.as_json:
        print_json(ghost_data(table, options.brightest) | ({} if veil is None else {"veiling_glare": asdict(veil)}))
        return
    _print_table(table, opened.lens.name, light.field_deg, options.brightest)
    if veil is not None:
        console().print(
            f"veiling glare index {veil.index:.3%} at {veil.wavelength_nm:g} nm: ghosts {veil.ghosts:.3%}, scatter "
            f"{veil.scatter:.3%}, blur {veil.blur:.3%}; a black patch of {veil.patch_deg:.2f} degrees"
        )


def _project_of(options: GhostsOptions) -> Callable[[Lens], Project]:
    """Check the options; return a function that makes the project of the opened lens."""
    from ...io.lens.coating_text import parse_coating_choice
    from ...io.lens.plate_text import parse_imperfection, parse_plate
    from .project_flags import project_of, scatter_flags

    lights = [*options.light, *options.light_px]
    if len(lights) > 1:
        which = "--light and --light-px are" if options.light and options.light_px else "--light is"
        which = which if options.light else "--light-px is"
        raise ProjectError(f"{which} given {len(lights)} times; ghosts are listed for one light, so keep one")
    if not lights:
        raise ProjectError("no light is given; give its place in degrees by --light X,Y, for example --light 10,5")
    angles = field_angles(options.light[0]) if options.light else (0.0, 0.0)
    wavelength_nm = options.wavelength_nm
    if not (math.isfinite(wavelength_nm) and 380.0 <= wavelength_nm <= 780.0):
        raise ProjectError(f"--wavelength-nm {wavelength_nm:g} is not visible light; choose one between 380 and 780 nm")
    in_front, behind, imperfection = options.filter_plate, options.cover_glass, options.imperfection
    limit = {} if options.order4_limit is None else {"order4_limit": options.order4_limit}
    settings = {
        "coating": parse_coating_choice(options.coating),
        "f_number": chosen_fstop(options.fstop),
        "filter": None if in_front is None else parse_plate(in_front, "--filter"),
        "camera": {
            "cover_glass": None if behind is None else parse_plate(behind, "--cover-glass"),
            "sensor_reflectance": options.sensor_reflectance,
            "focus_distance": options.focus,
            "sensor_distance": options.sensor_distance,
            **_picture(options),
        },
        "imperfection": None if imperfection is None else parse_imperfection(imperfection),
        "scatter": scatter_flags(options.scatter, options.surface_roughness, options.cleanliness),
        "lights": ({"field_deg": angles, "distance": None if options.distance == math.inf else options.distance},),
        "quality": {"paths": options.paths, "orders": options.orders, **limit},
        "zoom": options.zoom,
    }
    if options.as_csv and (options.as_json or options.glare):
        raise ProjectError(
            f"--csv prints a table of ghosts, which cannot hold {'--json' if options.as_json else '--glare'}; keep one"
        )
    _check_sweep(options)
    if options.orders == 2 and limit:
        raise ProjectError("--order4-limit is for ghosts of four reflections only; add --orders 4, or leave it out")
    if settings["scatter"] is not None and not options.glare:
        raise ProjectError("--scatter, --surface-roughness and --cleanliness change the glare only; add --glare")
    return lambda lens: project_of({"lens": lens, **settings})


def _picture(options: GhostsOptions) -> dict[str, Any]:
    """Return the settings of the picture in which the pixel of a light counts."""
    given = {"--px-origin": options.px_origin, "--size": options.size, "--sensor": options.sensor}
    for flag, value in given.items():
        if value is not None and not options.light_px:
            raise ProjectError(f"{flag} is for the pixel of --light-px; add it, or leave {flag} out")
    size = {} if options.size is None else {"size_px": picture_size(options.size)}
    if options.sensor is None:
        return size
    from ...io.project.camera_list import camera_format, is_camera_name
    from .framing import on_sensor

    if not is_camera_name(options.sensor):
        return {**size, "sensor_mm": pair(options.sensor, "--sensor", "36x24 (mm)", "x")}
    size_px, sensor_mm, words = on_sensor(camera_format(options.sensor), size.get("size_px"))
    print_remarks([words])
    return {"size_px": size_px, "sensor_mm": sensor_mm}


def _at_pixel(project: Project, options: GhostsOptions) -> Project:
    """Return a project whose light lies at the pixel of --light-px."""
    from ...workflow.light_places import lights_at_pixels
    from .tracks import from_top_left

    size = project.camera.size_px
    return lights_at_pixels(project, {0: from_top_left(options.light_px[0], options.px_origin, size[1])})


def _check_sweep(options: GhostsOptions) -> None:
    from .ghost_sweep import sweep_axes

    sweep_axes(options.sweep or ())
    if options.sweep and (options.glare or options.brightest is not None):
        raise ProjectError(
            f"--sweep lists points and surfaces, without {'--glare' if options.glare else '--brightest'}; leave it out"
        )


def _kept(options: GhostsOptions, settled: ResolvedProject, *inputs: Any) -> AbstractContextManager[AnalysisMemory]:
    """Keep the finished ghosts in the state folder until the block is done; `inputs` determine them with the lens."""
    from ..._version import __version__
    from ...render.image.partial_picture import digest_of
    from ...workflow.kept_work.kept_analysis import kept_analysis
    from ...workflow.kept_work.unnamed_work import unnamed_file

    # how the ghosts are printed does not change them
    command = repr(replace(options, as_json=False, as_csv=False, brightest=None))
    digest = digest_of(__version__, settled.lens, settled.order, settled.coating, inputs)
    return kept_analysis(unnamed_file(f"ghosts {command}"), digest, print_remark)


def _sweep(options: GhostsOptions, project: Project, settled: ResolvedProject, query: GhostQuery) -> None:
    """Analyse the ghosts at every point of a sweep, and print the result."""
    from ...workflow.ghost_sweep import along, surface_gains, sweep_ghosts
    from .ghost_sweep import print_sweep, sweep_axes, sweep_csv, sweep_data

    axes = sweep_axes(options.sweep or ())
    fields = (query.field_deg,) if axes.field is None else along(query.field_deg, axes.field)
    swept = fields, axes.wavelength or (query.wavelength_nm,), axes.fstop or (options.fstop,)
    with _kept(options, settled, query, swept) as memory, one_bar("sweep") as progress:
        points = list(sweep_ghosts(project, query, *swept, memory=memory, progress=progress))
    if options.as_csv:
        print(sweep_csv(points), end="")
        return
    gains = surface_gains(points)
    if options.as_json:
        print_json(sweep_data(points, gains))
    else:
        print_sweep(settled.opened.lens.name, points, gains)


def ghost_data(table: GhostTable, brightest: int | None = None) -> dict[str, Any]:
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


def table_csv(table: GhostTable, brightest: int | None = None) -> str:
    """Return the analysis as comma-separated values: a header, the direct image, then the ghosts as in `ghost_data`.

    Parameters
    ----------
    table : GhostTable
    brightest : int, optional
        Largest number of ghosts; None: all.

    Returns
    -------
    str
        Numbers have all their digits, unknown ones are empty; lines end with a line feed.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    columns = (
        "path", "throughput_mm2", "of_direct", "centroid_x_mm", "centroid_y_mm", "rms_radius_mm", "peak_irradiance",
        "peak_patch_mm", "bounded_by", "focus_distance_mm",
    )  # fmt: skip
    writer.writerow(columns)
    direct = table.direct.throughput_mm2
    for row in (table.direct, *table.ghosts[:brightest]):
        part = row.throughput_mm2 / direct if direct > 0.0 else math.nan
        values = (
            row.throughput_mm2, part, *row.centroid_mm, row.rms_radius_mm, row.peak_irradiance, row.peak_patch_mm,
            row.bounded_by, row.focus_distance_mm,
        )  # fmt: skip
        cells = ("" if isinstance(value, float) and not math.isfinite(value) else value for value in values)
        writer.writerow((row.name, *cells))
    return text.getvalue()


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
    # a light without a direct image may still make ghosts
    compared = ghost and direct.throughput_mm2 > 0.0
    return (
        f"{row.throughput_mm2:.4g}",
        f"{row.throughput_mm2 / direct.throughput_mm2:.2e}" if compared else "-" if ghost else "1",
        # z: print -0.00 as 0.00
        f"{row.centroid_mm[0]:z.2f}, {row.centroid_mm[1]:z.2f}",
        f"{row.rms_radius_mm:.3g}",
        f"{row.peak_irradiance:.3g}" if compared else "-",
        row.bounded_by if ghost else "-",
        "-" if row.focus_distance_mm is None or not ghost else f"{row.focus_distance_mm:.1f}",
    )
