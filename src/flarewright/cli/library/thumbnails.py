"""`flarewright library thumbnails`: render the missing thumbnails of the user's library."""

from __future__ import annotations

from typing import Annotated

import typer

from ..common import one_bar, print_remarks

EPILOG = "The editor does this in the background when its panel Library is open."


def thumbnails(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME...]", help="Lenses of your library (default: all).")
    ] = None,
) -> None:
    """Render the missing thumbnails of your library as drafts; an interrupted command resumes."""
    from ...workflow.own_library.own_lenses import find_own
    from ...workflow.own_library.thumbnails import make_thumbnails

    with one_bar("thumbnails") as bar:
        made, failed = make_thumbnails(bar, [find_own(name)[0] for name in names] if names else None)
    print_remarks([f"no thumbnail of {name}: {reason}" for name, reason in failed])
    print_remarks([f"{made} rendered"])
