"""`flarewright library thumbnails`: render the missing thumbnails of the user's library."""

from __future__ import annotations

from typing import Annotated

import typer

from ..common import one_bar, print_remarks

EPILOG = "The editor does this in the background when its panel Library is open."


def thumbnails(
    most: Annotated[int | None, typer.Option(metavar="N", min=1, help="Render at most N (default: all).")] = None,
) -> None:
    """Render the missing thumbnails of your library as drafts; an interrupted command resumes."""
    from ...workflow.own_thumbnails import make_thumbnails

    with one_bar("thumbnails") as bar:
        made, failed = make_thumbnails(bar, most)
    print_remarks([f"no thumbnail of {name}: {reason}" for name, reason in failed])
    print_remarks([f"{made} rendered"])
