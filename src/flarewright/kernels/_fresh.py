"""Compile a kernel anew when any kernel has changed: each holds the code of those that it calls.

Numba asks only whether a kernel's own file has changed. In a checkout that was brought up to date, or in which somebody
works, kernels would go on with other kernels' code of before.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any


def stamp_of(folder: Path) -> tuple[float, int]:
    """Return when a folder's modules were changed last, and how large they are: other code, another stamp."""
    files = [path.stat() for path in folder.glob("*.py")]
    return max((one.st_mtime for one in files), default=0.0), sum(one.st_size for one in files)


_STAMP = stamp_of(Path(__file__).parent)


def ask_all(kernel: Any) -> None:
    """Have a kernel's cache hold only while no kernel of this folder changes.

    Parameters
    ----------
    kernel : dispatcher
        Changed.
    """
    # nothing is cached, or by another Numba's ways
    with suppress(AttributeError):
        kernel._cache._cache_file._source_stamp = (kernel._cache._cache_file._source_stamp, *_STAMP)
