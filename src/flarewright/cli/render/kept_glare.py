"""The veiling glare index of a command, whose finished directions are kept in the state folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..partial_work import partial_work

if TYPE_CHECKING:
    from ...model import Project
    from ...render.scattering.veiling_glare import VeilingGlare
    from ...typing import Progress


def kept_glare(
    project: Project, wavelength_nm: float, *, threads: int | None = None, progress: Progress | None = None
) -> VeilingGlare:
    """Compute the veiling glare index; with scatter, which takes minutes for some lenses, an interrupted run resumes.

    Parameters
    ----------
    project, wavelength_nm, threads, progress
        As of `render.scattering.veiling_glare.veiling_glare`.
    """
    from ..._version import __version__
    from ...render.image.partial_picture import digest_of
    from ...render.scattering.scatter_pass import chosen_scatter
    from ...render.scattering.veiling_glare import veiling_glare
    from ...render.scene.resolve import resolve_project

    settled = resolve_project(project)
    scatter = chosen_scatter(settled)
    if scatter is None:
        return veiling_glare(project, wavelength_nm, threads=threads, progress=progress)
    inputs = (project, settled.lens, settled.order, settled.coating, scatter, wavelength_nm)
    digest = digest_of(__version__, *inputs)
    with partial_work(None, ["veiling glare", digest], "direction", "directions") as steps:
        return veiling_glare(project, wavelength_nm, threads=threads, progress=progress, step=steps.step)
