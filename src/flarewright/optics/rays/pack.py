"""Packed lenses: a lens as arrays, for the kernels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import cycle
from typing import get_args

import numpy as np

from ...errors import LensError, ProjectError
from ...kernels.tracing.intersect import AXES, DEGREE, TANGENT
from ...kernels.tracing.lens_arrays import ConicLens, LensArrays, ShapedLens
from ...model import AsLens, Coating, CoatingChoice, InTurn, Lens, PerRow, Preset, QuarterWave, Stop
from ...model.lens.coating import StandardName
from ...typing import Floats
from ..coatings.thin_film import film_stack, reflectance_table
from ..lens.dispersion import D_LINE_NM
from ..lens.paraxial import FirstOrder, gap_indices, vertex_positions
from ..lens.surface_shape import curvature_across, has_rotational_symmetry, seen_along, shape_table

REFLECTANCE_SAMPLES = 1025

PERIOD = "period"
"""A preset of the library's lenses: plausible films of their time (tools/choose_period_coatings.py)."""

STAGGERED = "staggered"
"""A preset of every lens whose file has none of that name: chosen for colourful ghosts, not historical."""

_STAGGERED = tuple(QuarterWave(center_wavelength_nm=center) for center in (450.0, 520.0, 600.0, 550.0))


@dataclass(frozen=True)
class PackedLens:
    """A lens at one opening and a few wavelengths, as arrays.

    Attributes
    ----------
    curvature, conic, z_vertex, semi, inv_semi : ndarray, shape (K,), float64
        Geometry of the rows in mm; `inv_semi` is 0 for the stop, whose opening is the iris.
    n_gap : ndarray, shape (W, K + 1), float64
        Index before row 0 and behind each row, per wavelength.
    reflectance : ndarray, shape (W, K, M), float64
        R against the cosine on the lower-index side, uniform over [0, 1].
    wavelengths_nm : ndarray, shape (W,)
    sensor_z : float
    stop_semi : float
    first_order : FirstOrder
    shapes : ndarray, shape (K, P), or None
        Shape and pose of the rows in the lens' frame (`optics.lens.surface_shape.shape_table`); None when all are
        centred conics.
    symmetric : bool
        Whether the lens has rotational symmetry, so that half a bundle suffices.
    curvature_x : ndarray, shape (K,), or None
        Curvatures in the x-z plane; None when they are those in the y-z plane.
    faced : ndarray, shape (K, P), or None
        `shapes` in the meridional frame of a light (`facing`).
    nearness : float
        1 / distance from that light to the first vertex, 1/mm; 0 for a distant one.
    """

    curvature: Floats
    conic: Floats
    z_vertex: Floats
    semi: Floats
    inv_semi: Floats
    n_gap: Floats
    reflectance: Floats
    wavelengths_nm: Floats
    sensor_z: float
    stop_semi: float
    first_order: FirstOrder
    shapes: Floats | None = None
    symmetric: bool = True
    curvature_x: Floats | None = None
    faced: Floats | None = None
    nearness: float = 0.0

    @property
    def halves(self) -> int:
        """Number of pupil halves that a traced bundle represents: 2 by mirror symmetry, else 1."""
        return 2 if self.symmetric else 1

    @property
    def form(self) -> Floats:
        """The `conic` argument of kernels: the conic constants, or the shape table in the light's frame."""
        if self.shapes is None:
            return self.conic
        if self.symmetric:
            return self.shapes
        assert self.faced is not None, "a lens without rotational symmetry needs a light's direction: call facing()"
        return self.faced

    def arrays(self, n_gap: Floats, reflectance: Floats, sensor_z: float | None = None) -> LensArrays:
        """Return the lens as an argument of kernels, with the given indices, reflectances and plane of the sensor."""
        z = self.sensor_z if sensor_z is None else sensor_z
        if self.shapes is None:
            return ConicLens(self.curvature, self.conic, self.z_vertex, self.inv_semi, n_gap, reflectance, z)
        return ShapedLens(self.form, self.z_vertex, self.inv_semi, n_gap, reflectance, z)

    @cached_property
    def typical_reflectance(self) -> Floats:
        """Root mean square of R over the wavelengths, shape (K, M), for estimates of two-reflection paths.

        R at the middle wavelength alone can be near 0 and much larger next to it. Two mirrors with the same coating
        give <R^2>, which is exact; for different coatings this is at least <R_1 R_2> (Cauchy and Schwarz).
        """
        return np.asarray(np.sqrt(np.mean(self.reflectance**2, axis=0)))

    @cached_property
    def typical_reflectance_of_four(self) -> Floats:
        """The same for four-reflection paths: fourth root of the mean of R^4 (Hoelder)."""
        return np.asarray(np.mean(self.reflectance**4, axis=0) ** 0.25)

    @cached_property
    def fitted(self) -> tuple[list[int], Floats, Floats]:
        """The first, middle and last wavelength, ascending, with their `n_gap` and `reflectance`.

        The grids of all paths are traced at these. Cached, because selecting them from the large tables takes as long
        as tracing some cells.
        """
        waves = sorted(wavelengths_fitted(self))
        if len(waves) == len(self.wavelengths_nm):
            return waves, self.n_gap, self.reflectance
        return waves, self.n_gap[waves], self.reflectance[waves]

    @cached_property
    def first_surface(self) -> int:
        """Row of the first surface; the stop can precede it."""
        return int(np.flatnonzero(self.inv_semi)[0])


