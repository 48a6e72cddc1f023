"""The scene as a file, which `flarewright shot --track` reads, and the names of the files."""

import json
import os
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from .errors import FlareError
from .vectors import Matrix, Vector

# the largest number of lights and frames of a file (docs/placing-lights.md)
MOST_LIGHTS, MOST_FRAMES = 1000, 10_000
# luminance of linear Rec.709
LUMINANCE = (0.2126390059, 0.7151686788, 0.0721923154)


class LightPath:
    """The states of one light, frame by frame, as they are found.

    Parameters
    ----------
    name : str
    kind : str
        "sun", "point", "spot" or "area".
    """

    def __init__(self, name: str, kind: str) -> None:
        self.name, self.kind = name, kind
        self.size = 0.0
        self._states: dict[int, dict[str, Any]] = {}

    def add(self, frame: int, matrix: Matrix, rgb: Vector, part: float, size: float) -> None:
        """Add a frame.

        Parameters
        ----------
        frame : int
        matrix : sequence
            Four rows, from the light to the world.
        rgb : tuple of float
            Irradiance at the camera of the whole light, linear Rec.709.
        part : float
            Part of it that nothing hides.
        size : float
            Radius, or the angular diameter of a sun in degrees.
        """
        level = max(sum(weight * max(value, 0.0) for weight, value in zip(LUMINANCE, rgb, strict=True)), 0.0)
        peak = max(rgb)
        seen = part > 0.0 and level > 0.0 and peak > 0.0
        self._states[frame] = {
            "frame": frame,
            "matrix": [list(row) for row in matrix],
            "intensity": level * part if seen else 0.0,
            # also of a hidden light: colours between two frames are interpolated
            "rgb": [max(value, 0.0) / peak for value in rgb] if peak > 0.0 else [1.0, 1.0, 1.0],
            "visible": seen,
        }
        self.size = max(self.size, size)

    @property
    def lit(self) -> bool:
        """Whether any light reaches the camera."""
        return any(state["visible"] for state in self._states.values())

    def data(self, frames: Sequence[int]) -> dict[str, Any]:
        """Return the light as the file has it; it is off in frames in which it was not found."""
        states, last = [], next(iter(self._states.values()))
        for frame in frames:
            if frame in self._states:
                last = self._states[frame]
                states.append(last)
            else:
                states.append({**last, "frame": frame, "intensity": 0.0, "visible": False})
        size = {"diameter_deg": min(self.size, 60.0)} if self.kind == "sun" else {"radius": self.size}
        return {"name": self.name[:200], "kind": self.kind, **size, "frames": states}


def scene_data(fps: float, camera: str, states: Sequence[dict[str, Any]], paths: Sequence[LightPath]) -> dict[str, Any]:
    """Return a scene as the file has it (docs/placing-lights.md).

    Raises
    ------
    FlareError
        There are no lights that reach the camera, or too many.
    """
    lit = [path for path in paths if path.lit]
    if not lit:
        what = "no light of the scene reaches the camera" if paths else "the scene has no light"
        raise FlareError(f"{what}; add a lamp, or mark a glowing object in its properties under Flarewright")
    if len(lit) > MOST_LIGHTS:
        raise FlareError(f"{len(lit)} lights reach the camera, more than {MOST_LIGHTS}; choose a collection of lights")
    frames = [state["frame"] for state in states]
    return {
        "format": "flarewright-scene",
        "version": 1,
        "fps": fps,
        "camera": {"name": camera[:200] or "Camera", "frames": list(states)},
        "lights": [path.data(frames) for path in lit],
    }


def write_json(data: dict[str, Any], path: Path) -> None:
    """Write a file whole or not at all.

    Raises
    ------
    FlareError
        The folder or the file cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(json.dumps(data, separators=(",", ":")), encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise FlareError(f"cannot write {path}: {error.strerror or error}; choose another output") from None


def frame_pattern(text: str) -> tuple[Path, Path]:
    """Return the pattern of the frames and the file of the scene beside them.

    Raises
    ------
    FlareError
        The name has no place for the number of the frame, or no folder.

    Examples
    --------
    >>> frame_pattern("/shots/flare.####.exr")[1].name
    'flare.scene.json'
    """
    path = Path(text)
    if len(re.findall("#+", path.name)) != 1:
        raise FlareError(f"the output {text!r} has no place for the number of a frame; name it flare.####.exr")
    if path.suffix.lower() != ".exr":
        raise FlareError(f"the output {text!r} is no EXR file; name it flare.####.exr")
    name = re.sub(r"[._-]*#+[._-]*", ".", path.stem).strip(".") or "flare"
    return path, path.with_name(f"{name}.scene.json")


def frame_file(pattern: Path, frame: int) -> Path:
    """Return the file of a frame.

    Examples
    --------
    >>> frame_file(Path("flare.####.exr"), 7).name
    'flare.0007.exr'
    """
    return pattern.with_name(re.sub("#+", lambda found: f"{frame:0{len(found[0])}d}", pattern.name))
