"""A project: everything that a render needs, in one record."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, field_validator

from .art import Art
from .base import Frozen
from .camera import Camera, Colorspace
from .coating import COATINGS, Coating
from .design import Design
from .holdout import Holdout
from .imperfection import Imperfection
from .iris import Iris
from .lens import LARGEST_F_NUMBER, LEAST_F_NUMBER, Lens
from .light import Light
from .plate import Plate
from .scatter import Scatter
from .starburst import Dirt, Starburst


class AsLens(Frozen):
    """Each surface keeps the coating of the lens file."""

    kind: Literal["lens"] = "lens"


class Preset(Frozen):
    """One of the lens file's named coating presets."""

    kind: Literal["preset"] = "preset"
    name: str


class Everywhere(Frozen):
    """One coating on every surface between glass and air; cemented surfaces stay bare."""

    kind: Literal["everywhere"] = "everywhere"
    coating: Coating


class InTurn(Frozen):
    """Coatings dealt out in turn, from the front on, to the surfaces between glass and air; cemented ones stay bare."""

    kind: Literal["in-turn"] = "in-turn"
    coatings: tuple[Coating, ...] = Field(min_length=1, max_length=500)


class PerRow(Frozen):
    """One coating a row, the stop's ignored."""

    kind: Literal["per-row"] = "per-row"
    coatings: tuple[Coating | None, ...]


CoatingChoice = Annotated[AsLens | Preset | Everywhere | InTurn | PerRow, Field(discriminator="kind")]
CHOICES = (AsLens, Preset, Everywhere, InTurn, PerRow)
"""What a `CoatingChoice` may be."""


def everywhere(coating: Any) -> Any:
    """Return the choice that a coating by itself stands for, on every surface between glass and air; others as is."""
    return Everywhere(coating=coating) if isinstance(coating, COATINGS) else coating


class Quality(Frozen):
    """How much work goes into a picture.

    Attributes
    ----------
    mode : {"draft", "final", "reference"}
        draft: paraxial matrices; final: traced ray bundles; reference: random rays, all orders of reflection.
    wavelengths : int
        Traced wavelengths; 3 is a draft of the colours, 7 to 31 for final pictures.
    bridge : bool
        Fill the gap between neighbouring wavelengths so that lateral colour shows no steps (final); sample the spectrum
        in steps of 5 nm or finer instead of at the traced wavelengths alone (reference).
    paths : {"all", "same-side"}
        Which two-reflection paths: all, or those that reflect twice on one side of the stop.
    tolerance_px : float
        The bundle's grid is refined until interpolation errs by less than this, in pixels.
    ringing : {"off", "collins", "frft"}
        Rings inside ghosts (final quality). collins: Fresnel diffraction at the iris with each ghost's own matrix, per
        wavelength, where it can be seen; frft: one fractional Fourier transform for all (Hullin et al. 2011,
        equation 5); off: sharp edges.
    cull : float
        Paths that carry less than this part of all ghost flux are left out, and said so.
    orders : {2, 4}
        4 also draws four-reflection ghosts (final only); reference quality has all orders in any case.
    order4_limit : float
        Of those only paths that carry more than this part of all two-reflection light in the picture.
    source_step_deg : float
        An area light wider than this is traced in parts: what a part's ghosts differ by over it is taken as straight.
    screen : bool
        For a picture that is only looked at (final): what eight bits hardly show is drawn in less detail, and less
        still as `tolerance_px` grows beyond 0.5; ghosts are looked for in the middle colour alone.
    seed : int
        Begins the random numbers.
    reference_error : float
        Reference quality ends when the ghosts' relative standard error is below this.
    reference_error_of : {"total", "blocks"}
        Whose error: of the ghosts' whole flux in the picture, or of its blocks of 16 x 16 pixels.
    reference_from : {"auto", "light", "camera"}
        Where reference quality begins the rays of area lights: at the light, at the sensor, or where less work makes
        less error.
    reference_samples : int or None
        Reference quality traces no more points of the front than this; None: as many as the error needs.
    """

    mode: Literal["draft", "final", "reference"] = "final"
    wavelengths: int = Field(7, ge=1, le=81)
    bridge: StrictBool = True
    paths: Literal["all", "same-side"] = "all"
    tolerance_px: float = Field(0.25, gt=0.0, le=10.0)
    ringing: Literal["off", "collins", "frft"] = "collins"
    cull: float = Field(0.0, ge=0.0, lt=1.0)
    orders: Literal[2, 4] = 2
    order4_limit: float = Field(1e-4, gt=0.0, lt=1.0)
    source_step_deg: float = Field(2.0, ge=0.05, le=60.0)
    screen: StrictBool = False
    seed: int = Field(0, ge=0, lt=2**63)
    reference_error: float = Field(0.02, gt=0.0, le=1.0)
    reference_error_of: Literal["total", "blocks"] = "blocks"
    reference_from: Literal["auto", "light", "camera"] = "auto"
    reference_samples: int | None = Field(None, ge=1)


