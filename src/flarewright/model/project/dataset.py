"""What a data set of training pairs is drawn from: lenses, lights, backgrounds and sensors, each as a distribution."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, StrictBool, field_validator

from ..base import Frozen
from ..lens.prescription import LARGEST_F_NUMBER, LEAST_F_NUMBER
from ..lens.scatter import LARGEST_LEVEL, LARGEST_ROUGHNESS_NM, LEAST_LEVEL
from .distribution import Constant, Distribution, Integers, LogUniform, TextChoice, Texts, Uniform, within

Part = Literal["clean", "flared", "ghosts", "starburst", "veil", "light_mask", "ghost_mask"]
PARTS: tuple[Part, ...] = ("clean", "flared", "ghosts", "starburst", "veil", "light_mask", "ghost_mask")
"""Pictures of an item. clean and flared have passed the sensor; ghosts, starburst and veil are light alone."""

Format = Literal["png", "png16", "jpeg", "exr"]
Split = Literal["train", "val", "test"]
SPLITS: tuple[Split, ...] = ("train", "val", "test")

# 255 identifiers of an 8-bit mask
MOST_GHOSTS = 255
MOST_LIGHTS = 16
_TONE = re.compile(r"srgb|linear|gamma:(?P<gamma>\d+(?:\.\d+)?)")


class LensDraws(Frozen):
    """Distributions of the lens and its settings.

    Attributes
    ----------
    names : TextChoice
        Lenses of the library, or lens files.
    stops_down : Distribution
        Stops below wide open: 0 is wide open, 2 halves the diameter.
    f_number : Distribution or None
        Instead of `stops_down`. Where the lens does not open so wide, it is wide open.
    zoom : Distribution
        0 is the shortest focal length of a zoom, 1 the longest, equal steps in ratio; other lenses ignore it.
    focus_distance : Distribution or None
        Plane in focus, mm in front of the first vertex; None: as in the lens file, else infinity.
    coating : TextChoice
        Texts of `--coating`: "lens", "none", "early-multicoat", "quarter-wave:550".
    sensor_width_mm : Distribution
        Width of the sensor that the picture covers; its pixels are square.
    """

    names: Texts
    stops_down: Annotated[Distribution, AfterValidator(within(0.0, 16.0))] = Constant(constant=0.0)
    f_number: Annotated[Distribution, AfterValidator(within(LEAST_F_NUMBER, LARGEST_F_NUMBER))] | None = None
    zoom: Annotated[Distribution, AfterValidator(within(0.0, 1.0))] = Uniform(uniform=(0.0, 1.0))
    focus_distance: Annotated[Distribution, AfterValidator(within(1.0, 1e9))] | None = None
    coating: Texts = TextChoice(choice=("lens",))
    sensor_width_mm: Annotated[Distribution, AfterValidator(within(0.1, 1000.0))] = Constant(constant=24.0)

    @field_validator("names")
    @classmethod
    def _each_lens_once(cls, names: TextChoice) -> TextChoice:
        twice = next((name for name in names.choice if names.choice.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"{twice!r} is listed twice; keep one, and give it a larger weight")
        return names


class IrisDraws(Frozen):
    """Distributions of the iris.

    Attributes
    ----------
    blades : Distribution or None
        0 is round, else 3 to 24; None: the lens file's.
    rounding : Distribution or None
        0 straight edges, 1 a circle; None: the lens file's.
    rotation_deg : Distribution
    repeat : int
        Items in sequence that share an iris. Its diffraction pattern takes longer than all else of a draft.
    """

    blades: Annotated[Distribution, AfterValidator(within(0.0, 24.0, whole=True))] | None = None
    rounding: Annotated[Distribution, AfterValidator(within(0.0, 1.0))] | None = None
    rotation_deg: Annotated[Distribution, AfterValidator(within(-360.0, 360.0))] = Uniform(uniform=(0.0, 360.0))
    repeat: int = Field(25, ge=1, le=1_000_000)

    @field_validator("blades")
    @classmethod
    def _blades_make_an_opening(cls, blades: Distribution | None) -> Distribution | None:
        values: tuple[float, ...] = ()
        if isinstance(blades, Integers):
            values = tuple(range(blades.integers[0], blades.integers[1] + 1))
        elif blades is not None:
            values = getattr(blades, "choice", blades.support)
        if {1.0, 2.0} & set(map(float, values)):
            raise ValueError("an iris has 0 blades (round) or at least 3; leave 1 and 2 out")
        return blades


class DirtDraws(Frozen):
    """Distributions of dirt in the pupil; none by default. It shapes the starburst; `in_ghosts` shows it in ghosts."""

    dust_per_mm2: Annotated[Distribution, AfterValidator(within(0.0, 200.0))] = Constant(constant=0.0)
    scratches_per_cm2: Annotated[Distribution, AfterValidator(within(0.0, 1000.0))] = Constant(constant=0.0)
    fingerprint: Annotated[Distribution, AfterValidator(within(0.0, 1.0))] = Constant(constant=0.0)
    in_ghosts: StrictBool = False


class ScatterDraws(Frozen):
    """Distributions of what scatters light into a veil. It takes seconds a picture.

    Attributes
    ----------
    roughness_nm : Distribution
        rms roughness of the surfaces.
    cleanliness_level : Distribution or None
        Dust on the surfaces by IEST-STD-CC1246; None: clean.
    """

    roughness_nm: Annotated[Distribution, AfterValidator(within(0.0, LARGEST_ROUGHNESS_NM))] = Constant(constant=1.0)
    cleanliness_level: Annotated[Distribution, AfterValidator(within(LEAST_LEVEL, LARGEST_LEVEL))] | None = None


class InFrame(Frozen):
    """A light anywhere in the picture, or around it, but for the distortion of the lens.

    Attributes
    ----------
    margin : float
        The picture is enlarged by this part of its sides at every edge: 0 keeps lights inside, 0.25 puts more than half
        of them outside.
    """

    kind: Literal["frame"] = "frame"
    margin: float = Field(0.0, ge=-0.45, le=4.0)


class InField(Frozen):
    """A light anywhere within field angles.

    Attributes
    ----------
    x_deg, y_deg : Distribution
        Right and up.
    """

    kind: Literal["field"] = "field"
    x_deg: Annotated[Distribution, AfterValidator(within(-89.0, 89.0))]
    y_deg: Annotated[Distribution, AfterValidator(within(-89.0, 89.0))]


class LightDraws(Frozen):
    """Distributions of the lights.

    Attributes
    ----------
    count : Distribution
        Lights in a picture.
    place : InFrame or InField
    stops : Distribution
        Irradiance of a light on a plane that faces it, in stops over pi times the mean luminance of the background: the
        sun at noon has about 3 over a sunlit scene, a lamp at night 0 to 6.
    temperature_k : Distribution
        Of a black body; drawn values are rounded to 100 K.
    diameter_deg : Distribution
        Angular diameter; 0 is a point.
    """

    count: Annotated[Distribution, AfterValidator(within(0, MOST_LIGHTS, whole=True))] = Constant(constant=1)
    place: Annotated[InFrame | InField, Field(discriminator="kind")] = InFrame()
    stops: Annotated[Distribution, AfterValidator(within(-20.0, 30.0))] = Uniform(uniform=(0.0, 6.0))
    temperature_k: Annotated[Distribution, AfterValidator(within(500.0, 100000.0))] = LogUniform(
        log_uniform=(2700.0, 6500.0)
    )
    diameter_deg: Annotated[Distribution, AfterValidator(within(0.0, 60.0))] = Constant(constant=0.0)


class BackgroundDraws(Frozen):
    """What is behind the flare.

    Attributes
    ----------
    folder : str or None
        Pictures, also in folders below it: 8-bit ones are decoded from sRGB, others are linear. None: synthetic ones.
    crop : Distribution
        Side of the crop relative to the largest crop of the item's proportions.
    flip : bool
        Whether half of the crops are mirrored.
    """

    folder: str | None = None
    crop: Annotated[Distribution, AfterValidator(within(0.01, 1.0))] = Uniform(uniform=(0.5, 1.0))
    flip: StrictBool = True


class ExposureDraws(Frozen):
    """How bright the picture is.

    Attributes
    ----------
    of : {"mean", "background"}
        mean: the background's mean luminance becomes 0.18 of white; background: its white stays white.
    stops : Distribution
        On top of that.
    """

    of: Literal["mean", "background"] = "mean"
    stops: Annotated[Distribution, AfterValidator(within(-20.0, 20.0))] = Constant(constant=0.0)


class SensorDraws(Frozen):
    """The sensor, which treats the clean and the flared picture alike.

    Attributes
    ----------
    full_well_e : Distribution or None
        Electrons at white, which set the photon noise; None: no photon noise.
    read_noise_e : Distribution
        rms of the read noise in electrons; needs `full_well_e`.
    noise : {"independent", "same"}
        Whether the clean picture has other noise than the flared one, or the same random numbers.
    black_level : Distribution
        Value of black, as a part of white, before clipping.
    clip : bool
        Clip at white; False only for EXR.
    tone : TextChoice
        "srgb", "linear" or "gamma:2.2".
    jpeg_quality : Distribution or None
        Quality of a JPEG file through which both pictures pass; None: none (95 for JPEG files).
    """

    full_well_e: Annotated[Distribution, AfterValidator(within(10.0, 1e7))] | None = None
    read_noise_e: Annotated[Distribution, AfterValidator(within(0.0, 1e5))] = Constant(constant=0.0)
    noise: Literal["independent", "same"] = "independent"
    black_level: Annotated[Distribution, AfterValidator(within(0.0, 0.5))] = Constant(constant=0.0)
    clip: StrictBool = True
    tone: Texts = TextChoice(choice=("srgb",))
    jpeg_quality: Annotated[Distribution, AfterValidator(within(1.0, 100.0, whole=True))] | None = None

    @field_validator("tone")
    @classmethod
    def _curves_exist(cls, tone: TextChoice) -> TextChoice:
        for text in tone.choice:
            tone_gamma(text)
        return tone


class MaskDraws(Frozen):
    """How masks are made.

    Attributes
    ----------
    ghosts : int
        The brightest ghosts that get an identifier.
    threshold : float
        A ghost covers the pixels where its luminance exceeds this part of white.
    """

    ghosts: int = Field(8, ge=1, le=MOST_GHOSTS)
    threshold: float = Field(0.002, gt=0.0, le=1e6)


class Splits(Frozen):
    """Splits by lens: all pictures of a lens are in one split.

    Attributes
    ----------
    train, val, test : float or tuple of str
        Parts of the lenses, chosen by the seed; or lenses by name. With names, other lenses are in train.
    """

    train: float | tuple[str, ...] = 1.0
    val: float | tuple[str, ...] = 0.0
    test: float | tuple[str, ...] = 0.0

    @field_validator("train", "val", "test")
    @classmethod
    def _parts_are_positive(cls, part: float | tuple[str, ...]) -> float | tuple[str, ...]:
        if isinstance(part, float) and not 0.0 <= part <= 1e6:
            raise ValueError(f"a split of {part:g} is not possible; give a weight of 0 or more, or names of lenses")
        return part


class DatasetSpec(Frozen):
    """Everything that determines a data set; with the number of an item it determines the bytes of its files.

    Attributes
    ----------
    seed : int
    size_px : tuple of int
    quality : {"draft", "final"}
        draft: paraxial matrices; final: traced rays.
    rings : bool
        Diffraction rings inside ghosts (final quality), which take half of its time.
    layout : {"webdataset", "folder", "flare7k"}
        Tar files; a folder a part; or the folders of Flare7K.
    format : {"png", "png16", "jpeg", "exr"}
        Files of pictures; masks are PNG.
    items_per_shard : int
        Items of a tar file.
    parts : tuple of str or None
        Some of `PARTS`; None: all, veil only with `scatter`.
    light_in_clean : {"core", "image", "none"}
        What the clean picture shows of a light. core: its starburst on the light mask, a blown-out disc without spikes,
        as Flare7K does; image: the sharp image of its disc; none: nothing.
    """

    schema_version: Literal[1] = 1
    seed: int = Field(0, ge=0, lt=2**63)
    size_px: tuple[int, int] = (512, 512)
    quality: Literal["draft", "final"] = "draft"
    rings: StrictBool = False
    layout: Literal["webdataset", "folder", "flare7k"] = "webdataset"
    format: Format = "png"
    items_per_shard: int = Field(250, ge=1, le=100_000)
    parts: tuple[Part, ...] | None = Field(None, min_length=1)
    light_in_clean: Literal["core", "image", "none"] = "core"
    lens: LensDraws
    iris: IrisDraws = IrisDraws()
    dirt: DirtDraws = DirtDraws()
    scatter: ScatterDraws | None = None
    lights: LightDraws = LightDraws()
    background: BackgroundDraws = BackgroundDraws()
    exposure: ExposureDraws = ExposureDraws()
    sensor: SensorDraws = SensorDraws()
    masks: MaskDraws = MaskDraws()
    splits: Splits = Splits()

    @field_validator("size_px")
    @classmethod
    def _picture_size_in_range(cls, size_px: tuple[int, int]) -> tuple[int, int]:
        width, height = size_px
        if not (16 <= width <= 8192 and 16 <= height <= 8192):
            raise ValueError(f"{width}x{height} is not between 16 and 8192 pixels a side")
        return size_px

    @property
    def drawn_parts(self) -> tuple[Part, ...]:
        """The parts that are written, in the order of `PARTS`."""
        if self.parts is not None:
            return tuple(part for part in PARTS if part in self.parts)
        return tuple(part for part in PARTS if part != "veil" or self.scatter is not None)


def tone_gamma(text: str) -> float | None:
    """Return the gamma of a tone curve "gamma:2.2", 1 for "linear", None for "srgb"; raises ValueError for others."""
    found = _TONE.fullmatch(text)
    if found is None or (found["gamma"] and not 0.2 <= float(found["gamma"]) <= 5.0):
        raise ValueError(f"{text[:40]!r} is no tone curve; write srgb, linear, or gamma:2.2 (0.2 to 5)")
    if text == "linear":
        return 1.0
    return float(found["gamma"]) if found["gamma"] else None
