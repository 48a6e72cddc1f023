"""Tracks of Nuke: scripts or pasted nodes with Tracker3 and Tracker4 nodes, pairs of curves, and columns of numbers.

Pixels count from the bottom left corner. A curve is `{curve x1001 960 961.5 x1004 964}`: x gives the frame of the next
value, a value without one follows at the step of the two before it (NDK developer guide, "Curve serialisation format").
A text of columns, as of the curve editor's Export ASCII, has `x y` or `frame x y` in each line.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import numpy as np

from ...errors import FileError
from ...typing import Floats
from ..files.door import shown
from .numbers import MOST_FRAMES, MOST_TRACKS, number, track_of
from .track import Track, TrackFile

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}]|[^\s{}"]+|"')
_NODE = re.compile(r"^\s*(?:Tracker[34]?|Root)\s*\{", re.MULTILINE)
_FORMAT = re.compile(r"""^\s*format\s+"(\d+)\s+(\d+)\s""", re.MULTILINE)
_TRACK_KNOB = re.compile(r"^track\d*$")
# braces inside braces; a Tracker4 has six
_DEEPEST = 40


def is_nuke(text: str) -> bool:
    """Return whether a text has curves of Nuke."""
    return "{curve " in text and ("Tracker" in text or text.count("{curve ") >= 2)


