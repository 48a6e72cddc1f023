"""Place, size and brightness of ghosts as functions of the prescription, with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.design import ghosts as kernel
from ...model import Lens
from ...optics.lens.paraxial import first_order
from ...typing import Floats
from .prescription import Structure, structure_of, vector_of


@dataclass(frozen=True)
class PlacedGhost:
    """A ghost to first order.

    Attributes
    ----------
    first_reflection, second_reflection : int
        Rows j, then i < j.
    place : float
        Centre, mm per unit slope (tangent of the field angle) of the light, towards the light in the upright picture.
    radius : float
        mm; negative where the image of the bounding edge is inverted.
    scale : float
        mm on the sensor per mm at the entrance; irradiance is proportional to 1 / scale^2.
    bounded_by : {"stop", "entrance"}
    reach : float
        Slope of the light beyond which the images of stop and entrance do not overlap: the ghost is invisible.
    """

    first_reflection: int
    second_reflection: int
    place: float
    radius: float
    scale: float
    bounded_by: str
    reach: float


@dataclass(frozen=True)
class Derivatives:
    """Ghosts of one prescription and their derivatives.

    Attributes
    ----------
    values : ndarray, shape (G, 6)
        Columns as in `kernels.design.ghosts`: PLACE, RADIUS, SCALE, BOUND, REACH, REACH_THESIS.
    place, radius, scale : ndarray, shape (G, 1 + 3 K)
        Derivatives with respect to the vector of the prescription.
    log_irradiance : ndarray, shape (G,)
        Of uncoated surfaces, for a light source of irradiance 1.
    log_irradiance_by : ndarray, shape (G, 1 + 3 K)
    """

    values: Floats
    place: Floats
    radius: Floats
    scale: Floats
    log_irradiance: Floats
    log_irradiance_by: Floats


def evaluate(structure: Structure, many: Floats, entrance: float) -> Floats:
    """Compute the ghosts of many prescriptions of one structure.

    Parameters
    ----------
    structure : Structure
    many : ndarray, shape (B, 1 + 3 K)
        `prescription.vector_of`.
    entrance : float
        Diameter of the entrance at the first vertex, mm.

    Returns
    -------
    ndarray, shape (B, G, 6)
        Columns as in `kernels.design.ghosts`; ghosts as in `structure.pairs`.

    Notes
    -----
    Tested against `optics.lens.paraxial` and the draft renderer in tests/design/problem/test_design_ghosts.py.
    """
    values = np.empty((len(many), len(structure.pairs), kernel.COLUMNS))
    kernel.ghosts_of_many(np.ascontiguousarray(many), structure.stop, structure.mirrors, float(entrance), values)
    return values


def differentiate(structure: Structure, vector: Floats, entrance: float) -> Derivatives:
    """Compute the ghosts of a prescription and their derivatives, by adjoint rays along each path.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    entrance : float
        mm.
    """
    count, size = len(structure.pairs), len(vector)
    values, jacobian = np.empty((count, kernel.COLUMNS)), np.empty((3, count, size))
    light, light_by = np.empty(count), np.empty((count, size))
    kernel.ghosts_with_derivatives(
        vector, structure.stop, structure.mirrors, float(entrance), values, jacobian, light, light_by
    )
    return Derivatives(values, jacobian[0], jacobian[1], jacobian[2], light, light_by)


def placed_ghosts(
    lens: Lens, *, f_number: float | None = None, entrance: float | None = None, sensor_distance: float | None = None
) -> tuple[PlacedGhost, ...]:
    """List the ghosts of a lens whose two reflections lie on one side of the stop.

    Parameters
    ----------
    lens : Lens
        Complete (`render.scene.resolve.open_lens`).
    f_number : float, optional
        None: wide open.
    entrance : float, optional
        Diameter at the first vertex, mm; None: that of the first surface.
    sensor_distance : float, optional
        mm; None: from the lens file, else the paraxial focus.

    Raises
    ------
    LensError
        When the stop stands in glass, or the lens is not one of revolution.
    """
    structure = structure_of(lens)
    order = first_order(lens, f_number, sensor_distance=sensor_distance)
    vector = vector_of(lens, 2.0 * order.stop_semi_diameter, order.sensor_distance)
    first = lens.rows[1 if structure.stop == 0 else 0]
    if entrance is None:
        entrance = 2.0 * (getattr(first, "semi_diameter", None) or order.entrance_pupil_diameter)
    values = evaluate(structure, vector[None], entrance)[0]
    return tuple(
        PlacedGhost(
            j, i, float(v[kernel.PLACE]), float(v[kernel.RADIUS]), float(v[kernel.SCALE]),
            "entrance" if v[kernel.BOUND] else "stop", float(v[kernel.REACH]),
        )
        for (j, i), v in zip(structure.pairs, values, strict=True)
    )  # fmt: skip
