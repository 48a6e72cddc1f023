"""The PNG preview of a render: its flags, its exposure, its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from ...errors import ProjectError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ...model import Project
    from ...render.render import Rendering
    from .options.record import RenderOptions

WHITE_CODE, BLACK_CODE = 250, 2
"""Codes of 255 that look white and black."""
MOSTLY = 0.5
"""Part of a preview that is white when its exposure is a mistake."""


@dataclass(frozen=True)
class PreviewLook:
    """Display settings of the PNG.

    Attributes
    ----------
    transform : {"filmic", "srgb", "aces"}
    stops : float or None
        Exposure; None: automatic, or that of a camera.
    ev, shutter_s : float or None
        Of a camera.
    iso, lux : float
    """

    transform: Any
    stops: float | None
    ev: float | None
    shutter_s: float | None
    iso: float
    lux: float


def preview_look(options: RenderOptions) -> PreviewLook | None:
    """Parse the flags of the PNG; None with --no-png.

    Raises
    ------
    ProjectError
        For flags that are unknown, contradict each other or are out of range.
    """
    from ...render.image.display import Transform
    from ...render.image.photographic_exposure import SUN_LUX

    view, exposure, ev, iso, lux = options.view, options.exposure, options.ev, options.iso, options.lux
    shutter = options.shutter
    given = {"--exposure": exposure, "--ev": ev, "--shutter": shutter, "--iso": iso, "--lux": lux, "--view": view}
    flags = [flag for flag, value in given.items() if value is not None]
    if options.no_png:
        if flags:
            raise ProjectError(f"{flags[0]} is for the PNG and --no-png omits it; keep one")
        return None
    check_look(view, exposure, get_args(Transform))
    ways = [flag for flag in ("--exposure", "--ev", "--shutter") if flag in flags]
    if len(ways) > 1:
        raise ProjectError(f"{' and '.join(ways)} each set the exposure of the PNG; keep one")
    if ways in ([], ["--exposure"]) and (iso is not None or lux is not None):
        raise ProjectError(f"{'--iso' if iso is not None else '--lux'} needs --ev or --shutter beside it")
    if ev is not None and not -30.0 <= ev <= 40.0:
        raise ProjectError(f"--ev {ev:g} is out of range; choose between -30 and 40")
    if iso is not None and not 1.0 <= iso <= 1e7:
        raise ProjectError(f"--iso {iso:g} is out of range; choose between 1 and 10 000 000")
    return PreviewLook(
        transform=view or "filmic", stops=exposure, ev=ev,
        shutter_s=None if shutter is None else _number("--shutter", shutter, "1/250 or 0.004", 1e-6, 1e5),
        iso=iso or 100.0,
        lux=SUN_LUX if lux is None or lux == "sun" else _number("--lux", lux, "20000 or sun", 1e-6, 1e9),
    )  # fmt: skip


def check_look(view: str | None, exposure: float | None, known: Sequence[str]) -> None:
    """Raise ProjectError for a view that does not exist or needs a package, and for an exposure out of range.

    Parameters
    ----------
    view : str or None
        Of `--view`.
    exposure : float or None
        Of `--exposure`, stops.
    known : sequence of str
        Views.
    """
    if view is not None and view not in known:
        raise ProjectError(f"--view {view!r} is unknown; choose {', '.join(known)}")
    if view == "aces":
        from ...render.image.aces_view import aces_available

        if not aces_available():
            raise ProjectError("--view aces needs opencolorio: pip install 'flarewright[color]', or choose filmic")
    if exposure is not None and not -100.0 <= exposure <= 100.0:
        raise ProjectError(f"--exposure {exposure:g} is out of range; choose between -100 and 100 stops")


def check_exposure(look: PreviewLook | None, project: Project) -> None:
    """Raise an error for `--ev` with a measured flare of unknown f-number, before rendering.

    Raises
    ------
    FlarewrightError
        In that case, or when the file is no ghost model.
    """
    from ...io.files.file_kind import is_ghost_model_file

    if look is None or look.ev is None or not is_ghost_model_file(project.lens):
        return
    from ...measure.replay.measured_project import flare_of, opening_of

    if opening_of(project, flare_of(project).model) is None:
        raise ProjectError(
            f"--ev needs an f-number, but that of the captures of {project.lens} is unknown; give --shutter instead"
        )


def _number(flag: str, text: str, example: str, low: float, high: float) -> float:
    """Parse a number or a fraction."""
    above, _, below = text.partition("/")
    try:
        value = float(above) / (float(below) if below else 1.0)
    except (ValueError, ZeroDivisionError):
        value = float("nan")
    if not low <= value <= high:
        raise ProjectError(f"{flag} {text!r} is not between {low:g} and {high:g}; write it like {example}")
    return value


def write_preview(rendering: Rendering, path: Path, look: PreviewLook) -> tuple[dict[str, Any], list[str]]:
    """Write the PNG of a render; return its entries in the summary, and remarks."""
    from ... import __version__
    from ...io.images.png import write_png
    from ...render.image.display import layers_exposure, view, view_text
    from ...render.image.photographic_exposure import photographic_stops

    layers, colorspace = rendering.layers, rendering.project.output.colorspace
    automatic = look.stops is None and look.ev is None and look.shutter_s is None
    if automatic:
        stops = layers_exposure(layers, colorspace)
    elif look.stops is not None:
        stops = look.stops
    else:
        # with a shutter no f-number is needed; `check_exposure` rejects an exposure value without one
        f_number = rendering.summary["f_number"] or 1.0
        stops = photographic_stops(f_number, ev=look.ev, shutter_s=look.shutter_s, iso=look.iso, lux=look.lux)
    stated = view_text(stops, look.transform, colorspace, automatic=automatic)
    pixels = view(layers[0].pixels, stops, look.transform, colorspace)
    write_png(path, pixels, {"Software": f"Flarewright {__version__}", "Description": stated})
    return {"preview": str(path), "view": stated, "exposure_stops": stops}, _misses(pixels, automatic=automatic)


def _misses(pixels: NDArray[np.uint8], *, automatic: bool) -> list[str]:
    """Return a remark on an exposure at which most of a picture is white, or all of it is black."""
    if automatic:
        return []
    remedy = "the EXR holds all light; leave the exposure out for an automatic one"
    white = float((pixels.min(axis=-1) >= WHITE_CODE).mean())
    if white > MOSTLY:
        return [f"{100.0 * white:.0f} % of the preview is white: {remedy}"]
    return [f"the preview is black at this exposure: {remedy}"] if pixels.max() <= BLACK_CODE else []
