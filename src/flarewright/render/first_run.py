"""What a command compiles on its first run (docs/adr/0007)."""

from __future__ import annotations

from collections.abc import Callable

from ..kernels.first_run import Shown, absent, compile_together
from ..kernels.helpers import TRACING, cores
from ..model import Bare, Project
from ..optics.pack import resolve_coatings
from ..optics.paths import ghost_paths
from .prepare import settle

FIRST = "first run: the kernels are compiled once, in some 10 to 40 seconds; flarewright warm-up does it ahead of time"
# what every command calls that traces rays
_TRACING = (*sum(TRACING, ()), "measure")
# what a render with scatter calls besides; that of a lens file compiles when it is called
_SCATTERING = ("hits", "scatter", "scatter picture", "scatter share")


def compile_for_render(
    project: Project,
    threads: int | None = None,
    report: Callable[[str], None] | None = None,
    shown: Shown | None = None,
) -> None:
    """Compile what a render calls, unless it is compiled.

    Parameters
    ----------
    project : Project
    threads : int, optional
        Most processes to use; None: one a core.
    report : callable, optional
        Told a sentence when something has to be compiled.
    shown : callable, optional
        As of `kernels.first_run.compile_together`.

    Raises
    ------
    FlarewrightError
        When the project cannot be rendered: nobody waits for a compiler to hear that.
    """
    scattering = _SCATTERING if project.scatter is not None and project.scatter.model != "none" else ()
    if not absent((*_TRACING, *scattering)):
        return
    settled = settle(project)
    if report is not None:
        report(FIRST)
    iris = settled.iris
    coated = any(coating not in (None, Bare()) for coating in resolve_coatings(settled.lens, settled.coating))
    names = [*_TRACING, *scattering]
    if project.quality.mode == "final":
        names += ["draw" if iris.mask is None else "draw masked", "densities", "pixels", "double"]
        if project.quality.bridge and project.quality.wavelengths > 1:
            names += ["shifts", "seen", "standing", "passing area"]
            names += ["traced angles", "path curves"] if coated else []
        if project.quality.ringing != "off":
            names += ["path matrices", "reached edges", "edge's part"]
            # wide open, and with lights that have a size, rings are rarely seen: what draws them is compiled when it
            # is called
            if project.f_number is not None and not all(light.extended for light in project.lights):
                names += ["draw ringing", "bounded by iris", "ghost's box"]
    elif project.quality.mode == "draft" and iris.mask is None:
        # a draft through a mask is rare: its kernel is compiled when it is called
        # only here: what the ghost analysis starts with need not know how ghosts are drawn
        from .ghosts import CROWD

        names += ["matrices", "path matrices", "row sums"]
        names += ["matrix angles", "path curves"] if coated else []
        bridged = project.quality.bridge and project.quality.wavelengths > 1
        if bridged or len(ghost_paths(settled.lens, project.quality.paths)) * len(project.lights) >= CROWD:
            names += ["ghosts' light"]
    if project.output.starburst:
        names += ["fan wings" if iris.blades == 0 or iris.mask is not None else "blade wings"]
    compile_together(names, min(threads or cores(), cores()), shown)


def compile_for_analysis(shown: Shown | None = None) -> None:
    """Compile what the ghost analysis calls, unless it is compiled; `shown` as of `compile_for_render`."""
    compile_together([*_TRACING, "draw", "densities"], cores(), shown)