def wavelengths_fitted(packed: PackedLens) -> list[int]:
    """Return the indices of the wavelengths that grids are fitted to: the middle one, then the ends."""
    last = len(packed.wavelengths_nm) - 1
    return [last // 2, *(w for w in (0, last) if w != last // 2)]


@dataclass(frozen=True)
class SensorMirror:
    """The sensor as a mirror.

    Attributes
    ----------
    reflectance : float
    radius : float
        Radius of a circle around it, mm; infinite for an unbounded plane.
    """

    reflectance: float
    radius: float = float("inf")


def resolve_coatings(lens: Lens, choice: CoatingChoice) -> tuple[Coating | None, ...]:
    """Return the coating of every row.

    Parameters
    ----------
    lens : Lens
    choice : CoatingChoice
        As in the lens file, a preset of it, one coating on every surface between glass and air, several repeated in
        order, or one per row.

    Returns
    -------
    tuple of Coating or None
        One entry per row; None is bare.

    Raises
    ------
    ProjectError
        For an unknown preset or a list of the wrong length.
    """
    if isinstance(choice, AsLens):
        return tuple(None if isinstance(row, Stop) else row.coating for row in lens.rows)
    if isinstance(choice, Preset):
        if choice.name == STAGGERED and STAGGERED not in lens.coating_presets:
            return _repeated_in_air(lens, _STAGGERED)
        if choice.name not in lens.coating_presets:
            known = ", ".join(preset_names(lens))
            hint = "; leave out 'preset:' for the standard coating" if choice.name in get_args(StandardName) else ""
            raise ProjectError(f"{lens.name} has no coating preset {choice.name!r}; it has: {known}{hint}")
        return lens.coating_presets[choice.name]
    if isinstance(choice, PerRow):
        if len(choice.coatings) != len(lens.rows):
            raise ProjectError(
                f"the coating list has {len(choice.coatings)} entries but {lens.name} has {len(lens.rows)} rows; "
                "give one entry per row, including the stop"
            )
        return choice.coatings
    return _repeated_in_air(lens, choice.coatings if isinstance(choice, InTurn) else (choice.coating,))


def preset_names(lens: Lens) -> tuple[str, ...]:
    """Return the valid names of a `Preset` for a lens: those of its file, and always "staggered"."""
    return tuple(dict.fromkeys((*lens.coating_presets, STAGGERED)))


def _repeated_in_air(lens: Lens, coatings: tuple[Coating, ...]) -> tuple[Coating | None, ...]:
    """Assign coatings in order, repeated, to the surfaces in air; cemented ones stay bare."""
    worn: list[Coating | None] = [None] * len(lens.rows)
    for k, coating in zip(rows_in_air(lens), cycle(coatings), strict=False):
        worn[k] = coating
    return tuple(worn)


def rows_in_air(lens: Lens) -> tuple[int, ...]:
    """Return the rows of surfaces between glass and air."""
    n = gap_indices(lens, D_LINE_NM)
    return tuple(k for k in range(len(lens.rows)) if min(n[k], n[k + 1]) == 1.0 and n[k] != n[k + 1])


def pack_lens(
    lens: Lens,
    first_order: FirstOrder,
    coatings: tuple[Coating | None, ...],
    wavelengths_nm: Floats,
    *,
    sensor: SensorMirror | None = None,
    in_bands: Floats | None = None,
) -> PackedLens:
    """Pack a complete lens into arrays.

    Parameters
    ----------
    lens : Lens
        With all semi-diameters (`optics.lens_import.semi_diameters.with_semi_diameters`).
    first_order : FirstOrder
        At the opening and focus in use.
    coatings : tuple of Coating or None
        One per row (`resolve_coatings`).
    wavelengths_nm : ndarray, shape (W,)
    sensor : SensorMirror, optional
        Adds the sensor as the last row; the other rows keep their numbers.
    in_bands : ndarray, shape (W, K, M), optional
        Replaces `PackedLens.reflectance`: means over the bands of the wavelengths
        (`optics.rays.path_reflectance.BandCurves.tables`).

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
        symmetric=has_rotational_symmetry(lens),
        curvature_x=curvature_across(lens),
    )
    return packed if sensor is None else _with_sensor(packed, sensor)


def _with_sensor(packed: PackedLens, sensor: SensorMirror) -> PackedLens:
    """Append the sensor: a plane between air and air with constant reflectance at all angles."""
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


def facing(packed: PackedLens, axes: Floats, nearness: float = 0.0) -> PackedLens:
    """Turn a lens towards a light; a lens with rotational symmetry does not change.

    Parameters
    ----------
    packed : PackedLens
    axes : ndarray, shape (2, 2)
        Those of the light (`optics.rays.bundle.Incidence.axes`).
    nearness : float
        That of the light.
    """
    if packed.symmetric or packed.shapes is None:
        return packed if packed.nearness == nearness else replace(packed, nearness=nearness)
    return replace(packed, faced=seen_along(packed.shapes, axes), nearness=nearness)


def _reflectance(lens: Lens, coatings: tuple[Coating | None, ...], n_gap: Floats, wavelengths_nm: Floats) -> Floats:
    n_d = gap_indices(lens, D_LINE_NM)
    table = np.zeros((len(wavelengths_nm), len(lens.rows), REFLECTANCE_SAMPLES))
    for k, row in enumerate(lens.rows):
        if isinstance(row, Stop):
            continue
        # films are designed at the d line and have a constant index
        indices, thicknesses_nm = film_stack(coatings[k], n_d[k], n_d[k + 1])
        for w, wavelength_nm in enumerate(wavelengths_nm):
            table[w, k] = _table(
                float(n_gap[w, k]), float(n_gap[w, k + 1]), indices, thicknesses_nm, float(wavelength_nm)
            )
    return table


@lru_cache(maxsize=4096)
def _table(
    n_front: float, n_back: float, indices: tuple[float, ...], thicknesses_nm: tuple[float, ...], wavelength_nm: float
) -> Floats:
    """Cache the tables of surfaces (8 kB each), which interactive edits use repeatedly."""
    return reflectance_table(n_front, n_back, indices, thicknesses_nm, wavelength_nm, REFLECTANCE_SAMPLES)
