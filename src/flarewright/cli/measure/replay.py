"""`flarewright measure replay`: a measured flare at any constellation and roll."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ...errors import FlarewrightError
from ..common import check_place, picture_size, print_json, print_remarks
from ..shared_options import Json, output_option

if TYPE_CHECKING:
    from ...model.measurement.replay_camera import ReplayCamera

EPILOG = "Example:\n\nflarewright measure replay model.json --constellation 12.3 --roll 30 -o flare.exr"


def replay(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A ghost model of `measure run`.")],
    output: Annotated[Path, output_option(metavar="OUT.exr", help="The picture to write.")],
    constellation: Annotated[float | None, typer.Option(help="Degrees between the optical axis and the light.")] = None,
    roll: Annotated[
        float | None, typer.Option(help="Direction of the light, degrees counterclockwise from the right (0).")
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="JSON: camera and light in space, f-number, ISO, exposure (docs/ghost-model.md)."
        ),
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Picture in pixels (default: that of the captures).")
    ] = (None),
    single: Annotated[bool, typer.Option("--ghosts", help="Also write a layer for each ghost.")] = False,
    rec709: Annotated[
        bool,
        typer.Option("--rec709", help="Convert to linear Rec.709 by the camera's matrix (default: camera colours)."),
    ] = False,
    full: Annotated[bool, typer.Option("--float", help="Write 32 bits per value, unscaled irradiances.")] = False,
    as_json: Json = False,
) -> None:
    """Render a measured flare as layers of an EXR file."""
    check_place(output, ".exr")
    from ...io.images.exr import write_exr
    from ...io.images.file_space import FileSpace
    from ...io.images.half import half_scale
    from ...io.measurement.ghost_model_file import read_ghost_model, read_replay_camera
    from ...measure.core.measured_side import measured_side
    from ...measure.replay.model_image import replay_model as draw
    from ...measure.replay.placement import brightness_gain
    from ...model.measurement.replay_camera import ReplayCamera
    from ...sentences import count

    known = read_ghost_model(model)
    shot = ReplayCamera() if camera is None else read_replay_camera(camera)
    angle, turn = _place(shot, constellation, roll)
    if shot.light is not None:
        # a camera file does not choose the side
        angle, turn = measured_side(known, angle, turn)
    pixels = picture_size(size) if size is not None else shot.size_px or known.size_px
    gain = brightness_gain(known.reference, shot)
    layers = draw(known, angle, roll_deg=turn, size_px=pixels, gain=gain, single=single,
                  colors="rec709" if rec709 else "camera")  # fmt: skip
    metadata = {"model": model.name, "constellation_deg": f"{angle:.9g}", "roll_deg": f"{turn:.9g}"}
    # the gain stands for the light's strength, as the intensity does in `render`
    scale = 1.0 if full else half_scale(gain)
    kind: Literal["half", "float"] = "float" if full else "half"
    # other programs would take a camera's own colours for Rec.709
    space: Literal["rec709"] | FileSpace = "rec709" if rec709 else FileSpace("camera", "")
    print_remarks(write_exr(output, layers, pixels, pixel_type=kind, scale=scale, metadata=metadata, colorspace=space))
    facts = {
        "output": str(output), "constellation_deg": angle, "roll_deg": turn, "brightness": gain,
        "size_px": list(pixels), "layers": [layer.name for layer in layers], "scale": scale,
    }  # fmt: skip
    if as_json:
        print_json(facts)
    else:
        place = f"{angle:.4g} degrees, roll {turn:.4g}"
        print(f"{output}: {count(len(layers), 'layer')}, {place}, brightness {gain:.4g}")


def _place(camera: ReplayCamera, constellation_deg: float | None, roll_deg: float | None) -> tuple[float, float]:
    """Return constellation and roll of the light, degrees: those of the camera file, or as given."""
    from ...measure.replay.placement import constellation_of_light

    if camera.light is not None:
        if constellation_deg is not None or roll_deg is not None:
            raise FlarewrightError("the camera file places the light; omit --constellation and --roll")
        constellation_deg, roll_deg = constellation_of_light(camera.position, camera.forward, camera.up, camera.light)
    elif constellation_deg is None:
        raise FlarewrightError("no place of the light; give --constellation DEG, or a --camera file with a light")
    return constellation_deg, roll_deg or 0.0
