"""`flarewright film`: make a film of finished frames."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from ..common import check_free, check_rate, one_bar, print_json, print_remarks
from ..progress_lines import print_line
from ..shared_options import Force, Json, output_option
from .preview import check_look

if TYPE_CHECKING:
    from ...workflow.films.assembly import FilmResult

EPILOG = (
    "Examples:\n\nflarewright film flare.####.exr -o flare.mp4\n\n"
    "flarewright film comp.####.exr --fps 23.976 --view filmic --exposure -1 -o comp.mov"
)


def film(
    files: Annotated[str, typer.Argument(metavar="NAME.####.exr", help="Finished frames: EXR, TIFF, PNG or JPEG.")],
    output: Annotated[Path, output_option(metavar="FILM.mp4|FILM.mov", help="H.264, or ProRes 422 HQ.")],
    frames: Annotated[
        str | None, typer.Option(metavar="A-BxS", help="1001-1240, 1001-1240x2 or 1,5,9-12 (default: all files).")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Frames per second (default: as the files state, or 24).")
    ] = None,
    layer: Annotated[str | None, typer.Option(metavar="NAME", help="Layer of EXR files (default: the sum).")] = None,
    view: Annotated[
        str | None, typer.Option(metavar="NAME", help="filmic (default for a flare), srgb, rec709 or aces.")
    ] = None,
    exposure: Annotated[
        float | None,
        typer.Option(metavar="STOPS", help="The same for all frames (default: automatic for a flare, else 0)."),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a film of the finished frames of a shot, all with one exposure.

    For shots that several machines have drawn; `shot --movie` does the same at the end of its work.
    """
    check_rate(fps)
    from ...workflow.films.assembly import assemble_film

    check_film_look(view, exposure)
    check_free(output, force)

    with one_bar("film") as progress:

        def report(frame: int, done: int, of: int) -> None:
            if progress is None:
                film_line(frame, done, of)
            else:
                progress(done / of, f"frame {frame}, {done} of {of}")

        found = assemble_film(
            files, output, frames=frames, fps=fps, layer=layer, view=view,  # type: ignore[arg-type]
            exposure_stops=exposure, report=report,
        )  # fmt: skip
    print_remarks(list(found.remarks))
    if as_json:
        print_json({**film_data(found), "remarks": list(found.remarks)})
    else:
        print_remarks([film_words(found)])


def check_film_look(view: str | None, exposure: float | None) -> None:
    """Raise ProjectError for a view or an exposure that a film cannot have."""
    from ...workflow.films.look import FilmView

    check_look(view, exposure, get_args(FilmView))


def film_line(frame: int, done: int, of: int) -> None:
    """Print the progress of a film as a line of JSON."""
    print_line({"frame": frame, "state": "encoded", "done": done, "of": of})


def film_data(film: FilmResult) -> dict[str, Any]:
    """Return what is known about a film as JSON data."""
    return {
        "film": film.file, "frames": len(film.frames), "fps": str(film.fps), "size_px": list(film.size_px),
        "codec": film.codec, "view": film.view, "exposure_stops": film.exposure_stops,
    }  # fmt: skip


def film_words(film: FilmResult) -> str:
    """Return a sentence about a film."""
    from ...sentences import count

    width, height = film.size_px
    return (
        f"wrote {film.file}: {count(len(film.frames), 'frame')} of {width}x{height}, {float(film.fps):.6g} a second, "
        f"{film.codec}; {film.view}"
    )
