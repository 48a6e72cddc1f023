"""`flarewright lens show`: a prescription as a table, as JSON and as a drawing."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...errors import ProjectError
from ..common import check_place, chosen_fstop, console, field_angles, print_json, print_remarks, write_text
from ..shared_options import FNumber, Json, Zoom

if TYPE_CHECKING:
    from ...model import Lens, Surface
    from ...optics.lens.paraxial import FirstOrder

LIMITS_NM = (100.0, 20000.0)

EPILOG = (
    "Examples:\n\nflarewright lens show tessar-brendel\n\n"
    "flarewright lens show canon-28-80 --plot canon.svg --light 0,12 --ghost 7-2"
)


def show(
    lens: Annotated[str, typer.Argument(metavar="NAME|FILE", help="A shipped lens or a lens file.")],
    plot: Annotated[Path | None, typer.Option(metavar="OUT.svg", help="Draw the cross-section.")] = None,
    light: Annotated[
        str | None, typer.Option(metavar="X,Y", help="Draw the rays of this light in addition to those on the axis.")
    ] = None,
    ghost: Annotated[
        str | None, typer.Option(metavar="J-I", help="Draw the rays of this ghost path; sensor-I too.")
    ] = None,
    zoom: Zoom = None,
    fstop: FNumber = None,
    wavelength: Annotated[
        float | None, typer.Option(metavar="NM", help="Wavelength of focal length, pupils and focus (default: 587.56).")
    ] = None,
    as_json: Json = False,
) -> None:
    """Show a lens: rows, focal length, pupils and sensor; with --plot also a drawing."""
    angles = field_angles(light) if light is not None else None
    mirrors = _mirrors(ghost) if ghost is not None else None
    f_number = chosen_fstop(fstop)
    if plot is not None:
        check_place(plot, ".svg")
    elif light is not None or ghost is not None:
        flag = "--light" if light is not None else "--ghost"
        raise ProjectError(f"{flag} chooses rays of a drawing: add --plot OUT.svg")

    from ...optics.lens.paraxial import first_order
    from ...render.scene.resolve import build, check_opens, open_lens

    opened = open_lens(lens)
    prescription, remarks = build(opened.lens, zoom=zoom).lens, list(opened.remarks)
    check_opens(prescription, f_number)
    order = first_order(prescription, f_number)
    if wavelength is not None:
        order = _order_at(prescription, f_number, wavelength)
        remarks.append(f"focal length, pupils and focus are those at {wavelength:g} nm")
    if plot is not None:
        from ...render.plots.cross_section import cross_section

        ghost_rows = None
        if mirrors is not None:
            ghost_rows = (len(prescription.rows) if mirrors[0] is None else mirrors[0], mirrors[1])
        picture = cross_section(prescription, order, field_deg=angles, ghost=ghost_rows)
        remarks += picture.remarks
        write_text(plot, picture.svg)
    print_remarks(remarks)
    data = as_data(prescription, order)
    if as_json:
        print_json({**data, "remarks": remarks})
    else:
        _print(data)
        print_remarks([] if plot is None else [f"wrote {plot}"])


def _order_at(lens: Lens, f_number: float | None, wavelength_nm: float) -> FirstOrder:
    """Return the first-order numbers at another wavelength than the d line."""
    from ...optics.lens.paraxial import first_order

    low, high = LIMITS_NM
    if not low <= wavelength_nm <= high:
        raise ProjectError(f"--wavelength {wavelength_nm:g} is not between {low:g} and {high:g} nm")
    return first_order(lens, f_number, wavelength_nm=wavelength_nm)


def _mirrors(text: str) -> tuple[int | None, int]:
    """Read a path's name; None is the sensor."""
    match = re.fullmatch(r"\s*(\d+|sensor)\s*-\s*(\d+)\s*", text, re.IGNORECASE)
    if not match:
        raise ProjectError(
            f"--ghost {text!r} is no ghost path; write J-I, the rows of its two reflections, 4-1 say, or sensor-I"
        )
    return None if match[1].lower() == "sensor" else int(match[1]), int(match[2])


def _radius_mm(curvature: float) -> float | None:
    """Return a radius as in the lens file; None for a plane."""
    from ...io.lens.lens_writer import shortest_radius

    return (shortest_radius(curvature) or 1.0 / curvature) if curvature else None


