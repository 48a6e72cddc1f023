"""What the numbers of a TIFF file mean."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import FileError
from ..files.door import shown

# TIFF's names of numbers that grow with the light
_LIGHT = ("MINISBLACK", "RGB", "YCBCR", "CFA", "LINEAR_RAW")
_OTHERS = {"SEPARATED": "the inks of a print (CMYK)", "PALETTE": "a palette", "MINISWHITE": "grey with white at 0"}


def refuse_inks(path: Path, page: Any) -> None:
    """Raise an error for a TIFF whose numbers are not light.

    Parameters
    ----------
    path : Path
    page : tifffile.TiffPage

    Raises
    ------
    FileError
        They are inks, a palette, or white at 0.
    """
    kind = getattr(page.photometric, "name", str(page.photometric))
    if kind not in _LIGHT:
        raise FileError(f"{shown(path)} holds {_OTHERS.get(kind, kind)}, no light; save it as an RGB TIFF")
