"""A sensor: noise, black level, clipping and tone curve, the same for the clean and the flared picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernels.raster.exposure import record
from ...model.project.dataset import DatasetSpec, tone_gamma
from ...render.image.display import srgb_codes, srgb_oetf
from ...typing import Pixels
from .draw import NOISE, SENSOR, draw_number, draw_text, stream

# value of white where the sensor does not clip
_NO_WHITE = float(np.finfo(np.float32).max)
# of a standard normal number
_STEPS = 1 << 16

# JPEG quality of files whose specification states none
PLAIN_QUALITY = 95


@dataclass(frozen=True)
class Sensor:
    """A sensor with drawn values.

    Attributes
    ----------
    full_well_e : float or None
        None: no noise.
    read_noise_e, black_level : float
    clip : bool
    tone : str
    jpeg_quality : int or None
    """

    full_well_e: float | None
    read_noise_e: float
    black_level: float
    clip: bool
    tone: str
    jpeg_quality: int | None


def draw_sensor(spec: DatasetSpec, index: int) -> Sensor:
    """Draw the sensor of an item."""
    rng, draws = stream(spec, index, SENSOR), spec.sensor
    tone = draw_text(draws.tone, rng)
    black = draw_number(draws.black_level, rng)
    well = None if draws.full_well_e is None else draw_number(draws.full_well_e, rng)
    read = draw_number(draws.read_noise_e, rng)
    quality = None if draws.jpeg_quality is None else int(draw_number(draws.jpeg_quality, rng))
    return Sensor(well, read, black, draws.clip, tone, quality)


def noise_of(spec: DatasetSpec, index: int, picture: int) -> Pixels:
    """Return standard normal numbers for a picture.

    Parameters
    ----------
    spec : DatasetSpec
    index : int
    picture : int
        0 is the flared picture, 1 the clean one; with `sensor.noise = "same"` both get the same numbers.

    Returns
    -------
    ndarray, shape (height, width, 3), float32
        Means of 65,536 equally probable steps of the distribution, at most 4.39, in a quarter of the time of exact
        numbers; a picture does not show the difference. The variance is 1 - 1.5e-6, the fourth moment 3 - 1.8e-4.
    """
    rng = stream(spec, index, NOISE + (picture if spec.sensor.noise == "independent" else 0))
    steps = rng.integers(0, _STEPS, (spec.size_px[1], spec.size_px[0], 3), np.uint16)
    return _normal_steps().take(steps)


@lru_cache(maxsize=1)
def _normal_steps() -> Pixels:
    """Return the mean of a standard normal number in each of `_STEPS` equally probable steps."""
    # the mean between two ends is the difference of the densities there over the probability
    normal = NormalDist()
    densities = [normal.pdf(normal.inv_cdf(k / _STEPS)) for k in range(1, _STEPS)]
    return np.asarray(-np.diff([0.0, *densities, 0.0]) * _STEPS, np.float32)


def exposed(light: Pixels, sensor: Sensor, noise: Pixels | None = None) -> Pixels:
    """Return what the sensor records, linear, white at 1.

    Parameters
    ----------
    light : ndarray, shape (H, W, 3), float32
        Linear; white at 1.
    sensor : Sensor
    noise : ndarray, shape (H, W, 3), optional
        Standard normal numbers; None: no noise.

    Returns
    -------
    ndarray, shape (H, W, 3), float32

    Notes
    -----
    The number of electrons is Poisson distributed with mean v F for a full well F, and read noise has variance r^2.
    The sum is drawn as one normal number of variance v F + r^2 (EMVA 1288, equation 9), which has the first two moments
    of the sum. Light beyond the full well has the noise of the full well, and clips.
    """
    recorded = np.empty(light.shape, np.float32)
    noisy = noise is not None and sensor.full_well_e is not None
    numbers = np.ascontiguousarray(noise, np.float32).ravel() if noisy else np.empty(0, np.float32)
    values = (sensor.full_well_e or 1.0, sensor.read_noise_e, sensor.black_level, 1.0 if sensor.clip else _NO_WHITE)
    record(np.ascontiguousarray(light, np.float32).ravel(), numbers, *map(np.float32, values), recorded.ravel())
    return recorded


def codes(linear: Pixels, tone: str, bits: int) -> NDArray[Any]:
    """Return a picture as whole numbers through a tone curve.

    Parameters
    ----------
    linear : ndarray, shape (H, W, 3), float32
        Light; each channel is clipped at black and white, as `exposed` clips it.
    tone : str
        "srgb", "linear" or "gamma:2.2".
    bits : int
        8 or 16.

    Returns
    -------
    ndarray, shape (H, W, 3), uint8 or uint16
    """
    gamma = tone_gamma(tone)
    # a view would mix colours beyond white and outside the primaries with white, and 16 bits would not
    if gamma is None and bits == 8:
        return srgb_codes(linear)
    light = np.clip(linear, 0.0, 1.0)
    if gamma is None:
        light = srgb_oetf(light.astype(np.float64)).astype(np.float32)
    elif gamma != 1.0:
        light = np.power(light, np.float32(1.0 / gamma))
    top = (1 << bits) - 1
    return (light * top + 0.5).astype(np.uint8 if bits == 8 else np.uint16)


def jpeg_bytes(picture: NDArray[np.uint8], quality: int) -> bytes:
    """Return an 8-bit picture as the bytes of a JPEG file (4:2:0 up to quality 90, 4:4:4 above it)."""
    from PIL import Image

    data = BytesIO()
    Image.fromarray(picture).save(data, "JPEG", quality=quality, subsampling=2 if quality <= 90 else 0)
    return data.getvalue()


def through_jpeg(picture: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Return an 8-bit picture after it has been a JPEG file."""
    from PIL import Image

    with Image.open(BytesIO(jpeg_bytes(picture, quality))) as image:
        return np.asarray(image)
