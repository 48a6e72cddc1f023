"""The first run: compile what a command needs in more than one process at once (docs/adr/0007).

Numba holds one lock while it compiles, so threads do not help. Each process compiles its share of the kernels that
Python calls ("roots") into Numba's cache on disk; what a helper has compiled is loaded from there. Nothing depends on
the helpers: a root that is not in the cache when it is first called is compiled then.
"""

from __future__ import annotations

import gc
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from importlib import import_module
from typing import Any

from numba.core.sigutils import normalize_signature

from .compile_progress import Progress, reporting, schedule
from .helpers import ahead, helping, is_helper

Shown = Callable[[], AbstractContextManager[Progress | None]]

_GEOMETRY = "i8[::1], i8[::1], f8[::1], f8[::1], f8[::1], f8[::1]"
_BUNDLE = "f8[:,::1], f8[:,::1], i8[:,::1]"
_CANVAS = "f8[:,::1], f8[::1], f8, f8[::1], f4[:,:,:,::1]"
_MASK = "Tuple((f4[::1], f8[:,::1], i8[:,::1]))"
_WINGS = "f8[::1], f8[::1], f8[::1], f8[::1]"

# module and kernel of each root, its types as a render calls it (tests/contracts compares them with real calls), and
# how long it takes to compile by itself
ROOTS = {
    "mesh": (
        "mesh.build_mesh",
        f"{_GEOMETRY}, f8[:,::1], f8[:,:,::1], f8, f8, f8, i8, f8, f8, f8[::1], i8, i8, i8, i8, f8, f8, f8, f8, f8, "
        "f8, i8",
        3.7,
    ),
    "prepass": (
        "prepass.find_box",
        f"{_GEOMETRY}, f8[::1], f8[:,::1], f8, f8, f8, i8, f8, f8, f8[::1], i8, i8, i8, i8, f8, f8, f8[:,::1]",
        3.2,
    ),
    "draw": ("bundle.draw_bundle", f"{_BUNDLE}, f8[::1], i8, f8[:,::1], none, {_CANVAS}, i8", 2.6),
    "draw masked": ("bundle.draw_bundle", f"{_BUNDLE}, f8[::1], i8, f8[:,::1], {_MASK}, {_CANVAS}, i8", 5.0),
    "draw ringing": (
        "ringing.draw_ringing",
        f"{_BUNDLE}, f8[::1], i8, f4[::1], f8[:,::1], f8[:,::1], {_CANVAS}, i8",
        4.4,
    ),
    "densities": ("bundle.node_densities", _BUNDLE, 0.3),
    "measure": ("bundle.measure_bundle", f"{_BUNDLE}, i8, f8[:,::1], f8[:,::1], i8", 0.7),
    "matrices": (
        "matrix.draw_matrix_ghosts",
        "i8[::1], i8[::1], i8[::1], i8[::1], f8[::1], none, f8[::1], f8[:,::1], f8[:,:,::1], f8, f8, f8, f8, f8, "
        "f8[:,::1], f8, none, f8[:,::1], f8[::1], f8, f8[:,:,::1], f8[:,:,::1]",
        2.6,
    ),
    "ghosts' light": (
        "matrix.weigh_matrix_ghosts",
        "i8[::1], i8[::1], i8[::1], i8[::1], f8[::1], none, f8[::1], f8[::1], f8[:,::1], f8, f8, f8, f8, f8, "
        "f8[:,::1], f8, f8[:,::1], f8[::1], f8, f8, f8, i8, f8[:,::1]",
        1.7,
    ),
    "path matrices": ("matrix.path_matrices", "i8[::1], i8[::1], f8[::1], f8[::1], f8[::1], f8, f8[:,:,::1]", 0.1),
    "row sums": ("raster.sum_rows", "f8[:,:,::1], f4[:,:,::1]", 0.1),
    "matrix angles": (
        "matrix.matrix_squares",
        "i8[::1], i8[::1], i8[::1], i8[::1], f8[::1], none, f8[::1], f8[::1], f8, f8, f8, f8, f8, f8, f8[::1]",
        0.6,
    ),
    "blade wings": (
        "resample.blend_blade_wings",
        f"{_WINGS}, f8, f8[:,:,::1], f8[:,:,::1], f8[::1], f8[::1], f8, f8, f8, f8, f4[:,:,::1]",
        0.7,
    ),
    "fan wings": ("resample.blend_fan_wings", f"{_WINGS}, f8[::1], f8, f8, f4[:,:,::1]", 0.3),
    "pixels": ("collect.collect", "f4[:,:,:,::1], f4[:,:,::1]", 0.1),
    "nodes": ("trace.trace_nodes", f"{_GEOMETRY}, f8[::1], f8[:,::1], f8, f8, f8, f8[::1], f8[::1], f8[:,::1]", 1.2),
    "hits": (
        "trace.trace_hits",
        "i8[::1], i8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8, f8, f8, f8[::1], f8[::1], f8[:,:,::1]",
        0.3,
    ),
    "seen": ("standing.seen_rays", "f8[:,::1], f8, f8[:,::1], f8[:,::1], f8[:,::1], f8, f8", 0.2),
    "standing": ("standing.standing_rays", "f8[:,::1], i8[:,::1], b1[::1], i8, i8", 0.2),
    "passing area": ("standing.passing_area", "f8[:,::1], i8[:,::1], b1[::1]", 0.1),
    "traced angles": (
        "standing.traced_squares",
        "i8[::1], i8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8, f8, f8, f8[::1], f8[::1], f8[:,::1]",
        0.7,
    ),
    "reached edges": ("lit_edge.reached_edges", "f8[:,::1], f8, f8, b1[::1]", 0.1),
    "bounded by iris": ("lit_edge.bounded_by_iris", "f8[:,::1], i8[:,::1], f8", 0.2),
    "ghost's box": ("lit_edge.widen_box", "f8[:,::1], f8, f8[:,::1], f8, f8[::1]", 0.1),
    "seen stop": (
        "lit_edge.widen_stops",
        "f8[:,::1], i8[:,::1], f8[:,:,::1], f8[::1], f8, f8[:,::1], f8[:,::1]",
        0.3,
    ),
    "edge's part": (
        "lit_edge.largest_part",
        "f8[:,::1], i8[:,::1], f8[::1], b1[::1], f8, f8, f8[:,::1], f8[:,::1], f8, f8[:,::1]",
        0.3,
    ),
    "shifts": ("standing.wide_shift", "f8[:,::1], f8[:,::1], f8, f8, f8", 0.3),
    "path curves": (
        "path_curves.multiply_steps",
        "f8[:,:,::1], i8[::1], i8[::1], i8[::1], f8[:,::1], f8[:,::1]",
        0.3,
    ),
    "scatter": (
        "scatter.gather_scatter",
        "f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8, UniTuple(i8, 4), f8[:,:,::1], f8[:,::1], "
        "f8[:,:,:,::1], f8[:,::1], UniTuple(f8, 2), f8[::1], f8[:,::1], none, f8, f8[:,::1], i8, f8[:,::1], f8[::1]",
        1.0,
    ),
    "scatter picture": (
        "scatter.spread_polar",
        "f8[::1], b1, UniTuple(f8, 2), UniTuple(f8, 2), f8[:,::1], f8[:,:,::1], f8[::1], f4[:,:,::1]",
        0.4,
    ),
    "scatter share": ("scatter.scattered_total", "f8[:,::1], f8[::1], f8, f8, f8, i8, i8", 0.2),
    "double": ("collect.add_doubled", "f4[:,:,::1], f4[:,:,::1]", 0.1),
}
# roots that take only so long after another one in the same process, whose inner kernels they share
KIN = {
    "prepass": ("mesh", 1.9),
    "nodes": ("mesh", 0.3),
    "measure": ("draw", 0.5),
    "densities": ("draw", 0.1),
    "ghosts' light": ("matrices", 0.8),
    "matrix angles": ("matrices", 0.3),
    "path matrices": ("matrices", 0.1),
}
# what a helper loses to its own start
_START = 0.7


