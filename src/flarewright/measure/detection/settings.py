"""Settings of the detection of ghosts."""

from __future__ import annotations

from dataclasses import dataclass

from ..fitting.settings import FitSettings, Growth


@dataclass(frozen=True)
class RimSettings:
    """Votes for borders, see `rim_voting`."""

    salient: float = 4.0  # gradient, in standard deviations of its noise, that yields half of a full vote
    level: float = 0.16  # subtracted from each view's vote, so that views without a border count against a candidate
    points: int = 40  # number of points of an outline
    step: float = 0.004  # step of the speeds, over the picture's width; a speed is a position over the field
    usual_speed: float = 1.0  # maximum speed, over the picture's width, up to which the steps are this fine
    most_speed: float = 2.6  # maximum speed, over the picture's width; beyond the usual one, steps are twice as long
    least_size: float = 0.006  # minimum size, over the picture's width
    usual_size: float = 0.06  # size, over the picture's width, beyond which sizes rise by a factor instead of a step
    size_step: float = 0.0028  # step of the smaller sizes, over the picture's width
    most_size: float = 0.45  # maximum size, over the picture's width
    sizes: int = 40  # number of the larger sizes
    same_place: float = 0.3  # of two candidates closer than this, over the sum of their sizes, the better one stays
    same_steps: float = 3.0  # added to that distance, steps of the speeds
    same_size: float = 0.5  # maximum difference of their sizes, over the part of that distance of the worse one


@dataclass(frozen=True)
class BlobSettings:
    """Votes for ghosts a few pixels wide, see `blobs`."""

    radii_px: tuple[float, ...] = (1.0, 1.8, 3.0)  # radii of the search, pixels
    inner_px: float = 1.0  # inner distance of the surroundings from the blob's edge, pixels
    outer_px: float = 3.5  # outer distance of the surroundings from the blob's edge, pixels
    step_px: float = 0.5  # step of the samples along the line and across it, pixels
    salient: float = 5.0  # contrast to the brightest side, in standard deviations, that yields half of a full vote
    level: float = 0.3  # subtracted from each vote, so that views without a blob count against a candidate
    stray_px: float = 1.5  # maximum deviation of a blob from its predicted position, pixels
    least_sigma: float = 0.03  # least field of a view that votes: nearer to the axis every speed fits
    refits: int = 3  # number of times that the law of motion is refitted around the predicted positions
    trials: int = 80  # number of best speeds that are refined
    near_best: float = 0.9  # minimum votes, over the best of a view, of the places whose centre is the blob's
    cubic_views: int = 6  # minimum number of views with a blob for a fit of the cubic term


@dataclass(frozen=True)
class CrescentSettings:
    """Votes for ghosts that shrink and slow down off axis, see `crescents`."""

    below: tuple[float, ...] = (1.5, 4.0)  # values of c in the denominator of position and size
    # pairs of length over height, and bend over half the height
    forms: tuple[tuple[float, float], ...] = ((1.0, 0.0), (0.5, 0.0), (0.3, 0.2), (0.2, 0.15))
    step: float = 0.004  # step of the speeds, over the picture's width at field `USUAL`
    most_speed: float = 1.3  # maximum speed, over the picture's width at field `USUAL`
    least_size: float = 0.012  # minimum half height, over the picture's width at field `USUAL`
    most_size: float = 0.45  # maximum half height, over the picture's width at field `USUAL`
    sizes: int = 40  # number of half heights
    compared: int = 400  # number of best candidates of each search that are compared
    most_distance: float = 0.3  # maximum distance of equal candidates, over their mean size in their middle view
    most_size_difference: float = 0.4  # maximum difference of the size of equal candidates, over the larger size
    most: int = 8  # maximum number of candidates


@dataclass(frozen=True)
class PursuitSettings:
    """Cycle of votes and fits, see `matching_pursuit.pursue`."""

    score: float = 0.9  # minimum votes of a candidate, in total
    score_per_view: float = 0.04  # minimum votes per view: residuals of subtracted ghosts vote in every view
    explains: float = 0.06  # minimum fraction of the squares in its windows that a ghost must explain
    sure: float = 6.0  # minimum significance of a ghost over all views, standard deviations
    left_behind: float = 0.08  # expected error of subtracted light at borders, as a fraction of it
    left_as_blobs: float = 0.2  # expected error of subtracted light for the blob search, as a fraction of it
    blob_reach_px: int = 3  # reach of that error around the light, pixels
    blob_px: float = 3.5  # maximum radius of a blob, pixels
    same_place: float = 0.1  # maximum distance of two trials of one ghost, over the sum of their sizes
    same_place_px: float = 4.0  # added to that distance, pixels
    same_size: float = 0.6  # maximum difference of their sizes, over that distance
    beside_blob_px: float = 3.0  # distance around a blob that its fit uses, pixels
    covers: float = 0.35  # minimum overlap of a fit with its start outline (intersection over union)
    overlap_views: int = 4  # number of views that measure the overlap
    retry_after: int = 2  # a refused candidate is tried again when the number of known ghosts, less this, has doubled
    most_tries: int = 3  # maximum number of trials of one candidate
    joint_steps: int = 6  # steps of the joint fit after new ghosts
    respan_growth: float = 1.1  # growth of the number of ghosts after which visible ranges are determined again
    trials: int = 12  # number of candidates of a search beyond the refused ones
    reserve: int = 20  # further candidates that avoid a new search after each refusal
    trials_per_vote: int = 4  # number of trials before the next vote
    least_score_ratio: float = 0.6  # minimum score, over that of the best, of a trial after another was accepted
    concurrent: int = 2  # number of concurrent trials after a refusal, when the next one often fails as well
    first_views: int = 16  # maximum number of views of a first fit
    crescents_from: float = 6.0  # the search for crescents starts when the best other candidate has fewer votes
    least_sigma: float = 0.05  # minimum field at which the shape of a candidate is converted to parameters
    trial_error: float = 0.05  # model error of a first fit, as a fraction of the light: its surroundings are unknown
    # limits of a first fit; fine pictures help it no more than coarse ones
    first: Growth = Growth(order=1, discs=1, error=0.05, soft=False, below=False, alike=False, area=2500)


