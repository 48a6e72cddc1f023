"""`flarewright warm-up`: compile the kernels before the first render."""

from __future__ import annotations

import time

from .common import first_run_bar, print_remarks

EPILOG = "In a container's recipe, after the installation: flarewright warm-up"


def warm_up() -> None:
    """Compile the kernels of renders and of the editor now, so that the first command starts at once.

    They are stored in the cache of the installation (or in the folder of NUMBA_CACHE_DIR) until the program changes.
    """
    from ..kernels.jit import warmup
    from ..kernels.jit.roots import roots
    from ..kernels.jit.warmup_processes import cores

    names = warmup.absent(roots())
    if not names:
        print_remarks(["all kernels are compiled already"])
    else:
        print_remarks([f"compiling {len(names)} kernels on {cores()} cores, once for this installation"])
        started = time.perf_counter()
        warmup.compile_together(names, cores(), first_run_bar)
        # on one core, or without permission to start processes, nothing is compiled ahead
        warmup.compile_roots(warmup.absent(names))
        print_remarks([f"compiled in {time.perf_counter() - started:.0f} s"])