def as_data(lens: Lens, order: FirstOrder) -> dict[str, Any]:
    """Return a lens as the JSON that `--json` prints."""
    from ...io.lens.coating_text import format_coating
    from ...model import Surface
    from ...optics.rays.pack import preset_names

    rows: list[dict[str, Any]] = []
    for k, row in enumerate(lens.rows):
        if not isinstance(row, Surface):
            rows.append(
                {"row": k, "stop": True, "radius_mm": None, "curvature": 0.0, "conic": 0.0, "thickness": row.thickness}
                | {"n_d": None, "v_d": None, "glass": None, "semi_diameter": order.stop_semi_diameter}
                | {"semi_diameter_estimated": False, "coating": None, "radius_x_mm": None, "shape": None}
            )
            continue
        medium = row.medium
        rows.append(
            {
                "row": k,
                "stop": False,
                "radius_mm": _radius_mm(row.curvature),
                "curvature": row.curvature,
                "conic": row.conic,
                "radius_x_mm": _radius_mm(row.meridian_x[0]) if row.toroidal else None,
                "shape": _shape(row),
                "thickness": row.thickness,
                "n_d": medium.n_d if medium else None,
                "v_d": medium.v_d if medium else None,
                "glass": medium.glass if medium else None,
                "semi_diameter": row.semi_diameter,
                "semi_diameter_estimated": row.semi_diameter_estimated,
                "coating": format_coating(row.coating) if row.coating else None,
            }
        )
    return {
        "name": lens.name,
        "source": lens.source,
        "notes": lens.notes,
        "efl_mm": order.efl,
        "bfl_mm": order.bfl,
        "efl_x_mm": order.efl_x,
        "bfl_x_mm": order.bfl_x,
        "f_number": order.f_number,
        "field_deg": lens.field_deg,
        "entrance_pupil_diameter_mm": order.entrance_pupil_diameter,
        "entrance_pupil_z_mm": order.entrance_pupil_z,
        "exit_pupil_diameter_mm": order.exit_pupil_diameter,
        "exit_pupil_z_mm": order.exit_pupil_z,
        "stop_semi_diameter_mm": order.stop_semi_diameter,
        "sensor_distance_mm": order.sensor_distance,
        "blades": lens.iris.blades,
        "positions": [position.name for position in lens.positions],
        "squeeze": lens.squeeze,
        "elements": [element.model_dump(mode="json") for element in lens.elements],
        "coating_presets": sorted(preset_names(lens)),
        "rows": rows,
    }


def _shape(row: Surface) -> str | None:
    """Describe how a surface differs from a centred conic; None if it does not."""
    words = []
    if row.toroidal:
        curvature, conic = row.meridian_x
        radius = "flat" if curvature == 0.0 else f"{1.0 / curvature:.3f}"
        form = ", a torus" if row.torus else ""
        words.append(f"{radius} across" + (f", conic {conic:g}" if conic else form))
    words += [f"A{4 + 2 * k} {term:g}" for k, term in enumerate(row.asphere) if term]
    words += [f"A{3 + 2 * k} {term:g}" for k, term in enumerate(row.odd_asphere) if term]
    if any(row.decentre or ()):
        words.append("decentred {:g}, {:g}".format(*(row.decentre or ())))
    if any(row.tilt_deg or ()):
        words.append("tilted {:g}, {:g} degrees".format(*(row.tilt_deg or ())))
    if row.figure is not None:
        rms = sum(value**2 for _, value in row.figure.zernike_nm) ** 0.5
        words += [f"figure {rms:.3g} nm rms"] if rms else []
        words += [f"figure image, {row.figure.peak_valley_nm:g} nm"] if row.figure.image else []
    return "; ".join(words) or None


def _across(data: dict[str, Any]) -> str:
    """Return the focal lengths in the x-z plane if they differ."""
    if data["efl_x_mm"] is None:
        return ""
    return f"; in the x-z plane {data['efl_x_mm']:.3f} and {data['bfl_x_mm']:.3f}"


def _print(data: dict[str, Any]) -> None:
    from rich.table import Table

    out = Table(
        title=f"{data['name']} · f/{data['f_number']:g}",
        caption="Lengths in mm; the glass follows the row; ~ marks an estimated semi-diameter.",
    )
    out.add_column("row", justify="right")
    for column in ("radius", "conic", "thickness", "n_d", "v_d", "semi-diameter"):
        out.add_column(column, justify="right", no_wrap=True)
    shaped = any(row["shape"] for row in data["rows"])
    out.add_column("glass", no_wrap=True)
    out.add_column("coating")
    if shaped:
        out.add_column("shape")
    for row in data["rows"]:
        radius = "stop" if row["stop"] else "flat" if row["radius_mm"] is None else f"{row['radius_mm']:.3f}"
        semi = "-" if row["semi_diameter"] is None else f"{row['semi_diameter']:.2f}"
        out.add_row(
            str(row["row"]),
            radius,
            f"{row['conic']:g}" if row["conic"] else "",
            f"{row['thickness']:.3f}",
            "" if row["n_d"] is None else f"{row['n_d']:.5f}",
            "" if row["v_d"] is None else f"{row['v_d']:.2f}",
            f"~{semi}" if row["semi_diameter_estimated"] else semi,
            row["glass"] or "",
            row["coating"] or "",
            *([row["shape"] or ""] if shaped else []),
        )
    terminal = console()
    terminal.print(out)
    terminal.print(
        f"focal length {data['efl_mm']:.3f}, back focus {data['bfl_mm']:.3f}{_across(data)}, "
        f"sensor {data['sensor_distance_mm']:.3f} behind the last vertex\n"
        f"entrance pupil {data['entrance_pupil_diameter_mm']:.3f} wide at z = {data['entrance_pupil_z_mm']:.3f}, "
        f"exit pupil {data['exit_pupil_diameter_mm']:.3f} wide at z = {data['exit_pupil_z_mm']:.3f} "
        "(z from the first vertex)"
    )
    if data["squeeze"]:
        terminal.print(f"anamorphic: squeezes the picture across by {data['squeeze']:g}")
    if data["positions"]:
        terminal.print(f"positions (--zoom): {', '.join(data['positions'])}, or a focal length between them")
    for element in data["elements"]:
        terminal.print(
            "element of rows {}-{}: decentred {:g}, {:g} mm, tilted {:g}, {:g} degrees".format(
                *element["rows"], *element["decentre"], *element["tilt_deg"]
            )
        )
    for key in ("source", "notes"):
        if data[key]:
            terminal.print(f"{key}: {data[key]}")
    if data["coating_presets"]:
        terminal.print(f"coating presets: {', '.join(data['coating_presets'])}")
