"""The bridge from the frozen model to the arrays that kernels read."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import cycle
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from ..errors import LensError, ProjectError
from ..kernels.intersect import AXES, DEGREE, TANGENT
from ..model import AsLens, Coating, CoatingChoice, InTurn, Lens, PerRow, Preset, QuarterWave, Stop
from ..model.coating import StandardName
from .coatings import film_stack, reflectance_table
from .paraxial import D_LINE_NM, FirstOrder, gap_indices, vertex_positions
from .shape import curvature_across, seen_along, shape_table, symmetric

REFLECTANCE_SAMPLES = 1025

PERIOD = "period"
"""A preset of the lenses of the library: plausible films of their time (tools/choose_period_coatings.py)."""

STAGGERED = "staggered"
"""A preset that every lens has, if its file has none of that name: chosen for ghosts of many colours, not known."""

_STAGGERED = tuple(QuarterWave(center_wavelength_nm=center) for center in (450.0, 520.0, 600.0, 550.0))


@dataclass(frozen=True)
class PackedLens:
    """A lens at one opening and a few wavelengths, as arrays.

    Attributes
    ----------
    curvature, conic, z_vertex, semi, inv_semi : ndarray, shape (K,), float64
        Geometry of the rows in mm; `inv_semi` is 0 for the stop, whose opening is the iris' business.
    n_gap : ndarray, shape (W, K + 1), float64
        Index before row 0 and behind each row, per wavelength.
    reflectance : ndarray, shape (W, K, M), float64
        R against the cosine on the lower-index side, uniform over [0, 1].
    wavelengths_nm : ndarray, shape (W,)
    sensor_z : float
    stop_semi : float
    first_order : FirstOrder
    shapes : ndarray, shape (K, P), or None
        Form and place of the rows in the lens' frame (`optics.shape.shape_table`); None when all are centred conics.
    symmetric : bool
        Whether the lens is one of revolution, so that half a bundle tells all of it.
    curvature_x : ndarray, shape (K,), or None
        Curvatures in the x-z plane; None when they are those in the y-z plane.
    faced : ndarray, shape (K, P), or None
        `shapes` in the meridional frame of one light (`facing`).
    nearness : float
        1 / distance from that light to the first vertex, 1/mm; 0 for a distant one.
    """

    curvature: NDArray[np.float64]
    conic: NDArray[np.float64]
    z_vertex: NDArray[np.float64]
    semi: NDArray[np.float64]
    inv_semi: NDArray[np.float64]
    n_gap: NDArray[np.float64]
    reflectance: NDArray[np.float64]
    wavelengths_nm: NDArray[np.float64]
    sensor_z: float
    stop_semi: float
    first_order: FirstOrder
    shapes: NDArray[np.float64] | None = None
    symmetric: bool = True
    curvature_x: NDArray[np.float64] | None = None
    faced: NDArray[np.float64] | None = None
    nearness: float = 0.0

    @property
    def halves(self) -> int:
        """How many halves of the pupil a traced bundle stands for: 2 by mirror symmetry, else the 1 it is."""
        return 2 if self.symmetric else 1

    @property
    def form(self) -> NDArray[np.float64]:
        """What kernels take as `conic`: the conic constants, or the shape table as the light sees it."""
        if self.shapes is None:
            return self.conic
        if self.symmetric:
            return self.shapes
        assert self.faced is not None, "a lens that is not one of revolution is traced towards a light: facing()"
        return self.faced

    @cached_property
    def typical_reflectance(self) -> NDArray[np.float64]:
        """Root mean square of R over the wavelengths, shape (K, M): for estimates of a path of two reflections.

        A coating may leave next to nothing at the middle wavelength and much beside it. Two mirrors of one coating make
        <R^2>, which this gives; of different ones it gives more than <R_1 R_2>, never less (Cauchy and Schwarz).
        """
        return np.asarray(np.sqrt(np.mean(self.reflectance**2, axis=0)))

    @cached_property
    def typical_reflectance_of_four(self) -> NDArray[np.float64]:
        """The same for paths of four reflections: fourth root of the mean of R^4 (Hoelder)."""
        return np.asarray(np.mean(self.reflectance**4, axis=0) ** 0.25)

    @cached_property
    def fitted(self) -> tuple[list[int], NDArray[np.float64], NDArray[np.float64]]:
        """The wavelengths that stand for all, the ends and the middle one, rising, and their `n_gap` and `reflectance`.

        Grids of all paths are traced at these: the tables are large, and to pick them out anew for each takes as long
        as to trace some cells.
        """
        waves = sorted(wavelengths_fitted(self))
        if len(waves) == len(self.wavelengths_nm):
            return waves, self.n_gap, self.reflectance
        return waves, self.n_gap[waves], self.reflectance[waves]

    @cached_property
    def first_surface(self) -> int:
        """Row of the first surface; the stop may stand in front of it."""
        return int(np.flatnonzero(self.inv_semi)[0])


def wavelengths_fitted(packed: PackedLens) -> list[int]:
    """Choose the wavelengths that stand for all: the middle one, then the ends."""
    last = len(packed.wavelengths_nm) - 1
    return [last // 2, *(w for w in (0, last) if w != last // 2)]


@dataclass(frozen=True)
class SensorMirror:
    """The sensor as a mirror.

    Attributes
    ----------
    reflectance : float
    radius : float
        Of the circle around it, mm; infinite for an unbounded plane.
    """

    reflectance: float
    radius: float = float("inf")


def resolve_coatings(lens: Lens, choice: CoatingChoice) -> tuple[Coating | None, ...]:
    """Decide the coating of every row.

    Parameters
    ----------
    lens : Lens
    choice : CoatingChoice
        As the lens file says, a preset of it, one coating on every surface between glass and air, several in turn, or
        one a row.

    Returns
    -------
    tuple of Coating or None
        One entry a row; None is bare.

    Raises
    ------
    ProjectError
        For an unknown preset or a list of the wrong length.
    """
    if isinstance(choice, AsLens):
        return tuple(None if isinstance(row, Stop) else row.coating for row in lens.rows)
    if isinstance(choice, Preset):
        if choice.name == STAGGERED and STAGGERED not in lens.coating_presets:
            return _dealt(lens, _STAGGERED)
        if choice.name not in lens.coating_presets:
            known = ", ".join(preset_names(lens))
            hint = "; leave out 'preset:' for the standard coating" if choice.name in get_args(StandardName) else ""
            raise ProjectError(f"{lens.name} has no coating preset {choice.name!r}; it has: {known}{hint}")
        return lens.coating_presets[choice.name]
    if isinstance(choice, PerRow):
        if len(choice.coatings) != len(lens.rows):
            raise ProjectError(
                f"the coating list has {len(choice.coatings)} entries but {lens.name} has {len(lens.rows)} rows; "
                "give one entry a row, the stop's included"
            )
        return choice.coatings
    return _dealt(lens, choice.coatings if isinstance(choice, InTurn) else (choice.coating,))


def preset_names(lens: Lens) -> tuple[str, ...]:
    """Return the names that `Preset` may have for a lens: those of its file, and "staggered" in any case."""
    return tuple(dict.fromkeys((*lens.coating_presets, STAGGERED)))


def _dealt(lens: Lens, coatings: tuple[Coating, ...]) -> tuple[Coating | None, ...]:
    """Coat each surface in air with the next of the coatings; cemented ones stay bare."""
    worn: list[Coating | None] = [None] * len(lens.rows)
    for k, coating in zip(rows_in_air(lens), cycle(coatings), strict=False):
        worn[k] = coating
    return tuple(worn)


def rows_in_air(lens: Lens) -> tuple[int, ...]:
    """Return the rows that stand between glass and air."""
    n = gap_indices(lens, D_LINE_NM)
    return tuple(k for k in range(len(lens.rows)) if min(n[k], n[k + 1]) == 1.0 and n[k] != n[k + 1])


def pack_lens(
    lens: Lens,
    first_order: FirstOrder,
    coatings: tuple[Coating | None, ...],
    wavelengths_nm: NDArray[np.float64],
    *,
    sensor: SensorMirror | None = None,
    in_bands: NDArray[np.float64] | None = None,
) -> PackedLens:
    """Turn a complete lens into arrays.

    Parameters
    ----------
    lens : Lens
        Every semi-diameter known (`optics.semi_diameters.complete`).
    first_order : FirstOrder
        At the opening and focus to be used.
    coatings : tuple of Coating or None
        One a row (`resolve_coatings`).
    wavelengths_nm : ndarray, shape (W,)
    sensor : SensorMirror, optional
        Adds the sensor as the last row; the lens' own rows keep their numbers.
    in_bands : ndarray, shape (W, K, M), optional
        `PackedLens.reflectance` in the place of that at the wavelengths themselves: the means over the bands that these
        stand for (`optics.coating_curves.BandCurves.tables`).

    Returns
    -------
    PackedLens

    Raises
    ------
    LensError
        When a semi-diameter is missing.
    """
    z = vertex_positions(lens)
    semi = np.full(len(lens.rows), first_order.stop_semi_diameter)
    inv_semi = np.zeros(len(lens.rows))
    curvature, conic = np.zeros(len(lens.rows)), np.zeros(len(lens.rows))
    for k, row in enumerate(lens.rows):
        if isinstance(row, Stop):
            continue
        if row.semi_diameter is None:
            raise LensError(f"{lens.name}, row {k}: the semi-diameter is missing; estimate it before tracing")
        semi[k], inv_semi[k] = row.semi_diameter, 1.0 / row.semi_diameter
        curvature[k], conic[k] = row.curvature, row.conic
    n_gap = np.array([gap_indices(lens, float(w)) for w in wavelengths_nm])
    packed = PackedLens(
        curvature=curvature,
        conic=conic,
        z_vertex=z,
        semi=semi,
        inv_semi=inv_semi,
        n_gap=n_gap,
        reflectance=_reflectance(lens, coatings, n_gap, wavelengths_nm) if in_bands is None else in_bands,
        wavelengths_nm=np.asarray(wavelengths_nm, dtype=np.float64),
        sensor_z=float(z[-1] + first_order.sensor_distance),
        stop_semi=first_order.stop_semi_diameter,
        first_order=first_order,
        shapes=shape_table(lens),
        symmetric=symmetric(lens),
        curvature_x=curvature_across(lens),
    )
    return packed if sensor is None else _with_sensor(packed, sensor)


def _with_sensor(packed: PackedLens, sensor: SensorMirror) -> PackedLens:
    """Append the sensor: a plane between air and air that reflects alike at every angle."""
    waves = len(packed.wavelengths_nm)
    mirror = np.full((waves, 1, REFLECTANCE_SAMPLES), sensor.reflectance)
    shapes, across = packed.shapes, packed.curvature_x
    if shapes is not None:
        plane = np.zeros((1, shapes.shape[1]))
        plane[0, AXES : AXES + 9], plane[0, TANGENT], plane[0, DEGREE] = np.eye(3).ravel(), np.inf, -1.0
        shapes = np.concatenate([shapes, plane])
    return replace(
        packed,
        curvature=np.append(packed.curvature, 0.0),
        conic=np.append(packed.conic, 0.0),
        z_vertex=np.append(packed.z_vertex, packed.sensor_z),
        semi=np.append(packed.semi, sensor.radius),
        inv_semi=np.append(packed.inv_semi, 1.0 / sensor.radius),
        n_gap=np.concatenate([packed.n_gap, np.ones((waves, 1))], axis=1),
        reflectance=np.concatenate([packed.reflectance, mirror], axis=1),
        shapes=shapes,
        curvature_x=None if across is None else np.append(across, 0.0),
    )


def facing(packed: PackedLens, axes: NDArray[np.float64], nearness: float = 0.0) -> PackedLens:
    """Turn a lens towards a light; a lens of revolution looks the same from everywhere.

    Parameters
    ----------
    packed : PackedLens
    axes : ndarray, shape (2, 2)
        The light's (`optics.bundle.Incidence.axes`).
    nearness : float
        The light's.

    Returns
    -------
    PackedLens
    """
    if packed.symmetric or packed.shapes is None:
        return packed if packed.nearness == nearness else replace(packed, nearness=nearness)
    return replace(packed, faced=seen_along(packed.shapes, axes), nearness=nearness)


def _reflectance(
    lens: Lens,
    coatings: tuple[Coating | None, ...],
    n_gap: NDArray[np.float64],
    wavelengths_nm: NDArray[np.float64],
) -> NDArray[np.float64]:
    n_d = gap_indices(lens, D_LINE_NM)
    table = np.zeros((len(wavelengths_nm), len(lens.rows), REFLECTANCE_SAMPLES))
    for k, row in enumerate(lens.rows):
        if isinstance(row, Stop):
            continue
        # films are designed at the d line and keep their index
        indices, thicknesses_nm = film_stack(coatings[k], n_d[k], n_d[k + 1])
        for w, wavelength_nm in enumerate(wavelengths_nm):
            table[w, k] = _table(
                float(n_gap[w, k]), float(n_gap[w, k + 1]), indices, thicknesses_nm, float(wavelength_nm)
            )
    return table


@lru_cache(maxsize=4096)
def _table(
    n_front: float, n_back: float, indices: tuple[float, ...], thicknesses_nm: tuple[float, ...], wavelength_nm: float
) -> NDArray[np.float64]:
    """Remember the tables of surfaces that a dragging hand asks for again and again (8 kB each)."""
    return reflectance_table(n_front, n_back, indices, thicknesses_nm, wavelength_nm, REFLECTANCE_SAMPLES)
