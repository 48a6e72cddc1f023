"""Writer of a minimal camera RAW file: an uncompressed DNG with a Bayer mosaic that a real decoder reads."""

from pathlib import Path

import numpy as np
import tifffile

from flarewright.optics.colour.rgb import xyz_to_rgb_matrix

BLACK, WHITE = 512, 16383
# matrix from XYZ to the camera's colours, in ten-thousandths as in DNG files
COLOR_MATRIX = ((7000, -900, -1000), (-4500, 12500, 2200), (-800, 1900, 5800))


def camera_to_rec709() -> np.ndarray:
    """Return the matrix from camera colours to Rec. 709; D65 white has a green of 1."""
    matrix = np.array(COLOR_MATRIX) / 1e4
    white = matrix @ [0.95047, 1.0, 1.08883]
    return xyz_to_rgb_matrix("rec709") @ np.linalg.inv(matrix) * white[1]


def write_dng(
    path: Path, mosaic: np.ndarray, *, exposure: tuple[int, int] = (1, 8), iso: int = 200,
    pattern: tuple[tuple[int, ...], ...] = ((0, 1), (1, 2)),
) -> None:  # fmt: skip
    """Write a mosaic (red, green / green, blue; uint16) with levels, white balance (2, 1, 1.5), f/2.8 and 50 mm."""
    rationals = tuple(n for row in COLOR_MATRIX for value in row for n in (value, 10000))
    tags = [
        (50706, "B", 4, (1, 4, 0, 0)), (33421, "H", 2, (len(pattern), len(pattern))),
        (33422, "B", len(pattern) ** 2, sum(pattern, ())),
        (50708, "s", 0, "Flarewright synthetic"), (271, "s", 0, "Flarewright"), (272, "s", 0, "synthetic"),
        (50714, "H", 1, BLACK), (50717, "H", 1, WHITE), (50721, "2i", 9, rationals),
        (50728, "2I", 3, (1, 2, 1, 1, 2, 3)), (50778, "H", 1, 21), (33434, "2I", 1, exposure),
        (33437, "2I", 1, (28, 10)),
        (34855, "H", 1, iso), (37386, "2I", 1, (50, 1)),
    ]  # fmt: skip
    tifffile.imwrite(path, mosaic, photometric=32803, extratags=[(*tag, False) for tag in tags], metadata=None)
