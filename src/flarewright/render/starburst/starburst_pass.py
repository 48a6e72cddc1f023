"""The starburst pass: the direct image of every light, with its pupil, dirt, size and spectrum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ...colorimetry import VISIBLE_NM
from ...errors import ProjectError, raised_as
from ...io.images.mask_image import read_mask
from ...kernels.raster.plane_memory import black_picture
from ...model import Dirt, Iris, Layer, Lines, Starburst
from ...optics.diffraction.fraunhofer import BladeWings, Pattern, Soil, pupil_pattern
from ...optics.lens.paths import direct_path
from ...optics.pupil.polygon import mapped, points
from ...typing import Floats
from ..ghosts.extent_blur import extent_coverage, joined_parts, spread_window
from ..scene.area_lights import motion
from ..scene.direct_image import PUPIL_SPAN, DirectImage, defocus_mm, pattern_stretch, traced_pupil, traced_spot
from ..scene.path_color import direct_flux
from ..scene.resolve import ResolvedProject
from ..scene.shot import Shot
from .many_lights import Stars, draw_stars
from .pattern import NEAR_SPLIT, starburst_layer
from .spectrum_basis import basis_spectra

# Hullin 2011, section 3.3: fine enough to average out the rings of single wavelengths
DIFFRACTION_STEP_NM = 5.0
# no film makes more of the light beyond than its 12e-6 of X, Y and Z under an incandescent lamp
LAST_NM = 780.0
# rotated and scaled copies that make up the spiral smear of art direction
SPIRAL_COPIES = 9
# a direct image with a larger defocus disc is drawn out of focus
OUT_OF_FOCUS_PX = 1.0
# from this number of lights with one pattern on, they are drawn together
MANY_LIGHTS = 8
# least number of lights per basis spectrum for which drawing them together saves time
LIGHTS_PER_SPECTRUM = 6


@dataclass(frozen=True)
class _Scene:
    """Data shared by all lights of a starburst."""

    settled: ResolvedProject
    mask: Floats | None
    soil: Soil | None
    look: Starburst


def read_soil(dirt: Dirt) -> Soil | None:
    """Read the dirt on the pupil; None if it is clean.

    Raises
    ------
    ProjectError
        The image of the dirt cannot be read.
    """
    if dirt.clean:
        return None
    return Soil(dirt, None if dirt.image is None else read_mask(dirt.image, what="dirt"))


def starburst_of(
    settled: ResolvedProject,
    shots: Sequence[Shot],
    images: Sequence[DirectImage],
    mask: Floats | None,
    soil: Soil | None = None,
    *,
    threads: int | None = None,
) -> Layer:
    """Draw the direct image of every light that has a starburst, spread by diffraction at the iris.

    Parameters
    ----------
    settled : ResolvedProject
    shots, images : sequence
        One per light, or per part of an area light.
    mask : ndarray, shape (A, B), or None
        Image of the iris.
    soil : Soil or None
        From `read_soil`.
    threads : int, optional
        None: all cores. The pixels do not depend on it.

    Returns
    -------
    Layer
        Named "starburst". Its light is the flux of the direct images minus the loss by dirt, in the unit of the ghosts,
        times the starburst intensity of art direction.

    Raises
    ------
    ProjectError
        The dirt leaves no light.
    """
    project = settled.project
    physical = project.art.physical or project.quality.mode == "reference"
    look = Starburst(cats_eye=project.starburst.cats_eye) if physical else project.starburst
    scene = _Scene(settled, mask, soil, look)
    width, height = shots[0].size_px
    total = black_picture(width, height)
    pairs = [pair for pair in zip(shots, images, strict=True) if project.lights[pair[0].number].starburst]
    lights = [list(of_one) for _, of_one in groupby(pairs, lambda pair: pair[0].number)]
    groups, others = _group_by_pattern(scene, lights)
    for group in groups:
        total += _many_lights(scene, group, threads)
    for parts in others:
        picture = _one_light(scene, parts, threads)
        if picture is not None:
            total += picture
    return Layer("starburst", total, (0, 0, width, height))


def _group_by_pattern(
    scene: _Scene, lights: list[list[tuple[Shot, DirectImage]]]
) -> tuple[list[list[tuple[Shot, DirectImage]]], list[list[tuple[Shot, DirectImage]]]]:
    """Group lights whose direct images share one pattern; return groups and single lights."""
    if len(lights) < MANY_LIGHTS or scene.look.cats_eye or scene.look.spiral_deg > 0.0:
        return [], lights
    groups: dict[tuple[float, ...], list[tuple[Shot, DirectImage]]] = {}
    others = []
    blurred: dict[float, bool] = {}
    for parts in lights:
        shot, image = parts[0]
        # distant lights share one defocus
        distance = shot.packed.nearness / shot.incidence.tilt_cosine
        if distance not in blurred:
            blurred[distance] = _out_of_focus(scene.settled, shot)
        if shot.border is not None or blurred[distance]:
            others.append(parts)
        elif _flux(shot, image) > 0.0:
            key = (*_diffracted_wavelengths(shot), *shot.packed.wavelengths_nm)
            groups.setdefault(key, []).append(parts[0])
    others += [[pair] for group in groups.values() if len(group) < MANY_LIGHTS for pair in group]
    return [group for group in groups.values() if len(group) >= MANY_LIGHTS], others


def _many_lights(scene: _Scene, group: list[tuple[Shot, DirectImage]], threads: int | None) -> NDArray[np.floating]:
    """Draw the lights of one pattern together, one drawing per basis spectrum."""
    shot = group[0][0]
    fine_nm = _diffracted_wavelengths(shot)
    (pattern,) = _patterns(scene, shot, np.zeros(1))
    assert pattern is not None, "only a cat's eye may be shut"
    pixels = shot.to_pixels
    places = np.array([image.position_mm for _, image in group]) * [pixels[2], -pixels[3]] + pixels[:2]
    throughputs = [lit.light.intensity * image.throughput_mm2 for lit, image in group]
    flux = direct_flux([lit for lit, _ in group], scene.settled.lens, throughputs, fine_nm)
    colors = np.array([lit.weights(fine_nm) for lit, _ in group]) * flux[:, :, None]
    chosen, gains, fits = basis_spectra(colors, max(1, len(group) // LIGHTS_PER_SPECTRUM))
    f_number = shot.working_f_number * scene.look.size
    stretch = pattern_stretch(scene.settled.lens, shot)
    strength = scene.look.intensity * pattern.transmittance / stretch
    pixel = (1.0 / float(pixels[2]) / stretch, 1.0 / float(pixels[3]))
    draft = scene.settled.project.quality.mode == "draft"
    total: NDArray[np.floating] = black_picture(*shot.size_px)
    for k, number in enumerate(chosen):
        own = Stars(pattern, f_number, fine_nm, colors[number] * strength, places[fits], gains[fits, k])
        total += draw_stars(own, pixel, shot.size_px, draft=draft, threads=threads)
    for pair in [pair for pair, good in zip(group, fits, strict=True) if not good]:
        picture = _one_light(scene, [pair], threads)
        if picture is not None:
            total += picture
    return total


def _out_of_focus(settled: ResolvedProject, shot: Shot) -> bool:
    return defocus_mm(settled.lens, shot) >= OUT_OF_FOCUS_PX / float(shot.to_pixels[2:].max())


def _one_light(
    scene: _Scene, parts: list[tuple[Shot, DirectImage]], threads: int | None
) -> NDArray[np.floating] | None:
    """Draw one light, all parts of an area light together; None if it is dark."""
    # the brightest part gives position and pupil
    shot, image = max(parts, key=lambda pair: _flux(*pair))
    fine_nm = _diffracted_wavelengths(shot)
    throughput: Floats = np.sum([part.light.intensity * found.throughput_mm2 for part, found in parts], axis=0)
    flux = direct_flux([shot], scene.settled.lens, [throughput], fine_nm)[0] * scene.look.intensity
    if not flux.any():
        return None
    # as the sensor sees a traced pupil, it is stretched already
    stretch = 1.0 if scene.look.cats_eye else pattern_stretch(scene.settled.lens, shot)
    pixel = (1.0 / float(shot.to_pixels[2]) / stretch, 1.0 / float(shot.to_pixels[3]))
    column = float(shot.to_pixels[0] + image.position_mm[0] * shot.to_pixels[2])
    row = float(shot.to_pixels[1] - image.position_mm[1] * shot.to_pixels[3])
    # a traced pupil has the size that the sensor sees, in units of the lens' f-number
    f_number = scene.settled.order.f_number if scene.look.cats_eye else shot.working_f_number
    # the pattern is centred on a pixel; the kernel contains the shift within that pixel
    middle = (math.floor(column) + 0.5, math.floor(row) + 0.5)
    kernel = _kernel(scene, parts, (shot, image), (column - middle[0], row - middle[1]))
    if kernel is not None:
        column, row = middle
    margin = (0, 0) if kernel is None else (kernel.shape[1] // 2, kernel.shape[0] // 2)
    width, height = shot.size_px
    size = (width + 2 * margin[0], height + 2 * margin[1])
    picture: NDArray[np.floating] | None = None
    smear = math.radians(scene.look.spiral_deg)
    quality = scene.settled.project.quality
    turns = ((np.arange(SPIRAL_COPIES) + 0.5) / SPIRAL_COPIES - 0.5) * smear if smear > 0.0 else np.zeros(1)
    for turn, made in zip(turns, _patterns(scene, shot, turns), strict=True):
        pattern = made
        if pattern is None:
            return None
        if smear > 0.0 and isinstance(pattern.wings, BladeWings):
            # a copy of a straight spike is as wide as the step between copies, so that no gaps appear
            half_fan = max(pattern.wings.half_fan, 0.5 * smear / SPIRAL_COPIES)
            pattern = replace(pattern, wings=replace(pattern.wings, half_fan=half_fan))
        drawn = starburst_layer(
            pattern,
            f_number * scene.look.size * math.exp(float(turn)),
            pixel,
            size,
            (column + margin[0], row + margin[1]),
            fine_nm,
            shot.weights(fine_nm) * (flux * pattern.transmittance / (len(turns) * stretch))[:, None],
            # the centre of a starburst is clipped on screens
            split=1 if quality.mode == "draft" or quality.screen else NEAR_SPLIT,
            threads=threads,
        )
        picture = drawn if picture is None else picture + drawn
    if picture is None or kernel is None:
        return picture
    return spread_window(picture.astype(np.float32, copy=False), (0, 0), size, kernel)[0]


def _flux(shot: Shot, image: DirectImage) -> float:
    return shot.light.intensity * float(image.throughput_mm2.mean())


def _kernel(
    scene: _Scene,
    parts: list[tuple[Shot, DirectImage]],
    brightest: tuple[Shot, DirectImage],
    offset: tuple[float, float],
) -> Floats | None:
    """Return the kernel that spreads the direct image besides diffraction: defocus and the light's shape.

    The kernel is shifted by `offset`, in columns and rows.
    """
    settled, shot = scene.settled, brightest[0]
    shape = _shape(settled, parts, brightest, offset) if shot.border is not None else None
    if not _out_of_focus(settled, shot):
        return shape
    spot = traced_spot(settled.lens, shot, offset if shape is None else (0.0, 0.0))
    if spot is None or shape is None:
        return shape if spot is None else spot
    return joined_parts(spot, shape)


def _shape(
    settled: ResolvedProject,
    parts: list[tuple[Shot, DirectImage]],
    brightest: tuple[Shot, DirectImage],
    offset: tuple[float, float],
) -> Floats | None:
    """Draw the image of an area light: its parts, each with its flux, around the position of the brightest part."""
    drawn = []
    zoom = brightest[0].to_pixels[2:] * [1.0, -1.0]
    for shot, image in parts:
        moved = motion(shot, direct_path(settled.lens)) if _flux(shot, image) > 0.0 else None
        if moved is not None and shot.border is not None:
            place = np.array(image.position_mm) - np.array(brightest[1].position_mm)
            border = mapped(shot.border, zoom[:, None] * moved[0], place * zoom + offset)
            drawn.append((border, _flux(shot, image)))
    if not drawn:
        return None
    reach = [int(np.ceil(max(np.abs(points(border)[:, k]).max() for border, _ in drawn) + 0.5)) for k in (1, 0)]
    size = (2 * reach[0] + 1, 2 * reach[1] + 1)
    total = np.zeros(size)
    for border, flux in drawn:
        part = np.abs(extent_coverage(mapped(border, np.eye(2), np.array([reach[1], reach[0]]) + 0.5), size))
        area = float(part.sum())
        total += part * (flux / area) if area > 0.0 else 0.0
    return np.asarray(total / total.sum()) if total.any() else None


def _patterns(scene: _Scene, shot: Shot, turns: Floats) -> list[Pattern | None]:
    """Compute the pattern at each rotation of the smear."""
    order = scene.settled.order
    iris, mask, span = scene.settled.iris, scene.mask, 1.0
    if scene.look.cats_eye:
        mask = traced_pupil(scene.settled.lens, shot, order.f_number)
        if mask is None:
            return [None] * len(turns)
        # the traced pupil already contains the blades
        iris, span = Iris(), PUPIL_SPAN
    with raised_as(ProjectError):
        return [
            pupil_pattern(iris, mask, span=span, radius_mm=order.stop_semi_diameter, soil=scene.soil, turn=float(turn))
            for turn in turns
        ]


def _diffracted_wavelengths(shot: Shot) -> Floats:
    """Return wavelengths in steps of 5 nm up to `LAST_NM`, or the lines of a line spectrum."""
    if isinstance(shot.light.spectrum, Lines):
        return np.array(sorted({nm for nm, _ in shot.light.spectrum.lines}))
    return np.arange(VISIBLE_NM[0], LAST_NM + 1.0, DIFFRACTION_STEP_NM)
