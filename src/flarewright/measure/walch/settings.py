"""Settings of Walch's method."""

from __future__ import annotations

from dataclasses import dataclass

from ..glow.settings import GlowSettings


@dataclass(frozen=True)
class WalchSettings:
    """Settings of `per_frame_fit.fit_as_walch`."""

    rounds: int = 60  # rounds of the gradient descent per image
    most_width_px: int = 96  # a ghost is fitted in images halved until its diameter is at most this, pixels
    margin: float = 0.25  # margin of the window, part of the ghost's radius
    margin_px: int = 8  # added margin of the window, pixels
    least_measured: float = 0.7  # least measured part of a window
    least_images: int = 3  # least number of images that must show a ghost
    least_radius_px: float = 0.5  # least radius of a ghost, pixels
    most_order: int = 6  # highest order of a polynomial over the constellation
    least_trust: float = 0.01  # values whose outlier weight is below this do not count in the degrees of freedom
    glow: GlowSettings = GlowSettings()  # halo and star
