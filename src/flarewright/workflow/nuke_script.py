"""A script or a gizmo for Nuke that reads a flare, grades each of its passes, and adds it to a plate."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from ..errors import OutputError, ProjectError
from ..io.files.door import no_file, shown
from ..io.images.exr import ExrContents, read_exr, scale_in_exr
from ..jobs.frame_list import MOST_FRAMES, FramePattern, frames_text
from ..render.image.compose import add_layer
from .keyframes import frame_rate
from .nuke_graph import Node, Passes, flare_nodes, layers_text, nodes_text, quoted

BEAUTY = "beauty"
DEFAULT_FPS = Fraction(24)

# names of layers that Nuke keeps as they are
_KEPT = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_SINGLE = re.compile(r"ghost[._]")
# a sum of rounded half floats differs from the rounded sum by this part of the largest value
_ROUNDED = 2.0**-8
_NUKE_VERSION = "12.0 v1"


@dataclass(frozen=True)
class Frames:
    """Files of one name with the number of the frame.

    Attributes
    ----------
    file : str
        The pattern as Nuke writes it, absolute.
    first, last : int
    missing : tuple of int
        Frames between them without a file.
    """

    file: str
    first: int
    last: int
    missing: tuple[int, ...] = ()


@dataclass(frozen=True)
class NukeScript:
    """Text of a script or gizmo.

    Attributes
    ----------
    text : str
    passes : tuple of str
        Layers that are graded one by one; "rest" is the light of ghosts without a layer.
    frames : tuple of int
        First and last frame.
    remarks : tuple of str
    """

    text: str
    passes: tuple[str, ...]
    frames: tuple[int, int]
    remarks: tuple[str, ...] = ()


def nuke_script(
    flare: str,
    *,
    plate: str | None = None,
    frames: Sequence[int] | None = None,
    fps: Fraction | None = None,
    gain: float = 1.0,
    singles: bool = False,
    gizmo: str | None = None,
) -> NukeScript:
    """Write the text of a script for the files of a flare.

    Parameters
    ----------
    flare : str
        An EXR file of `render` or `shot`, or the pattern of a sequence: `flare.####.exr`, `%04d`, `$F4`.
    plate : str, optional
        A picture or pattern to which the flare is added.
    frames : sequence of int, optional
        None: those that there are.
    fps : Fraction, optional
        Frames per second. None: those of the file, or 24.
    gain : float
        Factor of the whole flare: value of the plate for an irradiance of 1.
    singles : bool
        Grade each single ghost that has a layer.
    gizmo : str, optional
        Name of a gizmo to write instead of a script: inputs for flare and plate, and a knob for the gain of each pass.

    Raises
    ------
    ProjectError
        There are no files, the first of the chosen frames does not exist, or frames have different scales.
    OutputError
        A file is no EXR of Flarewright's.

    Notes
    -----
    `tests/workflow/test_nuke_script.py` evaluates the nodes: with gains of 1 the script gives plate + beauty.

    Examples
    --------
    >>> text = nuke_script("flare.####.exr", plate="plate.####.exr").text             # doctest: +SKIP
    """
    if not (np.isfinite(gain) and gain > 0.0):
        raise ProjectError(f"the gain {gain:g} is no factor above 0")
    files = _sequence(flare, frames)
    contents = read_exr(FramePattern(flare).path(files.first))
    _check_scales(FramePattern(flare), files, contents.scale)
    found, remarks = _passes(contents, singles)
    remarks += _missing_words(flare, files)
    layers = (*found.passes, *found.singles)
    rest = ("rest",) if found.singles else ()
    graded = (*(layer for layer in layers if layer != "ghosts" or not rest), *rest) or (BEAUTY,)
    if gizmo is not None:
        text = _gizmo_text(gizmo, found, graded, gain)
        return NukeScript(text, graded, (files.first, files.last), tuple(remarks))
    fps = fps or _fps_of(contents) or DEFAULT_FPS
    size = _format(contents)
    root = (
        ("first_frame", str(files.first)), ("last_frame", str(files.last)), ("lock_range", "true"),
        ("fps", f"{float(fps):.9g}"), ("format", size),
    )  # fmt: skip
    reader = Node("Read", "Flare_file", (("file_type", "exr"), *_read_knobs(files, size), ("raw", "true")))
    nodes = [reader, *flare_nodes(found, reader.name, overall=repr(float(gain)))]
    if plate is not None:
        behind = _sequence(plate, None if frames is None else range(files.first, files.last + 1))
        if (behind.first > files.first or behind.last < files.last) and FramePattern(plate).numbered:
            remarks.append(f"{plate} has the frames {behind.first} to {behind.last} only")
        remarks += _missing_words(plate, behind)
        sum_of_flare = nodes[-1]
        last = sum_of_flare.place[1] + 1
        nodes.append(Node("Read", "Plate", _read_knobs(behind, None), place=(-2, last - 1)))
        nodes.append(Node("Merge2", "Comp", (("operation", "plus"),), ("Plate", sum_of_flare.name), (-2, last)))
    header = "".join(f" {knob} {value}\n" for knob, value in root)
    text = f"version {_NUKE_VERSION}\nRoot {{\n inputs 0\n{header}}}\n{layers_text(layers)}{nodes_text(nodes)}"
    return NukeScript(text, graded, (files.first, files.last), tuple(remarks))


def _sequence(text: str, frames: Sequence[int] | None) -> Frames:
    """Return the files of a pattern; the number of a single file is 1."""
    pattern = FramePattern(text)
    if not pattern.numbered:
        if not Path(text).is_file():
            raise ProjectError(
                f"{shown(text)} {no_file(text)}: check the path, or write #### for the number of the frame"
            )
        first, last = (1, 1) if frames is None else (min(frames), max(frames))
        return Frames(_absolute(Path(text)), first, last)
    try:
        there = set(pattern.on_disk())
    except ProjectError:
        # a folder that cannot be read has no files
        there = set()
    if not there:
        raise ProjectError(f"there are no files {shown(text)}: draw them with flarewright shot, or check the path")
    wanted = set(there if frames is None else frames)
    if not wanted & there:
        raise ProjectError(f"{shown(text)} has the frames {frames_text(sorted(there))[:200]}, none of those asked")
    first, last = (min(there), max(there)) if frames is None else (min(wanted), max(wanted))
    if last - first >= MOST_FRAMES:
        raise ProjectError(
            f"{shown(text)}: {first} to {last} are more than {MOST_FRAMES} frames; choose fewer --frames"
        )
    # a Read reads every frame between its first and its last
    missing = tuple(frame for frame in range(first, last + 1) if frame not in there)
    if first not in there:
        raise ProjectError(f"{shown(str(pattern.path(first)))} does not exist: choose --frames that there are")
    # the number as Nuke writes it
    place = "#" * pattern.digits if pattern.digits > 1 else "%d"
    return Frames(_absolute(Path(pattern.rewritten(place))), first, last, missing)


def _missing_words(text: str, files: Frames) -> list[str]:
    """Return a remark on frames that a Read asks for and that have no file."""
    if not files.missing:
        return []
    return [f"{text} has no frames {frames_text(files.missing)[:200]}; Nuke reports an error there"]


def _check_scales(pattern: FramePattern, files: Frames, scale: float) -> None:
    """Raise an error for a frame whose values have another factor than the first frame's, which the script divides out.

    `render` chooses the factor by the lights of one picture, `shot` by those of all frames.
    """
    first = pattern.path(files.first)
    for frame in range(files.first + 1, files.last + 1) if pattern.numbered else ():
        path = pattern.path(frame)
        if path.exists() and (other := scale_in_exr(path)) != scale:
            raise ProjectError(
                f"{shown(path)} holds irradiances times {other:g}, {shown(first)} times {scale:g}: draw all frames "
                "with flarewright shot, or with --float"
            )


def _absolute(path: Path) -> str:
    """Return a path as Nuke writes it."""
    text = path.absolute().as_posix()
    if shown(text) != text:
        raise OutputError(f"{shown(text)} is not UTF-8: rename the file")
    return text


def _passes(contents: ExrContents, singles: bool) -> tuple[Passes, list[str]]:
    """Return the layers to grade, checked to add up to the beauty, and remarks on the others."""
    remarks: list[str] = []
    first, *others = contents.layers
    ghosts = [one for one in others if _SINGLE.match(one.name)]
    parts = [one for one in others if one not in ghosts and not one.name.endswith(".variance")]
    kept = [one.name for one in ghosts if _KEPT.fullmatch(one.name)]
    if singles and len(kept) < len(ghosts):
        remarks.append(
            f"{len(ghosts) - len(kept)} single ghosts stay in the pass ghosts, since Nuke changes names such as "
            f"{next(one.name for one in ghosts if one.name not in kept)}: flarewright shot writes others"
        )
    if singles and not ghosts:
        remarks.append("there are no layers of single ghosts: draw them with --layers ghosts --brightest 20")
    flare = Passes(contents.scale)
    if not parts:
        return flare, remarks
    width, height = contents.size_px
    total = np.zeros((height, width, 3))
    for one in parts:
        add_layer(total, one)
    beauty = np.asarray(first.pixels, dtype=np.float64)
    names = [one.name for one in parts]
    wrong = float(np.abs(total - beauty).max()) > _ROUNDED * max(float(np.abs(beauty).max()), 1e-300)
    if wrong or not all(map(_KEPT.fullmatch, names)):
        reason = "do not add up to the beauty" if wrong else "have names that Nuke changes"
        remarks.append(f"the layers {', '.join(names)[:200]} {reason}: the beauty is graded as a whole")
        return flare, remarks
    use = tuple(kept) if singles and "ghosts" in names else ()
    return replace(flare, passes=tuple(names), singles=use), remarks


def _fps_of(contents: ExrContents) -> Fraction | None:
    """Return the frames per second in a header."""
    value = contents.header.get("framesPerSecond")
    try:
        # releases of the library differ: a fraction, or an object with numerator and denominator
        return None if value is None else frame_rate(getattr(value, "n", value) / getattr(value, "d", 1))
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None


def _format(contents: ExrContents) -> str:
    width, height = contents.size_px
    aspect = float(contents.header.get("pixelAspectRatio", 1.0))
    return quoted(f"{width} {height} 0 0 {width} {height} {aspect:g} flare_{width}x{height}")


def _read_knobs(files: Frames, size: str | None) -> tuple[tuple[str, str], ...]:
    ends = (("first", files.first), ("last", files.last), ("origfirst", files.first), ("origlast", files.last))
    knobs = (("file", quoted(files.file)), *((name, str(value)) for name, value in ends), ("origset", "true"))
    return knobs if size is None else (knobs[0], ("format", size), *knobs[1:])


def _gizmo_text(name: str, flare: Passes, graded: tuple[str, ...], gain: float) -> str:
    """Return the text of a gizmo: inputs plate and flare, a knob for each gain, and for the scale of the file."""
    knobs = [("exposure", gain, "exposure"), *((f"gain_{one}", 1.0, one) for one in graded)]
    lines = ["Gizmo {", " inputs 2", f" name {name}", " addUserKnob {20 User l Flarewright}"]
    for knob, value, label in knobs:
        lines += [f" addUserKnob {{7 {knob} l {quoted(label)} R 0 4}}", f" {knob} {value!r}"]
    nodes = [
        Node("Input", "flare", (("number", "1"),)),
        *flare_nodes(flare, "flare", gains="parent.gain_", overall="{{parent.exposure}}"),
    ]
    total = nodes[-1]
    row = total.place[1] + 1
    nodes += [
        Node("Input", "plate", place=(-2, row - 1)),
        Node("Merge2", "Comp", (("operation", "plus"),), ("plate", total.name), (-2, row)),
        Node("Output", "Output1", (), ("Comp",), (-2, row + 1)),
    ]
    head = "\n".join([f"version {_NUKE_VERSION}", *lines, "}"])
    return f"{head}\n{layers_text((*flare.passes, *flare.singles))}{nodes_text(nodes, ' ')}end_group\n"
