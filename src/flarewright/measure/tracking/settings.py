"""Settings of the tracking of ghosts from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass

from ..fitting.settings import FitSettings


@dataclass(frozen=True)
class FrameFitSettings:
    """Joint fit of all ghosts in one frame, see `frame_fit.measure_together`."""

    width_px: int = 240  # maximum width of the halved pictures, pixels: three parameters per ghost need no more
    steps: int = 6  # maximum number of Gauss-Newton steps, with full and then with reduced weight of outliers
    brightness_spread: float = 3.0  # prior spread of a brightness about the prediction, over the model
    shift_spread: float = 0.3  # prior spread of a shift about the prediction, over the ghost's radius
    shift_spread_width: float = 0.01  # added prior spread of a shift, over the picture's width
    size_spread: float = 0.2  # prior spread of a size about the prediction, over the model
    dark_percentile: float = 10.0  # percentile of a view's pixels that scales the prior of the uniform background
    least_gain: float = 1e-3  # the fit ends after a step that lowers the cost by less than this fraction
    known: float = 0.7  # maximum error of a value that a view determines, over the prior's spread
    sizes: tuple[float, float] = (0.4, 2.0)  # smallest and largest size, over the model
    model_error: float = FitSettings.model_error  # expected model error, as a fraction of the light
    outlier: float = FitSettings.outlier  # standard deviations beyond which a pixel loses weight


@dataclass(frozen=True)
class CurveSettings:
    """Curves over the constellation, see `smoothing_spline.smooth_curve`."""

    # numbers of knots to try: a constant, a line, natural splines
    knots: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 8, 10, 12)
    most_weight: float = 25.0  # largest weight of a value, over the median
    outlier: float = 4.0  # values lose weight beyond this many usual deviations from the median of their neighbours


@dataclass(frozen=True)
class TrackingSettings:
    """Settings of `follow.follow`."""

    there: float = 0.35  # minimum brightness of a seen ghost, over the prediction
    sure: float = 4.0  # minimum significance of a seen ghost, standard errors
    vague: float = 0.3  # maximum error of a brightness that decides, over the prediction
    least_inside: float = 0.03  # minimum fraction of a ghost's box inside the frame
    history: int = 5  # number of latest poses that predict the next
    predicted_brightness: tuple[float, float] = (0.3, 2.0)  # range of a predicted brightness, over the model
    predicted_size: tuple[float, float] = (0.5, 1.8)  # range of a predicted size, over the model
    most_shift: float = 0.5  # largest shift over the size of the ghost; beyond, the fit has moved to another ghost
    most_size_factor: float = 1.5  # largest factor on the size
    most_brightness: float = 3.0  # largest factor on the brightness
    frame: FrameFitSettings = FrameFitSettings()  # fit of one frame
    curves: CurveSettings = CurveSettings()  # curves through the poses
