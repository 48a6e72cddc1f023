"""`flarewright predict`: predict the amount of flare."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import ProjectError
from ...workflow.defaults import SHOWN_PX
from ..common import (
    check_place,
    console,
    one_bar,
    pair,
    print_json,
    print_remark,
    print_remarks,
    progress_bar,
    remembered,
    write_text,
)
from ..option_record import with_options
from ..render.kept_glare import kept_glare
from .options.record import PredictOptions
from .scene import is_scene_file, predict_and_print

if TYPE_CHECKING:
    from ...model import Project
    from ...predict.occurrence import Flares, Occurrence, Setting, Wanted
    from ...predict.pictures import Spread
    from ...render.scattering.veiling_glare import VeilingGlare

EPILOG = (
    "Examples:\n\nflarewright predict heliar-tronnier -o heliar.html\n\n"
    "flarewright predict canon-28-80 --fstop 8 --coating preset:staggered --sensor 36x24 --luminance 50,5000 "
    "-o canon.html --json\n\n"
    "flarewright predict match.toml --near 'east stand' --radius 10 -o match.html"
)

# options by what they are for
_OF_LENS = ("fstop", "coating", "zoom", "focus", "spectrum", "light_diameter")
_OF_CURVES = ("sensor", "roll", "to", "bins", "illuminance", "luminance", "tolerance", "samples", "check")
_OF_MODEL = ("unit_per_cd_m2", "count", "around_light")
_OF_SCENE = ("near", "radius", "height", "shortest_shot")


@with_options(PredictOptions)
def predict(options: PredictOptions) -> None:
    """Predict the amount of flare.

    For a lens or a measured flare: curves over the angle between camera and light, of sum, mean, maximum and
    log-average, without the light's image. For a scene: every light in every camera over time, ranked.
    """
    if options.output is not None:
        check_place(options.output, ".html")
    if options.cache is not None:
        check_place(options.cache, ".npz")
    if options.quality not in (None, "draft", "final"):
        raise ProjectError(f"--quality {options.quality!r} is unknown here; choose draft or final")
    from ...jobs.cluster.executor import workers_of

    workers_of(options.cluster, options.processes, options.threads)
    # any number of processes draws the same pictures
    unnamed = repr(replace(options, threads=None, processes=None, cluster=None))
    if is_scene_file(options.subject):
        _refuse(_given(options, _OF_LENS + _OF_MODEL + _OF_CURVES), "a scene", "the scene file sets it")
        _check_search(options)
        predict_and_print(Path(options.subject), options, unnamed)
        return
    _refuse(_given(options, _OF_SCENE), "a lens or a measured flare", "give a scene file")
    wanted = _wanted(options)
    from ...io.files.file_kind import is_ghost_model_file
    from ...workflow.flare_pictures import pictures_elsewhere

    size, folder = _sensor(options.sensor), Path() if options.output is None else options.output.parent
    measured = is_ghost_model_file(options.subject)
    with pictures_elsewhere(options.cluster, options.processes, options.threads, folder, print_remark) as spread:
        project, flares = (None, _of_model(options, size)) if measured else _of_lens(options, size or (36.0, 24.0))
        _curves(flares, wanted, project if options.glare else None, options, unnamed, spread)


def _given(options: PredictOptions, names: Sequence[str]) -> dict[str, Any]:
    """Return options by their words on the command line."""
    return {"--" + name.replace("_", "-"): getattr(options, name) for name in names}


def _of_model(options: PredictOptions, size: tuple[float, float] | None) -> Flares:
    """Read the flare of a measured model."""
    from ...workflow.measured_flares import Counting, model_flares

    measured = {**_given(options, (*_OF_LENS, "quality", "check")), "--glare": options.glare or None}
    _refuse(measured, "a measured flare", "it was measured")
    unit, luminance = options.unit_per_cd_m2, options.luminance
    if unit is not None and not 0.0 < unit < math.inf:
        raise ProjectError(f"--unit-per-cd-m2 {unit:g} is no unit; give a number above 0")
    if unit is None and luminance is not None:
        raise ProjectError(
            f"--luminance {luminance} has no effect without --unit-per-cd-m2: the brightness of a scene in a "
            "measured flare's captures is unknown"
        )
    whole = options.count == "ghosts"
    if whole:
        _refuse(_given(options, ("around_light",)), "--count ghosts", "ghosts count everywhere")
    flares = model_flares(options.subject, size, unit, Counting(whole, options.around_light))
    if not flares.sampled.per_lux:
        untold = "it lacks luminance_cd_m2 and solid_angle_sr of its captures' light (docs/measure.md)"
        _refuse(_given(options, ("illuminance",)), options.subject, untold)
    return flares


def _of_lens(options: PredictOptions, size: tuple[float, float]) -> tuple[Project, Flares]:
    """Build the project of a lens, and its flare."""
    from ...render.warmup import compile_for_render
    from ...workflow.lens_flares import lens_flares, shown_project

    _refuse(_given(options, ("unit_per_cd_m2",)), "a lens", "it follows from the glass")
    _refuse(_given(options, ("count", "around_light")), "a lens", "the light's image is separate from the flare")
    project = _project(options, size)
    compile_for_render(shown_project(project), options.threads)
    return project, lens_flares(project, options.quality or "final", options.threads)


def _curves(
    flares: Flares,
    wanted: Wanted,
    glare_of: Project | None,
    options: PredictOptions,
    unnamed: str,
    spread: Spread | None,
) -> None:
    """Predict the curves of one camera and print them."""
    from ...predict.occurrence import occurrence_data, predict_occurrence
    from ...predict.occurrence_page import occurrence_page

    reach = flares.sampled.reach_deg
    if wanted.to_deg is not None and not flares.sampled.least_deg < wanted.to_deg <= reach:
        raise ProjectError(
            f"--to {wanted.to_deg:g} is beyond the range of this flare; choose degrees above "
            f"{flares.sampled.least_deg:g} and up to {reach:g}"
        )
    output = options.output
    # pictures are kept until the page is written
    with remembered(options.cache, output, unnamed) as memory:
        with progress_bar() as progress:
            found = predict_occurrence(flares, wanted, progress, memory, spread)
        if glare_of is not None:
            found = replace(found, glare=_glare(glare_of, options.threads))
        print_remarks(dict.fromkeys(found.flare.remarks))
        if output is not None:
            write_text(output, occurrence_page(found))
    if options.as_json:
        print_json({**occurrence_data(found), **({} if output is None else {"report": str(output)})})
        return
    _print(found)
    if output is not None:
        print_remarks([f"wrote {output}"])


def _refuse(flags: dict[str, Any], what: str, why: str) -> None:
    """Raise an error for flags without meaning here, instead of ignoring them."""
    for flag, value in flags.items():
        if value is not None:
            raise ProjectError(f"{flag} has no meaning for {what}: {why}; omit {flag}")


def _check_search(options: PredictOptions) -> None:
    """Raise an error for limits of a search, or a time between switches of cameras, that are none."""
    for flag, value, least in (
        ("--radius", options.radius, 1e-6), ("--height", options.height, 0.0),
        ("--shortest-shot", options.shortest_shot, 0.0),
    ):  # fmt: skip
        if value is not None and not least <= value < 1e6:
            raise ProjectError(f"{flag} {value:g} is out of range; give a number of {'s' if 'shot' in flag else 'm'} "
                               f"{'of at least' if least == 0.0 else 'above'} 0")  # fmt: skip
    if options.near is None and (options.radius or options.height):
        raise ProjectError("--radius and --height limit the search for a position; add --near CAMERA")


def _wanted(options: PredictOptions) -> Wanted:
    from ...predict.occurrence import Wanted

    setting, to, roll, tolerance = _setting(options), options.to, options.roll, options.tolerance
    if roll is not None and not (math.isfinite(roll) and abs(roll) <= 360.0):
        raise ProjectError(f"--roll {roll:g} is no direction; choose degrees between -360 and 360")
    if tolerance is not None and not 1e-4 <= tolerance <= 1.0:
        raise ProjectError(f"--tolerance {tolerance:g} is out of range; choose between 0.0001 and 1")
    if to is not None and not (math.isfinite(to) and to > 0.0):
        raise ProjectError(f"--to {to:g} is no constellation; choose degrees above 0")
    given = {
        "to_deg": to, "roll_deg": roll, "tolerance": tolerance, "samples": options.samples, "checks": options.check,
        "bins": options.bins,
    }  # fmt: skip
    known: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    return Wanted(setting=setting, pictures=options.output is not None, **known)


def _sensor(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    from ...model.project.camera import checked_sensor_size

    width, height = pair(text, "--sensor", "36x24 (mm)", "x")
    try:
        return checked_sensor_size((width, height))
    except ValueError as error:
        raise ProjectError(f"--sensor {text!r}: {error}") from None


def _setting(options: PredictOptions) -> Setting:
    from ...predict.occurrence import Setting

    illuminance = 1e5 if options.illuminance is None else options.illuminance
    if not 0.0 < illuminance <= 1e9:
        raise ProjectError(f"--illuminance {illuminance:g} is no illuminance; give lux above 0, 1e5 for the sun")
    if options.luminance is None:
        return Setting(illuminance)
    low, high = pair(options.luminance, "--luminance", "50,5000 (cd/m², darkest and brightest)")
    if not 0.0 <= low < high:
        raise ProjectError(f"--luminance {options.luminance!r}: give the darkest first, at least 0, then the brightest")
    return Setting(illuminance, (low, high))


def _project(options: PredictOptions, sensor: tuple[float, float]) -> Project:
    """Return a project of the flags, with its light on the axis."""
    from ...io.lens.coating_text import parse_coating_choice
    from ...io.project.spectrum_text import parse_spectrum
    from ..render.project_flags import project_of

    width, height = sensor
    size_px = (SHOWN_PX, round(SHOWN_PX * height / width))
    light = {
        "field_deg": (0.0, 0.0), "spectrum": parse_spectrum(options.spectrum or "d65"),
        "diameter_deg": options.light_diameter or 0.0,
    }  # fmt: skip
    return project_of({
        "lens": options.subject, "f_number": options.fstop, "coating": parse_coating_choice(options.coating or "lens"),
        "zoom": options.zoom, "lights": (light,),
        "camera": {"size_px": size_px, "sensor_mm": (width, height), "focus_distance": options.focus},
    })  # fmt: skip


def _glare(project: Project, threads: int | None) -> VeilingGlare:
    from ...optics.lens.dispersion import D_LINE_NM

    with one_bar("veiling glare") as progress:
        return kept_glare(project, D_LINE_NM, threads=threads, progress=progress)


def _print(found: Occurrence) -> None:
    """Print the extremes of the curves."""
    from rich.table import Table

    from ...predict.occurrence import occurrence_data
    from ...predict.occurrence_page import WORDS
    from ...render.plots.chart import number

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
