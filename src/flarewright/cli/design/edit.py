"""`flarewright design resize` and `design move-stop`: direct changes of a lens."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from ...errors import ProjectError
from ..common import check_free, check_place, chosen_fstop, console, one_of, print_remarks
from ..shared_options import FNumber, Force, KnownLens, output_option

Output = Annotated[Path, output_option(metavar="LENS.toml", help="The changed lens.")]


def resize(
    lens: KnownLens,
    output: Output,
    height: Annotated[float, typer.Option(help="Factor on its size, or on the diameter of --all.")],
    ghost: Annotated[str | None, typer.Option(metavar="J-I", help="Ghost to resize.")] = None,
    every: Annotated[
        str | None,
        typer.Option("--all", metavar="WHERE", help="Resize all ghosts bounded by the stop or the entrance instead."),
    ] = None,
    mirror: Annotated[str, typer.Option(help="Mirror whose curvature changes: first (J) or second (I).")] = "first",
    fstop: FNumber = None,
    force: Force = False,
) -> None:
    """Resize one ghost by the radius of a mirror, or all by an opening, and list the effect on all ghosts."""
    check_place(output, ".toml")
    check_free(output, force)
    which: Literal["first", "second"] = one_of("--mirror", mirror, ("first", "second"))
    opening: Literal["stop", "entrance"] = "stop" if every is None else one_of("--all", every, ("stop", "entrance"))
    if (ghost is None) == (every is None):
        raise ProjectError("no ghost given; give --ghost J-I for one, or --all stop or --all entrance for all")
    if every is not None and which != "first":
        raise ProjectError("--mirror is for one ghost: --all changes an opening; keep one")
    if not 0.0 < height < 1000.0:
        raise ProjectError(f"--height {height:g} is no size; give a number above 0 and below 1000")
    pair = None if ghost is None else _mirrors(ghost)
    f_number = chosen_fstop(fstop)
    from rich.table import Table

    from ...design.finishing.lens_edits import resize_all, resize_ghost
    from ...io.lens.lens_writer import write_lens
    from ...render.scene.resolve import open_lens

    if pair is not None:
        done = resize_ghost(open_lens(lens).lens, pair, height, mirror=which, f_number=f_number)
    else:
        done = resize_all(open_lens(lens).lens, height, by=opening, f_number=f_number)
    write_lens(done.lens, output)
    print_remarks([f"wrote {output}: row {done.row} has a new {'diameter' if pair is None else 'curvature'}"])
    out = Table(title="Place in mm per unit slope of the light, radius in mm", caption="Negative radius: inverted.")
    for column in ("ghost", "place", "now", "radius", "now", "times"):
        out.add_column(column, justify="right", no_wrap=True)
    for (j, i), (place, radius), (place_now, radius_now) in zip(done.ghosts, done.before, done.after, strict=True):
        times = abs(radius_now / radius) if radius else float("nan")
        cells = (f"{place:.2f}", f"{place_now:.2f}", f"{radius:.3f}", f"{radius_now:.3f}", f"{times:.3f}")
        out.add_row(f"{j}-{i}", *cells)
    console().print(out)


def _mirrors(ghost: str) -> tuple[int, int]:
    first, _, second = ghost.partition("-")
    if not (first.isdecimal() and second.isdecimal()):
        raise ProjectError(f"--ghost {ghost!r} is no ghost; write its mirrors as 4-1")
    return int(first), int(second)


def move_stop(
    lens: KnownLens,
    output: Output,
    row: Annotated[int, typer.Option(help="Row that becomes the stop, a plane in air.")],
    force: Force = False,
) -> None:
    """Make another row the stop; the old stop is removed."""
    check_place(output, ".toml")
    check_free(output, force)
    from ...design.finishing.lens_edits import move_stop as moved
    from ...design.problem.prescription import structure_of
    from ...io.lens.lens_writer import write_lens
    from ...render.scene.resolve import open_lens

    before = open_lens(lens).lens
    after = moved(before, row)
    write_lens(after, output)
    print_remarks([f"wrote {output}"])
    counts = [len(structure_of(one).pairs) for one in (before, after)]
    print(f"the stop is row {after.stop_row}, f/{after.f_number:.3g}; {counts[0]} ghosts before, {counts[1]} now")
