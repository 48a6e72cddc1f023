"""`flarewright gallery`: a contact sheet of all lenses and looks."""

from __future__ import annotations

import json
from functools import partial
from hashlib import sha256
from pathlib import Path
from shutil import copyfile
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import OutputError
from .common import picture_size, print_json, progress_bar, tell, write_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..io.contact_sheet import Figure
    from ..render.gallery import Card

EPILOG = "Example: flarewright gallery -o gallery --size 640x360"

TITLE = "Flarewright: lenses and looks"
SECTIONS = {"lens": "Lenses, as photographed", "look": "Looks"}
_DONE = "gallery.json"


def gallery(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="The folder; made where it is missing.")
    ],
    size: Annotated[str, typer.Option(metavar="WxH", help="Each picture, in pixels.")] = "480x270",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Render every lens and every look of the library, and write a page (index.html) and one picture of them all.

    Pictures that are there from an earlier run stay: an interrupted gallery goes on where it was.
    """
    from ..io.contact_sheet import write_contact_sheet
    from ..render.gallery import cards

    size_px = picture_size(size)
    _make(output)
    known = cards()
    figures = []
    done = _read_done(output / _DONE)
    with progress_bar() as begin:
        bar = begin("gallery")
        for k, card in enumerate(known):
            bar(k / len(known), card.title)
            stamp = _stamp(card, size_px)
            file = f"{card.kind}-{card.name}.png"
            if done.get(file) != stamp or not (output / file).is_file():
                _render(card, size_px, output / file)
                done[file] = stamp
                write_text(output / _DONE, json.dumps(done, indent=1))
            figures.append(_figure(card, file, output / file))
    page, picture = write_contact_sheet(output, TITLE, figures)
    if as_json:
        pictures = [{"kind": card.kind, "name": card.name, "command": card.command} for card in known]
        print_json({"page": str(page), "picture": str(picture), "pictures": pictures})
    else:
        tell([f"wrote {page}", f"wrote {picture}"])


def shipped_gallery(folder: Path) -> Path:
    """Write the contact sheet of the pictures that ship, in no time.

    Parameters
    ----------
    folder : Path
        Made where it is missing.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    from ..io.atomic import write_atomically
    from ..io.contact_sheet import write_contact_sheet
    from ..io.thumbnails import thumbnail_path
    from ..render.gallery import cards

    _make(folder)
    figures = []
    for card in cards():
        source = thumbnail_path(card.kind, card.name)
        write_atomically(folder / source.name, partial(copyfile, source))
        figures.append(_figure(card, source.name, source))
    return write_contact_sheet(folder, TITLE, figures)[0]


def _render(card: Card, size_px: tuple[int, int], path: Path) -> None:
    from .. import __version__
    from ..io.png import write_png
    from ..render.first_run import compile_for_render
    from ..render.gallery import card_picture, card_project

    compile_for_render(card_project(card, size_px), None, lambda sentence: tell([sentence]))
    about = {"Software": f"Flarewright {__version__}", "Description": card.command}
    write_png(path, card_picture(card, size_px), about)


def _figure(card: Card, file: str, path: Path) -> Figure:
    import numpy as np
    from PIL import Image

    from ..io.contact_sheet import Figure

    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"))
    return Figure(SECTIONS[card.kind], card.title, card.caption, card.command, file, pixels)


def _stamp(card: Card, size_px: Sequence[int]) -> str:
    """Return what a picture depends on, in short: the version and what it shows."""
    from .. import __version__
    from ..io.library import lens_path
    from ..render.gallery import card_project

    project = card_project(card, (size_px[0], size_px[1]))
    lens = lens_path(str(project.lens)).read_bytes()
    return sha256(f"{__version__} {project.model_dump_json()}".encode() + lens).hexdigest()[:16]


def _read_done(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _make(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"cannot write into {folder}: it is a file; give -o a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"the folder {folder} cannot be made: {error.strerror or error}; choose another") from None
