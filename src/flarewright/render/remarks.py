"""Sentences for the user about a finished picture."""

from __future__ import annotations

from collections.abc import Sequence

from ..model import Layer, Stop
from ..optics.lens.surface_shape import ideal
from ..optics.scattering.sensor_grating import grating_orders
from ..typing import Floats
from .scene.direct_image import widest_defocus_mm
from .scene.placement_remarks import veil_remarks
from .scene.resolve import ResolvedProject
from .scene.shot import Shot
from .starburst.starburst_pass import OUT_OF_FOCUS_PX

BLACK = "the picture is black: no light comes through the lens to the sensor"
HIDDEN = "the picture is black: a holdout or a depth plate hides every light"
MANY_PARTS = 36
"""Number of parts of area lights from which on a remark states that they take the time."""
DARK = "the picture is black: every light has intensity 0"


def percent(share: float) -> str:
    """Format a part of the light as a percentage."""
    return f"{100.0 * share:.2g} %" if share >= 1e-6 else "less than 0.0001 %"


def black_remarks(settled: ResolvedProject, shots: Sequence[Shot], passes: Sequence[Layer]) -> tuple[str, ...]:
    """Return a remark on why a picture is black; none if it has light."""
    # line by line: a picture with light ends the search early
    if any(line.any() for layer in passes for line in layer.pixels):
        return ()
    if not any(light.intensity > 0.0 for light in settled.project.lights):
        return (DARK,)
    return (BLACK,) if any(shot.share > 0.0 for shot in shots) else (HIDDEN,)


def ghost_veil_remarks(passes: Sequence[Layer]) -> list[str]:
    """Return remarks about a veil of ghosts over the whole picture."""
    ghosts = next((layer for layer in passes if layer.name == "ghosts"), None)
    return [] if ghosts is None else veil_remarks(ghosts)


def scene_remarks(settled: ResolvedProject, shots: tuple[Shot, ...]) -> tuple[str, ...]:
    """Return remarks about defocus, settings that the quality ignores, and expensive rings."""
    remarks = []
    blur_px = widest_defocus_mm(settled.lens, shots) * float(shots[0].to_pixels[2])
    if settled.project.output.starburst and blur_px > OUT_OF_FOCUS_PX:
        of = f"the direct image of {'the light' if len(shots) == 1 else 'a light'} is out of focus"
        spot = "a disc" if shots[0].packed.curvature_x is None else "a spot up to"
        remarks.append(f"{of}: {spot} {blur_px:.1f} pixels wide")
    if settled.project.quality.mode == "draft" and ideal(settled.lens) != settled.lens:
        remarks.append("draft quality draws the lens as designed, without decentre, tilt and figure errors")
    quality = settled.project.quality
    extended = sum(shot.border is not None for shot in shots)
    if quality.mode == "final" and extended > MANY_PARTS:
        remarks.append(
            f"area lights were traced in {extended} parts, each as long as a point; "
            "--quality draft has at most 16 a light"
        )
    remarks += _grating_remarks(settled, shots)
    if quality.ringing == "frft" and quality.mode != "final":
        remarks.append(f"{quality.mode} quality traces rays alone: quality.ringing is for final quality")
    rings = shots[0].ringing
    if rings is not None:
        # imported only where there are rings
        from .ghosts.ring_tables import table_obstacle

        if own := table_obstacle(settled.project.lights, image=rings.form is None):
            remarks.append(f"rings in the ghosts of {own} take most of the time: --ringing off leaves them out")
    return tuple(remarks)


def _grating_remarks(settled: ResolvedProject, shots: tuple[Shot, ...]) -> list[str]:
    """Return remarks about orders of a sensor grating that are invisible or left out."""
    camera, mode = settled.project.camera, settled.project.quality.mode
    if camera.sensor_grating is None:
        return []
    if settled.sensor is None:
        return ["camera.sensor_grating diffracts what the sensor reflects: nothing without camera.sensor_reflectance"]
    if mode != "final":
        return [f"{mode} quality mirrors at the sensor: camera.sensor_grating is for final quality"]
    last = max(k for k, row in enumerate(settled.lens.rows) if not isinstance(row, Stop))
    orders = grating_orders(shots[0].packed, last, camera.sensor_grating)
    drawn = sum(order.efficiency for order in orders)
    return [f"{len(orders)} orders of the sensor's grating were drawn, which hold {drawn:.1%} of what it reflects"]


def mask_remarks(mask: Floats | None) -> list[str]:
    """Return a remark about a mask that is not square: it is mapped to the square around the round opening."""
    if mask is None or mask.shape[0] == mask.shape[1]:
        return []
    height, width = mask.shape
    return [f"the iris image has {width}x{height} pixels and is stretched to the square around the iris; give a square"]
