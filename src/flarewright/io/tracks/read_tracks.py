"""Find out which program wrote a file of tracks, and read it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

from ...errors import FileError, ProjectError
from ..files.door import outside, shown
from ..files.text_file import read_text
from .after_effects import is_after_effects, read_after_effects
from .equalizer import is_equalizer, read_equalizer
from .nuke import is_columns, is_nuke, read_columns, read_nuke
from .numbers import LARGEST_BYTES
from .scene_json import is_scene_json, read_scene
from .syntheyes import is_syntheyes, read_syntheyes
from .table import is_table, read_table
from .track import Origin, TrackFile

TrackFormat = Literal["csv", "nuke", "nuke-ascii", "after-effects", "syntheyes", "3de", "blender", "usd"]
FORMATS: tuple[TrackFormat, ...] = get_args(TrackFormat)

_WHAT = "a file of tracks"
_USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_USD_STARTS = (b"#usda", b"PXR-USDC")


def track_format(text: str) -> TrackFormat:
    """Return a format by its name.

    Raises
    ------
    ProjectError
        There is no such format.
    """
    for name in FORMATS:
        if text == name:
            return name
    raise ProjectError(f"--track-format {text!r} is unknown; choose {', '.join(FORMATS[:-1])} or {FORMATS[-1]}")


def read_tracks(
    path: str | Path, form: TrackFormat | None = None, *, origin: Origin | None = None, first_frame: int = 1
) -> TrackFile:
    r"""Read the tracks of a file.

    Parameters
    ----------
    path : path
    form : str, optional
        Its format (`FORMATS`). None: by its contents.
    origin : {"top-left", "bottom-left"}, optional
        Corner from which the pixels of a table count; None: the top left one. Other formats have their own corner.
    first_frame : int
        Frame of the first line of a file of `x y` columns, which has no frames.

    Raises
    ------
    FileError
        The file cannot be read, or has no tracks of that format.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "sun.csv"
    ...     _ = file.write_text("frame,x,y\n1001,640,360\n1002,650.5,361\n")
    ...     found = read_tracks(file)
    >>> found.format, found.tracks[0].frames.tolist()
    ('csv', [1001.0, 1002.0])
    """
    if form == "usd" or (form is None and _is_usd(Path(path))):
        from .usd_stage import read_stage

        return read_stage(path)
    text = read_text(path, _WHAT, LARGEST_BYTES, foreign=True)
    name = str(path)
    chosen = form or _format_of(text)
    match chosen:
        case "after-effects":
            return read_after_effects(text, name)
        case "blender":
            return read_scene(text, name)
        case "nuke":
            return read_nuke(text, name)
        case "3de":
            return read_equalizer(text, name)
        case "syntheyes":
            return read_syntheyes(text, name)
        case "csv":
            table = read_table(text, name, origin or "top-left")
            if form is None and origin is None and is_columns(text) and "frame" not in text.lower():
                # numbers with tabs are also what Nuke exports
                words = f"{shown(path)} has no names of columns: read as frame, x, y from the top left corner"
                words += "; --track-format nuke-ascii counts from the bottom left"
                table = replace(table, remarks=(*table.remarks, words))
            return table
        case "nuke-ascii":
            return read_columns(text, name, first_frame)
    raise FileError(
        f"{shown(path)} is no known file of tracks: give a table frame,x,y or an export of Nuke, After Effects, "
        "SynthEyes, 3DEqualizer, the Blender add-on or USD, or name its --track-format"
    )


def _is_usd(path: Path) -> bool:
    """Return whether a file is a USD stage, by its name or its first bytes."""
    if path.suffix.lower() in _USD_SUFFIXES:
        return True
    with outside(path, _WHAT) as file:
        return file.read(8).startswith(_USD_STARTS)


def _format_of(text: str) -> TrackFormat | None:
    """Return the format of a text by its contents."""
    found: tuple[tuple[TrackFormat, bool], ...] = (
        ("after-effects", is_after_effects(text)),
        ("blender", is_scene_json(text)),
        ("nuke", is_nuke(text)),
        ("3de", is_equalizer(text)),
        ("csv", is_table(text)),
        ("syntheyes", is_syntheyes(text)),
        ("nuke-ascii", is_columns(text)),
    )
    return next((name for name, fits in found if fits), None)
