"""One sample of a lens within manufacturing tolerances: decentred and tilted groups, figure errors."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np

from ...errors import ProjectError
from ...model import Element, Figure, Imperfection, Lens, Surface
from .paths import LightPath

# Noll indices of figure errors: astigmatism, coma, trefoil, first spherical and following terms; no tilt or power
TERMS = tuple(range(5, 16))


def glass_groups(lens: Lens) -> tuple[tuple[int, int], ...]:
    """Return the groups of rows that are one piece: single or cemented lenses.

    Returns
    -------
    tuple of (int, int)
        First and last row of each.
    """
    groups = []
    first = None
    for k, row in enumerate(lens.rows):
        if not isinstance(row, Surface):
            continue
        if first is None:
            first = k
        if row.medium is None:
            groups.append((first, k))
            first = None
    return tuple(groups)


def imperfect(lens: Lens, sample: Imperfection | None) -> Lens:
    """Return one sample of a lens.

    Parameters
    ----------
    lens : Lens
    sample : Imperfection or None
        None: the nominal lens.

    Returns
    -------
    Lens
        The same lens when all tolerances are 0.

    Raises
    ------
    ProjectError
        When the lens file has [[elements]].

    Notes
    -----
    Decentres and tilts are uniform within a disc; a figure is a Gaussian vector over Noll's terms 5 to 15, scaled to a
    root mean square that is uniform between 0 and the tolerance. Each piece and surface has separate random numbers,
    scaled by the tolerances: a wider tolerance moves everything farther in the same direction.
    """
    if sample is None or not (sample.decentre_um or sample.tilt_arcmin or sample.figure_nm):
        return lens
    if any(element.displaced for element in lens.elements):
        raise ProjectError(
            f"{lens.name} has moved elements ([[elements]] of its file), which imperfection cannot combine; remove "
            "one of the two"
        )
    changes: dict[str, object] = {}
    if sample.decentre_um or sample.tilt_arcmin:
        changes["elements"] = tuple(_moved(group, number, sample) for number, group in enumerate(glass_groups(lens)))
    if sample.figure_nm:
        changes["rows"] = tuple(
            _polished(row, k, sample) if isinstance(row, Surface) else row for k, row in enumerate(lens.rows)
        )
    return lens.replace(**changes)


def _moved(group: tuple[int, int], number: int, sample: Imperfection) -> Element:
    reach, around, askew, about = np.random.default_rng([sample.seed, 0, number]).random(4)
    far = sample.decentre_um * 1e-3 * sqrt(reach)
    turned = sample.tilt_arcmin / 60.0 * sqrt(askew)
    return Element(
        rows=group,
        decentre=(far * cos(2.0 * pi * around), far * sin(2.0 * pi * around)),
        tilt_deg=(turned * cos(2.0 * pi * about), turned * sin(2.0 * pi * about)),
    )


def _polished(row: Surface, k: int, sample: Imperfection) -> Surface:
    generator = np.random.default_rng([sample.seed, 1, k])
    shape = generator.standard_normal(len(TERMS))
    amplitudes = shape / np.linalg.norm(shape) * sample.figure_nm * generator.random()
    total = dict(row.figure.zernike_nm) if row.figure is not None else {}
    for term, amplitude in zip(TERMS, amplitudes, strict=True):
        total[term] = total.get(term, 0.0) + float(amplitude)
    figure = row.figure if row.figure is not None else Figure()
    return row.replace(figure=figure.replace(zernike_nm=tuple(total.items())))


def ghost_offset(path: LightPath, sample: Imperfection | None) -> tuple[float, float]:
    """Return the artistic random offset of a ghost.

    Parameters
    ----------
    path : LightPath
        A ghost.
    sample : Imperfection or None

    Returns
    -------
    tuple of float
        Right and up in the upright picture, mm on the sensor.

    Notes
    -----
    Hullin et al. 2011, section 7, "Imperfect Symmetries": a variance that translates each ghost. Gaussian along either
    axis; every path has separate random numbers.
    """
    if sample is None or sample.ghost_offset_mm == 0.0:
        return 0.0, 0.0
    generator = np.random.default_rng([sample.seed, 2, *path.mirrors])
    right, up = sample.ghost_offset_mm * generator.standard_normal(2)
    return float(right), float(up)
