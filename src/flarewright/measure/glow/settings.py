"""Settings of the fit of halo and star, and of their subtraction."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist


@dataclass(frozen=True)
class HaloSettings:
    """Fit of the halo, see `fit.fit_halo`."""

    low: float = 0.3  # quantile over the constellations that estimates the light without ghosts
    halvings: int = 2  # halvings of the pictures: noise would bias a low quantile at full resolution
    rings: int = 20  # number of rings around the light
    sectors: int = 12  # sectors of a ring whose differences estimate the error of its level
    dark_quantile: float = 0.02  # quantile of a ring's pixels; the darkest places bound the halo
    dark_views: float = 0.1  # quantile of these bounds over the views, as rims shade the light in some
    least_pixels: int = 12  # minimum number of pixels of a ring
    most_exponent: float = 4.0  # maximum exponent of the halo's fall with distance within a ring

    @property
    def dark_noise_bias(self) -> float:
        """Bias of `dark_quantile` by noise, standard deviations."""
        return -NormalDist().inv_cdf(self.dark_quantile)


@dataclass(frozen=True)
class StarSettings:
    """Fit of the star, see `fit.fit_star`."""

    directions: int = 1440  # number of directions that sample the star
    least_ridge: float = 1.25  # minimum brightness of a ridge, over the light between ridges
    most_spikes: int = 48  # maximum number of spikes
    least_spikes: int = 4  # minimum number of spikes: two are ghosts along the line through axis and light
    hidden: float = 0.4  # fraction of the spikes that may be hidden
    spike_deg: float = 7.0  # maximum width of a spike, degrees; wider features along a ring are ghosts
    most_blades: int = 20  # an iris with more blades counts as round
    rings: int = 24  # number of rings around the light that sample the star
    inner: float = 0.06  # radius of the first ring, over the picture's width
    outer: float = 0.35  # radius of the last ring, over the picture's width
    strong: float = 0.6  # minimum of a strong harmonic along the rings, over the strongest
    width_part: float = 0.4  # half width of the directions that measure a spike's width, over their distance
    least_width_px: float = 0.4  # minimum width of a spike, pixels
    gap_quantile: float = 0.1  # quantile of the directions that estimates the light between spikes


@dataclass(frozen=True)
class StrengthSettings:
    """Strength of halo and star in each view, see `fit.followed`."""

    samples: int = 8000  # number of pixels of a view
    rounds: int = 12  # number of rounds of reweighted least squares
    glow_error: float = 0.1  # relative error of the laws of halo and star
    least_signal: float = 0.1  # minimum peak of halo or star, over the noise
    bright_pixels: int = 50  # minimum number of pixels above the noise for a view to bound its glow


@dataclass(frozen=True)
class RejectionSettings:
    """Rejection of ghosts that are residual glow, see `rejection.is_residual_glow`."""

    # maximum offsets from the light (over the size or the light's distance from the axis) and brightness for each
    limits: tuple[tuple[float, float], ...] = ((0.05, 0.1), (0.12, 0.02), (float("inf"), 0.005))
    views: int = 8  # number of views that measure the brightness
    hidden_size: float = 1.5  # maximum size of a ghost nearly hidden in the masked disc, over the disc's radius
    coarse_px: float = 4.0  # added to that size, pixels, as the resolution of the halo is limited
    hidden_offset: float = 0.12  # maximum offset of the centre of such a ghost from the light, as in `limits`


@dataclass(frozen=True)
class GlowSettings:
    """Settings of halo and star."""

    left_behind: float = 0.1  # expected error of the subtracted glow, as a fraction of it
    halo: HaloSettings = HaloSettings()  # fit of the halo
    star: StarSettings = StarSettings()  # fit of the star
    strength: StrengthSettings = StrengthSettings()  # strength in each view
    rejection: RejectionSettings = RejectionSettings()  # rejection of ghosts
