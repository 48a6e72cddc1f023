"""Photographic defaults for lenses of the library: plausible settings where the user gives none.

The ideal settings (`flarewright render --ideal`) are bare glass, wide open, a point light and perfect blades; they do
not look like a photograph. A photographer's lens is coated and stopped down and has rounded blades; lights have a size.
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet

from ...io.lens.library import in_library, lens_path
from ...model import Iris, Lens, Light, Preset, Project
from ...optics.lens.zoom import positioned
from ...optics.pupil.light_shape import disc_fits
from ...optics.rays.pack import PERIOD, STAGGERED
from .resolve import open_lens

LEAST_F_NUMBER = 4.0
"""Smallest default f-number of fast lenses, which are otherwise stopped down by two stops."""

THIRD_STOPS = (4.0, 4.5, 5.0, 5.6, 6.3, 7.1, 8.0, 9.0, 10.0, 11.0, 13.0, 14.0, 16.0, 18.0, 20.0, 22.0)
"""F-numbers engraved in thirds of a stop."""

ROUNDING = 0.03
"""Roundness of the blades. A rounded blade turns its spike into a fan of 360 degrees / blades times this number: at 0.2
six blades make fans of 12 degrees, and the 18 fans of nine blades leave hardly a gap."""
ROUGHNESS_UM, ROUGHNESS_LENGTH_UM = 2.0, 200.0
"""Rms and correlation length of the blades' edges: cut steel is accurate to some micrometres. The light of a rough edge
leaves its spike the sooner the farther out (`optics.diffraction`), so that spikes taper and the core is round."""

LIGHT_DEG = 0.25


def as_photographed(project: Project, said: AbstractSet[str] = frozenset()) -> tuple[Project, tuple[str, ...]]:
    """Fill in settings for a lens of the library that the user has not given.

    Parameters
    ----------
    project : Project
        With a shipped lens by name; any other project is returned unchanged.
    said : set of str
        Settings to keep: "f_number", "coating", "iris.blades", "iris.rounding", "iris.roughness_um", "iris.mask",
        "lights".

    Returns
    -------
    project : Project
        With an f-number, a coating, rounded blades and sizes of lights where they were not given.
    chosen : tuple of str
        Short descriptions of what was filled in.

    Examples
    --------
    >>> from flarewright import Light, Project
    >>> project, filled = as_photographed(Project(lens="takumar-50-f1.4", lights=(Light(field_deg=(-9.0, 5.0)),)))
    >>> project.f_number, filled[0]
    (4.0, 'f/4')
    """
    if not isinstance(project.lens, str) or not in_library(lens_path(project.lens)):
        return project, ()
    lens, chosen = open_lens(project.lens).lens, []
    changes: dict[str, object] = {}
    if "f_number" not in said:
        # a zoom may open less at its long end
        at_zoom = positioned(lens, project.zoom, project.camera.focus_distance)
        changes["f_number"] = stopped_down(at_zoom.f_number)
        chosen.append(f"f/{changes['f_number']:g}")
    if "coating" not in said:
        preset = plausible_preset(lens)
        changes["coating"] = Preset(name=preset)
        chosen.append(f"coating preset:{preset} (chosen, not known)")
    iris = project.iris or lens.iris
    if not said & {"iris.blades", "iris.rounding", "iris.mask"} and _straight(iris):
        roughened = {"rounding": ROUNDING}
        chosen.append(f"blades rounded by {ROUNDING:g}")
        if "iris.roughness_um" not in said and iris.roughness_um == 0.0:
            roughened |= {"roughness_um": ROUGHNESS_UM, "roughness_length_um": ROUGHNESS_LENGTH_UM}
            chosen.append(f"edges rough by {ROUGHNESS_UM:g} um")
        changes["iris"] = iris.replace(**roughened)
    if "lights" not in said and all(_point(light) for light in project.lights):
        sized = (light.replace(diameter_deg=LIGHT_DEG) for light in project.lights)
        # a light at the border of the front half-space stays a point
        changes["lights"] = tuple(wide if disc_fits(wide) else wide.replace(diameter_deg=0.0) for wide in sized)
        if changes["lights"] != project.lights:
            chosen.append(f"lights of {LIGHT_DEG:g} degrees")
    filled: Project = project.replace(**changes) if changes else project
    return filled, tuple(chosen)


def stopped_down(f_number: float) -> float:
    """Return the engraved f-number two stops down from wide open, at least f/4."""
    target = max(2.0 * f_number, LEAST_F_NUMBER)
    return min((max(number, f_number) for number in THIRD_STOPS), key=lambda number: abs(number / target - 1.0))


def plausible_preset(lens: Lens) -> str:
    """Return the coating preset with which a lens of the library is shown.

    The films of its time, staggered over the surfaces; for a lens without a preset of its time, the first in its file.
    """
    if PERIOD in lens.coating_presets:
        return PERIOD
    return next((name for name in lens.coating_presets if name not in (STAGGERED, "single-coated")), STAGGERED)


def _straight(iris: Iris) -> bool:
    return iris.blades > 0 and iris.rounding == 0.0 and iris.mask is None


def _point(light: Light) -> bool:
    return light.diameter_deg == 0.0 and light.shape is None
