"""`flarewright design identify`: what the ghosts of a lens tell of its prescription."""

from __future__ import annotations

from math import hypot, radians, tan
from typing import Annotated

import typer

from ..errors import ProjectError
from .common import chosen_fstop, field_angles, print_json, tell

EPILOG = "Example:\n\nflarewright design identify heliar-tronnier --light 5,5 --fstop 16 --brightness"


def identify(
    lens: Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens (flarewright lenses) or a lens file.")],
    light: Annotated[
        list[str], typer.Option(metavar="X,Y", help="Field angles of a measured light, degrees; may be repeated.")
    ],
    fstop: Annotated[float | None, typer.Option(help="f-number; wide open when left out.")] = None,
    brightness: Annotated[bool, typer.Option("--brightness", help="So is the irradiance (bare glass).")] = False,
    stop_known: Annotated[bool, typer.Option("--stop-known", help="The stop's diameter is known.")] = False,
    entrance: Annotated[float, typer.Option(help="Diameter of the entrance, mm.")] = 100.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Tell which numbers of a prescription places and sizes of ghosts fix, and what to measure besides."""
    slopes = [hypot(*(tan(radians(angle)) for angle in field_angles(text))) for text in light]
    if not all(slopes):
        raise ProjectError("a light on the axis puts every ghost at its middle; move the light off it")
    if not 0.0 < entrance < 1e6:
        raise ProjectError(f"--entrance {entrance:g} is no diameter; give millimetres above 0")
    f_number = chosen_fstop(fstop)
    import numpy as np

    from ..design.identify import Identification
    from ..design.identify import identify as analyse
    from ..design.prescription import structure_of, vector_of
    from ..render.prepare import first_order, load_lens

    remarks: list[str] = []
    known = load_lens(lens, remarks=remarks)
    order = first_order(known, f_number)
    structure = structure_of(known)
    vector = vector_of(known, 2.0 * order.stop_semi_diameter, order.sensor_distance)

    def analysed(told: bool) -> Identification:
        return analyse(structure, vector, np.array(slopes), entrance=entrance, brightness=told, stop_known=stop_known)

    found = analysed(brightness)
    brighter = found if brightness else analysed(True)
    tell(remarks)
    if as_json:
        print_json({
            "rank": found.rank, "unknowns": found.unknowns, "fixed": list(found.fixed), "free": list(found.free),
            "remedies": list(found.remedies), "singular_values": found.singular_values.tolist(),
            "rank_with_brightness": brighter.rank,
        })  # fmt: skip
        return
    print(f"{known.name}: {len(structure.pairs)} ghosts fix {found.rank} of {found.unknowns} numbers")
    if found.rank == found.unknowns:
        print("near this lens no other has the same ghosts")
        return
    print(f"fixed: {', '.join(found.fixed) or 'no single one'}")
    print(f"free to change together: {', '.join(found.free)}")
    print(f"to fix the rest, measure: {', '.join(found.remedies)}")
    if brighter.rank > found.rank:
        print(f"or measure how bright the ghosts are (bare glass): {brighter.rank} of {found.unknowns} numbers then")
