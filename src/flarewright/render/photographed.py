"""What a lens of the library is taken to be like where nothing is said: as it is photographed with.

Bare glass, wide open, a point of light and ideal blades are what science asks for (`flarewright render --ideal`), and
look like no photograph. A photographer's lens is coated and stopped down and has rounded blades; lights have a size.
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet

from ..io.library import is_shipped, lens_path
from ..model import Iris, Lens, Light, Preset, Project, Surface
from ..optics.pack import PERIOD, STAGGERED
from .prepare import load_lens

STOPPED = 4.0
"""Fast lenses, two stops down from wide open, are stopped down at least to this f-number."""

THIRDS = (4.0, 4.5, 5.0, 5.6, 6.3, 7.1, 8.0, 9.0, 10.0, 11.0, 13.0, 14.0, 16.0, 18.0, 20.0, 22.0)
"""F-numbers engraved in thirds of a stop."""

ROUNDING = 0.2
ROUGHNESS_UM, ROUGHNESS_LENGTH_UM = 5.0, 50.0
"""Rms of the blades' edges and how far along it hangs together: cut steel is true to some micrometres. Without it the
fans of light that rounded blades make have hard borders, and widen; with it spikes taper and the core is round."""

LIGHT_DEG = 0.25

__all__ = [
    "LIGHT_DEG", "ROUGHNESS_LENGTH_UM", "ROUGHNESS_UM", "ROUNDING", "as_photographed", "plausible_preset",
    "stopped_down",
]  # fmt: skip


def as_photographed(project: Project, said: AbstractSet[str] = frozenset()) -> tuple[Project, tuple[str, ...]]:
    """Fill in what is not said of a lens of the library.

    Parameters
    ----------
    project : Project
        Of a shipped lens by its name; any other is returned as it is.
    said : set of str
        What stays: "f_number", "coating", "iris.blades", "iris.rounding", "iris.roughness_um", "iris.mask", "lights",
        "quality.ringing".

    Returns
    -------
    project : Project
        With an f-number, a coating, rounded blades and the size of lights where none are said.
    told : tuple of str
        What was filled in, in few words each.

    Examples
    --------
    >>> from flarewright import Light, Project
    >>> project, told = as_photographed(Project(lens="takumar-50-f1.4", lights=(Light(field_deg=(-9.0, 5.0)),)))
    >>> project.f_number, told[0]
    (4.0, 'f/4')
    """
    if not isinstance(project.lens, str) or not is_shipped(lens_path(project.lens)):
        return project, ()
    lens, told = load_lens(project.lens), []
    changes: dict[str, object] = {}
    if "f_number" not in said:
        changes["f_number"] = stopped_down(lens.f_number)
        told.append(f"f/{changes['f_number']:g}")
    if "coating" not in said:
        preset = plausible_preset(lens)
        changes["coating"] = Preset(name=preset)
        told.append(f"coating preset:{preset} (chosen, not known)")
    iris = project.iris or lens.iris
    if not said & {"iris.blades", "iris.rounding", "iris.mask"} and _straight(iris):
        worn = {"rounding": ROUNDING}
        told.append(f"blades rounded by {ROUNDING:g}")
        if "iris.roughness_um" not in said and iris.roughness_um == 0.0:
            worn |= {"roughness_um": ROUGHNESS_UM, "roughness_length_um": ROUGHNESS_LENGTH_UM}
            told.append(f"edges rough by {ROUGHNESS_UM:g} um")
        changes["iris"] = iris.replace(**worn)
    if "lights" not in said and all(_point(light) for light in project.lights):
        changes["lights"] = tuple(light.replace(diameter_deg=LIGHT_DEG) for light in project.lights)
        told.append(f"lights of {LIGHT_DEG:g} degrees")
    if "quality.ringing" not in said and project.quality.ringing != "off" and _has_cylinders(lens):
        changes["quality"] = project.quality.replace(ringing="off")
        told.append("no rings in ghosts, which take most of the time behind cylinders")
    filled: Project = project.replace(**changes) if changes else project
    return filled, tuple(told)


def stopped_down(f_number: float) -> float:
    """Return the engraved f-number two stops down from wide open, f/4 at least."""
    wanted = max(2.0 * f_number, STOPPED)
    return min((max(number, f_number) for number in THIRDS), key=lambda number: abs(number / wanted - 1.0))


def plausible_preset(lens: Lens) -> str:
    """Return the coating preset that a lens of the library is shown with.

    Films of its time, on each surface its own; of a lens that has none of that time, the first that its file names.
    """
    if PERIOD in lens.coating_presets:
        return PERIOD
    return next((name for name in lens.coating_presets if name not in (STAGGERED, "single-coated")), STAGGERED)


def _has_cylinders(lens: Lens) -> bool:
    return any(isinstance(row, Surface) and row.toroidal for row in lens.rows)


def _straight(iris: Iris) -> bool:
    return iris.blades > 0 and iris.rounding == 0.0 and iris.mask is None


def _point(light: Light) -> bool:
    return light.diameter_deg == 0.0 and light.shape is None