def is_columns(text: str) -> bool:
    """Return whether a text has two or three numbers a line, without separators."""
    first = [line.split() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")][:5]
    # the first line may have names
    body = first[1:] or first
    width = len(body[0]) if body else 0
    return width in (2, 3) and all(len(cells) == width and all(map(_is_number, cells)) for cells in body)


def read_nuke(text: str, file: str) -> TrackFile:
    """Read the tracks of all Tracker nodes of a script, or of pairs of curves.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.

    Raises
    ------
    FileError
        There is no track with curves of x and y, or the script is damaged.
    """
    name = shown(file)
    root = next((found for found in _NODE.finditer(text) if found[0].split("{")[0].strip() == "Root"), None)
    size = None
    if root is not None and (stated := _FORMAT.search(text, root.end(), root.end() + 20_000)):
        size = float(stated[1]), float(stated[2])
    tracks: list[Track] = []
    nodes = [found for found in _NODE.finditer(text) if "Tracker" in found[0]]
    for node in nodes:
        body = _parsed(text[node.end() :], name)
        for label, x, y in _tracks_of_node(body):
            tracks.append(_track(name, label, x, y, size))
            if len(tracks) > MOST_TRACKS:
                raise FileError(f"{name} has more than {MOST_TRACKS} tracks; export those of the lights only")
    if not nodes:
        curves = [item for item in _all_lists(_parsed(text + "}", name)) if item[:1] == ["curve"]]
        if len(curves) % 2:
            raise FileError(f"{name} has {len(curves)} curves; a track has one for x and one for y")
        pairs = zip(curves[::2], curves[1::2], strict=True)
        tracks = [_track(name, f"track {k}", x, y, size) for k, (x, y) in enumerate(pairs, 1)]
    if not tracks:
        raise FileError(f"{name} has no track with curves of x and y; track it in Nuke first, or bake its expressions")
    return TrackFile(tuple(tracks), "nuke")


def read_columns(text: str, file: str, first_frame: float) -> TrackFile:
    """Read columns of numbers: `x y`, one line a frame, or `frame x y`.

    Parameters
    ----------
    text : str
    file : str
        Its name, for messages.
    first_frame : float
        Frame of the first line of two columns.

    Raises
    ------
    FileError
        A line has other columns than the first one, or a cell is no number.
    """
    name = shown(file)
    frames: list[float] = []
    places: list[tuple[float, float]] = []
    remarks, label, width = [], "track", 0
    for k, line in enumerate(text.splitlines(), 1):
        cells = line.split()
        if not cells or line.lstrip().startswith("#"):
            continue
        where = f"{name} line {k}"
        if not width and not any(map(_is_number, cells[1:])):
            # a first line with names
            label, width = cells[0][:80], 0
            continue
        width = width or len(cells)
        if len(cells) != width or width not in (2, 3):
            raise FileError(f"{where} has {len(cells)} numbers; write x y, or frame x y, in every line")
        values = [number(cell, where, what) for cell, what in zip(cells, ("frame", "x", "y")[-width:], strict=True)]
        frames.append(values[0] if width == 3 else first_frame + len(frames))
        places.append((values[-2], values[-1]))
    if not frames:
        raise FileError(f"{name} has no lines of numbers; write x y, or frame x y, in every line")
    if width == 2:
        remarks.append(f"{name} has no frames: its first line is frame {first_frame:g}")
    return TrackFile(
        (track_of(name, label, frames, places, origin="bottom-left"),), "nuke-ascii", remarks=tuple(remarks)
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _parsed(text: str, file: str) -> list[Any]:
    """Return the nested lists of a brace's contents; its opening brace is before the text."""
    stack: list[list[Any]] = [[]]
    for found in _TOKEN.finditer(text):
        token = found[0]
        if token == "{":
            if len(stack) > _DEEPEST:
                raise FileError(f"{file} has braces inside more than {_DEEPEST} braces: it is no script of Nuke")
            stack.append([])
        elif token == "}":
            done = stack.pop()
            if not stack:
                return done
            stack[-1].append(done)
        else:
            stack[-1].append(token[1:-1] if len(token) > 1 and token[0] == '"' else token)
    raise FileError(f"{file} ends inside a node: it is cut short; save or copy it again")


def _all_lists(items: list[Any]) -> list[list[Any]]:
    """Return all lists in nested lists, from left to right."""
    found = []
    for item in items:
        if isinstance(item, list):
            found += [item, *_all_lists(item)]
    return found


def _tracks_of_node(body: list[Any]) -> list[tuple[str, list[Any], list[Any]]]:
    """Return name, x curve and y curve of each track of a Tracker node."""
    knobs = list(pairwise(body))
    label = next((str(value) for knob, value in knobs if knob == "name" and isinstance(value, str)), "Tracker")
    found = []
    for knob, value in knobs:
        if not isinstance(knob, str) or not isinstance(value, list):
            continue
        if knob == "tracks":
            found += _table_rows(value)
        elif _TRACK_KNOB.match(knob):
            curves = [item for item in _all_lists([value]) if item[:1] == ["curve"]]
            if len(curves) == 2:
                found.append((f"{label} {knob}", curves[0], curves[1]))
    return found


def _table_rows(value: list[Any]) -> list[tuple[str, list[Any], list[Any]]]:
    """Return the rows of a Tracker4's table: its columns are named before them."""
    if len(value) < 3 or not all(isinstance(part, list) for part in value[:3]):
        return []
    columns = [column[3] if isinstance(column, list) and len(column) > 3 else "" for column in value[1]]
    if not {"name", "track_x", "track_y"} <= set(columns):
        return []
    at = [columns.index(column) for column in ("name", "track_x", "track_y")]
    found = []
    for row in value[2]:
        if isinstance(row, list) and len(row) > max(at):
            label, x, y = (row[k] for k in at)
            if isinstance(x, list) and isinstance(y, list) and x[:1] == y[:1] == ["curve"]:
                found.append((label if isinstance(label, str) else "track", x, y))
    return found


def _track(file: str, label: str, x: list[Any], y: list[Any], size: tuple[float, float] | None) -> Track:
    """Return the track of two curves: every frame that has a key in one of them."""
    of_x, of_y = (_keys(curve, f"{file}: track {label!r}") for curve in (x, y))
    frames = np.union1d(of_x[0], of_y[0])
    places = np.column_stack([np.interp(frames, *keys) for keys in (of_x, of_y)])
    return track_of(file, label[:80], frames.tolist(), places.tolist(), origin="bottom-left", size_px=size)


def _keys(curve: list[Any], where: str) -> tuple[Floats, Floats]:
    """Return the frames and values of a curve's keys."""
    frames: list[float] = []
    values: list[float] = []
    stated: float | None = None
    for token in curve[1:]:
        if isinstance(token, list):
            raise FileError(f"{where} has an expression; bake it to keys")
        head = token[:1]
        if head == "x" and len(token) > 1:
            stated = number(token[1:], where, "a frame")
        elif (len(token) == 1 and token.isalpha()) or (head and head in "stuv"):
            # interpolation between keys, and slopes at them
            continue
        else:
            step = frames[-1] - frames[-2] if len(frames) > 1 else 1.0
            frames.append(stated if stated is not None else frames[-1] + step if frames else 0.0)
            values.append(_value(token, where))
            stated = None
    if not frames:
        raise FileError(f"{where} has a curve without keys; track it again")
    if len(frames) > MOST_FRAMES:
        raise FileError(f"{where} has {len(frames)} keys, more than {MOST_FRAMES}; export a shorter range")
    if any(b <= a for a, b in pairwise(frames)):
        raise FileError(f"{where} has keys whose frames do not rise; export it again")
    return np.array(frames), np.array(values)


def _value(token: str, where: str) -> float:
    """Return a number of a curve, decimal or the eight digits of a binary one."""
    if re.fullmatch(r"0x[0-9a-fA-F]{8}", token):
        return number(str(float(np.frombuffer(bytes.fromhex(token[2:]), ">f4")[0])), where, "a value")
    return number(token, where, "a value")
