"""One light seen through a settled lens: everything the passes share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..model import Iris, Light, Project
from ..model.camera import Colorspace
from ..model.grating import SensorGrating
from ..model.light import Spectrum
from ..optics.border import closed
from ..optics.bundle import Incidence, incidence, least_distance
from ..optics.coating_curves import CURVE_NM, BandCurves, PathSpectrum, band_curves, coating_curves
from ..optics.diffraction import Soil
from ..optics.dirt import lay_elements, rasterise
from ..optics.iris import blade_edges, outline, transmission
from ..optics.mask_levels import MaskLevels, mask_levels
from ..optics.pack import PackedLens, facing, pack_lens, resolve_coatings
from ..optics.source import parts
from ..optics.spectrum import at_its_lines, band_parts, band_weights, hats, sampled_wavelengths, traced_wavelengths
from .prepare import Settled

if TYPE_CHECKING:
    from .ringing import Ringing

Floats = NDArray[np.float64]

# the picture of the dirt in ghosts: pixels a side, and half its width in radii
SOIL_SIDE, SOIL_SPAN = 1024, 1.65
# straight edges that stand for a rounded iris in draft quality
DRAFT_EDGES = 48


@dataclass(frozen=True)
class Opening:
    """The iris as the kernels read it.

    Attributes
    ----------
    blades : ndarray, shape (B, 4)
        Curved edges (`optics.iris.blade_edges`); the border of a mask image.
    edges : ndarray, shape (E, 4)
        The same opening by straight edges.
    radius, inner : float
        Circles around and within the opening, mm; half of it for a mask, whose inside is unknown.
    mask : ndarray, shape (A, B), or None
        Transmittance image, if the iris is one.
    half : float
        The mask spans [-half, half], mm.
    """

    blades: Floats
    edges: Floats
    radius: float
    inner: float
    mask: Floats | None
    half: float

    @cached_property
    def levels(self) -> MaskLevels | None:
        """The mask as kernels that draw read it."""
        return None if self.mask is None else mask_levels(self.mask, self.half)

    @property
    def mean_transmittance(self) -> float:
        """Mean of the mask over the square around the round opening; 1 without a mask."""
        # a turned one spans more than that square
        return 1.0 if self.mask is None else float(self.mask.mean()) * 2.0 * (self.half / self.radius) ** 2


@dataclass(frozen=True)
class Shot:
    """One light, ready to be drawn.

    Attributes
    ----------
    light : Light
        As it is drawn: of an area light one part, a point.
    incidence : Incidence
    packed : PackedLens
        At the wavelengths traced for this light.
    opening : Opening
    to_pixels : ndarray, shape (4,)
        Column and row of the axis, pixels per mm across and down.
    size_px : tuple of int
    colorspace : {"rec709", "acescg"}
    ringing : Ringing or None
        How ghosts show the diffraction at the iris; None: not at all.
    number : int
        Which of the project's lights it is, or is a part of.
    share : float
        Its part of that light.
    border : ndarray, shape (N, 5), or None
        Of the part, or of what is seen of it (`optics.border`), in slopes (tan X, tan Y) from its own; None for a
        point.
    grating : SensorGrating or None
        What the sensor's pixels make of the light that it reflects.
    curves : BandCurves or None
        What coatings do between the traced wavelengths, whose rays carry the means over bands; None where rays carry
        the reflectances at the traced wavelengths, and colours between them are straight.
    """

    light: Light
    incidence: Incidence
    packed: PackedLens
    opening: Opening
    to_pixels: Floats
    size_px: tuple[int, int]
    colorspace: Colorspace
    ringing: Ringing | None = None
    number: int = 0
    share: float = 1.0
    border: Floats | None = None
    grating: SensorGrating | None = None
    curves: BandCurves | None = None

    @property
    def gain(self) -> float:
        """Irradiance on the plane of the first vertex."""
        return self.light.intensity * self.incidence.cosine

    @property
    def view_radius(self) -> float:
        """Half diagonal of the picture on the sensor, mm."""
        half_width = 0.5 * self.size_px[0] / self.to_pixels[2]
        return float(np.hypot(half_width, 0.5 * self.size_px[1] / self.to_pixels[3]))

    def weights(self, wavelengths_nm: Floats, spectrum: PathSpectrum | None = None) -> Floats:
        """Return the RGB weights of wavelengths for this light, shape (N, 3), or (P, N, 3) for P paths.

        Parameters
        ----------
        wavelengths_nm : ndarray, shape (N,)
            The traced ones, and any between them where what rays carry is interpolated.
        spectrum : PathSpectrum, optional
            What the path lets pass; None: what is straight between the wavelengths.

        Returns
        -------
        ndarray
            For each wavelength the colour of its band's light that passes, over what rays carry there.
        """
        look = self.light.spectrum, tuple(wavelengths_nm), self.colorspace
        if spectrum is None:
            return _weights(*look)
        carried = carried_at(self, spectrum, wavelengths_nm)
        # not `tensordot`: its library's threads wait busily beside ours
        weights: Floats = np.einsum("...l,lwc->...wc", spectrum.passed, _parts(*look))
        return np.divide(weights, carried[..., None], out=np.zeros_like(weights), where=carried[..., None] > 0.0)


def carried_at(shot: Shot, spectrum: PathSpectrum, wavelengths_nm: Floats) -> Floats:
    """Interpolate what rays carry between the traced wavelengths, shape (N,) or (P, N)."""
    traced_nm = shot.packed.wavelengths_nm
    if len(wavelengths_nm) == len(traced_nm):
        return spectrum.carried
    carried: Floats = spectrum.carried @ hats(wavelengths_nm, traced_nm)
    return carried


def moved(shot: Shot, slope: Floats) -> Shot:
    """Put a shot's light elsewhere.

    Parameters
    ----------
    shot : Shot
    slope : ndarray, shape (2,)
        tan X and tan Y of the field angles.

    Returns
    -------
    Shot
        A point.
    """
    x, y = (float(angle) for angle in np.degrees(np.arctan(slope)))
    light = shot.light.replace(field_deg=(x, y))
    seen = incidence((x, y), light.distance, shot.packed.first_order.entrance_pupil_z)
    packed = facing(shot.packed, seen.axes, seen.nearness)
    return replace(shot, light=light, incidence=seen, packed=packed, border=None)


@lru_cache(maxsize=512)
def _weights(spectrum: Spectrum, wavelengths_nm: tuple[float, ...], colorspace: Colorspace) -> Floats:
    return band_weights(spectrum, np.array(wavelengths_nm), colorspace)


@lru_cache(maxsize=256)
def _parts(spectrum: Spectrum, wavelengths_nm: tuple[float, ...], colorspace: Colorspace) -> Floats:
    return band_parts(spectrum, np.array(wavelengths_nm), colorspace, CURVE_NM)


def make_opening(settled: Settled, mask: Floats | None) -> Opening:
    """Turn an iris, or a mask image, into what the kernels read.

    Parameters
    ----------
    settled : Settled
    mask : ndarray, shape (A, B), or None
        Transmittance in [0, 1], row 0 up.

    Returns
    -------
    Opening
    """
    semi = settled.order.stop_semi_diameter
    if mask is not None:
        # the mask ends at its own border, so the border cuts as four blades
        turn = np.radians(settled.iris.rotation_deg) + 0.5 * np.pi * np.arange(4)
        square = np.stack([np.cos(turn), np.sin(turn), np.full(4, semi), np.zeros(4)], axis=1)
        image, half = _turned(np.asarray(mask, dtype=np.float64), settled.iris.rotation_deg)
        return Opening(square, square, float(np.sqrt(2.0) * semi), 0.5 * semi, image, half * semi)
    iris = settled.iris
    curved = iris.blades == 0 or iris.rounding > 0.0
    edges = blade_edges(iris, semi)
    border = outline(iris, semi, DRAFT_EDGES if curved else iris.blades)
    if curved:
        # chords lose a little of the arc's area; give it back
        step = 2.0 * np.pi / DRAFT_EDGES
        border = border * float(np.sqrt(step / np.sin(step)))
    return Opening(
        blades=edges,
        edges=_straight(border),
        radius=float(np.hypot(border[:, 0], border[:, 1]).max()),
        inner=float(edges[:, 2].min()),
        mask=None,
        half=1.0,
    )


def _turned(mask: Floats, rotation_deg: float) -> tuple[Floats, float]:
    """Turn a mask as `optics.iris.transmission` does; return it, and half of what it spans then, in radii."""
    if rotation_deg % 90.0 == 0.0:
        return np.ascontiguousarray(np.rot90(mask, round(rotation_deg / 90.0))), 1.0
    # the square around the turned one, as fine as the mask is
    half = float(np.sqrt(2.0))
    count = int(np.ceil(half * max(mask.shape)))
    at = ((np.arange(count) + 0.5) * 2.0 / count - 1.0) * half
    seen = transmission(Iris(rotation_deg=rotation_deg), 1.0, at, at[:, None], mask=mask)
    return np.ascontiguousarray(seen[::-1]), half


def soiled_opening(opening: Opening, semi: float, soil: Soil) -> Opening:
    """Lay dirt on an opening, for ghosts.

    Parameters
    ----------
    opening : Opening
        From `make_opening`; its edges stay as they are.
    semi : float
        Semi-diameter of the round opening, mm.
    soil : Soil

    Returns
    -------
    Opening
        With a mask that holds what dirt lets through, and the iris image where there is one.
    """
    spacing = 2.0 * SOIL_SPAN / SOIL_SIDE
    at = np.asarray((np.arange(SOIL_SIDE) + 0.5) * spacing - SOIL_SPAN, dtype=np.float64)
    _, light = rasterise(lay_elements(soil.dirt, semi), at)
    for image, half in ((soil.image, 1.0), (opening.mask, opening.half / semi)):
        if image is not None:
            seen = transmission(Iris(), half, at, at[:, None], mask=image)
            if image is soil.image:
                seen[np.maximum(np.abs(at), np.abs(at)[:, None]) >= 1.0] = 1.0
            light = light * seen
    return replace(opening, mask=np.ascontiguousarray(light[::-1]), half=SOIL_SPAN * semi)


def _straight(border: Floats) -> Floats:
    """Turn a closed counter-clockwise polyline into straight edges (normal, offset, curvature 0)."""
    along = np.roll(border, -1, axis=0) - border
    length = np.hypot(along[:, 0], along[:, 1])
    along, start = along[length > 1e-12] / length[length > 1e-12, None], border[length > 1e-12]
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    offset = (normal * start).sum(axis=1)
    return np.column_stack([normal, offset, np.zeros(len(offset))])


def make_shots(settled: Settled, opening: Opening, *, sampled: bool = False) -> tuple[Shot, ...]:
    """Prepare every light of a project; an area light in parts.

    Parameters
    ----------
    settled : Settled
    opening : Opening
    sampled : bool
        Whether the wavelengths stand for all light by themselves (`optics.spectrum.sampled_wavelengths`), for random
        rays.

    Returns
    -------
    tuple of Shot
    """
    project: Project = settled.project
    width, height = project.camera.size_px
    sensor = project.camera.sensor
    to_pixels = np.array([width / 2.0, height / 2.0, width / sensor[0], height / sensor[1]])
    coatings = resolve_coatings(settled.lens, settled.coating)
    quality = project.quality
    bridged = quality.bridge and quality.mode != "reference"
    curves = coating_curves(settled.lens, coatings, settled.sensor) if bridged else None
    choose = sampled_wavelengths if sampled else traced_wavelengths
    packs: dict[tuple[object, ...], tuple[PackedLens, BandCurves | None]] = {}
    shots: list[Shot] = []
    for number, light in enumerate(project.lights):
        wavelengths_nm = choose(quality.wavelengths, light.spectrum)
        # the lines of a spectrum are traced as they are
        banded = curves is not None and not at_its_lines(light.spectrum, wavelengths_nm)
        traced = tuple(wavelengths_nm.tolist())
        key = (traced, light.spectrum if banded else None)
        if key not in packs:
            bands = band_curves(curves, light.spectrum, traced) if banded and curves is not None else None
            lens = pack_lens(
                settled.lens, settled.order, coatings, wavelengths_nm, sensor=settled.sensor,
                in_bands=None if bands is None else bands.tables[:, : len(settled.lens.rows)],
            )  # fmt: skip
            packs[key] = lens, bands
        of_light, bands = packs[key]
        whole = []
        for part in parts(light, quality.source_step_deg):
            changes = {"field_deg": part.field_deg, "intensity": light.intensity * part.share, "holdout": None}
            point = light.replace(**changes, diameter_deg=0.0, shape=None) if light.extended else light
            seen = _seen(settled, of_light, number, point)
            packed = facing(of_light, seen.axes, seen.nearness)
            whole.append(
                Shot(
                    point,
                    seen,
                    packed,
                    opening,
                    to_pixels,
                    (width, height),
                    project.output.colorspace,
                    number=number,
                    share=part.share,
                    border=closed(part.corners) if light.extended else None,
                    grating=project.camera.sensor_grating,
                    curves=bands,
                )
            )
        shots += whole if project.holdout is None and light.holdout is None else _unhidden(settled, light, whole)
    return tuple(shots)


def _unhidden(settled: Settled, light: Light, whole: list[Shot]) -> list[Shot]:
    """Return what is seen of the parts of a light; one dark point when all of it is hidden."""
    # it looks through a shot itself
    from .holdout import read_plates, seen_part

    plates = read_plates(settled.project, light)
    seen = [shot for part in whole if (shot := seen_part(settled.lens, part, plates)) is not None]
    return seen or [replace(whole[0], light=whole[0].light.replace(intensity=0.0), share=0.0, border=None)]


def _seen(settled: Settled, packed: PackedLens, number: int, light: Light) -> Incidence:
    """Find where a light stands, and refuse one that stands in the lens."""
    if light.distance is None:
        return incidence(light.field_deg)
    least = least_distance(packed)
    if light.distance <= least:
        raise ProjectError(
            f"lights[{number}].distance: a light at {light.distance:g} mm stands in the lens {settled.lens.name} or "
            f"behind its entrance pupil; give more than {least:.4g} mm"
        )
    return incidence(light.field_deg, light.distance, settled.order.entrance_pupil_z)
