"""Catalogue glasses that a designed lens may use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import ProjectError
from ...io.lens.glass_catalogue import MAKERS, CatalogueGlass, by_name, glasses_of
from ...model import Medium
from ...typing import Floats

# glasses whose n_d differ by less than this make the same ghosts to first order: one of them suffices
SAME_INDEX = 2e-4


@dataclass(frozen=True, eq=False)
class GlassList:
    """Catalogue glasses by increasing index.

    Attributes
    ----------
    glasses : tuple of CatalogueGlass
    n_d : ndarray, shape (M,)
    """

    glasses: tuple[CatalogueGlass, ...]
    n_d: Floats

    def nearest(self, n_d: float, count: int) -> list[int]:
        """Return the numbers of up to `count` glasses nearest in index, nearest first."""
        return [int(k) for k in np.argsort(np.abs(self.n_d - n_d), kind="stable")[:count]]

    def medium(self, number: int) -> Medium:
        """Return a glass as a medium of a lens file."""
        glass = self.glasses[number]
        return Medium(glass=glass.full_name, n_d=glass.n_d, v_d=round(glass.v_d, 2), dispersion=glass.dispersion)


def glass_list(entries: tuple[str, ...], n_d: tuple[float, float]) -> GlassList:
    """Look up glasses by name or by maker.

    Parameters
    ----------
    entries : tuple of str
        Makers, glasses, or "all"; case does not matter.
    n_d : tuple of float
        Least and largest index; glasses outside are dropped.

    Returns
    -------
    GlassList
        Of several glasses with the same index, only the one that comes first in `entries`.

    Raises
    ------
    GlassError
        A name is in no catalogue.
    ProjectError
        No glass has an index inside the limits.
    """
    named: list[CatalogueGlass] = []
    for entry in entries:
        word = entry.strip().upper()
        if word == "ALL":
            named += [glass for maker in MAKERS for glass in glasses_of(maker)]
        else:
            named += glasses_of(word) or (by_name(entry),)
    kept: list[CatalogueGlass] = []
    # a stable sort: of equals the first named stays first
    for glass in sorted(named, key=lambda one: one.n_d):
        if n_d[0] <= glass.n_d <= n_d[1] and not (kept and glass.n_d - kept[-1].n_d < SAME_INDEX):
            kept.append(glass)
    if not kept:
        raise ProjectError(
            f"none of design.glasses has an index between {n_d[0]:g} and {n_d[1]:g}; name other glasses, or widen "
            "design.bounds.n_d"
        )
    return GlassList(tuple(kept), np.array([glass.n_d for glass in kept]))
