"""The sampled wave behind the pupil: smooth or rough blades, mask images, and dirt.

Lengths are in radii of the round opening; rows rise with y, seen from behind the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...model.lens.iris import Iris
from ...typing import Floats, Mask
from .dirt import Elements, rasterise
from .iris import blade_edges, softened, transmission

FFT_SIZE = 4096
WINDOW = 12.0
"""Width of the zero-padded pupil plane in pupil radii; the step in s is 1 / WINDOW, the Nyquist frequency 171."""

BLOCKED = "the dirt blocks all light; use less of it"
"""Sentence on dirt that leaves no light."""

PUPIL_REACH = 1.65
"""Largest radius of an opening: the corner of a straight triangle is at 1.56."""


@dataclass(frozen=True)
class PupilImage:
    """An image with a content digest, so that caches can compare it."""

    digest: bytes
    pixels: NDArray[np.floating] = field(compare=False, repr=False)


@dataclass(frozen=True)
class Pupil:
    """A sampled pupil.

    Attributes
    ----------
    at : ndarray, shape (G,)
        Sample positions on both axes.
    opening : ndarray, shape (G, G)
        Transmittance of blades or mask without dirt.
    amplitude : ndarray, shape (G, G)
        Amplitude of the wave with dirt; borders of blades are softened by a triangle two samples wide.
    light : float
        Integral of the transmittance with dirt.
    transmittance, amplitude_left : float
        Mean factors of light and amplitude by dirt in the opening.
    spread : float
        Fraction of the opening's light that pieces of dirt scatter: mean transmittance minus squared mean amplitude.
    drawn : ndarray, shape (G, G), or None
        Amplitude that an image of dirt blocks.
    """

    at: Floats
    opening: Floats
    amplitude: Floats
    light: float
    transmittance: float = 1.0
    amplitude_left: float = 1.0
    spread: float = 0.0
    drawn: Floats | None = None

    def holds(self, pieces: Floats) -> Mask:
        """Return whether pieces, with x and y in the first two columns, lie in the opening."""
        step = float(self.at[1] - self.at[0])
        size = len(self.at)
        place = np.floor((pieces[:, :2] - self.at[0]) / step + 0.5).astype(np.intp)
        ok = ((place >= 0) & (place < size)).all(axis=1)
        column, row = np.clip(place, 0, size - 1).T
        found: Mask = ok & (self.opening[row, column] > 0.5)
        return found


def pupil_amplitude(
    iris: Iris,
    mask: PupilImage | None,
    span: float,
    radius_mm: float,
    elements: Elements | None,
    dirt_image: PupilImage | None,
    turn: float,
) -> Pupil:
    """Sample a pupil.

    Parameters
    ----------
    iris : Iris
    mask : PupilImage or None
        Transmittance over [-span, span] squared, instead of the blades.
    span, radius_mm : float
        As in `fraunhofer.pupil_pattern`.
    elements : Elements or None
        Dirt, already rotated.
    dirt_image : PupilImage or None
        Transmittance over [-1, 1] squared; 1 outside.
    turn : float
        Rotates blades and images, rad.

    Raises
    ------
    ValueError
        When no light passes.
    """
    spacing = WINDOW / FFT_SIZE
    half = math.ceil(PUPIL_REACH / spacing)
    at: Floats = np.asarray((np.arange(-half, half) + 0.5) * spacing, dtype=np.float64)
    turned = iris.model_copy(update={"rotation_deg": iris.rotation_deg + math.degrees(turn)})
    if mask is None:
        opening = _blades(turned, at, spacing, radius_mm)
        amplitude = opening
    else:
        opening = _image(turned, mask, span, at, spacing)
        if not opening.max() > 0.0:
            raise ValueError("the iris mask is dark everywhere; white must mark the opening")
        amplitude = np.sqrt(opening)
    light = float(opening.sum()) * spacing**2
    if elements is None:
        return Pupil(at, opening, amplitude, light)
    kept, passing = rasterise(elements, at)
    spread = float((opening * passing).sum() / opening.sum() - ((amplitude * kept).sum() / amplitude.sum()) ** 2)
    drawn = None
    if dirt_image is not None:
        clear = _image(Iris(rotation_deg=math.degrees(turn)), dirt_image, 1.0, at, spacing)
        clear[np.maximum(np.abs(at), np.abs(at)[:, None]) >= 1.0] = 1.0
        drawn = amplitude * (1.0 - np.sqrt(clear))
        kept, passing = kept * np.sqrt(clear), passing * clear
    left = float((opening * passing).sum()) * spacing**2
    if not left > 1e-6 * light:
        raise ValueError(BLOCKED)
    weight = float(amplitude.sum())
    return Pupil(
        at, opening, amplitude * kept, left, left / light, float((amplitude * kept).sum()) / weight, spread, drawn
    )


def _blades(iris: Iris, at: Floats, spacing: float, radius_mm: float) -> Floats:
    ramp = transmission(iris, 1.0, at, at[:, None], footprint=2.0 * spacing)
    if iris.roughness_um > 0.0:
        _roughen(ramp, iris, at, spacing, radius_mm)
    return softened(ramp)


def _roughen(ramp: Floats, iris: Iris, at: Floats, spacing: float, radius_mm: float) -> None:
    """Displace every blade's edge by independent noise, in place."""
    sigma = 1e-3 * iris.roughness_um / radius_mm
    length = 1e-3 * iris.roughness_length_um / radius_mm
    band = 6.0 * sigma + 2.0 * spacing
    close = transmission(iris, 1.0, at, at[:, None], footprint=2.0 * band)
    row, column = np.nonzero((close > 0.0) & (close < 1.0))
    x, y = at[column], at[row]
    worst = np.full(x.size, -np.inf)
    rng = np.random.default_rng([iris.roughness_seed, 4])
    edges = blade_edges(iris, 1.0)
    round_one = len(edges) == 1
    for nx, ny, offset, curvature in edges:
        qx, qy = x - offset * nx, y - offset * ny
        value = nx * qx + ny * qy + 0.5 * curvature * (qx * qx + qy * qy)
        along = np.arctan2(y, x) if round_one else -ny * qx + nx * qy
        noise = _noise(rng, length, np.pi if round_one else 2.0 * PUPIL_REACH, round_one)
        worst = np.maximum(worst, value + sigma * np.interp(along, *noise))
    ramp[row, column] = np.clip(0.5 - worst / (2.0 * spacing), 0.0, 1.0)


