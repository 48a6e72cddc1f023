"""Predict a lens' flare over the constellation, from the project to the curves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..model import Project
    from ..predict.occurrence import Occurrence, Wanted
    from ..typing import Progress


def flare_curves(
    project: Project,
    wanted: Wanted | None = None,
    *,
    quality: str = "final",
    threads: int | None = None,
    progress: Callable[[str], Progress] = lambda _: lambda _part, _words: None,
    processes: int | None = None,
    cluster: str | None = None,
    announce: Callable[[str], None] | None = None,
) -> Occurrence:
    """Predict sum, mean, maximum and log-average of a lens' flare over the constellation.

    Parameters
    ----------
    project : Project
        With one light; its spectrum, distance and size count, and its angle is varied.
    wanted : Wanted, optional
        Range, tolerance and pictures (default: `predict.occurrence.Wanted()`).
    quality : {"draft", "final"}
        Quality of the renders behind the curves.
    threads : int, optional
        Default: all cores; the curves do not depend on it.
    progress : callable
        Called with the name of a part of the work; returns the progress callback of that part.
    processes, cluster, announce
        As of `flare_pictures.pictures_elsewhere`; the curves do not depend on them.

    Raises
    ------
    FlarewrightError
        When the lens cannot be rendered, or there is no such cluster.

    Examples
    --------
    >>> import flarewright as fw
    >>> from flarewright.predict import Wanted
    >>> project = fw.Project(lens="heliar-tronnier", lights=(fw.Light(field_deg=(0, 0)),))
    >>> found = flare_curves(project, Wanted(to_deg=20.0, checks=0), quality="draft")  # doctest: +SKIP
    >>> found.curves.constellation_deg  # doctest: +SKIP
    """
    from ..predict.occurrence import Wanted, predict_occurrence
    from .flare_pictures import pictures_elsewhere
    from .lens_flares import lens_flares

    with pictures_elsewhere(cluster, processes, threads, Path(), announce) as spread:
        flares = lens_flares(project, quality, threads)
        return predict_occurrence(flares, Wanted() if wanted is None else wanted, progress, spread=spread)
