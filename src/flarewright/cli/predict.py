"""`flarewright predict`: how much flare there will be."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from ..errors import ProjectError
from .common import check_place, console, pair, print_json, progress_bar, remembered, tell, write_text
from .predict_flares import lens_flares
from .predict_measured import Counting, model_flares
from .predict_scene import SceneWishes, is_scene, predict_scene
from .predict_sizes import SHOWN_PX

if TYPE_CHECKING:
    from ..model import Project
    from ..predict.occurrence import Flares, Occurrence, Setting, Wanted
    from ..render.glare import VeilingGlare

EPILOG = (
    "Examples:\n\nflarewright predict heliar-tronnier -o heliar.html\n\n"
    "flarewright predict canon-28-80 --fstop 8 --coating preset:staggered --sensor 36x24 --luminance 50,5000 "
    "-o canon.html --json\n\n"
    "flarewright predict match.toml --near 'east stand' --radius 10 -o match.html"
)

_LENS, _CURVES, _SCENE = "Camera", "Curves of a lens or a measured flare", "Scene"


def predict(
    subject: Annotated[
        str,
        typer.Argument(metavar="LENS|MODEL|SCENE", help="A lens, a measured flare (.json), or a scene file (.toml)."),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="REPORT.html", help="Write a report to look at.")
    ] = None,
    fstop: Annotated[
        float | None, typer.Option(help="f-number; wide open when left out.", rich_help_panel=_LENS)
    ] = None,
    coating: Annotated[
        str | None,
        typer.Option(
            help="lens, none, preset:NAME, quarter-wave:NM or what `render` takes besides.", rich_help_panel=_LENS
        ),
    ] = None,
    zoom: Annotated[
        str | None,
        typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.", rich_help_panel=_LENS),
    ] = None,
    focus: Annotated[
        float | None, typer.Option(help="Plane in focus, mm; infinity when left out.", rich_help_panel=_LENS)
    ] = None,
    sensor: Annotated[
        str | None, typer.Option(metavar="WxH", help="Sensor in mm (36x24).", rich_help_panel=_LENS)
    ] = None,
    unit_per_cd_m2: Annotated[
        float | None,
        typer.Option(
            help="Of a measured flare: the value that a photographed grey card of 1 cd/m² has in its captures; without "
            "it there is no veil and no contrast.",
            rich_help_panel=_LENS,
        ),
    ] = None,
    count: Annotated[
        Literal["all", "ghosts"] | None,
        typer.Option(
            metavar="all|ghosts",
            help="Of a measured flare: all but what is around the light (the default), or ghosts only.",
            rich_help_panel=_LENS,
        ),
    ] = None,
    around_light: Annotated[
        float | None,
        typer.Option(
            metavar="PART",
            help="Of a measured flare: how far around the light's image only ghosts count, part of the picture's "
            "width (0.0556); 0 counts the light's own image too.",
            rich_help_panel=_LENS,
        ),
    ] = None,
    spectrum: Annotated[
        str | None,
        typer.Option(help="Of the light: d65, black-body:K or what `render` takes.", rich_help_panel=_CURVES),
    ] = None,
    light_diameter: Annotated[
        float | None,
        typer.Option(help="Degrees across the light's disc, 0.53 for the sun.", rich_help_panel=_CURVES),
    ] = None,
    roll: Annotated[
        float | None,
        typer.Option(help="Direction of the light around the axis, degrees from the right.", rich_help_panel=_CURVES),
    ] = None,
    to: Annotated[
        float | None, typer.Option(help="Largest constellation, degrees; 85 when left out.", rich_help_panel=_CURVES)
    ] = None,
    bins: Annotated[
        int | None, typer.Option(min=2, max=20, help="Between a curve's extremes (5).", rich_help_panel=_CURVES)
    ] = None,
    illuminance: Annotated[
        float | None,
        typer.Option(
            help="Of the light on a plane facing it, lx (1e5, the sun). For a measured flare: of the light to predict, "
            "whatever was photographed; its model has to tell the luminance and solid angle of that.",
            rich_help_panel=_CURVES,
        ),
    ] = None,
    luminance: Annotated[
        str | None,
        typer.Option(
            metavar="MIN,MAX",
            help="Darkest and brightest of the scene, cd/m²: tells contrast.",
            rich_help_panel=_CURVES,
        ),
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Error of the curves between samples (0.03).", rich_help_panel=_CURVES)
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(min=5, max=2000, help="Constellations to draw at most (48).", rich_help_panel=_CURVES),
    ] = None,
    check: Annotated[
        int | None,
        typer.Option(min=0, max=100, help="Final renders to compare the curves with (4).", rich_help_panel=_CURVES),
    ] = None,
    near: Annotated[
        str | None,
        typer.Option(metavar="CAMERA", help="Look for a better position near this camera.", rich_help_panel=_SCENE),
    ] = None,
    radius: Annotated[
        float | None, typer.Option(help="For --near: how far around, m (5).", rich_help_panel=_SCENE)
    ] = None,
    height: Annotated[
        float | None, typer.Option(help="For --near: how far up and down, m (0).", rich_help_panel=_SCENE)
    ] = None,
    shortest_shot: Annotated[
        float | None, typer.Option(help="Least seconds between two switches of camera (0).", rich_help_panel=_SCENE)
    ] = None,
    quality: Annotated[
        str | None,
        typer.Option(
            help="final (traced rays, the default) or draft: matrices, quick but dark beyond the field of view."
        ),
    ] = None,
    glare: Annotated[bool, typer.Option("--glare", help="Also tell the veiling glare index.")] = False,
    cache: Annotated[
        Path | None,
        typer.Option(metavar="FILE.npz", help="Keep what was drawn, to go on after Ctrl-C or with a changed scene."),
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores when left out.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Tell how much flare there will be.

    For a lens or a measured flare: curves over the angle between camera and light, of sum, mean, maximum and
    log-average, without the light's own image. For a scene: every light in every camera over time, ranked.
    """
    if output is not None:
        check_place(output, ".html")
    if cache is not None:
        check_place(cache, ".npz")
    if quality not in (None, "draft", "final"):
        raise ProjectError(f"--quality {quality!r} is unknown here; choose draft or final")
    lens_flags = {
        "--fstop": fstop, "--coating": coating, "--zoom": zoom, "--focus": focus, "--spectrum": spectrum,
        "--light-diameter": light_diameter,
    }  # fmt: skip
    curve_flags = {
        "--sensor": sensor, "--roll": roll, "--to": to, "--bins": bins, "--illuminance": illuminance,
        "--luminance": luminance, "--tolerance": tolerance, "--samples": samples, "--check": check,
    }  # fmt: skip
    measured_flags = {"--unit-per-cd-m2": unit_per_cd_m2, "--count": count, "--around-light": around_light}
    scene_flags = {"--near": near, "--radius": radius, "--height": height, "--shortest-shot": shortest_shot}
    if is_scene(subject):
        _refuse({**lens_flags, **measured_flags, **curve_flags}, "a scene", "the scene file tells it")
        predict_scene(
            Path(subject),
            _scene_wishes(SceneWishes(
                output, quality or "final", near, 5.0 if radius is None else radius, height or 0.0,
                shortest_shot or 0.0, glare, threads, as_json, cache,
            ), radius or height),
        )  # fmt: skip
        return
    _refuse(scene_flags, "a lens or a measured flare", "give a scene file")
    wanted = _wanted(to, roll, tolerance, samples, check, bins, _setting(illuminance, luminance), output)
    size = _sensor(sensor)
    from ..io.ghost_model_file import names_ghost_model

    if names_ghost_model(subject):
        measured = {"--glare": glare or None, "--quality": quality, "--check": check}
        _refuse({**lens_flags, **measured}, "a measured flare", "it was measured")
        if unit_per_cd_m2 is not None and not 0.0 < unit_per_cd_m2 < math.inf:
            raise ProjectError(f"--unit-per-cd-m2 {unit_per_cd_m2:g} is no unit; give a number above 0")
        if unit_per_cd_m2 is None and luminance is not None:
            raise ProjectError(
                f"--luminance {luminance} tells nothing without --unit-per-cd-m2: how bright a scene is in a measured "
                "flare's captures is not known"
            )
        if count == "ghosts":
            _refuse({"--around-light": around_light}, "--count ghosts", "ghosts count everywhere")
        project, flares = None, model_flares(subject, size, unit_per_cd_m2, Counting(count == "ghosts", around_light))
        if not flares.sampled.per_lux:
            untold = "it does not tell luminance_cd_m2 and solid_angle_sr of its captures' light (docs/measure.md)"
            _refuse({"--illuminance": illuminance}, subject, untold)
    else:
        _refuse({"--unit-per-cd-m2": unit_per_cd_m2}, "a lens", "it follows from the glass")
        apart = "the light's own image is drawn apart from the flare"
        _refuse({"--count": count, "--around-light": around_light}, "a lens", apart)
        project = _project(subject, fstop, coating, zoom, focus, size or (36.0, 24.0), spectrum, light_diameter)
        flares = lens_flares(project, quality or "final", threads)
    _curves(flares, wanted, project if glare else None, threads, output, as_json, cache)


