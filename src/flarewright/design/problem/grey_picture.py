"""The grey ghost picture of the thesis, and similarity of two pictures (PSNR, SSIM)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...io.images.png import encode_png
from ...kernels.design import ghosts as columns
from ...render.image.display import view
from ...typing import Floats, Indices
from .ghosts import evaluate
from .prescription import Structure

# side in pixels, and half the side in mm: the field of a 50 degree camera from a distance of 50 mm
SIDE = 512
HALF_FRAME = 23.3
# half of the light's intensity. The thesis does not state it: this value makes a black picture differ from the target
# by the PSNR that the thesis reports, 20.0 and 24.5 dB for the Heliar
GAIN = 1.1
DIAGONAL = (0.5**0.5, 0.5**0.5)
# stop diameter, mm, for drawing ghosts without a lens: that of the thesis for the Heliar
OWN_STOP = 4.5


def grey_picture(
    structure: Structure,
    vector: Floats,
    slope: float,
    *,
    entrance: float = 100.0,
    blades: int = 6,
    gain: float = GAIN,
    colors: Floats | None = None,
) -> Floats:
    """Draw ghosts in grey, as the program of Van Acoleyen 2025 does.

    Parameters
    ----------
    structure : Structure
    vector : ndarray, shape (1 + 3 K,)
    slope : float
        Of the light source, which stands on the diagonal.
    entrance : float
        mm.
    blades : int
        Of the iris; 0 is round.
    gain : float
        Half of the light's intensity.
    colors : ndarray, shape (G, 3), optional
        Colour of each ghost; None: grey, 2 / G.

    Returns
    -------
    ndarray, shape (512, 512) or (512, 512, 3)
        Clamped to 1.

    Notes
    -----
    Thesis section 4.3.4: the colour is multiplied by stop height / ghost height and by one half, added and clamped. A
    ghost bounded by the entrance is round. The program gives a hidden ghost a height of 100000, which draws nothing.
    """
    values = evaluate(structure, vector[None], entrance)[0]
    level = np.full((len(values), 1), 2.0 / len(values)) if colors is None else colors
    radii = values[:, columns.RADIUS]
    light = gain * level * (0.5 * vector[0] / np.maximum(np.abs(radii), 1e-6))[:, None]
    light[slope > values[:, columns.REACH_THESIS]] = 0.0
    shapes = np.where(values[:, columns.BOUND] == 0.0, blades, 0)
    picture = disc_picture(values[:, columns.PLACE] * slope, radii, light, DIAGONAL, HALF_FRAME, SIDE, shapes)
    return picture[..., 0] if colors is None else picture


def light_of_ghosts(count: int, stop_diameter: float = OWN_STOP, gain: float = GAIN) -> float:
    """Return the level of a grey ghost times its radius, mm, when `count` ghosts share the light (`grey_picture`)."""
    return gain * 2.0 / count * 0.5 * stop_diameter


def disc_picture(
    places: Floats,
    radii: Floats,
    light: Floats,
    direction: tuple[float, float],
    half_frame: float,
    side: int,
    blades: Indices | None = None,
) -> Floats:
    """Draw uniform discs or polygons along a line through the middle of a square picture, y up.

    Parameters
    ----------
    places, radii : ndarray, shape (G,)
        mm; a polygon with a negative radius is inverted.
    light : ndarray, shape (G, C)
        Value that each adds to its pixels.
    direction : tuple of float
        Unit vector of the line.
    half_frame : float
        mm.
    side : int
        Pixels.
    blades : ndarray, shape (G,), optional
        Number of corners of each; 0 or None is round. The radius of a polygon is that of its corners.

    Returns
    -------
    ndarray, shape (side, side, C)
        Clamped to 1; row 0 is the bottom.
    """
    picture = np.zeros((side, side, light.shape[1]))
    pixel = 2.0 * half_frame / side
    for g in range(len(places)):
        if not light[g].any():
            continue
        x0, y0 = (float(places[g]) * part for part in direction)
        spans = [_span(centre, abs(float(radii[g])), half_frame, side) for centre in (x0, y0)]
        if any(first >= last for first, last in spans):
            continue
        x, y = (_axis(span, pixel, half_frame + c) for span, c in zip(spans, (x0, y0), strict=True))
        outside = _outside(x[None, :], y[:, None], float(radii[g]), 0 if blades is None else int(blades[g]))
        cover = np.clip(0.5 - outside / pixel, 0.0, 1.0)
        picture[slice(*spans[1]), slice(*spans[0])] += cover[..., None] * light[g]
    return np.minimum(picture, 1.0)


def _axis(span: tuple[int, int], pixel: float, start: float) -> Floats:
    return np.asarray((np.arange(*span) + 0.5) * pixel - start, dtype=np.float64)


def _span(centre: float, radius: float, half_frame: float, side: int) -> tuple[int, int]:
    """Return the pixels that a disc can touch along one axis."""
    pixel = 2.0 * half_frame / side
    first, last = ((centre + way * (radius + pixel) + half_frame) / pixel for way in (-1.0, 1.0))
    return max(int(np.floor(min(first, 1e6))), 0), min(int(np.ceil(max(last, -1e6))) if last < 1e6 else side, side)


def _outside(x: Floats, y: Floats, radius: float, blades: int) -> Floats:
    """Return the distance from the border of a disc or a regular polygon, positive outside, mm."""
    if blades == 0:
        return np.asarray(np.hypot(x, y) - abs(radius), dtype=np.float64)
    turn = 0.0 if radius > 0.0 else np.pi
    outside = np.full(np.broadcast_shapes(x.shape, y.shape), -np.inf)
    for angle in turn + 2.0 * np.pi * (np.arange(blades) + 0.5) / blades:
        outside = np.maximum(outside, np.cos(angle) * x + np.sin(angle) * y)
    return np.asarray(outside - abs(radius) * np.cos(np.pi / blades), dtype=np.float64)


def psnr(target: Floats, found: Floats) -> float:
    """Return the peak signal-to-noise ratio in dB for a peak of 1 (thesis eq. 6.1, 6.2); 200 for equal pictures."""
    error = float(np.mean((target - found) ** 2))
    return 200.0 if error < 1e-20 else float(-10.0 * np.log10(error))


def psnr_with_gain(target: Floats, found: Floats) -> float:
    """Return `psnr` with the second picture scaled by the gain that maximises it."""
    power = float((found * found).sum())
    gain = float((target * found).sum()) / power if power > 0.0 else 0.0
    return psnr(target, gain * found)


def ssim(target: Floats, found: Floats) -> float:
    """Return the structural similarity, the mean over windows of 7 x 7 pixels (thesis equation 6.3; Wang et al. 2004).

    Parameters
    ----------
    target, found : ndarray, shape (H, W)
    """
    from scipy import ndimage

    c1, c2, side = 0.01**2, 0.03**2, 7

    def mean(image: Floats) -> Floats:
        inner = slice(side // 2, -(side // 2))
        return np.asarray(ndimage.uniform_filter(image, side)[inner, inner])

    # unbiased sample variance
    unbiased = side**2 / (side**2 - 1)
    mu_f, mu_g = mean(target), mean(found)
    var_f = unbiased * (mean(target * target) - mu_f**2)
    var_g = unbiased * (mean(found * found) - mu_g**2)
    both = unbiased * (mean(target * found) - mu_f * mu_g)
    alike = (2.0 * mu_f * mu_g + c1) * (2.0 * both + c2) / ((mu_f**2 + mu_g**2 + c1) * (var_f + var_g + c2))
    return float(alike.mean())


def screen_pixels(picture: Floats) -> NDArray[np.uint8]:
    """Convert a picture to display pixels, 1 as white, as in the file of a target picture.

    Parameters
    ----------
    picture : ndarray, shape (H, W), (H, W, 1) or (H, W, 3)
        Linear, row 0 at the bottom.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8
        Row 0 at the top.
    """
    light = picture[::-1] if picture.ndim == 3 else picture[::-1, :, None]
    return view(np.broadcast_to(light, (*light.shape[:2], 3)), 0.0, "srgb")


def png_bytes(picture: Floats) -> bytes:
    """Return a picture as the bytes of a PNG file (`screen_pixels`)."""
    return encode_png(screen_pixels(picture), {})
