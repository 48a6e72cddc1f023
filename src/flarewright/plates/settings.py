"""What a user says about a plate: its files, which areas count as light sources, and how bright they are."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Literal

from ..errors import ProjectError
from ..model.project.backplate import Transfer
from ..render.image.photographic_exposure import SUN_LUX


@dataclass(frozen=True)
class SourceKind:
    """A lamp of known brightness in the plate.

    Attributes
    ----------
    kind : {"sun", "lamp"}
        sun: the brightest source is the sun. lamp: every clipped source, or else the brightest, is a lamp.
    illuminance_lx : float
        What it gives on a plane at the camera that faces it.
    """

    kind: Literal["sun", "lamp"]
    illuminance_lx: float


@dataclass(frozen=True)
class PlateSettings:
    """A plate, or a sequence of them, and how its lights are found.

    Attributes
    ----------
    files : str
        A picture, a name with a place for the frame's number (`jobs.frame_list.FramePattern`), or a film.
    layer : str or None
        Layer of an EXR file.
    transfer : str or None
        How codes are read (`io.images.transfer`); None: by the kind of file, or as a film states.
    matte : str or None
        Grey pictures in the plate's frame: white may flare, black must not.
    threshold : float or None
        Plate value (luminance) above which a pixel belongs to a source; None: `stops`.
    stops : float
        The threshold in stops above the mean luminance of the plates (`detection.log_average_luminance`).
    knee_stops : float
        A source whose brightest pixel is this far above the threshold counts in full; at the threshold it counts
        nothing. Only in sequences, over `fade` frames.
    fade : int
        Frames before and after, over which a source near the threshold fades. 0: every frame alone.
    least_px : int
        Sources of fewer pixels are left out.
    most_lights : int
        Largest number of lights in a frame; the faintest sources are joined, and have ghosts only.
    point_px : float or None
        Sources narrower than this are points, pixels; None: half a percent of the plate's width, at least 3. An area
        light blurs its ghosts, and costs more time.
    gain : float
        Factor of the brightness of all found lights.
    highlights : float or None
        Plate value that a clipped white (1.0) stands for: display values are expanded by the inverse of a shoulder.
    white : float or None
        Plate value of white paper in the sun, facing it.
    source : SourceKind or None
        Brightness of a lamp that is known; needs `white`.
    first : int
        Number of a single picture, or of the first frame of a film. A shot sets that of the frame at 0 s.
    """

    files: str
    layer: str | None = None
    transfer: Transfer | None = None
    matte: str | None = None
    threshold: float | None = None
    stops: float = 5.0
    knee_stops: float = 1.0
    fade: int = 4
    least_px: int = 1
    most_lights: int = 32
    point_px: float | None = None
    gain: float = 1.0
    highlights: float | None = None
    white: float | None = None
    source: SourceKind | None = None
    first: int = 1

    def __post_init__(self) -> None:
        if self.threshold is not None and not 0.0 < self.threshold < float("inf"):
            raise ProjectError(f"a threshold of {self.threshold:g} is none; give a plate value above 0")
        if not -20.0 <= self.stops <= 40.0:
            raise ProjectError(f"{self.stops:g} stops above the mean are none; give -20 to 40, 5 is usual")
        if not 0 <= self.fade <= 100:
            raise ProjectError(f"a fade of {self.fade} frames is none; give 0 to 100")
        if self.least_px < 1:
            raise ProjectError(f"sources of at least {self.least_px} pixels do not exist; give 1 or more")
        if not 1 <= self.most_lights <= 5000:
            raise ProjectError(f"{self.most_lights} lights are not possible; give 1 to 5000")
        if self.point_px is not None and not self.point_px >= 0.0:
            raise ProjectError(f"points of {self.point_px:g} pixels do not exist; give 0 or more")
        if not 0.0 < self.gain <= 1e9:
            raise ProjectError(f"a gain of the plate of {self.gain:g} is none; give a factor above 0")
        if self.highlights is not None and not 1.0 <= self.highlights <= 1e6:
            raise ProjectError(f"highlights up to {self.highlights:g} are not possible; give 1 to 1000000")
        if self.white is not None and not 0.0 < self.white <= 1e6:
            raise ProjectError(f"white paper in the sun has no plate value of {self.white:g}; give one up to 1000000")
        if self.source is not None and self.white is None:
            raise ProjectError(
                "the brightness of a source needs the scale of the plate: give --white, the plate value of white "
                "paper in the sun, such as 0.9"
            )


HIGH_BEAM_CD = 30_000.0
"""Luminous intensity of a headlight on high beam, cd."""


def parse_source(text: str) -> SourceKind:
    """Return the lamp of `--source`.

    Parameters
    ----------
    text : str
        "sun"; "headlight@30", at 30 m; "lamp:800@3", a bulb of 800 lumen at 3 m.

    Raises
    ------
    ProjectError
        The text is none of these.

    Notes
    -----
    A lamp of intensity I at distance d gives I / d^2; a bulb of F lumen shines evenly around, with I = F / (4 pi).

    Examples
    --------
    >>> parse_source("headlight@30").illuminance_lx
    33.333333333333336
    """
    word, at, far = text.strip().lower().partition("@")
    word, _, lumen = word.partition(":")
    wanted = "write sun, headlight@METRES or lamp:LUMEN@METRES, such as lamp:800@3"
    if word == "sun" and not at and not lumen:
        return SourceKind("sun", SUN_LUX)
    if word not in ("headlight", "lamp") or (word == "headlight") == bool(lumen):
        raise ProjectError(f"--source {text[:60]!r} is no known lamp; {wanted}")
    try:
        distance_m, flux = float(far), float(lumen or 1.0)
    except ValueError:
        raise ProjectError(f"--source {text[:60]!r} needs a distance; {wanted}") from None
    if not (0.0 < distance_m < 1e9 and 0.0 < flux < 1e12):
        raise ProjectError(f"--source {text[:60]!r} has a value that is not above 0; {wanted}")
    candela = HIGH_BEAM_CD if word == "headlight" else flux / (4.0 * pi)
    return SourceKind("lamp", candela / distance_m**2)
