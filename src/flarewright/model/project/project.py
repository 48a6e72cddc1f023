"""`Project`: everything that a render needs, in one record."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, StrictBool, field_validator, model_validator

from ...errors import ProjectError
from ..base import Frozen
from ..lens.coating import COATINGS, STANDARD_NAMES, Coating, Standard
from ..lens.imperfection import Imperfection
from ..lens.iris import Iris
from ..lens.plate import Plate
from ..lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER, Lens
from ..lens.scatter import Scatter
from .animation import ProjectCurve, Timeline, one_curve_each
from .art import Art
from .backplate import Backplate
from .camera import Camera, Colorspace
from .design import Design
from .holdout import Holdout
from .light import Light
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
    """Coatings repeated in order, front to back, over the surfaces between glass and air; cemented ones stay bare."""

    kind: Literal["in-turn"] = "in-turn"
    coatings: tuple[Coating, ...] = Field(min_length=1, max_length=500)


class PerRow(Frozen):
    """One coating per row; the stop's is ignored."""

    kind: Literal["per-row"] = "per-row"
    coatings: tuple[Coating | None, ...]


CoatingChoice = Annotated[AsLens | Preset | Everywhere | InTurn | PerRow, Field(discriminator="kind")]
CHOICES = (AsLens, Preset, Everywhere, InTurn, PerRow)
"""The types that a `CoatingChoice` can have."""


def everywhere(coating: Any) -> Any:
    """Return `Everywhere` for a coating, so that it covers every surface between glass and air; others unchanged."""
    return Everywhere(coating=coating) if isinstance(coating, COATINGS) else coating