def _curves(
    flares: Flares,
    wanted: Wanted,
    glare_of: Project | None,
    threads: int | None,
    output: Path | None,
    as_json: bool,
    cache: Path | None,
) -> None:
    """Predict the curves of one camera and tell them."""
    from ..predict.occurrence import occurrence_data, predict_occurrence
    from ..predict.occurrence_page import occurrence_page

    reach = flares.sampled.reach_deg
    if wanted.to_deg is not None and not flares.sampled.least_deg < wanted.to_deg <= reach:
        raise ProjectError(
            f"--to {wanted.to_deg:g} is beyond what this flare knows; choose degrees above "
            f"{flares.sampled.least_deg:g} and up to {reach:g}"
        )
    with progress_bar() as told, remembered(cache, output) as memory:
        found = predict_occurrence(flares, wanted, told, memory)
    if glare_of is not None:
        found = replace(found, glare=_glare(glare_of, threads))
    tell(dict.fromkeys(found.flare.remarks))
    if output is not None:
        write_text(output, occurrence_page(found))
    if as_json:
        print_json({**occurrence_data(found), **({} if output is None else {"report": str(output)})})
        return
    _print(found)
    if output is not None:
        tell([f"wrote {output}"])


def _refuse(flags: dict[str, Any], what: str, why: str) -> None:
    """Refuse flags that mean nothing here, instead of passing over them."""
    for flag, value in flags.items():
        if value is not None:
            raise ProjectError(f"{flag} has no meaning for {what}: {why}; leave {flag} out")


