"""Settings of the merge of photographs to HDR frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class CalibrationSettings:
    """Black, white and noise of the camera, see `calibrate` and `noise`."""

    groups: int = 5  # number of sampled constellations
    bands: int = 8  # number of sampled bands of rows per photograph
    rows: int = 64  # number of rows per band
    pile: int = 50  # least number of pixels at the largest value that indicates clipping
    darks_for_picture: int = 4  # least number of dark frames for a black image; fewer give a black level only
    flat_side: int = 31  # side of the neighbourhood that a flat's pixel is compared with, pixels
    levels_differ: float = 0.002  # black levels that differ by this part of full contradict each other
    clipped_flat: float = 0.01  # clipped part from which a flat is refused
    far_above: float = 2.0  # largest ratio of the highest pixel value to a given white level, both above black
    lit: float = 0.05  # pixels above this part of the brightest count as well lit
    bins: int = 40  # number of bins of signal
    least_samples: int = 200  # least number of samples per bin
    least_bins: int = 4  # least number of bins for a fit of the noise
    level_side: int = 7  # side of the mean by which pixels are sorted into bins, pixels


@dataclass(frozen=True)
class GeometrySettings:
    """Path of the light and optical axis, see `camera_geometry` and `optical_axis`."""

    faintest: float = 0.05  # part of the largest flux below which a frame does not show the light: it left the picture
    least_contrast: float = 20.0  # least contrast of the light in at least one frame
    worst_path: float = 0.02  # largest residual of the path of one light, part of the width
    least_focal: float = 0.1  # least motion of the light per tangent, part of the width; even a fisheye has more
    distortion_angles: int = 8  # least number of distinct angles to fit the distortion
    least_sigmas: float = 4.0  # a distortion term is used when it exceeds this many standard errors
    most_powers: int = 3  # largest number of powers of t in the law
    outlier_jitters: float = 4.0  # deviation from the law, in units of the jitter, at which a light has half its weight
    near_px: float = 8.0  # distance from the axis below which the direction to the light is undefined, pixels
    nod_deg: float = 0.2  # prior standard deviation of the foot beside the axis by nodding, degrees
    off_centre: float = 0.02  # prior standard deviation of the axis beside the picture's middle, part of the width
    off_middle: float = 0.03  # distance of the axis from the picture's middle that is reported, part of the width
    axis_reach: float = 0.015  # search range of the axis beside the path, part of the width
    axis_step_px: float = 0.5  # step of that search, pixels of the reduced frame
    axis_width_px: int = 360  # approximate width of the reduced frames, pixels
    star_error: float = 0.3  # relative error of the star in the search of the mirror line
    ghost_asymmetry: float = 0.05  # relative asymmetry of a ghost
    systematic: float = 0.05  # relative systematic error of the axis: ghosts of odd irises are not symmetric
    near_light: float = 0.04  # radius around the light that is left out, part of the width
    mirror_frames: int = 12  # maximum number of frames compared to find the mirror line
    # least distance of the light from the axis in these frames, parts of the width, the best first
    least_off_axis: tuple[float, ...] = (0.15, 0.08)


@dataclass(frozen=True)
class ExposureSettings:
    """Exposures of a constellation, see `hdr_merge` and `exposure_check`."""

    safe: float = 4.0  # least distance of a counted value from white, standard deviations
    compare: tuple[float, float] = (0.02, 0.7)  # range of levels, parts of full, in which two exposures are compared
    worst_ratio: float = 0.02  # largest error of an exposure ratio that is corrected
    far_below: float = 0.002  # part of full below black from which a pixel indicates damage
    far_spreads: float = 10.0  # standard deviations below black from which a pixel indicates damage
    dead: float = 0.01  # a file is damaged when this part of it indicates damage
    plausible: tuple[float, float] = (0.7, 1.4)  # plausible range of measured over expected light
    vote_levels: tuple[float, ...] = (0.1, 0.02)  # least light of a vote, part of full, the best first
    black_error: float = 1e-4  # error of black, part of full
    least_votes: int = 150  # least number of votes
    least_majority: float = 0.75  # least part of the votes that must agree, which rejects hot pixels


@dataclass(frozen=True)
class DriftSettings:
    """Drift of the light or the shutter between frames, see `exposure_drift`."""

    ring: tuple[float, float] = (0.015, 0.06)  # radii of the ring around the light, parts of the width
    least_px: tuple[float, float] = (6.0, 14.0)  # least values of these radii, pixels
    sectors: int = 8  # sectors of the ring (opposite ones together), against ghosts or the border in some
    least_pixels: int = 8  # least number of pixels per sector
    slow_deg: float = 6.0  # changes over more degrees than this are attributed to the lens
    least_snr: float = 5.0  # least signal-to-noise ratio of a pixel of the whole picture
    least_bright: float = 0.1  # least part of such pixels
    least_sigmas: float = 2.0  # a drift is corrected when it exceeds this many standard errors
    most_error: float = 0.01  # a drift is corrected when its relative error is below this
    least_frames: int = 6  # least number of frames


@dataclass(frozen=True)
class LightSettings:
    """Position of the light, and second lights, see `light_position` and `second_light`."""

    rival: float = 0.25  # size of a rival light, part of the first one's clipped area or else flux
    least_area_px: int = 4  # least clipped area, pixels; a smaller one can be a hot pixel
    other_area_px: int = 9  # least clipped area of a spot that can be a second, fainter light, pixels
    other: float = 0.01  # least part of the first light's flux of such a spot that is not clipped
    other_far: float = 0.1  # least distance of such a spot from the first light, part of the width
    other_far_px: float = 15.0  # least distance of such a spot from the first light, pixels
    ring_px: tuple[float, float] = (3.0, 6.0)  # ring around such a spot, pixels from its edge
    dark: float = 0.1  # largest part of such a spot's light in that ring
    rim_px: int = 14  # width of the ring beyond the clipped area in which the star's symmetry is evaluated, pixels
    asymmetry: float = 0.02  # relative asymmetry of the star besides noise
    stray: float = 2.0  # asymmetry by ghosts on one side, over the median asymmetry of the outer half
    correlated_px: float = 16.0  # errors of a star's pixels are correlated: this many count as one
    least_error_px: float = 0.02  # least error of a light's position, pixels
    given_light_error_px: float = 0.5  # standard error of a light position that the user gives, pixels
    scatter_px: float = 2.0  # largest scatter of a fixed spot, pixels
    scatter: float = 0.05  # largest scatter of a fixed spot, part of the light's motion
    least_agreeing: float = 0.8  # least part of the frames that agree on a fixed spot
    beside: float = 0.1  # a spot this far beside the line of ghosts in two frames is no ghost, part of the width
    least_motion: float = 0.3  # a spot fixed in three frames is no ghost when the light moves by this part of the width
    ahead: float = 0.1  # least cosine of a direction in front of the camera


@dataclass(frozen=True)
class MergeSettings:
    """Settings of the merge."""

    block: int = 1  # side of the pixel block that is averaged into one pixel
    white_balance: Literal["none", "camera"] | tuple[float, float, float] = "none"  # red, green, blue
    upright: bool = False  # whether frames are rotated to remove the tilt of the horizon
    calibration: CalibrationSettings = CalibrationSettings()  # black, white and noise
    exposures: ExposureSettings = ExposureSettings()  # exposures of a constellation
    light: LightSettings = LightSettings()  # position of the light
    geometry: GeometrySettings = GeometrySettings()  # path of the light and axis
    drift: DriftSettings = DriftSettings()  # drift between frames
