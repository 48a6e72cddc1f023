"""Types that many modules share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""Double-precision numbers: coordinates, matrices, spectra."""

Pixels = NDArray[np.float32]
"""Single-precision numbers: pictures and other large arrays."""

Indices = NDArray[np.int64]
"""Integers: rows, paths, corners."""

Mask = NDArray[np.bool_]
"""Boolean mask."""

Progress = Callable[[float, str], None]
"""Callback of long computations: takes the finished part (0 to 1) and the name of the current step."""

Report = Callable[[str], None]
"""Callback that takes one line for the user."""

__all__ = ["Floats", "Indices", "Mask", "Pixels", "Progress", "Report"]
