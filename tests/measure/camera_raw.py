"""A minimal camera RAW file: an uncompressed DNG with a Bayer mosaic, as a real decoder reads it."""

from pathlib import Path

import numpy as np
import tifffile

BLACK, WHITE = 512, 16383


def write_dng(path: Path, mosaic: np.ndarray, *, exposure: tuple[int, int] = (1, 8), iso: int = 200) -> None:
    """Write a mosaic (red, green / green, blue; uint16) with levels, white balance (2, 1, 1.5), f/2.8 and 50 mm."""
    tags = [
        (50706, "B", 4, (1, 4, 0, 0)), (33421, "H", 2, (2, 2)), (33422, "B", 4, (0, 1, 1, 2)),
        (50708, "s", 0, "Flarewright synthetic"), (271, "s", 0, "Flarewright"), (272, "s", 0, "synthetic"),
        (50714, "H", 1, BLACK), (50717, "H", 1, WHITE), (50721, "2i", 9, (1, 1, *(0, 1) * 3, 1, 1, *(0, 1) * 3, 1, 1)),
        (50728, "2I", 3, (1, 2, 1, 1, 2, 3)), (50778, "H", 1, 21), (33434, "2I", 1, exposure),
        (33437, "2I", 1, (28, 10)),
        (34855, "H", 1, iso), (37386, "2I", 1, (50, 1)),
    ]  # fmt: skip
    tifffile.imwrite(path, mosaic, photometric=32803, extratags=[(*tag, False) for tag in tags], metadata=None)
