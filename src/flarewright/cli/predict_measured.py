"""Flares for `flarewright predict`, built from a measured model."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import ProjectError
from .predict_sizes import SHOWN_PX, SIDE_PX, WIDTH_MM

if TYPE_CHECKING:
    from ..model import Layer
    from ..model.ghost_model import GhostModel
    from ..predict.flare import Flare
    from ..predict.occurrence import Flares

# a sensor whose proportions differ by a larger part is not that of the captures
_OTHER_SHAPE = 0.03


@dataclass(frozen=True)
class Counting:
    """What of a measured flare counts.

    Attributes
    ----------
    ghosts_only : bool
    around_light : float or None
        How far around the light's image only ghosts count, part of the picture's width; None: `dimmed.AROUND_LIGHT`.
    named : str
        What a person calls that number.
    """

    ghosts_only: bool = False
    around_light: float | None = None
    named: str = "--around-light"

    def around(self, model: GhostModel) -> float:
        """Return how far around the light's image only ghosts count.

        Raises
        ------
        ProjectError
            When there is no such distance, or nothing is beyond it.
        """
        from ..measure.counted import nothing_beyond
        from ..measure.dimmed import AROUND_LIGHT

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
    """Return a measured flare as it is sampled and shown; nothing better judges it.

    Parameters
    ----------
    path : str
    sensor_mm : tuple of float or None
        None: 36 mm wide.
    unit_per_cd_m2 : float or None
        What a scene of 1 cd/m2 has in the captures; None: not known.
    counting : Counting

    Raises
    ------
    FlarewrightError
        When the file is no ghost model, the sensor has other proportions than the captures, or nothing counts.
    """
    from ..io.ghost_model_file import read_ghost_model
    from ..predict.occurrence import Flares

    refuse_others(path, "predict takes a lens, a scene (.toml), or")
    model = read_ghost_model(path)
    width = sensor_width(model, sensor_mm, lambda width, height: f"--sensor {width:g}x{height:g}")
    sampled, shown = (
        model_flare(model, Path(path).name, width, unit_per_cd_m2, side, counting) for side in (SIDE_PX, SHOWN_PX)
    )
    return Flares(sampled, sampled.sensor, "measured", None, shown)


def sensor_width(
    model: GhostModel, sensor_mm: tuple[float, float] | None, written: Callable[[float, float], str]
) -> float:
    """Return how wide a measured camera's sensor is, mm.

    Parameters
    ----------
    model : GhostModel
    sensor_mm : tuple of float or None
        As a person told it; None: 36 mm wide.
    written : callable
        Writes a width and a height as a person tells them.

    Raises
    ------
    ProjectError
        When it has other proportions than the captures.
    """
    if sensor_mm is None:
        return WIDTH_MM
    (wide, high), (width, height) = model.size_px, sensor_mm
    if abs(height * wide / (width * high) - 1.0) > _OTHER_SHAPE:
        fitting = float(f"{width * high / wide:.4g}")
        raise ProjectError(
            f"{written(width, height)} has other proportions than the captures, which have {wide} x {high} pixels; "
            f"give {written(width, fitting)}"
        )
    return width


def refuse_others(path: str, takes: str) -> None:
    """Refuse JSON that is plainly no ghost model, of whose keys a list would be no help.

    Parameters
    ----------
    path : str
        What cannot be read is left to the reader.
    takes : str
        Goes before what a ghost model is called.

    Raises
    ------
    ProjectError
    """
    try:
        text = Path(path).read_text("utf-8", errors="ignore")
    except OSError:
        return
    if not all(f'"{key}"' in text for key in ("axis_px", "focal_px", "largest_deg")):
        raise ProjectError(
            f"{path} is no ghost model: {takes} the model.json or compact.json that flarewright measure run writes"
        )


# every light of a scene asks for the same
@lru_cache(maxsize=8)
def model_flare(
    model: GhostModel,
    name: str,
    sensor_width_mm: float,
    unit_per_cd_m2: float | None,
    width_px: int,
    counting: Counting,
) -> Flare:
    """Return what counts of a measured flare as a function.

    Parameters
    ----------
    model : GhostModel
    name : str
    sensor_width_mm : float
    unit_per_cd_m2 : float or None
    width_px : int
    counting : Counting

    Returns
    -------
    Flare
        Per illuminance of the light, when the model tells that of its captures.

    Raises
    ------
    ProjectError
        When nothing counts.
    """
    from ..measure.counted import counted
    from ..measure.replay import BEYOND_DEG
    from ..predict.flare import Flare, Frame
    from ..predict.table import DECIMALS

    around = counting.around(model)
    drawn: GhostModel = model.replace(halo=None, star=None, sprites=()) if counting.ghosts_only else model
    left_out, counts = _what_counts(model, around, counting)
    if not (drawn.ghosts or drawn.halo or drawn.star or drawn.sprites):
        counts = "there is nothing in the model: it has no ghosts, halo, star or sprites"
        if drawn != model:
            counts = "nothing is counted: only ghosts were asked for, and the model has none"
    remarks = [counts]
    reference = model.reference
    light_lx, unit = 1.0, "radiance in the captures' unit, with the light that was photographed"
    per_lux = reference.luminance_cd_m2 is not None and reference.solid_angle_sr is not None
    if reference.luminance_cd_m2 is not None and reference.solid_angle_sr is not None:
        light_lx = reference.luminance_cd_m2 * reference.solid_angle_sr
        unit = "radiance in the captures' unit over the illuminance that the light gives on a plane facing it"
    else:
        remarks.append("the model does not tell the light of its captures: values are in its own unit, not per lux")
    width, height = model.size_px
    size = (width_px, max(1, round(width_px * height / width)))

    def draw(constellation_deg: float, roll_deg: float) -> Sequence[Layer]:
        return counted(drawn, constellation_deg, roll_deg=roll_deg, size_px=size, around=around, gain=1.0 / light_lx,
                       colors="camera" if model.to_rec709 is None else "rec709")  # fmt: skip

    low, high = model.constellation_deg
    # angles are asked for with so many digits: none shall lie beyond what is known
    grid = 10.0**DECIMALS
    settings = str((size, unit_per_cd_m2, around))
    return Flare(
        name=name,
        draw=draw,
        size_px=size,
        sensor=Frame(sensor_width_mm, sensor_width_mm * size[1] / size[0]),
        f_number=reference.f_number if reference.f_number is not None else math.nan,
        scene_scale=math.nan if unit_per_cd_m2 is None else unit_per_cd_m2,
        # its frame turns, but what lies beyond the captures' border was not measured
        turns_by_deg=None,
        least_deg=max(math.ceil((low - BEYOND_DEG) * grid) / grid, 0.0),
        reach_deg=math.floor((high + BEYOND_DEG) * grid) / grid,
        dark_beyond=False,
        unit=unit,
        per_lux=per_lux,
        fingerprint=hashlib.sha256(drawn.model_dump_json().encode() + settings.encode()).hexdigest(),
        left_out=left_out,
        remarks=tuple(remarks),
    )


def _what_counts(model: GhostModel, around: float, counting: Counting) -> tuple[str, str]:
    """Say what of the light is left out of a measured flare, and what is counted."""
    if counting.ghosts_only:
        return "only ghosts are drawn", "only ghosts are counted, neither star nor halo nor what is left beside them"
    if around == 0.0:
        return "the light's own image is in it", "all of the measured flare is counted, the light's own image too"
    degrees = math.degrees(math.atan(around * model.size_px[0] / model.focal_px))
    return "the light's own image is left out", (
        f"ghosts are counted everywhere, star, halo and what is left beside them only farther than {around:.3g} of the "
        f"width from the light's image ({degrees:.2g} degrees on the axis): nearer they hold the light's own image"
    )
