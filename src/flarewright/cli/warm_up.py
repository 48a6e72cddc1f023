"""`flarewright warm-up`: compile the kernels ahead of the first render."""

from __future__ import annotations

import time

from .common import first_run_bar, tell

EPILOG = "In a container's recipe, after the installation: flarewright warm-up"


def warm_up() -> None:
    """Compile the kernels of renders now, so that the first command begins at once.

    They are kept in the cache of the installation (or the folder that NUMBA_CACHE_DIR names) until the program changes.
    """
    from ..kernels import first_run
    from ..kernels.helpers import cores

    names = first_run.absent(list(first_run.ROOTS))
    if not names:
        tell(["all kernels are compiled already"])
    else:
        tell([f"compiling {len(names)} kernels on {cores()} cores, once for this installation"])
        begun = time.perf_counter()
        first_run.compile_together(names, cores(), first_run_bar)
        # on one core, and in a process that may start no other, they are left
        first_run.compile_roots(first_run.absent(names))
        tell([f"compiled in {time.perf_counter() - begun:.0f} s"])
    _draw_once()


def _draw_once() -> None:
    """Draw two small pictures: kernels that are quick to compile are in no table."""
    from ..model import Camera, Light, Output, Preset, Project, Quality
    from ..render.display import view
    from ..render.render import render

    shot = Project(
        lens="triplet-pestrecov", f_number=8.0, coating=Preset(name="staggered"), camera=Camera(size_px=(64, 36)),
        lights=(Light(field_deg=(8.0, 4.0), diameter_deg=0.25),), output=Output(layers="passes", gamut="compress"),
    )  # fmt: skip
    for quality in (Quality(), Quality(mode="draft", wavelengths=3)):
        view(render(shot.replace(quality=quality)).layers[0].pixels)
