"""`flarewright predict`: how much flare there will be."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ProjectError
from .common import check_place, console, pair, print_json, progress_bar, tell

if TYPE_CHECKING:
    from ..model import Project
    from ..predict.occurrence import Flares, Occurrence, Setting
    from ..render.glare import VeilingGlare

EPILOG = (
    "Examples:\n\nflarewright predict heliar-tronnier -o heliar.html\n\n"
    "flarewright predict canon-28-80 --fstop 8 --coating preset:staggered --sensor 36x24 --luminance 50,5000 "
    "-o canon.html --json"
)


def predict(
    lens: Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens (flarewright lenses) or a lens file.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="REPORT.html", help="Write a report to look at.")
    ] = None,
    fstop: Annotated[float | None, typer.Option(help="f-number; wide open when left out.")] = None,
    coating: Annotated[
        str, typer.Option(help="lens, none, preset:NAME, quarter-wave:NM or what `render` takes besides.")
    ] = "lens",
    zoom: Annotated[
        str | None, typer.Option(metavar="MM|NAME", help="Focal length, or a position of the lens file.")
    ] = None,
    focus: Annotated[float | None, typer.Option(help="Plane in focus, mm; infinity when left out.")] = None,
    sensor: Annotated[str, typer.Option(metavar="WxH", help="Sensor in mm.")] = "36x24",
    spectrum: Annotated[str, typer.Option(help="Of the light: d65, black-body:K or what `render` takes.")] = "d65",
    light_diameter: Annotated[float, typer.Option(help="Degrees across the light's disc, 0.53 for the sun.")] = 0.0,
    roll: Annotated[float, typer.Option(help="Direction of the light around the axis, degrees from the right.")] = 0.0,
    to: Annotated[float | None, typer.Option(help="Largest constellation, degrees; 85 when left out.")] = None,
    bins: Annotated[int, typer.Option(min=2, max=20, help="Bins between the extremes of a curve.")] = 5,
    illuminance: Annotated[float, typer.Option(help="Of the light on a plane facing it, lx; the sun gives 1e5.")] = 1e5,
    luminance: Annotated[
        str | None, typer.Option(metavar="MIN,MAX", help="Darkest and brightest of the scene, cd/m²: tells contrast.")
    ] = None,
    quality: Annotated[
        str, typer.Option(help="final: traced rays; draft: matrices, quick but dark beyond the field of view.")
    ] = "final",
    tolerance: Annotated[float, typer.Option(help="Error of the curves between samples.")] = 0.03,
    samples: Annotated[int, typer.Option(min=5, max=2000, help="Constellations to draw at most.")] = 48,
    check: Annotated[int, typer.Option(min=0, max=100, help="Final renders to compare the curves with.")] = 4,
    glare: Annotated[bool, typer.Option("--glare", help="Also tell the veiling glare index.")] = False,
    threads: Annotated[int | None, typer.Option(min=1, help="All cores when left out.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Tell how much flare a light makes wherever it stands: curves over the angle between camera and light.

    The curves hold sum, mean, maximum and log-average of the flare in the picture, without the light's own image.
    """
    if output is not None:
        check_place(output, ".html")
    project = _project(lens, fstop, coating, zoom, focus, sensor, spectrum, light_diameter)
    if quality not in ("draft", "final"):
        raise ProjectError(f"--quality {quality!r} is unknown here; choose draft or final")
    if to is not None and not 0.0 < to <= 85.0:
        raise ProjectError(f"--to {to:g} is no constellation of a lens; choose degrees above 0 and up to 85")
    if not (math.isfinite(roll) and abs(roll) <= 360.0):
        raise ProjectError(f"--roll {roll:g} is no direction; choose degrees between -360 and 360")
    if not 1e-4 <= tolerance <= 1.0:
        raise ProjectError(f"--tolerance {tolerance:g} is no error to end at; choose between 0.0001 and 1")
    from ..predict.occurrence import Wanted, predict_occurrence

    wanted = Wanted(to, roll, tolerance, samples, check, bins, _setting(illuminance, luminance), output is not None)
    flares = _lens_flares(project, quality, threads)
    with progress_bar() as told:
        found = predict_occurrence(flares, wanted, told)
    if glare:
        found = replace(found, glare=_glare(project, threads))
    tell(dict.fromkeys(found.flare.remarks))
    files = {} if output is None else {"report": str(output)}
    if output is not None:
        from ..predict.occurrence_page import occurrence_page

        write_page(output, occurrence_page(found))
    if as_json:
        from ..predict.occurrence import occurrence_data

        print_json({**occurrence_data(found), **files})
        return
    _print(found)
    tell(f"wrote {name}" for name in files.values())