def _noise(rng: np.random.Generator, length: float, reach: float, periodic: bool) -> tuple[Floats, Floats]:
    """Return Gaussian noise of variance 1 on [-reach, reach] with the correlation exp(-(d / length)^2)."""
    # noise finer than the grid would be averaged
    length = max(length, 0.25 * WINDOW / FFT_SIZE)
    count = min(max(64, math.ceil(2.0 * reach / (length / 4.0))), 1 << 20)
    if not periodic:
        count *= 2  # the second half decouples the two ends
    step = 2.0 * reach / (count if periodic else count / 2)
    frequency = np.fft.rfftfreq(count, step)
    white = np.fft.rfft(rng.normal(size=count))
    # the autocorrelation of the kernel exp(-2 (d / length)^2) is exp(-(d / length)^2)
    shaped = np.fft.irfft(white * np.exp(-0.5 * (math.pi * frequency * length) ** 2), count)
    shaped /= np.sqrt(np.mean(np.exp(-((math.pi * np.fft.fftfreq(count, step) * length) ** 2))))
    kept = count if periodic else count // 2
    t = np.asarray(-reach + step * np.arange(kept + (1 if periodic else 0)), dtype=np.float64)
    return t, np.asarray(np.append(shaped, shaped[0]) if periodic else shaped[:kept])


def _image(iris: Iris, picture: PupilImage, span: float, at: Floats, spacing: float) -> Floats:
    """Return means of 3 x 3 bilinear samples, because the image can be finer than the grid."""
    if iris.rotation_deg % 90.0 == 0.0:
        return _upright(np.rot90(picture.pixels, round(iris.rotation_deg / 90.0)), at / span, spacing / span)
    fine = (at[:, None] + np.array([-1.0, 0.0, 1.0]) * spacing / 3.0).ravel()
    light = transmission(iris, span, fine, fine[:, None], mask=picture.pixels)
    mean: Floats = light.reshape(len(at), 3, len(at), 3).mean(axis=(1, 3))
    return mean


def _upright(pixels: NDArray[np.floating], at: Floats, spacing: float) -> Floats:
    """Return an image over [-1, 1] squared sampled as in `_image`, one axis after the other."""
    light = np.asarray(pixels, dtype=np.float64)
    for rising in (-1.0, 1.0):
        side = light.shape[0]
        total = np.zeros((len(at), light.shape[1]))
        for shift in (-1.0, 0.0, 1.0):
            # counted from 1, with a line of zeros at either end
            place = np.clip(0.5 * (rising * (at + shift * spacing / 3.0) + 1.0) * side + 0.5, 0.0, side + 1.0)
            low = np.minimum(place.astype(np.intp), side)
            part = (place - low) / 3.0
            for line, share in ((low - 1, 1.0 / 3.0 - part), (low, part)):
                inside = (line >= 0) & (line < side)
                total[inside] += share[inside, None] * light[line[inside]]
        light = np.ascontiguousarray(total.T)
    return light
