"""Build the flares that `flarewright predict` needs, from a measured model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FileError, ProjectError
from ..io.files.file_kind import foreign_hint
from ..io.files.text_file import read_bytes
from ..io.measurement.ghost_model_file import LARGEST_MODEL
from .defaults import SHOWN_PX, SIDE_PX, WIDTH_MM

if TYPE_CHECKING:
    from ..model import Layer
    from ..model.measurement.ghost_model import GhostModel
    from ..predict.flare import Flare
    from ..predict.occurrence import Flares

# largest relative difference of a sensor's aspect ratio from that of the captures
_OTHER_SHAPE = 0.03


@dataclass(frozen=True)
class Counting:
    """Which light of a measured flare counts.

    Attributes
    ----------
    ghosts_only : bool
    around_light : float or None
        Radius around the light's image within which only ghosts count, part of the picture's width; None:
        `subtraction.AROUND_LIGHT`.
    named : str
        Name of that option in messages.
    """

    ghosts_only: bool = False
    around_light: float | None = None
    named: str = "--around-light"

    def around(self, model: GhostModel) -> float:
        """Return the radius around the light's image within which only ghosts count.

        Raises
        ------
        ProjectError
            When it is negative or covers the whole picture.
        """
        from ..measure.glow.subtraction import AROUND_LIGHT
        from ..measure.replay.flare_only import nothing_beyond

        around, most = AROUND_LIGHT if self.around_light is None else self.around_light, nothing_beyond(model)
        if not 0.0 <= around < most:
            raise ProjectError(
                f"{self.named} {around:g} is no part of the picture's width that leaves something around the light; "
                f"give a number from 0 to below {most:.3g}, or count ghosts only"
            )
        return around


def model_flares(
    path: str, sensor_mm: tuple[float, float] | None, unit_per_cd_m2: float | None, counting: Counting
) -> Flares:
    """Return a measured flare for sampling and viewing; there is no better one for checking.

    Parameters
    ----------
    path : str
    sensor_mm : tuple of float or None
        None: the model's, else 36 mm wide.
    unit_per_cd_m2 : float or None
        Value of a scene of 1 cd/m2 in the captures; None: unknown.
    counting : Counting

    Raises
    ------
    FlarewrightError
        When the file is no ghost model, the sensor has another aspect ratio than the captures, or nothing counts.
    """
    from ..io.measurement.ghost_model_file import read_ghost_model
    from ..predict.occurrence import Flares

    refuse_others(path, "predict takes a lens, a scene (.toml), or")
    model = read_ghost_model(path)
    width = sensor_width(model, sensor_mm, lambda width, height: f"--sensor {width:g}x{height:g}")
    sampled, shown = (
        replace(
            model_flare(model, Path(path).name, width, unit_per_cd_m2, side, counting),
            recipe=partial(_made_again, path, sensor_mm, unit_per_cd_m2, counting, side),
        )
        for side in (SIDE_PX, SHOWN_PX)
    )
    return Flares(sampled, sampled.sensor, "measured", None, shown)


def _made_again(
    path: str,
    sensor_mm: tuple[float, float] | None,
    unit_per_cd_m2: float | None,
    counting: Counting,
    width_px: int,
    _threads: int | None,
) -> Flare:
    flares = model_flares(path, sensor_mm, unit_per_cd_m2, counting)
    return flares.sampled if width_px == SIDE_PX else flares.shown


def sensor_width(
    model: GhostModel, sensor_mm: tuple[float, float] | None, written: Callable[[float, float], str]
) -> float:
    """Return the width of a measured camera's sensor, mm.

    Parameters
    ----------
    model : GhostModel
    sensor_mm : tuple of float or None
        As given by the user; None: the model's, else 36 mm wide.
    written : callable
        Formats a width and a height as the user writes them.

    Raises
    ------
    ProjectError
        When the aspect ratio differs from that of the captures.
    """
    if sensor_mm is None:
        return model.sensor_width_mm or WIDTH_MM
    (wide, high), (width, height) = model.size_px, sensor_mm
    if abs(height * wide / (width * high) - 1.0) > _OTHER_SHAPE:
        fitting = float(f"{width * high / wide:.4g}")
        raise ProjectError(
            f"{written(width, height)} has other proportions than the captures, which have {wide} x {high} pixels; "
            f"give {written(width, fitting)}"
        )
    return width


def refuse_others(path: str, takes: str) -> None:
    """Raise when a JSON file is clearly no ghost model, for a shorter message than a list of its keys.

    Parameters
    ----------
    path : str
        A file that cannot be read is skipped; the reader reports it.
    takes : str
        Start of the message, before the name of a ghost model.

    Raises
    ------
    ProjectError
    """
    try:
        text = read_bytes(path, "a ghost model", LARGEST_MODEL).decode("utf-8", errors="ignore")
    except FileError:
        return
    if hint := foreign_hint(text):
        raise ProjectError(f"{path} {hint}")
    if not all(f'"{key}"' in text for key in ("axis_px", "focal_px", "largest_deg")):
        raise ProjectError(
            f"{path} is no ghost model: {takes} the model.json or compact.json that flarewright measure run writes"
        )


# all lights of a scene share the flare
@lru_cache(maxsize=8)
def model_flare(
    model: GhostModel,
    name: str,
    sensor_width_mm: float,
    unit_per_cd_m2: float | None,
    width_px: int,
    counting: Counting,
) -> Flare:
    """Return the counted light of a measured flare as a function.

    Returns
    -------
    Flare
        Per illuminance of the light, if the model knows that of its captures.

    Raises
    ------
    ProjectError
        When nothing counts.
    """
    from ..measure.core.measured_side import measured_side
    from ..measure.replay.flare_only import counted_flare
    from ..predict.flare import Flare, Frame, fingerprint_of
    from ..predict.table import DECIMALS

    around = counting.around(model)
    drawn: GhostModel = model.replace(halo=None, star=None, sprites=()) if counting.ghosts_only else model
    left_out, counts = _what_counts(model, around, counting)
    remarks = [counts if drawn.ghosts or drawn.halo or drawn.star or drawn.sprites else _nothing_counts(drawn, model)]
    light_lx = _light_lx(model)
    if light_lx is None:
        unit = "radiance in the captures' unit, with the light that was photographed"
        remarks.append("the model does not know the light of its captures: values are in its unit, not per lux")
    else:
        unit = "radiance in the captures' unit over the illuminance that the light gives on a plane facing it"
    width, height = model.size_px
    size = (width_px, max(1, round(width_px * height / width)))

    def draw(constellation_deg: float, roll_deg: float) -> Sequence[Layer]:
        there, roll = measured_side(drawn, constellation_deg, roll_deg)
        return counted_flare(
            drawn,
            there,
            roll_deg=roll,
            size_px=size,
            around=around,
            gain=1.0 if light_lx is None else 1.0 / light_lx,
            colors="camera" if model.to_rec709 is None else "rec709",
        )

    low, high = model.constellation_deg
    # constellations are rounded to these decimals: round the limits inwards
    grid = 10.0**DECIMALS
    nearest = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
    farthest = max(abs(low), abs(high))
    least = math.ceil(nearest * grid) / grid
    settings = str((size, unit_per_cd_m2, around))
    return Flare(
        name=name,
        draw=draw,
        size_px=size,
        sensor=Frame(sensor_width_mm, sensor_width_mm * size[1] / size[0]),
        f_number=math.nan if model.reference.f_number is None else model.reference.f_number,
        scene_scale=math.nan if unit_per_cd_m2 is None else unit_per_cd_m2,
        # turning the frame would need light beyond the captures' border, which was not measured
        turns_by_deg=None,
        least_deg=least,
        reach_deg=max(math.floor(farthest * grid) / grid, least),
        dark_beyond=False,
        unit=unit,
        per_lux=light_lx is not None,
        fingerprint=fingerprint_of(drawn.model_dump_json(), settings),
        left_out=left_out,
        remarks=tuple(remarks),
    )


def _light_lx(model: GhostModel) -> float | None:
    """Return the illuminance that the photographed light gives on a plane facing it; None if it is unknown."""
    luminance, solid_angle_sr = model.reference.luminance_cd_m2, model.reference.solid_angle_sr
    return None if luminance is None or solid_angle_sr is None else luminance * solid_angle_sr


def _nothing_counts(drawn: GhostModel, model: GhostModel) -> str:
    """Return the remark on a model of which nothing is drawn."""
    if drawn == model:
        return "there is nothing in the model: it has no ghosts, halo, star or sprites"
    return "nothing is counted: only ghosts were requested, and the model has none"


def _what_counts(model: GhostModel, around: float, counting: Counting) -> tuple[str, str]:
    """Return descriptions of the light that is left out of a measured flare, and of what counts."""
    if counting.ghosts_only:
        return "only ghosts are drawn", "only ghosts are counted, without star, halo and residual"
    if around == 0.0:
        return "the light's own image is in it", "all of the measured flare is counted, including the light's own image"
    degrees = math.degrees(math.atan(around * model.size_px[0] / model.focal_px))
    return "the light's own image is left out", (
        f"ghosts are counted everywhere, star, halo and residual only farther than {around:.3g} of the width from the "
        f"light's image ({degrees:.2g} degrees on the axis): nearer they include the light's own image"
    )