def write_page(output: Path, text: str) -> None:
    """Write a report, whole or not at all."""
    from ..io.atomic import write_atomically

    def write(temporary: Path) -> None:
        temporary.write_text(text, "utf-8")

    write_atomically(output, write)


def _setting(illuminance: float, luminance: str | None) -> Setting:
    from ..predict.occurrence import Setting

    if not 0.0 < illuminance <= 1e9:
        raise ProjectError(f"--illuminance {illuminance:g} is no illuminance; give lux above 0, 1e5 for the sun")
    if luminance is None:
        return Setting(illuminance)
    low, high = pair(luminance, "--luminance", "50,5000 (cd/m², darkest and brightest)")
    if not 0.0 <= low < high:
        raise ProjectError(f"--luminance {luminance!r}: give the darkest first, at least 0, then the brightest")
    return Setting(illuminance, (low, high))


def _project(
    lens: str, fstop: float | None, coating: str, zoom: str | None, focus: float | None, sensor: str, spectrum: str,
    light_diameter: float,
) -> Project:  # fmt: skip
    """Return a project of what the flags say, its light on the axis."""
    from pydantic import ValidationError

    from ..io.project_file import explain, parse_coating_choice
    from ..io.spectrum_text import parse_spectrum
    from ..model import Project
    from .render_flags import in_flags

    width, height = pair(sensor, "--sensor", "36x24 (mm)", "x")
    if min(width, height) <= 0.0:
        raise ProjectError(f"--sensor {sensor!r}: a sensor has a width and a height above 0 mm")
    size_px = (240, max(1, min(round(240.0 * height / width), 2400)))
    light = {"field_deg": (0.0, 0.0), "spectrum": parse_spectrum(spectrum), "diameter_deg": light_diameter}
    fields: dict[str, Any] = {
        "lens": lens, "f_number": fstop, "coating": parse_coating_choice(coating), "zoom": zoom, "lights": (light,),
        "camera": {"size_px": size_px, "sensor_mm": (width, height), "focus_distance": focus},
    }  # fmt: skip
    try:
        return Project.model_validate(fields)
    except ValidationError as error:
        raise ProjectError(in_flags(explain(error, fields)[0])) from None


def _lens_flares(project: Project, quality: str, threads: int | None) -> Flares:
    """Return the flare of a lens as it is sampled, judged and shown."""
    from ..predict.lens_flare import lens_flare, square_flare, statistics_quality
    from ..predict.occurrence import Flares
    from ..render.first_run import compile_for_render

    final = project.replace(quality={"mode": "final"})
    compile_for_render(final, threads)
    sampled, frame = square_flare(project, statistics_quality(quality), threads=threads)
    judge, _ = square_flare(project, final.quality, threads=threads)
    return Flares(sampled, frame, quality, judge, lens_flare(final, threads=threads))


def _glare(project: Project, threads: int | None) -> VeilingGlare:
    from ..optics.paraxial import D_LINE_NM
    from ..render.glare import veiling_glare

    return veiling_glare(project, D_LINE_NM, threads=threads)


def _print(found: Occurrence) -> None:
    """Print the extremes of the curves."""
    from rich.table import Table

    from ..predict.chart import number
    from ..predict.occurrence import occurrence_data
    from ..predict.occurrence_page import WORDS

    data = occurrence_data(found)
    out = Table(
        title=f"{found.flare.name} · f/{found.flare.f_number:.3g} · {found.frame.width:g}x{found.frame.height:g} mm",
        caption="Irradiance on the sensor over the light's illuminance; the light's own image is left out.",
    )
    out.add_column("estimator")
    for column in ("least", "at degrees", "most", "at degrees"):
        out.add_column(column, justify="right")
    for name, one in data["statistics"].items():
        cells = [number(one["least"]["value"]), number(one["least"]["constellation_deg"])]
        cells += [number(one["most"]["value"]), number(one["most"]["constellation_deg"])]
        out.add_row(WORDS[name], *cells)
    console().print(out)
    lux, veil = number(found.setting.illuminance_lx), number(max(data["veil_cd_m2"]))
    console().print(f"a light of {lux} lx lights the sensor, on average, as much as a scene of {veil} cd/m² at worst")
    if "k_ratio" in data:
        console().print(f"it leaves at least {min(data['k_ratio']):.1%} of the scene's contrast")
    if found.glare is not None:
        console().print(f"veiling glare index {found.glare.index:.3%} at {found.glare.wavelength_nm:g} nm")
