"""`flarewright gallery`: a page and a contact sheet of all lenses and looks."""

from __future__ import annotations

import json
from functools import partial
from hashlib import sha256
from pathlib import Path
from shutil import copyfile
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import FlarewrightError, OutputError
from .common import picture_size, print_json, print_remark, print_remarks, progress_bar, write_text
from .shared_options import Json, output_option

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..io.images.contact_sheet import Figure
    from ..render.gallery import Card

EPILOG = "Example: flarewright gallery -o gallery --size 640x360"

TITLE = "Flarewright: lenses and looks"
SECTIONS = {"lens": "Lenses, as photographed", "look": "Looks"}
_DONE = "gallery.json"
_ENTRY = {"of", "sha256"}


def gallery(
    output: Annotated[Path, output_option(metavar="DIR", help="The folder; created if missing.")],
    size: Annotated[
        str, typer.Option(metavar="WxH", help="Size of each picture, in pixels (default: 480x270).")
    ] = "480x270",
    as_json: Json = False,
) -> None:
    """Render every lens and every look of the library, and write a page (index.html) and a contact sheet.

    Pictures of an earlier run are kept: an interrupted gallery resumes.
    """
    from ..io.files.text_file import digest_of
    from ..io.images.contact_sheet import write_contact_sheet
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
            whole = digest_of(output / file)
            if done.get(file) != {"of": stamp, "sha256": whole}:
                if whole is not None and done.get(file, {}).get("of") == stamp:
                    print_remarks([f"{output / file} is damaged or was changed; it is rendered again"])
                _render(card, size_px, output / file)
                done[file] = {"of": stamp, "sha256": digest_of(output / file)}
                write_text(output / _DONE, json.dumps(done, indent=1))
            figures.append(_figure(card, file, output / file))
    page, picture = write_contact_sheet(output, TITLE, figures)
    if as_json:
        pictures = [{"kind": card.kind, "name": card.name, "command": card.command} for card in known]
        print_json({"page": str(page), "picture": str(picture), "pictures": pictures})
    else:
        print_remarks([f"wrote {page}", f"wrote {picture}"])


def shipped_gallery(folder: Path) -> Path:
    """Write the page of the shipped pictures, without rendering.

    Parameters
    ----------
    folder : Path
        Created if missing.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    from ..io.files.atomic_write import write_atomically
    from ..io.images.contact_sheet import write_contact_sheet
    from ..io.images.thumbnails import thumbnail_path
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
    from ..io.images.png import write_png
    from ..render.gallery import card_picture, card_project
    from ..render.warmup import compile_for_render

    compile_for_render(card_project(card, size_px), None, print_remark)
    about = {"Software": f"Flarewright {__version__}", "Description": card.command}
    write_png(path, card_picture(card, size_px), about)


def _figure(card: Card, file: str, path: Path) -> Figure:
    import numpy as np
    from PIL import Image

    from ..io.files.door import outside
    from ..io.images.contact_sheet import Figure

    with outside(path, "a picture", pixel_bytes=4) as file_of_picture, Image.open(file_of_picture) as image:
        pixels = np.asarray(image.convert("RGB"))
    return Figure(SECTIONS[card.kind], card.title, card.caption, card.command, file, pixels)


def _stamp(card: Card, size_px: Sequence[int]) -> str:
    """Return a hash of the version, project and lens of a picture."""
    from .. import __version__
    from ..io.files.text_file import read_bytes
    from ..io.lens.library import lens_path
    from ..render.gallery import card_project

    project = card_project(card, (size_px[0], size_px[1]))
    lens = read_bytes(lens_path(str(project.lens)), "a lens file")
    return sha256(f"{__version__} {project.model_dump_json()}".encode() + lens).hexdigest()[:16]


def _read_done(path: Path) -> dict[str, Any]:
    """Return the stamps of the finished pictures by file; entries of any other form, in a damaged list, are dropped."""
    from ..io.files.text_file import read_json

    try:
        found = read_json(path, "a list of pictures")
    except FlarewrightError:
        return {}
    if not isinstance(found, dict):
        return {}
    return {
        file: entry
        for file, entry in found.items()
        if isinstance(entry, dict) and entry.keys() == _ENTRY and all(isinstance(text, str) for text in entry.values())
    }


def _make(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"cannot write into {folder}: it is a file; give -o a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"the folder {folder} cannot be made: {error.strerror or error}; choose another") from None