def _scene_wishes(wishes: SceneWishes, searched: float | None) -> SceneWishes:
    for flag, value, least in (
        ("--radius", wishes.radius_m, 1e-6), ("--height", wishes.height_m, 0.0),
        ("--shortest-shot", wishes.shortest_shot_s, 0.0),
    ):  # fmt: skip
        if not least <= value < 1e6:
            raise ProjectError(f"{flag} {value:g} is out of range; give a number of {'s' if 'shot' in flag else 'm'} "
                               f"{'of at least' if least == 0.0 else 'above'} 0")  # fmt: skip
    if wishes.near is None and searched:
        raise ProjectError("--radius and --height say how far to look for a position; add --near CAMERA")
    return wishes


def _wanted(
    to: float | None, roll: float | None, tolerance: float | None, samples: int | None, check: int | None,
    bins: int | None, setting: Setting, output: Path | None,
) -> Wanted:  # fmt: skip
    from ..predict.occurrence import Wanted

    if roll is not None and not (math.isfinite(roll) and abs(roll) <= 360.0):
        raise ProjectError(f"--roll {roll:g} is no direction; choose degrees between -360 and 360")
    if tolerance is not None and not 1e-4 <= tolerance <= 1.0:
        raise ProjectError(f"--tolerance {tolerance:g} is no error to end at; choose between 0.0001 and 1")
    if to is not None and not (math.isfinite(to) and to > 0.0):
        raise ProjectError(f"--to {to:g} is no constellation; choose degrees above 0")
    given = {"to_deg": to, "roll_deg": roll, "tolerance": tolerance, "samples": samples, "checks": check, "bins": bins}
    known: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    return Wanted(setting=setting, pictures=output is not None, **known)


