"""What `flarewright render` takes a lens of the library to be like when nothing is said: as it is photographed with.

Bare glass, wide open, a point of light and ideal blades are what science asks for (`--ideal`), and look like no
photograph. A photographer's lens is coated, stopped down, has rounded blades, and its lights have a size.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..optics.pack import PERIOD, STAGGERED

if TYPE_CHECKING:
    from ..model import Lens
    from .render_flags import Flags

STOPPED = 4.0
"""Fast lenses, two stops down from wide open, are stopped down at least to this f-number."""

THIRDS = (4.0, 4.5, 5.0, 5.6, 6.3, 7.1, 8.0, 9.0, 10.0, 11.0, 13.0, 14.0, 16.0, 18.0, 20.0, 22.0)
"""F-numbers engraved in thirds of a stop."""

ROUNDING = 0.3
ROUGHNESS_UM = 3.0
"""Rms of the blades' edges: cut steel is true to some micrometres."""

LIGHT_DEG = 0.25

__all__ = ["as_photographed"]


def as_photographed(flags: Flags) -> tuple[Flags, str | None]:
    """Fill in what is not said for a lens of the library; say what was filled in.

    Parameters
    ----------
    flags : Flags

    Returns
    -------
    Flags
        With an f-number, a coating, rounded blades and the size of lights where none are given.
    str or None
        A remark; None where nothing was filled in: of a project, and of a person's own lens file.
    """
    from ..io.library import is_shipped, lens_path
    from ..render.prepare import load_lens

    if flags.project is not None or flags.resumed is not None or flags.lens is None:
        return flags, None
    path = lens_path(flags.lens)
    if not is_shipped(path):
        return flags, None
    lens, told = load_lens(flags.lens), []
    changes: dict[str, Any] = {}
    if flags.fstop is None:
        changes["fstop"] = stopped_down(lens.f_number)
        told.append(f"f/{changes['fstop']:g}")
    if flags.coating is None:
        changes["coating"] = f"preset:{plausible_preset(lens)}"
        told.append(f"coating {changes['coating']} (chosen, not known)")
    if flags.rounding is None and flags.blades is None and flags.iris_image is None and _straight(lens):
        changes["rounding"] = ROUNDING
        told.append(f"blades rounded by {ROUNDING:g}")
        if flags.roughness is None:
            changes["roughness"] = ROUGHNESS_UM
            told.append(f"edges rough by {ROUGHNESS_UM:g} um")
    if flags.light and not (flags.light_diameter or flags.light_size or flags.light_polygon or _has_sun(flags)):
        changes["light_diameter"] = [LIGHT_DEG]
        told.append(f"lights of {LIGHT_DEG:g} degrees")
    if not changes:
        return flags, None
    return replace(flags, **changes), f"as photographed: {', '.join(told)}; --ideal leaves this out"


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


def _straight(lens: Lens) -> bool:
    return lens.iris.blades > 0 and lens.iris.rounding == 0.0 and lens.iris.mask is None


def _has_sun(flags: Flags) -> bool:
    """Whether a light has a size of its own (`--light sun@X,Y`)."""
    return any("@" in text for text in flags.light)
