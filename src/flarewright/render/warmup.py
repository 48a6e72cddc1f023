"""Compile the kernels that a command needs before its first run (docs/adr/0007)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..kernels.jit.roots import needed
from ..kernels.jit.warmup import Shown, absent, compile_together
from ..kernels.jit.warmup_processes import cores, is_helper
from ..model import Bare, Lens, Project
from ..optics.lens.paths import ghost_paths
from ..optics.lens.surface_shape import shape_table
from ..optics.rays.pack import resolve_coatings
from .scene.resolve import resolve_project

if TYPE_CHECKING:
    from ..typing import Report

FIRST = "first run: the kernels are compiled once, in some 10 to 40 seconds; flarewright warm-up does it ahead of time"


def compile_for_render(
    project: Project, threads: int | None = None, report: Report | None = None, shown: Shown | None = None
) -> None:
    """Compile the kernels of a render that are not compiled yet.

    Parameters
    ----------
    project : Project
    threads : int, optional
        Largest number of processes; None: one per core.
    report : callable, optional
        Called with one sentence when something has to be compiled.
    shown : callable, optional
        As in `kernels.jit.warmup.compile_together`.

    Raises
    ------
    FlarewrightError
        The project cannot be rendered; raised before anything is compiled.
    """
    names = needed(traits(project))
    # a helper process leaves compiling to its first calls
    if is_helper() or not absent(names):
        return
    if report is not None:
        report(FIRST)
    compile_together(names, min(threads or cores(), cores()), shown)


def compile_for_analysis(lens: Lens, shown: Shown | None = None) -> None:
    """Compile the kernels of the ghost analysis of a lens that are not compiled yet.

    Parameters
    ----------
    lens : Lens
    shown : callable, optional
        As in `compile_for_render`.
    """
    compile_together(needed({"ghosts", _shape(lens)}), cores(), shown)


def traits(project: Project) -> set[str]:
    """Return the features of a render that decide which kernels it calls (`kernels.jit.roots`).

    Raises
    ------
    FlarewrightError
        The project cannot be rendered.
    """
    # imported here: the ghost analysis does not need the drawing code
    from .ghosts.draft_ghosts import CROWDED_GHOSTS

    settled, quality = resolve_project(project), project.quality
    masked = settled.iris.mask is not None
    coated = any(coating not in (None, Bare()) for coating in resolve_coatings(settled.lens, settled.coating))
    # rings are rarely visible wide open or with extended lights
    seen = project.f_number is not None and not all(light.extended for light in project.lights)
    crowded = len(ghost_paths(settled.lens, quality.paths)) * len(project.lights) >= CROWDED_GHOSTS
    optional = {
        "area": any(light.extended for light in project.lights),
        "coated": coated,
        "colours": quality.bridge and quality.wavelengths > 1,
        "crowded": crowded,
        "rings": quality.ringing != "off",
        "seen-rings": quality.ringing != "off" and seen,
        "scatter": project.scatter is not None and project.scatter.model != "none",
        "spikes": project.output.starburst and settled.iris.blades > 0 and not masked,
        "fan": project.output.starburst and (settled.iris.blades == 0 or masked),
    }
    return {quality.mode, _shape(settled.lens), "masked" if masked else "open"} | {
        trait for trait, present in optional.items() if present
    }


def _shape(lens: Lens) -> str:
    """Return the trait of a lens: all rows centred conics, or rows of any shape."""
    return "conic" if shape_table(lens) is None else "shaped"
