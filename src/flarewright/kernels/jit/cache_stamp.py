"""Cache validity: recompile a kernel when the source of any kernel changes.

A compiled kernel contains the code of its callees, but Numba checks only the kernel's own source file. After an update
or an edit, kernels would keep running the old code of their callees.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any


def stamp_of(folder: Path) -> tuple[float, int]:
    """Return the latest modification time and the total size of all modules under a folder."""
    files = [path.stat() for path in folder.rglob("*.py")]
    return max((one.st_mtime for one in files), default=0.0), sum(one.st_size for one in files)


_STAMP = stamp_of(Path(__file__).parents[1])


def stamp_cache(kernel: Any) -> None:
    """Make a kernel's cache entry valid only while no module of `flarewright.kernels` changes.

    Parameters
    ----------
    kernel : dispatcher
        Changed in place.
    """
    # the kernel has no cache, or an unsupported Numba version stores the stamp elsewhere
    with suppress(AttributeError):
        kernel._cache._cache_file._source_stamp = (kernel._cache._cache_file._source_stamp, *_STAMP)
