"""The roots: kernels that Python calls, each with the argument types of one kind of call (docs/adr/0007).

`tools/record_roots.py` runs commands and writes what they call to `roots.json`. No import of Numba, so that helper
processes start at once.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

# seconds until a helper process has started
START_S = 0.7


@dataclass(frozen=True)
class Root:
    """A kernel and the types of its arguments.

    Attributes
    ----------
    kernel : str
        Module under `flarewright.kernels`, and function.
    types : str
        Argument types, an expression in Numba's names of types; that of a named tuple has the path of its class.
    seconds : float
        CPU seconds to compile it alone.
    kin : str
        Another root that shares inner kernels with it; "" for none.
    seconds_after_kin : float
        CPU seconds to compile it after `kin` in the same process.
    needs : tuple of frozenset of str
        The smallest sets of traits with which a command called it; none if only commands without traits do.
    """

    kernel: str
    types: str
    seconds: float
    kin: str
    seconds_after_kin: float
    needs: tuple[frozenset[str], ...]


@cache
def roots() -> dict[str, Root]:
    """Return all roots by name: the name of the function, numbered if it has several types."""
    table = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
    return {
        name: Root(**(row | {"needs": tuple(frozenset(need.split()) for need in row["needs"])}))
        for name, row in table.items()
    }


def needed(traits: Collection[str]) -> list[str]:
    """Return the roots that a command calls.

    Parameters
    ----------
    traits : collection of str
        Features of the command, as in `render.warmup`.
    """
    return [name for name, root in roots().items() if any(need <= set(traits) for need in root.needs)]


def tracing_roots() -> list[str]:
    """Return the roots that every render and ghost analysis of a lens of centred conics calls."""
    called = [
        needed(traits) for traits in ({"final", "conic", "open"}, {"draft", "conic", "open"}, {"ghosts", "conic"})
    ]
    return [name for name in called[0] if all(name in each for each in called[1:])]


def drawing_roots() -> list[str]:
    """Return the further roots of every final render of a lens of centred conics with an iris of blades."""
    traced = tracing_roots()
    return [name for name in needed({"final", "conic", "open"}) if name not in traced]


def durations(share: Sequence[str]) -> list[float]:
    """Return the seconds that each root of a share takes after those before it."""
    return [_seconds(name, share[:k]) for k, name in enumerate(share)]


def divide_roots(names: Iterable[str], processes: int) -> list[list[str]]:
    """Divide roots over processes: the slowest first, each to the process that would finish it first.

    Roots of one kernel stay together: Numba writes the cache index of a kernel without a lock.

    Parameters
    ----------
    names : iterable of str
    processes : int

    Returns
    -------
    list of list of str
        The first share belongs to this process; no share is empty.
    """
    busy = [0.0, *[START_S] * (processes - 1)]
    shares: list[list[str]] = [[] for _ in busy]
    for name in sorted(names, key=lambda name: -roots()[name].seconds):
        done = [started + _seconds(name, share) for started, share in zip(busy, shares, strict=True)]
        same = [k for k, share in enumerate(shares) if roots()[name].kernel in (roots()[each].kernel for each in share)]
        first = same[0] if same else done.index(min(done))
        busy[first] = done[first]
        shares[first].append(name)
    return [share for share in shares if share]


def _seconds(name: str, share: Sequence[str]) -> float:
    root = roots()[name]
    return root.seconds_after_kin if root.kin in share else root.seconds
