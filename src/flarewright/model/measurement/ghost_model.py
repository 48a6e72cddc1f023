"""A measured flare: parameters of its ghosts, star and halo over the constellation, with their uncertainties.

Positions are in pixels of the picture it was measured in, from the optical axis; a light at constellation theta has the
field s of length tan(theta) / tan(`largest_deg`), pointing to where the light's image lies. Radiance is in the unit of
the captures at their settings (`Reference`).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, TypeVar

from pydantic import Field, model_validator

from ..base import Frozen
from .sprite import Sprite

Ten = tuple[float, float, float, float, float, float, float, float, float, float]
Rgb3 = tuple[float, float, float]
Above0 = Annotated[float, Field(gt=0.0)]
AnyGhost = TypeVar("AnyGhost", "AberrationGhost", "BezierGhost")
Fade = tuple[Annotated[float, Field(ge=0.0)], Annotated[float, Field(ge=0.0)]]


class Disc(Frozen):
    """A circular vignetting edge: a disc in the ghost's pupil whose centre moves with the light.

    Attributes
    ----------
    centre : tuple of float
        The centre is s (centre[0] + centre[1] s.s).
    radius : float
        In radii of the ghost's first rim.
    """

    centre: tuple[float, float]
    radius: float = Field(gt=0.0)


Lateral = Annotated[float, Field(ge=-1000.0, le=1000.0)]


class Channel(Frozen):
    """One colour of a ghost: landing point and brightness of each point p of its pupil.

    (x, y) = (s f + p g) / (1 + b v + c w); f, g and the intensity are polynomials of u = p.p, v = p.s, w = s.s
    with the ten terms 1, u, v, w, uu, uv, vv, uw, vw, ww. The pupil is the unit disc, or the ghost's `blades`, cut by
    `discs`.

    Attributes
    ----------
    f, g : tuple of 10 float
        In radii of the ghost's unit disc.
    intensity : tuple of 10 float
        Radiance times pixels per area of the pupil; below 0 counts as 0.
    discs : tuple of Disc
    soft_px : float
        Standard deviation of the Gaussian blur of the ghost, pixels; the light's size softens the edges.
    lateral_px : tuple of 2 or 6 float
        Lateral colour: each wavelength within the colour draws the ghost at a different place and size. At t standard
        deviations from the mean wavelength, f and g change by t f' + (t t - 1) f" and t g' + (t t - 1) g", pixels. The
        numbers are f', g', f", g", and the changes of f' and g' per w; missing numbers are 0.
    below : tuple of 2 float
        b and c.
    uncertainty : tuple of float
        Standard deviation of f, g, intensity and the three numbers of each disc, in this order; then of soft_px,
        lateral_px, and `below` with six numbers of lateral_px, if fitted. 0 for numbers that were not fitted. Empty:
        unknown.
    """

    f: Ten
    g: Ten
    intensity: Ten
    discs: tuple[Disc, ...] = Field((), max_length=4)
    soft_px: float = Field(0.0, ge=0.0, le=1000.0)
    lateral_px: tuple[Lateral, ...] = (0.0, 0.0)
    below: tuple[float, float] = (0.0, 0.0)
    uncertainty: tuple[float, ...] = ()

    @model_validator(mode="after")
    def _count(self) -> Channel:
        numbers = 30 + 3 * len(self.discs)
        if len(self.lateral_px) not in (2, 6):
            raise ValueError(f"lateral_px needs 2 numbers or 6, and has {len(self.lateral_px)}")
        if len(self.uncertainty) not in (0, numbers, numbers + 1, numbers + 3, numbers + 7, numbers + 9):
            raise ValueError(
                f"uncertainty needs {numbers} numbers, one more with that of soft_px, three or seven more with "
                "lateral_px's too, nine more with below's, or none"
            )
        return self


class Curve(Frozen):
    """A number over the constellation: a natural cubic spline with evenly spaced knots.

    Attributes
    ----------
    values : tuple of float
        At knots that divide a ghost's `visible_deg` evenly; two values give a straight line, one a constant.
    error : tuple of float
        Standard deviation of each value.
    """

    values: tuple[float, ...] = Field(min_length=1, max_length=32)
    error: tuple[float, ...] = Field(min_length=1, max_length=32)

    @model_validator(mode="after")
    def _pairs(self) -> Curve:
        if len(self.values) != len(self.error):
            raise ValueError("a curve needs one error for each value")
        return self


class Curves(Frozen):
    """Corrections of a ghost over the constellation that its aberrations do not predict; None: no correction.

    Attributes
    ----------
    brightness : Curve or None
        Factor.
    along_px : Curve or None
        Pixels towards the light.
    size : Curve or None
        Factor.
    """

    brightness: Curve | None = None
    along_px: Curve | None = None
    size: Curve | None = None


class Blades(Frozen):
    """Polygonal pupil edge of straight sides of one length (iris blades); it does not turn with the light's roll.

    Attributes
    ----------
    count : int
    first_deg : float
        Direction of one side from the pupil's centre, counterclockwise from the right in the upright picture.
    """

    count: int = Field(ge=3, le=36)
    first_deg: float


def _appears_first(ghost: AnyGhost) -> AnyGhost:
    low, high = ghost.visible_deg
    if low > high:
        raise ValueError(f"visible_deg {low:g} to {high:g}: the smaller constellation must come first")
    return ghost


class AberrationGhost(Frozen):
    """A ghost by its aberrations: one set of parameters for all constellations.

    Attributes
    ----------
    name : str
    red, green, blue : Channel
    blades : Blades or None
        Polygon of the same area instead of the pupil's unit disc.
    visible_deg : tuple of float
        Constellations at which it appears and disappears.
    fade_deg : tuple of float
        Widths of the constellation ranges, centred at `visible_deg`, over which the light fades; 0: at once.
    curves : Curves
        Corrections that `measure compress` found over the constellation.
    """

    kind: Literal["aberration"] = "aberration"
    name: str
    red: Channel
    green: Channel
    blue: Channel
    blades: Blades | None = None
    visible_deg: tuple[float, float]
    fade_deg: Fade = (0.0, 0.0)
    curves: Curves = Curves()

    _appears = model_validator(mode="after")(_appears_first)


class BezierGhost(Frozen):
    """A ghost by Walch's primitive (2017, chapter 6): every parameter is a polynomial in the angle from the axis.

    Attributes
    ----------
    name : str
    numbers : tuple of 19 tuples of float
        Coefficients, lowest order first. The polynomials' variable z runs from -1 at the smallest to 1 at the largest
        angle from the axis within `visible_deg`; both sides of the axis share them. In order: centre along and across
        the field, height, extent left and right, control points left (along, across) and right, falloff outside and
        inside, exponents outside and inside, border level and inner level of red, green and blue. Pixels and radiance.
        Control points range from 0 to 1.5 times the extent and the height.
    uncertainty : tuple of float
        Standard deviation of each number about its polynomial, 0 when unknown, or empty.
    visible_deg : tuple of float
        Constellations at which it appears and disappears.
    fade_deg : tuple of float
        As in `AberrationGhost`.
    """

    kind: Literal["bezier"] = "bezier"
    name: str
    numbers: tuple[tuple[float, ...], ...] = Field(min_length=19, max_length=19)
    uncertainty: tuple[float, ...] = Field((), max_length=19)
    visible_deg: tuple[float, float]
    fade_deg: Fade = (0.0, 0.0)

    _appears = model_validator(mode="after")(_appears_first)


def _by_constellation(what: str, constellation_deg: Sequence[float]) -> None:
    # not strictly: two rolls can have one constellation
    if any(b < a for a, b in pairwise(constellation_deg)):
        raise ValueError(f"the constellations of {what} must rise")


def _along_radii(what: str, radius_px: Sequence[float], radiance: Sequence[Rgb3], uncertainty: Sequence[Rgb3]) -> None:
    if len(radius_px) != len(radiance):
        raise ValueError(f"{what} needs one radiance for each radius, not {len(radiance)} for {len(radius_px)}")
    if uncertainty and len(uncertainty) != len(radiance):
        raise ValueError(f"{what} needs an uncertainty for each radiance or none, not {len(uncertainty)}")
    if radius_px[0] <= 0.0:
        raise ValueError(f"{what}'s radius_px must be above 0")
    if any(b <= a for a, b in pairwise(radius_px)):
        raise ValueError(f"{what}'s radius_px must rise")


class Halo(Frozen):
    """Light around the light's image: haze, scatter and the star's core.

    Attributes
    ----------
    radius_px : tuple of float
        Rising distances from the light's image.
    radiance : tuple of Rgb
        At those distances; in between the logarithms are interpolated, beyond the last it is 0.
    uncertainty : tuple of Rgb
        Standard deviations of `radiance`, from its variation with direction; empty: unknown.
    strength : tuple of (float, float)
        Rising constellations, degrees, and a factor of the halo; linear between them; empty: 1 throughout.
    even : tuple of (float, Rgb)
        Rising constellations, degrees, and a uniform radiance of the whole picture: veiling glare, and ghosts too large
        and faint to separate; linear between them; empty: none.
    """

    radius_px: tuple[float, ...] = Field(min_length=2)
    radiance: tuple[Rgb3, ...]
    uncertainty: tuple[Rgb3, ...] = ()
    strength: tuple[tuple[float, float], ...] = ()
    even: tuple[tuple[float, Rgb3], ...] = ()

    @model_validator(mode="after")
    def _rising(self) -> Halo:
        _along_radii("a halo", self.radius_px, self.radiance, self.uncertainty)
        _by_constellation("a halo's strength", [angle for angle, _ in self.strength])
        _by_constellation("a halo's even", [angle for angle, _ in self.even])
        return self


class Star(Frozen):
    """Diffraction spikes around the light's image; they turn with the camera, not with the light.

    Attributes
    ----------
    spikes : int
        n for an even, 2n for an odd number of blades.
    first_deg : float
        Direction of a spike, counterclockwise from the right in the upright picture.
    width_px : float
        Standard deviation across a spike.
    radius_px : tuple of float
        Rising distances from the light's image.
    radiance : tuple of Rgb
        On the ridge of a spike at those distances, as in `Halo`.
    uncertainty : tuple of Rgb
        Standard deviations of `radiance`, from the differences between spikes; empty: unknown.
    strength : tuple of (float, float)
        As in `Halo`: vignetting dims the light's image, and the star with it.
    """

    spikes: int = Field(ge=2, le=72)
    first_deg: float
    width_px: float = Field(gt=0.0)
    radius_px: tuple[float, ...] = Field(min_length=2)
    radiance: tuple[Rgb3, ...]
    uncertainty: tuple[Rgb3, ...] = ()
    strength: tuple[tuple[float, float], ...] = ()

    @model_validator(mode="after")
    def _rising(self) -> Star:
        _along_radii("a star", self.radius_px, self.radiance, self.uncertainty)
        _by_constellation("a star's strength", [angle for angle, _ in self.strength])
        return self


class Reference(Frozen):
    """Settings of the captures, for the brightness at other settings (Walch 2017, equation 8.3).

    Attributes
    ----------
    f_number, iso, exposure_s : float or None
    luminance_cd_m2 : float or None
        Of the light that was photographed.
    solid_angle_sr : float or None
        Of that light, seen from the camera.
    clipping : Rgb or None
        Radiance at which the sensor clips at these settings; None: not known.
    """

    f_number: float | None = Field(None, gt=0.0)
    iso: float | None = Field(None, gt=0.0)
    exposure_s: float | None = Field(None, gt=0.0)
    luminance_cd_m2: float | None = Field(None, gt=0.0)
    solid_angle_sr: float | None = Field(None, gt=0.0)
    clipping: tuple[Above0, Above0, Above0] | None = None


Ghost = Annotated[AberrationGhost | BezierGhost, Field(discriminator="kind")]


class GhostModel(Frozen):
    """A measured flare.

    Attributes
    ----------
    schema_version : 1
    size_px : tuple of int
        Width and height of the captures.
    axis_px : tuple of float
        Where the optical axis meets the picture; pixel k spans k to k + 1, row 0 is at the top.
    focal_px : float
        Pixels per unit of tangent, near the axis.
    sensor_width_mm : float or None
        Width of the sensor that the captures show; None: unknown.
    distortion : float
        With t = tan(constellation) the light's image lies focal_px t (1 + distortion t^2) from the axis.
    largest_deg : float
        Constellation at which the field has length 1.
    constellation_deg : tuple of float
        Range that was measured.
    ghosts : tuple of AberrationGhost or BezierGhost
    removed : tuple of AberrationGhost or BezierGhost
        Ghosts that the user rejected, or that the search attributes to halo and star near the light. Later stages still
        account for their light; nothing draws them.
    halo : Halo or None
    star : Star or None
    sprites : tuple of Sprite
        Residual light that ghosts, halo and star do not explain; all sprites add up.
    reference : Reference
    background : Rgb
        Radiance of the whole picture that belongs to no layer.
    to_rec709 : tuple of 3 tuples of 3 float, or None
        From the captures' red, green and blue to linear Rec.709, one row each; None: unknown.
    remarks : tuple of str
    """

    schema_version: Literal[1] = 1
    size_px: tuple[int, int]
    axis_px: tuple[float, float]
    focal_px: float = Field(gt=0.0)
    distortion: float = 0.0
    sensor_width_mm: float | None = Field(None, gt=0.0)
    largest_deg: float = Field(gt=0.0, lt=90.0)
    constellation_deg: tuple[float, float]
    ghosts: tuple[Ghost, ...] = ()
    removed: tuple[Ghost, ...] = ()
    halo: Halo | None = None
    star: Star | None = None
    sprites: tuple[Sprite, ...] = ()
    reference: Reference = Reference()
    background: Rgb3 = (0.0, 0.0, 0.0)
    to_rec709: tuple[Rgb3, Rgb3, Rgb3] | None = None
    remarks: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _names(self) -> GhostModel:
        names = [ghost.name for ghost in self.ghosts]
        if len(set(names)) != len(names):
            raise ValueError("two ghosts have the same name")
        if min(self.size_px) < 1:
            raise ValueError("size_px must be at least 1 by 1")
        low, high = self.constellation_deg
        if not -90.0 < low <= high < 90.0:
            raise ValueError(
                f"constellation_deg {low:g} to {high:g}: the smaller comes first, both lie between -90 and 90"
            )
        return self
