"""`flarewright render`: from a lens and a light to a layered, linear picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ProjectError
from .common import check_place, first_run_bar, print_json, tell
from .preview import PreviewLook, check_exposure, preview_look, write_preview

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..model import Project
    from ..model.reference_state import ReferenceState
    from ..render.ledger import Ledger
    from ..render.reference import ReferenceRun
    from ..render.render import Rendering

EPILOG = (
    "Examples:\n\nflarewright render heliar-tronnier --light 10,5 -o flare.exr\n\n"
    "flarewright render canon-28-80 --light -8,3 --light 2,6 --intensity 1 --intensity 0.2 --spectrum black-body:3200 "
    "--fstop 8 --blades 7 --coating quarter-wave:550 --size 1920x1080 --layers ghosts --brightest 30 "
    "-o shot.exr\n\n"
    "flarewright render heliar-tronnier --light sun@10,5 --light -12,2 --light-size 3x2 --distance inf --distance 900 "
    "--spectrum d65 --spectrum rgb:1,0.6,0.2 -o room.exr\n\n"
    "flarewright render model.json --light 12,7 --mute 3 -o measured.exr\n\n"
    "flarewright render --project shot.toml --quality draft -o test.exr"
)

_LIGHT, _LENS, _CAMERA, _WORK, _ART, _OUT = "Light", "Lens", "Camera", "Quality", "Art direction", "Output"
_REFERENCE = "Reference quality"
_DIRT = "Starburst"


def render(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="OUT.exr", help="The EXR file.", rich_help_panel=_OUT)
    ],
    lens: Annotated[
        str | None, typer.Argument(metavar="LENS", help="A shipped lens, a lens file, or a measured flare (.json).")
    ] = None,
    project: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A project file; flags given beside it win over it.")
    ] = None,
    look: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="Coatings, iris, dirt, colours of lights ... as one of `flarewright looks`; flags beside it win.",
        ),
    ] = None,
    light: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y",
            help="Field angles in degrees, right and up, or sun@X,Y for a disc of 0.53 degrees; may be repeated.",
            rich_help_panel=_LIGHT,
        ),
    ] = None,
    intensity: Annotated[
        list[float] | None,
        typer.Option(help="Irradiance of the light: once for all, or once per light.", rich_help_panel=_LIGHT),
    ] = None,
    spectrum: Annotated[
        list[str] | None,
        typer.Option(
            help="d65, equal-energy, black-body:K, lines:NM,NM*POWER, rgb:R,G,B (linear Rec.709) or a .csv: once for "
            "all, or once per light.",
            rich_help_panel=_LIGHT,
        ),
    ] = None,
    light_diameter: Annotated[
        list[float] | None,
        typer.Option(help="Degrees across the light's disc, 0.53 for the sun; 0 is a point.", rich_help_panel=_LIGHT),
    ] = None,
    light_size: Annotated[
        list[str] | None,
        typer.Option(metavar="WxH", help="Degrees across an evenly bright rectangle.", rich_help_panel=_LIGHT),
    ] = None,
    light_polygon: Annotated[
        list[str] | None,
        typer.Option(
            metavar="'X,Y X,Y X,Y'", help="Corners of an even light, degrees from its place.", rich_help_panel=_LIGHT
        ),
    ] = None,
    distance: Annotated[
        list[float] | None,
        typer.Option(
            help="Light in front of the lens, mm; inf, or left out: distant. Once for all, or once per light.",
            rich_help_panel=_LIGHT,
        ),
    ] = None,
    holdout: Annotated[
        Path | None,
        typer.Option(help="An image of the picture's shape; its black hides lights.", rich_help_panel=_LIGHT),
    ] = None,
    depth: Annotated[
        Path | None,
        typer.Option(help="An EXR depth plate in metres: what is nearer hides lights.", rich_help_panel=_LIGHT),
    ] = None,
    fstop: Annotated[
        float | None, typer.Option(help="f-number; wide open when left out.", rich_help_panel=_LENS)
    ] = None,
    blades: Annotated[int | None, typer.Option(help="Blades of the iris, 0 is round.", rich_help_panel=_LENS)] = None,
    rotation: Annotated[
        float | None, typer.Option(help="Turns the blades, degrees counter-clockwise.", rich_help_panel=_LENS)
    ] = None,
    rounding: Annotated[
        float | None, typer.Option(help="0 straight blades, 1 a full circle.", rich_help_panel=_LENS)
    ] = None,
    iris_image: Annotated[
        Path | None, typer.Option(help="A grey image as the iris; white transmits.", rich_help_panel=_LENS)
    ] = None,
    roughness: Annotated[
        float | None, typer.Option(help="Rms of the blades' edges, micrometres.", rich_help_panel=_LENS)
    ] = None,
    coating: Annotated[
        str | None,
        typer.Option(
            help="none, quarter-wave:NM, preset:NAME, lens, a name of `flarewright coating list`, film:N:NM, "
            "stack:N:NM,... or a coating file.",
            rich_help_panel=_LENS,
        ),
    ] = None,
    ideal: Annotated[
        bool,
        typer.Option(
            "--ideal",
            help="Lens of the library as in its file: wide open, bare unless its file says more, straight blades, a "
            "point of light. Left out: stopped down, coated, as photographed.",
            rich_help_panel=_LENS,
        ),
    ] = False,
    focus: Annotated[
        float | None,
        typer.Option(help="Plane in focus, mm in front of the lens; infinity when left out.", rich_help_panel=_LENS),
    ] = None,
    dust: Annotated[
        float | None, typer.Option(help="Specks of dust per mm^2 of the stop.", rich_help_panel=_DIRT)
    ] = None,
    scratches: Annotated[
        float | None, typer.Option(help="Scratches per cm^2 of the stop.", rich_help_panel=_DIRT)
    ] = None,
    fingerprint: Annotated[
        float | None, typer.Option(help="Light that a fingerprint's ridges take, 0 to 1.", rich_help_panel=_DIRT)
    ] = None,
    dirt_image: Annotated[
        Path | None, typer.Option(help="A grey image of dirt over the stop; white transmits.", rich_help_panel=_DIRT)
    ] = None,
    cats_eye: Annotated[
        bool,
        typer.Option("--cats-eye", help="Starburst of the pupil as rims clip it at that angle.", rich_help_panel=_DIRT),
    ] = False,
    starburst_size: Annotated[
        float | None, typer.Option(help="Stretches the starburst by hand; 1 is physics.", rich_help_panel=_ART)
    ] = None,
    starburst_spiral: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Smears the starburst over an angle, to hide fringes.", rich_help_panel=_ART),
    ] = None,
    scatter: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL", help="What surfaces scatter: none, harvey-shack, abg, chaumond.", rich_help_panel=_LENS
        ),
    ] = None,
    surface_roughness: Annotated[
        float | None,
        typer.Option(help="Rms roughness of the surfaces, nm (1); scatters.", rich_help_panel=_LENS),
    ] = None,
    cleanliness: Annotated[
        float | None,
        typer.Option(help="Dust on the surfaces: level of IEST-STD-CC1246, 300 say.", rich_help_panel=_LENS),
    ] = None,
    zoom: Annotated[
        str | None,
        typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.", rich_help_panel=_LENS),
    ] = None,
    filter_plate: Annotated[
        str | None,
        typer.Option(
            "--filter",
            metavar="GLASS:MM[:GAP]",
            help="A plane filter in front: N-BK7:2, or with its gap to the lens, 1.52:2:10.",
            rich_help_panel=_LENS,
        ),
    ] = None,
    imperfection: Annotated[
        str | None,
        typer.Option(
            metavar="SEED[:UM:ARCMIN[:NM]]",
            help="One sample within tolerances: decentre (10 um), tilt (1 arcmin), figure (0 nm rms).",
            rich_help_panel=_LENS,
        ),
    ] = None,
    ghost_offset: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Moves each ghost by chance, standard deviation; seeded by --imperfection, else --seed.",
            rich_help_panel=_ART,
        ),
    ] = None,
    cover_glass: Annotated[
        str | None,
        typer.Option(
            metavar="GLASS:MM[:GAP]", help="Plane glass in front of the sensor: N-BK7:2:0.5.", rich_help_panel=_CAMERA
        ),
    ] = None,
    sensor_reflectance: Annotated[
        float | None,
        typer.Option(help="Part of the light the sensor mirrors back, 0 to 1 (0).", rich_help_panel=_CAMERA),
    ] = None,
    sensor_grating: Annotated[
        str | None,
        typer.Option(
            metavar="UM[:FILL[:ORDERS]]",
            help="Period of its pixels, which diffract what it mirrors (final): 8:0.7:3.",
            rich_help_panel=_CAMERA,
        ),
    ] = None,
    squeeze: Annotated[
        float | None,
        typer.Option(help="Of an anamorphic lens; its file's when left out.", rich_help_panel=_CAMERA),
    ] = None,
    desqueeze: Annotated[
        bool, typer.Option("--desqueeze", help="Draw an anamorphic picture wide.", rich_help_panel=_CAMERA)
    ] = False,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Picture in pixels (1280x720).", rich_help_panel=_CAMERA)
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Sensor in mm (36 wide, square pixels).", rich_help_panel=_CAMERA),
    ] = None,
    sensor_distance: Annotated[
        float | None,
        typer.Option(help="Last vertex to sensor, mm; the paraxial focus when left out.", rich_help_panel=_CAMERA),
    ] = None,
    quality: Annotated[
        str | None,
        typer.Option(
            help="draft: matrices, milliseconds; final: traced rays; reference: random rays, all orders, with errors.",
            rich_help_panel=_WORK,
        ),
    ] = None,
    wavelengths: Annotated[
        int | None, typer.Option(help="Traced wavelengths: 3 for a draft, 7 to 31 for final.", rich_help_panel=_WORK)
    ] = None,
    paths: Annotated[
        str | None, typer.Option(help="Ghost paths: all, or same-side of the stop.", rich_help_panel=_WORK)
    ] = None,
    ringing: Annotated[
        str | None,
        typer.Option(
            help="Rings inside ghosts, final quality: collins, exact paraxial diffraction, the default; frft, Hullin's "
            "estimate; off.",
            rich_help_panel=_WORK,
        ),
    ] = None,
    rule: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RULE",
            help="A rule of [\\[art.rules]]: 'select = \"row:7\", tint = [1, 0.6, 0.3], scale = 2'; may be repeated.",
            rich_help_panel=_ART,
        ),
    ] = None,
    mute: Annotated[
        list[str] | None,
        typer.Option(
            metavar="GHOSTS",
            help="Leave ghosts out: 7-3, row:7, brightest:5, largest:10, bounded:stop, 'not 7-3'; may be repeated.",
            rich_help_panel=_ART,
        ),
    ] = None,
    solo: Annotated[
        list[str] | None,
        typer.Option(metavar="GHOSTS", help="Draw these ghosts only; may be repeated.", rich_help_panel=_ART),
    ] = None,
    gain: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FACTOR", help="Multiply a pass (ghosts, starburst) or ghosts (7-3).", rich_help_panel=_ART
        ),
    ] = None,
    physical: Annotated[
        bool, typer.Option("--physical", help="Ignore all that is changed by hand.", rich_help_panel=_ART)
    ] = False,
    threads: Annotated[
        int | None, typer.Option(min=1, help="All cores when left out; pixels do not change.", rich_help_panel=_WORK)
    ] = None,
    orders: Annotated[
        int | None, typer.Option(help="2; 4 also draws ghosts of four reflections (final).", rich_help_panel=_WORK)
    ] = None,
    order4_limit: Annotated[
        float | None,
        typer.Option(
            help="Of those, draw what carries more than this part of the two-reflection light (1e-4).",
            rich_help_panel=_WORK,
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Begins all random numbers: rays, dirt, rough edges.", rich_help_panel=_REFERENCE)
    ] = None,
    error: Annotated[
        float | None,
        typer.Option(help="Go on to this relative standard error (0.02).", rich_help_panel=_REFERENCE),
    ] = None,
    error_of: Annotated[
        str | None,
        typer.Option(help="Of blocks (16x16 pixels) or of the total of all ghosts.", rich_help_panel=_REFERENCE),
    ] = None,
    rays_from: Annotated[
        str | None,
        typer.Option(help="Of area lights: auto, light or camera.", rich_help_panel=_REFERENCE),
    ] = None,
    samples: Annotated[
        int | None, typer.Option(help="Trace no more points of the front than this.", rich_help_panel=_REFERENCE)
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="End after this time.", rich_help_panel=_REFERENCE)
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Go on from a .state.npz file.", rich_help_panel=_REFERENCE),
    ] = None,
    layers: Annotated[
        str | None,
        typer.Option(help="beauty; passes: also starburst, ghosts; ghosts: also each ghost.", rich_help_panel=_OUT),
    ] = None,
    brightest: Annotated[
        int | None, typer.Option(help="Of single ghosts, write only so many.", rich_help_panel=_OUT)
    ] = None,
    no_starburst: Annotated[
        bool, typer.Option("--no-starburst", help="Leave out the light's direct image.", rich_help_panel=_OUT)
    ] = False,
    colorspace: Annotated[str | None, typer.Option(help="rec709 or acescg, linear.", rich_help_panel=_OUT)] = None,
    gamut: Annotated[
        str | None,
        typer.Option(help="keep negative channels (when left out), or compress colours.", rich_help_panel=_OUT),
    ] = None,
    half: Annotated[
        bool, typer.Option("--half", help="Write 16 bits a value, as when left out.", rich_help_panel=_OUT)
    ] = False,
    float32: Annotated[
        bool, typer.Option("--float", help="Write 32 bits a value, irradiances as they are.", rich_help_panel=_OUT)
    ] = False,
    full_windows: Annotated[
        bool,
        typer.Option("--full-windows", help="Single ghosts at full size, for Blender.", rich_help_panel=_OUT),
    ] = False,
    exposure: Annotated[
        float | None, typer.Option(help="Stops, for the PNG only; automatic when left out.", rich_help_panel=_OUT)
    ] = None,
    ev: Annotated[
        float | None,
        typer.Option(help="Exposure value of a camera, log2(N^2 / t), for the PNG only.", rich_help_panel=_OUT),
    ] = None,
    shutter: Annotated[
        str | None,
        typer.Option(metavar="SECONDS", help="Shutter of a camera, 1/250, for the PNG only.", rich_help_panel=_OUT),
    ] = None,
    iso: Annotated[
        float | None, typer.Option(help="With --ev or --shutter; 100 when left out.", rich_help_panel=_OUT)
    ] = None,
    lux: Annotated[
        str | None,
        typer.Option(
            help="With --ev or --shutter: what a light of intensity 1 gives; sun (100 000) when left out.",
            rich_help_panel=_OUT,
        ),
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(help="filmic (when left out), srgb or aces, for the PNG only.", rich_help_panel=_OUT),
    ] = None,
    no_png: Annotated[
        bool, typer.Option("--no-png", help="Write no PNG beside the EXR.", rich_help_panel=_OUT)
    ] = False,
    ledger: Annotated[
        bool, typer.Option("--ledger", help="Tell what became of the light.", rich_help_panel=_OUT)
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a summary as one JSON object.", rich_help_panel=_OUT)
    ] = False,
) -> None:
    """Render the flare of a lens into a layered, linear EXR, with a PNG to look at.

    Every value is an irradiance on the sensor relative to a light of irradiance 1, so layers add up to the beauty.
    A file of half floats holds it times a power of two, its attribute flarewright.scale.
    """
    check_place(output, ".exr")
    view_of = preview_look(view=view, exposure=exposure, ev=ev, shutter=shutter, iso=iso, lux=lux, no_png=no_png)
    if half and float32:
        raise ProjectError("--half and --float both say how many bits a value has; keep one")
    from .art_flags import naming_rules
    from .flag_set import Flags
    from .look_flags import photographed, put_look, said_by
    from .render_flags import build_project

    state = _read_state(resume)
    flags = Flags(
        lens=lens, project=project, light=light or [], intensity=intensity or [], spectrum=spectrum or [],
        fstop=fstop, blades=blades, rotation=rotation, rounding=rounding, iris_image=iris_image, coating=coating,
        light_diameter=light_diameter or [], light_size=light_size or [], light_polygon=tuple(light_polygon or ()),
        distance=distance or [], rule=tuple(rule or ()),
        roughness=roughness, dust=dust, scratches=scratches, fingerprint=fingerprint, dirt_image=dirt_image,
        cats_eye=cats_eye, starburst_size=starburst_size, starburst_spiral=starburst_spiral,
        focus=focus, size=size, sensor=sensor, sensor_distance=sensor_distance, quality=quality,
        wavelengths=wavelengths, paths=paths, layers=layers, brightest=brightest, no_starburst=no_starburst,
        colorspace=colorspace, gamut=gamut, half=half if half or float32 else None,
        mute=mute or [], solo=solo or [], gain=gain or [], physical=physical,
        orders=orders, order4_limit=order4_limit,
        seed=seed, error=error, error_of=error_of, samples=samples, rays_from=rays_from,
        resumed=None if state is None else state.project,
        ringing=ringing, scatter=scatter, surface_roughness=surface_roughness, cleanliness=cleanliness,
        holdout=holdout, depth=depth,
        zoom=zoom, filter_plate=filter_plate, imperfection=imperfection, ghost_offset=ghost_offset,
        cover_glass=cover_glass, sensor_reflectance=sensor_reflectance, sensor_grating=sensor_grating,
        squeeze=squeeze, desqueeze=desqueeze,
    )  # fmt: skip
    said, plain = said_by(flags), ideal or project is not None or state is not None
    remarks: list[str] = []
    if look is not None:
        flags, of_look, unfit = put_look(flags, look)
        said, remarks = said | of_look, list(unfit)
    settings = build_project(flags)
    if not plain:
        settings, filled = photographed(settings, said)
        remarks = [*filled, *remarks]
    check_exposure(view_of, settings)
    only = {
        "--resume": state, "--time-limit": time_limit, "--error": error, "--error-of": error_of, "--samples": samples,
        "--rays-from": rays_from,
    }  # fmt: skip
    run = _reference_run(
        settings, output, state, time_limit, [flag for flag, value in only.items() if value is not None]
    )
    _keep_inputs(settings, project, [output] if no_png else [output, output.with_suffix(".png")])
    try:
        with naming_rules(flags, settings):
            rendering = _render(settings, threads, run, ledger)
    except KeyboardInterrupt:
        if run is not None and run.state_file is not None and run.state_file.exists():
            tell([f"to go on: flarewright render --resume {run.state_file} -o {output}"])
        raise
    files, written = _write(rendering, output, full_windows, view_of)
    remarks = [*remarks, *rendering.remarks, *written]
    if ringing == "collins" and settings.quality.mode != "final":
        remarks.insert(0, f"{settings.quality.mode} quality traces rays alone: --ringing is for final quality")
    if orders == 4 and settings.quality.mode == "draft":
        remarks.insert(0, "draft quality draws ghosts of two reflections alone: --orders 4 is for final quality")
    if brightest is not None and settings.output.layers != "ghosts":
        remarks.insert(0, "--brightest counts layers of single ghosts, and there are none: add --layers ghosts")
    if full_windows and settings.output.layers != "ghosts":
        remarks.insert(0, "--full-windows is for layers of single ghosts, and there are none: add --layers ghosts")
    if order4_limit is not None and settings.quality.orders != 4:
        remarks.insert(0, "--order4-limit is for ghosts of four reflections, and there are none: add --orders 4")
    if run is not None:
        remarks.append(f"to go on to a smaller --error: --resume {run.state_file}")
    tell(remarks)
    if rendering.ledger is not None:
        _print_ledger(rendering.ledger)
    if as_json:
        print_json({**rendering.summary, **files, "remarks": remarks})
    else:
        tell(f"wrote {name}" for name in (files["output"], files.get("preview")) if name)


def _keep_inputs(settings: Project, project_file: Path | None, outputs: list[Path]) -> None:
    """Refuse to write over a file that this render reads."""
    read = [project_file, settings.lens if isinstance(settings.lens, str) else None]
    read += [settings.iris.mask if settings.iris is not None else None, settings.dirt.image]
    for hiding in (settings.holdout, *(light.holdout for light in settings.lights)):
        read += [] if hiding is None else [hiding.image, hiding.depth]
    for source in read:
        for output in outputs:
            if source is not None and Path(source).exists() and output.exists() and output.samefile(source):
                raise ProjectError(f"{output} would replace the file it is made from; choose another name for -o")


def _read_state(path: Path | None) -> ReferenceState | None:
    if path is None:
        return None
    from ..io.reference_state import read_state

    return read_state(path)


def _reference_run(
    project: Project, output: Path, state: ReferenceState | None, time_limit: float | None, given: list[str]
) -> ReferenceRun | None:
    """Check what only reference quality understands; None for the other qualities."""
    if time_limit is not None and not 0.0 < time_limit < float("inf"):
        raise ProjectError(f"--time-limit {time_limit:g} is no time; give seconds above 0")
    if project.quality.mode != "reference":
        for flag in given:
            raise ProjectError(
                f"{flag} works with --quality reference only, not with {project.quality.mode}; add it or leave "
                f"{flag} out"
            )
        return None
    from ..io.reference_state import SUFFIX
    from ..render.reference import ReferenceRun

    return ReferenceRun(state, output.with_name(output.stem + SUFFIX), time_limit)


def _print_ledger(ledger: Ledger) -> None:
    """Print the ledger as a table to stderr."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"What became of the light: {ledger.entered_mm2:.6g} mm² entered")
    table.add_column("light")
    table.add_column("share of what entered", justify="right")
    table.add_column("standard error", justify="right")
    for line in ledger.lines:
        table.add_row(line.words, f"{line.share:.6%}", f"{line.standard_error:.1e}")
    table.add_section()
    table.add_row("sum", f"{ledger.total.share:.6%}", f"{ledger.total.standard_error:.1e}")
    Console(stderr=True, markup=False, highlight=False).print(table)