@dataclass(frozen=True)
class JoinSettings:
    """Joining of two ghosts that are one, see `join_ghosts`."""

    most_loss: float = 0.08  # maximum fraction that a joined ghost loses of the squares that the smaller explains
    most_distance: float = 0.4  # maximum distance of the centres over the larger size, at the largest field
    least_shared: float = 0.5  # minimum fraction of common views
    core_starts: tuple[float, ...] = (1.0, 0.4, -0.2)  # start magnifications of the pupil's centre; small: bright
    blob_size: float = 0.005  # maximum size of a blob, over the picture's width; blobs are not joined
    trial_views: int = 10  # maximum number of views of a trial
    area_px: int = 2500  # size of a window of a trial, pixels


@dataclass(frozen=True)
class SplitSettings:
    """Splitting of a ghost that covers two, see `split_ghosts`."""

    views: int = 16  # maximum number of views
    least_votes: float = 2.0  # minimum votes of another border
    same_overlap: float = 0.7  # a candidate with more overlap (intersection over union) is the ghost itself
    view_stride: int = 4  # step between the views that measure the overlap
    most_distance: float = 1.2  # search range of the distance from the ghost's centre, over its size
    least_size: float = 0.3  # minimum size of the search, over the size of the ghost
    most_size: float = 1.4  # maximum size of the search, over the size of the ghost
    places: int = 61  # number of positions of the search
    sizes: int = 30  # number of sizes of the search
    own_place: float = 0.15  # votes within this distance, over the size of the ghost, belong to the ghost itself
    own_size: float = 0.12  # votes within this size difference, over the size of the ghost, belong to the ghost itself
    least_sigma: float = 0.1  # minimum field for the ratio of position to field
    least_size_px: float = 2.0  # minimum size of the search, pixels
    least_gain: float = 0.02  # minimum fraction by which two ghosts must lower the squares
    model_error: float = 0.05  # expected model error, as a fraction of the light, equal for one and two ghosts
    # limits of the first fit of the other ghost
    first: Growth = Growth(order=1, discs=1, error=1e-6, soft=False, below=False, alike=False, area=2500)
    rounds: int = 3  # rounds of the alternating fits of both ghosts
    steps: int = 6  # steps of each of these fits
    area_px: int = 3500  # size of a window of these fits, pixels


@dataclass(frozen=True)
class PictureSettings:
    """Ghosts of one picture, see `single_image.spots_of_picture`."""

    most: int = 60  # maximum number of ghosts
    enough: float = 0.25  # minimum score of a proposed circle, over the best possible score
    above_chance: float = 1.25  # minimum score of a proposed circle, over the score of chance
    border: float = 0.06  # half width of the band around a found border that later votes exclude, over the radius
    smoothed_px: float = 7.0  # added half width of that band, pixels
    body: float = 0.5  # minimum mean contrast of a disc to its surroundings, over the noise
    least_noise: float = 1e-4  # minimum noise, over the brightest percentile of the picture
    finer: tuple[float, ...] = (0.5, 0.125, 0.03)  # steps that refine a found circle, over the step of the search
    # ring inside a border whose light is the ghost's, and ring outside: bounds over the radius, and added pixels
    ring_inside: tuple[float, float] = (0.7, 0.93)
    ring_outside: tuple[float, float] = (1.07, 1.3)
    ring_outside_px: tuple[float, float] = (2.0, 3.0)
    own_noise: float = 0.04  # minimum noise, over each pixel: slow gradients in bright areas are no borders


@dataclass(frozen=True)
class DetectionSettings:
    """Settings of the detection of ghosts, and of the fits that it makes."""

    width_px: int = 400  # maximum width of the pictures of the search, pixels
    views: int = 50  # maximum number of constellations of the search; more make a vote expensive without improving it
    rims: RimSettings = RimSettings()  # votes for borders
    blobs: BlobSettings = BlobSettings()  # votes for small ghosts
    crescents: CrescentSettings = CrescentSettings()  # votes for crescents
    pursuit: PursuitSettings = PursuitSettings()  # cycle of votes and fits
    joining: JoinSettings = JoinSettings()  # joining of ghosts
    splitting: SplitSettings = SplitSettings()  # splitting of ghosts
    picture: PictureSettings = PictureSettings()  # ghosts of one picture
    fit: FitSettings = FitSettings()  # fits during the search
