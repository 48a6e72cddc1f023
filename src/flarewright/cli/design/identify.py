"""`flarewright design identify`: numbers of a prescription that ghosts determine."""

from __future__ import annotations

from math import hypot, radians, tan
from typing import Annotated

import typer

from ...errors import ProjectError
from ..common import chosen_fstop, field_angles, print_json, print_remarks
from ..shared_options import FNumber, Json, KnownLens

EPILOG = "Example:\n\nflarewright design identify heliar-tronnier --light 5,5 --fstop 16 --brightness"


def identify(
    lens: KnownLens,
    light: Annotated[
        list[str], typer.Option(metavar="X,Y", help="Field angles of a measured light, degrees; may be repeated.")
    ],
    fstop: FNumber = None,
    brightness: Annotated[
        bool, typer.Option("--brightness", help="Irradiances are measured too (bare glass).")
    ] = False,
    stop_known: Annotated[bool, typer.Option("--stop-known", help="The stop's diameter is known.")] = False,
    entrance: Annotated[float, typer.Option(help="Diameter of the entrance, mm.")] = 100.0,
    as_json: Json = False,
) -> None:
    """List the numbers of a prescription that ghosts determine, and further measurements for the others."""
    slopes = [hypot(*(tan(radians(angle)) for angle in field_angles(text))) for text in light]
    if not all(slopes):
        raise ProjectError("a light on the axis puts every ghost at its middle; move the light off it")
    if not 0.0 < entrance < 1e6:
        raise ProjectError(f"--entrance {entrance:g} is no diameter; give millimetres above 0")
    f_number = chosen_fstop(fstop)
    import numpy as np

    from ...design.problem.prescription import structure_of, vector_of
    from ...design.results.identify import Identification
    from ...design.results.identify import identify as analyse
    from ...optics.lens.paraxial import first_order
    from ...render.scene.resolve import check_opens, open_lens

    opened = open_lens(lens)
    known = opened.lens
    check_opens(known, f_number)
    order = first_order(known, f_number)
    structure = structure_of(known)
    vector = vector_of(known, 2.0 * order.stop_semi_diameter, order.sensor_distance)

    def analysed(brightness_known: bool) -> Identification:
        return analyse(
            structure, vector, np.array(slopes), entrance=entrance, brightness=brightness_known, stop_known=stop_known
        )

    found = analysed(brightness)
    brighter = found if brightness else analysed(True)
    print_remarks(opened.remarks)
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
    print(f"to fix the others, measure: {', '.join(found.remedies)}")
    if brighter.rank > found.rank:
        print(f"or measure the brightness of ghosts (bare glass): {brighter.rank} of {found.unknowns} numbers then")
