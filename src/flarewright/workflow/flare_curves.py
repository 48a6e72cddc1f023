"""Predict a lens' flare over the constellation, from the project to the curves."""

from __future__ import annotations

from collections.abc import Callable
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

    Returns
    -------
    Occurrence

    Raises
    ------
    FlarewrightError
        When the lens cannot be rendered.

    Examples
    --------
    >>> import flarewright as fw
    >>> from flarewright.predict import Wanted
    >>> project = fw.Project(lens="heliar-tronnier", lights=(fw.Light(field_deg=(0, 0)),))
    >>> found = flare_curves(project, Wanted(to_deg=20.0, checks=0), quality="draft")  # doctest: +SKIP
    >>> found.curves.angles_deg  # doctest: +SKIP
    """
    from ..predict.occurrence import Wanted, predict_occurrence
    from .lens_flares import lens_flares

    return predict_occurrence(lens_flares(project, quality, threads), Wanted() if wanted is None else wanted, progress)