def _sensor(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    from ..model.camera import predicted_sensor

    width, height = pair(text, "--sensor", "36x24 (mm)", "x")
    try:
        return predicted_sensor((width, height))
    except ValueError as error:
        raise ProjectError(f"--sensor {text!r}: {error}") from None


def _setting(illuminance: float | None, luminance: str | None) -> Setting:
    from ..predict.occurrence import Setting

    illuminance = 1e5 if illuminance is None else illuminance
    if not 0.0 < illuminance <= 1e9:
        raise ProjectError(f"--illuminance {illuminance:g} is no illuminance; give lux above 0, 1e5 for the sun")
    if luminance is None:
        return Setting(illuminance)
    low, high = pair(luminance, "--luminance", "50,5000 (cd/m², darkest and brightest)")
    if not 0.0 <= low < high:
        raise ProjectError(f"--luminance {luminance!r}: give the darkest first, at least 0, then the brightest")
    return Setting(illuminance, (low, high))


def _project(
    lens: str, fstop: float | None, coating: str | None, zoom: str | None, focus: float | None,
    sensor: tuple[float, float], spectrum: str | None, light_diameter: float | None,
) -> Project:  # fmt: skip
    """Return a project of what the flags say, its light on the axis."""
    from pydantic import ValidationError

    from ..io.coating_text import parse_coating_choice
    from ..io.project_file import explain
    from ..io.spectrum_text import parse_spectrum
    from ..model import Project
    from .render_flags import in_flags

    width, height = sensor
    size_px = (SHOWN_PX, round(SHOWN_PX * height / width))
    light = {
        "field_deg": (0.0, 0.0), "spectrum": parse_spectrum(spectrum or "d65"), "diameter_deg": light_diameter or 0.0
    }  # fmt: skip
    fields: dict[str, Any] = {
        "lens": lens, "f_number": fstop, "coating": parse_coating_choice(coating or "lens"), "zoom": zoom,
        "lights": (light,),
        "camera": {"size_px": size_px, "sensor_mm": (width, height), "focus_distance": focus},
    }  # fmt: skip
    try:
        return Project.model_validate(fields)
    except ValidationError as error:
        raise ProjectError(in_flags(explain(error, fields)[0])) from None


def _glare(project: Project, threads: int | None) -> VeilingGlare:
    from ..optics.paraxial import D_LINE_NM
    from ..render.glare import veiling_glare

    return veiling_glare(project, D_LINE_NM, threads=threads)


def _print(found: Occurrence) -> None:
    """Print the extremes of the curves."""
    from rich.table import Table

    from ..predict.occurrence import occurrence_data
    from ..predict.occurrence_page import WORDS
    from ..render.chart import number

    data = occurrence_data(found)
    out = Table(
        title=f"{found.flare.name} · {found.flare.aperture} · {found.frame.width:g}x{found.frame.height:g} mm",
        caption=f"{found.flare.unit.capitalize()}; {found.flare.left_out}.",
    )
    out.add_column("estimator")
    for column in ("least", "at degrees", "most", "at degrees"):
        out.add_column(column, justify="right")
    for name, one in data["statistics"].items():
        cells = [number(one["least"]["value"]), number(one["least"]["constellation_deg"])]
        cells += [number(one["most"]["value"]), number(one["most"]["constellation_deg"])]
        out.add_row(WORDS[name], *cells)
    console().print(out)
    if not math.isfinite(found.flare.scene_scale):
        return
    veil = number(max(data["veil_cd_m2"]))
    light = f"a light of {number(found.setting.illuminance_lx)} lx" if found.flare.per_lux else "the captures' light"
    console().print(f"{light} lights the sensor, on average, as much as a scene of {veil} cd/m² at worst")
    if "k_ratio" in data:
        console().print(f"it leaves at least {min(data['k_ratio']):.1%} of the scene's contrast")
    if found.glare is not None:
        console().print(f"veiling glare index {found.glare.index:.3%} at {found.glare.wavelength_nm:g} nm")