class Quality(Frozen):
    """Rendering method and accuracy.

    Attributes
    ----------
    mode : {"draft", "final", "reference"}
        draft: paraxial matrices; final: traced ray bundles; reference: random rays, all orders of reflection.
    wavelengths : int
        Number of traced wavelengths: 3 for draft colours, 7 to 31 for final pictures.
    bridge : bool
        Fill the gap between neighbouring wavelengths so that lateral colour shows no steps (final); sample the spectrum
        in steps of 5 nm or finer instead of at the traced wavelengths alone (reference).
    paths : {"all", "same-side"}
        Which two-reflection paths: all, or those that reflect twice on one side of the stop.
    tolerance_px : float
        Largest interpolation error of the ray bundle's grid, pixels; the grid is refined to it.
    ringing : {"off", "collins", "frft"}
        Diffraction rings inside ghosts (final quality). collins: Fresnel diffraction at the iris with each ghost's own
        matrix, per wavelength, where it is visible; frft: one fractional Fourier transform for all (Hullin et al.
        2011, equation 5); off: sharp edges.
    cull : float
        Skip paths that carry less than this fraction of all ghost flux; a remark reports them.
    orders : {2, 4}
        4 also draws four-reflection ghosts (final only); reference quality always has all orders.
    order4_limit : float
        Draw only four-reflection paths that carry more than this fraction of the two-reflection light in the picture.
    source_step_deg : float
        Trace area lights wider than this in parts; within a part, ghosts change linearly. Lights wider than 24 degrees
        have as many parts as one of 24, or 12 across.
    screen : bool
        For pictures that are only viewed (final): draw with less detail what eight bits hardly show, with still less
        as `tolerance_px` exceeds 0.5; search ghosts in the middle colour only.
    seed : int
        Seed of the random numbers.
    reference_error : float
        Reference quality stops when the relative standard error of the ghosts is below this, 1e-5 to 1. Rays grow with
        its inverse square, so smaller ones are never reached.
    reference_error_of : {"total", "blocks"}
        Error of the whole ghost flux in the picture, or of its blocks of 16 x 16 pixels.
    reference_from : {"auto", "light", "camera"}
        Where reference quality starts the rays of area lights: at the light, at the sensor, or where the same work
        gives the smaller error.
    reference_samples : int or None
        Largest number of points on the front that reference quality traces; None: no limit.
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
    reference_error: float = Field(0.02, ge=1e-5, le=1.0)
    reference_error_of: Literal["total", "blocks"] = "blocks"
    reference_from: Literal["auto", "light", "camera"] = "auto"
    reference_samples: int | None = Field(None, ge=1)


class Output(Frozen):
    """Layers and formats of the output.

    Attributes
    ----------
    layers : {"beauty", "passes", "ghosts"}
        beauty: one picture; passes: beauty, starburst, ghosts; ghosts: also one layer a ghost.
    brightest : int or None
        Only the N brightest single ghosts get a separate layer.
    colorspace : {"rec709", "acescg"}
    ocio_space : str or None
        A linear colour space of scenes, a role or an alias of an OpenColorIO configuration: the pixels of files are
        converted to it from rec709.
    ocio_config : str or None
        Its configuration, a file or a name such as "ocio://default"; None: the variable OCIO, else the built-in one.
    gamut : {"keep", "compress"}
        keep: colours outside the primaries have negative channels; compress: colours are moved towards white, and the
        beauty is the sum of the compressed passes.
    pixel_type : {"half", "float"}
        half: 16 bits per value, irradiances times a constant of the lights (`io.images.half.exr_scale`); float: 32
        bits, irradiances unscaled.
    compression : {"zip", "dwaa"}
        zip: lossless; dwaa: lossy, smaller files, for half floats only.
    starburst : bool
        Whether the picture includes the direct image of the light with its diffraction pattern.
    matte : {"none", "ghosts"}
        ghosts: a Cryptomatte, in which each ghost's coverage is its share of the light of a pixel.
    matte_ranks : int
        Ghosts that it keeps at a pixel, those with most light; an even number, two a layer.
    """

    layers: Literal["beauty", "passes", "ghosts"] = "passes"
    brightest: int | None = Field(None, ge=1)
    colorspace: Colorspace = "rec709"
    ocio_space: str | None = Field(None, min_length=1)
    ocio_config: str | None = Field(None, min_length=1)
    gamut: Literal["keep", "compress"] = "keep"
    pixel_type: Literal["half", "float"] = "half"
    compression: Literal["zip", "dwaa"] = "zip"
    starburst: StrictBool = True
    matte: Literal["none", "ghosts"] = "none"
    matte_ranks: int = Field(8, ge=2, le=64)

    @field_validator("matte_ranks")
    @classmethod
    def _two_ranks_a_layer(cls, ranks: int) -> int:
        if ranks % 2:
            raise ValueError(f"a layer of a Cryptomatte has two ranks; give an even number, such as {ranks + 1}")
        return ranks

    @model_validator(mode="after")
    def _one_space(self) -> Output:
        if self.ocio_space is not None and self.colorspace != "rec709":
            raise ValueError(f'ocio_space is converted from "rec709", and colorspace is "{self.colorspace}": keep one')
        return self

    @model_validator(mode="after")
    def _dwaa_keeps_16_bits(self) -> Output:
        if self.compression == "dwaa" and self.pixel_type == "float":
            raise ValueError('compression "dwaa" keeps 16 bits of a value, and pixel_type "float" writes 32: keep one')
        return self


class Project(Frozen):
    """Everything that a render needs; command-line flags set the same fields.

    Attributes
    ----------
    lens : str or Lens
        A shipped lens' name, a path, or the prescription itself.
    f_number : float or None
        None: wide open.
    iris : Iris or None
        None: the lens file's.
    coating : CoatingChoice
        A plain coating, or the name of a standard one, means `Everywhere`, and the text `lens` means `AsLens`. The
        command line's other texts are read by `flarewright.parse_coating_choice`.
    dirt : Dirt
        Dirt in the pupil; none by default.
    starburst : Starburst
        How the direct image is drawn.
    zoom : str or float or None
        A position of the lens by name, or a focal length in mm; None: the gaps of the rows.
    filter : Plate or None
        A plane plate in front of the lens.
    imperfection : Imperfection or None
        One manufactured sample within tolerances; None: the nominal design.
    scatter : Scatter or None
        Surface scatter; None: as in the lens file (lenses of the library have none).
    holdout : Holdout or None
        Holdout of all lights.
    art : Art
        Art direction; none by default.
    design : Design or None
        Settings of `flarewright design`; a render ignores them.
    curves : tuple of ProjectCurve
        Values over time, for a shot; a render without a time ignores them.
    timeline : Timeline
        Frames per second of a shot, and the number of its frame at 0 s.
    plate : Backplate or None
        Photograph under the flare, for the editor and for comps; a render draws the flare alone.
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
    curves: Annotated[tuple[ProjectCurve, ...], AfterValidator(one_curve_each)] = ()
    timeline: Timeline = Timeline()
    plate: Backplate | None = None

    @property
    def lit_by_plate(self) -> bool:
        """Whether the lights are those of the plate: layers have its unit then, and add to it as they are."""
        return self.plate is not None and self.plate.lit

    @field_validator("coating", mode="before")
    @classmethod
    def _coating_of_a_word(cls, coating: Any) -> Any:
        if not isinstance(coating, str):
            return everywhere(coating)
        word = coating.strip()
        if word == "lens":
            return AsLens()
        for name in STANDARD_NAMES:
            if word.lower() == name:
                return everywhere(Standard(name))
        raise ProjectError(
            f"coating {coating!r} is not lens or one of {', '.join(STANDARD_NAMES)}; "
            f"flarewright.parse_coating_choice({coating!r}) reads the other words of the command line"
        )

    @field_validator("zoom")
    @classmethod
    def _zoom_is_above_zero(cls, zoom: str | float | None) -> str | float | None:
        if isinstance(zoom, float) and not zoom > 0.0:
            raise ValueError(f"{zoom:g} is no focal length; give one above 0 mm, or the name of a position")
        return zoom