class Output(Frozen):
    """What is written.

    Attributes
    ----------
    layers : {"beauty", "passes", "ghosts"}
        beauty: one picture; passes: beauty, starburst, ghosts; ghosts: also one layer a ghost.
    brightest : int or None
        Of the single ghosts only the N brightest get a layer of their own.
    colorspace : {"rec709", "acescg"}
    gamut : {"keep", "compress"}
        keep: colours outside the primaries have negative channels; compress: they are moved towards white, and the
        beauty is the sum of the passes so moved.
    pixel_type : {"half", "float"}
        half: 16 bits a value, irradiances times a constant of the lights (`io.half.exr_scale`); float: 32 bits,
        irradiances as they are.
    starburst : bool
        Whether the direct image of the light with its diffraction pattern is part of the picture.
    """

    layers: Literal["beauty", "passes", "ghosts"] = "passes"
    brightest: int | None = Field(None, ge=1)
    colorspace: Colorspace = "rec709"
    gamut: Literal["keep", "compress"] = "keep"
    pixel_type: Literal["half", "float"] = "half"
    starburst: StrictBool = True


class Project(Frozen):
    """Everything that a render needs; the command line's flags are its shorthand.

    Attributes
    ----------
    lens : str or Lens
        A shipped lens' name, a path, or the prescription itself.
    f_number : float or None
        None: wide open.
    iris : Iris or None
        None: the lens file's.
    coating : CoatingChoice
        A coating by itself stands for `Everywhere`; `flarewright.parse_coating_choice` reads the command line's texts.
    dirt : Dirt
        What lies in the pupil; nothing by default.
    starburst : Starburst
        How the direct image is drawn.
    zoom : str or float or None
        One of the lens' positions by name, or a focal length in mm; None: as the rows stand.
    filter : Plate or None
        A plane plate in front of the lens.
    imperfection : Imperfection or None
        One sample of the lens within tolerances; None: as designed.
    scatter : Scatter or None
        What the surfaces scatter; None: as the lens file says, which is nothing for the lenses of the library.
    holdout : Holdout or None
        What stands in front of all lights.
    art : Art
        What is changed by hand; nothing by default.
    design : Design or None
        The target of `flarewright design`; a render does not look at it.
    """

    schema_version: Literal[1] = 1
    lens: str | Lens
    f_number: float | None = Field(None, gt=LEAST_F_NUMBER, le=LARGEST_F_NUMBER)
    iris: Iris | None = None
    coating: CoatingChoice = AsLens()
    lights: tuple[Light, ...] = Field(min_length=1)
    camera: Camera = Camera()
    quality: Quality = Quality()
    output: Output = Output()
    dirt: Dirt = Dirt()
    starburst: Starburst = Starburst()
    zoom: str | float | None = None
    filter: Plate | None = None
    imperfection: Imperfection | None = None
    scatter: Scatter | None = None
    holdout: Holdout | None = None
    art: Art = Art()
    design: Design | None = None

    @field_validator("coating", mode="before")
    @classmethod
    def _coating_is_no_text(cls, coating: Any) -> Any:
        if isinstance(coating, str):
            raise ValueError(
                f"{coating!r} is a text; write coating=flarewright.parse_coating_choice({coating!r}), or give it to "
                "flarewright.render beside the project"
            )
        return everywhere(coating)

    @field_validator("zoom")
    @classmethod
    def _zoom_is_above_zero(cls, zoom: str | float | None) -> str | float | None:
        if isinstance(zoom, float) and not zoom > 0.0:
            raise ValueError(f"{zoom:g} is no focal length; give one above 0, in mm, or the name of a position")
        return zoom
