"""`flarewright looks`: the shipped looks, and a look from any project."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .common import check_free, check_place, console, print_json, print_remarks, write_text
from .shared_options import Force, Json, output_option

if TYPE_CHECKING:
    from rich.text import Text

    from ..render.gallery import Card

EPILOG = (
    "Use one with: flarewright render --look low-sun -o flare.exr\n\n"
    "On your own lens and light: flarewright render my.lens --light -9,5 --look low-sun -o flare.exr"
)
SAVE_EPILOG = "Then: flarewright render takumar-50-f1.4 --light -9,5 --look dusk.toml -o flare.exr"

# columns of a picture in the terminal; each character shows two pixels, one above the other
_COLUMNS = 32


def looks(context: typer.Context, as_json: Json = False) -> None:
    """List the shipped looks, with pictures on a terminal with enough colours."""
    if context.invoked_subcommand is not None:
        return
    from ..io.images.thumbnails import thumbnail_path
    from ..io.project.look_file import read_look, shipped_looks
    from ..render.gallery import cards

    known = {name: read_look(name) for name in shipped_looks()}
    if as_json:
        print_json({
            "looks": [
                {
                    "name": name, "title": look.name, "notes": look.notes, "lens": look.example.lens,
                    "says": list(look.says), "picture": str(thumbnail_path("look", name)),
                }
                for name, look in known.items()
            ]
        })  # fmt: skip
        return
    from rich.table import Table

    terminal = console()
    pictured = terminal.is_terminal and terminal.color_system == "truecolor"
    out = Table(caption="flarewright gallery -o DIR makes a page of all lenses and looks.", show_lines=pictured)
    if pictured:
        out.add_column("")
    out.add_column("name", no_wrap=True)
    out.add_column("shown with", no_wrap=True)
    out.add_column("description")
    for card in (card for card in cards() if card.kind == "look"):
        picture = [_picture(card)] if pictured else []
        out.add_row(*picture, card.name, str(known[card.name].example.lens), card.caption)
    terminal.print(out)


def save(
    project: Annotated[Path, typer.Argument(metavar="PROJECT", help="A project file.")],
    output: Annotated[Path, output_option(metavar="LOOK.toml", help="The look.")],
    name: Annotated[str | None, typer.Option(help="Name of the look (default: that of the file).")] = None,
    notes: Annotated[str, typer.Option(help="A sentence on its contents.")] = "",
    force: Force = False,
) -> None:
    """Save the look of a project: coatings, iris, f-number, dirt, scatter, colours, overrides."""
    from ..io.project.look_file import look_text
    from ..io.project.project_file import read_project
    from ..render.scene.looks import look_of

    check_place(output, ".toml")
    check_free(output, force)
    title = name if name is not None else output.stem.replace("-", " ").replace("_", " ").capitalize()
    look, remarks = look_of(read_project(project), title, notes)
    write_text(output, look_text(look, output.parent))
    print_remarks([*remarks, f"the look has {', '.join(look.says)}", f"wrote {output}"])


def _picture(card: Card) -> Text:
    """Draw a small picture in half blocks: the upper pixel as foreground colour, the lower one as background."""
    import numpy as np
    from PIL import Image
    from rich.text import Text

    from ..io.images.thumbnails import thumbnail

    with Image.open(BytesIO(thumbnail(card.kind, card.name))) as image:
        rows = 2 * round(0.5 * _COLUMNS * image.height / image.width)
        pixels = np.asarray(image.convert("RGB").resize((_COLUMNS, rows), Image.Resampling.BOX))
    out = Text()
    for upper, lower in zip(pixels[0::2], pixels[1::2], strict=True):
        for above, below in zip(upper, lower, strict=True):
            out.append("▀", style=f"rgb({above[0]},{above[1]},{above[2]}) on rgb({below[0]},{below[1]},{below[2]})")
        out.append("\n")
    out.right_crop(1)
    return out