def _render(project: Project, threads: int | None, run: ReferenceRun | None, ledger: bool) -> Rendering:
    """Render with a progress bar where someone looks at it."""
    import sys

    draw = _renderer(project, threads, run, ledger)
    if not sys.stderr.isatty():
        return draw(progress=None)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("rendering", total=1.0)
        return draw(progress=lambda done, what: bar.update(task, completed=done, description=what))


def _renderer(
    project: Project, threads: int | None, run: ReferenceRun | None, ledger: bool
) -> Callable[..., Rendering]:  # fmt: skip
    """Return what draws a project, be it of a lens or of a measured flare, once it is told its progress."""
    from functools import partial

    from ..io.ghost_model_file import names_ghost_model

    if names_ghost_model(project.lens):
        from ..measure.rendering import render_measured

        if ledger:
            raise ProjectError(f"{project.lens} is a measured flare, whose light no ledger follows; leave --ledger out")
        return partial(render_measured, project)
    from ..render.first_run import compile_for_render
    from ..render.render import render as render_project

    compile_for_render(project, threads, lambda sentence: tell([sentence]), first_run_bar)
    return partial(render_project, project, threads=threads, run=run, ledger=ledger)


def _write(
    rendering: Rendering, output: Path, full_windows: bool, look: PreviewLook | None
) -> tuple[dict[str, Any], list[str]]:
    """Write the EXR and its preview; return what was written where, and remarks."""
    from .. import __version__
    from ..io.exr import write_exr
    from ..io.half import exr_scale
    from ..io.project_file import project_text
    from ..render.gamut import negative_share

    project = rendering.project
    width, height = project.camera.size_px
    scale = exr_scale(project)
    remarks = list(
        write_exr(
            output,
            rendering.layers,
            (width, height),
            pixel_type=project.output.pixel_type,
            scale=scale,
            metadata={"version": __version__, "project": project_text(project)},
            pixel_aspect=project.camera.pixel_aspect,
            colorspace=project.output.colorspace,
            full_windows=full_windows,
        )
    )
    outside = negative_share(rendering.layers[0])
    if outside > 0.0:
        remarks.append(
            f"{round(outside * width * height)} of {width * height} pixels have a negative channel: colours outside "
            "the file's primaries; --gamut compress writes none"
        )
    files: dict[str, Any] = {
        "output": str(output), "layers": [layer.name for layer in rendering.layers], "scale": scale,
        "negative_pixels": outside,
    }  # fmt: skip
    if look is not None:
        files |= write_preview(rendering, output.with_suffix(".png"), look)
        remarks.append(f"the preview shows {files['view']}")
    return files, remarks
