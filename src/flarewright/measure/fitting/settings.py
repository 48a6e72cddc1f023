"""Settings of the fits of ghosts; an ablation sets them through `FitSettings`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Growth:
    """Limits on the complexity of a ghost, and the terms of its fit.

    Attributes
    ----------
    order, intensity_order, discs : int
        Maximum orders, see `parameters.free_numbers`, and maximum number of discs.
    offset : bool
        Fit a uniform background around the ghost in every view; it absorbs unknown ghosts.
    error : float, optional
        Expected model error, as a fraction of the light; default: `FitSettings.model_error`.
    soft : bool
        Fit soft borders, from order 1 on.
    below : bool
        Fit the denominator of position and size, from order 1 on.
    alike : bool
        See `ghost_fit.refine`.
    area : int, optional
        See `patches.patches_of`.
    """

    order: int = 2
    intensity_order: int = 1
    discs: int = 2
    offset: bool = True
    error: float | None = None
    soft: bool = True
    below: bool = True
    alike: bool = True
    area: int | None = None


@dataclass(frozen=True)
class PriorSettings:
    """Prior spread of a ghost's parameters, see `ghost_fit.priors` and `colour_prior.ties`."""

    first_order: float = 0.3  # spread of first-order aberrations, over the size of the ghost
    higher_order: float = 0.15  # spread of aberrations of higher order, over the size of the ghost
    least_size: float = 0.04  # least size that scales the aberrations, over the picture's width
    wide: float = 5.0  # spread of position and size, which is almost free, over the picture's width
    by_field: float = 0.3  # spread of the change of position and size with the field, over the picture's width
    slopes: tuple[float, float, float] = (0.15, 0.25, 0.5)  # slopes of brightness by u, v and w, over the brightness
    higher_slopes: float = 0.25  # spread of the terms of brightness of higher order, over the brightness
    denominator: tuple[float, float] = (0.3, 2.0)  # spread of the denominator of f and g, terms in v and w
    softness: float = 0.005  # spread of the softness of borders, over the picture's width
    # spread of the ten terms of f and g between colours: the part that scales with the picture's width, in 1e-4
    colour_widths: tuple[tuple[int, ...], tuple[int, ...]] = (
        (28, 1, 5, 10, 3, 3, 3, 3, 3, 3), (6, 1, 2, 4, 2, 2, 2, 2, 2, 2),
    )  # fmt: skip
    # the part of this spread that scales with the size of the ghost, in 1e-3
    colour_sizes: tuple[tuple[int, ...], tuple[int, ...]] = (
        (15, 1, 4, 6, 5, 5, 5, 5, 5, 5), (7, 1, 3, 3, 3, 3, 3, 3, 3, 3),
    )  # fmt: skip
    colour_rims: float = 0.04  # spread of rims between colours, in radii of the first one
    colour_denominator: float = 0.05  # spread of the denominator of position and size between colours


@dataclass(frozen=True)
class GrowthSettings:
    """Steps by which a fit of one ghost gets more parameters, see `model_growth.grow`."""

    rim_pays: float = 0.02  # minimum fraction by which a rim must lower the cost
    order_pays: float = 0.02  # minimum fraction by which a higher order must lower the cost
    rim_centres: tuple[float, ...] = (-2.4, -1.2, -0.6, 0.6, 1.2, 2.4)  # start values of a new rim's centre, over s
    rim_cuts: tuple[float, ...] = (0.3, 0.9)  # start depths of a new rim's cut into the first, over the pupil's radius
    rim_views: int = 8  # number of views that choose the best rim of a first fit
    fine_pixels: int = 1500  # larger patches, pixels, are halved in the search for a rim


@dataclass(frozen=True)
class JointSettings:
    """Joint fits of all ghosts, see `joint_shapes` and `joint_intensities`."""

    shape_width_px: int = 240  # maximum width of the halved pictures of the fit of shapes, pixels
    shape_views: int = 16  # maximum number of views of the fit of shapes
    shape_steps: int = 10  # maximum number of steps of the fit of shapes in a round
    least_remaining: float = 0.5  # minimum fraction of its brightness, and of its size, that a ghost keeps in one step
    least_gain: float = 3e-4  # the fit of shapes ends after a step that lowers the cost by less than this fraction
    light_width_px: int = 120  # maximum width of the halved pictures of the solution of brightness, pixels
    light_views: int = 25  # maximum number of views of the solution of brightness
    needed: float = 0.03  # minimum fraction of the squares in its footprint that a ghost alone must explain


@dataclass(frozen=True)
class RestartSettings:
    """Joint restart from plain ghosts, see `restart.restart_jointly`."""

    rounds: int = 6  # rounds of joint fit and linear solution of the brightness
    steps: int = 10  # maximum number of steps of each joint fit
    rim_pays: float = 0.1  # minimum fraction by which each former rim must lower the squares
    views: int = 16  # maximum number of views of the test of former rims
    area_px: int = 3500  # size of a window of the test of former rims, pixels


@dataclass(frozen=True)
class LifetimeSettings:
    """Visible range of a ghost, see `lifetimes`."""

    there: float = 0.35  # minimum amplitude of a visible ghost, over that of its shape
    most_error: float = 0.5  # maximum standard deviation of an amplitude that decides; others leave the view undecided
    least_views: int = 3  # least length of a range, views: two do not test whether the ghost moves


@dataclass(frozen=True)
class FitSettings:
    """Effort of `alternating_fit.fit_all`, and the settings of all fits."""

    rounds: int = 1  # number of times that every ghost is refitted against the others
    most: Growth = Growth(order=2, discs=2, area=3500)  # limits on the complexity of a ghost
    views: int = 32  # maximum number of views that one fit uses
    area_px: int = 7000  # size of a patch, pixels: pictures are halved until the ghost's window is about as small
    outlier: float = 4.0  # standard deviations beyond which a pixel loses weight
    amplitude_outlier: float = 16.0  # the same for amplitudes; it reduces the weight of pixels at edges of other ghosts
    model_error: float = 0.03  # expected model error, as a fraction of the light; it limits the weight of bright ghosts
    alike_px: float = 64.0  # pixels that share one model error; their noise is independent
    lit: float = 0.1  # threshold of the footprint, as a fraction of the maximum of the shape
    priors: PriorSettings = PriorSettings()  # prior spread of the parameters
    growth: GrowthSettings = GrowthSettings()  # growth of one ghost's model
    joint: JointSettings = JointSettings()  # joint fits of all ghosts
    restart: RestartSettings = RestartSettings()  # joint restart from plain ghosts
    lifetimes: LifetimeSettings = LifetimeSettings()  # visible range of a ghost
