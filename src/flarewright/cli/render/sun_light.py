"""`--sun WHEN,LAT,LON`: the sun at a place and time, in the view of a camera."""

from __future__ import annotations

from datetime import datetime
from math import isfinite
from typing import TYPE_CHECKING

from ...errors import ProjectError

if TYPE_CHECKING:
    from ...workflow.sun_place import SunPlace
    from .options.record import RenderOptions

_FORM = "--sun 2024-06-21T18:00+02:00,48.14,11.58 (time with its offset from UTC, degrees north, degrees east)"
# ranges of heading, tilt and roll, degrees
_RANGES = {"--heading": (-360.0, 360.0), "--tilt": (-90.0, 90.0), "--roll": (-360.0, 360.0)}


def check_aim(flags: RenderOptions) -> None:
    """Raise an error for an orientation of the camera that has no effect or is out of range."""
    given = {"--heading": flags.heading, "--tilt": flags.tilt, "--roll": flags.roll}
    for flag, value in given.items():
        if value is None:
            continue
        if flags.sun is None:
            raise ProjectError(f"{flag} is the camera's orientation for --sun; add --sun, or leave it out")
        low, high = _RANGES[flag]
        if not low <= value <= high:
            raise ProjectError(f"{flag} lies between {low:g} and {high:g} degrees, not {value:g}")


def sun_field(flags: RenderOptions) -> SunPlace:
    """Return where the camera of the flags sees the sun.

    Raises
    ------
    FlarewrightError
        An option is none, or the sun cannot be seen.
    """
    from ...model.project.scene import Site
    from ...workflow.sun_place import CameraAim, sun_place

    check_aim(flags)
    assert flags.sun is not None
    parts = [part.strip() for part in flags.sun.split(",")]
    if len(parts) != 3:
        raise ProjectError(f"--sun {flags.sun!r} is no time and place; write {_FORM}")
    when = _moment(parts[0], flags.sun)
    latitude, longitude = (
        _degrees(part, limit, flags.sun) for part, limit in zip(parts[1:], (90.0, 180.0), strict=True)
    )
    if flags.heading is None:
        raise ProjectError("--sun needs --heading, where the camera looks: degrees clockwise from north, 90 is east")
    aim = CameraAim(flags.heading, flags.tilt or 0.0, flags.roll or 0.0)
    return sun_place(when, Site(latitude_deg=latitude, longitude_deg=longitude), aim)


def sun_remark(flags: RenderOptions) -> list[str]:
    """Return a remark on the place of the sun, and on its illuminance, which is left to --intensity."""
    if flags.sun is None:
        return []
    found = sun_field(flags)
    return [
        f"the sun stands at azimuth {found.azimuth_deg:.2f}, elevation {found.elevation_deg:.2f} degrees, field angles "
        f"{found.field_deg[0]:.2f},{found.field_deg[1]:.2f}; in a clear sky it gives {found.illuminance_lx / 1e3:.0f} "
        "klx; its intensity is that of --intensity (default: 1)"
    ]


def _moment(text: str, whole: str) -> datetime:
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        raise ProjectError(f"--sun {whole!r} has no time {text[:40]!r}; write {_FORM}") from None
    if when.tzinfo is None:
        raise ProjectError(f"--sun {text!r} has no offset from UTC; write +02:00 or Z behind the time")
    return when


def _degrees(text: str, limit: float, whole: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not (isfinite(value) and abs(value) <= limit):
        raise ProjectError(f"--sun {whole!r}: {text[:40]!r} is no angle up to {limit:g} degrees; write {_FORM}")
    return value
