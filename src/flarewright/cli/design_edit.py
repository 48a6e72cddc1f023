"""`flarewright design resize` and `design move-stop`: direct changes of a lens."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from ..errors import ProjectError
from .common import check_place, chosen_fstop, console, tell

Lens = Annotated[str, typer.Argument(metavar="LENS", help="A shipped lens (flarewright lenses) or a lens file.")]
Output = Annotated[Path, typer.Option("-o", "--output", metavar="LENS.toml", help="The changed lens.")]


def resize(
    lens: Lens,
    output: Output,
    height: Annotated[float, typer.Option(help="Multiplies its size, or the diameter of --all.")],
    ghost: Annotated[str | None, typer.Option(metavar="J-I", help="Which ghost.")] = None,
    every: Annotated[
        str | None, typer.Option("--all", metavar="WHERE", help="Instead, all that the stop or the entrance bounds.")
    ] = None,
    mirror: Annotated[str, typer.Option(help="Which of its two mirrors is bent: first (J) or second (I).")] = "first",
    fstop: Annotated[float | None, typer.Option(help="f-number; wide open when left out.")] = None,
) -> None:
    """Resize one ghost by the radius of one of its mirrors, or all by an opening, and show what happens to them."""
    check_place(output, ".toml")
    if mirror not in ("first", "second"):
        raise ProjectError(f"--mirror {mirror!r} is unknown; choose first or second")
    if every not in (None, "stop", "entrance"):
        raise ProjectError(f"--all {every!r} is unknown; choose stop or entrance")
    if (ghost is None) == (every is None):
        raise ProjectError("what is to be resized? Give --ghost J-I for one, or --all stop or --all entrance for all")
    if not 0.0 < height < 1000.0:
        raise ProjectError(f"--height {height:g} is no size; give a number above 0 and below 1000")
    pair = None if ghost is None else _mirrors(ghost)
    f_number = chosen_fstop(fstop)
    from rich.table import Table

    from ..design.edits import resize_all, resize_ghost
    from ..io.lens_writer import write_lens
    from ..render.prepare import load_lens

    which: Literal["first", "second"] = "second" if mirror == "second" else "first"
    if pair is not None:
        done = resize_ghost(load_lens(lens), pair, height, mirror=which, f_number=f_number)
    else:
        done = resize_all(load_lens(lens), height, by="stop" if every == "stop" else "entrance", f_number=f_number)
    write_lens(done.lens, output)
    tell([f"wrote {output}: row {done.row} is {'opened' if pair is None else 'bent'}"])
    out = Table(title="Place in mm per unit slope of the light, radius in mm", caption="Negative radius: upside down.")
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
    lens: Lens,
    output: Output,
    row: Annotated[int, typer.Option(help="The row that becomes the stop: a plane in air.")],
) -> None:
    """Make another row the stop; the old one is taken out, and ghosts are those of the new stop."""
    check_place(output, ".toml")
    from ..design.edits import move_stop as moved
    from ..design.prescription import structure_of
    from ..io.lens_writer import write_lens
    from ..render.prepare import load_lens

    before = load_lens(lens)
    after = moved(before, row)
    write_lens(after, output)
    tell([f"wrote {output}"])
    counts = [len(structure_of(one).pairs) for one in (before, after)]
    print(f"the stop is row {after.stop_row}, f/{after.f_number:.3g}; {counts[0]} ghosts before, {counts[1]} now")
