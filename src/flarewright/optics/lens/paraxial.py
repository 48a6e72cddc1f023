"""First-order optics by ray transfer matrices: focal length, pupils, flare matrices Ma and Ms.

Rays are (y, u), the path is unfolded so that distances run forward (docs/physics.md, "Ray transfer matrices").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np

from ...errors import LensError
from ...kernels.paraxial import ghosts
from ...model import Lens, Medium, Stop, Surface
from ...typing import Floats
from .dispersion import D_LINE_NM, refractive_index
from .paths import LightPath, direct_path
from .surface_shape import curvature_across

Matrix = Floats
# one index, or one at each wavelength
_Index = TypeVar("_Index", float, Floats)

# a few dozen steps take less time in Python than loading a compiled kernel
_path_matrices = getattr(ghosts.path_matrices, "py_func", ghosts.path_matrices)

# a power below this part of the surfaces' powers is what rounding leaves of an afocal lens
AFOCAL = 1e-8


@dataclass(frozen=True)
class FirstOrder:
    """First-order data of a lens at one wavelength. Lengths in mm, z from the first vertex.

    Attributes
    ----------
    efl, bfl : float
        Focal length; last vertex to rear focus.
    f_number : float
    entrance_pupil_diameter, entrance_pupil_z, exit_pupil_diameter, exit_pupil_z : float
        Images of the stop from the front and from behind; `exit_pupil_z` is infinite for a telecentric lens.
    stop_semi_diameter : float
        The opening that gives the f-number.
    sensor_distance : float
        Last vertex to sensor.
    efl_x, bfl_x : float or None
        Focal length and back focus in the x-z plane, where they differ from those in the y-z plane (cylinders,
        toroids); all other data are for the y-z plane. None: the same. Infinite where that plane has no power.
    """

    efl: float
    bfl: float
    f_number: float
    entrance_pupil_diameter: float
    entrance_pupil_z: float
    exit_pupil_diameter: float
    exit_pupil_z: float
    stop_semi_diameter: float
    sensor_distance: float
    efl_x: float | None = None
    bfl_x: float | None = None


def focal_lengths(efl: float, efl_x: float | None) -> tuple[float, float]:
    """Return the focal lengths across and up the picture, mm, of a `FirstOrder`.

    A plane without power has no focus: the lens then counts as equal in both.
    """
    return efl if efl_x is None or not np.isfinite(efl_x) else efl_x, efl


def vertex_positions(lens: Lens) -> Floats:
    """Return the z of every row's vertex, mm from the first, shape (K,)."""
    return np.concatenate([[0.0], np.cumsum([row.thickness for row in lens.rows[:-1]])])


def gap_indices(lens: Lens, wavelength_nm: float) -> Floats:
    """Return the index before row 0 and behind every row, shape (K + 1,)."""
    return np.array(_in_gaps(lens, 1.0, lambda medium: _index(medium, wavelength_nm)))


def gap_indices_at(lens: Lens, wavelengths_nm: Floats) -> Floats:
    """Return `gap_indices` at many wavelengths, shape (W, K + 1)."""
    air = np.ones(len(wavelengths_nm))
    return np.column_stack(_in_gaps(lens, air, lambda medium: air * refractive_index(medium, wavelengths_nm)))


def _in_gaps(lens: Lens, air: _Index, index: Callable[[Medium | None], _Index]) -> list[_Index]:
    found = [air]
    for row in lens.rows:
        # the stop is a plane in a gap and has that gap's medium
        found.append(found[-1] if isinstance(row, Stop) else index(row.medium))
    return found


# cached: every frame of a sequence needs the same index
@lru_cache(maxsize=4096)
def _index(medium: Medium | None, wavelength_nm: float) -> float:
    return float(refractive_index(medium, wavelength_nm))


def path_matrices(
    lens: Lens, path: LightPath, wavelength_nm: float, sensor_z: float, *, across: bool = False
) -> tuple[list[Matrix], Matrix]:
    """Multiply the matrices along a path, in the y-z plane or across it.

    Parameters
    ----------
    lens : Lens
    path : LightPath
    wavelength_nm : float
    sensor_z : float
        Sensor plane, mm from the first vertex.
    across : bool
        In the x-z plane, which differs for cylinders and toroids.

    Returns
    -------
    to_stop : list of ndarray, shape (2, 2)
        Ma for every crossing of the stop, from the plane of the first vertex.
    total : ndarray, shape (2, 2)
        First vertex to sensor: Ms Ma.
    """
    curvature = _curvatures(lens, across)
    to_stop = np.empty((path.stop_crossings, 2, 2))
    n, z = gap_indices(lens, wavelength_nm), vertex_positions(lens)
    if path.sensor:
        curvature, z, n = np.append(curvature, 0.0), np.append(z, sensor_z), np.append(n, 1.0)
    total = _path_matrices(path.rows, path.actions, curvature, z, n, sensor_z, to_stop)
    return list(to_stop), np.array(total).reshape(2, 2)


def _curvatures(lens: Lens, across: bool) -> Floats:
    """Return the curvatures of the rows in the y-z plane, or across it."""
    curvature = curvature_across(lens) if across else None
    if curvature is None:
        return np.array([row.curvature if isinstance(row, Surface) else 0.0 for row in lens.rows])
    return curvature


