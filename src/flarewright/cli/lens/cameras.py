"""`flarewright cameras`: the cameras that `--sensor` knows."""

from __future__ import annotations

from ..common import console, print_json
from ..shared_options import Json

EPILOG = (
    "Examples:\n\n"
    "flarewright render heliar-tronnier --light 4,2 --sensor arri-alexa-35 --size 1152x791 -o flare.exr\n\n"
    "flarewright render heliar-tronnier --light 4,2 --sensor super-16 --size 1280x720 -o flare.exr"
)


def cameras(as_json: Json = False) -> None:
    """List the cameras of --sensor with their active area, their pixels and the source of both."""
    from ...io.project.camera_list import camera_formats

    known = camera_formats()
    if as_json:
        print_json({"cameras": [camera.model_dump(mode="json") for camera in known]})
        return
    from rich.table import Table

    out = Table(caption="Area: width and height in mm. Pixels: recorded; film has none.")
    out.add_column("name", no_wrap=True)
    out.add_column("camera")
    for column in ("area mm", "pixels"):
        out.add_column(column, justify="right", no_wrap=True)
    out.add_column("source")
    for camera in known:
        (width, height), size = camera.sensor_mm, camera.size_px
        pixels = "-" if size is None else f"{size[0]}x{size[1]}"
        out.add_row(camera.name, camera.title, f"{width:.2f}x{height:.2f}", pixels, camera.source)
    console().print(out)
