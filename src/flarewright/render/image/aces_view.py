"""The ACES view of opencolorio's built-in configuration (the extra `color`), baked into a cube."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ProjectError
from ...typing import Pixels

# side of the cube, and the range of its axes in stops around 1
_CUBE, _LOW, _HIGH = 40, -14.0, 12.0


def aces_available() -> bool:
    """Return whether opencolorio is installed."""
    from importlib.util import find_spec

    return find_spec("PyOpenColorIO") is not None


def aces_pixels(light: Pixels) -> NDArray[np.uint8]:
    """Return linear light in the ACES view, by linear interpolation in the baked cube.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3)
        Linear Rec.709, with the exposure applied; negative values count as 0.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8

    Raises
    ------
    ProjectError
        opencolorio is not installed.
    """
    cube = _cube()
    place = (np.log2(np.maximum(light, 2.0**_LOW)) - _LOW) / (_HIGH - _LOW) * (_CUBE - 1)
    place = np.clip(place, 0.0, _CUBE - 1.001).astype(np.float32)
    low = place.astype(np.intp)
    part = place - low
    out = np.zeros_like(light)
    for corner in range(8):
        step = np.array([corner >> 2 & 1, corner >> 1 & 1, corner & 1])
        weight = np.prod(np.where(step == 1, part, 1.0 - part), axis=2, keepdims=True)
        at = low + step
        out += weight * cube[at[..., 0], at[..., 1], at[..., 2]]
    return (np.clip(out, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


@lru_cache(maxsize=1)
def _cube() -> Pixels:
    """Bake the view into a cube; applying opencolorio to a whole picture takes 0.2 s."""
    if not aces_available():
        raise ProjectError("the aces view needs opencolorio: pip install 'flarewright[color]', or choose filmic")
    import PyOpenColorIO

    config: Any = PyOpenColorIO.Config.CreateFromFile("ocio://default")
    display = config.getDefaultDisplay()
    chosen = PyOpenColorIO.DisplayViewTransform(
        src="lin_rec709_scene", display=display, view=config.getDefaultView(display)
    )
    processor = config.getProcessor(chosen).getDefaultCPUProcessor()
    axis = np.exp2(np.linspace(_LOW, _HIGH, _CUBE, dtype=np.float32))
    axis[0] = 0.0
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    baked = np.ascontiguousarray(grid, dtype=np.float32)
    processor.applyRGB(baked)
    return np.clip(baked.reshape(_CUBE, _CUBE, _CUBE, 3), 0.0, 1.0)
