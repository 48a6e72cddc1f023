"""A merged frame as the fitter sees it: pixels, their variance, and the position of the light."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...errors import FlarewrightError
from ...model.measurement.capture import MergedFrame
from ...typing import Floats, Mask, Pixels
from .binning import binned
from .parameter_vector import field, frame


@dataclass(frozen=True)
class View:
    """One constellation.

    Attributes
    ----------
    constellation_deg : float
    sigma : float
        Magnitude of the normalized field s, at least 0.
    frame : ndarray, shape (5,)
        Axis x and y in pixels, cosine and sine of the light's direction, 1.
    light_px : tuple of float
    pixels : ndarray, shape (height, width, 3), float32
        Radiance; glow and known ghosts may be subtracted.
    variance : ndarray, shape (height, width, 3), float32
        Variance of the pixels; infinite where nothing was measured.
    nominal_roll_deg : float
        Roll as listed in captures.csv; views of one roll make a series.
    """

    constellation_deg: float
    sigma: float
    frame: Floats
    light_px: tuple[float, float]
    pixels: Pixels
    variance: Pixels
    nominal_roll_deg: float = 0.0

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.pixels.shape[1], self.pixels.shape[0]

    @property
    def roll_deg(self) -> float:
        """Direction of the line from the axis to a light of positive constellation, counterclockwise from the right."""
        turn = float(np.degrees(np.arctan2(self.frame[3], self.frame[2])))
        return turn - (180.0 if self.constellation_deg < 0.0 else 0.0)

    @property
    def off_axis_px(self) -> float:
        """Distance of the light from the axis, pixels."""
        return float(np.hypot(*np.subtract(self.light_px, self.frame[:2])))

    @cached_property
    def darkest_noise(self) -> float:
        """Standard deviation of the darkest pixels; infinite when nothing was measured."""
        known = self.variance[np.isfinite(self.variance)]
        return float(np.sqrt(np.percentile(known, 5))) if known.size else np.inf

    def showing(self, pixels: Pixels) -> View:
        """Return the same view with other pixels."""
        return replace(self, pixels=pixels)

    @property
    def measured(self) -> Pixels:
        """The pixels, with NaN where nothing was measured."""
        return np.where(np.isfinite(self.variance), self.pixels, np.float32(np.nan))

    def showing_one(self, picture: Pixels) -> View:
        """Return the same view with one picture, shape (H, W), in every channel."""
        return self.showing(np.broadcast_to(picture[..., None], self.pixels.shape))


def views_of(frames: Sequence[MergedFrame], largest_deg: float | None = None) -> tuple[View, ...]:
    """Return the views of merged frames, in order of rising constellation.

    Parameters
    ----------
    frames : sequence of MergedFrame
        All of one size.
    largest_deg : float, optional
        Constellation at which the normalized field is 1; None: the largest of the frames.

    Raises
    ------
    FlarewrightError
        When there are fewer than three frames, sizes differ, or all are at one constellation.
    """
    if len(frames) < 3:
        few = "1 constellation is" if len(frames) == 1 else f"{len(frames)} constellations are"
        raise FlarewrightError(f"{few} too few to follow a ghost; photograph at least 3")
    shapes = Counter(frame.radiance.shape for frame in frames)
    (height, width, _), _ = shapes.most_common(1)[0]
    odd = next((frame for frame in frames if frame.radiance.shape[:2] != (height, width)), None)
    if odd is not None:
        raise FlarewrightError(
            f"{odd.info.file} has {odd.radiance.shape[1]}x{odd.radiance.shape[0]} pixels, most frames have "
            f"{width}x{height}; remove it and merge again"
        )
    largest = largest_deg or max(abs(each.constellation_deg) for each in frames)
    if not largest > 0.0:
        raise FlarewrightError("all frames have the light on the axis; turn the camera between the captures")
    views = [
        View(
            each.constellation_deg, abs(field(each.constellation_deg, largest)),
            frame(each.axis_px, each.roll_deg, each.constellation_deg, 1.0), each.light_px, each.radiance,
            each.variance, each.info.nominal_roll_deg,
        )
        for each in frames
    ]  # fmt: skip
    return tuple(sorted(views, key=lambda view: view.constellation_deg))


def pixel_distances(view: View, place: float, scale: float = 1.0) -> Floats:
    """Return the distance of every pixel from a point on the line through axis and light, in full-size pixels.

    Parameters
    ----------
    view : View
    place : float
        Distance of the point from the axis towards the light, pixels.
    scale : float
        Size of the result over the size of the view.

    Returns
    -------
    ndarray, shape (H scale, W scale)
    """
    height, width = (round(side * scale) for side in view.pixels.shape[:2])
    ax, ay, cosine, sine, _ = view.frame
    x, y = (np.arange(width) + 0.5) / scale - ax, (np.arange(height) + 0.5) / scale - ay
    return np.asarray(np.hypot(x[None, :] - cosine * place, y[:, None] + sine * place), dtype=np.float64)


def all_finite(pixels: NDArray[np.floating]) -> Mask:
    """Return the mask of pixels whose three colours are finite, for a picture of shape (H, W, 3)."""
    # colour by colour: several times as fast as NumPy's `all` over three
    red, green, blue = (np.isfinite(pixels[..., m]) for m in range(3))
    return np.asarray(red & green & blue)


def halved_pixels(pixels: Pixels, times: int, variance: bool = False) -> Pixels:
    """Average a picture of shape (H, W, ...) over squares of side 2**times.

    Incomplete squares at the border are dropped. With `variance`, the picture holds variances of pixels, and the result
    holds the variances of the averages.
    """
    side = 2**times
    if side == 1:
        return pixels
    means = binned(pixels, side, pixels.dtype)
    return np.asarray(means / side**2 if variance else means, dtype=np.float32)


def halved_view(view: View, times: int) -> View:
    """Return a view halved `times` times, with lengths in its larger pixels."""
    factor = 0.5**times
    x, y, cosine, sine, _ = view.frame
    return replace(
        view, frame=np.array([x * factor, y * factor, cosine, sine, 1.0]),
        light_px=(view.light_px[0] * factor, view.light_px[1] * factor), pixels=halved_pixels(view.pixels, times),
        variance=halved_pixels(view.variance, times, variance=True),
    )  # fmt: skip