def compile_together(names: Sequence[str], processes: int, shown: Shown | None = None) -> None:
    """Compile roots that are not in the cache, some of them in other processes.

    Returns at once when the cache holds them, when Numba does not compile or has nowhere to cache, or when there is
    only one process to use and no progress to show: then each root is compiled when it is first called.

    Parameters
    ----------
    names : sequence of str
        Keys of `ROOTS` that the command will call.
    processes : int
        Largest number of processes, this one included.
    shown : callable, optional
        Called only when something is to be compiled. Returns a context; its value is called with the part done (0 to 1)
        and a few words, or is None to show nothing.
    """
    if is_helper():
        return
    missing = absent(names)
    begun = [helper for helper in ahead() if set(helper.names) & set(missing)]
    others = {name for helper in begun for name in helper.names}
    shares = divided([name for name in missing if name not in others], max(processes - len(begun), 1))
    alone = len(shares) + len(begun) < 2
    if not missing or (alone and shown is None):
        return
    # the others are at work before this process gets something to show
    with helping(shares[1:]) as helpers, nullcontext() if shown is None else shown() as progress:
        if alone and progress is None:
            return
        own, *theirs = shares or [[]]
        busy = [_START + sum(_each(share)) for share in theirs] + [sum(_each(helper.names)) for helper in begun]
        with reporting(schedule(_each(own), busy), progress) as compiled:
            compile_roots(own, compiled)
            for helper in (*helpers, *begun):
                helper.wait()


