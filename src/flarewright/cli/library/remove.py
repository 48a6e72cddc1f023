"""`flarewright library remove`: remove lenses from the user's library."""

from __future__ import annotations

from typing import Annotated

import typer

from ..common import print_remark, print_remarks

EPILOG = "The files that were added stay where they are: flarewright library add adds them again."


def remove(names: Annotated[list[str], typer.Argument(metavar="NAME...", help="Lenses of your library.")]) -> None:
    """Remove lenses from your library."""
    from ...workflow.own_library.own_lenses import find_own, remove_lens

    # a name that is wrong is reported before anything is removed
    found = list(dict.fromkeys(find_own(name)[0] for name in names))
    for name in found:
        remove_lens(name, print_remark)
        print_remarks([f"removed {name}"])
