"""The time code of a film's frame."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

from ..images.exr_attributes import time_code

_CODE = re.compile(r"(\d{1,2}):(\d{2}):(\d{2})([:;.])(\d{2})")
# numbers that a drop-frame code leaves out in each minute but every tenth (SMPTE ST 12-1)
_DROPPED, _MINUTE, _TEN_MINUTES = 2, 1798, 17982


def time_code_after(first: str, frames: int, fps: Fraction | None) -> Any:
    """Return the time code of a frame, as OpenEXR's type.

    Parameters
    ----------
    first : str
        That of the first frame: "10:00:00:00"; a semicolon before the frames marks a drop-frame code.
    frames : int
        Frames after the first one.
    fps : Fraction or None

    Returns
    -------
    OpenEXR.TimeCode or None
        None for a text that is no time code, and above 30 frames a second, which a time code does not count.
    """
    match = _CODE.fullmatch(first.strip())
    if match is None or fps is None:
        return None
    hours, minutes, seconds, number = (int(match[k]) for k in (1, 2, 3, 5))
    rate = max(1, round(fps))
    count = ((hours * 60 + minutes) * 60 + seconds) * rate + number
    if match[4] == ":" or rate != 30:
        return time_code(count + frames, fps)
    passed = hours * 60 + minutes
    tens, rest = divmod(count - _DROPPED * (passed - passed // 10) + frames, _TEN_MINUTES)
    minute = max(0, rest - _DROPPED) // _MINUTE
    numbered = time_code(tens * _TEN_MINUTES + rest + _DROPPED * (9 * tens + minute), fps)
    numbered.dropFrame = True
    return numbered


def code_text(code: Any) -> str:
    """Return a time code of OpenEXR as a film states it: "10:00:00:00"."""
    return f"{code.hours:02d}:{code.minutes:02d}:{code.seconds:02d}{';' if code.dropFrame else ':'}{code.frame:02d}"