def flare_matrices(lens: Lens, path: LightPath, wavelength_nm: float, sensor_z: float) -> tuple[Matrix, Matrix]:
    """Split a path at its first crossing of the stop.

    Parameters
    ----------
    lens, path, wavelength_nm, sensor_z
        As in `path_matrices`.

    Returns
    -------
    Ma, Ms : ndarray, shape (2, 2)
        r_stop = Ma r_in and r_sensor = Ms r_stop (Lee and Eisemann 2013; Van Acoleyen 2025, section 4.3.1).
    """
    to_stop, total = path_matrices(lens, path, wavelength_nm, sensor_z)
    return to_stop[0], _behind_stop(to_stop[0], total)


def _behind_stop(to_stop: Matrix, total: Matrix) -> Matrix:
    """Return Ms from Ma and Ms Ma."""
    rear: Matrix = total @ np.linalg.inv(to_stop)
    return rear


def first_order(
    lens: Lens,
    f_number: float | None = None,
    *,
    sensor_distance: float | None = None,
    focus_distance: float | None = None,
    wavelength_nm: float = D_LINE_NM,
) -> FirstOrder:
    """Compute focal length, pupils, stop and sensor position of a lens.

    Parameters
    ----------
    lens : Lens
    f_number : float, optional
        None: wide open.
    sensor_distance, focus_distance : float, optional
        Override those of the lens file, mm.
    wavelength_nm : float

    Raises
    ------
    LensError
        When the lens has no power or no real image, or the plane in focus lies inside the front focus.
    """
    last = float(vertex_positions(lens)[-1])
    (to_stop,), system = path_matrices(lens, direct_path(lens), wavelength_nm, last)
    (a, _), (c, _) = system
    if _is_afocal(lens, c, wavelength_nm):
        raise LensError(f"{lens.name}: the lens is afocal (no focal length); give a lens that makes an image")
    efl, bfl = -1.0 / c, -a / c
    if efl <= 0.0:
        raise LensError(f"{lens.name}: the focal length is negative ({efl:.2f} mm), so it makes no real image")
    number = lens.f_number if f_number is None else f_number
    pupil = efl / number
    (sa, sb), _ = to_stop
    exit_diameter, exit_z = _exit_pupil(_behind_stop(to_stop, system), abs(sa) * pupil)
    return FirstOrder(
        efl=float(efl),
        bfl=float(bfl),
        f_number=float(number),
        entrance_pupil_diameter=float(pupil),
        entrance_pupil_z=float(sb / sa),
        exit_pupil_diameter=exit_diameter,
        exit_pupil_z=last + exit_z,
        stop_semi_diameter=float(abs(sa) * pupil / 2.0),
        sensor_distance=_sensor(lens, system, sensor_distance, focus_distance),
        **_meridian_x(lens, wavelength_nm, last),
    )


def _meridian_x(lens: Lens, wavelength_nm: float, last: float) -> dict[str, float]:
    """Return focal length and back focus in the x-z plane, if they differ there."""
    if curvature_across(lens) is None:
        return {}
    _, ((a, _), (c, _)) = path_matrices(lens, direct_path(lens), wavelength_nm, last, across=True)
    afocal = _is_afocal(lens, c, wavelength_nm, across=True)
    return {"efl_x": float("inf") if afocal else -1.0 / c, "bfl_x": float("inf") if afocal else -a / c}


def _is_afocal(lens: Lens, slope: float, wavelength_nm: float, *, across: bool = False) -> bool:
    """Whether a lens has no power, given the slope behind it of a ray that enters at height 1."""
    powers = np.diff(gap_indices(lens, wavelength_nm)) * _curvatures(lens, across)
    return abs(slope) <= AFOCAL * float(np.abs(powers).sum())


def _exit_pupil(rear: Matrix, stop_diameter: float) -> tuple[float, float]:
    """Image the stop through the rows behind it; return diameter, and z from the last vertex."""
    if abs(rear[1, 1]) < 1e-12:
        return float("inf"), float("inf")
    z = -rear[0, 1] / rear[1, 1]
    return float(abs(rear[0, 0] + z * rear[1, 0]) * stop_diameter), float(z)


def _sensor(lens: Lens, system: Matrix, sensor_distance: float | None, focus_distance: float | None) -> float:
    """Return the sensor position: stated, else the image of the plane in focus, else the paraxial focus."""
    distance = sensor_distance
    focus = focus_distance
    if distance is None and focus is None:
        distance, focus = lens.sensor_distance, lens.focus_distance
    if distance is not None:
        return float(distance)
    (a, b), (c, d) = system
    if focus is None:
        found = -a / c
    else:
        y, u = a * focus + b, c * focus + d
        if u >= 0.0:
            raise LensError(
                f"{lens.name}: {focus:g} mm lies inside the front focus, where nothing can be focused; "
                "focus farther away"
            )
        found = -y / u
    if found <= 0.0:
        raise LensError(
            f"{lens.name}: the image lies {-found:.2f} mm in front of the last surface, so no sensor fits there; "
            "give a lens with a real image behind it"
        )
    return float(found)
