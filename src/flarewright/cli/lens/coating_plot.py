"""`flarewright coating plot`: reflectance of a coating, as a drawing, a table or JSON."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import ProjectError
from ..common import check_place, console, print_json, print_remarks
from ..shared_options import Json, output_option

if TYPE_CHECKING:
    from ...model import Coating
    from ...optics.coatings.response import CoatingResponse

EPILOG = (
    "Examples:\n\nflarewright coating plot modern-broadband -o modern.svg\n\n"
    "flarewright coating plot quarter-wave:550 --glass N-SF6 -o quarter.png\n\n"
    "flarewright coating plot stack:1.38:99,2.05:130 --glass 1.7 --json"
)


def plot(
    coating: Annotated[
        str,
        typer.Argument(
            metavar="COATING", help="none, quarter-wave:NM, film:N:NM, stack:N:NM,... or a standard coating's name."
        ),
    ],
    glass: Annotated[
        str, typer.Option(metavar="NAME|N", help="Catalogue glass, or an index for all wavelengths.")
    ] = "N-BK7",
    output: Annotated[Path | None, output_option(metavar="OUT.svg|png", help="Draw the curves into this file.")] = None,
    as_json: Json = False,
) -> None:
    """Print the reflectance of a coated glass surface in air, by wavelength and angle, and its colour."""
    from ...io.lens.coating_text import parse_coating

    chosen = parse_coating(coating)
    if output is not None:
        check_place(output, (".svg", ".png"))
    from ...optics.coatings.response import coating_response
    from ...render.plots.coating_plot import PLOT_ANGLES_DEG

    name, n_d, n_glass = _glass(glass)
    curves = coating_response(chosen, n_d, n_glass, PLOT_ANGLES_DEG)
    if output is not None:
        _draw(output, chosen, curves, (name, n_d, n_glass))
        print_remarks([f"wrote {output}"])
    if as_json:
        print_json(curve_data(chosen, curves, name, n_d))
    elif output is None:
        _print(chosen, curves, name)


def _glass(text: str) -> tuple[str, float, Any]:
    """Return name, n_d and the indices at the plotted wavelengths of a glass."""
    from ...io.lens.glass_catalogue import by_name
    from ...model import Medium
    from ...optics.coatings.response import WAVELENGTHS_NM
    from ...optics.lens.dispersion import refractive_index

    try:
        n = float(text)
    except ValueError:
        known = by_name(text)
        medium = Medium(glass=known.name, n_d=known.n_d, v_d=known.v_d, dispersion=known.dispersion)
        return known.full_name, known.n_d, refractive_index(medium, WAVELENGTHS_NM)
    # NaN fails this comparison too
    if not 1.0 < n <= 4.0:
        raise ProjectError(f"--glass {text} is no index of a glass; give a number above 1 and up to 4, or a name")
    return f"n = {n:g}", n, n


def _draw(output: Path, coating: Coating, curves: CoatingResponse, glass: tuple[str, float, Any]) -> None:
    from ... import __version__
    from ...io.lens.coating_text import format_coating
    from ...optics.coatings.response import coating_response
    from ...render.plots.coating_plot import STRIP_ANGLES_DEG, coating_figure
    from ...render.plots.svg import write_figure

    name, n_d, n_glass = glass
    strip = coating_response(coating, n_d, n_glass, STRIP_ANGLES_DEG)
    bare = coating_response(None, n_d, n_glass, 0.0)
    figure = coating_figure(curves, strip, float(bare.luminous_reflectance[0]), format_coating(coating), name)
    write_figure(output, figure, f"Flarewright {__version__}")


def curve_data(coating: Coating, curves: CoatingResponse, glass: str, n_d: float) -> dict[str, Any]:
    """Return a coating's response as the JSON that `--json` prints."""
    from ...io.lens.coating_text import format_coating

    return {
        "coating": format_coating(coating),
        "glass": glass,
        "n_d": n_d,
        "films": [{"index": film.index, "thickness_nm": film.thickness_nm} for film in curves.films],
        "wavelengths_nm": curves.wavelengths_nm.tolist(),
        "angles": [
            {
                "angle_deg": float(angle),
                "mean_reflectance": float(mean),
                "luminous_reflectance": float(luminous),
                "rgb": rgb.tolist(),
                "reflectance": row.tolist(),
            }
            for angle, mean, luminous, rgb, row in zip(
                curves.angles_deg, curves.mean_reflectance, curves.luminous_reflectance, curves.rgb,
                curves.reflectance, strict=True,
            )
        ],
    }  # fmt: skip


def _print(coating: Coating, curves: CoatingResponse, glass: str) -> None:
    from rich.table import Table

    from ...io.lens.coating_text import format_coating

    shown_nm = (420.0, 450.0, 500.0, 550.0, 600.0, 650.0, 680.0)
    out = Table(
        title=f"{format_coating(coating)} on {glass}",
        caption="Reflectance in percent: mean over 420 to 680 nm, luminous for daylight, and at wavelengths in nm.",
    )
    out.add_column("angle", justify="right", no_wrap=True)
    for column in ("mean", "luminous", *(f"{nm:.0f}" for nm in shown_nm)):
        out.add_column(column, justify="right", no_wrap=True)
    at = [int(abs(curves.wavelengths_nm - nm).argmin()) for nm in shown_nm]
    for k, angle in enumerate(curves.angles_deg):
        numbers = [curves.mean_reflectance[k], curves.luminous_reflectance[k], *curves.reflectance[k, at]]
        out.add_row(f"{angle:g}", *(f"{100.0 * number:.3f}" for number in numbers))
    terminal = console()
    terminal.print(out)
    films = ", ".join(f"n {film.index:.4g} {film.thickness_nm:.1f} nm" for film in curves.films)
    terminal.print(f"films from air: {films or 'none'}")
