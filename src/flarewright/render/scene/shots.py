"""Prepare all lights of a project as shots: area lights in parts, without what holdouts hide."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from ...model import Light, Project, Quality
from ...optics.colour.spectrum import covers_all_lines, sampled_wavelengths, traced_wavelengths
from ...optics.pupil.light_shape import parts
from ...optics.pupil.polygon import closed
from ...optics.rays.bundle import incidence
from ...optics.rays.pack import PackedLens, facing, resolve_coatings
from ...optics.rays.path_reflectance import BandCurves, coating_curves
from .between_wavelengths import Between, lens_between
from .holdout import read_plates, seen_part
from .opening import Opening
from .resolve import ResolvedProject, distance_in_front
from .shot import Shot

DRAFT_PARTS = 4
"""Largest number of parts of an area light in each direction in drafts: a ghost of matrices moves almost linearly, and
a light of 40 degrees with four parts differs from one with twenty by 1 % of its light (mean over the picture)."""

WIDEST_DIVIDED_DEG, MOST_PARTS = 24.0, 12
"""Parts of an area light are no wider than the step up to this width of the light, or this number of them across. A
wider light has no more. The sum of their errors is a part of the ghosts' light, and parts of a twelfth of a wide light
leave 0.5 % of it, as parts of 2 degrees do of a narrow one; their number would grow with its square."""


def make_shots(settled: ResolvedProject, opening: Opening, *, sampled: bool = False) -> tuple[Shot, ...]:
    """Return the shots of all lights of a project, several for an area light.

    Parameters
    ----------
    settled : ResolvedProject
    opening : Opening
    sampled : bool
        Whether the wavelengths are spectral samples (`optics.colour.spectrum.sampled_wavelengths`), for random rays.
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
    packs: dict[tuple[object, ...], tuple[PackedLens, BandCurves | None, Between | None]] = {}
    shots: list[Shot] = []
    for number, light in enumerate(project.lights):
        wavelengths_nm = choose(quality.wavelengths, light.spectrum)
        # line spectra are traced at their lines
        whole_light = covers_all_lines(light.spectrum, wavelengths_nm)
        banded = curves is not None and not whole_light
        traced = tuple(wavelengths_nm.tolist())
        key = (traced, light.spectrum)
        if key not in packs:
            of_bands = curves if banded else None
            between = lens_between(settled.lens, settled.order, coatings, settled.sensor, of_bands, light.spectrum)
            steep = bridged and not whole_light and 1 < len(traced) < len(between.fine_nm)
            packs[key] = *between.packed_at(wavelengths_nm), between if steep else None
        of_light, bands, between_them = packs[key]
        whole = []
        distance = distance_in_front(settled, of_light, number)
        near = light if distance == light.distance else light.replace(distance=distance)
        for part in parts(light, quality.source_step_deg, most_parts(quality)):
            changes = {"field_deg": part.field_deg, "intensity": light.intensity * part.share, "holdout": None}
            point = near.replace(**changes, diameter_deg=0.0, shape=None) if light.extended else near
            seen = incidence(point.field_deg, distance, settled.order.entrance_pupil_z)
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
                    between=between_them,
                    dense=sampled and not whole_light,
                )
            )
        shots += whole if project.holdout is None and light.holdout is None else _unhidden(settled, light, whole)
    return tuple(shots)


def most_parts(quality: Quality) -> int | None:
    """Return the largest number of parts of an area light in each direction; None: any.

    Parameters
    ----------
    quality : Quality
        Reference quality draws single directions, so its parts stay as narrow as it sets them.
    """
    if quality.mode == "reference":
        return None
    if quality.mode == "draft":
        return DRAFT_PARTS
    return max(MOST_PARTS, ceil(WIDEST_DIVIDED_DEG / quality.source_step_deg))


def _unhidden(settled: ResolvedProject, light: Light, whole: list[Shot]) -> list[Shot]:
    """Return the visible parts of a light, or one dark point if all of it is hidden."""
    plates = read_plates(settled.project, light)
    seen = [shot for part in whole if (shot := seen_part(settled.lens, part, plates)) is not None]
    return seen or [replace(whole[0], light=whole[0].light.replace(intensity=0.0), share=0.0, border=None)]
