"""`flarewright nuke-script`: a script or a gizmo that composites a flare in Nuke."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...errors import ProjectError
from ..common import check_free, check_place, check_rate, print_json, print_remarks, write_text
from ..shared_options import Force, Json, output_option

EPILOG = (
    "Examples:\n\nflarewright nuke-script 'flare.####.exr' --plate 'plate.####.exr' -o comp.nk\n\n"
    "flarewright nuke-script 'flare.####.exr' --single-ghosts -o flare.gizmo"
)


def nuke_script(
    flare: Annotated[str, typer.Argument(metavar="FILE.exr|flare.####.exr", help="An EXR of render or shot.")],
    output: Annotated[Path, output_option(metavar="OUT.nk|OUT.gizmo", help="The script to write.")],
    plate: Annotated[
        str | None, typer.Option(metavar="FILE|plate.####.exr", help="Picture to which the flare is added.")
    ] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="A-B", help="Frames, such as 1001-1240 (default: those there are).")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Frames per second (default: those of the file, or 24).")
    ] = None,
    gain: Annotated[
        float, typer.Option(metavar="FACTOR", help="Value of the plate for an irradiance of 1 (default: 1).")
    ] = 1.0,
    single_ghosts: Annotated[
        bool, typer.Option("--single-ghosts", help="Grade each single ghost that has a layer.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a Nuke script that reads a flare, grades each pass, and adds it to a plate.

    A name that ends in .gizmo gives a gizmo with inputs for plate and flare, and a knob for each gain.
    """
    check_place(output, (".nk", ".gizmo"))
    check_free(output, force)
    is_gizmo = output.suffix.lower() == ".gizmo"
    if is_gizmo:
        for flag, value in (("--plate", plate), ("--frames", frames), ("--fps", fps)):
            if value is not None:
                raise ProjectError(f"a gizmo has inputs for flare and plate: leave {flag} out, or write a .nk file")
    check_rate(fps)
    from ...jobs.frame_list import parse_frames
    from ...workflow.keyframes import frame_rate
    from ...workflow.nuke_script import nuke_script as script_of

    script = script_of(
        flare, plate=plate, frames=None if frames is None else parse_frames(frames),
        fps=None if fps is None else frame_rate(fps), gain=gain, singles=single_ghosts,
        gizmo=_name(output) if is_gizmo else None,
    )  # fmt: skip
    write_text(output, script.text)
    if as_json:
        first, last = script.frames
        print_json(
            {
                "file": str(output), "passes": script.passes, "first_frame": first, "last_frame": last,
                "remarks": script.remarks,
            }
        )  # fmt: skip
    else:
        print_remarks([*script.remarks, f"{output}: grades {', '.join(script.passes)}", f"wrote {output}"])


def _name(output: Path) -> str:
    plain = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in output.stem)
    return plain if plain[:1].isalpha() else f"Flare_{plain}"
