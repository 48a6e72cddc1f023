"""The starburst pass: every light's direct image with its own pupil, dirt, size and spectrum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ..errors import ProjectError
from ..io.mask_image import read_mask
from ..model import Dirt, Iris, Layer, Lines, Starburst
from ..optics.border import mapped, points
from ..optics.diffraction import BladeWings, Pattern, Soil, pupil_pattern
from ..optics.paths import direct_path
from ..optics.spectrum import VISIBLE_NM
from .direct import PUPIL_SPAN, DirectImage, defocus_mm, traced_pupil, traced_spot
from .few_spectra import few_spectra
from .many_stars import Stars, draw_stars
from .path_color import direct_flux
from .prepare import Settled
from .shot import Shot
from .sources import motion
from .spread import covered, joined, spread
from .starburst import NEAR_SPLIT, starburst_layer

Floats = NDArray[np.float64]

# Hullin 2011, section 3.3: fine enough to blur the rings of single wavelengths into each other
DIFFRACTION_STEP_NM = 5.0
# turned and grown copies that stand for the artist's smear
SPIRAL_COPIES = 9
# a direct image whose disc of defocus is wider than this is drawn out of focus
OUT_OF_FOCUS_PX = 1.0
# so many lights of one look are drawn together
MANY_LIGHTS = 8
# fewer lights than this for each of the spectra that stand for theirs are not worth it
FEW_SPECTRA = 6

__all__ = ["read_soil", "starburst_of"]


@dataclass(frozen=True)
class _Scene:
    """What all lights of a starburst share."""

    settled: Settled
    mask: Floats | None
    soil: Soil | None
    look: Starburst


def read_soil(dirt: Dirt) -> Soil | None:
    """Read what lies on the pupil; None when it is clean.

    Parameters
    ----------
    dirt : Dirt

    Returns
    -------
    Soil or None

    Raises
    ------
    ProjectError
        When its image cannot be read.
    """
    if dirt.clean:
        return None
    return Soil(dirt, None if dirt.image is None else read_mask(dirt.image, what="dirt"))


def starburst_of(
    settled: Settled,
    shots: Sequence[Shot],
    images: Sequence[DirectImage],
    mask: Floats | None,
    soil: Soil | None = None,
    *,
    threads: int | None = None,
) -> Layer:
    """Draw the direct image of every light, spread by diffraction at the iris.

    Parameters
    ----------
    settled : Settled
    shots, images : sequence
        One a light, or a part of an area light.
    mask : ndarray, shape (A, B), or None
        The iris as an image.
    soil : Soil or None
        From `read_soil`.
    threads : int, optional
        None: all cores; the pixels do not depend on it.

    Returns
    -------
    Layer
        Named "starburst"; its light is the direct images' flux less what dirt takes, in the unit of the ghosts, times
        the artist's intensity.

    Raises
    ------
    ProjectError
        When dirt leaves no light.
    """
    project = settled.project
    physical = project.art.physical or project.quality.mode == "reference"
    look = Starburst(cats_eye=project.starburst.cats_eye) if physical else project.starburst
    scene = _Scene(settled, mask, soil, look)
    width, height = shots[0].size_px
    total = np.zeros((height, width, 3), dtype=np.float32)
    lights = [list(of_one) for _, of_one in groupby(zip(shots, images, strict=True), lambda pair: pair[0].number)]
    groups, others = _alike(scene, lights)
    for group in groups:
        total += _many_lights(scene, group, threads)
    for parts in others:
        picture = _one_light(scene, parts, threads)
        if picture is not None:
            total += picture
    return Layer("starburst", total, (0, 0, width, height))


def _alike(
    scene: _Scene, lights: list[list[tuple[Shot, DirectImage]]]
) -> tuple[list[list[tuple[Shot, DirectImage]]], list[list[tuple[Shot, DirectImage]]]]:
    """Collect lights whose direct images are one pattern at many places; the rest are drawn one by one."""
    if len(lights) < MANY_LIGHTS or scene.look.cats_eye or scene.look.spiral_deg > 0.0:
        return [], lights
    groups: dict[tuple[float, ...], list[tuple[Shot, DirectImage]]] = {}
    others = []
    blurred: dict[float, bool] = {}
    for parts in lights:
        shot, image = parts[0]
        # all distant lights are as sharp as one
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
    """Draw lights of one pattern together: as many times as there are spectra that stand for all of theirs."""
    shot = group[0][0]
    fine_nm = _diffracted_wavelengths(shot)
    (pattern,) = _patterns(scene, shot, np.zeros(1))
    assert pattern is not None, "only a cat's eye may be shut"
    pixels = shot.to_pixels
    places = np.array([image.position_mm for _, image in group]) * [pixels[2], -pixels[3]] + pixels[:2]
    throughputs = [lit.light.intensity * image.throughput_mm2 for lit, image in group]
    flux = direct_flux([lit for lit, _ in group], scene.settled.lens, throughputs, fine_nm)
    colors = np.array([lit.weights(fine_nm) for lit, _ in group]) * flux[:, :, None]
    chosen, gains, fits = few_spectra(colors, max(1, len(group) // FEW_SPECTRA))
    f_number = scene.settled.order.f_number * scene.look.size
    strength = scene.look.intensity * pattern.transmittance
    pixel = (1.0 / float(pixels[2]), 1.0 / float(pixels[3]))
    draft = scene.settled.project.quality.mode == "draft"
    total: NDArray[np.floating] = np.zeros((shot.size_px[1], shot.size_px[0], 3), dtype=np.float32)
    for k, number in enumerate(chosen):
        own = Stars(pattern, f_number, fine_nm, colors[number] * strength, places[fits], gains[fits, k])
        total += draw_stars(own, pixel, shot.size_px, draft=draft, threads=threads)
    for pair in [pair for pair, good in zip(group, fits, strict=True) if not good]:
        picture = _one_light(scene, [pair], threads)
        if picture is not None:
            total += picture
    return total


def _out_of_focus(settled: Settled, shot: Shot) -> bool:
    return defocus_mm(settled.lens, shot) >= OUT_OF_FOCUS_PX / float(shot.to_pixels[2:].max())


def _one_light(
    scene: _Scene, parts: list[tuple[Shot, DirectImage]], threads: int | None
) -> NDArray[np.floating] | None:
    """Draw one light, the parts of an area light together; None when it is dark."""
    # the brightest part stands for the others: its place, and its pupil
    shot, image = max(parts, key=lambda pair: _flux(*pair))
    fine_nm = _diffracted_wavelengths(shot)
    throughput: Floats = np.sum([part.light.intensity * found.throughput_mm2 for part, found in parts], axis=0)
    flux = direct_flux([shot], scene.settled.lens, [throughput], fine_nm)[0] * scene.look.intensity
    if not flux.any():
        return None
    pixel = (1.0 / float(shot.to_pixels[2]), 1.0 / float(shot.to_pixels[3]))
    column = float(shot.to_pixels[0] + image.position_mm[0] * shot.to_pixels[2])
    row = float(shot.to_pixels[1] - image.position_mm[1] * shot.to_pixels[3])
    order = scene.settled.order
    # a pattern is drawn into whole pixels: what spreads it knows where within its pixel it is
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
            # copies of a straight spike are as wide as the step between them, and leave no gap
            half_fan = max(pattern.wings.half_fan, 0.5 * smear / SPIRAL_COPIES)
            pattern = replace(pattern, wings=replace(pattern.wings, half_fan=half_fan))
        drawn = starburst_layer(
            scene.settled.iris,
            order.f_number * scene.look.size * math.exp(float(turn)),
            pixel,
            size,
            (column + margin[0], row + margin[1]),
            fine_nm,
            shot.weights(fine_nm) * (flux * pattern.transmittance / len(turns))[:, None],
            pattern=pattern,
            # the middle of a starburst is white on a screen
            split=1 if quality.mode == "draft" or quality.screen else NEAR_SPLIT,
            threads=threads,
        )
        picture = drawn if picture is None else picture + drawn
    if picture is None or kernel is None:
        return picture
    return spread(picture, kernel)[margin[1] : margin[1] + height, margin[0] : margin[0] + width]


def _flux(shot: Shot, image: DirectImage) -> float:
    return shot.light.intensity * float(image.throughput_mm2.mean())


def _kernel(
    scene: _Scene,
    parts: list[tuple[Shot, DirectImage]],
    brightest: tuple[Shot, DirectImage],
    offset: tuple[float, float],
) -> Floats | None:
    """Return what the direct image of a point is spread over besides diffraction: defocus, and the light's shape.

    It is moved by `offset`, columns and rows.
    """
    settled, shot = scene.settled, brightest[0]
    shape = _shape(settled, parts, brightest, offset) if shot.border is not None else None
    if not _out_of_focus(settled, shot):
        return shape
    spot = traced_spot(settled.lens, shot, offset if shape is None else (0.0, 0.0))
    if spot is None or shape is None:
        return shape if spot is None else spot
    return joined(spot, shape)


def _shape(
    settled: Settled,
    parts: list[tuple[Shot, DirectImage]],
    brightest: tuple[Shot, DirectImage],
    offset: tuple[float, float],
) -> Floats | None:
    """Draw an area light as its parts are imaged, each with its own flux; the middle is the brightest part's place."""
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
        part = np.abs(covered(mapped(border, np.eye(2), np.array([reach[1], reach[0]]) + 0.5), size))
        area = float(part.sum())
        total += part * (flux / area) if area > 0.0 else 0.0
    return np.asarray(total / total.sum()) if total.any() else None


def _patterns(scene: _Scene, shot: Shot, turns: Floats) -> list[Pattern | None]:
    """Make the pattern at every turn of the smear."""
    order = scene.settled.order
    iris, mask, span = scene.settled.iris, scene.mask, 1.0
    if scene.look.cats_eye:
        mask = traced_pupil(scene.settled.lens, shot, order.f_number)
        if mask is None:
            return [None] * len(turns)
        # it is drawn as the blades stand
        iris, span = Iris(), PUPIL_SPAN
    try:
        return [
            pupil_pattern(iris, mask, span=span, radius_mm=order.stop_semi_diameter, soil=scene.soil, turn=float(turn))
            for turn in turns
        ]
    except ValueError as error:
        raise ProjectError(str(error)) from error


def _diffracted_wavelengths(shot: Shot) -> Floats:
    """Return steps of 5 nm over the visible range, or the lines of a spectrum of lines."""
    if isinstance(shot.light.spectrum, Lines):
        return np.array(sorted({nm for nm, _ in shot.light.spectrum.lines}))
    return np.arange(VISIBLE_NM[0], VISIBLE_NM[1] + 1.0, DIFFRACTION_STEP_NM)
