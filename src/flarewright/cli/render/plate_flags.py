"""Conversion of the flags of a plate to its settings."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

from ...errors import ProjectError
from .options.plate import CompOptions, PlateOptions

if TYPE_CHECKING:
    from ...model import Backplate
    from ...plates.settings import PlateSettings

# options that change nothing without a plate
_FLAGS = tuple(each.name for kind in (PlateOptions, CompOptions) for each in fields(kind))


def plate_settings(plate: str | None, options: PlateOptions, own: Backplate | None = None) -> PlateSettings | None:
    """Return the settings of a plate; None without one.

    Parameters
    ----------
    plate : str or None
        Its file name.
    options : PlateOptions
    own : Backplate, optional
        Plate of the project: its search has the defaults, and a comp needs no other plate.

    Raises
    ------
    ProjectError
        A value is invalid, two flags contradict each other, or a flag of a plate is given without one.
    """
    given = [name for name in _FLAGS if getattr(options, name, None) is not None]
    if plate is None:
        if own is not None and "over" in given:
            given.remove("over")
        if given:
            flag = given[0].replace("_", "-")
            raise ProjectError(f"--{flag} is for a plate, and none is given; add its file, or omit --{flag}")
        return None
    from ...io.images.transfer import TRANSFERS
    from ...plates.settings import PlateSettings, parse_source
    from ...workflow.plates.found_lights import search_values

    if options.threshold is not None and options.stops is not None:
        raise ProjectError("--threshold and --stops both say which pixels are lights; keep one")
    if options.white is not None and options.source is None:
        raise ProjectError("--white is the scale for --source, and no source is given; add it, or omit --white")
    if options.plate_transfer not in (None, *TRANSFERS):
        raise ProjectError(f"--plate-transfer {options.plate_transfer!r} is unknown; choose {', '.join(TRANSFERS)}")
    values = {
        "layer": options.plate_layer, "transfer": options.plate_transfer, "matte": options.flare_matte,
        "threshold": options.threshold, "stops": options.stops, "fade": options.fade, "least_px": options.least_pixels,
        "most_lights": options.most_lights, "point_px": options.point_size, "gain": options.plate_gain,
        "highlights": options.highlights, "white": options.white,
        "source": None if options.source is None else parse_source(options.source),
    }  # fmt: skip
    base = {} if own is None else search_values(own)
    if options.stops is not None:
        base.pop("threshold", None)
    values = {**base, **{key: value for key, value in values.items() if value is not None}}
    return PlateSettings(plate, **{key: value for key, value in values.items() if value is not None})  # type: ignore[arg-type]
