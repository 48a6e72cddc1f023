"""Standard attributes of OpenEXR for the frames of a shot."""

from __future__ import annotations

from fractions import Fraction
from math import inf
from typing import Any

# a time code counts at most 30 frames a second (SMPTE ST 12-1)
_MOST_CODED = 30
_DAY_S = 86400


def shot_attributes(
    *,
    frame: int,
    fps: Fraction,
    shutter_s: float,
    focal_length: float | None = None,
    f_number: float | None = None,
    focus_distance: float | None = None,
    lens: str = "",
) -> dict[str, Any]:
    """Return the standard attributes of a frame.

    Parameters
    ----------
    frame : int
        Its number.
    fps : Fraction
    shutter_s : float
        Time that the shutter is open; 0: not written.
    focal_length, focus_distance : float or None
        Millimetres; a focus distance of infinity is None. A focal length of None is unknown.
    f_number : float or None
        None: unknown.
    lens : str

    Returns
    -------
    dict
        framesPerSecond, timeCode (`time_code`), expTime, aperture, focus in metres, effectiveFocalLength, lensModel.

    Notes
    -----
    Names and units: OpenEXR, "Standard Attributes" (ImfStandardAttributes.h).
    """
    found: dict[str, Any] = {"framesPerSecond": fps}
    if (code := time_code(frame, fps)) is not None:
        found["timeCode"] = code
    if shutter_s > 0.0:
        found["expTime"] = shutter_s
    if focal_length is not None:
        found["effectiveFocalLength"] = float(focal_length)
        found["focus"] = inf if focus_distance is None else focus_distance / 1000.0
    if f_number is not None:
        found["aperture"] = float(f_number)
    if lens.isascii() and lens:
        found["lensModel"] = lens
    return found


def time_code(frame: int, fps: Fraction) -> Any:
    """Return the time code of a frame as OpenEXR's type: frame 0 is 00:00:00:00, no frame is dropped.

    Parameters
    ----------
    frame : int
    fps : Fraction
        Rates such as 24000/1001 count as the next whole number.

    Returns
    -------
    OpenEXR.TimeCode or None
        None for a negative frame, and above 30 frames per second, which a time code does not count.
    """
    import OpenEXR

    rate = max(1, round(fps))
    if frame < 0 or rate > _MOST_CODED:
        return None
    seconds, rest = divmod(frame, rate)
    seconds %= _DAY_S
    # the time, then flags and user data
    return OpenEXR.TimeCode(seconds // 3600, seconds // 60 % 60, seconds % 60, rest, *([0] * 14))
