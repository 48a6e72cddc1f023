"""Check that layers fit into the memory."""

from __future__ import annotations

from math import inf
from pathlib import Path

MEMINFO = Path("/proc/meminfo")


def spare_bytes() -> float:
    """Return the number of bytes that the system can still allocate; infinite if unknown.

    Notes
    -----
    Linux grants any allocation and kills the process, without a message, when it uses memory that does not exist. So
    requests that are too large must fail before.
    """
    try:
        lines = dict(line.split(":", 1) for line in MEMINFO.read_text().splitlines())
        return 1024.0 * sum(int(lines[name].split()[0]) for name in ("MemAvailable", "SwapFree"))
    except (OSError, ValueError, KeyError):
        return inf


def check_memory(size: float, spare: float) -> None:
    """Raise `MemoryError` if layers need more memory than there is.

    Parameters
    ----------
    size, spare : float
        Bytes that the layers need, and bytes that are available (`spare_bytes`).

    Raises
    ------
    MemoryError
        They do not fit.
    """
    if size > spare:
        raise MemoryError
