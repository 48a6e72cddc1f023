"""A measured flare: its ghosts, star and halo as numbers over the constellation, and how well they are known.

Positions are in pixels of the picture it was measured in, from the optical axis; a light at constellation theta has the
field s of length tan(theta) / tan(`largest_deg`), pointing to where the light's image lies. Radiance is in the unit of
the captures at their settings (`Reference`).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, TypeVar

from pydantic import Field, model_validator

from .base import Frozen
from .sprite import Sprite

Ten = tuple[float, float, float, float, float, float, float, float, float, float]
Rgb3 = tuple[float, float, float]
Above0 = Annotated[float, Field(gt=0.0)]
AnyGhost = TypeVar("AnyGhost", "AberrationGhost", "BezierGhost")
Fade = tuple[Annotated[float, Field(ge=0.0)], Annotated[float, Field(ge=0.0)]]


class Disc(Frozen):
    """A rim that cuts a ghost: a disc in its pupil whose centre moves with the light.

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
    """One colour of a ghost: where each point p of its pupil lands, and how bright it is.

    (x, y) = (s f + p g) / (1 + b v + c w); f, g and the intensity are polynomials of u = p.p, v = p.s, w = s.s
    with the ten terms 1, u, v, w, uu, uv, vv, uw, vw, ww. The pupil is the unit disc, or the ghost's `blades`, cut by
    `discs`.

    Attributes
    ----------
    f, g : tuple of 10 float
        Pixels.
    intensity : tuple of 10 float
        Radiance times pixels per area of the pupil; below 0 counts as 0.
    discs : tuple of Disc
    soft_px : float
        Standard deviation of the Gaussian that spreads its light, pixels: borders are soft, for the light has a size.
    lateral_px : tuple of 2 or 6 float
        Of the wavelengths that the colour is made of each draws the ghost at its own place and in its own size: by f'
        and g', pixels, f and g grow with one standard deviation; the same with both signs turned. Then f" and g", by
        which they grow with t t - 1 for a wavelength t standard deviations away, and by how much f' and g' grow with w;
        0 where these are not there.
    below : tuple of 2 float
        b and c.
    uncertainty : tuple of float
        Standard deviation of f, g, intensity and each disc's three numbers, in this order, of soft_px where that was
        fitted, then of lateral_px where that was, and of six numbers of it and `below` where this was; 0 for numbers
        that were not fitted. Empty: unknown.
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
    """A number over the constellation: a natural cubic spline through evenly spread knots.

    Attributes
    ----------
    values : tuple of float
        At knots that divide a ghost's `visible_deg` evenly; two are a straight line, one a constant.
    error : tuple of float
        Standard deviation of each.
    """

    values: tuple[float, ...] = Field(min_length=1, max_length=32)
    error: tuple[float, ...] = Field(min_length=1, max_length=32)

    @model_validator(mode="after")
    def _pairs(self) -> Curve:
        if len(self.values) != len(self.error):
            raise ValueError("a curve needs one error for each value")
        return self


class Curves(Frozen):
    """What a ghost does over the constellation that its aberrations do not foretell; None: nothing.

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
    """A rim of straight sides of one length, an iris' blades; it stands still when the light rolls.

    Attributes
    ----------
    count : int
    first_deg : float
        Direction in which a side lies from the pupil's middle, counterclockwise from the right in the upright picture.
    """

    count: int = Field(ge=3, le=36)
    first_deg: float


def _appears_first(ghost: AnyGhost) -> AnyGhost:
    low, high = ghost.visible_deg
    if low > high:
        raise ValueError(
            f"visible_deg {low:g} to {high:g}: it appears before it disappears, so the smaller comes first"
        )
    return ghost


class AberrationGhost(Frozen):
    """A ghost by its aberrations: one set of numbers for all constellations.

    Attributes
    ----------
    name : str
    red, green, blue : Channel
    blades : Blades or None
        In the place of the pupil's unit disc stands a polygon as large.
    visible_deg : tuple of float
        Constellations at which it appears and disappears.
    fade_deg : tuple of float
        Over which range about each of these its light comes and goes evenly; 0 is at once.
    curves : Curves
        What `measure compress` found to differ over the constellation.
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
    """A ghost by Walch's primitive (2017, chapter 6): every number a polynomial over the angle from the axis.

    Attributes
    ----------
    name : str
    numbers : tuple of 19 tuples of float
        Coefficients, lowest order first, of z from -1 to 1 between the least and the largest angle from the axis that
        `visible_deg` holds: both sides of the axis share them. In order: centre along and across the field, height,
        extent left and right, control points left (along, across) and right, falloff outside and inside, exponents
        outside and inside, border level and inner level of red, green and blue. Pixels and radiance. Control points
        count from 0 to 1.5 times the extent and the height.
    uncertainty : tuple of float
        Standard deviation of each number about its polynomial, 0 where it is not known, or empty.
    visible_deg : tuple of float
        Constellations at which it appears and disappears.
    fade_deg : tuple of float
        As of an `AberrationGhost`.
    """

    kind: Literal["bezier"] = "bezier"
    name: str
    numbers: tuple[tuple[float, ...], ...] = Field(min_length=19, max_length=19)
    uncertainty: tuple[float, ...] = Field((), max_length=19)
    visible_deg: tuple[float, float]
    fade_deg: Fade = (0.0, 0.0)

    _appears = model_validator(mode="after")(_appears_first)


def _by_constellation(what: str, constellation_deg: Sequence[float]) -> None:
    # two rolls may have been photographed at one constellation
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
        Standard deviations of `radiance`, by how far directions differ; empty: not known.
    strength : tuple of (float, float)
        Rising constellations, degrees, and how much of the halo there is; linear between them; empty: 1 throughout.
    even : tuple of (float, Rgb)
        Rising constellations, degrees, and radiance that is the same in the whole picture: veil, and ghosts too large
        and faint to be told apart; linear between them; empty: none.
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
    """Spikes of diffraction around the light's image; they turn with the camera, not with the light.

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
        On a spike's ridge at those distances, as in `Halo`.
    uncertainty : tuple of Rgb
        Standard deviations of `radiance`, by how far spikes differ; empty: not known.
    strength : tuple of (float, float)
        As in `Halo`: the lens' rims shade the light's image, and with it the star.
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
    distortion : float
        With t = tan(constellation) the light's image lies focal_px t (1 + distortion t^2) from the axis.
    largest_deg : float
        Constellation at which the field has length 1.
    constellation_deg : tuple of float
        Range that was measured.
    ghosts : tuple of AberrationGhost or BezierGhost
    removed : tuple of AberrationGhost or BezierGhost
        What a person says is no ghost of the lens, or is no more than halo and star leave around the light: a fit
        accounts for its light, and nothing draws it.
    halo : Halo or None
    star : Star or None
    sprites : tuple of Sprite
        What is left beside all of these; their light adds up.
    reference : Reference
    background : Rgb
        Radiance everywhere, part of no layer.
    to_rec709 : tuple of 3 tuples of 3 float, or None
        From the captures' red, green and blue to linear Rec.709, one row each; None: unknown.
    remarks : tuple of str
    """

    schema_version: Literal[1] = 1
    size_px: tuple[int, int]
    axis_px: tuple[float, float]
    focal_px: float = Field(gt=0.0)
    distortion: float = 0.0
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
