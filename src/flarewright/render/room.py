"""How much memory a picture may take."""

from __future__ import annotations

from math import inf
from pathlib import Path

MEMINFO = Path("/proc/meminfo")


def spare_bytes() -> float:
    """Return how many bytes the system can still give; infinite where it does not tell.

    Notes
    -----
    Linux promises any amount and ends, without a word, the process that takes it at its word. So what is known to be
    too much has to be refused before.
    """
    try:
        lines = dict(line.split(":", 1) for line in MEMINFO.read_text().splitlines())
        return 1024.0 * sum(int(lines[name].split()[0]) for name in ("MemAvailable", "SwapFree"))
    except (OSError, ValueError, KeyError):
        return inf


def need(size: float, spare: float) -> None:
    """Refuse to hold more bytes than there are.

    Parameters
    ----------
    size, spare : float
        Bytes that layers take, and those that there were for them (`spare_bytes`).

    Raises
    ------
    MemoryError
        When they do not fit.
    """
    if size > spare:
        raise MemoryError