def _each(share: Sequence[str]) -> list[float]:
    """Return how long each root of a share takes after those before it, seconds."""
    return [_seconds(name, share[:k]) for k, name in enumerate(share)]


def divided(names: Sequence[str], processes: int) -> list[list[str]]:
    """Divide roots over processes, the slowest first, each to the one that would be done with it first.

    Parameters
    ----------
    names : sequence of str
    processes : int

    Returns
    -------
    list of list of str
        The first share is this process'; none is empty.
    """
    busy = [0.0, *[_START] * (processes - 1)]
    shares: list[list[str]] = [[] for _ in busy]
    for name in sorted(names, key=lambda name: -ROOTS[name][2]):
        done = [begun + _seconds(name, share) for begun, share in zip(busy, shares, strict=True)]
        first = done.index(min(done))
        busy[first] = done[first]
        shares[first].append(name)
    return [share for share in shares if share]


def _seconds(name: str, share: Sequence[str]) -> float:
    kin, seconds = KIN.get(name, ("", 0.0))
    return seconds if kin in share else ROOTS[name][2]


def absent(names: Sequence[str]) -> list[str]:
    """Return the roots of which the cache on disk holds nothing that fits the sources; none where nothing is cached."""
    return [name for name in names if not _held(kernel(name))]


def kernel(name: str) -> Any:
    """Return the kernel of a root."""
    module, function = ROOTS[name][0].split(".")
    return getattr(import_module(f"{__package__}.{module}"), function)


def types(name: str) -> tuple[Any, ...]:
    """Return the types that a render calls a root with; the cache knows a kernel by them."""
    found, _ = normalize_signature(f"({ROOTS[name][1]},)")
    return tuple(found)


def _held(dispatcher: Any) -> bool:
    try:
        # Numba has no public way to look into its cache without a call
        return bool(dispatcher._cache._cache_file._load_index())
    except Exception:
        # not compiled, not cached, or another Numba: there is nothing to win
        return True


def compile_roots(names: Sequence[str], compiled: Callable[[], None] = lambda: None) -> None:
    """Compile roots for the types that a render calls them with, into the cache on disk.

    Parameters
    ----------
    names : sequence of str
        Keys of `ROOTS`.
    compiled : callable, optional
        Called after each.
    """
    with _uncollected():
        for name in names:
            # what cannot be compiled ahead tells so when it is called
            with suppress(Exception):
                kernel(name).compile(types(name))
            compiled()


def help_out(names: Sequence[str]) -> None:
    """Compile roots in a helper, and end the process.

    Parameters
    ----------
    names : sequence of str
        Keys of `ROOTS`.
    """

    def end_with_parent() -> None:
        # the pipe closes when the command ends, however it ends
        os.read(0, 1)
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    compile_roots(absent(names))
    os._exit(0)


@contextmanager
def _uncollected() -> Iterator[None]:
    """Leave the garbage collector out of the compiler's way: it takes a tenth of the time and finds little.

    Nor does it look later at what stands then: the compiler's half a million objects took it 0.4 s at the first chance,
    in every process, and no memory came back.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.freeze()
            gc.enable()
