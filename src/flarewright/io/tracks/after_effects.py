"""Keyframe data of After Effects: what Edit, Copy puts on the clipboard, saved as text.

Blocks of tab-separated lines: the path of a property, its columns, and one line a key. Pixels count from the top left
corner. A track point gives its Attach Point in the pixels of its footage; any other property with x and y in pixels is
a track too, such as a layer's Position in the pixels of the composition.
"""

from __future__ import annotations

from ...errors import FileError
from ..files.door import shown
from .numbers import MOST_TRACKS, number, track_of
from .track import Track, TrackFile

_FIRST = "adobe after effects"
# of a track point: the place that the tracker applies, then the one that it follows
_POINTS = ("Attach Point", "Feature Center")
_LEFT_OUT = {"Anchor Point", "Attach Point Offset", "Search Offset", "Feature Size", "Search Size"}


def is_after_effects(text: str) -> bool:
    """Return whether a text starts as keyframe data does."""
    return text.lstrip().lower().startswith(_FIRST)


def read_after_effects(text: str, file: str) -> TrackFile:
    """Read the tracks of keyframe data.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.

    Raises
    ------
    FileError
        No property has x and y in pixels, or a number is none.
    """
    name = shown(file)
    facts, blocks = _blocks(text, name)
    fps = number(facts["units per second"], f"{name}: Units Per Second", "frames per second") if (
        "units per second" in facts
    ) else None  # fmt: skip
    size = _size(facts, name)
    tracked: dict[str, dict[str, list[tuple[str, list[str]]]]] = {}
    others: dict[str, list[tuple[str, list[str]]]] = {}
    for path, rows in blocks:
        if path[0] == "Motion Trackers":
            tracked.setdefault(" ".join(path[1:-1]), {})[path[-1]] = rows
        elif path[-1] not in _LEFT_OUT:
            others[_named(" ".join(path[1:]) or path[0], others)] = rows
    found: list[Track] = []
    for point, properties in tracked.items():
        chosen = next((properties[one] for one in _POINTS if one in properties), None)
        if chosen is not None:
            found.append(_track(name, point, chosen, size))
    remarks = []
    if not found:
        # a null or a solid has its own size, which is often square; its position counts in the composition
        known = size if size is not None and size[0] != size[1] else None
        found = [_track(name, key, rows, known) for key, rows in others.items()]
    elif others:
        remarks.append(f"{name}: {', '.join(others)[:200]} left out, since there are track points")
    if not found:
        raise FileError(
            f"{name} has no property with x and y in pixels; select the keys of a track point or of a Position in "
            "After Effects, copy them and save them as text"
        )
    if len(found) > MOST_TRACKS:
        raise FileError(f"{name} has more than {MOST_TRACKS} properties; copy those of the lights only")
    return TrackFile(tuple(found), "after-effects", fps, tuple(remarks))


def _blocks(text: str, file: str) -> tuple[dict[str, str], list[tuple[list[str], list[tuple[str, list[str]]]]]]:
    """Return the facts of the head, and the blocks with x and y in pixels: their path and their lines with places."""
    facts: dict[str, str] = {}
    blocks: list[tuple[list[str], list[tuple[str, list[str]]]]] = []
    path: list[str] = []
    rows: list[tuple[str, list[str]]] | None = None
    skipping = False
    for k, line in enumerate(text.splitlines(), 1):
        word = line.strip().lower()
        if word in ("expression data", "end of expression data"):
            skipping = word == "expression data"
            continue
        if not word or skipping or word.startswith((_FIRST, "end of keyframe data")):
            continue
        cells = [cell.strip() for cell in line.split("\t")]
        if cells[0]:
            path, rows = [cell for cell in cells if cell], None
        elif not path:
            if len(cells) >= 3:
                facts[cells[1].lower()] = cells[2]
        elif len(cells) > 1 and cells[1].lower() == "frame":
            columns = [cell.lower() for cell in cells[2:4]]
            if columns == ["x pixels", "y pixels"]:
                rows = []
                blocks.append((path, rows))
        elif rows is not None:
            rows.append((f"{file} line {k}", cells[1:4]))
    return facts, blocks


def _track(file: str, name: str, rows: list[tuple[str, list[str]]], size: tuple[float, float] | None) -> Track:
    """Return the track of a block's lines."""
    frames, places = [], []
    for where, cells in rows:
        if len(cells) < 3:
            raise FileError(f"{where} is no 'frame, x, y'; copy the keys again")
        # a property without keys has a value and no frame
        frames.append(number(cells[0], where, "a frame") if cells[0] else 0.0)
        places.append((number(cells[1], where, "x"), number(cells[2], where, "y")))
    return track_of(file, name[:80], frames, places, size_px=size)


def _size(facts: dict[str, str], file: str) -> tuple[float, float] | None:
    """Return the size of the source."""
    if not {"source width", "source height"} <= facts.keys():
        return None
    width, height = (
        number(facts[f"source {side}"], f"{file}: Source {side.title()}", f"the {side}") for side in ("width", "height")
    )
    if not (1.0 <= width <= 1e6 and 1.0 <= height <= 1e6):
        raise FileError(
            f"{file}: the source has {width:g}x{height:g} pixels, which no picture has; copy the keys again"
        )
    return width, height


def _named(name: str, known: dict[str, list[tuple[str, list[str]]]]) -> str:
    """Return a name that no other block has."""
    return name if name not in known else f"{name} {len(known) + 1}"
